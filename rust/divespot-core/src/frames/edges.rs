//! Which pixels of a frame lie on a surface, and not between two.

use crate::parallel::fill_chunks;

use super::camera::Camera;
use super::noise::ByRange;
use super::noise::Noise;

/// Tangent of the steepest incidence at which a surface is taken for one: 80°. Beyond it, a pixel
/// covers more of the surface along the ray than six times its width.
const STEEPEST: f64 = 5.67;
/// A difference of two pixels within so many of its standard deviations may be noise.
const NOISE: f64 = 4.0;
/// Pixels that a thread takes at a time.
const CHUNK: usize = 1 << 13;

/// Whether each pixel lies on a surface, with both neighbours of its row and of its column.
///
/// A flying pixel mixes a near and a far surface: at least one neighbour is farther from it along
/// the ray than any surface that is seen at all could go within a pixel, its noise considered.
#[must_use]
pub fn usable(camera: &Camera, ranges_m: &[f64], noise: &Noise, threads: usize) -> Vec<bool> {
    let noise = ByRange::new(noise);
    let mut found = vec![false; ranges_m.len()];
    fill_chunks(&mut found, CHUNK, threads, |first, piece| {
        for (k, out) in piece.iter_mut().enumerate() {
            *out = is_on_surface(camera, ranges_m, &noise, first + k);
        }
    });
    found
}

fn is_on_surface(camera: &Camera, ranges_m: &[f64], noise: &ByRange, pixel: usize) -> bool {
    let range_m = ranges_m[pixel];
    if !range_m.is_finite() {
        return false;
    }
    let step = STEEPEST * camera.pitch[pixel];
    let most_m = range_m * step + NOISE * std::f64::consts::SQRT_2 * noise.sigma_m(range_m);
    neighbours(camera, pixel).all(|other| {
        let off = (ranges_m[other] - range_m).abs();
        off.is_nan() || off <= most_m
    })
}

/// The pixels left, right, above and below.
pub(crate) fn neighbours(camera: &Camera, pixel: usize) -> impl Iterator<Item = usize> {
    let (columns, count) = (camera.columns, camera.pixels());
    let column = pixel % columns;
    let left = (column > 0).then(|| pixel - 1);
    let right = (column + 1 < columns).then(|| pixel + 1);
    let above = pixel.checked_sub(columns);
    let below = (pixel + columns < count).then(|| pixel + columns);
    [left, right, above, below].into_iter().flatten()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frames::noise::tests::{camera, plane};

    #[test]
    fn a_pixel_between_two_surfaces_is_found_and_a_slope_is_not() {
        let camera = camera(40, 50);
        let mut ranges = plane(&camera, [0.6, 0.0, 1.0], 1.4);
        let noise = Noise::default();
        assert!(usable(&camera, &ranges, &noise, 2).iter().all(|&one| one));
        ranges[20 * 50 + 25] -= 0.5;
        let found = usable(&camera, &ranges, &noise, 2);
        assert!(!found[20 * 50 + 25] && found[18 * 50 + 25]);
        ranges[3] = f64::NAN;
        assert!(!usable(&camera, &ranges, &noise, 1)[3]);
    }
}
