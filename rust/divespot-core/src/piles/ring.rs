//! The ring of ground around an object, and the base that it carries.

use super::banks;
use super::base::Base;
use super::patch::{Patch, Zone};
use super::waves::Footprint;
use crate::count::to_f64;

/// So many of an object's cells tell where it lies.
const PLACES: usize = 300;

/// The middle of an object's core, and the seen cells of the ring of ground around it.
pub(crate) fn ring(patch: &Patch) -> ([f64; 2], Vec<[f64; 3]>) {
    let core: Vec<[f64; 2]> = patch.cells(Zone::Core).map(|c| patch.grid.center(c)).collect();
    let mean = |k: usize| core.iter().map(|p| p[k]).sum::<f64>() / to_f64(core.len());
    ([mean(0), mean(1)], seen(patch, Zone::Ring).collect())
}

/// The plane through the ring of ground around an object, and the ring's cells.
pub(crate) fn ring_plane(patch: &Patch) -> Option<(Base, Vec<[f64; 3]>)> {
    let (center, ring) = ring(patch);
    let known = patch.plane.as_ref().filter(|plane| plane.center_m == center).cloned();
    let plane = known.or_else(|| Base::around(center, &ring, patch.grid.cell_m))?;
    Some((plane, ring))
}

/// The base of an object, as the ground around it, and what lies beyond its ring, lets expect.
pub(crate) fn ring_base(patch: &Patch) -> Option<Base> {
    let (plane, mut ground) = ring_plane(patch)?;
    ground.extend(seen(patch, Zone::Beyond));
    let footprint = footprint(patch, plane.center_m);
    Some(banks::with_banks(plane.with_waves(&ground, &footprint), patch))
}

/// The cells of a zone that were seen.
fn seen(patch: &Patch, zone: Zone) -> impl Iterator<Item = [f64; 3]> + '_ {
    let seen = patch.cells(zone).filter(|&cell| !patch.heights_m[cell].is_nan());
    seen.map(|cell| {
        let [x, y] = patch.grid.center(cell);
        [x, y, patch.heights_m[cell]]
    })
}

/// The cells that are held, about a centre.
fn footprint(patch: &Patch, center: [f64; 2]) -> Footprint {
    let held: Vec<usize> = patch.held().collect();
    let every = held.len().div_ceil(PLACES).max(1);
    let place = |&cell: &usize| {
        let p = patch.grid.center(cell);
        [0, 1].map(|k| p[k] - center[k])
    };
    Footprint {
        places: held.iter().step_by(every).map(place).collect(),
        size_m: patch.grid.cell_m * to_f64(held.len()).sqrt(),
    }
}
