//! Integer sums of pixels in voxels, and the points made of them.

use crate::Point;
use crate::accumulator::ONE;

use super::keys::{Cells, cell, number};

/// Integer units along a voxel's edge.
pub(crate) const PARTS: f64 = 65_536.0;
/// Voxels along the edge of a brick, in which neighbours are looked up together.
const EDGE: i64 = 4;
/// Voxels in a brick.
const VOXELS: usize = 64;

/// A pixel in its voxel.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Item {
    pub(crate) brick: u64,
    /// The voxel within the brick.
    pub(crate) voxel: u8,
    pub(crate) weight: u8,
    pub(crate) inside: [u16; 3],
}

impl Item {
    /// The brick of a voxel, and the voxel's number within it.
    #[inline]
    pub(crate) fn home(at: [i64; 3]) -> Option<(u64, u8)> {
        let [x, y, z] = at.map(|v| v & (EDGE - 1));
        let brick = number(at.map(|v| v >> 2))?;
        Some((brick, (x << 4 | y << 2 | z) as u8))
    }
}

/// The sums of one voxel's pixels.
#[derive(Debug, Clone, Copy, Default)]
struct PixelSums {
    weight: u64,
    /// Weighted places in the voxel, in integer units.
    inside: [u64; 3],
    /// Weighted squares of the heights in it.
    square: u64,
    pixels: u32,
    frames: u32,
    /// The last frame that was added, from 1.
    last: u32,
}

impl PixelSums {
    #[inline]
    fn take(&mut self, item: &Item) {
        let weight = u64::from(item.weight);
        self.weight += weight;
        (0..3).for_each(|k| self.inside[k] += weight * u64::from(item.inside[k]));
        let height = u64::from(item.inside[2] >> 4);
        self.square += weight * height * height;
        self.pixels += 1;
    }

    fn merge(&mut self, other: &Self) {
        self.weight += other.weight;
        (0..3).for_each(|k| self.inside[k] += other.inside[k]);
        self.square += other.square;
        self.pixels += other.pixels;
        self.frames += other.frames;
    }
}

/// Voxels, grouped by brick, in the order in which they were first seen.
#[derive(Debug, Default)]
pub(crate) struct Voxels {
    bricks: Cells<u32>,
    /// For each brick the indices of its voxels' sums, from 1; 0 for empty voxels.
    places: Vec<[u32; VOXELS]>,
    sums: Vec<PixelSums>,
}

impl Voxels {
    /// Adds pixels of a frame, whose number is above 0; consecutive ones are mostly in one brick.
    pub(crate) fn add(&mut self, items: &[Item], frame: u32) {
        for run in items.chunk_by(|a, b| a.brick == b.brick) {
            let brick = self.brick(run[0].brick);
            for item in run {
                let sums = self.sums(brick, item.voxel);
                sums.frames += u32::from(sums.last != frame);
                sums.last = frame;
                sums.take(item);
            }
        }
    }

    pub(crate) fn merge(&mut self, other: &Self) {
        for (&key, &theirs) in &other.bricks {
            let brick = self.brick(key);
            for voxel in 0..VOXELS as u8 {
                let place = other.places[theirs as usize][usize::from(voxel)];
                if place > 0 {
                    self.sums(brick, voxel).merge(&other.sums[place as usize - 1]);
                }
            }
        }
    }

    #[inline]
    fn brick(&mut self, key: u64) -> usize {
        let places = &mut self.places;
        let add = || {
            places.push([0; VOXELS]);
            places.len() as u32 - 1
        };
        *self.bricks.entry(key).or_insert_with(add) as usize
    }

    #[inline]
    fn sums(&mut self, brick: usize, voxel: u8) -> &mut PixelSums {
        let place = &mut self.places[brick][usize::from(voxel)];
        if *place == 0 {
            self.sums.push(PixelSums::default());
            *place = self.sums.len() as u32;
        }
        &mut self.sums[*place as usize - 1]
    }

    /// The keys of all voxels, and their means.
    pub(crate) fn held(&self, voxel_m: f64) -> Vec<(u64, Held)> {
        let mut found = Vec::with_capacity(self.sums.len());
        for (&key, &brick) in &self.bricks {
            let low = cell(key).map(|v| v * EDGE);
            let places = self.places[brick as usize].iter().enumerate();
            for (voxel, &place) in places.filter(|(_, place)| **place > 0) {
                let [x, y, z] = [voxel >> 4, voxel >> 2 & 3, voxel & 3].map(|v| v as i64);
                let at = [low[0] + x, low[1] + y, low[2] + z];
                let held = Held::of(at, &self.sums[place as usize - 1], voxel_m);
                found.extend(number(at).map(|number| (number, held)));
            }
        }
        found
    }

    pub(crate) fn bytes(&self) -> usize {
        self.bricks.capacity() * (size_of::<(u64, u32)>() + 1)
            + self.places.capacity() * size_of::<[u32; VOXELS]>()
            + self.sums.capacity() * size_of::<PixelSums>()
    }
}

/// The mean of one or several voxels.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Held {
    pub(crate) at: Point,
    /// Mean square of the heights, in m².
    square_m2: f64,
    weight: f64,
    pub(crate) pixels: u32,
    pub(crate) frames: u32,
}

impl Held {
    fn of(cell: [i64; 3], sums: &PixelSums, voxel_m: f64) -> Self {
        let weight = sums.weight as f64;
        let part = |k: usize| sums.inside[k] as f64 / weight / PARTS;
        let at = std::array::from_fn(|k| (cell[k] as f64 + part(k)) * voxel_m);
        let square = sums.square as f64 / weight * 256.0 / PARTS / PARTS - part(2) * part(2);
        let square_m2 = if square > 0.0 { square * voxel_m * voxel_m } else { 0.0 } + at[2] * at[2];
        Self { at, square_m2, weight, pixels: sums.pixels, frames: sums.frames }
    }

    pub(crate) fn is_one_with(&self, below: &Self, voxel_m: f64) -> bool {
        self.at[2] - below.at[2] < ONE * voxel_m
    }

    pub(crate) fn with(&self, other: &Self) -> Self {
        let weight = self.weight + other.weight;
        let share = other.weight / weight;
        let mean = |a: f64, b: f64| a + (b - a) * share;
        Self {
            at: std::array::from_fn(|k| mean(self.at[k], other.at[k])),
            square_m2: mean(self.square_m2, other.square_m2),
            weight,
            pixels: self.pixels + other.pixels,
            frames: self.frames.max(other.frames),
        }
    }

    /// Standard deviation of the heights, in m.
    pub(crate) fn spread_m(&self) -> f64 {
        let variance = self.square_m2 - self.at[2] * self.at[2];
        if variance > 0.0 { variance.sqrt() } else { 0.0 }
    }
}
