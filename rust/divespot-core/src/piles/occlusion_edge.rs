//! Flying pixels at an occlusion edge.
//!
//! Beside the shadow of a box, a depth camera sees light reflected by the box's sides: a false
//! surface that is highest at the occlusion edge and falls away from it. A pile has a summit of its
//! own. If an object's summit borders the shadow of something steep and higher, the object is
//! either such a false surface or partly occluded; neither has a volume that can be measured.

use std::collections::BTreeSet;

use super::object::Object;
use super::reason::Reason;
use crate::connectivity::{EIGHT, components};
use crate::count::to_f64;
use crate::extent::off_scan_cells;
use crate::heightmap::Grid;

/// The share of an object's cells, from the highest down, that is its summit. Chosen: lower trusts
/// single cells, higher reaches down to flanks that border any shadow.
const SUMMIT: f64 = 0.05;
/// With more than this share of its volume seen, an object is no false surface: a person or tool on
/// a pile hides less than the rest of it. Chosen on the scenes of `divespot evaluate`.
const MOSTLY: f64 = 2.0 / 3.0;
/// A cell borders a shadow within this many columns and rows. Chosen: fewer miss shadows with a
/// ragged edge, more call piles near a shadow its work.
const NEAR: usize = 3;

/// Gives the reason to every object whose summit borders the shadow of a higher, steep object.
/// `surface_m` are the heights of the surface, `heights_m` those with the things on it.
///
/// An object that surrounds most of a shadow, and was mostly seen, has something on it and is
/// exempt.
pub(crate) fn mark(grid: &Grid, surface_m: &[f64], heights_m: &[f64], objects: &mut [Object]) {
    let is_steep = |o: &&Object| matches!(o.reason, Some(Reason::SteepSides | Reason::Apart));
    let steep: Vec<&Object> = objects.iter().filter(is_steep).collect();
    if steep.is_empty() {
        return;
    }
    let shadows = Occlusions::of(grid, heights_m);
    let near = |o: &Object| o.covers_m.iter().flat_map(|p| shadows.near(p)).collect();
    let cast: Vec<(f64, BTreeSet<usize>)> =
        steep.into_iter().map(|o| (o.max_height_m, near(o))).collect();
    let lies = |o: &&mut Object| matches!(o.reason, None | Some(Reason::NotClear));
    for object in objects.iter_mut().filter(lies) {
        let higher = cast.iter().filter(|(height_m, _)| *height_m > object.max_height_m);
        let mut beside: BTreeSet<usize> =
            higher.flat_map(|(_, shadows)| shadows).copied().collect();
        if beside.is_empty() {
            continue;
        }
        if mostly_seen(grid, surface_m, object) {
            beside.retain(|&shadow| !shadows.is_within(shadow, object));
        }
        let top = summit(object);
        let borders = top.iter().filter(|p| shadows.near(p).any(|s| beside.contains(&s))).count();
        if 2 * borders > top.len() {
            object.reason = Some(Reason::Shadow);
        }
    }
}

/// Whether the surface was seen over most of an object's volume.
fn mostly_seen(grid: &Grid, surface_m: &[f64], object: &Object) -> bool {
    let sum =
        |cells: &mut dyn Iterator<Item = &[f64; 3]>| cells.map(|p| p[2].max(0.0)).sum::<f64>();
    let seen = |p: &&[f64; 3]| !surface_m[grid.cell(&p[..])].is_nan();
    sum(&mut object.covers_m.iter().filter(seen)) > MOSTLY * sum(&mut object.covers_m.iter())
}

fn summit(object: &Object) -> Vec<[f64; 3]> {
    let mut cells = object.covers_m.clone();
    cells.sort_by(|a, b| b[2].total_cmp(&a[2]));
    cells.truncate((SUMMIT * to_f64(cells.len())).ceil() as usize);
    cells
}

/// Connected components of unseen cells inside the scan.
struct Occlusions<'a> {
    grid: &'a Grid,
    /// The region of each unseen cell, by its number.
    region: Vec<Option<usize>>,
}

impl<'a> Occlusions<'a> {
    fn of(grid: &'a Grid, heights_m: &[f64]) -> Self {
        let off_scan = off_scan_cells(grid, heights_m);
        let unseen = heights_m.iter().zip(off_scan).map(|(h, b)| h.is_nan() && !b).collect();
        let mut region = vec![None; grid.len()];
        for (number, cells) in components(grid, unseen, &EIGHT).iter().enumerate() {
            cells.iter().for_each(|&cell| region[cell] = Some(number));
        }
        Self { grid, region }
    }

    /// Whether an object surrounds most of a shadow.
    fn is_within(&self, shadow: usize, object: &Object) -> bool {
        let covers: BTreeSet<usize> =
            object.covers_m.iter().map(|p| self.grid.cell(&p[..])).collect();
        let inside = |&cell: &usize| self.region[cell] == Some(shadow);
        let edge: BTreeSet<usize> = (0..self.region.len())
            .filter(inside)
            .flat_map(|cell| self.grid.around(cell, 1))
            .filter(|cell| !inside(cell))
            .collect();
        2 * edge.intersection(&covers).count() > edge.len()
    }

    /// The shadows near a place.
    fn near(&self, p: &[f64; 3]) -> impl Iterator<Item = usize> + '_ {
        self.grid.around(self.grid.cell(p), NEAR).filter_map(|n| self.region[n])
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::{exact, measured};
    use super::*;

    /// A box, its shadow, and beyond it a heap whose summit lies `away` m from the shadow's edge.
    fn reasons(away: f64) -> Vec<Option<Reason>> {
        let inside = |x: f64, y: f64| (1.5..2.5).contains(&x) && (2.0..4.0).contains(&y);
        let dark = |x: f64, y: f64| (2.5..3.5).contains(&x) && (2.0..4.0).contains(&y);
        let heap = move |x: f64, y: f64| (0.4 * (1.0 - (x - 3.5 - away).hypot(y - 3.0))).max(0.0);
        let height = move |x, y| match (inside(x, y), dark(x, y)) {
            (true, _) => 1.0,
            (_, true) => f64::NAN,
            _ => heap(x, y),
        };
        let objects = measured(&exact(height), |x, y| height(x, y) > 0.05);
        objects.iter().map(|o| o.reason).collect()
    }

    #[test]
    fn a_veil_beside_a_shadow_is_no_pile_and_a_pile_with_its_own_summit_is() {
        assert!(reasons(0.0).contains(&Some(Reason::Shadow)), "{:?}", reasons(0.0));
        let whole = reasons(0.9);
        assert!(whole.contains(&None) && !whole.contains(&Some(Reason::Shadow)), "{whole:?}");
    }

    /// A cone as it was measured, with its highest cell first.
    fn cone() -> (Grid, Object) {
        let cone = |x: f64, y: f64| (0.5 * (1.2 - (x - 4.0).hypot(y - 3.0))).max(0.0);
        let map = exact(cone);
        (map.grid, measured(&map, |x, y| cone(x, y) > 0.05).remove(0))
    }

    #[test]
    fn a_summit_is_a_twentieth_of_the_cells() {
        let (_, mut object) = cone();
        object.covers_m.truncate(400);
        assert_eq!(summit(&object).len(), 20);
    }

    #[test]
    fn two_thirds_of_a_volume_that_were_seen_are_most_of_it() {
        let (grid, mut object) = cone();
        object.covers_m.truncate(100);
        object.covers_m.iter_mut().for_each(|p| p[2] = 1.0);
        let seen = |count: usize| {
            let mut surface_m = vec![f64::NAN; grid.len()];
            object.covers_m[..count].iter().for_each(|p| surface_m[grid.cell(&p[..])] = 1.0);
            mostly_seen(&grid, &surface_m, &object)
        };
        assert!(seen(75) && !seen(60));
    }

    #[test]
    fn a_cell_three_columns_from_a_shadow_borders_it() {
        let (grid, _) = cone();
        let dark =
            |cell: usize| cell % grid.columns == 20 && (10..30).contains(&(cell / grid.columns));
        let heights_m: Vec<f64> =
            (0..grid.len()).map(|cell| if dark(cell) { f64::NAN } else { 0.0 }).collect();
        let shadows = Occlusions::of(&grid, &heights_m);
        let borders = |away: usize| {
            let [x, y] = grid.center(20 * grid.columns + 20 + away);
            shadows.near(&[x, y, 0.0]).next().is_some()
        };
        assert!(borders(3) && !borders(4));
    }
}
