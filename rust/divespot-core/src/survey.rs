//! What a cloud says of itself: point spacing, roughness and surface normals.
//!
//! All default lengths follow from here, so a heap of 10 cm and a stockpile of 30 m are measured
//! with the same settings.

use std::num::NonZero;

use kiddo::{ImmutableKdTree, SquaredEuclidean};

use crate::error::{Error, Result};
use crate::fixed::Fixed;
use crate::moments::Moments;
use crate::parallel::map_chunks;
use crate::sample::sample;
use crate::{Bounds, Point};

/// Positions whose neighbourhood is looked at.
const SURVEYED: usize = 2000;
/// The neighbour whose distance is the spacing: on a square grid the last one a step away.
const SPACING_NEIGHBOR: usize = 4;
/// Neighbours, the point included, through which a small plane is laid.
const NEIGHBORS: NonZero<usize> = NonZero::new(17).unwrap();
const CHUNK: usize = 100;

/// A surface normal; its sign means nothing.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Normal {
    /// Where it stands.
    pub at: Point,
    /// Unit normal.
    pub normal: Point,
}

/// What a cloud says of itself.
#[derive(Debug, Clone, PartialEq)]
pub struct Survey {
    /// Typical distance between neighbouring points: the step of a square grid, about
    /// 1.1 / √(points per m²) on a random surface, twice the step of a line.
    pub spacing_m: f64,
    /// Typical distance of a point from the plane through its neighbours.
    pub roughness_m: f64,
    /// Normals of the surveyed positions.
    pub normals: Vec<Normal>,
}

struct Neighborhood {
    spacing_m: f64,
    surface: Option<(Normal, f64)>,
}

/// Surveys the neighbourhoods of about 2,000 positions.
///
/// Duplicates count as one position. `seed` decides which positions are looked at; the order of
/// the points does not.
///
/// # Errors
///
/// Fewer than five distinct positions.
pub fn survey(points: &[Point], seed: u64, threads: usize) -> Result<Survey> {
    let mut positions = sample(points, points.len(), seed);
    positions.dedup();
    let too_few = Error::TooFewPoints {
        what: "a point spacing (duplicates count once)",
        given: positions.len(),
        needed: SPACING_NEIGHBOR + 1,
    };
    if positions.len() <= SPACING_NEIGHBOR {
        return Err(too_few);
    }
    let tree = ImmutableKdTree::<f64, 3>::new_from_slice(&positions).map_err(|_| too_few)?;
    let fixed = Fixed::new(Bounds::of(positions.iter().copied()).map_or(0.0, |b| b.largest()), 32);
    let asked = SURVEYED.min(positions.len());
    let around = |p: &Point| {
        let found = tree.query(p).nearest_n::<SquaredEuclidean<f64>>(NEIGHBORS).execute();
        let near: Vec<(f64, Point)> =
            found.iter().map(|i| (i.distance, positions[i.item as usize])).collect();
        look(*p, &near, fixed)
    };
    let parts = map_chunks(asked, CHUNK, threads, |range| {
        positions[range].iter().map(around).collect::<Vec<_>>()
    });
    let seen: Vec<Neighborhood> = parts.into_iter().flatten().collect();
    Ok(Survey {
        spacing_m: median(seen.iter().map(|n| n.spacing_m).collect()),
        roughness_m: median(seen.iter().filter_map(|n| Some(n.surface?.1)).collect()),
        normals: seen.iter().filter_map(|n| Some(n.surface?.0)).collect(),
    })
}

/// `near` holds squared distances and positions, the nearest (the point itself) first.
fn look(at: Point, near: &[(f64, Point)], fixed: Fixed) -> Neighborhood {
    let spacing_m = near.get(SPACING_NEIGHBOR).map_or(0.0, |(square, _)| square.sqrt());
    let flattest = Moments::of(near.iter().map(|(_, p)| p), fixed).flattest(fixed);
    let surface = flattest
        .filter(|_| near.len() == NEIGHBORS.get())
        .map(|(normal, variance)| (Normal { at, normal: normal.into() }, variance.sqrt()));
    Neighborhood { spacing_m, surface }
}

/// The lower median; 0 where there is nothing.
fn median(mut values: Vec<f64>) -> f64 {
    if values.is_empty() {
        return 0.0;
    }
    let middle = (values.len() - 1) / 2;
    *values.select_nth_unstable_by(middle, f64::total_cmp).1
}
