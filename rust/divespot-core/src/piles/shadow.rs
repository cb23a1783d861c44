//! Haze at the edge of a shadow.
//!
//! Beside the shadow that a box casts, a depth camera sees light that came by way of its sides: a
//! veil that is highest at the shadow's edge and sinks away from it. A pile has a summit of its
//! own. Where the summit borders the shadow of something steep and higher, it is either such a veil
//! or hidden in part; neither has a volume.

use std::collections::BTreeSet;

use super::patch::Scene;
use super::{Object, Reason};
use crate::count::to_f64;

/// An object's summit is the highest of its cells, this share of them.
const SUMMIT: f64 = 0.05;
/// A cell so many columns and rows from a shadow borders it.
const NEAR: usize = 3;

/// Gives the reason to every object whose summit borders the shadow of a higher, steep one.
pub(crate) fn mark(scene: &Scene<'_>, objects: &mut [Object]) {
    let shadows = Shadows::of(scene);
    let steep = objects.iter().filter(|o| o.reason == Some(Reason::SteepSides));
    let cast: Vec<(f64, BTreeSet<usize>)> = steep
        .map(|o| (o.max_height_m, o.covers_m.iter().flat_map(|p| shadows.near(p)).collect()))
        .collect();
    for object in objects.iter_mut().filter(|o| o.reason.is_none()) {
        let higher = cast.iter().filter(|(height_m, _)| *height_m > object.max_height_m);
        let around: BTreeSet<usize> = higher.flat_map(|(_, shadows)| shadows).copied().collect();
        let top = summit(object);
        let borders = top.iter().filter(|p| shadows.near(p).any(|s| around.contains(&s))).count();
        if 2 * borders > top.len() {
            object.reason = Some(Reason::Shadow);
        }
    }
}

fn summit(object: &Object) -> Vec<[f64; 3]> {
    let mut cells = object.covers_m.clone();
    cells.sort_by(|a, b| b[2].total_cmp(&a[2]));
    cells.truncate((SUMMIT * to_f64(cells.len())).ceil() as usize);
    cells
}

/// Connected regions of cells that were not seen, though the scan goes on around them.
struct Shadows<'a> {
    scene: &'a Scene<'a>,
    /// The region of each unseen cell, by its first cell.
    region: Vec<Option<usize>>,
}

impl<'a> Shadows<'a> {
    fn of(scene: &'a Scene<'a>) -> Self {
        let mut shadows = Self { scene, region: vec![None; scene.heights_m.len()] };
        for first in 0..scene.heights_m.len() {
            shadows.spread(first);
        }
        shadows
    }

    fn spread(&mut self, first: usize) {
        let mut front = vec![first];
        while let Some(cell) = front.pop() {
            let unseen = self.scene.heights_m[cell].is_nan() && !self.scene.beyond[cell];
            if unseen && self.region[cell].is_none() {
                self.region[cell] = Some(first);
                front.extend(self.scene.grid.around(cell, 1));
            }
        }
    }

    /// The shadows that a place borders.
    fn near(&self, p: &[f64; 3]) -> impl Iterator<Item = usize> + '_ {
        let cell = self.scene.grid.cell(p);
        self.scene.grid.around(cell, NEAR).filter_map(|n| self.region[n])
    }
}

#[cfg(test)]
mod tests {
    use super::super::Reason;
    use super::super::tests::{exact, measured};

    /// A box, its shadow, and beyond it a heap whose summit lies `away` from the shadow's edge.
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
}
