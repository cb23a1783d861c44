//! Point spacing (m), roughness (m) and surface normals of a cloud, from about 2,000
//! neighbourhoods.
//!
//! All default lengths follow from these, so that a heap of 10 cm and a stockpile of 30 m are
//! measured with the same settings.

use crate::error::{Error, Result};
use crate::fixed::Fixed;
use crate::moments::Moments;
use crate::nearest::KdTree;
use crate::parallel::{both, map_chunks};
use crate::positions::distinct_of;
use crate::sample::sample;
use crate::{Places, Point, thread_count};

/// Number of positions whose neighbourhood is examined: the standard error of a median is then 0.03
/// standard deviations (closed form: 1.25 / √2000). Chosen: more take time.
const SURVEYED: usize = 2000;
/// The neighbour whose distance is the spacing: on a square grid the last one a step away.
const SPACING_NEIGHBOR: usize = 4;
/// Number of neighbours, including the point, through which a plane is fitted. Chosen: fewer fit
/// their own noise, more reach around edges.
const NEIGHBORS: usize = 17;
/// Largest distance of a position and its neighbours from their plane, on a surface: this share of
/// the spacing for the surface's form, plus this many times the cloud's roughness. One outlier
/// among seventeen, as far off as the spacing, makes 0.23 of the spacing.
const FLAT: f64 = 0.05;
const ROUGH: f64 = 2.0;
/// Share of the positions used, from the densest on: the sparsest may be clumps of outliers.
/// Chosen: higher takes clumps in, lower leaves out far ground.
const KEPT: f64 = 0.97;
/// Share of the surface with at least the density that [`Survey::sparse_m`] gives.
const MOST: f64 = 0.75;
/// Points in a leaf of the tree; large, since searches are few. Decides no answer.
const LEAF: usize = 128;
/// Positions for a thread at a time. Decides no answer.
const CHUNK: usize = 100;
/// Relative difference of the steps of a regular raster: rounding.
const REGULAR: f64 = 1e-6;

/// A surface normal, of either sign.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Normal {
    /// The place of the normal.
    pub at: Point,
    /// Unit normal.
    pub normal: Point,
}

/// Point spacing, roughness and normals of a cloud.
#[derive(Debug, Clone, PartialEq)]
pub struct Survey {
    /// Number of distinct positions; that of points, if none of those examined is shared.
    pub positions: usize,
    /// Typical distance between neighbouring points, in m: the step of a square grid, about 1.1 /
    /// √(points per m²) on a random surface, twice the step of a line.
    pub spacing_m: f64,
    /// The spacing where points are sparse, in m: three quarters of the surface are at least as
    /// dense.
    pub sparse_m: f64,
    /// Whether the spacing is that of a regular raster: the same almost everywhere.
    pub regular: bool,
    /// Typical distance of a point from the plane through its neighbours, in m.
    pub roughness_m: f64,
    /// Normals at the examined positions.
    pub normals: Vec<Normal>,
}

struct Neighborhood {
    /// Whether some of the neighbours share a position.
    crowded: bool,
    spacing_m: f64,
    surface: Option<(Normal, f64)>,
}

/// Examines the neighbourhoods of about 2,000 positions.
///
/// Duplicates count as one position. `seed` decides which positions are examined; the order of the
/// points does not.
///
/// # Errors
///
/// Fewer than five distinct positions.
///
/// # Examples
///
/// ```
/// use divespot_core::Point;
/// use divespot_core::survey::survey;
///
/// // A floor of 40 by 40 points, 2 cm apart.
/// let floor: Vec<Point> =
///     (0..1600).map(|i| [f64::from(i % 40) * 0.02, f64::from(i / 40) * 0.02, 0.0]).collect();
/// let found = survey(&floor, 0, 0)?;
/// assert!(found.regular);
/// assert!((found.spacing_m - 0.02).abs() < 1e-9);
/// assert!(found.roughness_m < 1e-9);
/// # Ok::<(), divespot_core::Error>(())
/// ```
pub fn survey(points: &[Point], seed: u64, threads: usize) -> Result<Survey> {
    let mut positions = points.len();
    let mut seen = neighborhoods(points, seed, threads)?;
    if seen.iter().any(|n| n.crowded) {
        let distinct = distinct_of(points);
        positions = distinct.len();
        seen = neighborhoods(&distinct, seed, threads)?;
    }
    let spacings = sorted(seen.iter().map(|n| n.spacing_m).collect());
    let roughness = sorted(seen.iter().filter_map(|n| Some(n.surface?.1)).collect());
    let spacing_m = quantile(&spacings, 1, 2);
    Ok(Survey {
        positions,
        spacing_m,
        sparse_m: sparse(&seen, quantile(&roughness, 1, 2)),
        regular: quantile(&spacings, 3, 5) - quantile(&spacings, 2, 5) <= REGULAR * spacing_m,
        roughness_m: quantile(&roughness, 1, 2),
        normals: seen.iter().filter_map(|n| Some(n.surface?.0)).collect(),
    })
}

fn neighborhoods(points: &[Point], seed: u64, threads: usize) -> Result<Vec<Neighborhood>> {
    if points.len() <= SPACING_NEIGHBOR {
        return Err(Error::TooFewPoints {
            what: "a point spacing (duplicates count once)",
            given: points.len(),
            needed: SPACING_NEIGHBOR + 1,
        });
    }
    let threads = thread_count(threads);
    let largest = || Places::from(points).bounds(threads).map_or(0.0, |b| b.largest());
    let draw = || (Fixed::new(largest(), 32), sample(points, SURVEYED, seed, threads));
    let (tree, (fixed, asked)) = both(threads, || KdTree::new(points, LEAF, threads), draw);
    let look = |&i: &u32| {
        let p = &asked[i as usize];
        (i, look(*p, &tree.nearest(p, NEIGHBORS), fixed))
    };
    let numbers = tree.leaf_by_leaf(&asked);
    let parts = map_chunks(asked.len(), CHUNK, threads, |range| {
        numbers[range].iter().map(look).collect::<Vec<_>>()
    });
    let mut seen: Vec<(u32, Neighborhood)> = parts.into_iter().flatten().collect();
    seen.sort_unstable_by_key(|(i, _)| *i);
    Ok(seen.into_iter().map(|(_, neighborhood)| neighborhood).collect())
}

/// The point spacing of [`survey`], in m.
///
/// # Errors
///
/// Fewer than five distinct positions.
///
/// # Examples
///
/// ```
/// use divespot_core::{Point, point_spacing};
///
/// // A floor of 40 by 40 points, 2 cm apart.
/// let floor: Vec<Point> =
///     (0..1600).map(|i| [f64::from(i % 40) * 0.02, f64::from(i / 40) * 0.02, 0.0]).collect();
/// assert!((point_spacing(&floor, 0)? - 0.02).abs() < 1e-9);
/// # Ok::<(), divespot_core::Error>(())
/// ```
pub fn point_spacing(points: &[Point], seed: u64) -> Result<f64> {
    survey(points, seed, 1).map(|survey| survey.spacing_m)
}

/// Examines one neighbourhood; `near` holds squared distances and positions, nearest (the point
/// itself) first.
fn look(at: Point, near: &[(f64, Point)], fixed: Fixed) -> Neighborhood {
    let spacing_m = near.get(SPACING_NEIGHBOR).map_or(0.0, |(square, _)| square.sqrt());
    let flattest = Moments::of(near.iter().map(|(_, p)| p), fixed).flattest(fixed);
    let surface = flattest
        .filter(|_| near.len() == NEIGHBORS)
        .map(|(normal, variance)| (Normal { at, normal: normal.into() }, variance.sqrt()));
    let crowded = near.iter().enumerate().any(|(i, a)| near[..i].iter().any(|b| a.1 == b.1));
    Neighborhood { crowded, spacing_m, surface }
}

/// The spacing below which three quarters of the surface lie: each position represents the square
/// of its spacing. Outliers, off the plane of their neighbours, represent none.
fn sparse(seen: &[Neighborhood], roughness_m: f64) -> f64 {
    let flat = |n: &&Neighborhood| {
        let most = FLAT * n.spacing_m + ROUGH * roughness_m;
        n.surface.is_some_and(|(_, off)| off <= most)
    };
    let spacings = sorted(seen.iter().filter(flat).map(|n| n.spacing_m).collect());
    let spacings = &spacings[..(KEPT * spacings.len() as f64) as usize];
    let whole: f64 = spacings.iter().map(|s| s * s).sum();
    let mut area = 0.0;
    let below = spacings.iter().find(|&&s| {
        area += s * s;
        area >= MOST * whole
    });
    below.copied().unwrap_or(0.0)
}

/// The quantile `part` / `of` of sorted values; 0 without values.
fn quantile(sorted: &[f64], part: usize, of: usize) -> f64 {
    sorted.get(sorted.len().saturating_sub(1) * part / of).copied().unwrap_or(0.0)
}

fn sorted(mut values: Vec<f64>) -> Vec<f64> {
    values.sort_unstable_by(f64::total_cmp);
    values
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sample::mix;

    /// Coordinates on `levels` levels for each axis, so that many are equal.
    fn levels(count: u64, levels: [u64; 3]) -> Vec<Point> {
        let coordinate = |i: u64, k: usize| (mix(3 * i + k as u64) % levels[k]) as f64 / 1000.0;
        (0..count).map(|i| std::array::from_fn(|k| coordinate(i, k))).collect()
    }

    fn grid(step: f64, times: usize) -> Vec<Point> {
        let cells = (0..40).flat_map(|i| (0..40).map(move |j| [i, j]));
        let points = cells.map(|[i, j]| [f64::from(i) * step, f64::from(j) * step, 0.0]);
        points.flat_map(|p| std::iter::repeat_n(p, times)).collect()
    }

    #[test]
    fn a_square_grid_has_its_step_however_often_each_point_comes() {
        for times in [1, 2, 10, 100] {
            assert_eq!(point_spacing(&grid(0.125, times), 0), Ok(0.125));
        }
    }

    #[test]
    fn a_shuffled_cloud_has_the_same_spacing() {
        let points = levels(9000, [1 << 30; 3]);
        let mut shuffled = points.clone();
        shuffled.sort_by_key(|p| p[1].to_bits());
        assert_eq!(point_spacing(&points, 7), point_spacing(&shuffled, 7));
    }

    #[test]
    fn four_positions_are_too_few() {
        let points: Vec<Point> = (0..400).map(|i| [f64::from(i % 4), 0.0, 0.0]).collect();
        let error = point_spacing(&points, 0).unwrap_err();
        assert!(matches!(error, Error::TooFewPoints { given: 4, needed: 5, .. }));
        assert!(point_spacing(&[], 0).is_err());
    }

    #[test]
    fn a_slope_has_its_normal_and_its_roughness() {
        let noise = |i: u64| ((mix(i) % 2000) as f64 / 1000.0 - 1.0) * 1e-3;
        let at = |i: u64| [(i % 60) as f64 * 0.01, (i / 60) as f64 * 0.01];
        let points: Vec<Point> =
            (0..3600).map(|i| [at(i)[0], at(i)[1], 0.5 * at(i)[0] + noise(i)]).collect();
        let survey = super::survey(&points, 0, 2).unwrap();
        let tilt = survey.normals.iter().map(|n| (n.normal[0] / n.normal[2] + 0.5).abs());
        assert!(tilt.sum::<f64>() / (survey.normals.len() as f64) < 0.05);
        assert!(survey.roughness_m > 2e-4 && survey.roughness_m < 1e-3, "{}", survey.roughness_m);
    }

    #[test]
    fn about_two_thousand_positions_are_looked_at_of_which_seventeen_make_a_surface() {
        let normals = |columns: usize, rows: usize| {
            let at = |i: usize| [(i % columns) as f64, (i / columns) as f64, 0.0];
            let points: Vec<Point> = (0..columns * rows).map(at).collect();
            survey(&points, 0, 1).unwrap().normals.len()
        };
        assert!((1500..2700).contains(&normals(100, 100)), "{}", normals(100, 100));
        assert!(normals(4, 5) > 0 && normals(2, 7) == 0);
    }

    #[test]
    fn a_raster_is_regular_to_a_millionth_of_its_step() {
        let is_regular = |off: f64| {
            let other = grid(1.0 + off, 1).into_iter().map(|p| [p[0] + 100.0, p[1], p[2]]);
            let points: Vec<Point> = grid(1.0, 1).into_iter().chain(other).collect();
            survey(&points, 0, 1).unwrap().regular
        };
        assert!(is_regular(0.7e-6) && !is_regular(1.6e-6));
    }

    /// Positions with this spacing, that lie so far off the plane of their neighbours.
    fn positions(count: usize, spacing_m: f64, off_m: f64) -> Vec<Neighborhood> {
        let surface = Some((Normal { at: [0.0; 3], normal: [0.0, 0.0, 1.0] }, off_m));
        (0..count).map(|_| Neighborhood { crowded: false, spacing_m, surface }).collect()
    }

    #[test]
    fn strays_are_off_by_a_twentieth_of_their_spacing_and_twice_the_roughness() {
        let counts = |off_m: f64, roughness_m: f64| {
            let seen = [positions(10, 1.0, 0.0), positions(90, 5.0, off_m)];
            sparse(&seen.into_iter().flatten().collect::<Vec<_>>(), roughness_m) == 5.0
        };
        assert!(counts(5.0 * 0.035, 0.0) && !counts(5.0 * 0.08, 0.0));
        assert!(counts(13.0, 10.0) && !counts(30.0, 10.0));
    }

    #[test]
    fn three_in_a_hundred_may_lie_anywhere_and_three_quarters_are_dense_enough() {
        let found = |few: usize, spacing_m: f64| {
            let seen = [positions(100 - few, 1.0, 0.0), positions(few, spacing_m, 0.0)];
            sparse(&seen.into_iter().flatten().collect::<Vec<_>>(), 0.0)
        };
        assert_eq!((found(2, 100.0), found(5, 100.0)), (1.0, 100.0));
        // Of 97, 7 have 20 % of the area, or 13 a third.
        assert_eq!((found(10, 1.8), found(16, 1.8)), (1.0, 1.8));
    }
}
