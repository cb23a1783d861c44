//! Which cells of a height map slope gently (less than 7.5°), measured over windows in which the
//! noise of the slope is small.

use std::collections::VecDeque;

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
        let half = to_f64(reach * (2 * reach + 1));
        let run = to_f64(reach + 1) * grid.cell_m;
        let (columns, rows) = (Span::all(grid.columns, reach), Span::all(grid.rows, reach));
        let mut sums = SummedArea::begun(grid, heights_m);
        let mut slopes: Vec<[f64; 2]> = Vec::with_capacity(grid.len());
        for row in rows.iter().polled() {
            sums.go_on(row.all);
            let [all, before, after] = [row.all, row.before, row.after].map(|rows| sums.rows(rows));
            let slope = |column: &Span| {
                let along = mean(all, column.after, half) - mean(all, column.before, half);
                let across = mean(after, column.all, half) - mean(before, column.all, half);
                [along / run, across / run]
            };
            slopes.extend(columns.iter().map(slope));
        }
        let tilt = tilt_of(&slopes);
        let gentle = |s: &[f64; 2]| (s[0] - tilt[0]).hypotenuse(s[1] - tilt[1]) <= GENTLE;
        Self { reach, noise_m, gentle: slopes.iter().map(gentle).collect() }
    }
}

/// The slope of the whole scene, if it is flatter than any flank; for scans of hillsides that were
/// not levelled.
fn tilt_of(slopes: &[[f64; 2]]) -> [f64; 2] {
    let median_of = |k: usize| {
        let mut known = Vec::with_capacity(slopes.len());
        known.extend(slopes.iter().map(|s| s[k]).filter(|v| !v.is_nan()));
        median(known)
    };
    let tilt = [0, 1].map(median_of);
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

/// A row of a summed-area table: of the seen heights and of their number.
type Sums = Vec<(f64, f64)>;

/// The rows of the summed-area table that a window needs, as it moves up.
struct SummedArea<'a> {
    heights_m: std::slice::Chunks<'a, f64>,
    rows: VecDeque<Sums>,
    /// The number of the first of these rows.
    first: usize,
}

impl<'a> SummedArea<'a> {
    fn begun(grid: &Grid, heights_m: &'a [f64]) -> Self {
        let below = vec![(0.0, 0.0); grid.columns + 1];
        let heights_m = heights_m.chunks(grid.columns.max(1));
        Self { heights_m, rows: VecDeque::from([below]), first: 0 }
    }

    /// Adds the rows up to the window's last, and drops those before its first.
    fn go_on(&mut self, (first, end): Ends) {
        while self.first + self.rows.len() <= end
            && let (Some(below), Some(heights_m)) = (self.rows.back(), self.heights_m.next())
        {
            let row = above(below, heights_m);
            self.rows.push_back(row);
        }
        self.rows.drain(..first - self.first);
        self.first = first;
    }

    /// The rows below and above some rows of cells.
    fn rows(&self, (first, end): Ends) -> [&Sums; 2] {
        [first, end].map(|row| &self.rows[row - self.first])
    }
}

/// The next row of a summed-area table.
fn above(below: &Sums, heights_m: &[f64]) -> Sums {
    let mut line = (0.0, 0.0);
    let mut sums = Vec::with_capacity(below.len());
    sums.push(below[0]);
    for (height, below) in heights_m.iter().zip(&below[1..]) {
        if !height.is_nan() {
            line = (line.0 + height, line.1 + 1.0);
        }
        sums.push((below.0 + line.0, below.1 + line.1));
    }
    sums
}

/// Mean over some columns of some rows; NaN if fewer than half of `cells` cells were seen.
fn mean([low, high]: [&Sums; 2], (x0, x1): Ends, cells: f64) -> f64 {
    let (a, b, c, d) = (low[x0], low[x1], high[x0], high[x1]);
    let (sum, count) = (d.0 - b.0 - c.0 + a.0, d.1 - b.1 - c.1 + a.1);
    if 2.0 * count >= cells { sum / count } else { f64::NAN }
}
