//! The ring of ground around an object, and the base that it carries.

use super::base::Base;
use super::patch::{Patch, Zone};
use super::to_f64;

/// The middle of an object's core, and the seen cells of the ring of ground around it.
pub(crate) fn ring(patch: &Patch) -> ([f64; 2], Vec<[f64; 3]>) {
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
pub(crate) fn ring_plane(patch: &Patch) -> Option<(Base, Vec<[f64; 3]>)> {
    let (center, ring) = ring(patch);
    let known = patch.plane.as_ref().filter(|plane| plane.center_m == center).cloned();
    let plane = known.or_else(|| Base::around(center, &ring, patch.grid.cell_m))?;
    Some((plane, ring))
}

pub(crate) fn ring_base(patch: &Patch) -> Option<Base> {
    let (plane, ring) = ring_plane(patch)?;
    Some(plane.with_film(&patch.grid, &ring))
}
