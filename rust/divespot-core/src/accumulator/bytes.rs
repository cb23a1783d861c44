//! Serialises an accumulator: the same voxels give the same bytes.
//!
//! Little endian. A header of 80 bytes: `dvspacc` and a version; origin and width (m) as f64; level
//! and number of tiles as u32; most, not finite, zero and number of voxels as u64. For each tile,
//! by place: x, y, z and its number of voxels as u32. For each voxel: its number and the bounds of
//! its heights as u16, its number of points as u32, their sums as u64.

use crate::{Error, Result};

use super::accumulate::{Accumulator, HIGHEST};
use super::lattice::Lattice;
use super::sums::Sums;
use super::tiles::{At, Tile, Tiles};

/// First bytes of every accumulator; the last one is the version.
const MAGIC: [u8; 8] = *b"dvspacc\x01";
/// Bytes of the header, of each voxel and of each tile.
const HEADER_BYTES: usize = 80;
const VOXEL_BYTES: usize = 34;
const TILE_BYTES: usize = 16;
/// Voxels in a tile.
const TILE_VOXELS: u16 = 512;

impl Accumulator {
    /// The accumulator as bytes.
    #[must_use]
    pub fn to_bytes(&self) -> Vec<u8> {
        self.bytes_of(&self.tiles.sorted(), self.dropped)
    }

    /// What it holds in cubes of 128 voxels, each with its place from the origin and as the bytes of
    /// an accumulator: to keep what would not fit in memory, and to merge a part of it. Points that
    /// were dropped are in none of them.
    #[must_use]
    pub fn blocks(&self) -> Vec<([i32; 3], Vec<u8>)> {
        let mut tiles = self.tiles.sorted();
        tiles.sort_by_key(|tile| tile.at.block());
        let blocks = tiles.chunk_by(|a, b| a.at.block() == b.at.block());
        blocks.map(|some| (some[0].at.block(), self.bytes_of(some, [0; 2]))).collect()
    }

    fn bytes_of(&self, tiles: &[&Tile], dropped: [u64; 2]) -> Vec<u8> {
        let occupied: usize = tiles.iter().map(|tile| tile.len()).sum();
        let size = HEADER_BYTES + TILE_BYTES * tiles.len() + VOXEL_BYTES * occupied;
        let mut bytes = Vec::with_capacity(size);
        bytes.extend(MAGIC);
        for number in self.lattice.origin.into_iter().chain([self.lattice.edge_m]) {
            bytes.extend(number.to_le_bytes());
        }
        bytes.extend(self.level.to_le_bytes());
        bytes.extend((tiles.len() as u32).to_le_bytes());
        let counts = [self.most as u64, dropped[0], dropped[1], occupied as u64];
        counts.into_iter().for_each(|count| bytes.extend(count.to_le_bytes()));
        for tile in tiles {
            tile.at.0.into_iter().for_each(|at| bytes.extend(at.to_le_bytes()));
            bytes.extend((tile.len() as u32).to_le_bytes());
            for (number, sums) in tile.voxels() {
                [number, sums.low, sums.high]
                    .into_iter()
                    .for_each(|v| bytes.extend(v.to_le_bytes()));
                bytes.extend(sums.count.to_le_bytes());
                sums.xyz.into_iter().for_each(|sum| bytes.extend(sum.to_le_bytes()));
            }
        }
        bytes
    }

    /// Reads an accumulator from its bytes.
    ///
    /// # Errors
    ///
    /// [`Error::Corrupt`] for bytes that were not made by [`Accumulator::to_bytes`]. Memory is
    /// allocated only for data that are there, not for what a header promises.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self> {
        let mut rest = bytes;
        if take::<8>(&mut rest)? != MAGIC {
            return Err(Error::Corrupt("are no accumulator of this version"));
        }
        let mut float = || take(&mut rest).map(f64::from_le_bytes);
        let (origin, edge_m) = ([float()?, float()?, float()?], float()?);
        let lattice = Lattice::new(origin, edge_m).map_err(|_| OFF)?;
        let level = take(&mut rest).map(u32::from_le_bytes)?;
        let tiles = take(&mut rest).map(u32::from_le_bytes)? as usize;
        let mut count = || take(&mut rest).map(u64::from_le_bytes);
        let (most, dropped, occupied) =
            (count()? as usize, [count()?, count()?], count()? as usize);
        let promised = occupied.checked_mul(VOXEL_BYTES);
        let promised = promised.and_then(|size| size.checked_add(tiles * TILE_BYTES));
        if promised != Some(rest.len()) || level > HIGHEST || occupied > most || most == 0 {
            return Err(OFF);
        }
        let tiles = read_tiles(&mut rest, tiles, level)?;
        if tiles.occupied != occupied {
            return Err(OFF);
        }
        Ok(Self { lattice, level, most, tiles, dropped })
    }
}

const OFF: Error = Error::Corrupt("do not hold what their header promises");

fn read_tiles(rest: &mut &[u8], count: usize, level: u32) -> Result<Tiles> {
    let mut tiles = Tiles::default();
    let mut before: Option<At> = None;
    for _ in 0..count {
        let mut whole = || take(rest).map(u32::from_le_bytes);
        let (at, voxels) = (At([whole()?, whole()?, whole()?]), whole()?);
        if before.is_some_and(|before| before >= at) || voxels == 0 {
            return Err(OFF);
        }
        before = Some(at);
        read_voxels(rest, voxels, at, level, &mut tiles)?;
    }
    Ok(tiles)
}

fn read_voxels(rest: &mut &[u8], count: u32, at: At, level: u32, tiles: &mut Tiles) -> Result<()> {
    let mut next = 0;
    for _ in 0..count {
        let mut short = || take(rest).map(u16::from_le_bytes);
        let (number, low, high) = (short()?, short()?, short()?);
        let count = take(rest).map(u32::from_le_bytes)?;
        let mut long = || take(rest).map(u64::from_le_bytes);
        let sums = Sums { xyz: [long()?, long()?, long()?], count, low, high };
        if !(next..TILE_VOXELS).contains(&number) || !sums.is_possible(level) {
            return Err(OFF);
        }
        next = number + 1;
        *tiles.sums(at.voxel(number)) = sums;
    }
    Ok(())
}

/// The next bytes.
fn take<const N: usize>(rest: &mut &[u8]) -> Result<[u8; N]> {
    let (taken, after) = rest.split_first_chunk::<N>().ok_or(OFF)?;
    *rest = after;
    Ok(*taken)
}
