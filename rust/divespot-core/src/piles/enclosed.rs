//! Removes walls inside a given outline, and what they cover, from the volume.

use super::base::Base;
use super::face::continued_to_faces;
use super::part::Part;
use super::patch::{Patch, Zone};
use super::scene::Scene;
use super::wall;
use crate::connectivity::components;
use crate::connectivity::{EIGHT, FOUR};

/// The region, clipped at the faces of the walls in it.
///
/// Steep points are a wall if they split the region or run out of it; the cells that a wall covers
/// do not count. An object inside the region with surface all around it is a gap in the surface,
/// and so are other unseen cells. `covered` says whether points off the surface lie over the cell
/// at a place.
pub(crate) fn up_to_faces(
    mut patch: Patch,
    covered: impl Fn([f64; 2]) -> bool,
    scene: &Scene<'_>,
    base: &Base,
    margin_m: f64,
) -> Patch {
    let counted: Vec<Part> = (0..patch.zones.len()).map(|cell| patch.counted(cell)).collect();
    let walls = walls(&patch, covered);
    if walls.is_empty() {
        patch.walls.fill(false);
        return patch;
    }
    // Of a cell that the outline only touches, most may lie behind a wall.
    for (zone, part) in patch.zones.iter_mut().zip(&counted) {
        if *zone == Zone::Core && part.share < 0.5 {
            *zone = Zone::Toe;
        }
    }
    for &cell in &walls {
        patch.zones[cell] = if patch.walls[cell] { Zone::Toe } else { Zone::Outside };
    }
    let mut patch = continued_to_faces(wall::up_to_walls(patch, base), scene, base, margin_m);
    for (cell, outlined) in counted.into_iter().enumerate() {
        if matches!(patch.zones[cell], Zone::Core | Zone::Toe) {
            let part = patch.counted(cell);
            let smaller = if part.share < outlined.share { part } else { outlined };
            patch.count_part(cell, smaller);
            patch.zones[cell] = if smaller.share > 0.0 { Zone::Core } else { Zone::Outside };
        }
    }
    patch
}

/// The cells of a region that belong to walls.
fn walls(patch: &Patch, covered: impl Fn([f64; 2]) -> bool) -> Vec<usize> {
    let (grid, core) = (&patch.grid, |cell: usize| patch.zones[cell] == Zone::Core);
    let seen = |cell: usize| !patch.heights_m[cell].is_nan();
    let off = |cell: usize| !seen(cell) && (patch.walls[cell] || covered(grid.center(cell)));
    let cells = || 0..patch.zones.len();
    let mut side = vec![usize::MAX; patch.zones.len()];
    let sides = components(grid, cells().map(|c| core(c) && seen(c)).collect(), &FOUR);
    for (number, cells) in sides.iter().enumerate() {
        cells.iter().for_each(|&cell| side[cell] = number);
    }
    let is_wall = |covered: &Vec<usize>| {
        let around = || {
            covered
                .iter()
                .flat_map(|&cell| EIGHT.iter().map(move |&(dx, dy)| grid.neighbor(cell, dx, dy)))
        };
        let runs_out = around().any(|n| n.is_none_or(|n| !core(n)));
        let mut beside = around().flatten().map(|n| side[n]).filter(|&s| s != usize::MAX);
        let first = beside.next();
        let parts = first.is_some_and(|first| beside.any(|other| other != first));
        covered.iter().any(|&cell| patch.walls[cell]) && (runs_out || parts)
    };
    let covered = components(grid, cells().map(|c| core(c) && off(c)).collect(), &EIGHT);
    covered.into_iter().filter(is_wall).flatten().collect()
}
