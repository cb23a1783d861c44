//! Solves for all poses at once, with the floor as a smooth surface, and estimates their
//! uncertainty. Lengths in m.
//!
//! Unknowns are the pose of every frame, the offset of its ranges, the offset common to all frames,
//! and the plane of the floor (least squares with the surfels' heights eliminated). The height of a
//! surfel is free; that of the floor is also near its plane, as far as the floor is even. A camera
//! whose ranges are all too long by 4 mm sees a curved floor and, moved along it, underestimates
//! its own motion. This determines the offset where the same place is seen from several angles.

use nalgebra::{Matrix3, Vector3};

use crate::parallel::map_chunks;

use super::confidence::loops;
use super::keyframe::Keyframe;
use super::links::{Links, model};
use super::model::Index;
use super::motion::Motion;
use super::noise::{Noise, NoiseTable};
use super::normal_equations::NormalEquations;
use super::state::{ALIKE, OFFSET_M, State, middles_of};
use super::track::{Settled, Tracker, floor};

/// The poses of all frames, and their uncertainty.
#[derive(Debug, Clone)]
pub struct Joint {
    /// From each frame to the scan, whose floor is z = 0; `None` if it was left out.
    pub poses: Vec<Option<Motion>>,
    /// Whether each frame was part of the solution; the others are to be registered with it
    /// (`Tracker::settled`).
    pub solved: Vec<bool>,
    /// Whether the surfels that a frame shares with others do not fix it along the floor.
    pub slides: Vec<bool>,
    /// Offset added to the ranges of each frame, in m.
    pub offsets_m: Vec<f64>,
    /// The part of the offset common to all frames, in m.
    pub offset_m: f64,
    /// Standard uncertainty of the mean of `offsets_m`.
    pub u_offset_m: f64,
    /// Standard deviation of the frames about their mean, over places a few cubes wide, in m.
    pub between_m: f64,
    /// Standard uncertainty of a mean height above the floor from the poses, in m.
    pub u_height_m: f64,
    /// Standard uncertainty of heights from the differences between frames, common to a place,
    /// in m.
    pub u_place_m: f64,
    /// Width of a place, in m.
    pub place_m: f64,
    /// Root mean square deviation of the floor from its plane, in m.
    pub uneven_m: f64,
    /// Pairs of frames that are not consecutive and see the same place.
    pub loops: usize,
    /// Whether a floor was in view.
    pub has_floor: bool,
}

/// Fewest and most rounds, of one step each after the first; after each round the noise is
/// estimated from the residuals. Chosen: rounds end as soon as no frame moves; fewer leave long
/// loops unsolved, more take time.
const ROUNDS: (usize, usize) = (3, 12);
/// Every how many surfels are used in the first round, which later ones correct. Chosen: more of
/// them take time, fewer start the later rounds from farther away.
const FIRST: usize = 4;
/// Surfels are linked again when a frame has moved by more than this share of a cube. Chosen: lower
/// links more often, which takes time; higher keeps patches at the wrong surfels.
const MOVED: f64 = 0.1;
/// Approximate number of points in which the floor is searched. Chosen: fewer fit it worse, more
/// take time.
const POINTS: usize = 20_000;
/// Parts in which observations are summed, fixed so that the result does not depend on the number
/// of threads.
const PARTS: usize = 4;
/// Standard deviation of a frame's own offset about the common one, in m. Chosen: lower leaves
/// offsets in the poses, higher lets offsets take up errors of the poses.
const OWN_OFFSET_M: f64 = 0.001;
/// Prior standard deviation of a frame's motion from its registered pose, in m and radians. Chosen
/// far beyond the errors of registration, so that it decides only where no surfel does: lower holds
/// frames where they were laid.
const LAID: f64 = 0.05;
/// A common offset of more standard deviations ([`OFFSET_M`]) is rejected: 15 mm, more than the
/// largest there. Chosen: lower rejects cameras that are far off, higher takes a distorted lens for
/// an offset.
const BELIEVED: f64 = 2.5;
/// Weight that fixes the first frame.
const HELD: f64 = 1e12;

impl Tracker {
    /// Solves for all poses.
    ///
    /// `is_exact`: the given poses are exact, and only offsets are estimated.
    #[must_use]
    pub fn solve(&mut self, noise: &Noise, is_exact: bool) -> Joint {
        let noise = NoiseTable::new(noise);
        let mut state = State::new(self, is_exact, true);
        let mut found = self.rounds(&mut state, &noise);
        if state.is_beyond_belief() {
            // Ranges that differ with the angle are no offset: the lens is distorted, or the scene
            // moved.
            self.frames_mut().iter_mut().flatten().for_each(|kept| kept.pose = kept.laid);
            state = State::new(self, is_exact, false);
            found = self.rounds(&mut state, &noise);
        }
        if let Some(by) = state.level(self.frames_mut()) {
            found.turn(&by);
        }
        self.settled = self.settle(&state);
        state.joint(self.frames(), &found)
    }

    fn rounds(&mut self, state: &mut State, noise: &NoiseTable) -> Links {
        let mut found = Links::default();
        for round in 0..ROUNDS.1 {
            if let Some(by) = state.level(self.frames_mut()) {
                found.turn(&by);
            }
            let has_moved = state.moved_m > MOVED * state.cube_m;
            // The first links are wide; the second round needs narrower ones.
            if round < 2 || has_moved {
                found = state.links(self.frames(), noise);
            } else if round >= ROUNDS.0 {
                break;
            }
            let steps = if round == 0 { 2 } else { 1 };
            let every = if round == 0 { FIRST } else { 1 };
            (0..steps).for_each(|_| state.step(self.frames_mut(), &found, every));
            state.learn(self.frames(), &found);
            state.is_settled = true;
        }
        state.step(self.frames_mut(), &found, 1);
        found
    }

    /// The surfels with which the frames outside the solution are registered, and their approximate
    /// poses.
    fn settle(&mut self, state: &State) -> Option<Settled> {
        let is_whole =
            self.frames().iter().zip(&state.places).all(|(f, at)| f.is_none() || at.is_some());
        if state.is_exact || is_whole {
            return None;
        }
        let surfels = model(&state.seen(self.frames()), state.cube_m).surfels();
        let mut before: Option<(Motion, Motion)> = None;
        for (kept, place) in self.frames_mut().iter_mut().zip(&state.places) {
            let Some(kept) = kept else { continue };
            if place.is_some() {
                before = Some((kept.laid, kept.pose));
            } else if let Some((laid, now)) = before {
                // At the same motion from the last solved frame as when it was registered.
                kept.pose = now.after(&laid.inverse().after(&kept.laid));
            }
        }
        Some(Settled { index: Index::new(surfels, state.cube_m), offset_m: state.offset_m })
    }
}

impl State {
    /// Whether the offset is larger than that of any depth camera.
    fn is_beyond_belief(&self) -> bool {
        self.offset_m.abs() > BELIEVED * OFFSET_M
    }

    /// Rotates the scene so that the floor is z = 0; returns the motion.
    fn level(&mut self, frames: &mut [Option<Keyframe>]) -> Option<Motion> {
        let sensors: Vec<Vector3<f64>> = frames.iter().flatten().map(|k| k.pose.shift).collect();
        let first = sensors.first()?;
        let mean = sensors.iter().sum::<Vector3<f64>>() / sensors.len() as f64;
        let seen = self.seen(frames);
        let every = seen.iter().map(|s| s.frame.patches.len()).sum::<usize>().div_ceil(POINTS);
        let patches = seen.iter().flat_map(|s| s.frame.patches.iter().map(move |p| (s, p)));
        let points: Vec<crate::Point> = patches
            .step_by(every.max(1))
            .map(|(s, p)| (s.frame.pose.apply(&p.at(s.offset_m)) - first).into())
            .collect();
        let plane = floor(&points, (mean - first).into(), self.range_m, self.threads)?;
        self.has_floor = true;
        if self.is_exact {
            return None;
        }
        let up = Vector3::from(plane.normal);
        let offset_m = plane.offset_m + up.dot(first);
        let by = Motion { rotation: onto_z(&up), shift: Vector3::new(0.0, 0.0, -offset_m) };
        frames.iter_mut().flatten().for_each(|kept| kept.pose = by.after(&kept.pose));
        self.plane = Vector3::zeros();
        Some(by)
    }

    /// Moves the frames by one least-squares step over every `every`-th surfel.
    fn step(&mut self, frames: &mut [Option<Keyframe>], found: &Links, every: usize) {
        let middles = middles_of(frames);
        let mut system = self.observed(frames, &middles, found, every);
        self.expect(&mut system);
        let Some(solved) = system.solved() else { return };
        let mut farthest_m = 0.0_f64;
        for (i, kept) in frames.iter_mut().enumerate() {
            let (Some(kept), Some(at)) = (kept.as_mut(), self.places[i]) else { continue };
            let by = Vector3::new(solved.x[at], solved.x[at + 1], solved.x[at + 2]);
            let shift = Vector3::new(solved.x[at + 3], solved.x[at + 4], solved.x[at + 5]);
            kept.pose = Motion::small(&by, &middles[i], &shift).after(&kept.pose);
            self.offsets_m[i] += solved.x[at + 6];
            farthest_m = farthest_m.max(shift.norm() + by.norm() * self.range_m);
        }
        let last = self.unknowns - 4;
        self.offset_m += solved.x[last];
        self.plane += Vector3::new(solved.x[last + 1], solved.x[last + 2], solved.x[last + 3]);
        self.solved = Some(solved);
        self.moved_m += farthest_m;
    }

    /// The normal equations of the surfels, summed in fixed parts: the same for any number of
    /// threads.
    fn observed(
        &self,
        frames: &[Option<Keyframe>],
        middles: &[Vector3<f64>],
        found: &Links,
        every: usize,
    ) -> NormalEquations {
        let chunk = found.len().div_ceil(PARTS).max(1);
        let parts = map_chunks(found.len(), chunk, self.threads, |numbers| {
            let mut system = NormalEquations::new(self.unknowns);
            let mut rows = Vec::new();
            for number in numbers.step_by(every) {
                self.rows(frames, middles, found.get(number), &mut rows);
                if rows.len() > 1 {
                    system.add_surfel(&rows);
                }
            }
            system
        });
        let mut system = NormalEquations::new(self.unknowns);
        parts.iter().for_each(|part| system.add(part));
        system
    }

    /// The weight of an offset with prior 0.
    fn or_held(&self, u_m: f64) -> f64 {
        if self.has_offset { 1.0 / (u_m * u_m) } else { HELD }
    }

    /// Adds the priors.
    fn expect(&self, system: &mut NormalEquations) {
        let common = self.unknowns - 4;
        let mut first = true;
        for (i, at) in self.places.iter().enumerate() {
            let Some(at) = *at else { continue };
            let held = if first || self.is_exact { HELD } else { 1.0 / (LAID * LAID) };
            first = false;
            (0..6).for_each(|k| system.add_prior(at + k, None, 0.0, held));
            let off = self.offsets_m[i] - self.offset_m;
            system.add_prior(at + 6, Some(common), off, self.or_held(OWN_OFFSET_M));
        }
        system.add_prior(common, None, self.offset_m, self.or_held(OFFSET_M));
        (1..4).for_each(|k| system.add_prior(common + k, None, self.plane[k - 1], 1.0));
    }

    fn joint(mut self, frames: &[Option<Keyframe>], found: &Links) -> Joint {
        let spread = self.spread(frames, found);
        let (u_height_m, u_offset_m) = self.by_covariance(frames, found);
        for (i, kept) in frames.iter().enumerate() {
            if kept.is_none() || self.places[i].is_none() {
                self.offsets_m[i] = self.offset_m;
            }
        }
        Joint {
            poses: frames.iter().map(|kept| kept.as_ref().map(|kept| kept.pose)).collect(),
            slides: self.slides(frames.len(), found),
            solved: self.places.iter().map(Option::is_some).collect(),
            offsets_m: self.offsets_m,
            offset_m: self.offset_m,
            u_offset_m,
            between_m: spread.between_m,
            u_height_m,
            u_place_m: spread.of_mean_m,
            place_m: ALIKE * self.range_m,
            uneven_m: self.uneven_m,
            loops: loops(frames.len(), found),
            has_floor: self.has_floor,
        }
    }
}

/// The smallest rotation of a direction onto z.
fn onto_z(up: &Vector3<f64>) -> Matrix3<f64> {
    let axis = up.cross(&Vector3::z());
    let sine = axis.norm();
    if sine < 1e-15 {
        return Matrix3::identity();
    }
    super::motion::turn(&(axis / sine * libm::atan2(sine, up.z)))
}
