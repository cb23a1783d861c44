//! An earlier scan of the empty floor, or a saved base, as what objects stand on.

use super::base::Base;
use super::territory::FOUR;
use crate::heightmap::{Grid, HeightMap, height_map_on};
use crate::robust::{median, scale};
use crate::{Error, Point, Result};

/// The noise of a cell less the mean of its four neighbours, in parts of a cell's own.
const OF_FOUR: f64 = 1.118;

/// A height for every cell of a grid.
#[derive(Debug, Clone, PartialEq)]
pub struct Surface {
    grid: Grid,
    heights_m: Vec<f64>,
    known: Vec<bool>,
    /// Standard deviation of a cell's height from the noise of the scan alone.
    pub noise_m: f64,
    /// Standard uncertainty of the height of a cell that was not seen.
    u_unknown_m: f64,
}

impl Surface {
    /// The surface through `points` on the cells of `grid`.
    ///
    /// A cell without points beside cells with some has their mean and counts as known: two grids
    /// never quite agree. All others lie on a film across what was seen, with the floor's own
    /// departures from a plane as their uncertainty.
    ///
    /// # Errors
    ///
    /// Too few points above or below the grid for a surface.
    pub fn through(points: &[Point], grid: Grid) -> Result<Self> {
        let mut map = height_map_on(points, grid);
        let noise_m = noise(&map);
        close_small_gaps(&mut map);
        let seen: Vec<Point> = (0..grid.len()).filter_map(|cell| place(&map, cell)).collect();
        let plane = Base::around(middle(&seen), &seen, grid.cell_m).ok_or(Error::TooFewPoints {
            what: "a surface that shares its place with the scan",
            given: seen.len(),
            needed: super::base::FEWEST,
        })?;
        let u_unknown_m = plane.noise_m;
        let film = plane.with_film(&grid, &seen);
        let known: Vec<bool> = map.heights_m.iter().map(|h| !h.is_nan()).collect();
        for (cell, height) in map.heights_m.iter_mut().enumerate().filter(|(_, h)| h.is_nan()) {
            *height = film.at(grid.center(cell));
        }
        Ok(Self { grid, heights_m: map.heights_m, known, noise_m, u_unknown_m })
    }

    /// Whether the surface rests on what was seen at a place of the grid.
    pub(crate) fn is_known(&self, p: [f64; 2]) -> bool {
        self.known[self.grid.cell(&p)]
    }

    pub(crate) fn at(&self, p: [f64; 2]) -> f64 {
        self.heights_m[self.grid.cell(&p)]
    }

    pub(crate) fn u_unknown_m(&self, p: [f64; 2]) -> f64 {
        if self.is_known(p) { 0.0 } else { self.u_unknown_m }
    }
}

fn place(map: &HeightMap, cell: usize) -> Option<Point> {
    let [x, y] = map.grid.center(cell);
    (!map.heights_m[cell].is_nan()).then_some([x, y, map.heights_m[cell]])
}

fn middle(seen: &[Point]) -> [f64; 2] {
    [0, 1].map(|k| median(seen.iter().map(|p| p[k]).collect()))
}

/// The heights of the four neighbours that were seen.
fn neighbors(map: &HeightMap, cell: usize) -> Vec<f64> {
    let next = FOUR.iter().filter_map(|&(dx, dy)| map.grid.neighbor(cell, dx, dy));
    next.map(|n| map.heights_m[n]).filter(|h| !h.is_nan()).collect()
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

/// The noise of a cell, from how far it stands off the mean of its neighbours: waves do not count.
fn noise(map: &HeightMap) -> f64 {
    let off = (0..map.grid.len()).filter_map(|cell| {
        let around = neighbors(map, cell);
        let off = map.heights_m[cell] - mean(&around);
        (around.len() == FOUR.len() && !off.is_nan()).then_some(off)
    });
    scale(off) / OF_FOUR
}

/// Gives cells without points the mean of two seen neighbours or more.
fn close_small_gaps(map: &mut HeightMap) {
    let gap = |cell: &usize| map.heights_m[*cell].is_nan();
    let closed: Vec<(usize, f64)> = (0..map.grid.len())
        .filter(gap)
        .map(|cell| (cell, neighbors(map, cell)))
        .filter(|(_, around)| around.len() > 1)
        .map(|(cell, around)| (cell, mean(&around)))
        .collect();
    closed.into_iter().for_each(|(cell, height)| map.heights_m[cell] = height);
}

#[cfg(test)]
mod tests {
    use super::*;

    const GRID: Grid = Grid { origin_m: [-4.0, 3.0], cell_m: 0.125, columns: 64, rows: 48 };

    fn points(height: impl Fn(f64, f64) -> f64) -> Vec<Point> {
        let at = |cell| GRID.center(cell);
        (0..GRID.len()).map(at).map(|[x, y]| [x, y, height(x, y)]).collect()
    }

    fn wave(x: f64, y: f64) -> f64 {
        0.7 + 0.02 * x + 0.01 * (x + 0.5 * y).sin()
    }

    #[test]
    fn cells_keep_their_height_and_a_single_gap_is_closed() {
        let mut floor = points(wave);
        floor.remove(20 * 64 + 20);
        let surface = Surface::through(&floor, GRID).unwrap();
        assert!((0..GRID.len()).all(|cell| surface.is_known(GRID.center(cell))));
        for p in points(wave) {
            assert!((surface.at([p[0], p[1]]) - p[2]).abs() < 1e-4);
        }
        assert!(surface.noise_m < 1e-4);
    }

    #[test]
    fn a_hole_is_crossed_and_paid_for() {
        let hole = |p: &Point| (p[0] - 1.0).hypot(p[1] - 6.0) < 0.8;
        let floor: Vec<Point> = points(wave).into_iter().filter(|p| !hole(p)).collect();
        let surface = Surface::through(&floor, GRID).unwrap();
        assert!((surface.at([1.0, 6.0]) - wave(1.0, 6.0)).abs() < 0.004);
        let u = surface.u_unknown_m([1.0, 6.0]);
        assert!(u > 0.002 && u < 0.02 && surface.u_unknown_m([-2.0, 4.0]) == 0.0, "{u}");
    }

    #[test]
    fn noise_is_told_from_waves_and_points_elsewhere_are_none() {
        let uniform = |i: u64| (crate::sample::mix(i) >> 11) as f64 / (1_u64 << 53) as f64;
        let mut rough = points(wave);
        (0..).zip(&mut rough).for_each(|(i, p)| p[2] += 0.006 * (uniform(i) - 0.5));
        let surface = Surface::through(&rough, GRID).unwrap();
        assert!((surface.noise_m / 0.0017 - 1.0).abs() < 0.25, "{}", surface.noise_m);
        let away: Vec<Point> = points(wave).iter().map(|p| [p[0] + 9.0, p[1], p[2]]).collect();
        let found = Surface::through(&away, GRID);
        assert!(matches!(found, Err(Error::TooFewPoints { given: 0, .. })));
    }
}
