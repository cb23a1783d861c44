//! Splits one object into its piles, without the walls they lean on.
//!
//! Touching piles are parted by a watershed (`watershed`), after the object has been clipped at walls
//! and continued to their faces (`wall`, `face`).

use super::annulus::annulus_plane;
use super::base::Base;
use super::object::{above_base, shape};
use super::scene::Scene;
use super::settings::Settings;
use super::window::Window;
use super::{banks, face, gaps, wall, watershed};

/// The piles of one object, each as `found` and as a `whole` with its occluded flanks. All of them
/// share the annulus of ground around the object.
pub(crate) fn alone(
    found: Window,
    mut whole: Window,
    scene: &Scene<'_>,
    settings: &Settings,
) -> Vec<(Window, Window)> {
    whole.plane = annulus_plane(&whole).map(|(plane, _)| plane);
    let base = whole.plane.clone().unwrap_or_else(|| settings.ground.clone());
    let (found, whole) = at_walls(found, whole, &base, scene, settings);
    let above = gaps::heights(&whole, &above_base(&whole, &base));
    let Some(parts) = watershed::parts(&whole, &above, settings.margin_m) else {
        return vec![(found, whole)];
    };
    let count = parts.iter().flatten().max().map_or(0, |most| most + 1);
    let part = |k: usize| {
        let kept = |p: [f64; 2]| parts[whole.grid.cell(&p)] == Some(k);
        (found.part(kept), whole.part(kept))
    };
    (0..count).map(part).collect()
}

/// Clips the object at the walls around it; a pile is continued to their faces.
fn at_walls(
    found: Window,
    whole: Window,
    base: &Base,
    scene: &Scene<'_>,
    settings: &Settings,
) -> (Window, Window) {
    let is_pile = shape(&found, base, settings).could_be_poured();
    let (found, whole) = (wall::up_to_walls(found, base), wall::up_to_walls(whole, base));
    if !is_pile {
        return (found, whole);
    }
    let whole = face::continued_to_faces(whole, scene, base, settings.margin_m);
    (found, banks::with_toe(whole))
}
