//! Which cells lie inside the scan (convex hull of the seen cells), and which seen cells are
//! isolated.

use crate::cancel::Polled;
use crate::heightmap::Grid;
use crate::pose::convex_hull;

/// A seen cell is isolated, and no evidence of the surface, if the number of seen cells within
/// [`NEAR`] cells of it is below this share of the typical number. Below that of a corner of the
/// scan, 0.36 (closed form: 9 cells of 25); lower keeps more outliers, higher eats corners.
const LONE: f64 = 0.25;
/// Half-width, in cells, of the square in which seen cells are counted. Chosen: smaller squares are
/// filled by a clump of outliers, larger ones find narrow strips of a scan isolated.
pub(crate) const NEAR: usize = 2;

/// Cells outside the convex hull of the seen cells: beyond the scan, not in an occlusion shadow.
pub(crate) fn off_scan_cells(grid: &Grid, heights_m: &[f64]) -> Vec<bool> {
    let mut ends = Vec::new();
    for (row, heights) in heights_m.chunks(grid.columns.max(1)).enumerate() {
        let seen = |h: &f64| !h.is_nan();
        if let (Some(a), Some(b)) = (heights.iter().position(seen), heights.iter().rposition(seen))
        {
            ends.extend([a, b].map(|column| [column as f64, row as f64, 0.0]));
        }
    }
    let hull = convex_hull(&ends, 1);
    let spans: Vec<[f64; 2]> = (0..grid.rows).map(|row| span(&hull, row as f64)).collect();
    let outside = |cell: usize| {
        let ([low, high], column) = (spans[cell / grid.columns], (cell % grid.columns) as f64);
        column < low || column > high
    };
    (0..grid.len()).polled().map(outside).collect()
}

/// The columns at which a row enters and leaves a convex polygon.
fn span(hull: &[[f64; 2]], row: f64) -> [f64; 2] {
    let mut span = [f64::INFINITY, f64::NEG_INFINITY];
    for (a, b) in hull.iter().zip(hull.iter().cycle().skip(1)) {
        if row < a[1].min(b[1]) || row > a[1].max(b[1]) {
            continue;
        }
        let along = if a[1] == b[1] { 0.0 } else { (row - a[1]) / (b[1] - a[1]) };
        for x in [a[0] + along * (b[0] - a[0]), if a[1] == b[1] { b[0] } else { f64::NAN }] {
            span = [span[0].min(x), span[1].max(x)];
        }
    }
    span
}

/// The heights without those of nearly isolated cells.
pub(crate) fn without_lone(grid: &Grid, heights_m: &[f64]) -> Vec<f64> {
    let company = company_of(grid, heights_m);
    let seen = (0..grid.len()).filter(|&cell| !heights_m[cell].is_nan());
    let typical = crate::robust::median(seen.map(|cell| f64::from(company[cell])).collect());
    let lone = |cell: usize| f64::from(company[cell]) < LONE * typical;
    let kept = |(cell, &h): (usize, &f64)| if lone(cell) { f64::NAN } else { h };
    heights_m.iter().enumerate().map(kept).collect()
}

/// Number of seen cells in the square around each cell, including the cell itself.
fn company_of(grid: &Grid, heights_m: &[f64]) -> Vec<u32> {
    let (columns, rows) = (grid.columns, grid.rows);
    let in_row = |cell: usize| {
        let (row, column) = (cell / columns * columns, cell % columns);
        let near = column.saturating_sub(NEAR)..(column + NEAR + 1).min(columns);
        near.filter(|c| !heights_m[row + c].is_nan()).count() as u32
    };
    let along: Vec<u32> = (0..grid.len()).polled().map(in_row).collect();
    let around = |cell: usize| {
        let (row, column) = (cell / columns, cell % columns);
        let near = row.saturating_sub(NEAR)..(row + NEAR + 1).min(rows);
        near.map(|r| along[r * columns + column]).sum()
    };
    (0..grid.len()).polled().map(around).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    const GRID: Grid = Grid { origin_m: [0.0; 2], cell_m: 0.5, columns: 20, rows: 20 };

    fn heights_of(seen: impl Fn([f64; 2]) -> bool) -> Vec<f64> {
        let height = |cell: usize| if seen(GRID.center(cell)) { 1.0 } else { f64::NAN };
        (0..GRID.len()).map(height).collect()
    }

    #[test]
    fn a_hole_is_not_beyond_the_scan_and_its_corners_are() {
        let disc = |[x, y]: [f64; 2]| ((x - 5.0).hypot(y - 5.0) - 3.0).abs() < 1.0;
        let off_scan = off_scan_cells(&GRID, &heights_of(disc));
        for (cell, &off_scan) in off_scan.iter().enumerate() {
            let [x, y] = GRID.center(cell);
            let r = (x - 5.0).hypot(y - 5.0);
            assert!(off_scan || r < 4.05, "{x} {y}");
            assert!(!off_scan || r > 3.6, "{x} {y}");
        }
        assert!(super::off_scan_cells(&GRID, &heights_of(|_| false)).iter().all(|&b| b));
    }

    #[test]
    fn a_lone_cell_goes_and_a_corner_stays() {
        let lone = [7.25, 7.25];
        let heights = heights_of(|p| p == lone || p[0] < 5.0 && p[1] < 5.0);
        let kept = without_lone(&GRID, &heights);
        for cell in 0..GRID.len() {
            let expected = heights[cell].is_nan() || GRID.center(cell) == lone;
            assert_eq!(kept[cell].is_nan(), expected, "{:?}", GRID.center(cell));
        }
    }

    #[test]
    fn what_has_a_quarter_of_the_usual_company_within_two_cells_stays() {
        // On a floor a cell has 25 around it. A block of 2 by 2 has 4, one of 3 by 3 has 9.
        let block = |[x, y]: [f64; 2], y0: f64, edge: f64| {
            (7.0..7.0 + edge).contains(&x) && (y0..y0 + edge).contains(&y)
        };
        let floor = |p: [f64; 2]| p[0] < 5.0;
        let all = heights_of(|p| floor(p) || block(p, 1.0, 1.0) || block(p, 6.0, 1.5));
        let kept = without_lone(&GRID, &all);
        for cell in (0..GRID.len()).filter(|&cell| !all[cell].is_nan()) {
            let p = GRID.center(cell);
            assert_eq!(kept[cell].is_nan(), block(p, 1.0, 1.0), "{p:?}");
        }
    }
}
