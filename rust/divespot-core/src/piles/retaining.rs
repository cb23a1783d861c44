//! Retaining walls, recognised by the surface on both sides without any point on their faces.
//!
//! From above, the top of a wall looks like an object that hangs in the air: no point lies between
//! it and the ground. But below a hanging object the surface continues no steeper than material
//! lies (50°), while across a retaining wall it drops at once. Heights in m.

use crate::connectivity::AXES;
use crate::heightmap::Grid;
use crate::hypotenuse::Hypotenuse;
use crate::material::STEEPEST_POURED;
use crate::near_plane::{near_plane, places_about};

/// Fewest cells across which the surface drops, for a retaining wall. Chosen on the scenes of
/// `divespot evaluate`.
const RETAINED: usize = 8;
/// The surface before a wall is fitted to its cells within this many columns and rows. Chosen:
/// fewer follow noise, more reach past the foot of what lies there.
const SUPPORT: usize = 4;
/// Largest thickness of a wall, in cells. Chosen on the scenes of `divespot evaluate`.
const WIDEST: isize = 12;

/// Whether a thing is a retaining wall: across it the surface drops more steeply than poured
/// material lies. Below a hanging thing it does not.
pub(super) fn is_retaining(grid: &Grid, heights_m: &[f64], thing: &[usize], margin_m: f64) -> bool {
    let across = |cell: usize, (dx, dy): (isize, isize)| {
        let end = |sign: isize| {
            let at = |k: isize| grid.neighbor(cell, sign * k * dx, sign * k * dy);
            (1..=WIDEST).find_map(|k| at(k).filter(|&n| !heights_m[n].is_nan()).map(|n| (k, n)))
        };
        let (Some((a, m)), Some((b, n))) = (end(1), end(-1)) else { return false };
        let run_m = ((a + b) as f64) * (dx as f64).hypotenuse(dy as f64) * grid.cell_m;
        (heights_m[m] - heights_m[n]).abs() > STEEPEST_POURED * run_m + margin_m
    };
    let retains =
        |&&cell: &&usize| heights_m[cell].is_nan() && AXES.iter().any(|&axis| across(cell, axis));
    thing.iter().filter(retains).nth(RETAINED - 1).is_some()
}

/// The first and last cell with a surface in each row and in each column.
pub(super) struct Ends {
    rows: Vec<[usize; 2]>,
    columns: Vec<[usize; 2]>,
}

impl Ends {
    pub(super) fn of(grid: &Grid, heights_m: &[f64]) -> Self {
        let none = [usize::MAX, 0];
        let mut ends = Self { rows: vec![none; grid.rows], columns: vec![none; grid.columns] };
        for cell in (0..heights_m.len()).filter(|&cell| !heights_m[cell].is_nan()) {
            let (column, row) = (cell % grid.columns, cell / grid.columns);
            for (line, at) in [(&mut ends.rows[row], column), (&mut ends.columns[column], row)] {
                *line = [line[0].min(at), line[1].max(at)];
            }
        }
        ends
    }

    /// Whether a surface lies within the thickness of a wall on one side of a cell, and none on the
    /// other.
    fn is_last(&self, grid: &Grid, cell: usize) -> bool {
        let (column, row) = (cell % grid.columns, cell / grid.columns);
        let beyond = |[first, last]: [usize; 2], at: usize| {
            let away = if at < first { first - at } else { at.saturating_sub(last) };
            first <= last && away > 0 && away <= WIDEST.unsigned_abs()
        };
        beyond(self.rows[row], column) || beyond(self.columns[column], row)
    }
}

/// Whether a thing ends the scan as a wall does: it rises from a surface on one side of it, and
/// there is none on the other. A thing that hangs over the surface has it on both sides, except at
/// the edge of the view.
pub(super) fn ends_scan(grid: &Grid, ends: &Ends, thing: &[usize], rises: &[bool]) -> bool {
    let last = thing.iter().filter(|&&cell| ends.is_last(grid, cell));
    2 * last.count() > thing.len() && thing.iter().filter(|&&cell| rises[cell]).count() >= RETAINED
}

/// Whether a cell beside a retaining wall holds some of the wall: it is higher than the surface
/// before it, extrapolated.
pub(super) fn is_lip(
    grid: &Grid,
    heights_m: &[f64],
    retaining: &[bool],
    cell: usize,
    margin_m: f64,
) -> bool {
    if heights_m[cell].is_nan() || retaining[cell] || !grid.around(cell, 1).any(|n| retaining[n]) {
        return false;
    }
    let of_wall = grid.around(cell, 1).filter(|&n| retaining[n]);
    let to_wall = places_about(grid, heights_m, cell, of_wall);
    let [u, v] = to_wall.iter().fold([0.0; 2], |sum, p| [sum[0] + p[0], sum[1] + p[1]]);
    let is_clean = |&n: &usize| !heights_m[n].is_nan() && !grid.around(n, 1).any(|n| retaining[n]);
    let mut before =
        places_about(grid, heights_m, cell, grid.around(cell, SUPPORT).filter(is_clean));
    before.retain(|p| p[0] * u + p[1] * v < 0.0);
    near_plane(&before).is_some_and(|surface| heights_m[cell] > surface[0] + margin_m)
}

#[cfg(test)]
mod tests {
    use super::super::face::tests::{objects, pile};
    use super::super::tests::CELL;
    use super::*;
    use crate::Point;

    const STEP: f64 = CELL / 3.0;

    fn cone(x: f64, y: f64) -> f64 {
        (0.5 * (1.2 - (x - 4.0).hypot(y - 3.0))).max(0.0)
    }

    /// Points a third of a cell apart, seen from above; where `over` gives a height, it hides what
    /// is below.
    fn seen_from_above(
        surface: impl Fn(f64, f64) -> f64,
        over: impl Fn(f64, f64) -> Option<f64>,
    ) -> Vec<Point> {
        let at = |i: i32| (f64::from(i) + 0.5) * STEP;
        let place = |i: i32| (at(i % 384), at(i / 384));
        let point = |(x, y)| [x, y, over(x, y).unwrap_or_else(|| surface(x, y))];
        (0..384 * 288).map(place).map(point).collect()
    }

    fn strip(x: f64, top_m: f64) -> Option<f64> {
        (4.3..4.4).contains(&x).then_some(top_m)
    }

    #[test]
    fn a_wall_of_which_only_the_top_was_seen_is_no_part_of_the_pile() {
        let before = |x: f64, y: f64| if x < 4.3 { cone(x, y) } else { 0.0 };
        let points = seen_from_above(before, |x, _| strip(x, 0.7));
        let at = |i: i32, from: f64| from + 0.01 * (f64::from(i) + 0.5);
        let truth: f64 =
            (0..240 * 240).map(|i| 1e-4 * before(at(i % 240, 2.8), at(i / 240, 1.8))).sum();
        let object = pile(&points);
        let off = object.volume.net_m3() - truth;
        assert!(off.abs() < 2.0 * object.budget.combined_m3(), "{off} of {truth}");
        assert!(off.abs() < 0.03 * truth && object.leans_on_wall, "{off} of {truth}");
        assert!(objects(&points).iter().filter(|o| o.reason.is_none()).count() == 1);
    }

    #[test]
    fn below_a_belt_the_pile_goes_on() {
        let truth = std::f64::consts::PI * 1.44 * 0.6 / 3.0;
        let object = pile(&seen_from_above(cone, |x, _| strip(x, 0.7)));
        assert!((object.volume.net_m3() / truth - 1.0).abs() < 0.01 && !object.leans_on_wall);
    }

    /// A map of 40 by 40 cells of 1 m; unseen from column `from` on, over `wide` columns.
    fn across(from: usize, wide: usize, low_m: f64) -> (Grid, Vec<f64>) {
        let grid = Grid { origin_m: [0.0; 2], cell_m: 1.0, columns: 40, rows: 40 };
        let height = |cell: usize| match cell % 40 {
            column if column < from => 30.0,
            column if column < from + wide => f64::NAN,
            _ => low_m,
        };
        let heights_m = (0..grid.len()).map(height).collect();
        (grid, heights_m)
    }

    fn retains(wide: usize, low_m: f64, cells: usize) -> bool {
        let (grid, heights_m) = across(10, wide, low_m);
        let thing: Vec<usize> = (0..cells).map(|row| row * 40 + 10).collect();
        is_retaining(&grid, &heights_m, &thing, 0.0)
    }

    #[test]
    fn a_wall_holds_back_what_would_lie_steeper_than_50_degrees_across_it() {
        // Two cells wide: three from the middle of one side to that of the other; at 50°, a drop of
        // 3.6 m.
        assert!(retains(2, 30.0 - 3.7, 8) && !retains(2, 30.0 - 3.5, 8));
        assert!(!retains(2, 30.0 - 3.7, 7));
    }

    #[test]
    fn a_wall_ends_the_scan_and_a_belt_crosses_it() {
        let (grid, heights_m) = across(30, 10, f64::NAN);
        let ends = Ends::of(&grid, &heights_m);
        let strip = |columns: std::ops::Range<usize>, rows: usize| -> Vec<usize> {
            columns.flat_map(|column| (0..rows).map(move |row| row * 40 + column)).collect()
        };
        let at = |column: usize| (0..grid.len()).map(move |cell| cell % 40 == column).collect();
        let rises: Vec<bool> = at(30);
        assert!(ends_scan(&grid, &ends, &strip(30..34, 8), &rises));
        assert!(!ends_scan(&grid, &ends, &strip(30..34, 7), &rises), "it rises in too few cells");
        assert!(!ends_scan(&grid, &ends, &strip(10..34, 8), &rises), "most lies over the surface");
    }

    #[test]
    fn no_wall_is_thicker_than_a_dozen_cells() {
        assert!(retains(12, 0.0, 8) && !retains(13, 0.0, 8));
    }

    #[test]
    fn a_cell_that_is_higher_than_the_surface_before_it_holds_some_of_the_wall() {
        let (grid, mut heights_m) = across(10, 2, 0.0);
        heights_m.iter_mut().enumerate().for_each(|(c, h)| *h += 0.5 * (c % 40) as f64);
        let retaining: Vec<bool> = heights_m.iter().map(|h| h.is_nan()).collect();
        let cell = 20 * 40 + 9;
        let lip = |heights_m: &[f64]| is_lip(&grid, heights_m, &retaining, cell, 0.1);
        assert!(!lip(&heights_m));
        heights_m[cell] += 0.2;
        assert!(lip(&heights_m));
    }

    #[test]
    fn the_surface_before_a_wall_goes_on_as_it_is_four_columns_away() {
        // Nothing was seen right before the wall, and five columns away another surface begins.
        let (grid, mut heights_m) = across(10, 2, 0.0);
        let retaining: Vec<bool> = heights_m.iter().map(|h| h.is_nan()).collect();
        for (cell, height_m) in heights_m.iter_mut().enumerate() {
            *height_m = match cell % 40 {
                7 | 8 => f64::NAN,
                column if column < 5 => 90.0,
                _ => *height_m,
            };
        }
        let cell = 20 * 40 + 9;
        let lip = |heights_m: &[f64]| is_lip(&grid, heights_m, &retaining, cell, 0.1);
        assert!(!lip(&heights_m));
        heights_m[cell] += 0.2;
        assert!(lip(&heights_m));
    }
}
