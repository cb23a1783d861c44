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

/// The points of each cell that are surface. Two numbers a cell: there are many cells.
#[derive(Debug)]
pub(crate) struct Taken {
    grid: Grid,
    reach: Reach,
    /// Those near this height; none where it is NaN.
    heights_m: Vec<f64>,
    /// Those up to this height, in a cell of a face; NaN elsewhere.
    faces_m: Vec<f64>,
    /// Those near a plane, at the foot of a face, by cell in ascending order; few cells have one.
    feet: Vec<(usize, [f64; 3])>,
}

impl Taken {
    /// Whether a point is surface.
    pub(crate) fn takes(&self, p: &Point) -> bool {
        let cell = self.grid.cell(p);
        let (height_m, face_m) = (self.heights_m[cell], self.faces_m[cell]);
        match (height_m.is_nan(), face_m.is_nan()) {
            (_, false) => p[2] <= face_m,
            (false, _) => (p[2] - height_m).abs() <= self.reach.far_m,
            (true, _) => self.foot_takes(cell, p),
        }
    }

    fn foot_takes(&self, cell: usize, p: &Point) -> bool {
        let Ok(foot) = self.feet.binary_search_by_key(&cell, |foot| foot.0) else { return false };
        let [x, y] = self.grid.center(cell);
        let local = [p[0] - x, p[1] - y, 0.0];
        (p[2] - value(&self.feet[foot].1.into(), &local)).abs() <= self.reach.near_m
    }
}

/// The surface points of each cell, after a walk with this reach. A face that leads up to a board
/// belongs to the board.
pub(crate) fn taken(
    columns: &Columns,
    mut heights_m: Vec<f64>,
    boards: &[usize],
    reach: Reach,
) -> Taken {
    let (grid, reach_m) = (&columns.grid, reach.far_m);
    let mut top: Vec<f64> =
        (0..grid.len()).polled().map(|cell| top(columns, cell, heights_m[cell], reach_m)).collect();
    boards.iter().for_each(|&cell| top[cell] = f64::INFINITY);
    let mut faces: Vec<bool> = top.iter().map(|top| !top.is_nan()).collect();
    for face in components(grid, faces.clone(), &EIGHT).into_iter().polled() {
        let around = || face.iter().flat_map(|&cell| grid.around(cell, 1)).map(|n| heights_m[n]);
        let highest = around().fold(f64::NEG_INFINITY, f64::max);
        if face.iter().all(|&cell| top[cell] <= highest + reach_m) {
            let level = |&&cell: &&usize| is_level(columns, &heights_m, cell, top[cell], reach_m);
            face.iter().polled().filter(level).for_each(|&cell| faces[cell] = false);
        }
    }
    let at_foot = |&cell: &usize| faces[cell] && !heights_m[cell].is_nan();
    let plane = |cell| Some((cell, foot(grid, &heights_m, &faces, cell)?));
    let feet = (0..grid.len()).polled().filter(at_foot).filter_map(plane).collect();
    for cell in (0..grid.len()).filter(|&cell| faces[cell]) {
        (heights_m[cell], top[cell]) = (f64::NAN, f64::NAN);
    }
    Taken { grid: *grid, reach, heights_m, faces_m: top, feet }
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
        let taken = |height_m: f64, face_m: f64, plane: Option<[f64; 3]>| Taken {
            grid: Grid { origin_m: [-0.5, -0.5], cell_m: 1.0, columns: 1, rows: 1 },
            reach: Reach { far_m: 0.5, near_m: 0.1 },
            heights_m: vec![height_m],
            faces_m: vec![face_m],
            feet: plane.map(|plane| (0, plane)).into_iter().collect(),
        };
        let near = taken(1.0, f64::NAN, None);
        assert!(near.takes(&at(1.5)) && !near.takes(&at(1.6)) && !near.takes(&at(0.4)));
        let nothing = taken(f64::NAN, f64::NAN, None);
        assert!(taken(0.5, 1.0, None).takes(&at(-3.0)) && !nothing.takes(&at(0.0)));
        assert!(!taken(0.5, 1.0, None).takes(&at(1.1)));
        let foot = taken(f64::NAN, f64::NAN, Some([0.0, 1.0, 0.0]));
        assert!(foot.takes(&at(0.55)) && !foot.takes(&at(0.3)));
    }
}
