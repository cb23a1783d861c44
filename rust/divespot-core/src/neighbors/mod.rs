//! The radius filter: which points have company.

mod cells;
mod columns;

use crate::error::positive;
use crate::{Bounds, Point, Result, thread_count};
use cells::{Cells, DEEPEST};
use columns::Columns;

/// Points that a thread takes at a time.
const CHUNK: usize = 4096;

/// Rounding must not hide a candidate; exact distances alone decide who is a neighbour.
const MARGIN: f64 = 1.0 + 1e-6;

/// Whether each point has at least `min_neighbors` others within `radius_m`.
///
/// A neighbour lies at a distance `<= radius_m`; the point itself does not count, a duplicate of
/// it does. Paper, Algorithm 1, lines 1 to 17, in near-linear time. `threads` = 0 takes every
/// core that the process may use.
///
/// # Errors
/// [`Error::Setting`](crate::Error::Setting) unless `radius_m` is finite and above zero.
pub fn radius_outlier_mask(
    points: &[Point],
    radius_m: f64,
    min_neighbors: usize,
    threads: usize,
) -> Result<Vec<bool>> {
    positive("radius_m", radius_m)?;
    if min_neighbors == 0 || min_neighbors >= points.len() {
        return Ok(vec![min_neighbors == 0; points.len()]);
    }
    let threads = thread_count(threads);
    let radius = Radius { square: radius_m * radius_m, reach: radius_m * MARGIN };
    let zero = Bounds { min: [0.0; 3], max: [0.0; 3] };
    let bounds = Bounds::of(points.iter().copied()).unwrap_or(zero);
    // Surfaces lie in shallow cells; what is deep, or has strays far away, goes upward by columns.
    Ok(match Cells::up_to(DEEPEST, points, &bounds, radius, threads) {
        Some(cells) => cells.mask(min_neighbors, radius, threads),
        None => Columns::new(points, &bounds, radius.reach, threads).mask(
            min_neighbors,
            radius,
            threads,
        ),
    })
}

/// The square of the radius, which decides, and what no neighbour is beyond.
#[derive(Debug, Clone, Copy)]
struct Radius {
    square: f64,
    reach: f64,
}

impl Radius {
    /// Whether `q` is a neighbour of `p`, or `p` itself.
    fn holds(self, p: Point, q: Point) -> bool {
        let [dx, dy, dz]: Point = std::array::from_fn(|k| q[k] - p[k]);
        dx * dx + dy * dy + dz * dz <= self.square
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Error;
    use crate::sample::mix;

    /// The neighbours of each point, counted in all pairs.
    fn slow(points: &[Point], radius: f64) -> Vec<usize> {
        let near = |p: &Point, q: &Point| {
            let [dx, dy, dz] = [q[0] - p[0], q[1] - p[1], q[2] - p[2]];
            dx * dx + dy * dy + dz * dz <= radius * radius
        };
        points.iter().map(|p| points.iter().filter(|q| near(p, q)).count() - 1).collect()
    }

    /// Points on `levels` levels an axis, a thousandth apart.
    fn cloud(count: u64, levels: [u64; 3]) -> Vec<Point> {
        let coordinate = |i: u64, k: usize| (mix(3 * i + k as u64) % levels[k]) as f64 / 1000.0;
        (0..count).map(|i| std::array::from_fn(|k| coordinate(i, k))).collect()
    }

    fn assert_equal_to_slow(points: &[Point], radius: f64) {
        let counts = slow(points, radius);
        for min_neighbors in [0, 1, 3, 20, 5000] {
            let expected: Vec<bool> = counts.iter().map(|&c| c >= min_neighbors).collect();
            for threads in [1, 3] {
                let found = radius_outlier_mask(points, radius, min_neighbors, threads);
                assert_eq!(found.as_ref(), Ok(&expected), "{radius} {min_neighbors}");
            }
        }
    }

    #[test]
    fn the_mask_is_that_of_all_pairs() {
        for levels in [[300, 200, 20], [1, 1, 1], [2, 1, 4000], [1, 900, 1], [900, 1, 1]] {
            for radius in [1e-9, 0.001, 0.005, 0.0123, 0.05, 2.0] {
                assert_equal_to_slow(&cloud(600, levels), radius);
            }
        }
        // More points than a thread takes at a time, in few columns.
        assert_equal_to_slow(&cloud(4500, [8, 8, 1 << 40]), 0.004);
        assert_equal_to_slow(&[], 1.0);
        assert_equal_to_slow(&[[1.0; 3]], 1.0);
    }

    #[test]
    fn a_point_exactly_on_the_radius_is_a_neighbor() {
        let points = [[0.0; 3], [0.375, 0.5, 0.0], [-0.625, 0.0, 0.0], [0.0, 0.0, 0.625 + 1e-12]];
        let found = radius_outlier_mask(&points, 0.625, 1, 1);
        assert_eq!(found, Ok(vec![true, true, true, false]));
    }

    /// Both ways, whichever the cloud calls for.
    #[test]
    fn surfaces_and_deep_clouds_have_the_mask_of_all_pairs() {
        for levels in [[300, 200, 20], [90, 90, 1], [8, 8, 4000], [500, 3, 2]] {
            for radius in [0.001, 0.0041, 0.0123, 0.05] {
                let points = cloud(3000, levels);
                let counts = slow(&points, radius);
                let radius = Radius { square: radius * radius, reach: radius * MARGIN };
                let bounds = Bounds::of(points.iter().copied()).unwrap();
                for needed in [1, 3, 20] {
                    let expected: Vec<bool> = counts.iter().map(|&c| c >= needed).collect();
                    let columns = Columns::new(&points, &bounds, radius.reach, 2);
                    assert_eq!(columns.mask(needed, radius, 2), expected);
                    if let Some(cells) =
                        Cells::up_to(usize::MAX / points.len(), &points, &bounds, radius, 2)
                    {
                        assert_eq!(cells.mask(needed, radius, 2), expected);
                    }
                }
            }
        }
    }

    #[test]
    fn a_surface_is_shallow_and_a_wall_is_deep() {
        let radius = Radius { square: 0.01 * 0.01, reach: 0.01 * MARGIN };
        let shallow = |levels| {
            let points = cloud(20_000, levels);
            let bounds = Bounds::of(points.iter().copied()).unwrap();
            Cells::up_to(DEEPEST, &points, &bounds, radius, 2).is_some()
        };
        assert!(shallow([500, 500, 20]) && !shallow([500, 2, 500]));
    }

    #[test]
    fn a_far_stray_point_changes_nothing() {
        let mut points = cloud(2000, [200, 200, 10]);
        let mut expected: Vec<bool> = slow(&points, 0.004).into_iter().map(|c| c >= 2).collect();
        points.push([1e9, 1e9, 1e9]);
        expected.push(false);
        assert_eq!(radius_outlier_mask(&points, 0.004, 2, 2), Ok(expected));
    }

    #[test]
    fn a_radius_that_is_none_is_refused() {
        for radius in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            let result = radius_outlier_mask(&[], radius, 1, 1);
            assert!(matches!(result, Err(Error::Setting { name: "radius_m", .. })));
        }
    }
}
