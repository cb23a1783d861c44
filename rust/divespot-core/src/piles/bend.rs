//! How the ground bends under an object, as far as the ring around it can tell.
//!
//! A film across the ring is right where the ground is level on average over every circle. Of a
//! floor that is bowl-shaped, folded or stepped it is not: it misses the bowl's depth, rounds the
//! fold off and makes a ramp of the step, by some per cent of a low pile. All of them show in the
//! ring itself.

use super::crease::Crease;
use super::nodes::{Nodes, without};

/// What a bend must leave at most of a simpler floor's squares, to be believed.
const CREASED: f64 = 0.35;
const BENT: f64 = 0.5;
/// A floor that leaves less than this share of the cells' noise is not looked at further.
const NOTICED: f64 = 0.5;

/// What the ground has, over a plane, that a film cannot see.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Bend {
    /// A bowl or a dome: this times the squared distance from the ring's centre.
    Bowl(f64),
    /// A fold or a step.
    Crease(Crease),
}

impl Bend {
    /// What the bend adds to the plane at a place.
    pub(crate) fn at(&self, x: f64, y: f64) -> f64 {
        match self {
            Self::Bowl(depth) => depth * (x * x + y * y),
            Self::Crease(crease) => crease.at(x, y),
        }
    }

    /// The bend that a ring (x, y, height, about its centre) shows, if there is one.
    ///
    /// A crease must fit clearly better than a smoothly bent floor, which has as many parameters;
    /// that one clearly better than a plane.
    pub(crate) fn found(ring: &[[f64; 3]]) -> Option<Self> {
        let nodes = Nodes::of(ring);
        let plane = nodes.basis(|x, y| vec![1.0, x, y])?;
        let saddle = nodes.basis(|x, y| vec![1.0, x, y, x * x - y * y, x * y])?;
        let left = without(&plane, &nodes.heights);
        let round = without(&saddle, &nodes.values(|x, y| x * x + y * y));
        let depth = round.dot(&nodes.heights) / round.norm_squared();
        let smooth = without(&saddle, &nodes.heights) - &round * depth;
        let noticed = nodes.roots.norm_squared() * (NOTICED * nodes.noise_m).powi(2);
        let crease = (smooth.norm_squared() > noticed)
            .then(|| Crease::best(&nodes, &plane, &left))
            .flatten()
            .filter(|crease| crease.leaves(&nodes, &plane, &left, &smooth) < CREASED);
        if let Some(crease) = crease {
            return Some(Self::Crease(crease.settled(ring, &nodes)));
        }
        let bent =
            left.norm_squared() > noticed && smooth.norm_squared() < BENT * left.norm_squared();
        bent.then(|| {
            let variance = smooth.norm_squared() / (smooth.len() - 6) as f64;
            let chance = variance / (depth * depth * round.norm_squared());
            Self::Bowl(depth * (1.0 - chance).max(0.0)) // less of it, the likelier it is chance
        })
    }
}
