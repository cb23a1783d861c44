//! Finds the one surface of a scene: bulk material and the ground under it, as seen from above.
//!
//! Method: points are kept apart by height in columns over cells; the surface is walked from the
//! ground, without steps steeper than material stands; boards and faces are then judged.
//! Slope-limited filters find bare earth in the same way (Vosselman 2000, Int. Arch. Photogramm.
//! 33(B3):935). Heights in m.

mod anywhere;
mod boards;
mod columns;
mod faces;
mod hills;
mod levels;
mod walk;

pub use hills::{Hills, hills, hills_and_holes};

use columns::{Columns, Needs};
use faces::Taken;
use levels::{Levels, NONE};
use walk::{Reach, mean, walk};

use crate::error::Result;
use crate::extent::off_scan_cells;
use crate::heightmap::{Grid, bounds};
use crate::parallel::fill_chunks;
use crate::slopes::Slopes;
use crate::{Places, thread_count};

/// Points or cells for a thread at a time. Decides no answer.
const CHUNK: usize = 1 << 12;

/// Thickness of a layer: this many standard deviations of the noise, three to either side, or this
/// share of a cell's width for a slope, 31° across a cell, whichever is more. Chosen: thinner
/// splits surfaces, thicker joins things to the ground below them.
const LAYER_SIGMAS: f64 = 6.0;
const LAYER_CELLS: f64 = 0.6;

/// Which of levelled points lie on the surface that can be walked from the ground. With `anywhere`,
/// the walk also starts where no ground is in view, from the large connected components of the
/// lowest layer.
///
/// # Errors
///
/// As [`Grid::over`].
///
/// # Examples
///
/// ```
/// use divespot_core::Point;
/// use divespot_core::surface::surface_points;
///
/// // A cone 0.2 m high and 0.8 m wide on a floor, a point each 2 cm, and a board 1 m above it.
/// let cone = |x: f64, y: f64| (0.2 - 0.5 * (x - 1.0).hypot(y - 1.0)).max(0.0);
/// let places = (0..10_000).map(|i| [f64::from(i % 100) * 0.02, f64::from(i / 100) * 0.02]);
/// let mut points: Vec<Point> = places.map(|[x, y]| [x, y, cone(x, y)]).collect();
/// points.extend((0..100).map(|i| [0.9 + f64::from(i % 10) * 0.02, 0.9 + f64::from(i / 10) * 0.02, 1.2]));
/// let on = surface_points(&points, 0.04, 0.001, false)?;
/// assert!(on[..10_000].iter().all(|&on| on));
/// assert!(on[10_000..].iter().all(|&on| !on), "what hangs over the cone is no part of it");
/// # Ok::<(), divespot_core::Error>(())
/// ```
pub fn surface_points<'a>(
    points: impl Into<Places<'a>>,
    cell_m: f64,
    noise_m: f64,
    anywhere: bool,
) -> Result<Vec<bool>> {
    surface_points_on(1, points, cell_m, noise_m, anywhere)
}

/// The same with this many threads; 0 takes every core that the process may use.
///
/// # Errors
///
/// As [`Grid::over`].
pub fn surface_points_on<'a>(
    threads: usize,
    points: impl Into<Places<'a>>,
    cell_m: f64,
    noise_m: f64,
    anywhere: bool,
) -> Result<Vec<bool>> {
    let (points, threads) = (points.into(), thread_count(threads));
    let grid = Grid::over(&bounds(points)?, cell_m, points.len())?;
    let taken = taken_points(points, grid, noise_m, anywhere, threads);
    let mut mask = vec![false; points.len()];
    fill_chunks(&mut mask, CHUNK, threads, |first, piece| {
        let places = points.within(first..first + piece.len());
        piece.iter_mut().zip(places).for_each(|(on, p)| *on = taken.takes(&p));
    });
    Ok(mask)
}

/// The surface points of each cell.
fn taken_points(
    points: Places<'_>,
    grid: Grid,
    noise_m: f64,
    anywhere: bool,
    threads: usize,
) -> Taken {
    let columns = Columns::of(points, grid, threads);
    let needs = columns.needs();
    let lowest = lowest_layer(&columns, &needs, noise_m, threads);
    let mut heights_m = seeds(&grid, &lowest);
    let reach = Reach::of(grid.cell_m, noise_m);
    if anywhere {
        anywhere::seed(&grid, &lowest, reach.far_m, &mut heights_m);
    }
    drop(lowest);
    let ground: Vec<bool> = heights_m.iter().map(|h| !h.is_nan()).collect();
    walk(&columns, &mut heights_m, &needs, reach);
    let boards = boards::without_boards(&columns, &mut heights_m, &ground, noise_m);
    faces::taken(&columns, heights_m, &boards, reach)
}

/// Height of the lowest layer in each cell, in m; NaN where there is none.
fn lowest_layer(columns: &Columns, needs: &Needs, noise_m: f64, threads: usize) -> Vec<f64> {
    let band_m = (LAYER_SIGMAS * noise_m).max(LAYER_CELLS * columns.grid.cell_m);
    let mut lowest_m = vec![f64::NAN; columns.grid.len()];
    fill_chunks(&mut lowest_m, CHUNK, threads, |first, piece| {
        for (lowest_m, cell) in piece.iter_mut().zip(first..) {
            *lowest_m = lowest(columns.heights(cell), needs.of(cell), band_m);
        }
    });
    lowest_m
}

/// Heights of the large gentle parts of the lowest layer, in m; NaN elsewhere.
fn seeds(grid: &Grid, lowest: &[f64]) -> Vec<f64> {
    let slopes = Slopes::of(grid, lowest);
    let levels = Levels::of(grid, lowest, &slopes, &off_scan_cells(grid, lowest));
    let largest = levels.largest();
    let seed = |cell: usize| match levels.of[cell] {
        NONE => f64::NAN,
        part if levels.edges[part as usize].is_lid(largest) => f64::NAN,
        _ => lowest[cell],
    };
    (0..grid.len()).map(seed).collect()
}

/// Mean of the lowest layer with enough points; NaN where there is none.
fn lowest(heights_m: &[f64], need: usize, band_m: f64) -> f64 {
    let enough = |first: &usize| {
        heights_m.get(first + need - 1).is_some_and(|last| last - heights_m[*first] <= band_m)
    };
    let Some(first) = (0..heights_m.len()).find(enough) else { return f64::NAN };
    let end = heights_m.partition_point(|&z| z <= heights_m[first] + band_m);
    mean(&heights_m[first..end])
}

#[cfg(test)]
mod tests;
