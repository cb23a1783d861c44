//! Merges the two voxels of a column that one surface passes through into one point.

use crate::cancel::Polled;

use super::accumulate::{Accumulator, Held, Mean};
use super::sums::BITS;
use super::tiles::Tile;

/// Two voxels, one above the other, hold one surface if their means are nearer than this share of a
/// width. Chosen between the halves of one surface, about its noise apart, and the means of
/// neighbours on a wall, a width apart: lower leaves surfaces doubled, higher thins out walls.
pub(crate) const ONE: f64 = 0.7;

impl Accumulator {
    /// As [`Accumulator::held`], with the two halves of a surface that lies at a face between
    /// voxels merged. The mean of each half would be off the surface by about the noise.
    #[must_use]
    pub fn surfaces(&self) -> Held {
        let mut held = Held::default();
        let near = ONE * f64::from(BITS + self.level).exp2();
        let plan = |tile: &&Tile| [tile.at.0[0], tile.at.0[1]];
        for tiles in self.tiles.sorted().chunk_by(|a, b| plan(a) == plan(b)).polled() {
            let mut voxels: Vec<_> = tiles.iter().flat_map(|tile| self.means(tile)).collect();
            voxels.sort_unstable_by_key(|(voxel, _)| *voxel);
            let mut before: Option<([u64; 3], Mean)> = None;
            for (voxel, mean) in voxels {
                let joined = before.filter(|(below, one)| {
                    is_above(voxel, *below) && mean.at[2] - one.at[2] < near
                });
                if let (None, Some((_, one))) = (joined, before) {
                    held.push(&self.lattice, one);
                }
                before = Some((voxel, joined.map_or(mean, |(_, one)| one.with(&mean))));
            }
            before.into_iter().for_each(|(_, one)| held.push(&self.lattice, one));
        }
        held
    }

    fn means(&self, tile: &Tile) -> impl Iterator<Item = ([u64; 3], Mean)> {
        tile.voxels().map(|(number, sums)| {
            let voxel = tile.voxel(number);
            (voxel, Mean::of(voxel, sums, self.level))
        })
    }
}

fn is_above(voxel: [u64; 3], below: [u64; 3]) -> bool {
    voxel == [below[0], below[1], below[2] + 1]
}
