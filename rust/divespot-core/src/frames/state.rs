//! What is known of frames while their poses are solved for.

use nalgebra::Vector3;

use super::links::{Link, links};
use super::noise::Noise;
use super::normal_equations::{Solved, WIDTH};
use super::track::{Kept, Tracker};

/// Standard uncertainty of a depth camera's offset: Microsoft gives 11 mm as its largest.
pub(super) const OFFSET_M: f64 = 0.006;
/// A floor's unevenness is alike over this part of the range.
pub(super) const ALIKE: f64 = 0.2;
/// Departures of surfels that no pixel's noise explains, at first.
const UNEXPLAINED_M: f64 = 3e-4;
/// A patch belongs to a surfel within this part of a cube along the normal, at first and later.
const ALONG: f64 = 0.5;
const SETTLED: f64 = 0.2;
/// Most frames that are solved for at once; of more, every so many.
const MOST: usize = 64;

/// What is known so far.
pub(super) struct State {
    pub(super) offsets_m: Vec<f64>,
    pub(super) offset_m: f64,
    /// Height and slopes of the floor's plane.
    pub(super) plane: Vector3<f64>,
    pub(super) has_floor: bool,
    pub(super) unexplained_m: f64,
    pub(super) uneven_m: f64,
    pub(super) range_m: f64,
    pub(super) cube_m: f64,
    pub(super) threads: usize,
    pub(super) is_exact: bool,
    /// Where among the unknowns each frame's stand; none of those that are not solved for.
    pub(super) places: Vec<Option<usize>>,
    pub(super) unknowns: usize,
    pub(super) solved: Option<Solved>,
    /// Whether the ranges' offset is sought.
    pub(super) has_offset: bool,
    /// How much larger the variance of places is than that of surfels lets expect.
    pub(super) excess: f64,
    /// Whether the frames lie so near that what does not fit is something else.
    pub(super) is_settled: bool,
}

impl State {
    pub(super) fn new(tracker: &Tracker, is_exact: bool, has_offset: bool) -> Self {
        let placed = tracker.frames.iter().flatten().count();
        let every = placed.div_ceil(MOST).max(1);
        let mut count = 0;
        let places: Vec<Option<usize>> = tracker
            .frames
            .iter()
            .map(|kept| {
                kept.as_ref()?;
                count += 1;
                ((count - 1) % every == 0).then(|| (count - 1) / every * WIDTH)
            })
            .collect();
        let unknowns = places.iter().flatten().count() * WIDTH + 4;
        Self {
            offsets_m: vec![0.0; tracker.frames.len()],
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
            unknowns,
            solved: None,
            is_settled: false,
            has_offset,
            excess: 1.0,
        }
    }

    pub(super) fn links(&self, frames: &[Option<Kept>], cube_m: f64, noise: &Noise) -> Vec<Link> {
        let moved = self.moved(frames);
        let chosen: Vec<(usize, &Kept)> = (0..frames.len())
            .filter(|&i| self.places[i].is_some())
            .filter_map(|i| moved[i].as_ref().map(|kept| (i, kept)))
            .collect();
        let along_m = if self.is_settled { SETTLED } else { ALONG } * cube_m;
        let mut found = links(&chosen, cube_m, along_m, noise, self.threads);
        // Back to where the pixels were: the offsets are unknowns.
        for sight in found.iter_mut().flat_map(|link| &mut link.sights) {
            sight.at -= sight.ray * self.offsets_m[sight.frame];
        }
        found
    }

    /// The frames with their offsets.
    pub(super) fn moved(&self, frames: &[Option<Kept>]) -> Vec<Option<Kept>> {
        let moved = |(kept, &offset): (&Option<Kept>, &f64)| {
            let mut kept = kept.clone()?;
            kept.patches.iter_mut().for_each(|p| p.at += p.ray * offset);
            Some(kept)
        };
        frames.iter().zip(&self.offsets_m).map(moved).collect()
    }
}

/// The middle of what each frame saw: its pose is turned about it.
pub(super) fn middles(frames: &[Option<Kept>]) -> Vec<Vector3<f64>> {
    let middle = |kept: &Kept| {
        let sum: Vector3<f64> = kept.patches.iter().map(|p| p.at).sum();
        kept.pose.apply(&(sum / kept.patches.len().max(1) as f64))
    };
    frames.iter().map(|kept| kept.as_ref().map_or_else(Vector3::zeros, middle)).collect()
}
