//! How the ground bends under an object, as far as the ring around it can tell.
//!
//! A film across the ring is right where the ground is level on average over every circle. Of a
//! floor that is bowl-shaped, folded or stepped it is not: it misses the bowl's depth, rounds the
//! fold off and makes a ramp of the step, by some per cent of a low pile. All of them show in the
//! ring itself.

use super::crease::Crease;
use super::nodes::{Nodes, without};

/// What a bend must leave at most of a simpler floor's squares, to be believed.
const CLEARER: f64 = 0.35;
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

    /// The bend that a ring of cells (x, y, height, about its centre) of edge `cell_m` shows, if there is one.
    ///
    /// A crease must fit clearly better than a smoothly bent floor, which has as many parameters;
    /// that one clearly better than a plane.
    pub(crate) fn found(ring: &[[f64; 3]], cell_m: f64) -> Option<Self> {
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
            .filter(|crease| crease.is_floor(&nodes))
            .filter(|crease| crease.leaves(&nodes, &plane, &left, &smooth) < CLEARER);
        if let Some(crease) = crease {
            return Some(Self::Crease(crease.settled(ring, cell_m, &nodes, &plane, &left)));
        }
        let bent =
            left.norm_squared() > noticed && smooth.norm_squared() < CLEARER * left.norm_squared();
        bent.then(|| {
            let variance = smooth.norm_squared() / (smooth.len() - 6) as f64;
            let chance = variance / (depth * depth * round.norm_squared());
            Self::Bowl(depth * (1.0 - chance).max(0.0)) // less of it, the likelier it is chance
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sample::mix;

    const CELL: f64 = 0.0137;

    /// The cells between 0.45 and 0.56 m off the centre, on a raster that lies anyhow.
    fn ring(height: impl Fn(f64, f64) -> f64) -> Vec<[f64; 3]> {
        let at = |i: i32| 0.0031 + f64::from(i) * CELL;
        let places = (-45..45).flat_map(|i| (-45..45).map(move |j| (at(i), at(j))));
        let on = |&(x, y): &(f64, f64)| (0.45..0.56).contains(&x.hypot(y));
        places
            .filter(on)
            .zip(0..)
            .map(|((x, y), i)| [x, y, height(x, y) + 0.001 * noise(i)])
            .collect()
    }

    /// About normal.
    fn noise(i: u64) -> f64 {
        (0..12).map(|k| (mix(12 * i + k) >> 11) as f64 / (1u64 << 53) as f64).sum::<f64>() - 6.0
    }

    /// How far the base is off on average over the disc within the ring, in metres.
    fn error(height: impl Fn(f64, f64) -> f64 + Copy) -> f64 {
        let mut local = ring(height);
        let bend = Bend::found(&local, CELL);
        let bend_at = |x: f64, y: f64| bend.map_or(0.0, |b| b.at(x, y));
        local.iter_mut().for_each(|p| p[2] -= bend_at(p[0], p[1]));
        let plane = Nodes::of(&local).plane_under(|_, _| 0.0).unwrap();
        let at = |i: i32| f64::from(i) * 0.005;
        let disc = (-90..90).flat_map(|i| (-90..90).map(move |j| (at(i), at(j))));
        let inside = disc.filter(|(x, y)| x.hypot(*y) < 0.45);
        let off = |(x, y): (f64, f64)| {
            plane[0] + plane[1] * x + plane[2] * y + bend_at(x, y) - height(x, y)
        };
        let (sum, count) = inside.fold((0.0, 0.0), |(s, n), p| (s + off(p), n + 1.0));
        sum / count
    }

    #[test]
    fn a_step_is_found_wherever_it_runs() {
        for (angle, at) in [(0.0, 0.0), (0.5, 0.2), (1.3, -0.15), (2.9, 0.1), (0.03, -0.21)] {
            let line = Line { angle, at };
            let off =
                error(|x, y| 0.7 + 0.02 * x + if line.beyond(x, y) > 0.0 { 0.03 } else { 0.0 });
            assert!(off.abs() < 4e-4, "{angle} {at}: {off}");
        }
    }

    #[test]
    fn a_fold_up_or_down_is_found() {
        for (slope, at) in [(0.05, 0.0), (-0.05, 0.2), (0.08, -0.1)] {
            let line = Line { angle: 0.7, at };
            let off = error(|x, y| 0.7 - 0.01 * y + slope * line.beyond(x, y).max(0.0));
            assert!(off.abs() < 3e-4, "{slope} {at}: {off}");
        }
    }

    #[test]
    fn a_bowl_is_found_and_a_plane_or_a_saddle_needs_none() {
        let off = error(|x, y| 0.03 * (x * x + y * y) + 0.01 * x);
        assert!(off.abs() < 5e-4, "{off}");
        assert_eq!(Bend::found(&ring(|x, y| 0.1 * x - 0.05 * y), CELL), None);
        let saddle = Bend::found(&ring(|x, y| 0.03 * (x * x - y * y)), CELL);
        assert!(saddle.is_none_or(|bend| bend.at(0.5, 0.0).abs() < 5e-4), "{saddle:?}");
    }

    #[test]
    fn debris_and_the_foot_of_a_wall_are_no_bend() {
        let debris = |x: f64, y: f64| if (x - 0.5).hypot(y) < 0.06 { 0.05 } else { 0.0 };
        let bend = Bend::found(&ring(debris), CELL);
        assert!(bend.is_none_or(|bend| bend.at(0.0, 0.0).abs() < 1e-3), "{bend:?}");
        let wall = |x: f64, _| if x > 0.5 { 3.0 * (x - 0.5) } else { 0.0 };
        let bend = Bend::found(&ring(wall), CELL);
        assert!(bend.is_none_or(|bend| bend.at(0.0, 0.0).abs() < 1e-3), "{bend:?}");
    }

    struct Line {
        angle: f64,
        at: f64,
    }

    impl Line {
        fn beyond(&self, x: f64, y: f64) -> f64 {
            x * self.angle.cos() + y * self.angle.sin() - self.at
        }
    }
}
