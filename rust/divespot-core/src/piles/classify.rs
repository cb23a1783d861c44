//! Whether an object can be a pile of bulk material: a table of reasons why not.
//!
//! These rules judge an object by itself. What takes other objects, or the points off the surface,
//! to tell is judged afterwards: `clear`, `floating`, `shadow`, `things`.

use super::base::{Base, Kind};
use super::patch::{Patch, Zone};
use super::reason::Reason;
use super::wall;
use crate::count::to_f64;
use crate::material::NEVER_STEEPER;

/// Poured material runs out to the ground. The rim of what stands clear of the ground is therefore
/// low: at most this share of the object's height.
const LOW: f64 = 0.35;
/// An object with this share of its rim high does not lie as poured.
const HIGH_SHARE: f64 = 0.5;
/// The object's height is the one that this share of its cells stays below.
const TOP: f64 = 0.95;
/// With less of its footprint seen than this, a pile's volume is no measurement any more: its crest
/// and more than half of its surface would be assumed.
const LEAST_SEEN: f64 = 0.4;
/// With more of its toe cut off than this, a pile fills the view.
const FILLS_VIEW: f64 = 0.5;

/// The reasons, in the order in which they are given.
const RULES: [(Reason, fn(&Evidence<'_>) -> bool); 4] = [
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

    /// A pile that fills the view: it runs out of the scan on most sides, and what was seen of the
    /// ground on one of them may be anything.
    fn fills_view(&self) -> bool {
        let is_unknown = |base: &Base| matches!(base.kind, Kind::RingLevel | Kind::Ground);
        self.own_base.is_some_and(is_unknown) && self.beyond_edge > FILLS_VIEW
    }
}

/// The part of an object that stands clear of the ground, without its toe and its hidden flanks.
pub(crate) struct Shape<'a> {
    pub(crate) patch: &'a Patch,
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
        self.patch.rim().count() == self.patch.cells(Zone::Core).count()
    }

    /// No pile is higher than material ever stands for the radius of a disc as large as it is: a rod
    /// with a skirt of flying pixels is. Nor is most of its rim high, where it is open to the sides.
    fn is_steep(&self) -> bool {
        let top_m = self.top_m();
        if top_m > NEVER_STEEPER * self.radius_m() {
            return true;
        }
        let low_m = (LOW * top_m).max(2.0 * self.margin_m);
        let tells = |&cell: &usize| self.sees_outside(cell) && !wall::is_beside(self.patch, cell);
        let rim: Vec<usize> = self.patch.rim().filter(tells).collect();
        let high = rim.iter().filter(|&&cell| self.above_m[cell] > low_m).count();
        to_f64(high) > HIGH_SHARE * to_f64(rim.len())
    }

    /// Whether something was seen just beyond a rim cell; where not, the object may go on.
    fn sees_outside(&self, cell: usize) -> bool {
        let outside = |n: usize| self.patch.zones[n] != Zone::Core && !self.above_m[n].is_nan();
        self.patch.around(cell, 2).any(outside)
    }

    /// The radius of a disc as large as the core.
    fn radius_m(&self) -> f64 {
        let cells = to_f64(self.patch.cells(Zone::Core).count());
        (cells / std::f64::consts::PI).sqrt() * self.patch.grid.cell_m
    }

    fn top_m(&self) -> f64 {
        let core = self.patch.cells(Zone::Core).map(|cell| self.above_m[cell]);
        let mut heights: Vec<f64> = core.filter(|h| !h.is_nan()).collect();
        let index = (TOP * to_f64(heights.len())) as usize;
        if index >= heights.len() {
            return 0.0;
        }
        *heights.select_nth_unstable_by(index, f64::total_cmp).1
    }
}
