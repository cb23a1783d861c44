//! Where a pile ends at the wall that it leans on.
//!
//! A cell before a wall holds points on the pile's surface and many more up the wall's face: their
//! mean is the height of neither. The face is where the points above the surface are, and the pile
//! goes on to it as it came: the cell counts by the share of it that lies before the face.

use std::collections::BTreeMap;

use super::base::{Kind, value, weighted_plane};
use super::patch::{Patch, Zone};
use super::region::{Part, Ring, moments, part};
use super::shape::STEEPEST;
use super::wall;
use crate::Point;
use crate::robust::{median, scale};

/// A face stands so many cells, at most, beyond the last that holds nothing but the pile.
const BEYOND: usize = 3;
/// The surface goes on as it is in the pile's cells so many columns and rows away.
const SUPPORT: usize = 5;
/// With fewer points, a face is not known.
const FEWEST: usize = 4;
/// Points on a wall's top are not on its face: only the lower half is taken.
const LOWER: f64 = 0.5;

/// The pile, continued to the faces of the walls it leans on.
///
/// `points` are those of the height map. Where no points tell where a face is, the pile stays.
pub(crate) fn continued_to_faces(mut patch: Patch, points: &[Point], margin_m: f64) -> Patch {
    if !wall::leans(&patch) {
        return patch;
    }
    let near = NearWalls::gather(&patch, points, margin_m);
    let ends: Vec<(usize, End)> =
        near.before_walls().filter_map(|cell| Some((cell, near.end(cell)?))).collect();
    for (cell, end) in ends {
        end.mark(&mut patch, cell);
    }
    patch
}

/// The points around a pile's walls, by cell.
struct NearWalls<'a> {
    patch: &'a Patch,
    points: BTreeMap<usize, Vec<Point>>,
    /// Cells at which a face may stand.
    near: Vec<bool>,
    /// Cells in which all there is can be the pile's surface.
    clean: Vec<bool>,
    margin_m: f64,
}

/// What is the pile's of a cell at a wall.
struct End {
    height_m: f64,
    part: Part,
}

impl End {
    /// Beyond the face the surface goes on too, so that slopes before it are the pile's.
    fn mark(self, patch: &mut Patch, cell: usize) {
        patch.heights_m[cell] = self.height_m;
        patch.walls[cell] = true;
        patch.zones[cell] = match patch.zones[cell] {
            _ if self.part.share == 0.0 => Zone::Outside,
            Zone::Core => Zone::Core,
            _ => Zone::Toe,
        };
        patch.count_part(cell, self.part);
    }
}

impl<'a> NearWalls<'a> {
    fn gather(patch: &'a Patch, points: &[Point], margin_m: f64) -> Self {
        let mut near = vec![false; patch.zones.len()];
        let walls = (0..near.len()).filter(|&cell| patch.walls[cell]);
        walls.flat_map(|cell| patch.around(cell, BEYOND)).for_each(|n| near[n] = true);
        let mut by_cell: BTreeMap<usize, Vec<Point>> = BTreeMap::new();
        for p in points.iter().filter(|p| patch.grid.holds(p)) {
            let cell = patch.grid.cell(p);
            if near[cell] {
                by_cell.entry(cell).or_default().push(*p);
            }
        }
        // Sums of numbers depend on their order, and the scan's must not matter.
        let key = |p: &Point| p.map(f64::to_bits);
        by_cell.values_mut().for_each(|points| points.sort_unstable_by_key(key));
        let clean = vec![false; near.len()];
        let walls = Self { patch, points: by_cell, near, clean, margin_m };
        let clean = (0..walls.near.len()).map(|cell| walls.is_clean(cell)).collect();
        Self { clean, ..walls }
    }

    /// Cells near the walls that hold something else than the pile, or nothing.
    fn before_walls(&self) -> impl Iterator<Item = usize> + '_ {
        let beside = |cell: usize| self.patch.around(cell, BEYOND).any(|n| self.clean[n]);
        (0..self.near.len()).filter(move |&c| self.near[c] && !self.clean[c] && beside(c))
    }

    /// Whether all there is in a cell can be the pile's surface.
    fn is_clean(&self, cell: usize) -> bool {
        let held = matches!(self.patch.zones[cell], Zone::Core | Zone::Toe);
        let seen = !self.patch.heights_m[cell].is_nan();
        held && seen && !self.patch.walls[cell] && !self.is_steep(cell)
    }

    /// Whether the points of a cell lie farther apart than on the steepest pile.
    fn is_steep(&self, cell: usize) -> bool {
        let heights = || self.points.get(&cell).into_iter().flatten().map(|p| p[2]);
        let relief = heights().fold(f64::MIN, f64::max) - heights().fold(f64::MAX, f64::min);
        relief > self.margin_m + STEEPEST * self.patch.grid.cell_m
    }

    fn end(&self, cell: usize) -> Option<End> {
        let surface = Surface::around(self, cell)?;
        let face = Face::of(&self.above(&surface, cell), surface.from)?;
        let grid = &self.patch.grid;
        let area = grid.cell_m * grid.cell_m;
        let [x, y] = grid.center(cell);
        let h = 0.5 * grid.cell_m;
        let square = vec![[x - h, y - h], [x + h, y - h], [x + h, y + h], [x - h, y + h]];
        let counted = part(moments(&face.before(&square), [x, y]), area);
        let is_cut = counted.share > 0.0 && counted.share < 1.0;
        let u_share = if is_cut { (face.spread_m / grid.cell_m).min(1.0) } else { 0.0 };
        Some(End { height_m: surface.at([x, y]), part: Part { u_share, ..counted } })
    }

    /// Points around a cell that lie above the pile's surface, below the wall's top.
    fn above(&self, surface: &Surface, cell: usize) -> Vec<[f64; 2]> {
        let heights = self.patch.around(cell, BEYOND).map(|n| self.patch.heights_m[n]);
        let top = heights.fold(f64::MIN, f64::max);
        let points = self.patch.around(cell, 1).filter_map(|n| self.points.get(&n)).flatten();
        let on_face = points.filter(|p| {
            let low = surface.at([p[0], p[1]]);
            p[2] > low + self.margin_m && p[2] < low + LOWER * (top - low)
        });
        on_face.map(|p| [p[0], p[1]]).collect()
    }
}

/// The pile's surface near a wall, as a plane.
struct Surface {
    plane: nalgebra::Vector3<f64>,
    center_m: [f64; 2],
    /// The middle of the cells it was taken from.
    from: [f64; 2],
}

impl Surface {
    /// The plane through the pile's cells near one, the nearest counting most.
    fn around(near: &NearWalls<'_>, cell: usize) -> Option<Self> {
        let (patch, center_m) = (near.patch, near.patch.grid.center(cell));
        let clean = patch.around(cell, SUPPORT).filter(|&n| near.clean[n]);
        let local = |n: usize| {
            let [x, y] = patch.grid.center(n);
            [x - center_m[0], y - center_m[1], patch.heights_m[n]]
        };
        let local: Vec<[f64; 3]> = clean.map(local).collect();
        let weights = local.iter().map(|p| 1.0 / (p[0] * p[0] + p[1] * p[1]));
        let plane = weighted_plane(&local, weights, Kind::Ring)?;
        let mean = |k: usize| local.iter().map(|p| p[k]).sum::<f64>() / local.len() as f64;
        let from = [center_m[0] + mean(0), center_m[1] + mean(1)];
        (plane[1].hypot(plane[2]) < STEEPEST).then_some(Self { plane, center_m, from })
    }

    fn at(&self, p: [f64; 2]) -> f64 {
        value(&self.plane, &[p[0] - self.center_m[0], p[1] - self.center_m[1], 0.0])
    }
}

/// The foot of a wall's face in plan, as a straight line.
struct Face {
    through: [f64; 2],
    /// Away from the pile.
    normal: [f64; 2],
    /// Standard deviation of the face's points across it.
    spread_m: f64,
}

impl Face {
    /// The line along which `points` lie, seen from a place on the pile.
    fn of(points: &[[f64; 2]], pile: [f64; 2]) -> Option<Self> {
        if points.len() < FEWEST {
            return None;
        }
        let mean = [0, 1].map(|k| points.iter().map(|p| p[k]).sum::<f64>() / points.len() as f64);
        let moment = |a: usize, b: usize| {
            points.iter().map(|p| (p[a] - mean[a]) * (p[b] - mean[b])).sum::<f64>()
        };
        let along = 0.5 * (2.0 * moment(0, 1)).atan2(moment(0, 0) - moment(1, 1));
        let across = [-along.sin(), along.cos()];
        let away =
            if dot(across, [mean[0] - pile[0], mean[1] - pile[1]]) < 0.0 { -1.0 } else { 1.0 };
        let normal = across.map(|v| away * v);
        let off = points.iter().map(|p| dot(normal, [p[0] - mean[0], p[1] - mean[1]]));
        let middle = median(off.clone().collect());
        let through = [mean[0] + middle * normal[0], mean[1] + middle * normal[1]];
        Some(Self { through, normal, spread_m: scale(off.map(|o| o - middle)) })
    }

    /// The part of an area that lies on the pile's side.
    fn before(&self, ring: &Ring) -> Ring {
        let off = |p: &[f64; 2]| dot(self.normal, [p[0] - self.through[0], p[1] - self.through[1]]);
        let mut kept = Vec::new();
        for (p, q) in ring.iter().zip(ring.iter().cycle().skip(1)) {
            let (a, b) = (off(p), off(q));
            if a <= 0.0 {
                kept.push(*p);
            }
            if a * b < 0.0 {
                kept.push([0, 1].map(|k| p[k] + a / (a - b) * (q[k] - p[k])));
            }
        }
        kept
    }
}

fn dot(a: [f64; 2], b: [f64; 2]) -> f64 {
    a[0] * b[0] + a[1] * b[1]
}

#[cfg(test)]
mod tests {
    use super::super::tests::{CELL, settings};
    use super::super::{Object, measure};
    use super::*;
    use crate::heightmap::height_map;

    const STEP: f64 = CELL / 3.0;

    fn cone(u: f64, v: f64) -> f64 {
        (0.5 * (1.2 - u.hypot(v))).max(0.0)
    }

    /// A cone against a wall whose face, turned in plan, lies `beyond` the cone's axis.
    fn leaning(turn: f64, beyond: f64) -> Vec<Point> {
        let (sin, cos) = turn.sin_cos();
        let plan = (0..384 * 288).map(|i| (f64::from(i % 384) + 0.5, f64::from(i / 384) + 0.5));
        let points = plan.filter_map(|(x, y)| {
            let (x, y) = (x * STEP, y * STEP);
            let u = (x - 4.0) * cos + (y - 3.0) * sin;
            let v = (y - 3.0) * cos - (x - 4.0) * sin;
            match u - beyond {
                off if off < 0.0 => Some([x, y, cone(u, v)]),
                off if off < 0.3 => Some([x, y, 1.0]),
                _ => None,
            }
        });
        let face = (0..200 * 40).map(|i| {
            let (v, z) = (f64::from(i / 40 - 100) * STEP, 0.025 * f64::from(i % 40));
            [4.0 + beyond * cos - v * sin, 3.0 + beyond * sin + v * cos, z]
        });
        let face = face.filter(|p| p[2] > cone(beyond, (p[0] - 4.0).hypot(p[1] - 3.0)));
        points.chain(face).collect()
    }

    /// The volume of the cone before the face, summed over a fine raster.
    fn truth(beyond: f64) -> f64 {
        let at = |i: i32| 0.01 * (f64::from(i) + 0.5) - 1.2;
        let column = |u: f64| (0..240).map(|j| cone(u, at(j))).sum::<f64>();
        let strip = 0.01 * (1.2 + beyond);
        (0..100).map(|i| column(strip * (f64::from(i) + 0.5) - 1.2) * strip * 0.01).sum()
    }

    fn pile(points: &[Point]) -> Object {
        let map = height_map(points, CELL).unwrap();
        let found = |(cell, &h): (usize, &f64)| {
            let [x, y] = map.grid.center(cell);
            let on_pile = h < 0.65 && (x - 4.0).hypot(y - 3.0) < 1.2;
            if h > 0.05 { i32::from(!on_pile) } else { -1 }
        };
        let labels: Vec<i32> = map.heights_m.iter().enumerate().map(found).collect();
        measure(&map.grid, &map.heights_m, &labels, points, &settings()).unwrap().remove(0)
    }

    #[test]
    fn a_pile_ends_at_the_face_wherever_it_runs_through_the_cells() {
        for (turn, beyond) in [(0.0, 0.3), (0.0, 0.34), (0.5, 0.33), (2.2, 0.5)] {
            let (object, truth) = (pile(&leaning(turn, beyond)), truth(beyond));
            let off = object.volume.net_m3() / truth - 1.0;
            assert!(off.abs() < 5e-3, "turned {turn}, {beyond} beyond: {off}");
            assert!(object.leans_on_wall && !object.touches_edge && object.reason.is_none());
        }
    }

    #[test]
    fn the_order_of_the_points_changes_no_bit() {
        let mut points = leaning(0.5, 0.33);
        let object = pile(&points);
        points.reverse();
        assert_eq!(object, pile(&points));
    }
}
