//! Where the walk starts if no ground is in view: a filled bin, or a heap that fills the view or
//! was cut out of its surroundings.
//!
//! Method: the large connected components of the lowest layer become seeds. Heights in m.

use crate::connectivity::FOUR;
use crate::connectivity::components_joined;
use crate::count::to_f64;
use crate::heightmap::Grid;

/// A component is large from this share of the largest one, as the fill of a truck beside the floor
/// around it. Chosen on the scenes of `divespot evaluate`.
const LARGE: f64 = 0.1;

/// Adds the large connected components of the lowest layer without any seed to the seeds.
/// Neighbours whose heights differ by at most `reach_m` are connected.
pub(crate) fn seed(grid: &Grid, lowest_m: &[f64], reach_m: f64, seeds_m: &mut [f64]) {
    let known = lowest_m.iter().map(|h| !h.is_nan()).collect();
    let joined = |a: usize, b: usize| (lowest_m[b] - lowest_m[a]).abs() <= reach_m;
    let pieces = components_joined(grid, known, &FOUR, joined);
    let largest = pieces.iter().map(Vec::len).max().unwrap_or(0);
    let large = |piece: &&Vec<usize>| to_f64(piece.len()) > LARGE * to_f64(largest);
    for piece in pieces.iter().filter(large) {
        if piece.iter().all(|&cell| seeds_m[cell].is_nan()) {
            piece.iter().for_each(|&cell| seeds_m[cell] = lowest_m[cell]);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::surface_points;
    use super::*;
    use crate::Point;

    /// A cone that fills the view, and a lamp over it.
    fn scene() -> Vec<Point> {
        let at = |i: i32| 0.03 * (f64::from(i) + 0.5) - 1.5;
        let plan = |i: i32| (at(i % 100), at(i / 100));
        let cone = (0..10_000).map(plan).map(|(x, y)| [x, y, 2.0 - 0.6 * x.hypot(y)]);
        let lamp = (0..400).map(|i| [0.01 * f64::from(i % 20), 0.01 * f64::from(i / 20), 2.6]);
        cone.chain(lamp).collect()
    }

    #[test]
    fn a_heap_that_fills_the_view_has_a_surface_where_it_is_asked_for() {
        let points = scene();
        let count = |anywhere| {
            let on = surface_points(&points, 0.06, 0.001, anywhere).unwrap();
            [
                on[..10_000].iter().filter(|on| **on).count(),
                on[10_000..].iter().filter(|on| **on).count(),
            ]
        };
        assert_eq!(count(false), [0, 0]);
        assert_eq!(count(true), [10_000, 0]);
    }

    #[test]
    fn a_piece_of_a_tenth_of_the_largest_is_large() {
        let grid = Grid { origin_m: [0.0; 2], cell_m: 1.0, columns: 40, rows: 10 };
        let is_seeded = |cells: usize| {
            let height = |cell: usize| match (cell / 40, cell % 40) {
                (0..5, _) => 0.0,
                (9, column) if column < cells => 9.0,
                _ => f64::NAN,
            };
            let lowest_m: Vec<f64> = (0..grid.len()).map(height).collect();
            let mut seeds_m = vec![f64::NAN; grid.len()];
            seed(&grid, &lowest_m, 1.0, &mut seeds_m);
            !seeds_m[9 * 40].is_nan()
        };
        assert!(is_seeded(30) && !is_seeded(14));
    }
}
