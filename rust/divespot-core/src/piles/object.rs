//! Measures one object: its volume above its base and the properties that are reported with it.
//!
//! The volume is the sum over its cells of height above the base × area × share, in m³.

use super::annulus::{annulus, annulus_base, annulus_plane};
use super::base::Base;
use super::budget::Budget;
use super::classify::{Evidence, Shape};
use super::part_height::part_height;
use super::reason::Reason;
use super::settings::Settings;
use super::window::{Window, Zone};
use super::{banks, gaps, outline, wall};
use crate::cancel::Polled;
use crate::count::to_f64;
use crate::heightmap::{Volume, integrate};
use crate::parallel::both;

/// An object that stands on the ground.
#[derive(Debug, Clone, PartialEq)]
pub struct Object {
    /// The label of its cells.
    pub label: i32,
    /// Volumes above and below the base, in m³.
    pub volume: Volume,
    /// Volumes above the other bases asked for, in m³.
    pub compared_m3: Vec<f64>,
    /// The uncertainty budget.
    pub budget: Budget,
    /// The base surface.
    pub base: Base,
    /// Area of the cells that it covers, in m².
    pub footprint_m2: f64,
    /// Height of its highest cell above the base, in m.
    pub max_height_m: f64,
    /// Middle of every cell that it covers, and its height above the base, in m.
    pub covers_m: Vec<[f64; 3]>,
    /// Centroid of the volume, in m.
    pub centroid_m: [f64; 3],
    /// Outline of the footprint at the height of the base, counter-clockwise, in m.
    pub outline_m: Vec<[f64; 3]>,
    /// Base in the middle of every measured cell, in m.
    pub base_m: Vec<[f64; 3]>,
    /// Share of the footprint's cells that were seen.
    pub seen_fraction: f64,
    /// Whether it runs out of the scan.
    pub touches_edge: bool,
    /// Whether it leans on walls, which are not part of it.
    pub leans_on_wall: bool,
    /// Why it is no pile; `None` for a pile.
    pub reason: Option<Reason>,
}

/// An object touches the scan's edge if more than this share of its toe lies beyond. Chosen on the
/// scenes of `divespot evaluate`.
pub(crate) const CUT_OFF: f64 = 0.1;

/// An object with fewer cells is judged on one thread. Decides no answer.
const LARGE: usize = 1 << 13;

/// Measures `window`, the object with its occluded flanks; `found`, without them, decides whether it
/// is a pile.
pub(crate) fn object_of(
    label: i32,
    found: &Window,
    window: &Window,
    settings: &Settings,
) -> Object {
    let base = base_of(window, settings.base.as_ref(), settings);
    let above = above_base(window, &base);
    let gaps = gaps::fill(window, &above);
    let filled = &gaps.above_m;
    let footprint = footprint_of(window, filled, settings.margin_m);
    let covered: Vec<usize> = (0..footprint.len()).filter(|&cell| footprint[cell]).collect();
    let share = |cells: &mut dyn Iterator<Item = &usize>| -> f64 {
        cells.fold(0.0, |sum, &cell| sum + window.counted(cell).share)
    };
    let seen = share(&mut covered.iter().filter(|&&cell| !above[cell].is_nan()));
    let whole = share(&mut covered.iter());
    let seen_fraction = seen / whole.max(f64::MIN_POSITIVE);
    let compared = settings.compared.iter();
    let threads = if window.zones.len() < LARGE { 1 } else { settings.threads };
    let toe = || outline::outline(&window.grid, &with_toe(window, &footprint));
    let drawn = || {
        let held = window.held().map(|cell| window.grid.center(cell)).collect();
        (on_base(&base, toe()), on_base(&base, held), centroid(window, &base, &covered, filled))
    };
    let judged = || {
        let reason = evidence(found, window, &base, seen_fraction, settings).why_no_pile();
        (reason, Budget::of(window, &base, &gaps, settings.toe_cells))
    };
    let ((outline_m, base_m, centroid_m), (reason, budget)) = both(threads, drawn, judged);
    Object {
        label,
        volume: volume(window, filled),
        compared_m3: compared.map(|base| compared_m3(window, base.as_ref(), settings)).collect(),
        budget,
        footprint_m2: whole * window.grid.cell_m * window.grid.cell_m,
        max_height_m: covered.iter().map(|&cell| filled[cell]).fold(0.0, f64::max),
        covers_m: covered.iter().map(|&cell| raised(window, cell, filled[cell])).collect(),
        centroid_m,
        outline_m,
        base_m,
        seen_fraction,
        touches_edge: touches_edge(window),
        leans_on_wall: wall::leans(window),
        reason,
        base,
    }
}

/// What the object is judged by.
fn evidence<'a>(
    found: &'a Window,
    window: &Window,
    base: &'a Base,
    seen_fraction: f64,
    settings: &Settings,
) -> Evidence<'a> {
    Evidence {
        shape: shape_above_ground(found, base, settings),
        own_base: settings.base.is_none().then_some(base),
        seen_fraction,
        beyond_edge: beyond_edge(window),
    }
}

/// The object's shape above the ground around it, whichever base was asked for.
fn shape_above_ground<'a>(found: &'a Window, local: &Base, settings: &Settings) -> Shape<'a> {
    let around =
        || annulus_plane(found).map_or_else(|| settings.ground.clone(), |(plane, _)| plane);
    let ground = if settings.base.is_none() { local.clone() } else { around() };
    shape(found, &ground, settings)
}

pub(crate) fn shape<'a>(found: &'a Window, ground: &Base, settings: &Settings) -> Shape<'a> {
    Shape { window: found, above_m: above_base(found, ground), margin_m: settings.margin_m }
}

/// The base asked for, as it is below this object.
pub(crate) fn base_of(window: &Window, wanted: Option<&Base>, settings: &Settings) -> Base {
    let Some(base) = wanted else {
        return annulus_base(window).unwrap_or_else(|| settings.ground.clone());
    };
    let (center, annulus) = annulus(window);
    banks::with_banks(base.clone().held_against(center, &annulus), window)
}

/// The volume of the counted cells, above and below the base.
fn volume(window: &Window, filled: &[f64]) -> Volume {
    let part = |cell: usize| window.counted(cell).share * part_height(window, filled, cell);
    integrate(window.held().map(part), window.grid.cell_m)
}

fn compared_m3(window: &Window, wanted: Option<&Base>, settings: &Settings) -> f64 {
    let above = above_base(window, &base_of(window, wanted, settings));
    volume(window, &gaps::heights(window, &above)).net_m3()
}

pub(crate) fn above_base(window: &Window, base: &Base) -> Vec<f64> {
    let heights = window.heights_m.iter().enumerate();
    heights.polled().map(|(cell, h)| h - base.at(window.grid.center(cell))).collect()
}

/// The cells that the object covers: its core, and the part of the toe that stands clear of the
/// base.
///
/// The threshold is a third of the margin for the mean of up to nine toe cells, whose noise is a
/// third of one cell's.
fn footprint_of(window: &Window, filled: &[f64], margin_m: f64) -> Vec<bool> {
    let toe = |cell: usize| window.zones[cell] == Zone::Toe;
    let clear =
        |cell: usize| window.mean_around(filled, cell, toe).is_some_and(|h| h > margin_m / 3.0);
    let covers = |cell: usize| match window.zones[cell] {
        Zone::Core => window.counted(cell).share > 0.0,
        Zone::Toe => !window.heights_m[cell].is_nan() && clear(cell),
        Zone::Outside | Zone::Annulus | Zone::Far => false,
    };
    (0..window.zones.len()).polled().map(covers).collect()
}

/// The footprint and the toe cells around it, for the outline: a tight line would cut the toe off.
fn with_toe(window: &Window, footprint: &[bool]) -> Vec<bool> {
    let toe = |cell: usize| window.zones[cell] == Zone::Toe && window.counted(cell).share > 0.0;
    let beside = |cell: usize| window.around(cell, 1).any(|n| footprint[n]);
    (0..footprint.len()).polled().map(|c| footprint[c] || toe(c) && beside(c)).collect()
}

fn raised(window: &Window, cell: usize, height_m: f64) -> [f64; 3] {
    let [x, y] = window.grid.center(cell);
    [x, y, height_m]
}

fn centroid(window: &Window, base: &Base, covered: &[usize], filled: &[f64]) -> [f64; 3] {
    let (mut weight, mut sum) = (0.0, [0.0; 3]);
    for &cell in covered.iter().polled() {
        let height = window.counted(cell).share * filled[cell].max(0.0);
        let [x, y] = window.grid.center(cell);
        let middle = [x, y, base.at([x, y]) + filled[cell].max(0.0) / 2.0];
        weight += height;
        (0..3).for_each(|k| sum[k] += height * middle[k]);
    }
    sum.map(|s| if weight > 0.0 { s / weight } else { f64::NAN })
}

pub(crate) fn on_base(base: &Base, line: Vec<[f64; 2]>) -> Vec<[f64; 3]> {
    line.into_iter().polled().map(|[x, y]| [x, y, base.at([x, y])]).collect()
}

/// Whether much of the toe lies beyond the scan's edge.
fn touches_edge(window: &Window) -> bool {
    beyond_edge(window) > CUT_OFF
}

/// The share of the toe that lies beyond the scan's edge.
fn beyond_edge(window: &Window) -> f64 {
    let toe: Vec<usize> = window.cells(Zone::Toe).collect();
    let cut = window.cells(Zone::Core).filter(|&cell| window.border[cell]).count();
    let off_scan = toe.iter().filter(|&&cell| window.off_scan[cell]).count() + cut;
    to_f64(off_scan) / to_f64((toe.len() + cut).max(1))
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::super::base::Kind;
    use super::super::coverage::Coverage;
    use super::super::tests::{exact, settings, window_of};
    use super::*;

    fn cone(x: f64, y: f64) -> f64 {
        (0.5 * (1.2 - (x - 4.0).hypot(y - 3.0))).max(0.0)
    }

    /// A cone of whose toe ten times this share lies beyond what was seen.
    fn off_scan(tenths: usize) -> Window {
        let mut window = window_of(&exact(cone), |x, y| cone(x, y) > 0.05);
        let toe: Vec<usize> = window.cells(Zone::Toe).collect();
        let cut = toe.iter().enumerate().filter(|(i, _)| i % 100 < tenths).map(|(_, &cell)| cell);
        let off_scan = Arc::make_mut(&mut window.off_scan);
        cut.for_each(|cell| off_scan[cell] = true);
        window
    }

    #[test]
    fn a_toe_of_which_a_tenth_lies_beyond_the_scan_is_cut_off() {
        assert!(touches_edge(&off_scan(15)) && !touches_edge(&off_scan(6)));
    }

    #[test]
    fn a_pile_of_whose_toe_half_does_fills_the_view() {
        let base = Base::plane(0.0, [0.0; 2], 0.0, 0.0, Kind::AnnulusLevel);
        let reason = |tenths| {
            let window = off_scan(tenths);
            let evidence = Evidence {
                shape: shape(&window, &base, &settings()),
                own_base: Some(&base),
                seen_fraction: 1.0,
                beyond_edge: beyond_edge(&window),
            };
            evidence.why_no_pile()
        };
        assert_eq!((reason(65), reason(40)), (Some(Reason::CutOff), None));
    }

    #[test]
    fn of_an_object_that_covers_nothing_nothing_was_seen() {
        let mut window = window_of(&exact(cone), |x, y| cone(x, y) > 0.05);
        window.count_parts(|_| Coverage::default());
        let seen = object_of(0, &window, &window, &settings()).seen_fraction;
        assert!(seen == 0.0 && seen.is_sign_positive(), "{seen}");
    }

    #[test]
    fn of_a_pile_two_fifths_must_have_been_seen() {
        let found = window_of(&exact(cone), |x, y| cone(x, y) > 0.05);
        let reason = |tenths: usize| {
            let mut seen = found.clone();
            let core: Vec<usize> = seen.cells(Zone::Core).collect();
            let unseen = core.iter().enumerate().filter(|(i, _)| i * 7 % 10 >= tenths);
            unseen.for_each(|(_, &cell)| seen.heights_m[cell] = f64::NAN);
            object_of(0, &found, &seen, &settings()).reason
        };
        assert_eq!((reason(2), reason(6)), (Some(Reason::TooLittleSeen), None));
    }
}
