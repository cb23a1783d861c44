//! Decides which points at faces belong to the surface; heights in m.
//!
//! A face is where points rise from the walked surface more steeply than 60°. A face between two
//! walked parts of the surface, as of a bench or of a pile that was dug out, is itself surface. At
//! the foot of any other face, as of a wall or a leg, the walk has also taken the face's lowest
//! points; there the surface is extrapolated by a plane through the cells before.

use super::columns::Columns;
use super::walk::Reach;
use crate::Point;
use crate::cancel::Polled;
use crate::connectivity::EIGHT;
use crate::connectivity::components;
use crate::heightmap::Grid;
use crate::material::NEVER_STEEPER;
use crate::near_plane::{near_plane, places_about, value};

/// The plane at a face's foot is fitted to the cells within this many columns and rows. Chosen:
/// fewer follow noise, more reach past the foot.
const SUPPORT: usize = 2;
/// The fewest cells for that plane: two more than its parameters. Chosen: fewer leave noise
/// unaveraged, more loses feet beside shadows.
const FEWEST: usize = 5;

/// The points of one cell that are surface.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Taken {
    /// Those within a distance of a height.
    Near {
        height_m: f64,
        within_m: f64,
    },
    /// Those up to a height.
    Face {
        up_to_m: f64,
    },
    /// Those within a distance of a plane; boxed, since few cells need it.
    Foot(Box<Foot>),
    Nothing,
}

/// Points so near to a plane through a place.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Foot {
    center_m: [f64; 2],
    plane: [f64; 3],
    within_m: f64,
}

impl Taken {
    pub(crate) fn takes(&self, p: &Point) -> bool {
        match self {
            Self::Near { height_m, within_m } => (p[2] - height_m).abs() <= *within_m,
            Self::Face { up_to_m } => p[2] <= *up_to_m,
            Self::Foot(foot) => {
                let local = [p[0] - foot.center_m[0], p[1] - foot.center_m[1], 0.0];
                (p[2] - value(&foot.plane.into(), &local)).abs() <= foot.within_m
            }
            Self::Nothing => false,
        }
    }
}

/// The surface points of each cell, after a walk with this reach. A face that leads up to a board
/// belongs to the board.
pub(crate) fn taken(
    columns: &Columns,
    heights_m: &[f64],
    boards: &[usize],
    reach: Reach,
) -> Vec<Taken> {
    let (grid, reach_m) = (&columns.grid, reach.far_m);
    let mut top: Vec<f64> =
        (0..grid.len()).polled().map(|cell| top(columns, cell, heights_m[cell], reach_m)).collect();
    boards.iter().for_each(|&cell| top[cell] = f64::INFINITY);
    let mut taken: Vec<Taken> = heights_m
        .iter()
        .map(|&height_m| match height_m.is_nan() {
            true => Taken::Nothing,
            false => Taken::Near { height_m, within_m: reach_m },
        })
        .collect();
    let mut faces: Vec<bool> = top.iter().map(|top| !top.is_nan()).collect();
    for face in components(grid, faces.clone(), &EIGHT).into_iter().polled() {
        let around = || face.iter().flat_map(|&cell| grid.around(cell, 1)).map(|n| heights_m[n]);
        let highest = around().fold(f64::NEG_INFINITY, f64::max);
        if face.iter().all(|&cell| top[cell] <= highest + reach_m) {
            let level = |&&cell: &&usize| is_level(columns, heights_m, cell, top[cell], reach_m);
            for &cell in face.iter().polled().filter(level) {
                taken[cell] = Taken::Face { up_to_m: top[cell] };
                faces[cell] = false;
            }
        }
    }
    for cell in (0..grid.len()).polled().filter(|&c| faces[c] && !heights_m[c].is_nan()) {
        taken[cell] = match foot(grid, heights_m, &faces, cell) {
            Some(plane) => {
                let (center_m, within_m) = (grid.center(cell), reach.near_m);
                Taken::Foot(Box::new(Foot { center_m, plane, within_m }))
            }
            None => Taken::Nothing,
        };
    }
    taken
}

/// The highest point that rises from the surface in a cell; NaN if none does. In a cell without
/// walked surface all points rise.
fn top(columns: &Columns, cell: usize, height_m: f64, reach_m: f64) -> f64 {
    let top = match height_m.is_nan() {
        true => columns.heights(cell).last().copied(),
        false => columns.rises(cell, height_m, reach_m),
    };
    top.unwrap_or(f64::NAN)
}

/// Whether the walked surface reaches the top of a face within the run that material at its
/// steepest needs.
fn is_level(columns: &Columns, heights_m: &[f64], cell: usize, top_m: f64, reach_m: f64) -> bool {
    let grid = &columns.grid;
    let rise_m = top_m - columns.heights(cell).first().unwrap_or(&top_m);
    let farthest = (rise_m / NEVER_STEEPER / grid.cell_m).ceil() as usize + 1;
    grid.around(cell, farthest).any(|n| heights_m[n] >= top_m - reach_m)
}

/// The plane through the cells around the foot of a face; near cells have more weight.
fn foot(grid: &Grid, heights_m: &[f64], faces: &[bool], cell: usize) -> Option<[f64; 3]> {
    let clean = grid.around(cell, SUPPORT).filter(|&n| !faces[n] && !heights_m[n].is_nan());
    let local = places_about(grid, heights_m, cell, clean);
    if local.len() < FEWEST {
        return None;
    }
    near_plane(&local).map(Into::into)
}

#[cfg(test)]
mod tests {
    use super::*;

    const GRID: Grid = Grid { origin_m: [0.0; 2], cell_m: 1.0, columns: 9, rows: 9 };
    const MIDDLE: usize = 40;

    /// Columns and rows from the middle.
    fn away(cell: usize) -> usize {
        (cell % 9).abs_diff(4).max((cell / 9).abs_diff(4))
    }

    /// Height in the middle of the plane through the cells that are `clean`.
    fn foot_m(height: impl Fn(usize) -> f64, clean: impl Fn(usize) -> bool) -> Option<f64> {
        let heights: Vec<f64> = (0..GRID.len()).map(height).collect();
        let faces: Vec<bool> = (0..GRID.len()).map(|cell| !clean(cell)).collect();
        foot(&GRID, &heights, &faces, MIDDLE).map(|plane| plane[0])
    }

    #[test]
    fn at_the_foot_of_a_face_the_surface_goes_on_as_two_cells_away() {
        let slope = |cell: usize| match away(cell) {
            0..=2 => 0.25 * GRID.center(cell)[0],
            _ => 99.0,
        };
        let found = foot_m(slope, |cell| away(cell) > 1).unwrap();
        assert!((found - 0.25 * GRID.center(MIDDLE)[0]).abs() < 1e-9, "{found}");
    }

    #[test]
    fn of_fewer_than_five_cells_nothing_is_known() {
        let only = |cells: &'static [usize]| foot_m(|_| 1.0, move |cell| cells.contains(&cell));
        assert!(only(&[39, 48, 49, 30, 31, 22]).is_some());
        assert!(only(&[39, 48, 49, 30]).is_none() && only(&[39, 48, 49]).is_none());
    }

    #[test]
    fn what_is_taken_lies_where_the_surface_is() {
        let at = |z: f64| [0.5, 0.5, z];
        let near = Taken::Near { height_m: 1.0, within_m: 0.5 };
        assert!(near.takes(&at(1.5)) && !near.takes(&at(1.6)) && !near.takes(&at(0.4)));
        assert!(Taken::Face { up_to_m: 1.0 }.takes(&at(-3.0)) && !Taken::Nothing.takes(&at(0.0)));
        assert!(!Taken::Face { up_to_m: 1.0 }.takes(&at(1.1)));
        let foot = Foot { center_m: [0.0, 0.0], plane: [0.0, 1.0, 0.0], within_m: 0.1 };
        let foot = Taken::Foot(Box::new(foot));
        assert!(foot.takes(&at(0.55)) && !foot.takes(&at(0.3)));
    }
}
