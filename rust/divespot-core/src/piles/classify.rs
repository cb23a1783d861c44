//! Decides whether an object can be a pile of bulk material: a table of reasons why not.
//!
//! Poured material runs out to the ground, so the rim of a pile is low and its sides are not steep.
//!
//! These rules judge an object by itself. What takes other objects, or the points off the surface,
//! to tell is judged afterwards: `detection_limit`, `floating`, `occlusion_edge`, `things`.

use super::base::{Base, Kind};
use super::reason::Reason;
use super::wall;
use super::window::{Window, Zone};
use crate::count::to_f64;
use crate::material::NEVER_STEEPER;

/// The rim of a pile is at most this high, as a share of the object's height. Chosen on the scenes
/// of `divespot evaluate`.
const LOW: f64 = 0.35;
/// An object with more than this share of its rim high is not poured. Chosen on the scenes of
/// `divespot evaluate`.
const HIGH_SHARE: f64 = 0.5;
/// The object's height is this quantile of its cells' heights. Chosen: nearer 1 outliers raise it,
/// lower cuts off peaks (a cone's is 0.78 of its height; closed form: 1 - √0.05).
const TOP: f64 = 0.95;
/// Smallest share of the footprint that must be seen. With less, the crest and more than half of
/// the surface would be assumed, not measured. Chosen on the scenes of `divespot evaluate`.
const LEAST_SEEN: f64 = 0.4;
/// A pile fills the view if more than this share of its toe lies beyond the scan. Chosen: half;
/// lower refuses piles cut off on one side, higher measures on ground that was hardly seen.
const FILLS_VIEW: f64 = 0.5;

/// A reason, and whether the evidence speaks for it.
type Rule = (Reason, fn(&Evidence<'_>) -> bool);

/// The reasons, in the order in which they are given.
const RULES: [Rule; 4] = [
    (Reason::Thin, |evidence| evidence.shape.is_thin()),
    (Reason::SteepSides, |evidence| evidence.shape.is_steep()),
    (Reason::TooLittleSeen, |evidence| evidence.seen_fraction < LEAST_SEEN),
    (Reason::CutOff, |evidence| evidence.fills_view()),
];

/// What an object is judged by.
pub(crate) struct Evidence<'a> {
    pub(crate) shape: Shape<'a>,
    /// What it stands on; `None` where a base was asked for.
    pub(crate) own_base: Option<&'a Base>,
    /// Share of its footprint that was seen.
    pub(crate) seen_fraction: f64,
    /// Share of its toe beyond what was seen.
    pub(crate) beyond_edge: f64,
}

impl Evidence<'_> {
    /// The reason why the object is no pile, if there is one.
    pub(crate) fn why_no_pile(&self) -> Option<Reason> {
        RULES.iter().find(|(_, holds)| holds(self)).map(|(reason, _)| *reason)
    }

    /// Whether the pile fills the view: it runs out of the scan on most sides, and the little ground
    /// that was seen may not be typical of the rest.
    fn fills_view(&self) -> bool {
        let is_unknown = |base: &Base| matches!(base.kind, Kind::AnnulusLevel | Kind::Ground);
        self.own_base.is_some_and(is_unknown) && self.beyond_edge > FILLS_VIEW
    }
}

/// The part of an object that stands clear of the ground, without its toe and its hidden flanks.
pub(crate) struct Shape<'a> {
    pub(crate) window: &'a Window,
    /// Height of each cell above the ground around the object, NaN where nothing was seen.
    pub(crate) above_m: Vec<f64>,
    /// Within this the ground lies.
    pub(crate) margin_m: f64,
}

impl Shape<'_> {
    /// Whether bulk material could lie so.
    pub(crate) fn could_be_poured(&self) -> bool {
        !self.is_thin() && !self.is_steep()
    }

    fn is_thin(&self) -> bool {
        self.window.rim().count() == self.window.cells(Zone::Core).count()
    }

    /// Whether it is steeper than bulk material lies. A pile is no higher than 60° over the radius of
    /// a disc of its area (a rod with flying pixels around it is), and most of its rim is low where
    /// the surface beyond was seen.
    fn is_steep(&self) -> bool {
        let top_m = self.top_m();
        if top_m > NEVER_STEEPER * self.radius_m() {
            return true;
        }
        let low_m = (LOW * top_m).max(2.0 * self.margin_m);
        let tells = |&cell: &usize| self.sees_outside(cell) && !wall::is_beside(self.window, cell);
        let rim: Vec<usize> = self.window.rim().filter(tells).collect();
        let high = rim.iter().filter(|&&cell| self.above_m[cell] > low_m).count();
        to_f64(high) > HIGH_SHARE * to_f64(rim.len())
    }

    /// Whether the surface was seen just beyond a rim cell; if not, the object may continue there.
    fn sees_outside(&self, cell: usize) -> bool {
        let outside = |n: usize| self.window.zones[n] != Zone::Core && !self.above_m[n].is_nan();
        self.window.around(cell, 2).any(outside)
    }

    /// The radius of a disc with the core's area, in m.
    fn radius_m(&self) -> f64 {
        let cells = to_f64(self.window.cells(Zone::Core).count());
        (cells / std::f64::consts::PI).sqrt() * self.window.grid.cell_m
    }

    fn top_m(&self) -> f64 {
        let core = self.window.cells(Zone::Core).map(|cell| self.above_m[cell]);
        let mut heights: Vec<f64> = core.filter(|h| !h.is_nan()).collect();
        let index = (TOP * to_f64(heights.len())) as usize;
        if index >= heights.len() {
            return 0.0;
        }
        *heights.select_nth_unstable_by(index, f64::total_cmp).1
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::{exact, window_of};
    use super::*;

    #[test]
    fn an_object_of_whose_rim_half_is_high_does_not_lie_as_poured() {
        let is_steep = |tenths: usize| {
            let window = window_of(&exact(|_, _| 0.0), |x, y| (x - 4.0).hypot(y - 3.0) < 1.0);
            let mut above = window.heights_m.clone();
            window.cells(Zone::Core).for_each(|cell| above[cell] = 1.0);
            let rim: Vec<usize> = window.rim().collect();
            for (i, &cell) in rim.iter().enumerate() {
                above[cell] = if i * 7 % 20 < tenths { 0.5 } else { 0.2 };
            }
            Shape { window: &window, above_m: above, margin_m: 0.01 }.is_steep()
        };
        assert_eq!((is_steep(7), is_steep(14)), (false, true));
    }
}
