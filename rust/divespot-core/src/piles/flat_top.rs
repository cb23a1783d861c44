//! The footprint and volume of flat-topped objects such as boxes.
//!
//! In an oblique view the side of a box fills the cells it passes through with points at every
//! height, and flying pixels trail from its edges. Averaged with the top, both widen the box by a
//! cell all round. So a cell counts by the share of it that the top covers: its number of points on
//! the top over that of the cells wholly on the top around it. Lengths in m.

use super::object::Object;
use crate::count::to_f64;
use crate::heightmap::{Grid, Volume};
use crate::hypotenuse::Hypotenuse;
use crate::near_plane::{value, weighted_plane};
use crate::robust::median_in;
use crate::{Bounds, Point};

/// The top is flat if this share of the object's cells lies within the margin of a plane. Chosen on
/// the scenes of `divespot evaluate`.
const FLAT: f64 = 0.5;
/// Iterations of the plane fit. Chosen: the first plane is level, and a top slopes by a few margins
/// at most; fewer end before the plane lies on the top.
const FITS: usize = 4;
/// A cell is wholly on the top if it and its neighbours hold this share of the typical number of
/// points. At a straight edge along the cells, the cell inside the edge does (6 of 9 cells).
const INSIDE: f64 = 2.0 / 3.0;
/// Cells wholly on the top are looked for within this many columns and rows. Chosen: fewer find
/// none on narrow tops, more take the density of other parts.
const NEAR: usize = 3;
/// Standard uncertainty of the edge, as a share of the distance between the top's edge and the one
/// found by height: a rectangular distribution (GUM 4.3.7), 1/√12.
const BETWEEN: f64 = 0.289;

/// Replaces the volume of flat-topped objects, none of which is a pile, by that below their tops.
pub(crate) fn trim<'a>(grid: &Grid, points: &[Point], objects: &'a mut [Object], margin_m: f64) {
    let top = |o: &'a mut Object| Top::of(o, margin_m).map(|top| (o, top));
    let mut flat: Vec<(&mut Object, Top)> = objects.iter_mut().filter_map(top).collect();
    let points = points_over(grid, points.iter(), flat.iter().map(|(object, _)| &**object));
    for (object, top) in &mut flat {
        let cells = covered(grid, &on_top(grid, &points, object, top));
        shrink(object, top.height_m, cells * grid.cell_m * grid.cell_m);
    }
}

/// The points over the cells of any of the objects, each with its cell.
pub(crate) fn points_over<'a>(
    grid: &Grid,
    points: impl Iterator<Item = &'a Point>,
    objects: impl Iterator<Item = &'a Object>,
) -> Vec<(usize, Point)> {
    let covered: Vec<Point> = objects.flat_map(|o| o.covers_m.iter().copied()).collect();
    let Some(bounds) = Bounds::of(covered.iter().copied()) else { return Vec::new() };
    let mut covers = vec![false; grid.len()];
    covered.iter().for_each(|p| covers[grid.cell(p)] = true);
    // Bounds first: far from all objects no cell need be looked up.
    let (low, high) = (bounds.min.map(|v| v - grid.cell_m), bounds.max.map(|v| v + grid.cell_m));
    let near = points.filter(|p| (0..2).all(|k| low[k] <= p[k] && p[k] <= high[k]));
    near.map(|p| (grid.cell(p), *p)).filter(|&(cell, _)| covers[cell]).collect()
}

/// The flat top of an object, as a plane above its base.
struct Top {
    center_m: [f64; 2],
    plane: [f64; 3],
    margin_m: f64,
    /// Mean height of its cells, in m.
    height_m: f64,
}

impl Top {
    /// The plane through the cells near the median height, refitted to the cells near itself;
    /// `None` if these are too few.
    fn of(object: &Object, margin_m: f64) -> Option<Self> {
        let mut heights: Vec<f64> = object.covers_m.iter().map(|p| p[2]).collect();
        let plane = [median_in(&mut heights), 0.0, 0.0];
        let first = object.covers_m.first()?;
        let mut top = Self { center_m: [first[0], first[1]], plane, margin_m, height_m: plane[0] };
        for _ in 0..FITS {
            let local: Vec<[f64; 3]> = object
                .covers_m
                .iter()
                .filter(|p| top.off_m(p).abs() <= margin_m)
                .map(|p| top.local(p))
                .collect();
            if to_f64(local.len()) <= FLAT * to_f64(heights.len()) {
                return None;
            }
            top.plane = weighted_plane(&local, std::iter::repeat(1.0), true)?.into();
            top.height_m = local.iter().map(|p| p[2]).sum::<f64>() / to_f64(local.len());
        }
        Some(top)
    }

    fn local(&self, p: &[f64; 3]) -> [f64; 3] {
        [p[0] - self.center_m[0], p[1] - self.center_m[1], p[2]]
    }

    /// Height of a cell or point above the top, in m.
    fn off_m(&self, p: &[f64; 3]) -> f64 {
        p[2] - value(&self.plane.into(), &self.local(p))
    }
}

/// Number of points on the top in each cell of the object; NaN in all others.
fn on_top(grid: &Grid, points: &[(usize, Point)], object: &Object, top: &Top) -> Vec<f64> {
    let mut count = vec![f64::NAN; grid.len()];
    object.covers_m.iter().for_each(|p| count[grid.cell(p)] = 0.0);
    for &(cell, [x, y, z]) in points {
        let on_top = || top.off_m(&[x, y, z - object.base.at([x, y])]).abs() <= top.margin_m;
        if !count[cell].is_nan() && on_top() {
            count[cell] += 1.0;
        }
    }
    count
}

/// How many cells the top covers, from the number of points on it in each.
fn covered(grid: &Grid, on_top: &[f64]) -> f64 {
    let cells: Vec<usize> = (0..on_top.len()).filter(|&cell| !on_top[cell].is_nan()).collect();
    let mut mean = vec![f64::NAN; on_top.len()];
    cells.iter().for_each(|&cell| mean[cell] = around(grid, on_top, cell));
    let full: Vec<f64> = cells
        .iter()
        .map(|&cell| {
            upper_quartile(grid.around(cell, NEAR).map(|n| mean[n]).filter(|&n| n > 0.0).collect())
        })
        .collect();
    let share = |(&cell, &full): (&usize, &f64)| match mean[cell] {
        inside if inside >= INSIDE * full => f64::from(u8::from(full > 0.0)),
        _ => on_top[cell] / full,
    };
    cells.iter().zip(&full).map(share).sum()
}

/// Upper quartile: near a straight edge more than a quarter of the cells are wholly on the top.
fn upper_quartile(mut counts: Vec<f64>) -> f64 {
    counts.sort_unstable_by(f64::total_cmp);
    counts.get(counts.len() * 3 / 4).copied().unwrap_or(0.0)
}

/// Mean number of points on the top in a cell and its neighbours.
fn around(grid: &Grid, on_top: &[f64], cell: usize) -> f64 {
    let counts = grid.around(cell, 1).map(|n| on_top[n]).filter(|count| !count.is_nan());
    counts.sum::<f64>() / to_f64(grid.around(cell, 1).count())
}

/// Reduces the object to its top. It never grows.
fn shrink(object: &mut Object, height_m: f64, area_m2: f64) {
    let volume = Volume { cut_m3: height_m * area_m2, fill_m3: 0.0, area_m2 };
    let between_m3 = object.volume.net_m3() - volume.net_m3();
    if between_m3 <= 0.0 {
        return;
    }
    object.budget.footprint_m3 = object.budget.footprint_m3.hypotenuse(BETWEEN * between_m3);
    object.volume = volume;
    object.footprint_m2 = area_m2;
}

#[cfg(test)]
mod tests {
    use super::super::tests::{CELL, exact, measured, settings};
    use super::super::{Budget, Found, Reason, measure};
    use super::*;
    use crate::heightmap::height_map;

    /// A box of 2 m by 1.5 m by 0.8 m with points all over its sides and flying pixels beside one.
    fn points_of() -> Vec<Point> {
        let at = |i: i32| (f64::from(i) + 0.5) * CELL / 3.0;
        let plan = (0..384 * 288).map(|i| (at(i % 384), at(i / 384)));
        let inside = |x: f64, y: f64| (3.02..5.02).contains(&x) && (2.01..3.51).contains(&y);
        let flying = |x: f64, y: f64| (5.02..5.22).contains(&x) && (2.01..3.51).contains(&y);
        let mut points: Vec<Point> = plan
            .map(|(x, y)| match (inside(x, y), flying(x, y)) {
                (true, _) => [x, y, 0.8],
                (_, true) => [x, y, 0.8 - 4.0 * (x - 5.02)],
                _ => [x, y, 0.0],
            })
            .collect();
        points.extend(
            (0..96 * 40)
                .map(|i| [3.02 + f64::from(i / 40) * 2.0 / 96.0, 2.01, 0.02 * f64::from(i % 40)]),
        );
        points
    }

    #[test]
    fn sides_and_flying_pixels_do_not_widen_a_box() {
        let points = points_of();
        let map = height_map(&points, CELL).unwrap();
        let labels: Vec<i32> =
            map.heights_m.iter().map(|&h| if h > 0.05 { 0 } else { -1 }).collect();
        let mut objects =
            measure(&map.grid, &map.heights_m, &Found::on_all_else(labels), &settings()).unwrap();
        assert_eq!(objects[0].reason, Some(Reason::SteepSides));
        assert!(objects[0].volume.net_m3() > 1.02 * 2.4, "{:?}", objects[0].volume);
        let (before, untrimmed) = (objects[0].budget.footprint_m3, objects[0].volume.net_m3());
        trim(&map.grid, &points, &mut objects, 0.03);
        let volume = objects[0].volume.net_m3();
        assert!((volume / 2.4 - 1.0).abs() < 0.02, "{volume}, untrimmed {untrimmed}");
        assert!((objects[0].footprint_m2 / 3.0 - 1.0).abs() < 0.02);
        assert!(objects[0].budget.footprint_m3 > before);
    }

    /// A block as it was measured.
    fn block() -> Object {
        let block =
            |x: f64, y: f64| if (x - 4.0).abs().max((y - 3.0).abs()) < 1.0 { 0.8 } else { 0.0 };
        measured(&exact(block), |x, y| block(x, y) > 0.0).remove(0)
    }

    #[test]
    fn a_top_is_flat_if_half_of_its_cells_lie_on_a_plane() {
        // Of a hundred cells the others lie as often above it as below.
        let is_flat = |flat: usize| {
            let mut object = block();
            object.covers_m.truncate(100);
            for (i, p) in object.covers_m.iter_mut().enumerate().skip(flat) {
                let off = 0.1 + 0.003 * i as f64;
                p[2] += if i % 2 == 0 { off } else { -off };
            }
            Top::of(&object, 0.03).is_some()
        };
        assert!(is_flat(65) && !is_flat(38));
    }

    #[test]
    fn cells_count_by_their_points_but_those_that_lie_wholly_on_the_top() {
        let grid = Grid { origin_m: [0.0; 2], cell_m: 1.0, columns: 12, rows: 9 };
        // Typical is the upper quartile of the means within three columns: 9.33, 9.33, 12 and 12.
        let ramp = |cell: usize| if cell % 12 < 3 { 4.0 } else { 12.0 };
        let on_top: Vec<f64> = (0..grid.len()).map(ramp).collect();
        let expected = 9.0 * (2.0 * 4.0 / 9.333_333 + 4.0 / 12.0 + 9.0);
        assert!((covered(&grid, &on_top) - expected).abs() < 1e-3, "{}", covered(&grid, &on_top));
        // Nothing happens to lie over one cell amid the top.
        let mut one = vec![12.0; grid.len()];
        one[4 * 12 + 6] = 0.0;
        assert_eq!(covered(&grid, &one), 108.0);
    }

    #[test]
    fn the_edge_lies_anywhere_between_the_tops_and_the_one_found_by_height() {
        let mut object = Object { budget: Budget::default(), ..block() };
        let by_height_m3 = object.volume.net_m3();
        let between_m3 = 0.1 * by_height_m3;
        shrink(&mut object, 0.8, (by_height_m3 - between_m3) / 0.8);
        let u_m3 = between_m3 / 12.0_f64.sqrt();
        assert!((object.budget.footprint_m3 / u_m3 - 1.0).abs() < 0.01, "{:?}", object.budget);
    }
}
