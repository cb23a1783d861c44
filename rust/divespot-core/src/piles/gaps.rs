//! Heights of unseen cells of an object, in m, and the standard uncertainty of their volume, in m³.
//!
//! Method: harmonic interpolation across enclosed gaps; in an occlusion shadow the flank runs down
//! at the pile's own angle of repose (`occluded_flank`).

use super::occluded_flank::{Edge, Flank, Rim, open_cells, rims_of};
use super::repose::Repose;
use super::window::{Window, Zone};
use crate::harmonic::{Node, relax};
use crate::hypotenuse::Hypotenuse;

/// Standard deviation of a rectangular distribution, as a share of its half-width (GUM 4.3.7):
/// 1/√3.
pub(crate) const ANYWHERE: f64 = 0.577;

/// Root mean square height of the surface above the flank in a shadow, as a share of the height of
/// the line of sight: a triangular distribution with its mode at the flank (GUM 4.3.9), 1/√6.
const BELOW_SIGHT: f64 = 0.408;

/// Heights above the base with the gaps filled, in m.
pub(crate) struct Filled {
    pub(crate) above_m: Vec<f64>,
    /// Standard uncertainty of the volume in filled cells, in m³.
    pub(crate) u_m3: f64,
}

/// Fills the unseen cells of an object.
///
/// In the shadow behind the object its flank runs down at the angle of repose. A gap that it
/// encloses, or one between its toe and the ground, is interpolated harmonically. Cells beyond the
/// scan do not count.
pub(crate) fn fill(window: &Window, above: &[f64]) -> Filled {
    let gaps = gaps_of(window, above);
    if gaps.is_empty() {
        return Filled { above_m: above.to_vec(), u_m3: 0.0 };
    }
    let hidden = Hidden::behind(window, above);
    let sight_m3 = hidden.below_sight_m3(window);
    let (filled, harmonic) = closed(window, above, gaps, &hidden);
    // The surface lies between the harmonic interpolation and the lowest flank of the material.
    let share = |cell: usize| window.counted(cell).share;
    let slack = harmonic.iter().map(|&c| share(c) * (filled[c] - hidden.above_m[c]).abs());
    let u_film_m3 = ANYWHERE * slack.sum::<f64>() * window.grid.cell_m * window.grid.cell_m;
    Filled {
        u_m3: u_film_m3.hypotenuse(hidden.u_m3()).hypotenuse(BELOW_SIGHT * sight_m3),
        above_m: filled,
    }
}

/// Only the heights of [`fill`], at about half the cost.
pub(crate) fn heights(window: &Window, above: &[f64]) -> Vec<f64> {
    let gaps = gaps_of(window, above);
    if gaps.is_empty() {
        return above.to_vec();
    }
    closed(window, above, gaps, &Hidden::behind(window, above)).0
}

/// The unseen cells of an object.
fn gaps_of(window: &Window, above: &[f64]) -> Vec<usize> {
    let held = |&cell: &usize| matches!(window.zones[cell], Zone::Core | Zone::Toe);
    (0..above.len()).filter(|&cell| above[cell].is_nan()).filter(held).collect()
}

/// The heights with the gaps filled, and the cells that were interpolated harmonically.
fn closed(
    window: &Window,
    above: &[f64],
    mut gaps: Vec<usize>,
    hidden: &Hidden<'_>,
) -> (Vec<f64>, Vec<usize>) {
    let mut filled = above.to_vec();
    for &cell in &gaps {
        if window.off_scan[cell] || hidden.covers(cell) {
            filled[cell] = hidden.above_m[cell];
        }
    }
    gaps.retain(|&cell| filled[cell].is_nan());
    stretch(window, &mut filled, &gaps);
    (filled, gaps)
}

/// The flanks that run down from the seen part of an object.
struct Flanks<'a> {
    window: &'a Window,
    above: &'a [f64],
    core: Vec<usize>,
    repose: Repose,
}

impl<'a> Flanks<'a> {
    fn of(window: &'a Window, above: &'a [f64]) -> Self {
        let core: Vec<usize> = window.cells(Zone::Core).collect();
        let repose = Repose::of(&window.grid, &core, |cell| above[cell]);
        Self { window, above, core, repose }
    }

    fn unseen(&self, cell: usize) -> bool {
        self.above[cell].is_nan() && !self.window.off_scan[cell] && !self.window.bars[cell]
    }

    fn rims(&self, edge: Edge) -> Vec<Rim> {
        let object = self.core.iter().map(|&cell| (cell, 0));
        let above = |_, cell: usize| self.above[cell];
        rims_of(&self.window.grid, object, edge, above, |cell| self.unseen(cell))
    }

    /// Heights of the flanks from these rims in m, for a slope that is `times` its uncertainty
    /// steeper.
    fn down(&self, rims: &[Rim], times: f64) -> Vec<f64> {
        let slope = |_| self.repose.steeper(times);
        Flank::down(&self.window.grid, rims, slope, |cell| self.unseen(cell)).above_m
    }
}

/// The occluded flanks.
struct Hidden<'a> {
    flanks: Flanks<'a>,
    /// Whether a cell lies in a shadow that is open to the ground.
    open: Vec<bool>,
    /// The rims for the lower bound.
    sure: Vec<Rim>,
    /// Lower and upper bound of the flank above the base, in m; 0 where no flank reaches.
    sure_m: Vec<f64>,
    crest_m: Vec<f64>,
    /// Mean of the two bounds, in m.
    above_m: Vec<f64>,
}

impl<'a> Hidden<'a> {
    fn behind(window: &'a Window, above: &'a [f64]) -> Self {
        let flanks = Flanks::of(window, above);
        let core = |cell: usize| window.zones[cell] == Zone::Core;
        let open = open_cells(&window.grid, |cell| flanks.unseen(cell), core);
        let sure = flanks.rims(Edge::Sure);
        let sure_m = flanks.down(&sure, 0.0);
        let rise_m = flanks.repose.slope * window.grid.cell_m;
        let crest_m = flanks.down(&flanks.rims(Edge::Crest { rise_m }), 0.0);
        let above_m = sure_m.iter().zip(&crest_m).map(|(low, high)| 0.5 * (low + high)).collect();
        Self { flanks, open, sure, sure_m, crest_m, above_m }
    }

    fn covers(&self, cell: usize) -> bool {
        self.open[cell] && self.above_m[cell] > 0.0
    }

    /// Volume in m³ between the flanks and the line of sight over the crest. A harmonic
    /// interpolation across the whole shadow stands for that line: it ends where the line meets the
    /// ground.
    fn below_sight_m3(&self, window: &Window) -> f64 {
        let hidden = |&cell: &usize| self.flanks.unseen(cell) && self.open[cell];
        let held: Vec<usize> = window.held().filter(hidden).collect();
        if held.is_empty() {
            return 0.0;
        }
        let mut sight_m = self.flanks.above.to_vec();
        let shadow: Vec<usize> =
            (0..sight_m.len()).filter(|&cell| self.flanks.unseen(cell)).collect();
        stretch(window, &mut sight_m, &shadow);
        let slack = held.iter().map(|&cell| (sight_m[cell] - self.above_m[cell]).max(0.0));
        slack.sum::<f64>() * window.grid.cell_m * window.grid.cell_m
    }

    /// Standard uncertainty of the volume of the occluded flanks, in m³.
    fn u_m3(&self) -> f64 {
        let sum = |high: &[f64], low: &[f64]| {
            let behind = (0..self.open.len()).filter(|&cell| self.open[cell]);
            behind.map(|cell| high[cell] - low[cell]).sum::<f64>()
        };
        let steeper = |times: f64| self.flanks.down(&self.sure, times);
        let u_angle = 0.5 * sum(&steeper(-1.0), &steeper(1.0));
        let u_rim = 0.5 * ANYWHERE * sum(&self.crest_m, &self.sure_m);
        let cell_m = self.flanks.window.grid.cell_m;
        u_angle.hypotenuse(u_rim) * cell_m * cell_m
    }
}

/// Interpolates harmonically across the cells of `gap`.
fn stretch(window: &Window, filled: &mut [f64], gap: &[usize]) {
    let known = filled.iter().filter(|h| !h.is_nan());
    let largest = known.fold(0.0_f64, |most, h| most.max(h.abs()));
    gap.iter().for_each(|&cell| filled[cell] = 0.0);
    let nodes: Vec<Node> = gap.iter().map(|&cell| Node::free(cell)).collect();
    relax(filled, window.grid.columns, &nodes, largest);
}

#[cfg(test)]
mod tests {
    use super::super::tests::{CELL, exact, window_of};
    use super::*;

    #[test]
    fn the_surface_of_a_gap_lies_anywhere_between_a_film_and_the_lowest_that_material_stands() {
        let is_block = |x: f64, y: f64| (x - 4.0).abs() < 1.0 && (y - 3.0).abs() < 1.0;
        let mut map = exact(|x, y| if is_block(x, y) { 1.0 } else { 0.0 });
        let gap = map.grid.cell(&[4.0, 3.0]);
        map.heights_m[gap] = f64::NAN;
        let window = window_of(&map, is_block);
        let u_m3 = fill(&window, &window.heights_m).u_m3;
        // The film is level. From what was seen for sure, two cells away and one aside, and from a
        // crest in the next cell, the flank comes down by half of that way, at a slope of 32.5°.
        let low_m = 32.5_f64.to_radians().tan() * 0.5 * 5.0_f64.sqrt() * CELL;
        assert!((u_m3 / (low_m * CELL * CELL / 3.0_f64.sqrt()) - 1.0).abs() < 0.01, "{u_m3}");
    }

    #[test]
    fn below_the_line_of_sight_what_is_higher_is_less_likely() {
        let cone = |x: f64, y: f64| (0.5 * (1.2 - (x - 4.0).hypot(y - 3.0))).max(0.0);
        let lit = |x: f64, y: f64| x < 4.2 || (y - 3.0).abs() > 1.6 || x > 6.2;
        let map = exact(|x, y| if lit(x, y) { cone(x, y) } else { f64::NAN });
        let window = window_of(&map, |x, y| lit(x, y) && cone(x, y) > 0.05);
        let above = &window.heights_m;
        let hidden = Hidden::behind(&window, above);
        let (filled, harmonic) = closed(&window, above, gaps_of(&window, above), &hidden);
        let slack: f64 = harmonic.iter().map(|&c| (filled[c] - hidden.above_m[c]).abs()).sum();
        let others_m3 = hidden.u_m3().hypot(slack * CELL * CELL / 3.0_f64.sqrt());
        let sight_m3 = (fill(&window, above).u_m3.powi(2) - others_m3.powi(2)).sqrt();
        let sixth = hidden.below_sight_m3(&window) / 6.0_f64.sqrt();
        assert!(sixth > 0.0 && (sight_m3 / sixth - 1.0).abs() < 0.1, "{sight_m3} {sixth}");
    }
}
