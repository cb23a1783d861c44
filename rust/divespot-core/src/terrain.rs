//! The ground as one surface, in m: as seen, and by harmonic interpolation below the objects on it.

use crate::cancel::Polled;
use crate::count::to_f64;
use crate::harmonic::Harmonic;
use crate::heightmap::Grid;
use crate::robust::{median, scale};

/// The ground of a height map.
#[derive(Debug, Clone, PartialEq)]
pub struct Terrain {
    /// Height of the ground in each cell, in m: as seen, or interpolated harmonically below
    /// objects. The interpolation is never below the ground beside it, so that risers do not show
    /// as objects.
    pub surface_m: Vec<f64>,
    /// Standard deviation of the ground's cells about a harmonic interpolation through them, in m.
    pub noise_m: f64,
}

/// The surface through the cells that are `ground`; `reach` is the half-width, in cells, of the
/// window in which their slope was measured.
pub(crate) fn terrain_of(grid: &Grid, heights_m: &[f64], ground: &[bool], reach: usize) -> Terrain {
    let seen = (0..grid.len()).filter(|&c| ground[c] && !heights_m[c].is_nan());
    let level_m = median(seen.clone().map(|cell| heights_m[cell]).collect());
    let place = |cell: usize| {
        let [x, y] = grid.center(cell);
        [x, y, heights_m[cell] - level_m]
    };
    let points = seen.map(place);
    let size = [grid.columns, grid.rows].map(|n| to_f64(n) * grid.cell_m);
    let harmonic = Harmonic::stretched(grid.origin_m, size, grid.cell_m, points.clone());
    let off = |p: [f64; 3]| p[2] - harmonic.at([p[0], p[1]]);
    let beside = cells_beside(grid, heights_m, reach, ground);
    let height = |cell: usize| match heights_m[cell] {
        seen if ground[cell] && !seen.is_nan() => seen,
        _ => (level_m + harmonic.at(grid.center(cell))).max(beside[cell]),
    };
    Terrain {
        surface_m: (0..grid.len()).polled().map(height).collect(),
        noise_m: scale(points.polled().map(off)),
    }
}

/// The highest ground within `reach` of each cell.
fn cells_beside(grid: &Grid, heights_m: &[f64], reach: usize, ground: &[bool]) -> Vec<f64> {
    let highest = |a: f64, b: &f64| a.max(*b);
    let lowest = |(&height, &is): (&f64, &bool)| if is { height } else { f64::NEG_INFINITY };
    let heights: Vec<f64> = heights_m.iter().zip(ground).map(lowest).collect();
    let around = |at: usize, end: usize| at.saturating_sub(reach)..(at + reach + 1).min(end);
    let mut along = Vec::with_capacity(heights.len());
    for row in heights.chunks(grid.columns.max(1)) {
        let most = |at| row[around(at, row.len())].iter().fold(f64::NEG_INFINITY, highest);
        along.extend((0..row.len()).map(most));
    }
    drop(heights);
    let mut all = vec![f64::NEG_INFINITY; along.len()];
    for (at, line) in all.chunks_mut(grid.columns.max(1)).enumerate().polled() {
        for row in around(at, grid.rows) {
            let other = &along[row * grid.columns..][..grid.columns];
            line.iter_mut().zip(other).for_each(|(most, height)| *most = most.max(*height));
        }
    }
    all
}
