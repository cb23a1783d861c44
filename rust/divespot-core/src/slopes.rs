//! Which cells of a height map slope gently (less than 7.5°), measured over windows in which the
//! noise of the slope is small.

use crate::cancel::Polled;
use crate::count::to_f64;
use crate::heightmap::Grid;
use crate::hypotenuse::Hypotenuse;
use crate::material::{FLATTEST, GENTLE};
use crate::robust::{median, scale};

/// The window is so wide that the noise of the slope is this many times smaller than [`GENTLE`].
/// Chosen: lower roughens level ground, higher rounds off edges.
const CERTAIN: f64 = 8.0;
/// Half-widths of that window, in cells. Chosen: wider windows blur what is as small as a pile,
/// narrower ones leave noisy ground steep.
const REACHES: std::ops::RangeInclusive<usize> = 1..=6;

/// Whether the slope across the window around each cell is gentle.
pub(crate) struct Slopes {
    /// Half-width of the window, in cells.
    pub(crate) reach: usize,
    /// Standard deviation of a cell's height, in m.
    pub(crate) noise_m: f64,
    pub(crate) gentle: Vec<bool>,
}

impl Slopes {
    pub(crate) fn of(grid: &Grid, heights_m: &[f64]) -> Self {
        let noise_m = cell_noise(grid, heights_m);
        let reach = reach_of(grid, noise_m);
        let sums = SummedArea::of(grid, heights_m);
        let half = to_f64(reach * (2 * reach + 1));
        let run = to_f64(reach + 1) * grid.cell_m;
        let slope = |columns: &Span, rows: &Span| {
            let mean = |columns, rows| sums.mean(columns, rows, half);
            let along = mean(columns.after, rows.all) - mean(columns.before, rows.all);
            let across = mean(columns.all, rows.after) - mean(columns.all, rows.before);
            [along / run, across / run]
        };
        let (columns, rows) = (Span::all(grid.columns, reach), Span::all(grid.rows, reach));
        let line = |row| columns.iter().map(move |column| slope(column, row));
        let slopes: Vec<[f64; 2]> = rows.iter().polled().flat_map(line).collect();
        let tilt = tilt_of(&slopes);
        let gentle = |s: &[f64; 2]| (s[0] - tilt[0]).hypotenuse(s[1] - tilt[1]) <= GENTLE;
        Self { reach, noise_m, gentle: slopes.iter().map(gentle).collect() }
    }
}

/// The slope of the whole scene, if it is flatter than any flank; for scans of hillsides that were
/// not levelled.
fn tilt_of(slopes: &[[f64; 2]]) -> [f64; 2] {
    let known = |k: usize| slopes.iter().map(|s| s[k]).filter(|v| !v.is_nan()).collect();
    let tilt = [0, 1].map(|k| median(known(k)));
    if tilt[0].hypotenuse(tilt[1]) < FLATTEST { tilt } else { [0.0; 2] }
}

/// Half-width, in cells, of a window over which the noise of the slope is small.
fn reach_of(grid: &Grid, noise: f64) -> usize {
    let certain = |&k: &usize| {
        let half = to_f64(k * (2 * k + 1));
        noise * (2.0 / half).sqrt() * CERTAIN <= GENTLE * to_f64(k + 1) * grid.cell_m
    };
    REACHES.into_iter().find(certain).unwrap_or(*REACHES.end())
}

/// Noise of a cell's height in m, from second differences along the rows: their standard deviation
/// over √6.
fn cell_noise(grid: &Grid, heights_m: &[f64]) -> f64 {
    let bends = heights_m
        .chunks(grid.columns.max(1))
        .flat_map(|row| row.windows(3).map(|h| h[0] - 2.0 * h[1] + h[2]));
    scale(bends.filter(|b| !b.is_nan())) / 6.0_f64.sqrt()
}

/// First column (or row) of a range, and the one after its last.
type Ends = (usize, usize);

/// Columns (or rows) of the window around one, clipped to the grid: all, and those on either side.
struct Span {
    all: Ends,
    before: Ends,
    after: Ends,
}

impl Span {
    /// The window of half-width `reach` around each of `count` columns.
    fn all(count: usize, reach: usize) -> Vec<Self> {
        let around = |at: usize| {
            let (first, end) = (at.saturating_sub(reach), (at + reach + 1).min(count));
            Self { all: (first, end), before: (first, at), after: (at + 1, end) }
        };
        (0..count).map(around).collect()
    }
}

/// Summed-area table of the seen heights and of their number.
struct SummedArea<'a> {
    grid: &'a Grid,
    sums: Vec<(f64, f64)>,
}

impl<'a> SummedArea<'a> {
    fn of(grid: &'a Grid, heights_m: &[f64]) -> Self {
        let width = grid.columns + 1;
        let mut sums = vec![(0.0, 0.0); width * (grid.rows + 1)];
        for row in (0..grid.rows).polled() {
            let mut line = (0.0, 0.0);
            for column in 0..grid.columns {
                let height = heights_m[row * grid.columns + column];
                if !height.is_nan() {
                    line = (line.0 + height, line.1 + 1.0);
                }
                let below = sums[row * width + column + 1];
                sums[(row + 1) * width + column + 1] = (below.0 + line.0, below.1 + line.1);
            }
        }
        Self { grid, sums }
    }

    /// Mean over some columns and rows; NaN if fewer than half of `cells` cells were seen.
    fn mean(&self, (x0, x1): Ends, (y0, y1): Ends, cells: f64) -> f64 {
        let at = |x: usize, y: usize| self.sums[y * (self.grid.columns + 1) + x];
        let (a, b, c, d) = (at(x0, y0), at(x1, y0), at(x0, y1), at(x1, y1));
        let (sum, count) = (d.0 - b.0 - c.0 + a.0, d.1 - b.1 - c.1 + a.1);
        if 2.0 * count >= cells { sum / count } else { f64::NAN }
    }
}
