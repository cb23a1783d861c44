//! The objects that stand on the ground: their footprint, base, volume and shape.
//!
//! Cutting above the ground and adding up the rest loses the toe (paper, "Voxel Meshing
//! Calculation"), which the paper repairs with an empirical factor. Here the cells of the toe are
//! kept, signed: outside the pile they average to nothing, so no factor is needed.

mod base;
mod budget;
mod film;
mod gaps;
mod outline;
mod patch;
mod pieces;
mod repose;
mod hidden;
mod shape;
mod territory;

pub use base::{Base, Kind};
pub use budget::Budget;
use pieces::flow_down;
pub use pieces::pieces;
pub use shape::Reason;

use std::collections::BTreeMap;

use crate::error::{Error, Result};
use crate::heightmap::{Grid, Volume, integrate};
use patch::{Patch, Reach, Scene, Zone};
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
    /// Share of the footprint's cells that were seen.
    pub seen_fraction: f64,
    /// Whether the object runs out of what was seen.
    pub touches_edge: bool,
    /// Why it is no pile; `None` for a pile.
    pub reason: Option<Reason>,
}

/// A toe with this share of its cells beyond what was seen is cut off.
const CUT_OFF: f64 = 0.1;

/// With less of its footprint seen than this, a pile's volume is no measurement any more: its crest
/// and more than half of its surface would be assumed.
const LEAST_SEEN: f64 = 0.4;

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
    if labels.len() != grid.len() || heights_m.len() != grid.len() {
        return Err(Error::Degenerate("one height and one label for each cell are needed"));
    }
    let heights_m = &hidden::without_lone(grid, heights_m);
    let beyond = hidden::beyond(grid, heights_m);
    let scene = Scene { grid, heights_m, beyond: &beyond };
    let found = patches(&scene, labels, settings);
    if settings.base.is_some() {
        return Ok(found.iter().map(|(n, patch)| object(*n, patch, patch, settings)).collect());
    }
    let whole = patches(&scene, &with_flanks(&scene, labels, &found, settings), settings);
    let pairs = found.iter().zip(&whole);
    Ok(pairs.map(|((n, found), (_, whole))| object(*n, found, whole, settings)).collect())
}

/// The labels, and with them the cells that flow down from each object to the ground around it,
/// seen or hidden behind it.
fn with_flanks(
    scene: &Scene<'_>,
    labels: &[i32],
    found: &[(i32, Patch)],
    settings: &Settings,
) -> Vec<i32> {
    let ground = || settings.ground.clone();
    let local = |patch: &Patch| ring_plane(patch).map_or_else(ground, |(base, _)| base);
    let mut bases: BTreeMap<i32, Base> = found.iter().map(|(n, p)| (*n, local(p))).collect();
    let clear = |n: i32, cell: usize| {
        let base = bases.get(&n).unwrap_or(&settings.ground);
        scene.heights_m[cell] > base.at(scene.grid.center(cell)) + settings.margin_m
    };
    let labels = flow_down(scene.grid, scene.heights_m, labels, clear);
    // Only a pile stands at an angle of repose.
    let shape =
        |base: &Base, p: &Patch| shape::why_no_pile(p, &above_base(p, base), settings.margin_m);
    let others = found.iter().filter(|(n, p)| bases.get(n).and_then(|b| shape(b, p)).is_some());
    let others: Vec<i32> = others.map(|(n, _)| *n).collect();
    bases.retain(|n, _| !others.contains(n));
    hidden::with_hidden_flanks(scene, &labels, &bases)
}

fn patches(scene: &Scene<'_>, labels: &[i32], settings: &Settings) -> Vec<(i32, Patch)> {
    let reach = Reach::each(labels, settings.toe_cells, settings.ring_share);
    let farthest = reach.iter().map(|r| r.toe + r.ring).max().unwrap_or(0);
    Patch::all(scene, labels, &Territory::grow(scene.grid, labels, farthest), &reach)
}

/// Measures `patch`, the object with its flanks; `found`, without them, tells whether it is a pile.
fn object(label: i32, found: &Patch, patch: &Patch, settings: &Settings) -> Object {
    let local = || ring_base(patch).unwrap_or_else(|| settings.ground.clone());
    let base = settings.base.clone().unwrap_or_else(local);
    let above = above_base(patch, &base);
    let gaps = gaps::fill(patch, &above);
    let filled = &gaps.above_m;
    let held = |cell: usize| matches!(patch.zones[cell], Zone::Core | Zone::Toe);
    let heights = (0..filled.len()).filter(|&cell| held(cell)).map(|cell| filled[cell]);
    let footprint = footprint(patch, filled, settings.margin_m);
    let covered: Vec<usize> = (0..footprint.len()).filter(|&cell| footprint[cell]).collect();
    let seen = covered.iter().filter(|&&cell| !above[cell].is_nan()).count();
    let seen_fraction = to_f64(seen) / to_f64(covered.len().max(1));
    let too_little = (seen_fraction < LEAST_SEEN).then_some(Reason::TooLittleSeen);
    Object {
        label,
        volume: integrate(heights, patch.grid.cell_m),
        budget: Budget::of(patch, &base, &gaps, settings.toe_cells),
        footprint_m2: to_f64(covered.len()) * patch.grid.cell_m * patch.grid.cell_m,
        max_height_m: covered.iter().map(|&cell| filled[cell]).fold(0.0, f64::max),
        centroid_m: centroid(patch, &base, &covered, filled),
        outline_m: on_base(&base, outline::outline(&patch.grid, &footprint)),
        seen_fraction,
        touches_edge: touches_edge(patch),
        reason: shape::why_no_pile(found, &above_base(found, &base), settings.margin_m)
            .or(too_little),
        base,
    }
}

fn above_base(patch: &Patch, base: &Base) -> Vec<f64> {
    let heights = patch.heights_m.iter().enumerate();
    heights.map(|(cell, h)| h - base.at(patch.grid.center(cell))).collect()
}

/// The plane through the ring of ground around an object, and the ring's cells.
fn ring_plane(patch: &Patch) -> Option<(Base, Vec<[f64; 3]>)> {
    let core: Vec<[f64; 2]> = patch.cells(Zone::Core).map(|c| patch.grid.center(c)).collect();
    let mean = |k: usize| core.iter().map(|p| p[k]).sum::<f64>() / to_f64(core.len());
    let seen = patch.cells(Zone::Ring).filter(|&cell| !patch.heights_m[cell].is_nan());
    let place = |cell: usize| {
        let [x, y] = patch.grid.center(cell);
        [x, y, patch.heights_m[cell]]
    };
    let ring: Vec<[f64; 3]> = seen.map(place).collect();
    Some((Base::around([mean(0), mean(1)], &ring)?, ring))
}

fn ring_base(patch: &Patch) -> Option<Base> {
    let (plane, ring) = ring_plane(patch)?;
    Some(plane.with_film(&patch.grid, &ring))
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
        Zone::Core => true,
        Zone::Toe => !patch.heights_m[cell].is_nan() && clear(cell),
        Zone::Outside | Zone::Ring => false,
    };
    (0..patch.zones.len()).map(covers).collect()
}

fn centroid(patch: &Patch, base: &Base, covered: &[usize], filled: &[f64]) -> [f64; 3] {
    let (mut weight, mut sum) = (0.0, [0.0; 3]);
    for &cell in covered {
        let height = filled[cell].max(0.0);
        let [x, y] = patch.grid.center(cell);
        let middle = [x, y, base.at([x, y]) + height / 2.0];
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
