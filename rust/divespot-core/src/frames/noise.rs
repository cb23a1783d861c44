//! The noise of a depth camera as a function of range and incidence, estimated from its own frames;
//! in m.

use crate::robust::scale;

use super::camera::Camera;
use super::patches::Patch;

/// Standard deviation of a range in m: `at_metre_m · range^power / cos(incidence)^incidence`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Noise {
    /// At a range of 1 m and normal incidence, in m.
    pub at_metre_m: f64,
    /// Exponent of the range.
    pub power: f64,
    /// Exponent of the inverse cosine of the incidence.
    pub incidence: f64,
}

impl Default for Noise {
    /// The default before any frame was seen: 3 mm at 1 m.
    fn default() -> Self {
        Self { at_metre_m: 0.003, power: 2.0, incidence: 0.0 }
    }
}

/// Smallest and largest exponent of the range; a frame may show only one range. Chosen around 2,
/// that of stereo (closed form): narrower refuses cameras, wider lets chance decide far ranges.
const POWERS: (f64, f64) = (0.0, 3.0);
/// Smallest noise, in m: a tenth of the step of depths in mm.
const LEAST_M: f64 = 1e-4;
/// Fewest samples of a class. Chosen: their standard deviation, from the median absolute value, is
/// then known to a sixth (closed form: 1 / √(2 · 0.37 · 50)).
const FEWEST: usize = 50;
/// Classes of range within the frame's span. Chosen: two exponents need a few; more hold too few
/// samples each.
const CLASSES: usize = 8;
/// Variance of a second difference of three values, in variances of one: 1 + 4 + 1.
const SECOND: f64 = 6.0;

impl Noise {
    /// Standard deviation of a range at this cosine of the incidence, in m.
    #[must_use]
    pub fn sigma_m(&self, range_m: f64, cosine: f64) -> f64 {
        let grown = libm::pow(range_m, self.power);
        let tilted = if self.incidence == 0.0 { 1.0 } else { libm::pow(cosine, -self.incidence) };
        (self.at_metre_m * grown * tilted).max(LEAST_M)
    }

    /// The noise of the frame that the patches were fitted to.
    ///
    /// A surface is straight over three pixels, so second differences along rows and columns are
    /// noise. Their robust spread is taken in classes of range and incidence, and a power law is
    /// fitted to it.
    #[must_use]
    pub fn of(camera: &Camera, ranges_m: &[f32], patches: &[Patch]) -> Self {
        let samples = sampled(camera, ranges_m, patches);
        let classes = classed(&samples);
        match classes.len() {
            0 => Self::default(),
            _ => fitted(&classes),
        }
    }
}

/// The noise, tabulated by range and incidence, because a power for each pixel would dominate the
/// run time.
#[derive(Debug, Clone)]
pub struct NoiseTable {
    noise: Noise,
    straight_m: Vec<f64>,
    tilted: Vec<f64>,
}

/// Step of range in m, number of steps, and number of steps of the cosine from 0 to 1. Chosen: from
/// 0.5 m on, the table is off by at most 1 % (closed form: half a step, squared law), up to 10 m.
const STEP_M: f64 = 0.005;
const STEPS: usize = 2048;
const COSINES: usize = 128;

impl NoiseTable {
    /// Tabulates a camera's noise.
    #[must_use]
    pub fn new(noise: &Noise) -> Self {
        let straight_m = |i: usize| noise.sigma_m((i as f64 + 0.5) * STEP_M, 1.0);
        let tilted = |i: usize| libm::pow((i as f64 + 0.5) / COSINES as f64, -noise.incidence);
        Self {
            noise: *noise,
            straight_m: (0..STEPS).map(straight_m).collect(),
            tilted: (0..COSINES).map(tilted).collect(),
        }
    }

    /// Standard deviation of a range at normal incidence, in m.
    #[inline]
    pub(crate) fn straight_m(&self, range_m: f32) -> f64 {
        let range_m = f64::from(range_m);
        match self.straight_m.get((range_m / STEP_M) as usize) {
            Some(&sigma_m) => sigma_m,
            None => self.noise.sigma_m(range_m, 1.0),
        }
    }

    /// Standard deviation of a range at this cosine of the incidence, in m.
    pub(crate) fn sigma_m(&self, range_m: f32, cosine: f64) -> f64 {
        let step = ((cosine * COSINES as f64) as usize).min(COSINES - 1);
        self.straight_m(range_m) * self.tilted[step]
    }
}

/// Range, cosine of the incidence, and a difference with the noise's standard deviation.
type Sample = (f64, f64, f64);

fn sampled(camera: &Camera, ranges_m: &[f32], patches: &[Patch]) -> Vec<Sample> {
    let mut found = Vec::new();
    for patch in patches {
        let (pixel, columns) = (patch.pixel, camera.columns);
        if pixel % columns == 0 || (pixel + 1) % columns == 0 {
            continue;
        }
        if pixel < columns || pixel + columns >= ranges_m.len() {
            continue;
        }
        for beside in [1, columns] {
            let range = |i: usize| f64::from(ranges_m[i]);
            let middle = range(pixel);
            let second = range(pixel - beside) + range(pixel + beside) - 2.0 * middle;
            if second.is_finite() {
                found.push((middle, patch.cosine(), second / SECOND.sqrt()));
            }
        }
    }
    found
}

/// Logarithms of range, inverse cosine and noise, for each class with enough samples.
fn classed(samples: &[Sample]) -> Vec<[f64; 3]> {
    let low = samples.iter().fold(f64::INFINITY, |low, s| low.min(s.0));
    let high = samples.iter().fold(0.0_f64, |high, s| high.max(s.0));
    let width = ((high - low) / CLASSES as f64).max(1e-9);
    let mut found = Vec::new();
    for by_range in 0..CLASSES {
        for (least, most) in [(0.0, 0.7), (0.7, 0.9), (0.9, 1.1)] {
            let within = |s: &&Sample| {
                let class = (((s.0 - low) / width) as usize).min(CLASSES - 1);
                class == by_range && s.1 >= least && s.1 < most
            };
            let own: Vec<Sample> = samples.iter().filter(within).copied().collect();
            if own.len() < FEWEST {
                continue;
            }
            let mean =
                |part: fn(&Sample) -> f64| own.iter().map(part).sum::<f64>() / own.len() as f64;
            let sigma = scale(own.iter().map(|s| s.2)).max(LEAST_M);
            found.push([libm::log(mean(|s| s.0)), -libm::log(mean(|s| s.1)), libm::log(sigma)]);
        }
    }
    found
}

/// The power law fitted to the classes; exponents that they do not determine are the default's.
fn fitted(classes: &[[f64; 3]]) -> Noise {
    let usual = Noise::default();
    // A weak prior on the default exponents decides if all classes are at one range. Chosen, in
    // weights of a class: lower lets their noise decide then, higher outweighs what ranges show.
    let pull = 0.05;
    let mut normal = nalgebra::Matrix3::<f64>::zeros();
    let mut right = nalgebra::Vector3::<f64>::zeros();
    for &[range, tilt, sigma] in classes {
        let row = nalgebra::Vector3::new(1.0, range, tilt);
        normal += row * row.transpose();
        right += row * sigma;
    }
    normal[(1, 1)] += pull;
    right[1] += pull * usual.power;
    normal[(2, 2)] += pull;
    right[2] += pull * usual.incidence;
    let Some(found) = normal.cholesky().map(|c| c.solve(&right)) else { return usual };
    Noise {
        at_metre_m: libm::exp(found[0]),
        power: found[1].clamp(POWERS.0, POWERS.1),
        incidence: found[2].clamp(0.0, 2.0),
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use crate::Point;
    use crate::frames::edges::usable_pixels;
    use crate::frames::patches::patches;
    use crate::sample::mix;

    /// A pinhole camera with a view of about 65° by 75°.
    pub(crate) fn camera_of(rows: usize, columns: usize) -> Camera {
        let ray = |i: usize| -> Point {
            let x = 0.77 * (2.0 * ((i % columns) as f64 + 0.5) / columns as f64 - 1.0);
            let y = 0.64 * (2.0 * ((i / columns) as f64 + 0.5) / rows as f64 - 1.0);
            let length = (x * x + y * y + 1.0).sqrt();
            [x / length, y / length, 1.0 / length]
        };
        let rays: Vec<Point> = (0..rows * columns).map(ray).collect();
        Camera::new(rows, columns, &rays).unwrap()
    }

    /// Ranges of a plane with this normal, `away_m` ahead of the camera.
    pub(crate) fn plane(camera: &Camera, normal: Point, away_m: f64) -> Vec<f32> {
        let along = |ray: &[f32; 3]| (0..3).map(|k| normal[k] * f64::from(ray[k])).sum::<f64>();
        camera.rays.iter().map(|ray| (normal[2] * away_m / along(ray)) as f32).collect()
    }

    /// Roughly normal numbers: the sum of twelve uniform ones.
    pub(crate) fn normal(i: u64) -> f64 {
        (0..12).map(|k| (mix(12 * i + k) >> 11) as f64 / (1_u64 << 53) as f64).sum::<f64>() - 6.0
    }

    #[test]
    fn the_noise_of_a_frame_is_that_which_was_put_in() {
        let camera = camera_of(240, 320);
        let truth = |r: f64| 0.0008 * r * r;
        let mut ranges = plane(&camera, [0.0, 0.5, 1.0], 1.6);
        for (i, r) in ranges.iter_mut().enumerate() {
            *r += (truth(f64::from(*r)) * normal(i as u64)) as f32;
        }
        let usable = usable_pixels(&camera, &ranges, &NoiseTable::new(&Noise::default()), 1);
        let found = Noise::of(&camera, &ranges, &patches(&camera, &ranges, &usable, 1));
        for range in [1.3, 1.6, 2.0] {
            let ratio = found.sigma_m(range, 0.8) / truth(range);
            assert!((0.85..1.15).contains(&ratio), "{range}: {ratio} {found:?}");
        }
    }
}
