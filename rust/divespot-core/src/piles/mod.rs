//! The objects that stand on the ground: their footprint, base, volume and shape.
//!
//! Cutting above the ground and adding up the rest loses the toe (paper, "Voxel Meshing
//! Calculation"), which the paper repairs with an empirical factor. Here the cells of the toe are
//! kept, signed: outside the pile they average to nothing, so no factor is needed.

mod base;
mod budget;
mod film;
mod outline;
mod patch;
mod pieces;
mod region;
mod shape;
mod statistics;
mod surface;
mod territory;

pub use base::{Base, Kind};
pub use budget::Budget;
use pieces::flow_down;
pub use pieces::pieces;
pub use region::{Region, Ring, measure_inside};
pub use shape::Reason;
pub use surface::Surface;

use crate::error::{Error, Result};
use crate::heightmap::{Grid, Volume, integrate};
use patch::{Patch, Reach, Scene, Zone};
use region::part_height;
use territory::Territory;

/// How objects are measured.
#[derive(Debug, Clone, PartialEq)]
pub struct Settings {
    /// Steps of one cell around the labelled cells that may hold the toe.
    pub toe_cells: u32,
    /// Width of the ring of ground beyond the toe, as a share of the edge of a square as large as
    /// the object.
    pub ring_share: f64,
    /// Cells this high above their base are the object's beyond doubt.
    pub margin_m: f64,
    /// The base of every object; `None` for a smooth surface through the ring around each.
    pub base: Option<Base>,
    /// Further bases whose volumes are wanted for comparison.
    pub compared: Vec<Option<Base>>,
    /// The base where a ring says nothing.
    pub ground: Base,
}

/// Something that stands on the ground.
#[derive(Debug, Clone, PartialEq)]
pub struct Object {
    /// The label of its cells.
    pub label: i32,
    /// Volume above and below the base.
    pub volume: Volume,
    /// Volumes above the bases that are compared.
    pub compared_m3: Vec<f64>,
    /// Its uncertainty.
    pub budget: Budget,
    /// The base.
    pub base: Base,
    /// Area of the cells that the object covers.
    pub footprint_m2: f64,
    /// Height of the highest cell above the base.
    pub max_height_m: f64,
    /// Centre of the volume.
    pub centroid_m: [f64; 3],
    /// The footprint's outline at the base, counter-clockwise.
    pub outline_m: Vec<[f64; 3]>,
    /// The base in the middle of every cell that was measured.
    pub base_m: Vec<[f64; 3]>,
    /// Share of the footprint's cells that were seen.
    pub seen_fraction: f64,
    /// Whether the object runs out of what was seen.
    pub touches_edge: bool,
    /// Why it is no pile; `None` for a pile.
    pub reason: Option<Reason>,
}

/// A toe with this share of its cells beyond what was seen is cut off.
const CUT_OFF: f64 = 0.1;

/// Measures every object in a levelled height map.
///
/// `heights_m` and `labels` hold one value a cell: the height, NaN where nothing was seen; the
/// object's number, or -1. Objects come by number.
///
/// # Errors
///
/// A number of heights or labels that is not the number of cells.
pub fn measure(
    grid: &Grid,
    heights_m: &[f64],
    labels: &[i32],
    settings: &Settings,
) -> Result<Vec<Object>> {
    let scene = Scene::new(grid, heights_m)?;
    if labels.len() != grid.len() {
        return Err(Error::Degenerate("one label for each cell is needed"));
    }
    let found = patches(&scene, labels, settings);
    // Where no toe is wanted, an object is what was found (paper).
    if settings.toe_cells == 0 {
        return Ok(found.iter().map(|(n, patch)| object(*n, patch, patch, settings)).collect());
    }
    let whole = patches(&scene, &with_flanks(&scene, labels, &found, settings), settings);
    let pairs = found.iter().zip(&whole);
    Ok(pairs.map(|((n, found), (_, whole))| object(*n, found, whole, settings)).collect())
}

/// The base below every cell that was measured, NaN elsewhere.
#[must_use]
pub fn base_map(grid: &Grid, objects: &[Object]) -> Vec<f64> {
    let mut map = vec![f64::NAN; grid.len()];
    objects.iter().flat_map(|o| &o.base_m).for_each(|p| map[grid.cell(p)] = p[2]);
    map
}

/// The labels, and with them the cells that flow down from each object to the ground around it.
fn with_flanks(
    scene: &Scene<'_>,
    labels: &[i32],
    found: &[(i32, Patch)],
    settings: &Settings,
) -> Vec<i32> {
    let local = |(n, patch): &(i32, Patch)| Some((*n, ring_plane(patch)?.0));
    let bases: std::collections::BTreeMap<i32, Base> = found.iter().filter_map(local).collect();
    let clear = |n: i32, cell: usize| {
        let base = bases.get(&n).unwrap_or(&settings.ground);
        scene.heights_m[cell] > base.at(scene.grid.center(cell)) + settings.margin_m
    };
    flow_down(scene.grid, scene.heights_m, labels, clear)
}

fn patches(scene: &Scene<'_>, labels: &[i32], settings: &Settings) -> Vec<(i32, Patch)> {
    let reach = Reach::each(labels, settings.toe_cells, settings.ring_share);
    let farthest = reach.iter().map(|r| r.toe + r.ring).max().unwrap_or(0);
    Patch::all(scene, labels, &Territory::grow(scene.grid, labels, farthest), &reach)
}

/// Measures `patch`, the object with its flanks; `found`, without them, tells whether it is a pile.
fn object(label: i32, found: &Patch, patch: &Patch, settings: &Settings) -> Object {
    let base = base_of(patch, settings.base.as_ref(), settings);
    let above = above_base(patch, &base);
    let filled = fill_gaps(patch, &above);
    let footprint = footprint(patch, &filled, settings.margin_m);
    let covered: Vec<usize> = (0..footprint.len()).filter(|&cell| footprint[cell]).collect();
    let share = |cells: &mut dyn Iterator<Item = &usize>| -> f64 {
        cells.map(|&cell| patch.part(cell).share).sum()
    };
    let seen = share(&mut covered.iter().filter(|&&cell| !above[cell].is_nan()));
    let whole = share(&mut covered.iter());
    let compared = settings.compared.iter();
    Object {
        label,
        volume: volume(patch, &filled),
        compared_m3: compared.map(|base| compared_m3(patch, base.as_ref(), settings)).collect(),
        budget: Budget::of(patch, &base, &above, &filled, settings.toe_cells),
        footprint_m2: whole * patch.grid.cell_m * patch.grid.cell_m,
        max_height_m: covered.iter().map(|&cell| filled[cell]).fold(0.0, f64::max),
        centroid_m: centroid(patch, &base, &covered, &filled),
        outline_m: on_base(&base, outline::outline(&patch.grid, &footprint)),
        base_m: on_base(&base, patch.held().map(|cell| patch.grid.center(cell)).collect()),
        seen_fraction: seen / whole.max(f64::MIN_POSITIVE),
        touches_edge: touches_edge(patch),
        reason: reason(found, &base, settings),
        base,
    }
}

/// Why it is no pile, by its height above the ground around it, whatever base was asked for.
fn reason(found: &Patch, local: &Base, settings: &Settings) -> Option<Reason> {
    let around = || ring_plane(found).map_or_else(|| settings.ground.clone(), |(plane, _)| plane);
    let ground = if settings.base.is_none() { local.clone() } else { around() };
    shape::why_no_pile(found, &above_base(found, &ground), settings.margin_m)
}

/// The base that was asked for, as it is below this object.
fn base_of(patch: &Patch, wanted: Option<&Base>, settings: &Settings) -> Base {
    let Some(base) = wanted else {
        return ring_base(patch).unwrap_or_else(|| settings.ground.clone());
    };
    let (center, ring) = ring(patch);
    base.clone().held_against(center, &ring)
}

/// The volume of the cells that are held, above and below nought.
fn volume(patch: &Patch, filled: &[f64]) -> Volume {
    let part = |cell: usize| patch.part(cell).share * part_height(patch, filled, cell);
    integrate(patch.held().map(part), patch.grid.cell_m)
}

fn compared_m3(patch: &Patch, wanted: Option<&Base>, settings: &Settings) -> f64 {
    let above = above_base(patch, &base_of(patch, wanted, settings));
    volume(patch, &fill_gaps(patch, &above)).net_m3()
}

fn above_base(patch: &Patch, base: &Base) -> Vec<f64> {
    let heights = patch.heights_m.iter().enumerate();
    heights.map(|(cell, h)| h - base.at(patch.grid.center(cell))).collect()
}

/// The middle of an object's core, and the seen cells of the ring of ground around it.
fn ring(patch: &Patch) -> ([f64; 2], Vec<[f64; 3]>) {
    let core: Vec<[f64; 2]> = patch.cells(Zone::Core).map(|c| patch.grid.center(c)).collect();
    let mean = |k: usize| core.iter().map(|p| p[k]).sum::<f64>() / to_f64(core.len());
    let seen = patch.cells(Zone::Ring).filter(|&cell| !patch.heights_m[cell].is_nan());
    let place = |cell: usize| {
        let [x, y] = patch.grid.center(cell);
        [x, y, patch.heights_m[cell]]
    };
    ([mean(0), mean(1)], seen.map(place).collect())
}

/// The plane through the ring of ground around an object, and the ring's cells.
fn ring_plane(patch: &Patch) -> Option<(Base, Vec<[f64; 3]>)> {
    let (center, ring) = ring(patch);
    Some((Base::around(center, &ring)?, ring))
}

fn ring_base(patch: &Patch) -> Option<Base> {
    let (plane, ring) = ring_plane(patch)?;
    Some(plane.with_film(&patch.grid, &ring))
}

/// Heights with the unseen cells closed: in the core, layer by layer, with the mean of the cells
/// around; at the toe with the base.
fn fill_gaps(patch: &Patch, above: &[f64]) -> Vec<f64> {
    let mut filled = above.to_vec();
    patch.cells(Zone::Toe).filter(|&c| above[c].is_nan()).for_each(|c| filled[c] = 0.0);
    let mut gaps: Vec<usize> = patch.cells(Zone::Core).filter(|&c| above[c].is_nan()).collect();
    while !gaps.is_empty() {
        let layer: Vec<(usize, f64)> = gaps
            .iter()
            .filter_map(|&cell| Some((cell, mean_around(patch, &filled, cell, |_| true)?)))
            .collect();
        if layer.is_empty() {
            break;
        }
        layer.into_iter().for_each(|(cell, height)| filled[cell] = height);
        gaps.retain(|&cell| filled[cell].is_nan());
    }
    filled
}

/// The mean of the known heights in and around a cell, among the cells that count.
fn mean_around(
    patch: &Patch,
    heights: &[f64],
    cell: usize,
    counts: impl Fn(usize) -> bool,
) -> Option<f64> {
    let near = patch.around(cell, 1).filter(|&n| counts(n));
    let known = near.map(|n| heights[n]).filter(|h| !h.is_nan());
    let (sum, count) = known.fold((0.0, 0.0), |(sum, count), h| (sum + h, count + 1.0));
    (count > 0.0).then(|| sum / count)
}

/// The cells that the object covers: its core, and the toe where it stands clear of the base.
///
/// Clear is a third of the margin, for the mean of the toe's cells around: of nine, it has a third
/// of their noise.
fn footprint(patch: &Patch, filled: &[f64], margin_m: f64) -> Vec<bool> {
    let toe = |cell: usize| patch.zones[cell] == Zone::Toe;
    let clear =
        |cell: usize| mean_around(patch, filled, cell, toe).is_some_and(|h| h > margin_m / 3.0);
    let covers = |cell: usize| match patch.zones[cell] {
        Zone::Core => patch.part(cell).share > 0.0,
        Zone::Toe => !patch.heights_m[cell].is_nan() && clear(cell),
        Zone::Outside | Zone::Ring => false,
    };
    (0..patch.zones.len()).map(covers).collect()
}

fn centroid(patch: &Patch, base: &Base, covered: &[usize], filled: &[f64]) -> [f64; 3] {
    let (mut weight, mut sum) = (0.0, [0.0; 3]);
    for &cell in covered {
        let height = patch.part(cell).share * filled[cell].max(0.0);
        let [x, y] = patch.grid.center(cell);
        let middle = [x, y, base.at([x, y]) + filled[cell].max(0.0) / 2.0];
        weight += height;
        (0..3).for_each(|k| sum[k] += height * middle[k]);
    }
    sum.map(|s| if weight > 0.0 { s / weight } else { f64::NAN })
}

fn on_base(base: &Base, line: Vec<[f64; 2]>) -> Vec<[f64; 3]> {
    line.into_iter().map(|[x, y]| [x, y, base.at([x, y])]).collect()
}

/// Whether much of the toe lies where nothing was seen out to the scan's edge.
fn touches_edge(patch: &Patch) -> bool {
    let toe: Vec<usize> = patch.cells(Zone::Toe).collect();
    let beyond = toe.iter().filter(|&&cell| patch.beyond[cell]).count() + patch.cut;
    to_f64(beyond) > CUT_OFF * to_f64(toe.len() + patch.cut)
}

#[allow(clippy::cast_precision_loss)] // counts of cells
fn to_f64(n: usize) -> f64 {
    n as f64
}

#[cfg(test)]
mod tests;
