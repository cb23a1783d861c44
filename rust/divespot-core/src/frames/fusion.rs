//! Frames whose poses are known, added up in voxels: in integers, so that they merge in any order.

use std::collections::HashMap;
use std::hash::{BuildHasherDefault, Hasher};

use crate::Point;
use crate::error::positive;
use crate::parallel::map_chunks;
use crate::sample::mix;
use crate::{Result, thread_count};

use super::camera::Camera;
use super::motion::Motion;
use super::noise::ByRange;
use super::noise::Noise;

/// What the pixels in one voxel add up to.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
struct Sums {
    weight: u64,
    /// Weighted places in the voxel, in parts of its edge.
    inside: [u64; 3],
    /// Weighted squares of the heights in it.
    square: u64,
    pixels: u32,
    frames: u32,
}

/// Parts of an edge.
const PARTS: f64 = 65_536.0;
/// Weight of a pixel whose noise is that of reference.
const WEIGHT: f64 = 16.0;
/// Voxels along an axis to either side of the origin.
const SPAN: i64 = 1 << 20;
/// Pixels that a thread takes at a time.
const CHUNK: usize = 1 << 13;
/// Two voxels of a column nearer than this part of an edge hold one surface.
const ONE: f64 = 0.7;

/// Hashes of keys that are numbers.
#[derive(Default)]
struct Mixed(u64);

impl Hasher for Mixed {
    fn finish(&self) -> u64 {
        self.0
    }

    fn write(&mut self, bytes: &[u8]) {
        bytes.iter().for_each(|&byte| self.0 = mix(self.0 ^ u64::from(byte)));
    }

    fn write_u64(&mut self, key: u64) {
        self.0 = mix(key);
    }
}

/// Voxels and what they hold.
///
/// # Examples
///
/// ```
/// use divespot_core::frames::{Camera, Fusion, Motion, Noise};
///
/// let rays: Vec<[f64; 3]> = (0..9).map(|i| [0.01 * f64::from(i), 0.0, 1.0]).collect();
/// let camera = Camera::new(3, 3, &rays)?;
/// let mut fusion = Fusion::new(0.05, &Noise::default(), 1.0)?;
/// fusion.add(&camera, &[1.0; 9], &[true; 9], &Motion::default(), 0.0, 1);
/// assert_eq!(fusion.points().counts.iter().sum::<u32>(), 9);
/// # Ok::<(), divespot_core::Error>(())
/// ```
pub struct Fusion {
    voxel_m: f64,
    noise: ByRange,
    reference_m: f64,
    voxels: HashMap<u64, Sums, BuildHasherDefault<Mixed>>,
}

/// The points of a fusion, by z of their columns' voxels.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Fused {
    /// Weighted mean of the pixels of each voxel.
    pub points: Vec<Point>,
    /// Pixels of each.
    pub counts: Vec<u32>,
    /// Frames that saw it.
    pub frames: Vec<u32>,
    /// Standard deviation of their heights.
    pub spreads_m: Vec<f64>,
}

/// A pixel in its voxel.
struct Item {
    key: u64,
    inside: [u32; 3],
    weight: u32,
}

impl Fusion {
    /// No frames yet; pixels weigh by their noise against that at `range_m`.
    ///
    /// # Errors
    ///
    /// [`crate::Error::Setting`] unless `voxel_m` is finite and above 0.
    pub fn new(voxel_m: f64, noise: &Noise, range_m: f64) -> Result<Self> {
        positive("voxel_m", voxel_m)?;
        let (noise, reference_m) = (ByRange::new(noise), noise.sigma_m(range_m, 1.0));
        Ok(Self { voxel_m, noise, reference_m, voxels: HashMap::default() })
    }

    /// Adds the usable pixels of a frame; `offset_m` is added to its ranges.
    pub fn add(
        &mut self,
        camera: &Camera,
        ranges_m: &[f64],
        usable: &[bool],
        pose: &Motion,
        offset_m: f64,
        threads: usize,
    ) {
        let items = map_chunks(ranges_m.len(), CHUNK, thread_count(threads), |pixels| {
            let usable = pixels.filter(|&i| usable[i]);
            let place = |i: usize| pose.apply(&(camera.rays[i] * (ranges_m[i] + offset_m)));
            usable.filter_map(|i| self.item(place(i).into(), ranges_m[i])).collect::<Vec<_>>()
        });
        let mut touched = Vec::new();
        // Neighbours in a row lie in one voxel, mostly: it is looked up once.
        for run in items.iter().flat_map(|piece| piece.chunk_by(|a, b| a.key == b.key)) {
            let sums = self.voxels.entry(run[0].key).or_default();
            if sums.pixels & FRESH == 0 {
                sums.pixels |= FRESH;
                sums.frames += 1;
                touched.push(run[0].key);
            }
            run.iter().for_each(|item| sums.take(item));
        }
        for key in touched {
            if let Some(sums) = self.voxels.get_mut(&key) {
                sums.pixels &= !FRESH;
            }
        }
    }

    /// Adds what another fusion of the same voxels holds, of other frames.
    pub fn merge(&mut self, other: &Self) {
        for (&key, theirs) in &other.voxels {
            let sums = self.voxels.entry(key).or_default();
            sums.weight += theirs.weight;
            (0..3).for_each(|k| sums.inside[k] += theirs.inside[k]);
            sums.square += theirs.square;
            sums.pixels += theirs.pixels;
            sums.frames += theirs.frames;
        }
    }

    fn item(&self, at: Point, range_m: f64) -> Option<Item> {
        let steps = at.map(|v| v / self.voxel_m);
        let cell = steps.map(f64::floor);
        let numbers = cell.map(|v| v as i64 + SPAN);
        if numbers.iter().any(|n| !(0..2 * SPAN).contains(n)) {
            return None;
        }
        let [x, y, z] = numbers.map(|n| n as u64);
        let ratio = self.reference_m / self.noise.sigma_m(range_m);
        let weight = (WEIGHT * ratio * ratio).round().clamp(1.0, 255.0) as u32;
        let inside = std::array::from_fn(|k| ((steps[k] - cell[k]) * PARTS) as u32);
        Some(Item { key: x << 42 | y << 21 | z, inside, weight })
    }

    /// The points: of each column the voxels, those put together that a face parts.
    #[must_use]
    pub fn points(&self) -> Fused {
        let mut keys: Vec<u64> = self.voxels.keys().copied().collect();
        keys.sort_unstable();
        let mut fused = Fused::default();
        let mut held: Option<(u64, Held)> = None;
        for key in keys {
            let own = Held::of(key, &self.voxels[&key], self.voxel_m);
            held = match held {
                Some((before, one)) if before + 1 == key && own.is_one_with(&one, self.voxel_m) => {
                    Some((key, one.with(&own)))
                }
                Some((_, one)) => {
                    fused.push(&one);
                    Some((key, own))
                }
                None => Some((key, own)),
            };
        }
        if let Some((_, one)) = held {
            fused.push(&one);
        }
        fused
    }
}

/// Marks a voxel that this frame has seen already.
const FRESH: u32 = 1 << 31;

impl Sums {
    #[inline]
    fn take(&mut self, item: &Item) {
        let weight = u64::from(item.weight);
        self.weight += weight;
        (0..3).for_each(|k| self.inside[k] += weight * u64::from(item.inside[k]));
        let height = u64::from(item.inside[2] >> 4);
        self.square += weight * height * height;
        self.pixels += 1;
    }
}

/// The mean of a voxel, or of several.
struct Held {
    at: Point,
    /// Mean square of the heights.
    square_m2: f64,
    weight: f64,
    pixels: u32,
    frames: u32,
}

impl Held {
    fn of(key: u64, sums: &Sums, voxel_m: f64) -> Self {
        let cell = [key >> 42, key >> 21, key].map(|k| (k & ((1 << 21) - 1)) as i64 - SPAN);
        let weight = sums.weight as f64;
        let part = |k: usize| sums.inside[k] as f64 / weight / PARTS;
        let at = std::array::from_fn(|k| (cell[k] as f64 + part(k)) * voxel_m);
        let square = sums.square as f64 / weight * 256.0 / PARTS / PARTS - part(2) * part(2);
        let square_m2 = if square > 0.0 { square * voxel_m * voxel_m } else { 0.0 } + at[2] * at[2];
        Self { at, square_m2, weight, pixels: sums.pixels, frames: sums.frames }
    }

    fn is_one_with(&self, other: &Self, voxel_m: f64) -> bool {
        self.at[2] - other.at[2] < ONE * voxel_m
    }

    fn with(&self, other: &Self) -> Self {
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
}

impl Fused {
    fn push(&mut self, one: &Held) {
        self.points.push(one.at);
        self.counts.push(one.pixels);
        self.frames.push(one.frames);
        let variance = one.square_m2 - one.at[2] * one.at[2];
        self.spreads_m.push(if variance > 0.0 { variance.sqrt() } else { 0.0 });
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frames::motion::turn;
    use crate::frames::noise::tests::{camera, normal, plane};
    use nalgebra::Vector3;

    fn down(x: f64) -> Motion {
        let rotation = turn(&Vector3::new(std::f64::consts::PI, 0.0, 0.0));
        Motion { rotation, shift: Vector3::new(x, 0.0, 1.4) }
    }

    fn frames(camera: &Camera) -> Vec<(Vec<f64>, Motion)> {
        (0..4_u64)
            .map(|f| {
                let mut ranges = plane(camera, [0.0, 0.0, 1.0], 1.4);
                let noise = |i: usize| 0.002 * normal(f << 32 | i as u64);
                ranges.iter_mut().enumerate().for_each(|(i, r)| *r += noise(i));
                (ranges, down(0.1 * f as f64))
            })
            .collect()
    }

    #[test]
    fn frames_merge_in_any_order_to_the_same_bits() {
        let camera = camera(60, 80);
        let frames = frames(&camera);
        let all = vec![true; camera.pixels()];
        let fused = |order: &[usize], threads: usize| {
            let mut fusion = Fusion::new(0.02, &Noise::default(), 1.4).unwrap();
            order.iter().for_each(|&i| {
                fusion.add(&camera, &frames[i].0, &all, &frames[i].1, 0.001, threads);
            });
            fusion
        };
        let expected = fused(&[0, 1, 2, 3], 1).points();
        assert_eq!(expected, fused(&[3, 1, 0, 2], 3).points());
        let mut merged = fused(&[2, 0], 2);
        merged.merge(&fused(&[3, 1], 1));
        assert_eq!(expected, merged.points());
        assert_eq!(expected.counts.iter().sum::<u32>() as usize, 4 * camera.pixels());
        assert!(expected.frames.iter().any(|&n| n > 2) && expected.frames.iter().all(|&n| n < 5));
    }

    #[test]
    fn a_floor_on_the_face_between_voxels_is_one_layer_at_its_height() {
        let camera = camera(60, 80);
        let mut fusion = Fusion::new(0.06, &Noise::default(), 1.4).unwrap();
        let all = vec![true; camera.pixels()];
        for (ranges, pose) in frames(&camera) {
            fusion.add(&camera, &ranges, &all, &pose, 0.0, 1);
        }
        let fused = fusion.points();
        let thick = fused.counts.iter().zip(&fused.points).filter(|(n, _)| **n > 8);
        assert!(thick.clone().count() > 200);
        let worst = thick.clone().map(|(_, p)| p[2].abs()).fold(0.0, f64::max);
        assert!(worst < 0.003, "{worst}");
        let mean = thick.clone().map(|(_, p)| p[2]).sum::<f64>() / thick.count() as f64;
        assert!(mean.abs() < 2e-4);
    }

    #[test]
    fn what_has_no_voxel_is_refused() {
        assert!(Fusion::new(0.0, &Noise::default(), 1.0).is_err());
    }
}
