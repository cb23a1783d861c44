//! Fuses frames with known poses in voxels; integer sums, so that they merge in any order. Lengths
//! in m.

use crate::error::positive;
use crate::parallel::{map_chunks, share};
use crate::sample::mix;
use crate::{Point, Result, thread_count};

use super::camera::Camera;
use super::motion::Motion;
use super::noise::{Noise, NoiseTable};
use super::voxels::{Held, Item, PARTS, Voxels};

/// Weight of a pixel with the reference noise, between 1 and 255. Chosen: pixels of a quarter to
/// four times that noise keep the weights of their variances (closed form: 16 / 4² = 1, 16 · 4² =
/// 256).
const WEIGHT: f64 = 16.0;
/// Pixels for a thread at a time. Decides no answer.
const CHUNK: usize = 1 << 14;
/// Parts that threads fill in parallel; a brick belongs to one of them. Decides no answer.
const SHARES: usize = 8;

/// Voxels and the sums of their pixels.
///
/// # Examples
///
/// ```
/// use divespot_core::frames::{Camera, Fusion, Motion, Noise};
///
/// let rays: Vec<[f64; 3]> = (0..9).map(|i| [0.01 * f64::from(i), 0.0, 1.0]).collect();
/// let camera = Camera::new(3, 3, &rays)?;
/// let mut fusion = Fusion::new(0.05, &Noise::default(), 1.0)?;
/// fusion.add(&camera, &[1.0; 9], &[true; 9], &Motion::default(), 0.0, 1);
/// assert_eq!(fusion.points().counts.iter().sum::<u32>(), 9);
/// # Ok::<(), divespot_core::Error>(())
/// ```
pub struct Fusion {
    voxel_m: f64,
    per_m: f64,
    noise: NoiseTable,
    reference_m: f64,
    shares: [Voxels; SHARES],
    frames: u32,
}

/// The points of a fusion, sorted by the z of their columns' voxels.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Fused {
    /// Weighted mean of each voxel's pixels, in m.
    pub points: Vec<Point>,
    /// Number of pixels in each.
    pub counts: Vec<u32>,
    /// Number of frames that saw each.
    pub frames: Vec<u32>,
    /// Standard deviation of the heights in each, in m.
    pub spreads_m: Vec<f64>,
}

impl Fusion {
    /// Creates an empty fusion with voxels of width `voxel_m`; pixels have a weight by their noise
    /// relative to that at `range_m`.
    ///
    /// # Errors
    ///
    /// [`crate::Error::Setting`] unless `voxel_m` is finite and above 0.
    pub fn new(voxel_m: f64, noise: &Noise, range_m: f64) -> Result<Self> {
        positive("voxel_m", voxel_m)?;
        let reference_m = noise.sigma_m(range_m, 1.0);
        let (noise, shares) = (NoiseTable::new(noise), std::array::from_fn(|_| Voxels::default()));
        Ok(Self { voxel_m, per_m: 1.0 / voxel_m, noise, reference_m, shares, frames: 0 })
    }

    /// The noise that determines the weights.
    #[must_use]
    pub fn noise(&self) -> &NoiseTable {
        &self.noise
    }

    /// Adds the usable pixels of a frame; `offset_m` is added to its ranges.
    pub fn add(
        &mut self,
        camera: &Camera,
        ranges_m: &[f32],
        usable: &[bool],
        pose: &Motion,
        offset_m: f64,
        threads: usize,
    ) {
        self.frames += 1;
        let (frame, threads) = (self.frames, thread_count(threads));
        let items = map_chunks(ranges_m.len(), CHUNK, threads, |pixels| {
            let mut found: [Vec<Item>; SHARES] = std::array::from_fn(|_| Vec::new());
            for i in pixels.filter(|&i| usable[i]) {
                let ray = camera.rays[i].map(f64::from);
                let away_m = f64::from(ranges_m[i]) + offset_m;
                let at = pose.apply(&(nalgebra::Vector3::from(ray) * away_m));
                if let Some(item) = self.item(at.into(), ranges_m[i]) {
                    found[mix(item.brick) as usize % SHARES].push(item);
                }
            }
            found
        });
        share(self.shares.iter_mut().enumerate(), threads, |(k, voxels)| {
            items.iter().for_each(|found| voxels.add(&found[k], frame));
        });
    }

    /// Adds another fusion with the same voxels and other frames.
    pub fn merge(&mut self, other: &Self) {
        self.shares.iter_mut().zip(&other.shares).for_each(|(own, theirs)| own.merge(theirs));
    }

    #[inline]
    fn item(&self, at: Point, range_m: f32) -> Option<Item> {
        let steps = at.map(|v| v * self.per_m);
        let cell = steps.map(below);
        let (brick, voxel) = Item::home(cell)?;
        let ratio = self.reference_m / self.noise.straight_m(range_m);
        let weight = (WEIGHT * ratio * ratio + 0.5).clamp(1.0, 255.0) as u8;
        let inside = std::array::from_fn(|k| ((steps[k] - cell[k] as f64) * PARTS) as u16);
        Some(Item { brick, voxel, weight, inside })
    }

    /// Memory of the voxels, in bytes.
    #[must_use]
    pub fn bytes(&self) -> usize {
        self.shares.iter().map(Voxels::bytes).sum()
    }

    /// The points: in each column the voxels, merged where a surface lies at a face between two.
    #[must_use]
    pub fn points(&self) -> Fused {
        let mut all: Vec<(u64, Held)> =
            self.shares.iter().flat_map(|voxels| voxels.held(self.voxel_m)).collect();
        all.sort_unstable_by_key(|&(number, _)| number);
        let mut fused = Fused::default();
        let mut before: Option<(u64, Held)> = None;
        for (number, own) in all {
            before = match before {
                Some((last, one)) if last + 1 == number && own.is_one_with(&one, self.voxel_m) => {
                    Some((number, one.with(&own)))
                }
                Some((_, one)) => {
                    fused.push(&one);
                    Some((number, own))
                }
                None => Some((number, own)),
            };
        }
        if let Some((_, one)) = before {
            fused.push(&one);
        }
        fused
    }
}

/// `floor` to an integer. `f64::floor` is slow where the processor has no instruction for it.
#[inline]
fn below(value: f64) -> i64 {
    let whole = value as i64;
    whole - i64::from(whole as f64 > value)
}

impl Fused {
    fn push(&mut self, one: &Held) {
        self.points.push(one.at);
        self.counts.push(one.pixels);
        self.frames.push(one.frames);
        self.spreads_m.push(one.spread_m());
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frames::motion::turn;
    use crate::frames::noise::tests::{camera_of, normal, plane};
    use nalgebra::Vector3;

    fn down(x: f64) -> Motion {
        let rotation = turn(&Vector3::new(std::f64::consts::PI, 0.0, 0.0));
        Motion { rotation, shift: Vector3::new(x, 0.0, 1.4) }
    }

    fn frames_of(camera: &Camera) -> Vec<(Vec<f32>, Motion)> {
        (0..4_u64)
            .map(|f| {
                let mut ranges = plane(camera, [0.0, 0.0, 1.0], 1.4);
                let noise = |i: usize| 0.002 * normal(f << 32 | i as u64);
                ranges.iter_mut().enumerate().for_each(|(i, r)| *r += noise(i) as f32);
                (ranges, down(0.1 * f as f64))
            })
            .collect()
    }

    #[test]
    fn frames_merge_in_any_order_to_the_same_bits() {
        let camera = camera_of(60, 80);
        let frames = frames_of(&camera);
        let all = vec![true; camera.pixels()];
        let fused = |order: &[usize], threads: usize| {
            let mut fusion = Fusion::new(0.02, &Noise::default(), 1.4).unwrap();
            order.iter().for_each(|&i| {
                fusion.add(&camera, &frames[i].0, &all, &frames[i].1, 0.001, threads);
            });
            fusion
        };
        let expected = fused(&[0, 1, 2, 3], 1).points();
        assert_eq!(expected, fused(&[3, 1, 0, 2], 3).points());
        let mut merged = fused(&[2, 0], 2);
        merged.merge(&fused(&[3, 1], 1));
        assert_eq!(expected, merged.points());
        assert_eq!(expected.counts.iter().sum::<u32>() as usize, 4 * camera.pixels());
        assert!(expected.frames.iter().any(|&n| n > 2) && expected.frames.iter().all(|&n| n < 5));
    }

    #[test]
    fn a_floor_on_the_face_between_voxels_is_one_layer_at_its_height() {
        let camera = camera_of(60, 80);
        let mut fusion = Fusion::new(0.06, &Noise::default(), 1.4).unwrap();
        let all = vec![true; camera.pixels()];
        for (ranges, pose) in frames_of(&camera) {
            fusion.add(&camera, &ranges, &all, &pose, 0.0, 1);
        }
        let fused = fusion.points();
        let thick = fused.counts.iter().zip(&fused.points).filter(|(n, _)| **n > 8);
        assert!(thick.clone().count() > 200);
        let worst = thick.clone().map(|(_, p)| p[2].abs()).fold(0.0, f64::max);
        assert!(worst < 0.003, "{worst}");
        let mean = thick.clone().map(|(_, p)| p[2]).sum::<f64>() / thick.count() as f64;
        assert!(mean.abs() < 2e-4);
    }

    #[test]
    fn what_has_no_voxel_is_refused() {
        assert!(Fusion::new(0.0, &Noise::default(), 1.0).is_err());
    }
}
