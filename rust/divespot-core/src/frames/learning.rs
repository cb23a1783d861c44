//! Estimates the noise beyond that of the pixels, and the floor's unevenness, from the residuals of
//! frames; in m.

use std::collections::BTreeMap;

use nalgebra::Vector3;

use crate::robust::scale;

use super::keyframe::Keyframe;
use super::links::{Link, Links, Sight};
use super::state::{ALIKE, State};

/// Least unevenness of a floor, in m. Chosen: lower lets a floor in view of few frames fix them too
/// well, higher does not use floors that are even.
const EVEN_M: f64 = 1e-4;

impl State {
    /// Estimates the unexplained noise and the unevenness of the floor.
    pub(super) fn learn(&mut self, frames: &[Option<Keyframe>], found: &Links) {
        let mut off = Vec::new();
        let mut noise_m2 = 0.0;
        for link in found.iter().filter(|link| link.sights.len() > 1) {
            for (sight, value) in link.sights.iter().zip(self.residuals(frames, link)) {
                // The mean is of the same values, which reduces their variance by (k - 1) / k.
                let k = link.sights.len() as f64;
                off.push(value * (k / (k - 1.0)).sqrt());
                noise_m2 += sight.noise_m2();
            }
        }
        if off.is_empty() {
            return;
        }
        let noise_m2 = noise_m2 / off.len() as f64;
        let seen_m = scale(off);
        self.unexplained_m = (seen_m * seen_m - noise_m2).max(1e-8).sqrt();
        self.excess = self.spread(frames, found).excess;
        self.uneven_m = self.unevenness_m(frames, found);
    }

    /// Root mean square deviation of the floor from its plane, over places with correlated
    /// unevenness, in m.
    fn unevenness_m(&self, frames: &[Option<Keyframe>], found: &Links) -> f64 {
        let mut sums: BTreeMap<[i32; 2], (f64, f64)> = Default::default();
        let wide_m = ALIKE * self.range_m;
        for link in found.iter().filter(|link| self.is_floor(*link)) {
            let at = link.surfel.at;
            let above = self.mean_off(frames, link) * link.surfel.normal.z + at.z
                - self.plane.dot(&Vector3::new(1.0, at.x, at.y));
            let sum = sums.entry([at.x, at.y].map(|v| (v / wide_m).floor() as i32)).or_default();
            *sum = (sum.0 + above, sum.1 + 1.0);
        }
        let means: Vec<f64> =
            sums.values().filter(|sum| sum.1 > 10.0).map(|sum| sum.0 / sum.1).collect();
        scale(means).max(EVEN_M)
    }

    fn mean_off(&self, frames: &[Option<Keyframe>], link: Link<'_>) -> f64 {
        let (mut sum, mut weight) = (0.0, 0.0);
        for sight in link.sights {
            let w = self.weight(sight);
            sum += w * self.off(frames, link, sight);
            weight += w;
        }
        if weight > 0.0 { sum / weight } else { 0.0 }
    }

    /// Distance at which a frame puts a surfel from the surfel's plane, in m.
    fn off(&self, frames: &[Option<Keyframe>], link: Link<'_>, sight: &Sight) -> f64 {
        let off = |kept| link.surfel.normal.dot(&(self.place(kept, sight).0 - link.surfel.at));
        frames[sight.frame()].as_ref().map_or(0.0, off)
    }

    /// Deviation of each frame that saw a surfel from their weighted mean, in m.
    pub(super) fn residuals(&self, frames: &[Option<Keyframe>], link: Link<'_>) -> Vec<f64> {
        let mean = self.mean_off(frames, link);
        link.sights.iter().map(|sight| self.off(frames, link, sight) - mean).collect()
    }
}
