//! The face of a bank that goes on below a pile which leans on it.
//!
//! A heap poured against a bench lies on its face. Where the bank rises from the edge of the heap, it
//! goes on under it as it came, until it meets the ground.

use std::sync::Arc;

use super::base::{Base, Kind, value, weighted_plane};
use super::patch::{Patch, Zone};
use super::territory::FOUR;
use crate::heightmap::Grid;
use crate::material::GENTLE;

/// A bank goes on as it is in its cells so many columns and rows around the nearest.
const SUPPORT: usize = 4;
/// Steeper than this, as rise over run, nothing to speak of lies on a face: 74°.
const STEEPEST: f64 = 3.5;
/// With fewer cells its slope is not known.
const FEWEST: usize = 6;

/// Heights of banks below an object; NaN where there is none.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Bank {
    grid: Grid,
    heights_m: Vec<f64>,
}

impl Bank {
    pub(crate) fn at(&self, p: [f64; 2]) -> f64 {
        if self.grid.holds(&[p[0], p[1], 0.0]) {
            self.heights_m[self.grid.cell(&p)]
        } else {
            f64::NAN
        }
    }

    /// The banks that go on under an object above its base; `None` where none do.
    pub(crate) fn under(patch: &Patch, base: &Base) -> Option<Arc<Self>> {
        let mut heights_m = vec![f64::NAN; patch.zones.len()];
        let beside = |&cell: &usize| patch.banks[cell] && four(patch, cell).any(|n| held(patch, n));
        let mut front: Vec<(usize, usize)> =
            (0..heights_m.len()).filter(beside).map(|bank| (bank, bank)).collect();
        while let Some((bank, cell)) = front.pop() {
            for n in four(patch, cell).filter(|&n| held(patch, n)) {
                let Some(height_m) = go_on(patch, bank, n) else { continue };
                let p = patch.grid.center(n);
                let lower = height_m < patch.heights_m[n] && height_m > base.at(p);
                if lower && (heights_m[n].is_nan() || heights_m[n] < height_m) {
                    heights_m[n] = height_m;
                    front.push((bank, n));
                }
            }
        }
        let any = heights_m.iter().any(|h| !h.is_nan());
        any.then(|| Arc::new(Self { grid: patch.grid, heights_m }))
    }
}

fn held(patch: &Patch, cell: usize) -> bool {
    matches!(patch.zones[cell], Zone::Core | Zone::Toe)
}

fn four(patch: &Patch, cell: usize) -> impl Iterator<Item = usize> + '_ {
    FOUR.iter().filter_map(move |&(dx, dy)| patch.grid.neighbor(cell, dx, dy))
}

/// The height at a cell of the plane through the bank's cells around one of them, where it goes down
/// there and material could lie on it. Cells beside the object hold some of it, too.
fn go_on(patch: &Patch, bank: usize, cell: usize) -> Option<f64> {
    let center = patch.grid.center(cell);
    let local: Vec<[f64; 3]> = patch
        .around(bank, SUPPORT)
        .filter(|&n| patch.banks[n] && !four(patch, n).any(|n| held(patch, n)))
        .map(|n| {
            let [x, y] = patch.grid.center(n);
            [x - center[0], y - center[1], patch.heights_m[n]]
        })
        .collect();
    if local.len() < FEWEST {
        return None;
    }
    let plane = weighted_plane(&local, std::iter::repeat(1.0), Kind::Ring)?;
    let height_m = value(&plane, &[0.0; 3]);
    let lies = (GENTLE..STEEPEST).contains(&plane[1].hypot(plane[2]));
    (lies && height_m < patch.heights_m[bank]).then_some(height_m)
}
