//! The ground around an object: which cells its toe and its annulus of ground may lie in.
//!
//! Method: a nearest-label map over the ground cells. It does not cross banks, faces or cliffs.
//! Ground that the object touches along only a small part of its foot is left out: where a pile
//! reaches the edge of its slab, the floor below the slab is not its base. Heights in m.

use std::collections::BTreeMap;

use super::nearest_label::NearestLabel;
use crate::cancel::Polled;
use crate::connectivity::components_joined;
use crate::connectivity::{FOUR, UNLABELLED};
use crate::count::to_f64;
use crate::heightmap::Grid;
use crate::hypotenuse::Hypotenuse;
use crate::material::{GENTLE, STEEPEST_POURED};

/// Height difference between two ground cells from which it is a cliff, in standard deviations of
/// the ground's noise, beyond what a slope explains. Chosen on the scenes of `divespot evaluate`.
const CLEAR: f64 = 6.0;
/// A part of the ground belongs to an object if the object touches it along at least this share of
/// the cells along which it touches its most-touched part. Chosen on the scenes of `divespot
/// evaluate`.
const SOME: f64 = 0.25;

/// The map in which the ground around objects is looked for.
pub(crate) struct Around<'a> {
    pub(crate) grid: &'a Grid,
    pub(crate) heights_m: &'a [f64],
    /// The cells that a toe or an annulus of ground may lie in.
    pub(crate) open: Vec<bool>,
    pub(crate) ground: &'a [bool],
    pub(crate) noise_m: f64,
}

impl Around<'_> {
    /// The nearest-label map of the objects, up to `farthest` steps away.
    pub(crate) fn nearest(&self, labels: &[i32], farthest: u32) -> NearestLabel {
        let goes_on =
            |from: usize, to: usize| self.open[to] && !self.drops(from, to, STEEPEST_POURED);
        let tells = |cell: usize| self.ground[cell] && !self.heights_m[cell].is_nan();
        let mut nearest = NearestLabel::grow_along(self.grid, labels, goes_on, tells, farthest);
        for cell in self.touched_little(labels, &nearest) {
            nearest.owner[cell] = UNLABELLED;
            nearest.steps[cell] = u32::MAX;
        }
        nearest
    }

    /// The cells of those parts of the ground that an object touches along little of its foot.
    fn touched_little(
        &self,
        labels: &[i32],
        NearestLabel { owner, last, .. }: &NearestLabel,
    ) -> Vec<usize> {
        let told =
            |cell: usize| owner[cell] != UNLABELLED && labels[last[cell] as usize] == UNLABELLED;
        let joined = |a: usize, b: usize| {
            owner[a] == owner[b] && !self.drops(last[a] as usize, last[b] as usize, GENTLE)
        };
        let cells = (0..labels.len()).polled().map(told).collect();
        let parts = components_joined(self.grid, cells, &FOUR, joined);
        let is_foot = |cell: usize| {
            self.grid.neighbors(cell, &FOUR).any(|n| owner[n] == owner[cell] && !told(n))
        };
        let foot = |part: &Vec<usize>| part.iter().filter(|&&cell| is_foot(cell)).count();
        let feet: Vec<usize> = parts.iter().map(foot).collect();
        let mut most: BTreeMap<i32, usize> = BTreeMap::new();
        for (part, &foot) in parts.iter().zip(&feet) {
            let most = most.entry(owner[part[0]]).or_default();
            *most = foot.max(*most);
        }
        let little = |(part, foot): &(Vec<usize>, usize)| {
            to_f64(*foot) < SOME * to_f64(most[&owner[part[0]]])
        };
        parts.into_iter().zip(feet).filter(little).flat_map(|(part, _)| part).collect()
    }

    /// Whether the height difference between two ground cells is more than `slope` gives over their
    /// distance, plus the foot of a pile within one cell, plus noise.
    fn drops(&self, from: usize, to: usize, slope: f64) -> bool {
        if !(self.ground[from] && self.ground[to]) {
            return false;
        }
        let drop_m = (self.heights_m[from] - self.heights_m[to]).abs();
        let (cell_m, clear_m) = (STEEPEST_POURED * self.grid.cell_m, CLEAR * self.noise_m);
        if drop_m <= cell_m + clear_m {
            return false; // nearly everywhere, and much sooner known
        }
        let ([ax, ay], [bx, by]) = (self.grid.center(from), self.grid.center(to));
        drop_m > slope * (ax - bx).hypotenuse(ay - by) + cell_m + clear_m
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::piles::found::Found;
    use crate::piles::tests::{CELL, exact, settings};
    use crate::piles::{Object, measure};

    const HIGH: f64 = 0.1;

    fn cone(x: f64, y: f64) -> f64 {
        (0.5 * (1.2 - (x - 4.0).hypot(y - 3.0))).max(0.0)
    }

    fn is_slab(x: f64, y: f64) -> bool {
        (x - 4.0).abs() < 1.6 && (y - 3.0).abs() < 1.6
    }

    /// A cone on a slab. The slab's rim, one cell wide, counts as a bank except in gaps; the
    /// object's labels reach the floor on one side over a `wide` strip, in m.
    fn on_slab(wide: f64, gap: impl Fn(f64, f64) -> bool) -> Object {
        let rim = |x: f64, y: f64| {
            is_slab(x, y) && ![-CELL, CELL].iter().all(|d| is_slab(x + d, y) && is_slab(x, y + d))
        };
        let heights = |x: f64, y: f64| match (rim(x, y), is_slab(x, y)) {
            (true, _) if gap(x, y) => f64::NAN,
            (true, _) => 0.5 * HIGH,
            (_, on) => cone(x, y) + if on { HIGH } else { 0.0 },
        };
        let map = exact(heights);
        let leak = |x: f64, y: f64| y > 4.0 && is_slab(x, y) && (x - 4.0).abs() < 0.5 * wide;
        let at = |cell: usize| map.grid.center(cell);
        let cells = 0..map.grid.len();
        let labels = cells
            .clone()
            .map(at)
            .map(|[x, y]| if cone(x, y) > 0.05 || leak(x, y) { 0 } else { UNLABELLED });
        let labels: Vec<i32> = labels.collect();
        let is_ground = |cell: usize| labels[cell] == UNLABELLED && !rim(at(cell)[0], at(cell)[1]);
        let ground = cells.map(is_ground).collect();
        let found = Found { ground, ..Found::on_all_else(labels.clone()) };
        measure(&map.grid, &map.heights_m, &found, &settings()).unwrap().remove(0)
    }

    fn share(object: &Object) -> f64 {
        (object.volume.cut_m3 - object.volume.fill_m3) / (std::f64::consts::PI * 1.44 * 0.6 / 3.0)
    }

    #[test]
    fn a_heap_that_comes_to_the_edge_of_its_slab_stands_on_the_slab() {
        for wide in [0.0, 0.5, 1.0] {
            let object = on_slab(wide, |_, _| false);
            assert!((share(&object) - 1.0).abs() < 0.02, "{wide}: {}", share(&object));
        }
    }

    #[test]
    fn a_cell_that_was_not_seen_is_no_way_through_a_bank() {
        let object = on_slab(0.0, |x, y| (((x + y) / CELL) as i32) % 5 == 0);
        assert!((share(&object) - 1.0).abs() < 0.02, "{}", share(&object));
    }

    /// Ground of three rows of 20 cells of 1 m, in whose middle an object lies: on one side along all
    /// of it, on the other, far lower, along so many cells.
    fn beside(cells: usize) -> usize {
        let grid = Grid { origin_m: [0.0; 2], cell_m: 1.0, columns: 20, rows: 3 };
        let labels: Vec<i32> = (0..60).map(|c| if c / 20 == 1 { 0 } else { UNLABELLED }).collect();
        let heights_m: Vec<f64> = (0..60).map(|c| if c < 20 { -99.0 } else { 0.0 }).collect();
        let ground: Vec<bool> = (0..60).map(|c| c / 20 == 2 || c < cells).collect();
        let open = ground.clone();
        let around =
            Around { grid: &grid, heights_m: &heights_m, open, ground: &ground, noise_m: 0.0 };
        around.nearest(&labels, 3).owner[..20].iter().filter(|&&owner| owner == 0).count()
    }

    #[test]
    fn ground_is_around_an_object_from_a_quarter_of_what_it_touches_most() {
        assert_eq!((beside(4), beside(6)), (0, 6));
    }

    #[test]
    fn six_standard_deviations_of_noise_are_no_cliff() {
        let grid = Grid { origin_m: [0.0; 2], cell_m: 1.0, columns: 2, rows: 1 };
        let drops = |drop_m: f64| {
            let (heights_m, open) = ([drop_m, 0.0], vec![true; 2]);
            let around = Around {
                grid: &grid,
                heights_m: &heights_m,
                open,
                ground: &[true; 2],
                noise_m: 1.0,
            };
            around.drops(0, 1, 0.0)
        };
        // And as much as something poured rises within a cell, 1.2 m.
        assert!(drops(9.0) && !drops(5.5));
    }
}
