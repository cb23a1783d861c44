//! The objects that stand on the ground: their footprint, base, volume and shape.
//!
//! Cutting above the ground and adding up the rest loses the toe (paper, "Voxel Meshing
//! Calculation"), which the paper repairs with an empirical factor. Here the cells of the toe are
//! kept, signed: outside the pile they average to nothing, so no factor is needed.

mod alone;
mod base;
mod budget;
mod clear;
mod crease;
mod face;
mod flat_top;
mod floating;
mod gaps;
mod hidden;
mod nodes;
mod object;
mod outline;
mod patch;
mod pieces;
mod region;
mod repose;
mod ring;
mod sectors;
mod shadow;
mod shape;
mod spike;
mod surface;
mod territory;
mod valley;
mod wall;
mod waves;

pub use base::{Base, Kind};
pub use budget::Budget;
pub use flat_top::trim_flat_tops;
pub use object::Object;
use pieces::flow_down;
pub use pieces::pieces;
pub use region::{Region, Ring, measure_inside};
pub use shape::Reason;
pub use surface::Surface;

use std::collections::BTreeMap;

use crate::Point;
use crate::error::{Error, Result};
use crate::heightmap::Grid;
use object::{object, why_no_pile};
pub(crate) use patch::flood;
use patch::{Patch, Reach, Scene};
use ring::ring_plane;
pub(crate) use territory::{FOUR, NOBODY, Territory};

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
    /// The base of every object; `None` for the one that the ground around each lets expect.
    pub base: Option<Base>,
    /// Further bases whose volumes are wanted for comparison.
    pub compared: Vec<Option<Base>>,
    /// The base where a ring says nothing.
    pub ground: Base,
}

/// Measures every object in a levelled height map of `points`.
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
    points: &[Point],
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
    let pairs = found.into_iter().zip(whole);
    let alone = pairs.flat_map(|((n, found), (_, whole))| {
        alone::alone(found, whole, points, settings).into_iter().map(move |pair| (n, pair))
    });
    let mut objects: Vec<Object> =
        alone.map(|(n, (found, whole))| object(n, &found, &whole, settings)).collect();
    clear::mark(&mut objects, settings);
    shadow::mark(&scene, &mut objects);
    floating::mark(grid, points, &mut objects, settings.margin_m);
    Ok(objects)
}

/// The base below every cell that was measured, NaN elsewhere.
#[must_use]
pub fn base_map(grid: &Grid, objects: &[Object]) -> Vec<f64> {
    let mut map = vec![f64::NAN; grid.len()];
    objects.iter().flat_map(|o| &o.base_m).for_each(|p| map[grid.cell(p)] = p[2]);
    map
}

/// The labels, and with them the cells that flow down from each object to the ground around it,
/// seen or hidden behind it. Walls that a pile hangs together with have no such flank.
fn with_flanks(
    scene: &Scene<'_>,
    labels: &[i32],
    found: &[(i32, Patch)],
    settings: &Settings,
) -> Vec<i32> {
    let ground = || settings.ground.clone();
    let local = |patch: &Patch| ring_plane(patch).map_or_else(ground, |(base, _)| base);
    let mut bases: BTreeMap<i32, Base> = found.iter().map(|(n, p)| (*n, local(p))).collect();
    let no_pile = |(n, patch): &&(i32, Patch)| why_no_pile(patch, &bases[n], settings).is_some();
    let (others, piles): (Vec<_>, Vec<_>) = found.iter().partition(no_pile);
    let mut labels = labels.to_vec();
    for cell in piles.iter().flat_map(|(_, p)| wall::found_walls(p, settings.margin_m)) {
        labels[scene.grid.cell(&cell)] = NOBODY;
    }
    let clear = |n: i32, cell: usize| {
        let base = bases.get(&n).unwrap_or(&settings.ground);
        scene.heights_m[cell] > base.at(scene.grid.center(cell)) + settings.margin_m
    };
    let labels = flow_down(scene.grid, &scene.heights_m, &labels, clear);
    // Only a pile stands at an angle of repose.
    others.iter().for_each(|(n, _)| drop(bases.remove(n)));
    hidden::with_hidden_flanks(scene, &labels, &bases)
}

fn patches(scene: &Scene<'_>, labels: &[i32], settings: &Settings) -> Vec<(i32, Patch)> {
    let reach = Reach::each(labels, settings.toe_cells, settings.ring_share);
    let farthest = reach.iter().map(|r| r.farthest()).max().unwrap_or(0);
    Patch::all(scene, labels, &Territory::grow(scene.grid, labels, farthest), &reach)
}

#[cfg(test)]
mod tests;
