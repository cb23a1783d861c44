//! The distance between neighbouring points, from which default lengths follow.

use std::num::NonZero;

use kiddo::{ImmutableKdTree, SquaredEuclidean};

use crate::sample::sample;
use crate::{Error, Point, Result};

/// Positions whose neighbours are looked up.
const SAMPLE: usize = 2000;

/// The neighbour whose distance counts: on a square grid the last one a step away.
const NEIGHBOR: usize = 4;

/// A typical distance between neighbouring points, in metres.
///
/// It is the median, over about 2,000 positions, of the distance to the fourth nearest other
/// position: the step of a square grid, about 1.1 / √(points per m²) on a random surface, twice
/// the step of a line. Duplicates count as one position. `seed` decides the positions asked;
/// the order of the points does not.
///
/// # Errors
/// [`Error::TooFewPoints`] with fewer than five positions.
pub fn point_spacing(points: &[Point], seed: u64) -> Result<f64> {
    let mut positions = sample(points, points.len(), seed);
    positions.dedup();
    let too_few = Error::TooFewPoints {
        what: "a point spacing (duplicates count once)",
        given: positions.len(),
        needed: NEIGHBOR + 1,
    };
    if positions.len() <= NEIGHBOR {
        return Err(too_few);
    }
    let asked = SAMPLE.min(positions.len());
    let squares = neighbor_squares(&positions, asked).ok_or(too_few)?;
    Ok(median(squares).sqrt())
}

/// The squared distances from the first `asked` positions to their fourth neighbours.
fn neighbor_squares(positions: &[Point], asked: usize) -> Option<Vec<f64>> {
    let tree = ImmutableKdTree::<f64, 3>::new_from_slice(positions).ok()?;
    let with_itself = NonZero::new(NEIGHBOR + 1)?;
    let farthest = |p: &Point| {
        let found = tree.query(p).nearest_n::<SquaredEuclidean<f64>>(with_itself).execute();
        found.last().map(|item| item.distance)
    };
    positions[..asked].iter().map(farthest).collect()
}

/// The lower median.
fn median(mut values: Vec<f64>) -> f64 {
    let middle = (values.len() - 1) / 2;
    *values.select_nth_unstable_by(middle, f64::total_cmp).1
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sample::mix;

    fn slow(positions: &[Point], p: &Point) -> f64 {
        let square = |q: &Point| (0..3).map(|k| (q[k] - p[k]).powi(2)).sum::<f64>();
        let mut squares: Vec<f64> = positions.iter().map(square).collect();
        squares.sort_by(f64::total_cmp);
        squares[NEIGHBOR]
    }

    /// Coordinates on `levels` levels an axis: many are equal.
    fn levels(count: u64, levels: [u64; 3]) -> Vec<Point> {
        let coordinate = |i: u64, k: usize| (mix(3 * i + k as u64) % levels[k]) as f64 / 1000.0;
        (0..count).map(|i| std::array::from_fn(|k| coordinate(i, k))).collect()
    }

    #[test]
    fn the_tree_finds_what_a_search_of_all_finds() {
        let shapes =
            [[1 << 40; 3], [30, 30, 3], [1000, 1, 1], [1, 1000, 1], [1, 1, 5000], [2, 2, 2000]];
        for shape in shapes {
            for count in [5, 31, 32, 33, 64, 65, 100, 1000, 5000] {
                let mut positions = sample(&levels(count, shape), count as usize, 0);
                positions.dedup();
                if positions.len() <= NEIGHBOR {
                    continue;
                }
                let asked = positions.len().min(300);
                let found = neighbor_squares(&positions, asked).unwrap();
                for (p, square) in positions.iter().zip(found) {
                    assert_eq!(square, slow(&positions, p), "{shape:?} {count}");
                }
            }
        }
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
}
