//! The state of the joint solution of poses.

use nalgebra::Vector3;

use super::keyframe::Keyframe;
use super::links::{Links, Seen};
use super::noise::NoiseTable;
use super::normal_equations::{Solved, WIDTH};
use super::track::Tracker;

/// Standard uncertainty of a depth camera's range offset, in m: about half the 11 mm that Microsoft
/// gives as the largest.
pub(super) const OFFSET_M: f64 = 0.006;
/// The floor's unevenness is correlated over this share of the range. Chosen: shorter takes waves
/// of the floor for independent errors, longer leaves too few places to tell them from.
pub(super) const ALIKE: f64 = 0.2;
/// Initial standard deviation of surfels beyond their pixels' noise, in m. Chosen: the first round
/// replaces it by an estimate.
const UNEXPLAINED_M: f64 = 3e-4;
/// Largest distance of a patch from its surfel along the normal, as a share of a cube's width, in
/// the first and in later rounds. Chosen: lower loses frames laid badly, higher links two surfaces.
const ALONG: f64 = 0.5;
const SETTLED: f64 = 0.2;

/// The state so far.
pub(super) struct State {
    pub(super) offsets_m: Vec<f64>,
    pub(super) offset_m: f64,
    /// Height (m) and slopes of the floor's plane.
    pub(super) plane: Vector3<f64>,
    pub(super) has_floor: bool,
    pub(super) unexplained_m: f64,
    pub(super) uneven_m: f64,
    pub(super) range_m: f64,
    pub(super) cube_m: f64,
    pub(super) threads: usize,
    pub(super) is_exact: bool,
    /// Index of each frame's first unknown; `None` if it is not solved for.
    pub(super) places: Vec<Option<usize>>,
    pub(super) unknowns: usize,
    pub(super) solved: Option<Solved>,
    /// Whether the offset of the ranges is estimated.
    pub(super) has_offset: bool,
    /// Variance of places' means, relative to that expected from independent surfels.
    pub(super) excess: f64,
    /// Whether the frames are near their final poses, so that large residuals are outliers.
    pub(super) is_settled: bool,
    /// Upper bound on how far a frame has moved since surfels were linked, in m.
    pub(super) moved_m: f64,
}

impl State {
    pub(super) fn new(tracker: &Tracker, is_exact: bool, has_offset: bool) -> Self {
        let mut count = 0;
        let place = |kept: &Option<Keyframe>| {
            let is_held = kept.as_ref().is_some_and(|kept| !kept.patches.is_empty());
            is_held.then(|| {
                count += 1;
                (count - 1) * WIDTH
            })
        };
        let places: Vec<Option<usize>> = tracker.frames().iter().map(place).collect();
        Self {
            offsets_m: vec![0.0; places.len()],
            offset_m: 0.0,
            plane: Vector3::zeros(),
            has_floor: false,
            unexplained_m: UNEXPLAINED_M,
            uneven_m: 0.002,
            range_m: tracker.range_m,
            cube_m: tracker.cube_m(),
            threads: tracker.threads(),
            is_exact,
            places,
            unknowns: count * WIDTH + 4,
            solved: None,
            is_settled: false,
            has_offset,
            excess: 1.0,
            moved_m: 0.0,
        }
    }

    pub(super) fn links(&mut self, frames: &[Option<Keyframe>], noise: &NoiseTable) -> Links {
        self.moved_m = 0.0;
        let along_m = if self.is_settled { SETTLED } else { ALONG } * self.cube_m;
        Links::of(&self.seen(frames), self.cube_m, along_m, noise, self.threads)
    }

    /// The frames that are solved for, with their offsets.
    pub(super) fn seen<'a>(&self, frames: &'a [Option<Keyframe>]) -> Vec<Seen<'a>> {
        let frames = frames.iter().enumerate().zip(&self.places);
        let solved = frames.filter(|(_, place)| place.is_some());
        let seen = solved.filter_map(|((number, kept), _)| {
            let offset_m = self.offsets_m[number];
            kept.as_ref().map(|frame| Seen { number, frame, offset_m })
        });
        seen.collect()
    }
}

/// Mean place of each frame's patches, about which its pose is rotated.
pub(super) fn middles_of(frames: &[Option<Keyframe>]) -> Vec<Vector3<f64>> {
    let middle = |kept: &Keyframe| {
        let sum: Vector3<f64> = kept.patches.iter().map(|p| p.at(0.0)).sum();
        kept.pose.apply(&(sum / kept.patches.len().max(1) as f64))
    };
    frames.iter().map(|kept| kept.as_ref().map_or_else(Vector3::zeros, middle)).collect()
}
