//! Every pile by itself: without the walls it leans on, the rods in it, the piles that touch it.

use super::base::Base;
use super::object::{above_base, why_no_pile};
use super::patch::Patch;
use super::ring::ring_plane;
use super::{Settings, face, gaps, spike, valley, wall};
use crate::Point;

/// The piles of one object, each as `found` and as a `whole` with its flanks; their ground is the
/// ground around all of them.
pub(crate) fn alone(
    found: Patch,
    mut whole: Patch,
    points: &[Point],
    settings: &Settings,
) -> Vec<(Patch, Patch)> {
    whole.plane = ring_plane(&whole).map(|(plane, _)| plane);
    let base = whole.plane.clone().unwrap_or_else(|| settings.ground.clone());
    let (found, whole) = cleared(found, whole, &base, points, settings);
    let above = gaps::heights(&whole, &above_base(&whole, &base));
    let Some(parts) = valley::parts(&whole, &above, settings.margin_m) else {
        return vec![(found, whole)];
    };
    let count = parts.iter().flatten().max().map_or(0, |most| most + 1);
    let part = |k: usize| {
        let kept = |p: [f64; 2]| parts[whole.grid.cell(&p)] == Some(k);
        (found.part(kept), whole.part(kept))
    };
    (0..count).map(part).collect()
}

/// The object without walls; what stands steeply in it is taken out of a pile only, for of other
/// things it is a part.
fn cleared(
    found: Patch,
    whole: Patch,
    base: &Base,
    points: &[Point],
    settings: &Settings,
) -> (Patch, Patch) {
    let margin_m = settings.margin_m;
    let free = |patch| wall::without_walls(patch, base, margin_m);
    if why_no_pile(&found, base, settings).is_some() {
        return (free(found), free(whole));
    }
    let clean = |patch| free(wall::without_found_walls(patch, margin_m));
    let whole = face::continued_to_faces(clean(whole), points, margin_m);
    (clean(found), spike::without_spikes(whole, margin_m))
}
