//! All poses at once, with the floor as one smooth surface, and how well they are known.
//!
//! Unknown are the pose of every frame, an offset of its ranges, the offset that all frames have in
//! common, and the plane of the floor. A surfel's height is whatever the frames that saw it agree
//! on; that of the floor is also near its plane, as far as the floor is even. A camera that
//! measures all ranges too long by 4 mm sees a floor that is curved and, moved along it, too little
//! of its own way: that the same place is seen from several angles tells how much.

use nalgebra::{Matrix3, Vector3};

use crate::parallel::map_chunks;

use super::confidence::loops;
use super::keyframe::Keyframe;
use super::links::{Links, model};
use super::model::Index;
use super::motion::Motion;
use super::noise::{Noise, NoiseTable};
use super::normal_equations::NormalEquations;
use super::state::{ALIKE, OFFSET_M, State, middles};
use super::track::{Settled, Tracker, floor};

/// The poses of all frames, and how well they are known.
#[derive(Debug, Clone)]
pub struct Joint {
    /// From each frame to the scan, whose floor is z = 0; none where it was left out.
    pub poses: Vec<Option<Motion>>,
    /// Whether each was solved for; the others are to be laid between them (`Tracker::settled`).
    pub solved: Vec<bool>,
    /// Whether nothing that a frame shares with others fixes it along the floor.
    pub slides: Vec<bool>,
    /// What is added to the ranges of each frame.
    pub offsets_m: Vec<f64>,
    /// What all frames have in common of it.
    pub offset_m: f64,
    /// Standard uncertainty of the mean of `offsets_m`.
    pub u_offset_m: f64,
    /// Standard deviation of the frames about their mean, over places a few cubes wide.
    pub between_m: f64,
    /// Standard uncertainty of a mean height above the floor, by the poses.
    pub u_height_m: f64,
    /// Standard uncertainty of heights by what frames differ by, common to a place.
    pub u_place_m: f64,
    /// Width of a place.
    pub place_m: f64,
    /// Root mean square departure of the floor from its plane.
    pub uneven_m: f64,
    /// Pairs of frames that are not neighbours in time, and see the same.
    pub loops: usize,
    /// Whether a floor was in view.
    pub has_floor: bool,
}

/// Fewest and most rounds, of one step but the first; after each, what the frames leave tells how
/// far they may be believed.
const ROUNDS: (usize, usize) = (3, 12);
/// Of so many surfels one is looked at in the first round, which later ones correct.
const FIRST: usize = 4;
/// Surfels are linked anew if a frame moved by more than this part of a cube since.
const MOVED: f64 = 0.1;
/// Points in which the floor is looked for, about.
const POINTS: usize = 20_000;
/// Parts in which observations are summed up, whatever the number of threads.
const PARTS: usize = 4;
/// Standard deviation of a frame's own offset about it.
const OWN_OFFSET_M: f64 = 0.001;
/// Frames move by so little from where they were laid, in metres and radians.
const LAID: f64 = 0.05;
/// An offset of more standard deviations is something else.
const BELIEVED: f64 = 2.5;
/// Weight that holds the first frame.
const HELD: f64 = 1e12;

impl Tracker {
    /// Solves for all poses.
    ///
    /// `is_exact`: the poses were given as they are, and only their offsets are sought.
    #[must_use]
    pub fn solve(&mut self, noise: &Noise, is_exact: bool) -> Joint {
        let noise = NoiseTable::new(noise);
        let mut state = State::new(self, is_exact, true);
        let mut found = self.rounds(&mut state, &noise);
        if state.is_beyond_belief() {
            // What differs with the angle is no offset: the lens, or a scene that moved.
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
            // The first links are wide: the second are of what lies near.
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

    /// What the frames that were not solved for are laid on, and where they are about to lie.
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
                // As it lay beside the last one that was solved for.
                kept.pose = now.after(&laid.inverse().after(&kept.laid));
            }
        }
        Some(Settled { index: Index::new(surfels, state.cube_m), offset_m: state.offset_m })
    }
}

impl State {
    /// Whether no depth camera has such an offset.
    fn is_beyond_belief(&self) -> bool {
        self.offset_m.abs() > BELIEVED * OFFSET_M
    }

    /// Turns everything so that the floor is z = 0; returns how.
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

    /// Moves the frames by what every so many surfels say.
    fn step(&mut self, frames: &mut [Option<Keyframe>], found: &Links, every: usize) {
        let middles = middles(frames);
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

    /// What surfels say, summed up in parts: in the same order at any number of threads.
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

    /// The weight of an offset that is expected to be 0.
    fn or_held(&self, u_m: f64) -> f64 {
        if self.has_offset { 1.0 / (u_m * u_m) } else { HELD }
    }

    /// What is expected before anything was seen.
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

/// The smallest rotation that takes a direction to z.
fn onto_z(up: &Vector3<f64>) -> Matrix3<f64> {
    let axis = up.cross(&Vector3::z());
    let sine = axis.norm();
    if sine < 1e-15 {
        return Matrix3::identity();
    }
    super::motion::turn(&(axis / sine * libm::atan2(sine, up.z)))
}
