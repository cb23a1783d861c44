//! Faces: where points rise from the walked surface more steeply than the walk goes.
//!
//! A face between two walked parts of the surface, a bench or a pile that was dug out, is itself the
//! surface. At the foot of any other, a wall or a leg, the walk has taken the lowest points of the
//! face along; the surface there goes on as it is in the cells before.

use super::columns::Columns;
use crate::Point;
use crate::connectivity::components;
use crate::heightmap::Grid;
use crate::piles::{EIGHT, Kind, value, weighted_plane};

/// The surface goes on as it is in the cells so many columns and rows away.
const SUPPORT: usize = 2;
/// With fewer cells it is not known.
const FEWEST: usize = 5;
/// What the surface's slope changes by within a cell.
const BEND: f64 = 0.3;

/// The surface in one cell.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Taken {
    /// Points so near to a height.
    Near {
        height_m: f64,
        within_m: f64,
    },
    /// Points up to a height.
    Face {
        up_to_m: f64,
    },
    /// Points so near to a plane through a place.
    Foot {
        center_m: [f64; 2],
        plane: [f64; 3],
        within_m: f64,
    },
    Nothing,
}

impl Taken {
    pub(crate) fn takes(&self, p: &Point) -> bool {
        match *self {
            Self::Near { height_m, within_m } => (p[2] - height_m).abs() <= within_m,
            Self::Face { up_to_m } => p[2] <= up_to_m,
            Self::Foot { center_m, plane, within_m } => {
                let local = [p[0] - center_m[0], p[1] - center_m[1], 0.0];
                (p[2] - value(&plane.into(), &local)).abs() <= within_m
            }
            Self::Nothing => false,
        }
    }
}

/// What of each cell is surface, after a walk with this reach.
pub(crate) fn taken(
    columns: &Columns,
    heights_m: &[f64],
    reach_m: f64,
    noise_m: f64,
) -> Vec<Taken> {
    let grid = &columns.grid;
    let top: Vec<f64> =
        (0..grid.len()).map(|cell| top(columns, cell, heights_m[cell], reach_m)).collect();
    let mut taken: Vec<Taken> = heights_m
        .iter()
        .map(|&height_m| match height_m.is_nan() {
            true => Taken::Nothing,
            false => Taken::Near { height_m, within_m: reach_m },
        })
        .collect();
    let mut faces: Vec<bool> = top.iter().map(|top| !top.is_nan()).collect();
    for face in components(grid, faces.clone(), &EIGHT) {
        let around = || face.iter().flat_map(|&cell| grid.around(cell, 1)).map(|n| heights_m[n]);
        let highest = around().fold(f64::NEG_INFINITY, f64::max);
        if face.iter().all(|&cell| top[cell] <= highest + reach_m) {
            for &cell in &face {
                taken[cell] = Taken::Face { up_to_m: top[cell] };
                faces[cell] = false;
            }
        }
    }
    for cell in (0..grid.len()).filter(|&c| faces[c] && !heights_m[c].is_nan()) {
        let within_m = reach_m.min(super::walk::SIGMAS * noise_m + BEND * grid.cell_m);
        taken[cell] = match foot(grid, heights_m, &faces, cell) {
            Some(plane) => Taken::Foot { center_m: grid.center(cell), plane, within_m },
            None => Taken::Nothing,
        };
    }
    taken
}

/// The highest point of a cell that rises from the surface; NaN where nothing does. In a cell that
/// was not walked everything does.
fn top(columns: &Columns, cell: usize, height_m: f64, reach_m: f64) -> f64 {
    let top = match height_m.is_nan() {
        true => columns.heights(cell).last().copied(),
        false => columns.rises(cell, height_m, reach_m),
    };
    top.unwrap_or(f64::NAN)
}

/// The plane through the cells around the foot of a face, the nearest counting most.
fn foot(grid: &Grid, heights_m: &[f64], faces: &[bool], cell: usize) -> Option<[f64; 3]> {
    let center = grid.center(cell);
    let clean = grid.around(cell, SUPPORT).filter(|&n| !faces[n] && !heights_m[n].is_nan());
    let local: Vec<[f64; 3]> = clean
        .map(|n| {
            let [x, y] = grid.center(n);
            [x - center[0], y - center[1], heights_m[n]]
        })
        .collect();
    if local.len() < FEWEST {
        return None;
    }
    let weights = local.iter().map(|p| 1.0 / (p[0] * p[0] + p[1] * p[1]));
    weighted_plane(&local, weights, Kind::Ring).map(Into::into)
}
