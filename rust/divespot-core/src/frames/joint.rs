//! All poses at once, with the floor as one smooth surface, and how well they are known.
//!
//! Unknown are the pose of every frame, an offset of its ranges, the offset that all frames have in
//! common, and the plane of the floor. A surfel's height is whatever the frames that saw it agree
//! on; that of the floor is also near its plane, as far as the floor is even. A camera that
//! measures all ranges too long by 4 mm sees a floor that is curved and, moved along it, too little
//! of its own way: that the same place is seen from several angles tells how much.

use nalgebra::{Matrix3, Vector3};

use super::confidence::loops;
use super::icp::lay;
use super::links::Link;
use super::model::{Index, Model};
use super::motion::Motion;
use super::normal_equations::NormalEquations;
use super::state::{OFFSET_M, State, middles};
use super::track::{Kept, Tracker, floor};

/// The poses of all frames, and how well they are known.
#[derive(Debug, Clone)]
pub struct Joint {
    /// From each frame to the scan, whose floor is z = 0; none where it was left out.
    pub poses: Vec<Option<Motion>>,
    /// What is added to the ranges of each frame.
    pub offsets_m: Vec<f64>,
    /// What all frames have in common of it, and its standard uncertainty.
    pub offset_m: f64,
    /// Standard uncertainty of `offset_m`.
    pub u_offset_m: f64,
    /// Standard deviation of the frames about their mean, over places a few cubes wide.
    pub between_m: f64,
    /// Standard uncertainty of a height above the floor that is common to such a place.
    pub u_height_m: f64,
    /// Root mean square departure of the floor from its plane.
    pub uneven_m: f64,
    /// Pairs of frames that are not neighbours in time, and see the same.
    pub loops: usize,
    /// Whether a floor was in view.
    pub has_floor: bool,
}

/// Rounds, each with new links, and steps of each.
const ROUNDS: usize = 3;
const STEPS: usize = 2;
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
    pub fn solve(&mut self, is_exact: bool) -> Joint {
        let mut state = State::new(self, is_exact, true);
        let mut found = self.rounds(&mut state);
        if state.is_beyond_belief() {
            // What differs with the angle is no offset: the lens, or a scene that moved.
            self.frames.iter_mut().flatten().for_each(|kept| kept.pose = kept.laid);
            state = State::new(self, is_exact, false);
            found = self.rounds(&mut state);
        }
        state.level(&mut self.frames);
        state.lay_others(&mut self.frames);
        state.joint(&self.frames, &found)
    }

    fn rounds(&mut self, state: &mut State) -> Vec<Link> {
        let (cube_m, noise) = (self.cube_m(), self.noise());
        for _ in 0..ROUNDS {
            state.level(&mut self.frames);
            let found = state.links(&self.frames, cube_m, &noise);
            for _ in 0..STEPS {
                state.step(&mut self.frames, &found);
            }
            state.learn(&self.frames, &found);
            state.is_settled = true;
        }
        state.level(&mut self.frames);
        let found = state.links(&self.frames, cube_m, &noise);
        state.step(&mut self.frames, &found);
        found
    }
}

impl State {
    /// Whether no depth camera has such an offset.
    fn is_beyond_belief(&self) -> bool {
        self.offset_m.abs() > BELIEVED * OFFSET_M
    }

    /// Lays the frames that were not solved for on those that were.
    fn lay_others(&self, frames: &mut [Option<Kept>]) {
        if self.is_exact || (0..frames.len()).all(|i| self.is_solved(frames, i)) {
            return;
        }
        let moved = self.moved(frames);
        let mut model = Model::new(self.cube_m);
        let solved = (0..frames.len()).filter(|&i| self.places[i].is_some());
        solved.filter_map(|i| moved[i].as_ref()).for_each(|k| model.add(&k.patches, &k.pose));
        let index = Index::new(model.surfels(), self.cube_m);
        let mut before: Option<(Motion, Motion)> = None;
        for (i, kept) in frames.iter_mut().enumerate() {
            let Some(kept) = kept else { continue };
            if self.places[i].is_some() {
                before = Some((kept.laid, kept.pose));
                continue;
            }
            // As it lay beside the last one that was solved for.
            let start = before
                .map_or(kept.pose, |(laid, now)| now.after(&laid.inverse().after(&kept.laid)));
            let offset = self.offset_m;
            kept.patches.iter_mut().for_each(|p| p.at += p.ray * offset);
            kept.pose = lay(&index, &kept.patches, start, false, self.threads).pose;
        }
    }

    fn is_solved(&self, frames: &[Option<Kept>], frame: usize) -> bool {
        frames[frame].is_none() || self.places[frame].is_some()
    }

    /// Turns everything so that the floor is z = 0.
    fn level(&mut self, frames: &mut [Option<Kept>]) {
        let sensors: Vec<Vector3<f64>> = frames.iter().flatten().map(|k| k.pose.shift).collect();
        let Some(first) = sensors.first() else { return };
        let mean = sensors.iter().sum::<Vector3<f64>>() / sensors.len() as f64;
        let moved = self.moved(frames);
        let points = moved.iter().flatten().flat_map(|kept| {
            kept.patches.iter().step_by(3).map(|p| (kept.pose.apply(&p.at) - first).into())
        });
        let points: Vec<crate::Point> = points.collect();
        let plane = floor(&points, (mean - first).into(), self.range_m, self.threads);
        let Some(plane) = plane else { return };
        self.has_floor = true;
        let up = Vector3::from(plane.normal);
        let offset_m = plane.offset_m + up.dot(first);
        let by = if self.is_exact { return } else { onto_z(&up) };
        let motion = Motion { rotation: by, shift: Vector3::new(0.0, 0.0, -offset_m) };
        frames.iter_mut().flatten().for_each(|kept| kept.pose = motion.after(&kept.pose));
        self.plane = Vector3::zeros();
    }

    fn step(&mut self, frames: &mut [Option<Kept>], found: &[Link]) {
        let middles = middles(frames);
        let mut system = NormalEquations::new(self.unknowns);
        for link in found {
            let rows = self.rows(frames, &middles, link);
            if rows.len() > 1 {
                system.add_surfel(&rows);
            }
        }
        self.expect(&mut system);
        let Some(solved) = system.solved() else { return };
        for (i, kept) in frames.iter_mut().enumerate() {
            let (Some(kept), Some(at)) = (kept.as_mut(), self.places[i]) else { continue };
            let by = Vector3::new(solved.x[at], solved.x[at + 1], solved.x[at + 2]);
            let shift = Vector3::new(solved.x[at + 3], solved.x[at + 4], solved.x[at + 5]);
            kept.pose = Motion::small(&by, &middles[i], &shift).after(&kept.pose);
            self.offsets_m[i] += solved.x[at + 6];
        }
        let last = self.unknowns - 4;
        self.offset_m += solved.x[last];
        self.plane += Vector3::new(solved.x[last + 1], solved.x[last + 2], solved.x[last + 3]);
        self.solved = Some(solved);
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

    fn joint(mut self, frames: &[Option<Kept>], found: &[Link]) -> Joint {
        let spread = self.spread(frames, found);
        let (u_model_m, u_offset_m) = self.by_covariance(frames, found);
        for (i, kept) in frames.iter().enumerate() {
            if kept.is_none() || self.places[i].is_none() {
                self.offsets_m[i] = self.offset_m;
            }
        }
        Joint {
            poses: frames.iter().map(|kept| kept.as_ref().map(|kept| kept.pose)).collect(),
            offsets_m: self.offsets_m,
            offset_m: self.offset_m,
            u_offset_m,
            between_m: spread.between_m,
            u_height_m: (spread.of_mean_m * spread.of_mean_m + u_model_m * u_model_m).sqrt(),
            uneven_m: self.uneven_m,
            loops: loops(found),
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
