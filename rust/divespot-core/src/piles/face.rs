//! Continues a pile to the faces of the walls it leans on.
//!
//! A cell at a face holds points of the pile's surface and many more of the face. There the pile's
//! height is extrapolated by a plane, and the cell counts by the share of its area before the line
//! of the face. The line is fitted to the face's points in plan. Lengths in m.

use super::axis::{dot, main_axis};
use super::base::Base;
use super::coverage::{Coverage, Ring, moments, part};
use super::faces::BEYOND;
use super::scene::Scene;
use super::standing::FEWEST;
use super::wall;
use super::window::{Window, Zone};
use crate::Point;
use crate::cancel::Polled;
use crate::count::to_f64;
use crate::hypotenuse::Hypotenuse;
use crate::material::NEVER_STEEPER;
use crate::near_plane::{near_plane, places_about, value};
use crate::robust::{median, scale};

/// The pile's plane is fitted to its cells within this many columns and rows. Chosen: fewer follow
/// noise, more round off the pile before the wall.
const SUPPORT: usize = 5;
/// Largest scatter of a face's points, as a share of a cell's width, with which the face may clip
/// cells that look like the pile's surface. Chosen on the scenes of `divespot evaluate`.
const SHARP: f64 = 0.5;
/// A face leans if its lean is significant by this many standard deviations. Chosen: lower leans
/// upright walls by their noise, higher makes leaning ones upright.
const SIGMAS: f64 = 3.0;
/// A face that leans by fewer cells over its height is an upright one, rounded off by
/// photogrammetry. Chosen on the scenes of `divespot evaluate`.
const LEANING: f64 = 2.1;
/// Standard deviation of where the face runs in a rounded edge, as a share of the edge's width: a
/// triangular distribution about its middle (GUM 4.3.9), 1/√24.
const ROUNDED: f64 = 0.204;
/// Share of the wall's height, from below, whose points are taken for the face: those on its top
/// are not on the face. Chosen: half; lower leaves few points, higher takes in a rounded top.
const LOWER: f64 = 0.5;

/// The pile, continued to the faces of the walls it leans on.
///
/// It stays as it is where too few points show a face.
pub(crate) fn continued_to_faces(
    mut window: Window,
    scene: &Scene<'_>,
    base: &Base,
    margin_m: f64,
) -> Window {
    if !wall::leans(&window) {
        return window;
    }
    let near = NearWalls::of(&window, scene, base, margin_m);
    let ends: Vec<(usize, End)> =
        near.before_walls().polled().filter_map(|cell| Some((cell, near.end(cell)?))).collect();
    for (cell, end) in ends {
        end.mark(&mut window, cell);
    }
    window
}

/// The surroundings of a pile's walls.
struct NearWalls<'a> {
    window: &'a Window,
    scene: &'a Scene<'a>,
    base: &'a Base,
    /// Cells at which a face may stand.
    near: Vec<bool>,
    /// Cells beside walls.
    beside: Vec<bool>,
    /// Cells that hold only points of the pile's surface.
    clean: Vec<bool>,
    margin_m: f64,
}

/// The pile's part of a cell at a wall.
struct End {
    height_m: f64,
    part: Coverage,
}

impl End {
    /// The height is extrapolated past the face too, so that slopes before it are the pile's own.
    fn mark(self, window: &mut Window, cell: usize) {
        window.heights_m[cell] = self.height_m;
        window.walls[cell] = true;
        window.zones[cell] = match window.zones[cell] {
            _ if self.part.share == 0.0 => Zone::Outside,
            Zone::Core => Zone::Core,
            _ => Zone::Toe,
        };
        window.count_part(cell, self.part);
    }
}

impl<'a> NearWalls<'a> {
    fn of(window: &'a Window, scene: &'a Scene<'a>, base: &'a Base, margin_m: f64) -> Self {
        let near = |reach: usize| -> Vec<bool> {
            (0..window.zones.len())
                .map(|c| window.around(c, reach).any(|n| window.walls[n]))
                .collect()
        };
        let clean = |cell: usize| {
            window.zones[cell] == Zone::Core
                && !window.heights_m[cell].is_nan()
                && !window.walls[cell]
                && !window.mixed[cell]
        };
        let clean = (0..window.zones.len()).map(clean).collect();
        Self { window, scene, base, near: near(BEYOND), beside: near(1), clean, margin_m }
    }

    /// Cells near the walls that are unseen or hold other points than the pile's, and cells beside
    /// walls, which may hold points of their faces only.
    fn before_walls(&self) -> impl Iterator<Item = usize> + '_ {
        let beside = |cell: usize| self.window.around(cell, BEYOND).any(|n| self.clean[n]);
        let at_wall = |&cell: &usize| !self.clean[cell] || self.beside[cell];
        (0..self.near.len()).filter(move |&c| self.near[c] && beside(c)).filter(at_wall)
    }

    fn end(&self, cell: usize) -> Option<End> {
        let surface = Surface::around(self, cell)?;
        let grid = &self.window.grid;
        let top_m = self.top_m(cell);
        let face = Face::of(&self.above(&surface, cell, top_m), surface.from)?;
        if self.clean[cell] && face.spread_m > SHARP * grid.cell_m {
            return None;
        }
        let area = grid.cell_m * grid.cell_m;
        let [x, y] = grid.center(cell);
        let h = 0.5 * grid.cell_m;
        let square = vec![[x - h, y - h], [x + h, y - h], [x + h, y + h], [x - h, y + h]];
        let height_m = surface.at([x, y]);
        // A leaning face continues down to the base, so on average it runs halfway between base and
        // surface. A rounded one most likely runs through the middle of its edge.
        let run_m = face.leans * (top_m - height_m);
        let leans = run_m > LEANING * grid.cell_m;
        let end_m = if leans { self.base.at([x, y]) } else { top_m };
        let before = face.before(&square, 0.5 * (height_m + end_m));
        let counted = part(moments(&before, [x, y]), area);
        let is_cut = counted.share > 0.0 && counted.share < 1.0;
        let u_m = if leans { face.spread_m } else { face.spread_m.hypotenuse(ROUNDED * run_m) };
        let u_share = if is_cut { (u_m / grid.cell_m).min(1.0) } else { 0.0 };
        Some(End { height_m, part: Coverage { u_share, ..counted } })
    }

    /// Height of the highest point off the surface near a cell, in m.
    fn top_m(&self, cell: usize) -> f64 {
        self.over(cell, BEYOND).map(|p| p[2]).fold(f64::MIN, f64::max)
    }

    fn over(&self, cell: usize, reach: usize) -> impl Iterator<Item = &Point> {
        let grid = &self.scene.grid;
        let cells = self.window.around(cell, reach);
        cells.flat_map(|n| self.scene.faces.over(grid.cell(&self.window.grid.center(n))))
    }

    /// Points around a cell above the pile's surface, in the lower part of the wall.
    fn above(&self, surface: &Surface, cell: usize, top_m: f64) -> Vec<Point> {
        let on_face = |p: &&Point| {
            let low = surface.at([p[0], p[1]]);
            p[2] > low + self.margin_m && p[2] < low + LOWER * (top_m - low)
        };
        let within = |reach| self.over(cell, reach).filter(on_face).copied().collect();
        let mut near = (1..=BEYOND).map(within);
        near.find(|points: &Vec<Point>| points.len() >= FEWEST).unwrap_or_default()
    }
}

/// The pile's surface near a wall, as a plane.
struct Surface {
    plane: nalgebra::Vector3<f64>,
    center_m: [f64; 2],
    /// The middle of the cells that the plane was fitted to.
    from: [f64; 2],
}

impl Surface {
    /// The plane through the pile's cells around `cell`; near cells have more weight.
    fn around(near: &NearWalls<'_>, cell: usize) -> Option<Self> {
        let (window, center_m) = (near.window, near.window.grid.center(cell));
        let clean = window.around(cell, SUPPORT).filter(|&n| near.clean[n] && !near.beside[n]);
        let local = places_about(&window.grid, &window.heights_m, cell, clean);
        let plane = near_plane(&local)?;
        let mean = |k: usize| local.iter().map(|p| p[k]).sum::<f64>() / local.len() as f64;
        let from = [center_m[0] + mean(0), center_m[1] + mean(1)];
        (plane[1].hypotenuse(plane[2]) < NEVER_STEEPER).then_some(Self { plane, center_m, from })
    }

    fn at(&self, p: [f64; 2]) -> f64 {
        value(&self.plane, &[p[0] - self.center_m[0], p[1] - self.center_m[1], 0.0])
    }
}

/// A wall's face: straight in plan, upright or leaning back.
struct Face {
    /// A point on it.
    through: Point,
    /// Its unit normal in plan, away from the pile.
    normal: [f64; 2],
    /// Its lean: distance back for each metre of height.
    leans: f64,
    /// Standard deviation of the points across the face, in m.
    spread_m: f64,
}

impl Face {
    /// The face through `points`, for a pile on the side of `pile`.
    fn of(points: &[Point], pile: [f64; 2]) -> Option<Self> {
        if points.len() < FEWEST {
            return None;
        }
        let count = to_f64(points.len());
        let mean = [0, 1, 2].map(|k| points.iter().map(|p| p[k]).sum::<f64>() / count);
        let moment = |a: usize, b: usize| {
            points.iter().map(|p| (p[a] - mean[a]) * (p[b] - mean[b])).sum::<f64>()
        };
        let (_, [x, y]) = main_axis(points.iter().map(|p| [p[0], p[1]]));
        let across = [-y, x];
        let away =
            if dot(across, [mean[0] - pile[0], mean[1] - pile[1]]) < 0.0 { -1.0 } else { 1.0 };
        let normal = across.map(|v| away * v);
        let rising = moment(2, 2);
        let leans = dot(normal, [moment(0, 2), moment(1, 2)]) / rising;
        let off = |p: &Point, leans: f64| {
            dot(normal, [p[0] - mean[0], p[1] - mean[1]]) - leans * (p[2] - mean[2])
        };
        let spread_m = scale(points.iter().map(|p| off(p, leans)));
        let leans = if leans * rising.sqrt() > SIGMAS * spread_m { leans } else { 0.0 };
        let off = points.iter().map(|p| off(p, leans));
        let middle = median(off.clone().collect());
        let through = [mean[0] + middle * normal[0], mean[1] + middle * normal[1], mean[2]];
        Some(Self { through, normal, leans, spread_m: scale(off.map(|o| o - middle)) })
    }

    /// The part of an area on the pile's side of the face at a height.
    fn before(&self, ring: &Ring, height_m: f64) -> Ring {
        let back_m = self.leans * (height_m - self.through[2]);
        let off = |p: &[f64; 2]| {
            dot(self.normal, [p[0] - self.through[0], p[1] - self.through[1]]) - back_m
        };
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

#[cfg(test)]
pub(crate) mod tests {
    use super::super::tests::{CELL, settings};
    use super::super::{Found, Object, measure};
    use super::*;
    use crate::heightmap::{bounds, height_map_within};
    use crate::surface::{Hills, hills, surface_points};

    const STEP: f64 = CELL / 3.0;

    fn cone(u: f64, v: f64) -> f64 {
        (0.5 * (1.2 - u.hypot(v))).max(0.0)
    }

    /// A cone against a wall whose face, rotated in plan, lies `beyond` m from the cone's axis.
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

    /// Volume of the cone before the face in m³, summed over a fine raster.
    fn truth(beyond: f64) -> f64 {
        let at = |i: i32| 0.01 * (f64::from(i) + 0.5) - 1.2;
        let column = |u: f64| (0..240).map(|j| cone(u, at(j))).sum::<f64>();
        let strip = 0.01 * (1.2 + beyond);
        (0..100).map(|i| column(strip * (f64::from(i) + 0.5) - 1.2) * strip * 0.01).sum()
    }

    pub(crate) fn pile(points: &[Point]) -> Object {
        objects(points).remove(0)
    }

    pub(crate) fn objects(points: &[Point]) -> Vec<Object> {
        let kept = surface_points(points, CELL, 0.0, false).unwrap();
        let on =
            |is: bool| points.iter().zip(&kept).filter(move |(_, k)| **k == is).map(|(p, _)| *p);
        let surface: Vec<Point> = on(true).collect();
        let all = bounds(points).unwrap();
        let map = height_map_within(&surface, &all, CELL).unwrap();
        let Hills { labels, ground, .. } = hills(&map.grid, &map.heights_m).unwrap();
        let found = Found {
            labels,
            ground,
            surface: surface.into(),
            loose: on(false).collect(),
            apart: Vec::new(),
        };
        measure(&map.grid, &map.heights_m, &found, &settings()).unwrap()
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

    /// A cone against a face that leans back by 0.3 m for each metre of height.
    fn leaning_back(beyond: f64) -> (Vec<Point>, f64) {
        let lean = 0.3;
        let bank = move |u: f64| ((u - beyond) / lean).clamp(0.0, 1.0);
        let plan = (0..384 * 288).map(|i| (f64::from(i % 384) + 0.5, f64::from(i / 384) + 0.5));
        let surface = plan.map(|(x, y)| {
            let (u, v) = (x * STEP - 4.0, y * STEP - 3.0);
            [x * STEP, y * STEP, cone(u, v).max(bank(u))]
        });
        let at = |i: i32| 0.01 * (f64::from(i) + 0.5) - 1.2;
        let material = |u: f64, v: f64| (cone(u, v) - bank(u)).max(0.0);
        let column = |u: f64| (0..240).map(|j| material(u, at(j))).sum::<f64>() * 1e-4;
        (surface.collect(), (0..240).map(|i| column(at(i))).sum())
    }

    #[test]
    fn a_face_that_leans_back_leaves_less_of_the_pile() {
        for beyond in [0.3, 0.33, 0.5] {
            let (points, truth) = leaning_back(beyond);
            let object = pile(&points);
            let off = object.volume.net_m3() / truth - 1.0;
            assert!(off.abs() < 0.01, "{beyond} beyond: {off}");
        }
    }

    /// The cone seen from above, against an edge that photogrammetry has rounded over two cells.
    fn rounded(beyond: f64) -> Vec<Point> {
        let plan = (0..384 * 288).map(|i| [f64::from(i % 384) + 0.5, f64::from(i / 384) + 0.5]);
        let surface = plan.filter_map(|[x, y]| {
            let (u, v) = (x * STEP - 4.0, y * STEP - 3.0);
            let of_wall = ((u - beyond) / (2.0 * CELL) + 0.5).clamp(0.0, 1.0);
            let height = cone(u, v) * (1.0 - of_wall) + of_wall;
            (u - beyond < 0.3).then_some([x * STEP, y * STEP, height])
        });
        surface.collect()
    }

    #[test]
    fn where_edges_are_rounded_the_face_runs_halfway_up() {
        for beyond in [0.3, 0.33, 0.36] {
            let (object, truth) = (pile(&rounded(beyond)), truth(beyond));
            let off = object.volume.net_m3() - truth;
            assert!(off.abs() < 0.015 * truth, "{beyond} beyond: {off} of {truth}");
            assert!(off.abs() < 2.0 * object.budget.combined_m3(), "{beyond} beyond: {off}");
        }
    }

    #[test]
    fn the_order_of_the_points_changes_no_bit() {
        let mut points = leaning(0.5, 0.33);
        let object = pile(&points);
        points.reverse();
        assert_eq!(object, pile(&points));
    }

    /// How a face of 20 rows of points leans that scatter by a centimetre to either side of it; its
    /// lean is so many standard deviations of what that may look like.
    fn lean(times: f64) -> f64 {
        let rising: f64 = (0..20).map(|i| 2.0 * (0.05 * (f64::from(i) - 9.5)).powi(2)).sum();
        let leans = times * 1.4826 * 0.01 / rising.sqrt();
        let point = |k: i32| {
            let (row, side) = (k / 2, f64::from(k % 2) - 0.5);
            [
                0.05 * leans * f64::from(row) + 0.02 * side,
                0.1 * f64::from(row * 7 % 20),
                0.05 * f64::from(row),
            ]
        };
        Face::of(&(0..40).map(point).collect::<Vec<_>>(), [-9.0, 1.0]).unwrap().leans / leans
    }

    #[test]
    fn a_face_leans_if_that_shows_by_three_standard_deviations() {
        assert!((lean(4.2) - 1.0).abs() < 0.2 && lean(2.2) == 0.0, "{} {}", lean(4.2), lean(2.2));
    }

    #[test]
    fn in_a_rounded_edge_the_face_runs_most_likely_in_the_middle() {
        let before: f64 = (-240..240).map(|i| cone(0.33, 0.005 * f64::from(i)) * 0.005).sum();
        let u_m = pile(&rounded(0.33)).budget.footprint_m3 / before;
        // Triangular over two cells.
        let ratio = u_m / (2.0 * CELL / 24.0_f64.sqrt());
        assert!((0.7..1.4).contains(&ratio), "{ratio}");
    }
}
