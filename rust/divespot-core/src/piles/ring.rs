//! The annulus of ground around an object, and the base surface that is fitted to it.

use super::banks;
use super::base::Base;
use super::patch::{Patch, Zone};
use super::waves::Footprint;
use crate::count::to_f64;

/// Most places of a footprint over which the base's mean is formed. Chosen: it bounds the time.
const PLACES: usize = 300;

/// The middle of an object's core, and the seen cells of its annulus.
pub(crate) fn ring(patch: &Patch) -> ([f64; 2], Vec<[f64; 3]>) {
    let core: Vec<[f64; 2]> = patch.cells(Zone::Core).map(|c| patch.grid.center(c)).collect();
    let mean = |k: usize| core.iter().map(|p| p[k]).sum::<f64>() / to_f64(core.len());
    ([mean(0), mean(1)], seen(patch, Zone::Ring).collect())
}

/// The plane through an object's annulus, and the cells of the annulus.
pub(crate) fn ring_plane(patch: &Patch) -> Option<(Base, Vec<[f64; 3]>)> {
    let (center, ring) = ring(patch);
    let known = patch.plane.as_ref().filter(|plane| plane.center_m == center).cloned();
    let plane = known.or_else(|| Base::around(center, &ring, patch.grid.cell_m))?;
    Some((plane, ring))
}

/// The base of an object: plane through the annulus, kriging with the ground beyond it, and banks.
pub(crate) fn ring_base(patch: &Patch) -> Option<Base> {
    let (plane, mut ground) = ring_plane(patch)?;
    ground.extend(seen(patch, Zone::Beyond));
    let footprint = footprint(patch, plane.center_m);
    Some(banks::with_banks(plane.with_waves(&ground, &footprint), patch))
}

/// The seen cells of a zone.
fn seen(patch: &Patch, zone: Zone) -> impl Iterator<Item = [f64; 3]> + '_ {
    let seen = patch.cells(zone).filter(|&cell| !patch.heights_m[cell].is_nan());
    seen.map(|cell| {
        let [x, y] = patch.grid.center(cell);
        [x, y, patch.heights_m[cell]]
    })
}

/// The counted cells, relative to a centre.
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
