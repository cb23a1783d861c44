//! Measures inside given outlines instead of finding objects; areas in m², volumes in m³.
//!
//! Each cell counts by the exact area of its part inside the outline.

use super::base::FEWEST;
use super::budget::Budget;
use super::coverage::{Coverage, ROUNDING, Ring, moments, part};
use super::enclosed::up_to_faces;
use super::found::Found;
use super::gaps::ANYWHERE;
use super::nearest_label::NearestLabel;
use super::object::{Object, base_of, object_of, on_base};
use super::repose::Repose;
use super::scene::Scene;
use super::settings::Settings;
use super::window::{Reach, Window, Zone};
use crate::cancel::poll;
use crate::connectivity::UNLABELLED;
use crate::count::to_f64;
use crate::error::{Error, Result};
use crate::extent;
use crate::heightmap::Grid;
use crate::hypotenuse::Hypotenuse;
use crate::material::NEVER_STEEPER;

/// Labels of the region's own cells and of the cells of other regions.
const OWN: i32 = 0;
const OTHERS: i32 = 1;

/// What is wrong with a region in which nothing was seen.
const NOTHING: &str = "lies where the scan saw nothing: a place inside the scan is needed";

/// Distances, in cells, at which the nearest surface is looked for, in this order.
const NEAREST: [usize; 6] = [1, 2, 4, 8, 16, 32];
/// From this many cells away, the seen surface says nothing of an unseen cell. Chosen: it bounds
/// the time; lower tells too small an uncertainty of wide gaps.
const FARTHEST: u32 = 200;
/// An area in plan: counter-clockwise lines around it, clockwise lines around its holes.
#[derive(Debug, Clone, PartialEq)]
pub struct Region {
    /// The lines in m, the one shown as the outline first.
    pub rings: Vec<Ring>,
}

impl Region {
    /// The area of the region, in m².
    #[must_use]
    pub fn area_m2(&self) -> f64 {
        self.rings.iter().map(|ring| moments(ring, [0.0; 2])[0]).sum()
    }

    /// The cells inside and the exact part of each: the lines are clipped to the cell's square.
    fn parts(&self, grid: &Grid, number: usize) -> Result<Vec<(usize, Coverage)>> {
        let mut sums = vec![[0.0; 3]; grid.len()];
        for ring in &self.rings {
            add_moments(grid, ring, &mut sums);
        }
        let area = grid.cell_m * grid.cell_m;
        if sums.iter().any(|s| !(-ROUNDING..=1.0 + ROUNDING).contains(&(s[0] / area))) {
            let problem = "has lines that overlap, or a hole outside: an area that is covered \
                           once is needed";
            return Err(Error::Outline { number, problem });
        }
        let inside = sums.into_iter().enumerate().map(|(cell, sums)| (cell, part(sums, area)));
        Ok(inside.filter(|(_, part)| part.share > 0.0).collect())
    }
}

/// Adds the area and first moments of `ring` in each cell, about the cell's middle.
fn add_moments(grid: &Grid, ring: &[[f64; 2]], sums: &mut [[f64; 3]]) {
    let mut above = ring.to_vec();
    for row in 0..grid.rows {
        poll();
        let (strip, rest) = split(above, 1, grid.origin_m[1] + to_f64(row + 1) * grid.cell_m);
        above = rest;
        // The part before the first row or column lies in no cell.
        let strip = if row == 0 { split(strip, 1, grid.origin_m[1]).1 } else { strip };
        let mut right = split(strip, 0, grid.origin_m[0]).1;
        for column in 0..grid.columns {
            if right.is_empty() {
                break;
            }
            let edge = grid.origin_m[0] + to_f64(column + 1) * grid.cell_m;
            let (piece, rest) = split(right, 0, edge);
            right = rest;
            let cell = row * grid.columns + column;
            let found = moments(&piece, grid.center(cell));
            (0..3).for_each(|k| sums[cell][k] += found[k]);
        }
    }
}

/// The parts below and above `at` along an axis (Sutherland and Hodgman 1974). Separate pieces stay
/// joined by a line along the cut, there and back, which adds no area.
fn split(ring: Ring, axis: usize, at: f64) -> (Ring, Ring) {
    if ring.iter().all(|p| p[axis] >= at) {
        return (Vec::new(), ring);
    }
    if ring.iter().all(|p| p[axis] <= at) {
        return (ring, Vec::new());
    }
    let (mut below, mut above) = (Vec::new(), Vec::new());
    for (i, &p) in ring.iter().enumerate() {
        let q = ring[(i + 1) % ring.len()];
        if p[axis] <= at {
            below.push(p);
        }
        if p[axis] >= at {
            above.push(p);
        }
        if (p[axis] - at) * (q[axis] - at) < 0.0 {
            let share = (at - p[axis]) / (q[axis] - p[axis]);
            let mut cut = [0, 1].map(|k| p[k] + share * (q[k] - p[k]));
            cut[axis] = at;
            below.push(cut);
            above.push(cut);
        }
    }
    (below, above)
}

/// Measures the volume inside each region, in their order; each counts as a pile.
///
/// The local base of a region is fitted to the annulus of ground that a pile of its shape would
/// have, without other regions. Walls inside a region, and what they hide, do not count.
///
/// # Errors
///
/// A number of heights that is not the number of cells, a region over which nothing was seen, or
/// one whose lines overlap.
///
/// # Examples
///
/// ```
/// use divespot_core::heightmap::height_map;
/// use divespot_core::piles::{Base, Found, Region, Settings, measure_inside};
///
/// // A cone 0.2 m high and 0.8 m wide on a floor, a point each 2 cm.
/// let cone = |x: f64, y: f64| (0.2 - 0.5 * (x - 1.0).hypot(y - 1.0)).max(0.0);
/// let places = (0..10_000).map(|i| [f64::from(i % 100) * 0.02, f64::from(i / 100) * 0.02]);
/// let points: Vec<_> = places.map(|[x, y]| [x, y, cone(x, y)]).collect();
/// let map = height_map(&points, 0.04)?;
/// let grid = &map.grid;
/// let ground = Base::ground(0.0, 0.001, 0.001);
/// let settings = Settings {
///     toe_cells: 3,
///     annulus_share: 0.15,
///     margin_m: 0.02,
///     base: Some(ground.clone()),
///     compared: Vec::new(),
///     ground,
///     link_cells: 2,
///     fewest_cells: 20,
///     threads: 0,
/// };
/// let found = Found::on_all_else(vec![-1; grid.len()]);
/// let around = Region { rings: vec![vec![[0.5, 0.5], [1.5, 0.5], [1.5, 1.5], [0.5, 1.5]]] };
/// let objects = measure_inside(grid, &map.heights_m, &[around], &found, &settings)?;
/// let truth_m3 = std::f64::consts::PI * 0.4_f64.powi(2) * 0.2 / 3.0;
/// assert!((objects[0].footprint_m2 - 1.0).abs() < 1e-9, "exact to the line");
/// assert!((objects[0].volume.net_m3() / truth_m3 - 1.0).abs() < 0.01);
/// # Ok::<(), divespot_core::Error>(())
/// ```
pub fn measure_inside(
    grid: &Grid,
    heights_m: &[f64],
    regions: &[Region],
    found: &Found,
    settings: &Settings,
) -> Result<Vec<Object>> {
    Inside::of(grid, heights_m, found, settings)?.measured(regions, found, settings)
}

/// A scene of which the points have been used: measuring inside outlines needs its cells alone.
pub struct Inside<'a> {
    scene: Scene<'a>,
    /// Whether something hides the surface.
    covered: Vec<bool>,
}

impl<'a> Inside<'a> {
    /// Finds the faces, and what is covered.
    ///
    /// # Errors
    ///
    /// As [`measure_inside`].
    pub fn of(
        grid: &'a Grid,
        heights_m: &[f64],
        found: &Found,
        settings: &Settings,
    ) -> Result<Self> {
        found.require_fit(grid)?;
        let mut scene = Scene::new(grid, heights_m, found, settings.margin_m)?;
        let mut lowest_m = vec![f64::NAN; grid.len()];
        for p in found.loose.iter().filter(|p| grid.holds(p)) {
            let lowest = &mut lowest_m[grid.cell(p)];
            *lowest = lowest.min(p[2]);
        }
        scene.off_scan = off_scan(grid, &scene.heights_m, &lowest_m);
        let covered =
            (0..grid.len()).map(|c| is_covered(grid, &scene.heights_m, c, lowest_m[c])).collect();
        Ok(Self { scene, covered })
    }

    /// Measures inside each outline. Of what was `found`, only the ground is needed.
    ///
    /// # Errors
    ///
    /// As [`measure_inside`].
    pub fn measured(
        self,
        regions: &[Region],
        found: &Found,
        settings: &Settings,
    ) -> Result<Vec<Object>> {
        let Self { scene, covered } = self;
        let grid = scene.grid;
        let parts: Vec<Vec<(usize, Coverage)>> = regions
            .iter()
            .zip(1..)
            .map(|(region, n)| region.parts(grid, n))
            .collect::<Result<_>>()?;
        let mut labels = vec![UNLABELLED; grid.len()];
        parts.iter().flatten().for_each(|(cell, _)| labels[*cell] = OTHERS);
        let measured = (0i32..).zip(regions.iter().zip(&parts)).map(|(label, (region, parts))| {
            let number = label as usize + 1;
            let nothing = Error::Outline { number, problem: NOTHING };
            let window = window_of(&scene, found, &labels, parts, settings).ok_or(nothing)?;
            let settings = Settings { toe_cells: 0, ..settings.clone() };
            let in_it = |p: [f64; 2]| covered[grid.cell(&p)];
            Ok(inside(label, region, window, in_it, &scene, &settings))
        });
        measured.collect()
    }
}

/// Standard uncertainty of the volume in the unseen part of a region, in m³: from the last seen
/// cell the surface may rise or fall at any angle of repose.
fn u_carried_on_m3(window: &Window) -> f64 {
    let seen = |cell: usize| !window.heights_m[cell].is_nan();
    let label = |cell: usize| if seen(cell) { OWN } else { UNLABELLED };
    let labels: Vec<i32> = (0..window.zones.len()).map(label).collect();
    let steps =
        NearestLabel::grow(&window.grid, &labels, |cell| !window.off_scan[cell], FARTHEST).steps;
    let unseen = window.held().filter(|&cell| !seen(cell) && !window.off_scan[cell]);
    let away = unseen.map(|cell| {
        window.counted(cell).share * f64::from(steps[cell].min(FARTHEST).saturating_sub(1))
    });
    Repose::ANY.slope * ANYWHERE * away.sum::<f64>() * window.grid.cell_m.powi(3)
}

/// The cells outside the convex hull of all points, on the surface or off it: an occluded gap
/// between a surface and a wall is not the end of the scan.
fn off_scan(grid: &Grid, heights_m: &[f64], loose_m: &[f64]) -> Vec<bool> {
    let seen = heights_m.iter().zip(loose_m).map(|(&h, &loose)| if h.is_nan() { loose } else { h });
    extent::off_scan_cells(grid, &seen.collect::<Vec<_>>())
}

/// Whether the lowest point off the surface over an unseen cell is higher than material could reach
/// from the nearest seen cells. Lower points do not hide the surface: the walk just did not reach
/// them.
fn is_covered(grid: &Grid, heights_m: &[f64], cell: usize, lowest_m: f64) -> bool {
    if lowest_m.is_nan() || !heights_m[cell].is_nan() {
        return false;
    }
    let highest = |away: usize| {
        let seen = grid.around(cell, away).map(|n| heights_m[n]).filter(|h| !h.is_nan());
        seen.reduce(f64::max).map(|h| h + NEVER_STEEPER * to_f64(away) * grid.cell_m)
    };
    NEAREST.into_iter().find_map(highest).is_some_and(|highest| lowest_m > highest)
}

/// The window around one region, given all regions' cells; `None` if nothing was seen inside.
fn window_of(
    scene: &Scene<'_>,
    found: &Found,
    taken: &[i32],
    parts: &[(usize, Coverage)],
    settings: &Settings,
) -> Option<Window> {
    if parts.iter().all(|(cell, _)| scene.heights_m[*cell].is_nan()) {
        return None;
    }
    let mut labels = taken.to_vec();
    let mut counts = vec![Coverage::default(); labels.len()];
    for &(cell, part) in parts {
        (labels[cell], counts[cell]) = (OWN, part);
    }
    let reach = Reach::each(&labels, settings.toe_cells, settings.annulus_share);
    let nearest = NearestLabel::grow(scene.grid, &labels, |_| true, reach[0].farthest());
    let (_, mut window) = Window::all(scene, &labels, &nearest, &reach).into_iter().next()?;
    window.count_parts(|center| counts[scene.grid.cell(&center)]);
    let grounded = |cell: usize| found.ground[scene.grid.cell(&window.grid.center(cell))];
    let ring = window.cells(Zone::Annulus).filter(|&cell| grounded(cell)).count();
    let zones = (0..window.zones.len()).map(|cell| match window.zones[cell] {
        Zone::Toe => Zone::Outside,
        Zone::Annulus | Zone::Far if ring >= FEWEST && !grounded(cell) => Zone::Outside,
        zone => zone,
    });
    window.zones = zones.collect();
    Some(window)
}

/// The object inside a region. Any shape counts, since the user asked for it.
fn inside(
    label: i32,
    region: &Region,
    window: Window,
    covered: impl Fn([f64; 2]) -> bool,
    scene: &Scene<'_>,
    settings: &Settings,
) -> Object {
    let within: f64 = window
        .held()
        .filter(|&cell| !window.off_scan[cell])
        .map(|cell| window.counted(cell).share)
        .sum();
    let base = base_of(&window, settings.base.as_ref(), settings);
    let window = up_to_faces(window, covered, scene, &base, settings.margin_m);
    let object = object_of(label, &window, &window, settings);
    let line = region.rings.first().cloned().unwrap_or_default();
    let whole_m2 = region.area_m2().max(f64::MIN_POSITIVE);
    let on_map = object.footprint_m2 / whole_m2;
    let on_map = if on_map > 1.0 - ROUNDING { 1.0 } else { on_map };
    let filled_m3 = object.budget.filled_m3.hypotenuse(u_carried_on_m3(&window));
    let within = within * window.grid.cell_m * window.grid.cell_m / whole_m2;
    Object {
        outline_m: on_base(&object.base, line),
        budget: Budget { filled_m3, ..object.budget },
        seen_fraction: object.seen_fraction * on_map,
        touches_edge: within < 1.0 - super::object::CUT_OFF,
        reason: None,
        ..object
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;

    const GRID: Grid = Grid { origin_m: [10.0, 20.0], cell_m: 0.5, columns: 12, rows: 10 };

    fn rectangle([x0, y0]: [f64; 2], [x1, y1]: [f64; 2]) -> Ring {
        vec![[x0, y0], [x1, y0], [x1, y1], [x0, y1]]
    }

    fn covered(region: &Region) -> f64 {
        region.parts(&GRID, 1).unwrap().iter().map(|(_, part)| part.share).sum::<f64>() * 0.25
    }

    /// First moment of the covered area along axis `k`, from the parts.
    fn moment(region: &Region, k: usize) -> f64 {
        let at = |(cell, part): &(usize, Coverage)| {
            part.share * 0.25 * (GRID.center(*cell)[k] + part.off_m[k])
        };
        region.parts(&GRID, 1).unwrap().iter().map(at).sum()
    }

    #[test]
    fn what_is_covered_adds_up_to_the_area_and_its_moments() {
        let star = |i: i32| (f64::from(i) * 0.628_318_5, if i % 2 == 0 { 2.1 } else { 0.7 });
        let ring: Ring = (0..10)
            .map(star)
            .map(|(turn, r)| [13.0 + r * turn.cos(), 22.4 + r * turn.sin()])
            .collect();
        let mut hole = rectangle([12.9, 22.2], [13.3, 22.9]);
        hole.reverse();
        let region = Region { rings: vec![ring.clone(), hole.clone()] };
        assert!((covered(&region) - region.area_m2()).abs() < 1e-9);
        for k in 0..2 {
            let whole = moments(&ring, [0.0; 2])[k + 1] + moments(&hole, [0.0; 2])[k + 1];
            assert!((moment(&region, k) - whole).abs() < 1e-9);
        }
    }

    #[test]
    fn a_comb_that_falls_into_teeth_within_a_row_is_covered_exactly() {
        let teeth =
            (0..20).map(|i| [10.3 + 0.25 * f64::from(i), if i % 2 == 0 { 21.6 } else { 23.9 }]);
        let ring: Ring = [[15.2, 20.1], [10.1, 20.1]].into_iter().chain(teeth).rev().collect();
        let region = Region { rings: vec![ring] };
        assert!(region.area_m2().abs() > 1.0);
        let turned = Region { rings: vec![region.rings[0].iter().rev().copied().collect()] };
        let right = if region.area_m2() > 0.0 { region } else { turned };
        assert!((covered(&right) - right.area_m2()).abs() < 1e-9);
    }

    #[test]
    fn beyond_the_grid_nothing_is_covered() {
        let over = Region { rings: vec![rectangle([9.0, 19.0], [11.25, 20.25])] };
        assert!((covered(&over) - 1.25 * 0.25).abs() < 1e-12);
        let around = Region { rings: vec![rectangle([0.0, 0.0], [99.0, 99.0])] };
        assert!((covered(&around) - 30.0).abs() < 1e-9);
        assert_eq!(covered(&Region { rings: vec![rectangle([0.0, 0.0], [5.0, 99.0])] }), 0.0);
    }

    #[test]
    fn lines_that_overlap_are_refused() {
        let twice =
            vec![rectangle([11.0, 21.0], [13.0, 23.0]), rectangle([12.0, 22.0], [14.0, 24.0])];
        assert!(Region { rings: twice }.parts(&GRID, 1).is_err());
        let bow = vec![[11.0, 21.0], [14.0, 21.0], [11.0, 24.0], [14.0, 24.0]];
        assert!(Region { rings: vec![bow] }.parts(&GRID, 1).is_err());
    }

    #[test]
    fn what_covers_a_cell_is_higher_than_material_from_the_nearest_surface() {
        let grid = Grid { origin_m: [0.0; 2], cell_m: 1.0, columns: 80, rows: 1 };
        let covered = |away: usize, lowest_m: f64| {
            let mut heights_m = vec![f64::NAN; 80];
            heights_m[40 + away] = 0.0;
            is_covered(&grid, &heights_m, 40, lowest_m)
        };
        // 60° over the cells that were looked over: one, or 32.
        assert!(covered(1, 2.0) && !covered(1, 1.5));
        assert!(covered(20, 60.0) && !covered(20, 50.0));
    }

    #[test]
    fn beyond_two_hundred_cells_from_what_was_seen_no_more_is_unknown() {
        let grid = Grid { origin_m: [0.0; 2], cell_m: 0.1, columns: 450, rows: 5 };
        let heights_m: Vec<f64> =
            (0..grid.len()).map(|cell| if cell % 450 < 5 { 1.0 } else { f64::NAN }).collect();
        let labels = vec![OWN; grid.len()];
        let scene =
            Scene::new(&grid, &heights_m, &Found::on_all_else(labels.clone()), 0.0).unwrap();
        let reach = Reach::each(&labels, 0, 0.2);
        let nearest = NearestLabel::grow(&grid, &labels, |_| true, 1);
        let mut window = Window::all(&scene, &labels, &nearest, &reach).remove(0).1;
        Arc::make_mut(&mut window.off_scan).fill(false);
        let steps: usize = (0..445).map(|away| 5 * usize::min(away, 199)).sum();
        let u_m3 = Repose::ANY.slope / 3.0_f64.sqrt() * to_f64(steps) * 0.1_f64.powi(3);
        assert!(
            (u_carried_on_m3(&window) / u_m3 - 1.0).abs() < 1e-3,
            "{}",
            u_carried_on_m3(&window)
        );
    }
}
