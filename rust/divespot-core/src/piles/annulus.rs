//! The annulus of ground around an object, and the base surface that is fitted to it.

use super::banks;
use super::base::Base;
use super::kriging::Footprint;
use super::window::{Window, Zone};
use crate::count::to_f64;

/// Most places of a footprint over which the base's mean is formed. Chosen: it bounds the time;
/// fewer sample the base more roughly.
const PLACES: usize = 300;

/// The middle of an object's core, and the seen cells of its annulus.
pub(crate) fn annulus(window: &Window) -> ([f64; 2], Vec<[f64; 3]>) {
    let core: Vec<[f64; 2]> = window.cells(Zone::Core).map(|c| window.grid.center(c)).collect();
    let mean = |k: usize| core.iter().map(|p| p[k]).sum::<f64>() / to_f64(core.len());
    ([mean(0), mean(1)], seen(window, Zone::Annulus).collect())
}

/// The plane through an object's annulus, and the cells of the annulus.
pub(crate) fn annulus_plane(window: &Window) -> Option<(Base, Vec<[f64; 3]>)> {
    let (center, annulus) = annulus(window);
    let known = window.plane.as_ref().filter(|plane| plane.center_m == center).cloned();
    let plane = known.or_else(|| Base::around(center, &annulus, window.grid.cell_m))?;
    Some((plane, annulus))
}

/// The base of an object: plane through the annulus, kriging with the ground beyond it, and banks.
pub(crate) fn annulus_base(window: &Window) -> Option<Base> {
    let (plane, mut ground) = annulus_plane(window)?;
    ground.reserve_exact(seen(window, Zone::Far).count());
    ground.extend(seen(window, Zone::Far));
    let footprint = footprint_of(window, plane.center_m);
    Some(banks::with_banks(plane.with_kriging(&ground, &footprint), window))
}

/// The seen cells of a zone.
fn seen(window: &Window, zone: Zone) -> impl Iterator<Item = [f64; 3]> + '_ {
    let seen = window.cells(zone).filter(|&cell| !window.heights_m[cell].is_nan());
    seen.map(|cell| {
        let [x, y] = window.grid.center(cell);
        [x, y, window.heights_m[cell]]
    })
}

/// The counted cells, relative to a centre.
fn footprint_of(window: &Window, center: [f64; 2]) -> Footprint {
    let held: Vec<usize> = window.held().collect();
    let every = held.len().div_ceil(PLACES).max(1);
    let place = |&cell: &usize| {
        let p = window.grid.center(cell);
        [0, 1].map(|k| p[k] - center[k])
    };
    Footprint {
        places: held.iter().step_by(every).map(place).collect(),
        size_m: window.grid.cell_m * to_f64(held.len()).sqrt(),
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::{exact, window_of};
    use super::*;

    #[test]
    fn about_three_hundred_cells_tell_where_an_object_lies() {
        let window =
            window_of(&exact(|_, _| 0.0), |x, y| (x - 4.0).abs().max((y - 3.0).abs()) < 1.0);
        let places = footprint_of(&window, [4.0, 3.0]).places.len();
        assert!((200..=300).contains(&places), "{places}");
    }
}
