//! Finds the approximate pose of a frame on the model without a start: heights above the floor,
//! compared over a grid of translations and rotations.

use std::collections::BTreeMap;

use nalgebra::{Matrix3, Vector3};

use super::model::Surfel;
use super::motion::Motion;
use super::patches::Patch;

/// Width of a cell, as a share of the range. Chosen: the search must end within the reach of
/// registration; wider loses small piles, half takes sixteen times as long (closed form).
const CELL: f64 = 0.035;
/// Largest translation, as a share of the range, and the rotations tried, in degrees. Chosen:
/// frames farther off hardly overlap; more take time in proportion.
const FARTHEST: f64 = 0.8;
const TURNS_DEG: [f64; 7] = [0.0, -6.0, 6.0, -12.0, 12.0, -20.0, 20.0];
/// Least share of a frame's cells that overlap with the model. Chosen: lower finds chance agreement
/// at the model's rim, higher misses fast motions.
const OVERLAP: f64 = 0.3;
/// Cap on height differences, as a share of the range: 5 cm at 1 m. Chosen: higher lets a person in
/// the view decide, lower makes piles as good as noise.
const CAP: f64 = 0.05;
/// Cost of a translation, as a share of its length, so that the smallest wins where heights do not
/// decide. Chosen below the differences that a pile makes: higher keeps frames where they were
/// expected.
const PULL: f64 = 5e-4;

/// The pose near `expected` at which the heights of a frame agree best with the model.
///
/// The model's floor is z = 0; `level` moves the frame's own floor onto it.
pub(crate) fn search(
    surfels: &[Surfel],
    patches: &[Patch],
    level: &Motion,
    expected: &Motion,
    range_m: f64,
) -> Option<Motion> {
    let cell_m = CELL * range_m;
    let model = grid(surfels.iter().map(|s| s.at), cell_m);
    let heading = turn_about_z(&(expected.rotation * level.rotation.transpose()));
    let mut best: Option<(f64, Motion)> = None;
    for degrees in TURNS_DEG {
        let rotation = about_z(degrees.to_radians()) * heading;
        let turned = Motion { rotation, shift: Vector3::zeros() }.after(level);
        let frame = grid(patches.iter().map(|p| turned.apply(&p.at)), cell_m);
        let offset = expected.shift - turned.shift;
        let start = [(offset.x / cell_m).round() as i32, (offset.y / cell_m).round() as i32];
        if let Some((cost, shift)) = best_shift(&model, &frame, start, range_m) {
            let cost = cost + PULL * degrees.to_radians().abs() * range_m;
            if best.as_ref().is_none_or(|(least, _)| cost < *least) {
                let shift = Vector3::new(f64::from(shift[0]), f64::from(shift[1]), 0.0) * cell_m;
                best = Some((cost, Motion { shift: turned.shift + shift, ..turned }));
            }
        }
    }
    best.map(|(_, pose)| pose)
}

type Grid = BTreeMap<[i32; 2], f64>;

/// Mean heights of the cells.
fn grid(places: impl Iterator<Item = Vector3<f64>>, cell_m: f64) -> Grid {
    let mut sums: BTreeMap<[i32; 2], (f64, f64)> = BTreeMap::new();
    for p in places {
        let cell = [(p.x / cell_m).floor() as i32, (p.y / cell_m).floor() as i32];
        let sum = sums.entry(cell).or_default();
        *sum = (sum.0 + p.z, sum.1 + 1.0);
    }
    sums.into_iter().map(|(cell, (sum, count))| (cell, sum / count)).collect()
}

/// A rectangle of heights, NaN where unknown.
struct Dense {
    low: [i32; 2],
    size: [i32; 2],
    heights: Vec<f64>,
}

impl Dense {
    fn of(grid: &Grid) -> Option<Self> {
        let span = |k: usize| {
            let cells = grid.keys().map(|cell| cell[k]);
            Some((cells.clone().min()?, cells.max()?))
        };
        let ((x0, x1), (y0, y1)) = (span(0)?, span(1)?);
        let (low, size) = ([x0, y0], [x1 - x0 + 1, y1 - y0 + 1]);
        let mut heights = vec![f64::NAN; size[0] as usize * size[1] as usize];
        for (cell, &z) in grid {
            heights[((cell[1] - y0) * size[0] + cell[0] - x0) as usize] = z;
        }
        Some(Self { low, size, heights })
    }

    #[inline]
    fn at(&self, x: i32, y: i32) -> Option<f64> {
        let (x, y) = (x - self.low[0], y - self.low[1]);
        let inside = x >= 0 && y >= 0 && x < self.size[0] && y < self.size[1];
        inside.then(|| self.heights[(y * self.size[0] + x) as usize]).filter(|z| !z.is_nan())
    }
}

fn best_shift(
    model: &Grid,
    frame: &Grid,
    start: [i32; 2],
    range_m: f64,
) -> Option<(f64, [i32; 2])> {
    let model = Dense::of(model)?;
    let cells: Vec<([i32; 2], f64)> = frame.iter().map(|(cell, &z)| (*cell, z)).collect();
    let far = (FARTHEST / CELL) as i32;
    let mut best: Option<(f64, [i32; 2])> = None;
    for dy in -far..=far {
        crate::cancel::poll();
        for dx in -far..=far {
            let shift = [start[0] + dx, start[1] + dy];
            let (mut sum, mut count) = (0.0, 0);
            for &([x, y], z) in &cells {
                if let Some(height) = model.at(x + shift[0], y + shift[1]) {
                    let off = (height - z).abs();
                    sum += if off < CAP * range_m { off } else { CAP * range_m };
                    count += 1;
                }
            }
            if f64::from(count) < OVERLAP * cells.len() as f64 {
                continue;
            }
            let away = f64::from(dx * dx + dy * dy).sqrt() * CELL;
            let cost = sum / f64::from(count) + PULL * away * range_m;
            if best.is_none_or(|(least, _)| cost < least) {
                best = Some((cost, shift));
            }
        }
    }
    best
}

/// The part of a rotation about z.
fn turn_about_z(rotation: &Matrix3<f64>) -> Matrix3<f64> {
    about_z(libm::atan2(rotation[(1, 0)], rotation[(0, 0)]))
}

fn about_z(angle: f64) -> Matrix3<f64> {
    super::motion::turn(&(Vector3::z() * angle))
}
