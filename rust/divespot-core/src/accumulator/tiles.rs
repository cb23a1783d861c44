//! Voxels stored in tiles, so that memory grows with the number of occupied voxels.

use std::collections::HashMap;
use std::hash::{BuildHasherDefault, Hash, Hasher};

use crate::hashing::Mixed;

use super::sums::{NOTHING, Sums};

/// A tile is a cube of 2³ voxels along each edge.
const EDGE_BITS: u32 = 3;
/// Voxels in a tile.
const VOXELS: usize = 1 << (3 * EDGE_BITS);
/// A block is a cube of 2⁴ tiles an edge.
const BLOCK_BITS: u32 = 4;
/// Tiles along an axis below the origin.
const BELOW: u32 = 1 << 31;
/// No sums yet.
const NONE: u16 = u16::MAX;

/// The place of a tile among all tiles.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct At(pub(super) [u32; 3]);

impl At {
    /// The place of one of the tile's voxels among all voxels.
    pub(super) fn voxel(self, number: u16) -> [u64; 3] {
        let axis = |k: u32| u64::from(number) >> (k * EDGE_BITS) & ((1 << EDGE_BITS) - 1);
        let [x, y, z] = self.0.map(|at| u64::from(at) << EDGE_BITS);
        [x + axis(0), y + axis(1), z + axis(2)]
    }

    /// Where the block of the tile there lies from the origin.
    pub(super) fn block(self) -> [i32; 3] {
        self.0.map(|at| at.wrapping_sub(BELOW).cast_signed() >> BLOCK_BITS)
    }
}

impl Hash for At {
    fn hash<H: Hasher>(&self, state: &mut H) {
        let [x, y, z] = self.0.map(u64::from);
        state.write_u64(x << 32 | y);
        state.write_u64(z);
    }
}

/// The voxels of a tile, by a number of 9 bits: z, y, x.
#[derive(Debug, Clone)]
pub(super) struct Tile {
    pub(super) at: At,
    index: Box<[u16; VOXELS]>,
    sums: Vec<Sums>,
}

impl Tile {
    /// The sums of each occupied voxel, in the order of their numbers.
    pub(super) fn voxels(&self) -> impl Iterator<Item = (u16, &Sums)> {
        let held = self.index.iter().zip(0..).filter(|(row, _)| **row != NONE);
        held.map(|(&row, voxel)| (voxel, &self.sums[row as usize]))
    }

    /// Number of occupied voxels.
    pub(super) fn len(&self) -> usize {
        self.sums.len()
    }

    /// The place of one of the tile's voxels among all voxels.
    pub(super) fn voxel(&self, number: u16) -> [u64; 3] {
        self.at.voxel(number)
    }
}

/// All tiles with occupied voxels.
#[derive(Debug, Clone, Default)]
pub(super) struct Tiles {
    rows: HashMap<At, u32, BuildHasherDefault<Mixed>>,
    tiles: Vec<Tile>,
    last: Option<(At, usize)>,
    pub(super) occupied: usize,
}

impl Tiles {
    /// The sums of a voxel; creates it if it is empty.
    #[inline]
    pub(super) fn sums(&mut self, voxel: [u64; 3]) -> &mut Sums {
        let at = At(voxel.map(|v| (v >> EDGE_BITS) as u32));
        let inside = voxel.map(|v| (v & ((1 << EDGE_BITS) - 1)) as usize);
        let number = (inside[2] << EDGE_BITS | inside[1]) << EDGE_BITS | inside[0];
        let row = match self.last {
            Some((last, row)) if last == at => row,
            _ => self.row(at),
        };
        let tile = &mut self.tiles[row];
        if tile.index[number] == NONE {
            tile.index[number] = tile.sums.len() as u16;
            tile.sums.push(NOTHING);
            self.occupied += 1;
        }
        &mut tile.sums[tile.index[number] as usize]
    }

    fn row(&mut self, at: At) -> usize {
        let tiles = &mut self.tiles;
        let row = *self.rows.entry(at).or_insert_with(|| {
            tiles.push(Tile { at, index: Box::new([NONE; VOXELS]), sums: Vec::new() });
            (tiles.len() - 1) as u32
        }) as usize;
        self.last = Some((at, row));
        row
    }

    /// The tiles in the order of their places: x, y, z.
    pub(super) fn sorted(&self) -> Vec<&Tile> {
        let mut sorted: Vec<&Tile> = self.tiles.iter().collect();
        sorted.sort_unstable_by_key(|tile| tile.at);
        sorted
    }

    pub(super) fn into_tiles(self) -> Vec<Tile> {
        self.tiles
    }

    pub(super) fn tiles(&self) -> &[Tile] {
        &self.tiles
    }
}
