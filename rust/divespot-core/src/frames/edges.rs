//! Removes flying pixels at depth edges: which pixels of a frame lie on one surface.

use crate::parallel::fill_chunks;

use super::camera::Camera;
use super::noise::NoiseTable;

/// Tangent of the steepest incidence of a surface: 80°. Beyond it, a pixel extends along the ray
/// more than six times its width. Chosen: lower loses far floors, higher keeps flying pixels.
const STEEPEST: f32 = 5.67;
/// Noise that the difference of two pixels may show, in standard deviations of one: four, times √2.
const NOISE: f32 = 4.0 * std::f32::consts::SQRT_2;
/// Rows of pixels for a thread at a time. Decides no answer.
const ROWS: usize = 32;

/// Whether each pixel lies on one surface with both neighbours of its row and of its column.
///
/// A flying pixel is a mix of a near and a far surface. Its distance from at least one neighbour
/// along the ray is more than a surface at the steepest incidence has within a pixel, plus noise.
#[must_use]
pub fn usable_pixels(
    camera: &Camera,
    ranges_m: &[f32],
    noise: &NoiseTable,
    threads: usize,
) -> Vec<bool> {
    let mut found = vec![false; ranges_m.len()];
    let columns = camera.columns;
    fill_chunks(&mut found, ROWS * columns, threads, |first, piece| {
        for (k, out) in piece.chunks_exact_mut(columns).enumerate() {
            row(camera, ranges_m, noise, first + k * columns, out);
        }
    });
    found
}

/// Decides for a row of pixels that starts at index `first`.
fn row(camera: &Camera, ranges_m: &[f32], noise: &NoiseTable, first: usize, found: &mut [bool]) {
    let columns = found.len();
    let range_at = |at: usize| ranges_m.get(at..at + columns);
    let own = &ranges_m[first..first + columns];
    let above = first.checked_sub(columns).and_then(range_at).unwrap_or(own);
    let below = range_at(first + columns).unwrap_or(own);
    let pitch = &camera.pitch[first..first + columns];
    for (x, out) in found.iter_mut().enumerate() {
        let range_m = own[x];
        let most_m = range_m * STEEPEST * pitch[x] + NOISE * noise.straight_m(range_m) as f32;
        if !most_m.is_finite() {
            continue;
        }
        // Comparisons with NaN are false, so unseen neighbours do not count.
        let is_off = |other: f32| (other - range_m).abs() > most_m;
        let left = own[x.saturating_sub(1)];
        let right = own[(x + 1).min(columns - 1)];
        *out = !(is_off(left) || is_off(right) || is_off(above[x]) || is_off(below[x]));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frames::noise::Noise;
    use crate::frames::noise::tests::{camera_of, plane};

    #[test]
    fn a_pixel_between_two_surfaces_is_found_and_a_slope_is_not() {
        let camera = camera_of(40, 50);
        let mut ranges = plane(&camera, [0.6, 0.0, 1.0], 1.4);
        let noise = NoiseTable::new(&Noise::default());
        assert!(usable_pixels(&camera, &ranges, &noise, 2).iter().all(|&one| one));
        ranges[20 * 50 + 25] -= 0.5;
        let found = usable_pixels(&camera, &ranges, &noise, 2);
        assert!(!found[20 * 50 + 25] && found[18 * 50 + 25]);
        ranges[3] = f32::NAN;
        assert!(!usable_pixels(&camera, &ranges, &noise, 1)[3]);
    }
}
