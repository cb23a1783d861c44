//! Registers frames with the model, one after the other. Lengths in m.

use nalgebra::{Matrix3, Vector3};

use crate::ground::{Axis, Frame, find_ground};
use crate::plane::Settings;

use super::cutter::FEWEST;
use super::icp::{Fit, lay, typical_range_m};
use super::keyframe::{Keyframe, Keyframes};
use super::model::{Index, Model};
use super::motion::Motion;
use super::patches::Patch;
use super::search::search;

/// Why a frame could not be placed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Lost {
    /// It has too few patches.
    Empty,
    /// It overlaps too little with the frames before.
    Overlap,
    /// It agrees nowhere with the frames before.
    Fit,
}

/// How a frame was placed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Placed {
    /// Share of the frame that was seen before.
    pub overlap: f64,
    /// Share of that which agrees with the model.
    pub lying: f64,
    /// Robust standard deviation of the distances from the model, in m.
    pub sigma_m: f64,
    /// The direction along which the scene does not fix the frame.
    pub sliding: Option<[f64; 3]>,
}

/// The sequence so far.
#[derive(Debug)]
pub struct Tracker {
    threads: usize,
    model: Option<Model>,
    keyframes: Keyframes,
    /// The solution with which frames outside it are registered.
    pub(crate) settled: Option<Settled>,
    /// Median range of the first frame, in m.
    pub(crate) range_m: f64,
}

/// A joint solution, to register other frames with.
#[derive(Debug)]
pub(crate) struct Settled {
    pub(crate) index: Index,
    pub(crate) offset_m: f64,
}

/// Least overlap with the model. Chosen: with less, frames seem to fit where they do not belong;
/// more loses fast motions.
const OVERLAP: f64 = 0.25;
/// Least share of the overlap that agrees with the model. Chosen: lower takes frames at the wrong
/// place, higher loses frames in which a person moves.
const LYING: f64 = 0.6;
/// Width of a cube of the model, as a share of the range: a few patches. Chosen: wider rounds off
/// piles, narrower leaves cubes with a single patch.
const CUBE: f64 = 0.02;
/// Thickness of the floor, as a share of the range, and number of planes tried. Chosen: lower loses
/// uneven floors, higher tilts the plane towards the toes of piles.
const FLOOR: f64 = 0.01;
const HYPOTHESES: u32 = 200;
/// A frame of which this share agrees with the model is not searched elsewhere. Chosen: higher
/// searches more, which takes time; lower keeps frames that lie wrong.
const WELL: f64 = 0.8;
/// One with this share is not compared with the pose of the frame before. Chosen: higher compares
/// almost always, which takes time; lower trusts a misled coarse search.
const SURELY: f64 = 0.97;
/// A pose is better if more of the overlap agrees with the model by this share, at an overlap of at
/// least this share of the other's. Chosen: lower lets noise decide, higher misses small piles.
const MORE: f64 = 0.01;
const SHARED: f64 = 0.6;
/// A pose is also better if it costs less than this share of the other's cost and agrees at least
/// as well. Chosen: nearer 1 lets noise decide, lower leaves small piles on large floors out.
const CHEAPER: f64 = 0.95;

impl Tracker {
    /// Creates an empty sequence.
    #[must_use]
    pub fn new(threads: usize) -> Self {
        Self {
            threads: crate::thread_count(threads),
            model: None,
            keyframes: Keyframes::new(),
            settled: None,
            range_m: 1.0,
        }
    }

    /// Median range of the first frame, in m.
    #[must_use]
    pub fn range_m(&self) -> f64 {
        self.range_m
    }

    pub(crate) fn threads(&self) -> usize {
        self.threads
    }

    /// Width of a cube of the model, in m.
    pub(crate) fn cube_m(&self) -> f64 {
        CUBE * self.range_m
    }

    pub(crate) fn frames(&self) -> &[Option<Keyframe>] {
        &self.keyframes.frames
    }

    pub(crate) fn frames_mut(&mut self) -> &mut [Option<Keyframe>] {
        &mut self.keyframes.frames
    }

    /// The poses, from the frames to the model.
    #[must_use]
    pub fn poses(&self) -> Vec<Option<Motion>> {
        self.frames().iter().map(|kept| kept.as_ref().map(|kept| kept.pose)).collect()
    }

    /// Memory of the model and of the frames, in bytes.
    #[must_use]
    pub fn bytes(&self) -> (usize, usize) {
        (self.model.as_ref().map_or(0, Model::bytes), self.keyframes.bytes())
    }

    /// Places the next frame; `given` is its approximate pose, or its exact one if `is_exact`.
    ///
    /// # Errors
    ///
    /// The reason why it was left out.
    pub fn add(
        &mut self,
        patches: &[Patch],
        given: Option<Motion>,
        is_exact: bool,
    ) -> Result<Placed, Lost> {
        let found = self.place(patches, given, is_exact);
        match found {
            Ok((pose, placed)) => {
                let cube_m = self.cube_m();
                self.model.get_or_insert_with(|| Model::new(cube_m)).add(patches, &pose);
                self.keyframes.push(pose, patches);
                Ok(placed)
            }
            Err(lost) => {
                self.keyframes.leave_out();
                Err(lost)
            }
        }
    }

    /// The pose of a placed frame, registered with the joint solution if it was not part of it.
    #[must_use]
    pub fn settled(&self, number: usize, patches: &[Patch]) -> Option<Motion> {
        let start = self.frames().get(number)?.as_ref()?.pose;
        let Some(Settled { index, offset_m }) = &self.settled else { return Some(start) };
        let moved = |p: &Patch| Patch { at: p.at * (1.0 + offset_m / p.at.norm()), ..*p };
        let patches: Vec<Patch> = patches.iter().map(moved).collect();
        Some(lay(index, &patches, start, false, self.threads).pose)
    }

    fn place(
        &mut self,
        patches: &[Patch],
        given: Option<Motion>,
        is_exact: bool,
    ) -> Result<(Motion, Placed), Lost> {
        if patches.len() < FEWEST {
            return Err(Lost::Empty);
        }
        let alone = Placed { overlap: 1.0, lying: 1.0, sigma_m: 0.0, sliding: None };
        let Some(model) = &self.model else {
            self.range_m = typical_range_m(patches);
            let level = leveled(patches, self.range_m, self.threads);
            return Ok((given.or(level).unwrap_or_default(), alone));
        };
        if let Some(pose) = given.filter(|_| is_exact) {
            return Ok((pose, alone));
        }
        let index = Index::new(model.surfels(), self.cube_m());
        let fit = self.best(&index, patches, given);
        if fit.overlap < OVERLAP {
            return Err(Lost::Overlap);
        }
        if fit.lying < LYING {
            return Err(Lost::Fit);
        }
        let sliding = fit.sliding.map(Into::into);
        let Fit { pose, overlap, lying, sigma_m, .. } = fit;
        Ok((pose, Placed { overlap, lying, sigma_m, sliding }))
    }

    /// The best of the registrations from several starts.
    fn best(&self, index: &Index, patches: &[Patch], given: Option<Motion>) -> Fit {
        let laid = |start: Motion, rough| lay(index, patches, start, rough, self.threads);
        let mut best = laid(given.unwrap_or_else(|| self.expected()), true);
        if given.is_none() && best.lying > SURELY && self.is_steady() {
            return best;
        }
        // Given poses may belong to another sequence.
        let expected = given.map(|_| laid(self.expected(), true));
        // A person in the view can mislead a coarse search, but not one from a near start.
        let last = self.last().map(|start| laid(start, false));
        for fit in expected.into_iter().chain(last) {
            if is_better(&fit, &best) {
                best = fit;
            }
        }
        if best.lying > WELL && (given.is_some() || self.is_steady()) {
            return best;
        }
        let expected = best.pose;
        let range_m = typical_range_m(patches);
        let found = leveled(patches, range_m, self.threads)
            .and_then(|level| search(&index.surfels, patches, &level, &expected, range_m));
        let elsewhere = found.map(|start| laid(start, true));
        elsewhere.filter(|fit| is_better(fit, &best)).unwrap_or(best)
    }

    /// The pose of the frame before.
    fn last(&self) -> Option<Motion> {
        self.frames().iter().rev().flatten().next().map(|kept| kept.pose)
    }

    /// Whether the motion is known from two frames before.
    fn is_steady(&self) -> bool {
        self.frames().iter().rev().take(2).filter(|kept| kept.is_some()).count() == 2
    }

    /// The expected pose of the next frame: the last motion continues.
    fn expected(&self) -> Motion {
        let mut placed = self.frames().iter().rev().flatten();
        let Some(last) = placed.next() else { return Motion::default() };
        match placed.next() {
            Some(before) if self.is_steady() => {
                last.pose.after(&before.pose.inverse().after(&last.pose))
            }
            _ => last.pose,
        }
    }
}

/// Whether one registration is better than another.
fn is_better(one: &Fit, other: &Fit) -> bool {
    let overlaps = one.overlap >= OVERLAP && one.overlap > SHARED * other.overlap;
    let lies_better = one.lying > other.lying + MORE && one.cost < other.cost;
    // A small pile on a large floor is a small part of the overlap, but a large part of the cost.
    let costs_less = one.lying >= other.lying && one.cost < CHEAPER * other.cost;
    overlaps && (lies_better || costs_less)
}

/// The motion of a frame's floor onto z = 0, with the camera above the origin.
pub(crate) fn leveled(patches: &[Patch], range_m: f64, threads: usize) -> Option<Motion> {
    let points: Vec<crate::Point> = patches.iter().map(|p| p.at.into()).collect();
    let plane = floor(&points, [0.0; 3], range_m, threads)?;
    let up = Vector3::from(plane.normal);
    // The camera's x axis becomes the scan's, projected on the floor; if it is near vertical, its y
    // axis.
    let ahead = if up.x.abs() < 0.9 { Vector3::x() } else { Vector3::y() };
    let x = (ahead - up * up.dot(&ahead)).normalize();
    let rotation = Matrix3::from_columns(&[x, up.cross(&x), up]).transpose();
    Some(Motion { rotation, shift: Vector3::new(0.0, 0.0, -plane.offset_m) })
}

/// The floor among points, seen from a place.
pub(crate) fn floor(
    points: &[crate::Point],
    sensor: crate::Point,
    range_m: f64,
    threads: usize,
) -> Option<crate::plane::Plane> {
    let settings = Settings {
        threshold_m: FLOOR * range_m,
        hypotheses: HYPOTHESES,
        cone: None,
        seed: 0,
        threads,
    };
    let frame = Frame { sensor: Some(sensor), z: Axis::Ahead };
    find_ground(points, &[], &settings, frame).ok().map(|ground| ground.plane)
}
