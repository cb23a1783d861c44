//! The ground as a gentle surface: it may slope, waver, be folded or stepped.
//!
//! Ground is what can be walked to from the level of the most ground cells: over slopes well below
//! any angle of repose, and across a step where the floor goes on behind it to the scan's edge.
//! Beneath everything else a film is stretched across.

use crate::count::to_f64;
use crate::error::{Error, Result};
use crate::film::Film;
use crate::heightmap::Grid;
use crate::piles::{FOUR, NOBODY, Territory, flood};
use crate::robust::scale;
use crate::slopes::Slopes;

/// The steepest ground, as rise over run: half the flattest angle of repose (15°).
pub(crate) const GENTLE: f64 = 0.13;
/// A riser is steeper than any bulk material lies: 60°, as run over rise.
const RISER: f64 = 0.577;

/// The ground of a height map.
#[derive(Debug, Clone, PartialEq)]
pub struct Terrain {
    /// Height of the ground in each cell: as seen, where it is ground; beneath what stands on it,
    /// a film across. Nowhere below the ground next to it, so that no riser stands out.
    pub surface_m: Vec<f64>,
    /// Standard deviation of the ground's cells about a film through them.
    pub noise_m: f64,
}

/// Finds the ground of a levelled height map; `level_m` is the height of most of it.
///
/// Where no cell near `level_m` lies gently, the ground is level.
///
/// # Errors
///
/// A number of heights that is not the number of cells.
pub fn terrain(grid: &Grid, heights_m: &[f64], level_m: f64, near_m: f64) -> Result<Terrain> {
    if heights_m.len() != grid.len() {
        return Err(Error::Degenerate("one height for each cell is needed"));
    }
    let slopes = Slopes::of(grid, heights_m);
    let fields = Fields::of(grid, &slopes);
    let ground = fields.ground(&slopes, heights_m, level_m, near_m);
    Ok(surface(grid, heights_m, &slopes, &ground, level_m))
}

/// A cell that lies in no field.
const NONE: usize = usize::MAX;

/// Connected cells that lie gently.
struct Fields<'a> {
    grid: &'a Grid,
    of: Vec<usize>,
    cells: Vec<Vec<usize>>,
}

impl<'a> Fields<'a> {
    fn of(grid: &'a Grid, slopes: &Slopes) -> Self {
        let mut fields = Self { grid, of: vec![NONE; grid.len()], cells: Vec::new() };
        for first in 0..grid.len() {
            if slopes.gentle[first] && fields.of[first] == NONE {
                fields.grow(first, slopes);
            }
        }
        fields
    }

    fn grow(&mut self, first: usize, slopes: &Slopes) {
        let field = self.cells.len();
        let (mut cells, mut next) = (vec![first], 0);
        self.of[first] = field;
        while next < cells.len() {
            for (dx, dy) in FOUR {
                let Some(n) = self.grid.neighbor(cells[next], dx, dy) else { continue };
                if slopes.gentle[n] && self.of[n] == NONE {
                    self.of[n] = field;
                    cells.push(n);
                }
            }
            next += 1;
        }
        self.cells.push(cells);
    }

    /// Which cells are ground: the field with most of it, those at its level to which a gentle
    /// slope leads, and those a step away.
    fn ground(&self, slopes: &Slopes, heights_m: &[f64], level_m: f64, near_m: f64) -> Vec<bool> {
        let near = |&&cell: &&usize| (slopes.means_m[cell] - level_m).abs() <= near_m;
        let counts: Vec<usize> = self.cells.iter().map(|c| c.iter().filter(near).count()).collect();
        let most = counts.iter().copied().max().unwrap_or(0);
        let main: Vec<bool> = counts.iter().map(|&n| n > 0 && n == most).collect();
        let nearest = self.nearest(&main);
        let level = |f: usize| {
            counts[f] > 0
                && 2 * counts[f] >= self.cells[f].len()
                && self.is_walked_to(f, slopes, &nearest)
        };
        let mut ground: Vec<bool> =
            (0..main.len()).map(|field| main[field] || level(field)).collect();
        let beyond = flood(self.grid, |cell| heights_m[cell].is_nan());
        let mut open: Vec<usize> = (0..self.cells.len())
            .filter(|&f| !ground[f] && self.reaches_edge(f, slopes.reach, &beyond))
            .collect();
        while let Some(i) = open.iter().position(|&f| self.is_a_step_away(f, slopes, &ground)) {
            ground[open.swap_remove(i)] = true;
        }
        self.of.iter().map(|&field| field != NONE && ground[field]).collect()
    }

    /// The nearest cell of the `main` fields to each cell, and how many steps it is away.
    fn nearest(&self, main: &[bool]) -> Territory {
        let label = |(&field, cell): (&usize, i32)| match main.get(field) {
            Some(true) => cell,
            _ => NOBODY,
        };
        let labels: Vec<i32> = self.of.iter().zip(0..).map(label).collect();
        let farthest = u32::try_from(self.grid.columns + self.grid.rows).unwrap_or(u32::MAX);
        Territory::grow(self.grid, &labels, farthest)
    }

    /// Whether a slope that is gentle leads to a field from the nearest cell of the main ones: a
    /// crest lies level, too, and where cells are large it is not far above the ground.
    fn is_walked_to(&self, field: usize, slopes: &Slopes, nearest: &Territory) -> bool {
        let first = self.cells[field].iter().min_by_key(|&&cell| nearest.steps[cell]);
        first.is_some_and(|&cell| {
            let Ok(from) = usize::try_from(nearest.owner[cell]) else { return false };
            let rise = (slopes.means_m[cell] - slopes.means_m[from]).abs();
            rise <= GENTLE * f64::from(nearest.steps[cell]) * self.grid.cell_m
        })
    }

    /// Whether a field goes on to the edge of what was seen.
    fn reaches_edge(&self, field: usize, reach: usize, beyond: &[bool]) -> bool {
        let ends = |cell: usize| {
            FOUR.iter().any(|&(dx, dy)| {
                let step = (reach + 1).cast_signed();
                self.grid.neighbor(cell, dx * step, dy * step).is_none_or(|n| beyond[n])
            })
        };
        self.cells[field].iter().any(|&cell| ends(cell))
    }

    /// Whether a riser leads from the ground to a field: a step that is low for the field's size,
    /// too short to be a flank, and about half as wide as the field at least.
    fn is_a_step_away(&self, field: usize, slopes: &Slopes, ground: &[bool]) -> bool {
        let size = to_f64(self.cells[field].len()).sqrt();
        let highest = GENTLE * size;
        let landing = |&&cell: &&usize| {
            FOUR.iter().any(|&way| self.riser(cell, way, slopes, ground, highest))
        };
        2.0 * to_f64(self.cells[field].iter().filter(landing).count()) >= size
    }

    /// Whether the ground lies across a riser of up to `highest` cells beside a field's cell.
    ///
    /// A window that touches the riser is not gentle, so the riser seems wider by a window.
    fn riser(
        &self,
        cell: usize,
        (dx, dy): (isize, isize),
        slopes: &Slopes,
        ground: &[bool],
        highest: f64,
    ) -> bool {
        let widest = 2 * slopes.reach + 2 + (RISER * highest) as usize;
        let found = (1..=widest.cast_signed())
            .map_while(|step| Some((step, self.grid.neighbor(cell, dx * step, dy * step)?)))
            .find(|&(_, n)| self.of[n] != NONE);
        let Some((run, there)) = found.filter(|&(_, n)| ground[self.of[n]]) else { return false };
        let rise = (slopes.means_m[cell] - slopes.means_m[there]).abs() / self.grid.cell_m;
        rise <= highest && run as f64 <= to_f64(2 * slopes.reach + 2) + RISER * rise
    }
}

fn surface(
    grid: &Grid,
    heights_m: &[f64],
    slopes: &Slopes,
    ground: &[bool],
    level_m: f64,
) -> Terrain {
    let seen: Vec<usize> =
        (0..grid.len()).filter(|&c| ground[c] && !heights_m[c].is_nan()).collect();
    let place = |&cell: &usize| {
        let [x, y] = grid.center(cell);
        [x, y, heights_m[cell] - level_m]
    };
    let points: Vec<[f64; 3]> = seen.iter().map(place).collect();
    let size = [grid.columns, grid.rows].map(|n| to_f64(n) * grid.cell_m);
    let film = Film::stretched(grid.origin_m, size, grid.cell_m, &points);
    let off = |p: &[f64; 3]| p[2] - film.at([p[0], p[1]]);
    let beside = beside(grid, heights_m, slopes.reach, ground);
    let height = |cell: usize| match heights_m[cell] {
        seen if ground[cell] && !seen.is_nan() => seen,
        _ => (level_m + film.at(grid.center(cell))).max(beside[cell]),
    };
    Terrain {
        surface_m: (0..grid.len()).map(height).collect(),
        noise_m: scale(points.iter().map(off)),
    }
}

/// The highest ground within a window's reach of each cell.
fn beside(grid: &Grid, heights_m: &[f64], reach: usize, ground: &[bool]) -> Vec<f64> {
    let highest = |a: f64, b: &f64| a.max(*b);
    let lowest = |(&height, &is): (&f64, &bool)| if is { height } else { f64::NEG_INFINITY };
    let heights: Vec<f64> = heights_m.iter().zip(ground).map(lowest).collect();
    let around = |at: usize, end: usize| at.saturating_sub(reach)..(at + reach + 1).min(end);
    let mut along = Vec::with_capacity(heights.len());
    for row in heights.chunks(grid.columns.max(1)) {
        let most = |at| row[around(at, row.len())].iter().fold(f64::NEG_INFINITY, highest);
        along.extend((0..row.len()).map(most));
    }
    let mut all = vec![f64::NEG_INFINITY; heights.len()];
    for (at, line) in all.chunks_mut(grid.columns.max(1)).enumerate() {
        for row in around(at, grid.rows) {
            let other = &along[row * grid.columns..][..grid.columns];
            line.iter_mut().zip(other).for_each(|(most, height)| *most = most.max(*height));
        }
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sample::mix;

    const CELL: f64 = 0.02;
    const GRID: Grid = Grid { origin_m: [0.0; 2], cell_m: CELL, columns: 120, rows: 90 };

    fn map(height: impl Fn(f64, f64) -> f64) -> Vec<f64> {
        let noise = |cell: u64| 0.002 * ((mix(cell) >> 11) as f64 / (1u64 << 53) as f64 - 0.5);
        let at = |cell: usize| {
            let [x, y] = GRID.center(cell);
            height(x, y) + noise(cell as u64)
        };
        (0..GRID.len()).map(at).collect()
    }

    fn cone(x: f64, y: f64) -> f64 {
        (0.45 * (0.5 - (x - 1.2).hypot(y - 0.9))).max(0.0)
    }

    /// Whether exactly the cells that stand 2 cm or more above the floor stand above the surface.
    fn only_stands(floor: impl Fn(f64, f64) -> f64, on_it: impl Fn(f64, f64) -> f64, level: f64) {
        let heights = map(|x, y| floor(x, y) + on_it(x, y));
        let terrain = terrain(&GRID, &heights, level, 0.01).unwrap();
        for (cell, (&height, surface)) in heights.iter().zip(&terrain.surface_m).enumerate() {
            let [x, y] = GRID.center(cell);
            let high = height > surface + 0.008;
            let stands = on_it(x, y);
            assert!(!high || stands > 0.0, "{x} {y}: {stands} is no object");
            assert!(high || stands < 0.05, "{x} {y}: {stands} is an object");
        }
        assert!(terrain.noise_m < 0.002, "{}", terrain.noise_m);
    }

    #[test]
    fn a_cone_stands_on_ground_of_any_gentle_form() {
        only_stands(|_, _| 0.5, cone, 0.5);
        only_stands(|x, y| 0.05 * x - 0.03 * y, cone, 0.0);
        only_stands(|x, y| 0.006 * (3.0 * x).sin() * (2.5 * y).cos(), cone, 0.0);
        only_stands(|x, _| 0.052 * (x - 1.1).max(0.0), cone, 0.0);
        only_stands(|x, _| -0.052 * (x - 1.1).max(0.0), cone, 0.0);
    }

    #[test]
    fn a_step_across_the_scan_is_ground_on_both_sides() {
        let step = |x: f64, _: f64| if x > 1.3 { 0.03 } else { 0.0 };
        only_stands(step, cone, 0.0);
        only_stands(step, cone, 0.03);
    }

    #[test]
    fn a_plate_amid_the_floor_and_a_heap_with_a_flat_top_are_no_ground() {
        let plate = |x: f64, y: f64| {
            if (0.6..1.6).contains(&x) && (0.4..1.2).contains(&y) { 0.06 } else { 0.0 }
        };
        only_stands(|_, _| 0.0, plate, 0.0);
        let heap = |x: f64, _: f64| (0.45 * (x - 1.2)).clamp(0.0, 0.08);
        only_stands(|_, _| 0.0, heap, 0.0);
    }

    #[test]
    fn a_crest_is_no_ground_however_near_to_its_level() {
        let blunt = |x: f64, y: f64| cone(x, y).min(0.12);
        let heights = map(blunt);
        let found = terrain(&GRID, &heights, 0.0, 0.5).unwrap();
        for (cell, &surface) in found.surface_m.iter().enumerate() {
            let [x, y] = GRID.center(cell);
            assert!(blunt(x, y) < 0.05 || surface < 0.02, "{x} {y}: {surface}");
        }
    }

    #[test]
    fn where_nothing_is_near_the_level_the_ground_is_level() {
        let heights = map(|x, _| 3.0 * x);
        let found = terrain(&GRID, &heights, 0.25, 0.01).unwrap();
        assert!(found.surface_m.iter().all(|&h| h == 0.25) && found.noise_m == 0.0);
        assert!(terrain(&GRID, &heights[1..], 0.25, 0.01).is_err());
    }
}
