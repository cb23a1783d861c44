//! Measures every object of a scene: footprint in m², volumes and uncertainty budget in m³.
//!
//! Method: base surface and core from the ground around each object, occluded flanks, walls,
//! watershed, then volume and budget of each pile (`object`).

use std::collections::BTreeMap;

use super::annulus::annulus_plane;
use super::around::Around;
use super::base::Base;
use super::divided::Divided;
use super::found::Found;
use super::object::{Object, object_of, shape};
use super::reason::Reason;
use super::scene::Scene;
use super::settings::Settings;
use super::things::Things;
use super::window::{Reach, Window};
use super::{alone, detection_limit, occluded_flank, occlusion_edge};
use crate::cancel::Polled;
use crate::connectivity::UNLABELLED;
use crate::error::Result;
use crate::heightmap::Grid;
use crate::parallel::{both, map_each};
use crate::thread_count;

/// Measures every object in a levelled height map, and the things off its surface.
///
/// `heights_m` holds one value for each cell: the height of the surface in m, NaN where it was not
/// seen. The result lists the objects by label, then the things.
///
/// # Errors
///
/// A number of heights, labels or ground cells that is not the number of cells.
///
/// # Examples
///
/// ```
/// use divespot_core::heightmap::height_map;
/// use divespot_core::piles::{Base, Found, Settings, measure};
/// use divespot_core::surface::hills;
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
/// let found = Found::on_all_else(hills(grid, &map.heights_m)?.labels);
/// let objects = measure(grid, &map.heights_m, &found, &settings)?;
/// let truth_m3 = std::f64::consts::PI * 0.4_f64.powi(2) * 0.2 / 3.0;
/// assert_eq!(objects.len(), 1);
/// assert_eq!(objects[0].reason, None, "it is a pile");
/// assert!((objects[0].volume.net_m3() / truth_m3 - 1.0).abs() < 0.01);
/// # Ok::<(), divespot_core::Error>(())
/// ```
pub fn measure(
    grid: &Grid,
    heights_m: &[f64],
    found: &Found,
    settings: &Settings,
) -> Result<Vec<Object>> {
    Ok(Standing::of(grid, heights_m, found, settings)?.measured(found, settings))
}

/// A scene whose points have been used.
pub enum Standing<'a> {
    /// There are things, which only their points tell from what hangs over the surface: they and
    /// the objects on the surface have been measured.
    Measured(Vec<Object>),
    /// Nothing is off the surface: to measure what is on it takes its cells alone.
    Cells(Box<Cells<'a>>),
}

/// The cells of a scene in which nothing is off the surface.
pub struct Cells<'a> {
    heights_m: &'a [f64],
    scene: Scene<'a>,
}

impl<'a> Standing<'a> {
    /// Uses the points.
    ///
    /// # Errors
    ///
    /// As [`measure`].
    pub fn of(
        grid: &'a Grid,
        heights_m: &'a [f64],
        found: &Found,
        settings: &Settings,
    ) -> Result<Self> {
        found.require_fit(grid)?;
        let scene_of = |heights_m, found| Scene::new(grid, heights_m, found, settings.margin_m);
        if found.loose.is_empty() {
            let scene = scene_of(heights_m, found)?;
            return Ok(Self::Cells(Box::new(Cells { heights_m, scene })));
        }
        let things = Things::of(grid, heights_m, found, settings);
        let on_surface = || Ok(measured(&scene_of(heights_m, found)?, found, settings));
        let off_surface = || {
            let scene = scene_of(&things.with_things_m, &things.found)?;
            Ok(things.judged(measured(&scene, &things.found, settings), settings))
        };
        let (objects, others) = both(settings.threads, on_surface, off_surface);
        let mut objects = [objects?, others?].concat();
        occlusion_edge::mark(grid, heights_m, &things.with_things_m, &mut objects);
        Ok(Self::Measured(objects))
    }

    /// The objects on the surface, then the things. Of what was `found`, only labels and ground are
    /// needed.
    #[must_use]
    pub fn measured(self, found: &Found, settings: &Settings) -> Vec<Object> {
        match self {
            Self::Measured(objects) => objects,
            Self::Cells(cells) => {
                let Cells { heights_m, scene } = *cells;
                let mut objects = measured(&scene, found, settings);
                occlusion_edge::mark(scene.grid, heights_m, heights_m, &mut objects);
                objects
            }
        }
    }
}

fn measured(scene: &Scene<'_>, found: &Found, settings: &Settings) -> Vec<Object> {
    let grid = scene.grid;
    let noise_m = settings.ground.noise_m;
    let heights_m = &scene.heights_m;
    let open = found.open(grid, heights_m);
    let around = Around { grid, heights_m, open, ground: &found.ground, noise_m };
    let divided = Divided::of(scene, found);
    let whole = windows(scene, &divided.labels, &around, settings);
    // With no toe (the paper's method), an object is exactly the cells that were found.
    if settings.toe_cells == 0 {
        return whole.iter().map(|(n, window)| object_of(*n, window, window, settings)).collect();
    }
    let bases = bases_of(&whole, &planes_of(&whole, settings), settings);
    drop(whole);
    let labels = clear_of_ground(scene, &divided.labels, &bases, settings);
    let alone = |(n, found, whole): (i32, Window, Window)| -> Vec<Object> {
        let parts = alone::alone(found, whole, scene, settings);
        parts.iter().map(|(found, whole)| object_of(n, found, whole, settings)).collect()
    };
    let pairs = with_their_flanks(scene, &labels, &around, settings);
    let mut objects = map_each(pairs, thread_count(settings.threads), alone).concat();
    detection_limit::mark(&mut objects, settings);
    if settings.base.is_none() {
        let walled_in = objects.iter_mut().filter(|o| o.label >= divided.first_apart);
        walled_in.for_each(|object| object.reason = Some(Reason::CutOff));
    }
    objects
}

/// The objects, each as it was found and with its occluded flanks.
fn with_their_flanks(
    scene: &Scene<'_>,
    labels: &[i32],
    around: &Around<'_>,
    settings: &Settings,
) -> Vec<(i32, Window, Window)> {
    let found = windows(scene, labels, around, settings);
    let planes = planes_of(&found, settings);
    let flanked = with_flanks(scene, labels, &found, &planes, settings);
    if flanked == labels {
        let pair = |((n, found), plane): ((i32, Window), _)| {
            let whole = found.clone().with_plane(plane);
            (n, found, whole)
        };
        return found.into_iter().zip(planes).map(pair).collect();
    }
    let mut whole: BTreeMap<i32, Window> =
        windows(scene, &flanked, around, settings).into_iter().collect();
    found.into_iter().filter_map(|(n, found)| Some((n, found, whole.remove(&n)?))).collect()
}

/// Height of the base in every measured cell, in m; NaN elsewhere.
#[must_use]
pub fn base_map(grid: &Grid, objects: &[Object]) -> Vec<f64> {
    let mut map = vec![f64::NAN; grid.len()];
    objects.iter().flat_map(|o| &o.base_m).for_each(|p| map[grid.cell(p)] = p[2]);
    map
}

/// The labels of only those cells that are more than the margin above the ground around their
/// object.
fn clear_of_ground(
    scene: &Scene<'_>,
    labels: &[i32],
    bases: &BTreeMap<i32, Base>,
    settings: &Settings,
) -> Vec<i32> {
    let clear = |(cell, &label): (usize, &i32)| {
        let base = bases.get(&label)?;
        let above_m = scene.heights_m[cell] - base.at(scene.grid.center(cell));
        (above_m > settings.margin_m).then_some(label)
    };
    labels.iter().enumerate().polled().map(|cell| clear(cell).unwrap_or(UNLABELLED)).collect()
}

/// The plane of the ground around each object; `None` where the annulus has too few cells.
fn planes_of(windows: &[(i32, Window)], settings: &Settings) -> Vec<Option<Base>> {
    let plane = |(_, window): &(i32, Window)| annulus_plane(window).map(|(plane, _)| plane);
    map_each(windows, thread_count(settings.threads), plane)
}

fn bases_of(
    windows: &[(i32, Window)],
    planes: &[Option<Base>],
    settings: &Settings,
) -> BTreeMap<i32, Base> {
    let base = |plane: &Option<Base>| plane.clone().unwrap_or_else(|| settings.ground.clone());
    windows.iter().zip(planes).map(|((n, _), plane)| (*n, base(plane))).collect()
}

/// The labels, extended over the occluded cells that each pile's flank runs down over.
fn with_flanks(
    scene: &Scene<'_>,
    labels: &[i32],
    found: &[(i32, Window)],
    planes: &[Option<Base>],
    settings: &Settings,
) -> Vec<i32> {
    let mut bases = bases_of(found, planes, settings);
    // Only piles stand at an angle of repose.
    for (n, window) in found {
        if !shape(window, &bases[n], settings).could_be_poured() {
            bases.remove(n);
        }
    }
    occluded_flank::with_occluded_flanks(scene, labels, &bases)
}

fn windows(
    scene: &Scene<'_>,
    labels: &[i32],
    around: &Around<'_>,
    settings: &Settings,
) -> Vec<(i32, Window)> {
    let reach = Reach::each(labels, settings.toe_cells, settings.annulus_share);
    let farthest = reach.iter().map(|r| r.farthest()).max().unwrap_or(0);
    let nearest = around.nearest(labels, farthest);
    Window::all(scene, labels, &nearest, &reach)
}
