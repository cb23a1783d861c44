//! Voxel downsampling in large, sparse boxes: the points are sorted by voxel.

use crate::order::{Keyed, keyed_by, sort_by_key};
use crate::parallel::map_chunks;
use crate::{Places, Point};

use super::lattice::{Grid, VoxelSums, Voxels};
use super::rows::Rows;

/// Voxels for a thread at a time. Decides no answer.
const CHUNK: usize = 1024;

pub(super) fn voxels(
    points: Places<'_>,
    grid: &Grid,
    threads: usize,
    with_rows: bool,
) -> (Voxels, Rows) {
    let sorted = sort(points, grid, threads);
    let voxels: Vec<&[Keyed]> = sorted.chunk_by(|a, b| a.key == b.key).collect();
    let sums = map_chunks(voxels.len(), CHUNK, threads, |range| {
        voxels[range].iter().map(|rows| mean(points, grid, rows)).collect::<Vec<_>>()
    });
    let (means, counts) = sums.into_iter().flatten().unzip();
    let mut rows = vec![0; if with_rows { points.len() } else { 0 }];
    for (voxel, held) in (0..).zip(&voxels).filter(|_| with_rows) {
        held.iter().for_each(|keyed| rows[keyed.row as usize] = voxel);
    }
    (Voxels { means, counts }, Rows::Kept(rows))
}

/// The rows, sorted by z, y, x of their cells, with one key for each voxel.
fn sort(points: Places<'_>, grid: &Grid, threads: usize) -> Vec<Keyed> {
    let bits = grid.last.map(|last| u64::BITS - last.leading_zeros());
    if bits.iter().sum::<u32>() > u64::BITS {
        return sort_by_axis(points, grid);
    }
    let pack = |[x, y, z]: [u64; 3]| (z << bits[1] | y) << bits[0] | x;
    sort_by_key(keyed_by(points, threads, |p| pack(grid.cell(p))))
}

/// The same for boxes whose three cell numbers do not fit in one key.
fn sort_by_axis(points: Places<'_>, grid: &Grid) -> Vec<Keyed> {
    let cell = |row: u32| grid.cell(&points.at(row as usize));
    let mut rows = keyed_by(points, 1, |_| 0);
    for axis in 0..3 {
        rows.iter_mut().for_each(|r| r.key = cell(r.row)[axis]);
        rows = sort_by_key(rows);
    }
    let mut voxel = 0;
    let mut previous = None;
    for r in &mut rows {
        let own = Some(cell(r.row));
        voxel += u64::from(own != previous);
        previous = own;
        r.key = voxel;
    }
    rows
}

/// The mean of the points in one voxel, and their number.
fn mean(points: Places<'_>, grid: &Grid, rows: &[Keyed]) -> (Point, u32) {
    let cell = grid.cell(&points.at(rows[0].row as usize));
    let mut sums = VoxelSums::default();
    rows.iter().for_each(|row| sums.add(grid.inside(cell, &points.at(row.row as usize))));
    (sums.mean(grid, cell), sums.count)
}
