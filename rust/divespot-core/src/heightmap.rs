//! The height map (paper, "Voxel Meshing Calculation"): one height in m for each square cell, and
//! volumes in m³ from it.
//!
//! Memory grows with the square of the scene's size; voxels would need its cube.

use std::ops::Range;

use crate::cancel::Polled;
use crate::error::{Error, Result, memory_for, positive};
use crate::fixed::Fixed;
use crate::material::NEVER_STEEPER;
use crate::parallel::{fill_chunks, map_chunks};
use crate::{Bounds, Places, Point, thread_count};

/// Most cells of a grid; and number of cells from which a grid may have at most `CELLS_A_POINT`
/// cells for each point, because with more it is mostly gaps. Chosen: they bound memory, at
/// [`BYTES_A_CELL`] to 13 GB and 0.8 GB; half of them refuse fine grids of large yards.
const MOST_CELLS: f64 = (1u64 << 26) as f64;
const ANY_CELLS: f64 = (1u64 << 22) as f64;
const CELLS_A_POINT: f64 = 64.0;
/// Memory of a triangulated height map for each cell while it is made, in bytes: 140, and a
/// reserve.
const BYTES_A_CELL: usize = 192;

/// Most parts in which points are averaged in parallel; each needs a grid of its own. Decides no
/// answer.
const PARTS: usize = 4;
/// Cells for a thread at a time. Decides no answer.
const CHUNK: usize = 1 << 13;

/// Square cells in plan, row by row: x along a row, y from row to row.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Grid {
    /// The corner of cell (0, 0) with the lowest x and y, in m.
    pub origin_m: [f64; 2],
    /// Width of a cell, in m.
    pub cell_m: f64,
    /// Number of cells in a row.
    pub columns: usize,
    /// Number of rows.
    pub rows: usize,
}

impl Grid {
    /// The grid over `bounds`, a quarter of a cell larger. Points of a regular raster whose step
    /// divides the cell then do not lie on the edge between two cells, where rounding would decide.
    ///
    /// # Errors
    ///
    /// A cell that is not above zero, or more than 2²⁶ cells, or than 2²² and 64 for each of the
    /// `count` points.
    pub fn over(bounds: &Bounds, cell_m: f64, count: usize) -> Result<Self> {
        positive("cell_m", cell_m)?;
        let extent = bounds.extent();
        let across = |k: usize| ((extent[k] + 0.25 * cell_m) / cell_m).floor() + 1.0;
        let cells = across(0) * across(1);
        if cells > MOST_CELLS.min(ANY_CELLS.max(CELLS_A_POINT * count as f64)) {
            return Err(Error::GridTooLarge { name: "cell_m", cells });
        }
        #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)] // at most 2²⁶
        let (columns, rows) = (across(0) as usize, across(1) as usize);
        memory_for(columns * rows * BYTES_A_CELL, || {
            format!("a grid of {columns} by {rows} cells")
        })?;
        let origin_m = [bounds.min[0] - 0.25 * cell_m, bounds.min[1] - 0.25 * cell_m];
        Ok(Self { origin_m, cell_m, columns, rows })
    }

    /// Checks that `given` values are one for each cell.
    pub(crate) fn require_each(&self, what: &'static str, given: usize) -> Result<()> {
        let needed = self.len();
        if given == needed { Ok(()) } else { Err(Error::Cells { what, given, needed }) }
    }

    /// The number of cells.
    #[must_use]
    pub fn len(&self) -> usize {
        self.columns * self.rows
    }

    /// Whether the grid has no cell.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The middle of a cell, in m.
    #[must_use]
    #[allow(clippy::cast_precision_loss)] // far below 2⁵³
    pub fn center(&self, cell: usize) -> [f64; 2] {
        let (column, row) = (cell % self.columns, cell / self.columns);
        [
            self.origin_m[0] + (column as f64 + 0.5) * self.cell_m,
            self.origin_m[1] + (row as f64 + 0.5) * self.cell_m,
        ]
    }

    /// Whether a point lies above or below a cell of the grid.
    pub(crate) fn holds(&self, p: &Point) -> bool {
        let within = |k: usize, most: usize| {
            (0.0..most as f64).contains(&((p[k] - self.origin_m[k]) / self.cell_m))
        };
        within(0, self.columns) && within(1, self.rows)
    }

    /// The cell at a place; outside the grid, the nearest one.
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)] // clamped to the grid
    #[inline]
    pub(crate) fn cell(&self, p: &[f64]) -> usize {
        let along = |k: usize, most: usize| {
            (((p[k] - self.origin_m[k]) / self.cell_m) as usize).min(most - 1)
        };
        along(1, self.rows) * self.columns + along(0, self.columns)
    }

    /// Whether a cell lies in the first or last row or column.
    #[must_use]
    pub fn is_border(&self, cell: usize) -> bool {
        let (column, row) = (cell % self.columns, cell / self.columns);
        column == 0 || row == 0 || column + 1 == self.columns || row + 1 == self.rows
    }

    /// The cells up to `reach` columns and rows away, including the cell itself.
    pub(crate) fn around(&self, cell: usize, reach: usize) -> impl Iterator<Item = usize> + use<> {
        let width = self.columns;
        let near = |at: usize, end: usize| at.saturating_sub(reach)..(at + reach + 1).min(end);
        let (columns, rows) = (near(cell % width, width), near(cell / width, self.rows));
        rows.flat_map(move |row| columns.clone().map(move |column| row * width + column))
    }

    /// The neighbour `dx` columns and `dy` rows away, if there is one.
    #[must_use]
    pub fn neighbor(&self, cell: usize, dx: isize, dy: isize) -> Option<usize> {
        self.ways(cell)((dx, dy))
    }

    /// The neighbours that `ways` lead to.
    pub(crate) fn neighbors<'a>(
        &self,
        cell: usize,
        ways: &'a [(isize, isize)],
    ) -> impl Iterator<Item = usize> + use<'a> {
        let way = self.ways(cell);
        ways.iter().filter_map(move |&by| way(by))
    }

    /// A function from directions to the neighbours of a cell; computes its column and row only
    /// once.
    #[inline]
    pub(crate) fn ways(&self, cell: usize) -> impl Fn((isize, isize)) -> Option<usize> + use<> {
        let (columns, rows) = (self.columns, self.rows);
        let (column, row) = (cell % columns, cell / columns);
        move |(dx, dy)| {
            let column = column.checked_add_signed(dx).filter(|&c| c < columns)?;
            let row = row.checked_add_signed(dy).filter(|&r| r < rows)?;
            Some(row * columns + column)
        }
    }
}

/// One height for each cell, and the number of points it is the mean of.
#[derive(Debug, Clone, PartialEq)]
pub struct HeightMap {
    /// The cells.
    pub grid: Grid,
    /// Height at the middle of each cell, in m; NaN without points.
    pub heights_m: Vec<f64>,
    /// Number of points in each cell.
    pub counts: Vec<u32>,
}

#[derive(Clone, Copy)]
struct CellSums {
    count: u32,
    xyz: [i64; 3],
}

/// The sums of no points.
const NOTHING: CellSums = CellSums { count: 0, xyz: [0; 3] };

/// Averages the points in each cell of width `cell_m`.
///
/// The mean height belongs to the mean position of the points. It is moved to the middle of the
/// cell along the slope between the neighbouring cells, so that points crowded on one side of the
/// cells do not bias the volume. The same points give the same bits in any order.
///
/// # Errors
///
/// No points, a cell that is not above zero, or too many cells (see [`Grid::over`]).
///
/// # Examples
///
/// ```
/// use divespot_core::heightmap::height_map;
///
/// let points = [[0.0, 0.0, 1.0], [0.5, 0.0, 2.0], [1.0, 0.0, 3.0]];
/// let map = height_map(&points, 0.5)?;
/// assert_eq!((map.grid.columns, map.grid.rows), (3, 1));
/// assert_eq!(map.counts, [1, 1, 1]);
/// # Ok::<(), divespot_core::Error>(())
/// ```
pub fn height_map(points: &[Point], cell_m: f64) -> Result<HeightMap> {
    height_map_within(points, &bounds(points)?, cell_m)
}

/// As [`height_map`], on the cells over `bounds`, which hold all points.
///
/// # Errors
///
/// As [`height_map`].
pub fn height_map_within(points: &[Point], bounds: &Bounds, cell_m: f64) -> Result<HeightMap> {
    height_map_of(points, None, bounds, cell_m, 1)
}

/// As [`height_map_within`], of the marked points if marks are given.
///
/// # Errors
///
/// As [`height_map`].
pub fn height_map_of<'a>(
    points: impl Into<Places<'a>>,
    marks: Option<&[bool]>,
    bounds: &Bounds,
    cell_m: f64,
    threads: usize,
) -> Result<HeightMap> {
    let points = points.into();
    let is_marked = |row: usize| marks.is_none_or(|marks| marks[row]);
    let count = marks.map_or(points.len(), |marks| marks.iter().filter(|&&is| is).count());
    let grid = Grid::over(bounds, cell_m, count)?;
    let fixed = Fixed::new(bounds.largest(), count);
    let threads = thread_count(threads);
    let part = |range: Range<usize>| {
        let rows = range.clone().zip(points.within(range));
        accumulate(rows.filter(|(row, _)| is_marked(*row)).map(|(_, p)| p), &grid, fixed)
    };
    let parts =
        map_chunks(points.len(), points.len().div_ceil(threads.min(PARTS)).max(1), threads, part);
    Ok(Cells::averaging(grid, merged(parts, &grid), fixed).averaged(threads))
}

/// The bounding box of points.
///
/// # Errors
///
/// No points.
pub fn bounds<'a>(points: impl Into<Places<'a>>) -> Result<Bounds> {
    let none = Error::TooFewPoints { what: "a height map", given: 0, needed: 1 };
    let points = points.into();
    points.ends(0..points.len()).map(|[min, max]| Bounds { min, max }).ok_or(none)
}

/// The points, averaged by cell.
pub(crate) struct Cells {
    pub(crate) grid: Grid,
    sums: Vec<CellSums>,
    /// Mean position of each cell's points.
    pub(crate) means: Vec<Option<Point>>,
}

impl Cells {
    /// The cells of width `cell_m` over a box around all points.
    pub(crate) fn within(points: &[Point], bounds: &Bounds, cell_m: f64) -> Result<Self> {
        let grid = Grid::over(bounds, cell_m, points.len())?;
        let fixed = Fixed::new(bounds.largest(), points.len());
        let sums = accumulate(points.iter().copied(), &grid, fixed);
        Ok(Self::averaging(grid, sums, fixed))
    }

    fn averaging(grid: Grid, sums: Vec<CellSums>, fixed: Fixed) -> Self {
        let means = sums.iter().map(|s| mean(s, fixed)).collect();
        Self { grid, sums, means }
    }

    fn averaged(self, threads: usize) -> HeightMap {
        let mut heights_m = vec![f64::NAN; self.grid.len()];
        fill_chunks(&mut heights_m, CHUNK, threads, |first, piece| {
            piece.iter_mut().zip(first..).for_each(|(height, cell)| *height = self.centered(cell));
        });
        self.with_heights(heights_m)
    }

    /// Height at the middle of a cell, in m.
    fn centered(&self, cell: usize) -> f64 {
        let Some(here) = self.means[cell] else { return f64::NAN };
        let center = self.grid.center(cell);
        let rise = |k: usize| slope(&self.grid, &self.means, cell, k) * (center[k] - here[k]);
        here[2] + rise(0) + rise(1)
    }

    pub(crate) fn with_heights(self, heights_m: Vec<f64>) -> HeightMap {
        HeightMap {
            grid: self.grid,
            heights_m,
            counts: self.sums.iter().map(|s| s.count).collect(),
        }
    }
}

fn accumulate(points: impl Iterator<Item = Point>, grid: &Grid, fixed: Fixed) -> Vec<CellSums> {
    let mut sums = vec![NOTHING; grid.len()];
    for p in points.polled() {
        let cell = &mut sums[grid.cell(&p)];
        cell.count += 1;
        (0..3).for_each(|k| cell.xyz[k] += fixed.encode(p[k]));
    }
    sums
}

/// The sums of all parts; integers, so their order does not matter.
fn merged(parts: Vec<Vec<CellSums>>, grid: &Grid) -> Vec<CellSums> {
    let add = |mut all: Vec<CellSums>, part: Vec<CellSums>| {
        for (sums, more) in all.iter_mut().zip(part) {
            sums.count += more.count;
            (0..3).for_each(|k| sums.xyz[k] += more.xyz[k]);
        }
        all
    };
    parts.into_iter().reduce(add).unwrap_or_else(|| vec![NOTHING; grid.len()])
}

fn mean(sums: &CellSums, fixed: Fixed) -> Option<Point> {
    (sums.count > 0).then(|| sums.xyz.map(|sum| fixed.mean(sum as f64, sums.count)))
}

/// The slope along axis `k`, between two neighbours or between one and the cell itself, as rise
/// over run.
///
/// Zero where it is steeper than any material stands: that is an edge between two surfaces, and the
/// mean of the points is the better height.
fn slope(grid: &Grid, means: &[Option<Point>], cell: usize, k: usize) -> f64 {
    let along = |step: isize| {
        let (dx, dy) = if k == 0 { (step, 0) } else { (0, step) };
        grid.neighbor(cell, dx, dy).and_then(|n| means[n]).or(means[cell])
    };
    let (Some(a), Some(b)) = (along(-1), along(1)) else { return 0.0 };
    let (run, rise) = (b[k] - a[k], b[2] - a[2]);
    if run >= 0.5 * grid.cell_m && rise.abs() <= NEVER_STEEPER * run { rise / run } else { 0.0 }
}

/// Volumes above and below a base.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Volume {
    /// Volume above the base, in m³.
    pub cut_m3: f64,
    /// Volume missing below the base, in m³; positive.
    pub fill_m3: f64,
    /// Area of the cells with a height, in m².
    pub area_m2: f64,
}

impl Volume {
    /// Cut less fill, in m³.
    #[must_use]
    pub fn net_m3(&self) -> f64 {
        self.cut_m3 - self.fill_m3
    }
}

/// Integrates heights above their base in m: the sum of cell area times height, cut and fill apart.
///
/// Cells whose height is NaN are left out; the caller fills or counts them.
///
/// # Examples
///
/// ```
/// use divespot_core::heightmap::integrate;
///
/// let volume = integrate([2.0, 1.0, -1.0, f64::NAN], 0.5);
/// assert_eq!((volume.cut_m3, volume.fill_m3, volume.area_m2), (0.75, 0.25, 0.75));
/// assert_eq!(volume.net_m3(), 0.5);
/// ```
#[must_use]
pub fn integrate(heights_above_base_m: impl IntoIterator<Item = f64>, cell_m: f64) -> Volume {
    let (mut cut, mut fill, mut cells) = (0.0, 0.0, 0.0);
    for height in heights_above_base_m.into_iter().filter(|h| !h.is_nan()) {
        cut += height.max(0.0);
        fill -= height.min(0.0);
        cells += 1.0;
    }
    let area = cell_m * cell_m;
    Volume { cut_m3: cut * area, fill_m3: fill * area, area_m2: cells * area }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn raster(n: i32, step: f64, height: impl Fn(f64, f64) -> f64) -> Vec<Point> {
        let at = |i: i32| (f64::from(i) + 0.5) * step;
        (0..n * n).map(|i| (at(i % n), at(i / n))).map(|(x, y)| [x, y, height(x, y)]).collect()
    }

    fn volume(points: &[Point], cell_m: f64) -> Volume {
        integrate(height_map(points, cell_m).unwrap().heights_m, cell_m)
    }

    #[test]
    fn solids_on_a_raster_have_their_volume() {
        let cone = raster(400, 0.005, |x, y| (0.8 - (x - 1.0).hypot(y - 1.0)).max(0.0) * 0.5);
        let truth = std::f64::consts::PI * 0.64 * 0.4 / 3.0;
        for cell_m in [0.005, 0.01, 0.02] {
            assert!((volume(&cone, cell_m).net_m3() / truth - 1.0).abs() < 1e-3, "{cell_m}");
        }
        let wedge = volume(&raster(128, 0.0625, |x, _| x / 4.0 - 0.5), 0.125);
        assert!((wedge.net_m3() - 32.0).abs() < 1e-9 && (wedge.area_m2 - 64.0).abs() < 1e-12);
        assert!((wedge.fill_m3 - 4.0).abs() < 1e-9);
    }

    #[test]
    fn points_crowded_in_a_corner_of_each_cell_do_not_tilt_the_volume() {
        let plane = |x: f64, y: f64| 0.3 * x + 0.2 * y;
        let even = raster(64, 0.25, plane);
        let crowded =
            even.iter().map(|p| [p[0] + 0.11, p[1] + 0.11, plane(p[0] + 0.11, p[1] + 0.11)]);
        let edge = [[0.0, 0.0, 0.0], [16.0, 16.0, plane(16.0, 16.0)]];
        let map = height_map(&crowded.chain(edge).collect::<Vec<_>>(), 0.25).unwrap();
        let inner = map.grid.columns * 20 + 20;
        let [x, y] = map.grid.center(inner);
        assert!((map.heights_m[inner] - plane(x, y)).abs() < 1e-9);
    }

    #[test]
    fn order_changes_no_bit_and_gaps_stay_gaps() {
        let points = raster(30, 0.1, |x, y| (x * y).sin());
        let mut shuffled = points.clone();
        shuffled.reverse();
        let map = height_map(&points[..450], 0.05).unwrap();
        assert_eq!(height_map(&points, 0.3).unwrap(), height_map(&shuffled, 0.3).unwrap());
        assert!(map.heights_m.iter().zip(&map.counts).all(|(h, &n)| h.is_nan() == (n == 0)));
    }

    #[test]
    fn impossible_grids_are_refused() {
        assert!(matches!(height_map(&[], 0.1), Err(Error::TooFewPoints { .. })));
        let far = [[0.0; 3], [1e9, 1e9, 0.0]];
        assert!(matches!(height_map(&far, 1e-3), Err(Error::GridTooLarge { .. })));
        assert!(matches!(height_map(&far, -1.0), Err(Error::Setting { .. })));
        assert_eq!(height_map(&[[4.0; 3]], 0.1).unwrap().heights_m, [4.0]);
    }

    #[test]
    fn a_grid_that_would_be_all_gaps_is_refused() {
        let refused = |millions: f64, points: usize| {
            let bounds = Bounds { min: [0.0; 3], max: [1e3 * millions - 1.0, 999.0, 0.0] };
            matches!(Grid::over(&bounds, 1.0, points), Err(Error::GridTooLarge { .. }))
        };
        // 2²² cells, or 64 a point, or 2²⁶ at most.
        assert!(refused(5.5, 1) && !refused(3.0, 1));
        assert!(refused(8.6, 100_000) && !refused(4.9, 100_000));
        assert!(refused(90.0, 2_000_000) && !refused(45.0, 2_000_000));
    }
}
