//! The heights of the points over each cell of a grid, sorted, in m.

use std::ops::Range;

use crate::Places;
use crate::cancel::Polled;
use crate::heightmap::Grid;
use crate::parallel::{fill_chunks, share};
use crate::robust::median;

/// Points for a thread at a time. Decides no answer.
const CHUNK: usize = 1 << 13;

/// Width of the blocks in which points are counted, in cells. Chosen: smaller ones are filled by
/// one pile's density, larger ones even out a scan that thins with range.
const BLOCK: usize = 8;
/// A surface holds at least this share of the typical number of points of the cells around: either
/// the sensor sees most of a cell's surface, or it sees something in front of it. Chosen on the
/// scenes of `divespot evaluate`.
const LEAST: f64 = 0.25;
/// Points on this many scan lines or more above a surface may be a face. The lowest of them is then
/// at most `WIDER` line spacings above the surface. Chosen: fewer lines take two outliers for a
/// face, more lose low walls.
const LINES: usize = 3;
const WIDER: f64 = 1.5;

/// The sorted heights of the points over each cell: 8 bytes for each point and 4 for each cell.
#[derive(Debug)]
pub(crate) struct Columns {
    pub(crate) grid: Grid,
    start: Vec<u32>,
    heights_m: Vec<f64>,
}

impl Columns {
    /// The columns of the points over the grid.
    pub(crate) fn of<'a>(points: impl Into<Places<'a>>, grid: Grid, threads: usize) -> Self {
        let points = points.into();
        let mut cells = vec![0_u32; points.len()];
        fill_chunks(&mut cells, CHUNK, threads, |first, piece| {
            let places = points.within(first..first + piece.len());
            piece.iter_mut().zip(places).for_each(|(cell, p)| *cell = grid.cell(&p) as u32);
        });
        let start = starts(&cells, grid.len());
        let mut heights_m = vec![0.0; cells.len()];
        let slabs = slabs_of(&start, &mut heights_m, threads);
        share(slabs.into_iter(), threads, |slab| slab.fill(points, &cells));
        Self { grid, start, heights_m }
    }

    fn range(&self, cell: usize) -> Range<usize> {
        self.start[cell] as usize..self.start[cell + 1] as usize
    }

    /// The heights of a cell's points in m, ascending.
    pub(crate) fn heights(&self, cell: usize) -> &[f64] {
        &self.heights_m[self.range(cell)]
    }

    /// The heights of a cell's points from `low` to `high`.
    pub(crate) fn between(&self, cell: usize, low: f64, high: f64) -> &[f64] {
        let heights = self.heights(cell);
        let first = heights.partition_point(|&z| z < low);
        let last = heights.partition_point(|&z| z <= high);
        &heights[first..last.max(first)]
    }

    /// The highest point of a cell, if points rise from `height_m` without a gap. A gap, above the
    /// points within `reach_m`, is wider than `reach_m` and than 1.5 times the spacing of the scan
    /// lines above.
    pub(crate) fn rises(&self, cell: usize, height_m: f64, reach_m: f64) -> Option<f64> {
        let heights = self.heights(cell);
        let above = &heights[heights.partition_point(|&z| z <= height_m + reach_m)..];
        let gap_m = reach_m.max(WIDER * step_m(above, reach_m));
        (*above.first()? <= height_m + reach_m + gap_m).then(|| above[above.len() - 1])
    }

    /// The lowest point of a cell that is connected to `height_m` by points with gaps of at most
    /// `gap_m`.
    pub(crate) fn lowest(&self, cell: usize, height_m: f64, gap_m: f64) -> f64 {
        let heights = self.heights(cell);
        let below = &heights[..heights.partition_point(|&z| z <= height_m)];
        end_of_run(below.iter().rev(), height_m, gap_m)
    }

    /// The highest such point.
    pub(crate) fn highest(&self, cell: usize, height_m: f64, gap_m: f64) -> f64 {
        let heights = self.heights(cell);
        let above = &heights[heights.partition_point(|&z| z <= height_m)..];
        end_of_run(above.iter(), height_m, gap_m)
    }

    /// The number of points that make a surface in each cell: a share of what the cells around, or
    /// of the whole scene, typically hold, whichever is least. Along a wall and around a person,
    /// cells hold more.
    pub(crate) fn needs(&self) -> Needs {
        let across = |n: usize| n.div_ceil(BLOCK);
        let (columns, rows) = (across(self.grid.columns), across(self.grid.rows));
        let mut blocks: Vec<Vec<u32>> = vec![Vec::new(); columns * rows];
        let block = |cell: usize| block_of(cell, self.grid.columns);
        let count = |cell: usize| self.range(cell).len() as u32;
        for cell in (0..self.grid.len()).polled().filter(|&cell| count(cell) > 0) {
            blocks[block(cell)].push(count(cell));
        }
        let scene = need(blocks.concat());
        let needs: Vec<u32> = blocks.into_iter().map(need).collect();
        let blocks = Grid { columns, rows, ..self.grid };
        let least = |at: usize| blocks.around(at, 1).map(|n| needs[n]).fold(scene, u32::min);
        Needs { of_block: (0..needs.len()).map(least).collect(), columns: self.grid.columns }
    }
}

/// The number of points that make a surface, by blocks of cells.
pub(crate) struct Needs {
    pub(super) of_block: Vec<u32>,
    /// Cells in a row of the grid.
    pub(super) columns: usize,
}

impl Needs {
    /// The number in a cell.
    pub(crate) fn of(&self, cell: usize) -> usize {
        self.of_block[block_of(cell, self.columns)] as usize
    }
}

/// The block of a cell.
fn block_of(cell: usize, columns: usize) -> usize {
    cell / columns / BLOCK * columns.div_ceil(BLOCK) + cell % columns / BLOCK
}

/// The last of `heights` before a gap, counted from `height_m`.
fn end_of_run<'a>(mut heights: impl Iterator<Item = &'a f64>, height_m: f64, gap_m: f64) -> f64 {
    let joined = |end: f64, z: &f64| if (z - end).abs() <= gap_m { Ok(*z) } else { Err(end) };
    heights.try_fold(height_m, joined).unwrap_or_else(|end| end)
}

/// Spacing of the scan lines on a face, in m; 0 where the points above a surface are closer than
/// `reach_m`, or on few lines.
fn step_m(above: &[f64], reach_m: f64) -> f64 {
    let gaps = || above.windows(2).map(|pair| pair[1] - pair[0]);
    let wide: Vec<f64> = gaps().filter(|&gap| gap > 0.5 * reach_m).collect();
    let close = gaps().filter(|gap| (0.1 * reach_m..=0.5 * reach_m).contains(gap)).count();
    if wide.len() < LINES || wide.len() < close { 0.0 } else { median(wide) }
}

fn need(mut counts: Vec<u32>) -> u32 {
    if counts.is_empty() {
        return u32::MAX;
    }
    let half = counts.len() / 2;
    (LEAST * f64::from(*counts.select_nth_unstable(half).1)).max(1.0) as u32
}

/// The columns of some consecutive cells.
struct Slab<'a> {
    cells: Range<u32>,
    /// The start of each column, and the end of the last.
    start: &'a [u32],
    heights_m: &'a mut [f64],
}

/// One slab for each thread, with roughly equal numbers of points.
fn slabs_of<'a>(start: &'a [u32], mut heights_m: &'a mut [f64], threads: usize) -> Vec<Slab<'a>> {
    let (last, count) = (start.len() - 1, heights_m.len());
    let mut first = 0;
    let take = |thread: usize| {
        let most = (count * (thread + 1) / threads) as u32;
        let end = if thread + 1 == threads { last } else { start.partition_point(|&s| s < most) };
        let end = end.clamp(first, last);
        let start = &start[first..=end];
        let held = (start[start.len() - 1] - start[0]) as usize;
        let cells = std::mem::replace(&mut first, end) as u32..end as u32;
        Slab { cells, start, heights_m: heights_m.split_off_mut(..held).unwrap_or_default() }
    };
    (0..threads).map(take).collect()
}

impl Slab<'_> {
    /// Sorts the heights of all points into these columns, and each column by height.
    fn fill(self, points: Places<'_>, cells: &[u32]) {
        let Self { cells: own, start, heights_m } = self;
        let mut next: Vec<u32> = start.iter().map(|s| s - start[0]).collect();
        for (cell, p) in cells.iter().zip(points.iter()).polled() {
            if own.contains(cell) {
                let next = &mut next[(cell - own.start) as usize];
                heights_m[*next as usize] = p[2];
                *next += 1;
            }
        }
        for column in start.windows(2).polled() {
            let range = (column[0] - start[0]) as usize..(column[1] - start[0]) as usize;
            heights_m[range].sort_unstable_by(f64::total_cmp);
        }
    }
}

/// The first index of each cell's points when they are sorted by cell.
fn starts(cells: &[u32], count: usize) -> Vec<u32> {
    let mut start = vec![0; count + 1];
    cells.iter().polled().for_each(|&cell| start[cell as usize + 1] += 1);
    for cell in 0..count {
        start[cell + 1] += start[cell];
    }
    start
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Point;

    /// Points at these heights over the cells of a grid with cells 1 m wide.
    fn columns_of(size: [usize; 2], heights: impl Fn(usize) -> Vec<f64>) -> Columns {
        let grid = Grid { origin_m: [0.0; 2], cell_m: 1.0, columns: size[0], rows: size[1] };
        let over = |cell: usize| {
            let [x, y] = grid.center(cell);
            heights(cell).into_iter().map(move |z| [x, y, z])
        };
        Columns::of(&(0..grid.len()).flat_map(over).collect::<Vec<Point>>(), grid, 2)
    }

    #[test]
    fn points_are_kept_by_cell_from_the_lowest_up() {
        let grid = Grid { origin_m: [0.0; 2], cell_m: 1.0, columns: 2, rows: 1 };
        let points = [[0.5, 0.5, 3.0], [1.5, 0.2, 0.0], [0.1, 0.2, -1.0], [0.9, 0.9, 0.5]];
        for threads in [1, 2, 5] {
            let columns = Columns::of(&points, grid, threads);
            assert_eq!(
                (columns.heights(0), columns.heights(1)),
                (&[-1.0, 0.5, 3.0][..], &[0.0][..])
            );
            assert_eq!(columns.between(0, -1.0, 0.5), [-1.0, 0.5]);
            assert!(columns.between(0, 0.6, 2.9).is_empty());
            assert!(columns.between(0, 2.0, 1.0).is_empty());
        }
    }

    #[test]
    fn what_stands_on_a_surface_rises_and_what_hangs_over_it_does_not() {
        let rises = |heights: &[f64]| columns_of([1, 1], |_| heights.to_vec()).rises(0, 0.0, 1.0);
        assert_eq!(rises(&[0.0, 0.9, 1.8, 2.5, 7.0]), Some(7.0));
        assert_eq!(rises(&[0.0, 2.1, 7.0]), None);
        assert_eq!(rises(&[-3.0, 0.0, 1.0]), None);
    }

    #[test]
    fn a_face_on_which_scan_lines_lie_far_apart_rises_too() {
        let rises = |heights: &[f64]| columns_of([1, 1], |_| heights.to_vec()).rises(0, 0.0, 1.0);
        assert_eq!(rises(&[0.0, 3.0, 5.5, 8.0, 10.5]), Some(10.5));
        assert_eq!(rises(&[0.0, 3.0, 5.5, 8.0]), None);
        assert_eq!(rises(&[0.0, 6.0, 8.5, 11.0, 13.5]), None);
    }

    #[test]
    fn a_run_of_points_ends_where_the_gap_is_wider() {
        let columns = columns_of([1, 1], |_| vec![-5.0, -1.0, 0.0, 0.8, 1.7, 4.0]);
        let run =
            |height_m: f64| (columns.lowest(0, height_m, 1.0), columns.highest(0, height_m, 1.0));
        assert_eq!(run(0.1), (-1.0, 1.7));
        assert_eq!(run(2.5), (-1.0, 2.5));
    }

    #[test]
    fn a_surface_holds_a_quarter_of_what_cells_around_typically_do() {
        // Blocks of 8 by 8 cells: with 12 points in each cell, with 40, and half with 12 and half
        // with 40.
        let counts = |cell: usize| match cell % 24 {
            0..8 | 16..20 => 12,
            _ => 40,
        };
        let needs = columns_of([24, 8], |cell| vec![0.0; counts(cell)]).needs();
        assert!((0..24 * 8).all(|cell| needs.of(cell) == if cell % 24 < 16 { 3 } else { 10 }));
        let bare = columns_of([9, 1], |cell| if cell < 8 { vec![0.0] } else { vec![] });
        assert!((0..9).all(|cell| bare.needs().of(cell) == 1));
    }

    #[test]
    fn where_somebody_stands_no_more_points_are_needed_than_anywhere() {
        let needs =
            columns_of([24, 8], |cell| vec![0.0; if cell % 24 < 8 { 400 } else { 40 }]).needs();
        assert!((0..24 * 8).all(|cell| needs.of(cell) == 10));
    }
}
