//! Points that share a position, as in files merged with themselves or with rounded coordinates.

use std::cmp::Ordering;

use crate::cancel::poll;
use crate::neighbors::radius_outlier_mask;
use crate::{Point, Result};

/// Every position once, ascending.
pub(crate) fn distinct_of(points: &[Point]) -> Vec<Point> {
    let mut positions = points.to_vec();
    positions.sort_unstable_by(|a, b| {
        poll();
        ascending(a, b)
    });
    positions.dedup();
    positions
}

/// Whether each point has at least `min_neighbors` other positions within `radius_m`.
///
/// As [`radius_outlier_mask`], but points that share a position count once: an outlier that a file
/// holds six times is still isolated.
///
/// # Errors
///
/// [`Error::Setting`](crate::Error::Setting) unless `radius_m` is finite and above zero.
///
/// # Examples
///
/// ```
/// use divespot_core::positions::radius_position_mask;
///
/// let points = [[0.0; 3], [0.01, 0.0, 0.0], [0.0; 3], [1.0; 3], [1.0; 3]];
/// assert_eq!(radius_position_mask(&points, 0.05, 1, 0)?, [true, true, true, false, false]);
/// # Ok::<(), divespot_core::Error>(())
/// ```
pub fn radius_position_mask(
    points: &[Point],
    radius_m: f64,
    min_neighbors: usize,
    threads: usize,
) -> Result<Vec<bool>> {
    let positions = distinct_of(points);
    let kept = radius_outlier_mask(&positions, radius_m, min_neighbors, threads)?;
    let is_kept = |p: &Point| {
        poll();
        positions.binary_search_by(|position| ascending(position, p)).is_ok_and(|i| kept[i])
    };
    Ok(points.iter().map(is_kept).collect())
}

fn ascending(a: &Point, b: &Point) -> Ordering {
    a.partial_cmp(b).unwrap_or(Ordering::Equal)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sample::mix;

    #[test]
    fn however_often_each_point_comes_the_same_positions_are_kept() {
        let coordinate = |i: u64, k: u64| (mix(3 * i + k) % 1000) as f64 / 1000.0;
        let once: Vec<Point> = (0..300).map(|i| [0, 1, 2].map(|k| coordinate(i, k))).collect();
        let mask = radius_outlier_mask(&once, 0.1, 2, 0).unwrap();
        assert!(mask.contains(&true) && mask.contains(&false));
        for times in [1, 2, 7] {
            let points: Vec<Point> =
                once.iter().flat_map(|p| std::iter::repeat_n(*p, times)).collect();
            let kept = radius_position_mask(&points, 0.1, 2, 0).unwrap();
            assert!(kept.iter().zip(0..).all(|(&kept, i): (_, usize)| kept == mask[i / times]));
        }
    }
}
