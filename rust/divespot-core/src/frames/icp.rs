//! Registers a frame with the model: point-to-plane ICP, coarse to fine (Chen and Medioni 1992).
//! Lengths in m.

use nalgebra::{Matrix6, SymmetricEigen, Vector3, Vector6};

use crate::parallel::map_chunks;
use crate::robust::scale;

use super::model::Index;
use super::motion::Motion;
use super::patches::Patch;

/// The result of a registration.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Fit {
    pub(crate) pose: Motion,
    /// Share of the patches with a surfel of the model near by.
    pub(crate) overlap: f64,
    /// Share of those that agree with it.
    pub(crate) lying: f64,
    /// Robust standard deviation of their distances, in m.
    pub(crate) sigma_m: f64,
    /// Mean cost of a patch with a surfel near by, in m.
    pub(crate) cost: f64,
    /// The direction of motion, if any, that the scene does not fix.
    pub(crate) sliding: Option<Vector3<f64>>,
}

/// A level: search radius as a share of the range, every how many patches are used, most
/// iterations, and the step (in radians, and shares of the range) below which it ends.
struct Level {
    reach: f64,
    every: usize,
    rounds: usize,
    done: f64,
}

/// From an eighth of the range, a few times the motion of a hand between two frames, down to the
/// size of a few patches. Chosen: narrower searches lose fast motions, wider ones pair other
/// surfaces.
const COARSE: [Level; 2] = [
    Level { reach: 0.12, every: 4, rounds: 15, done: 1e-4 },
    Level { reach: 0.05, every: 2, rounds: 10, done: 1e-4 },
];
/// The last level, for starts that are near already.
const FINE: [Level; 1] = [Level { reach: 0.02, every: 1, rounds: 8, done: 1e-5 }];
/// Least cosine of the angle between normals of one surface: 32°. Chosen: lower pairs both sides of
/// an edge, higher loses noisy normals and turned frames.
const ALIKE: f64 = 0.85;
/// Residuals beyond this share of the search radius, and beyond this many standard deviations, lose
/// weight (Huber). Chosen: lower slows convergence, higher lets what moved pull the frame.
const HUBER: f64 = 0.1;
const DEVIATIONS: f64 = 3.0;
/// Mean squared slope of the surfaces along a motion, from which the scene fixes it: that of a
/// floor tilted by 0.8° everywhere. Chosen: lower takes the noise of a floor for shape and slides,
/// higher ignores small piles.
const FIXED: f64 = 2e-4;
/// The variance of noisy normals, times this factor, is subtracted from the squared slopes: 1 would
/// be exact without errors of the variance itself. Chosen: more ignores slopes that are there.
const NOISY: f64 = 1.2;
/// Patches for a thread at a time. Decides no answer.
const CHUNK: usize = 2048;
/// Patches keep their surfels while the frame moves by less than this share of the search radius.
/// Chosen: lower searches more often, higher keeps wrong pairs longer.
const SAME: f64 = 0.05;
/// A patch agrees with the model within this many standard deviations. Chosen: of normal errors 1
/// in 16,000 is beyond; lower calls good frames bad, higher hides what moved.
const ON: f64 = 4.0;

/// Registers patches with the model, from a roughly known pose.
pub(crate) fn lay(
    index: &Index,
    patches: &[Patch],
    start: Motion,
    rough: bool,
    threads: usize,
) -> Fit {
    let range_m = typical_range_m(patches);
    let mut run = Run { index, patches, range_m, threads, pose: start, sliding: None };
    let levels = COARSE.iter().filter(|_| rough).chain(FINE.iter());
    levels.for_each(|level| run.level(level));
    run.judged()
}

/// The median range of a frame, in m.
pub(crate) fn typical_range_m(patches: &[Patch]) -> f64 {
    crate::robust::median(patches.iter().map(|p| p.at.norm()).collect())
}

struct Run<'a> {
    index: &'a Index,
    patches: &'a [Patch],
    range_m: f64,
    threads: usize,
    pose: Motion,
    sliding: Option<Vector3<f64>>,
}

/// A patch and its surfel.
#[derive(Clone, Copy)]
struct Pair {
    patch: usize,
    surfel: usize,
}

impl Run<'_> {
    fn level(&mut self, level: &Level) {
        let reach_m = (level.reach * self.range_m).max(self.index.cube_m);
        let (mut pairs, mut moved) = (Vec::new(), f64::INFINITY);
        for _ in 0..level.rounds {
            if moved * self.range_m > SAME * reach_m {
                pairs = self.pairs(reach_m, level.every);
                moved = 0.0;
            }
            if pairs.len() < 6 {
                break;
            }
            let by = self.step(&pairs, reach_m);
            moved += by;
            if by < level.done {
                break;
            }
        }
    }

    fn pairs(&self, reach_m: f64, every: usize) -> Vec<Pair> {
        let count = self.patches.len().div_ceil(every);
        let found = map_chunks(count, CHUNK, self.threads, |range| {
            let near = range.filter_map(|k| self.near(k * every, reach_m));
            near.filter(|pair| self.is_alike(pair)).collect::<Vec<_>>()
        });
        found.concat()
    }

    fn near(&self, patch: usize, reach_m: f64) -> Option<Pair> {
        let at = self.pose.apply(&self.patches[patch].at);
        self.index.nearest(&at, reach_m).map(|surfel| Pair { patch, surfel })
    }

    fn is_alike(&self, pair: &Pair) -> bool {
        let normal = self.pose.rotation * self.patches[pair.patch].normal;
        self.index.surfels[pair.surfel].normal.dot(&normal) > ALIKE
    }

    /// The place of a pair's patch, and its distance from the surfel's plane in m.
    fn off(&self, pair: &Pair) -> (Vector3<f64>, f64) {
        let surfel = &self.index.surfels[pair.surfel];
        let at = self.pose.apply(&self.patches[pair.patch].at);
        (at, surfel.normal.dot(&(at - surfel.at)))
    }

    /// Moves the pose; returns by how much, in radians and shares of the range.
    fn step(&mut self, pairs: &[Pair], reach_m: f64) -> f64 {
        let laid: Vec<(Vector3<f64>, f64)> = pairs.iter().map(|pair| self.off(pair)).collect();
        let spread = scale(laid.iter().map(|one| one.1));
        let limit_m = (HUBER * reach_m).max(DEVIATIONS * spread);
        let middle = laid.iter().map(|one| one.0).sum::<Vector3<f64>>() / pairs.len() as f64;
        let (mut normal, mut right) = (Matrix6::zeros(), Vector6::zeros());
        let (mut weight, mut slope_var) = (0.0, 0.0);
        for (pair, (at, off_m)) in pairs.iter().zip(laid) {
            let w = if off_m.abs() <= limit_m { 1.0 } else { limit_m / off_m.abs() };
            let (patch, surfel) = (&self.patches[pair.patch], &self.index.surfels[pair.surfel]);
            let n = surfel.normal;
            let turn = (at - middle).cross(&n) / self.range_m;
            let row = Vector6::new(turn.x, turn.y, turn.z, n.x, n.y, n.z);
            normal += row * row.transpose() * w;
            right -= row * (w * off_m);
            weight += w;
            // The noise of the surfel's normal falls with the number of its pixels.
            slope_var += w * patch.slope_var * patch.count / surfel.count;
        }
        let least = FIXED * weight + NOISY * slope_var;
        let step = self.fixed_part(&normal, &right, least);
        let by: Vector3<f64> = step.fixed_rows::<3>(0) / self.range_m;
        let shift: Vector3<f64> = step.fixed_rows::<3>(3).into();
        self.pose = Motion::small(&by, &middle, &shift).after(&self.pose);
        by.norm() + shift.norm() / self.range_m
    }

    /// Solves for the motions that the scene fixes; along the others the pose stays as expected.
    fn fixed_part(
        &mut self,
        normal: &Matrix6<f64>,
        right: &Vector6<f64>,
        least: f64,
    ) -> Vector6<f64> {
        let eigen = SymmetricEigen::new(*normal);
        let mut step = Vector6::zeros();
        let mut slid = (0.0, None);
        for k in 0..6 {
            let (value, axis) = (eigen.eigenvalues[k], eigen.eigenvectors.column(k));
            if value > least {
                step += axis * (axis.dot(right) / value);
                continue;
            }
            let shift: Vector3<f64> = axis.fixed_rows::<3>(3).into();
            if shift.norm() > slid.0 {
                slid = (shift.norm(), Some(shift / shift.norm()));
            }
        }
        self.sliding = slid.1;
        step
    }

    fn judged(&self) -> Fit {
        let reach_m = 2.0 * self.index.cube_m;
        let found = map_chunks(self.patches.len(), CHUNK, self.threads, |range| {
            range.filter_map(|k| self.near(k, reach_m)).collect::<Vec<_>>()
        });
        let near = found.concat();
        let alike = near.iter().filter(|pair| self.is_alike(pair));
        let off_m: Vec<f64> = alike.map(|pair| self.off(pair).1.abs()).collect();
        let sigma_m = scale(off_m.iter().copied());
        let on_m = ON * sigma_m.max(1e-3 * self.range_m);
        let lying = off_m.iter().filter(|off| **off < on_m).count() as f64;
        let cap_m = 0.02 * self.range_m;
        let unpaired = (near.len() - off_m.len()) as f64 * cap_m;
        let cost = unpaired + off_m.iter().map(|off| off.min(cap_m)).sum::<f64>();
        let (all, count) = (self.patches.len().max(1) as f64, near.len().max(1) as f64);
        Fit {
            pose: self.pose,
            overlap: near.len() as f64 / all,
            lying: lying / count,
            sigma_m,
            cost: cost / count,
            sliding: self.sliding,
        }
    }
}
