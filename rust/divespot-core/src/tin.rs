//! The height map of few points, in m: a triangulated irregular network (Delaunay), averaged over
//! cells.
//!
//! Where points are farther apart than cells, cells without a point would be gaps, and means over
//! the others would follow the density of the points. The linear surface between the points is
//! right for any density.

use spade::handles::{FaceHandle, InnerTag, VertexHandle};
use spade::{DelaunayTriangulation, HasPosition, Point2, Triangulation};

use crate::cancel::{Polled, poll};
use crate::error::{Error, Result};
use crate::heightmap::{Cells, Grid, HeightMap, bounds};
use crate::hypotenuse::Hypotenuse;
use crate::{Bounds, Point};

/// A triangle with an edge longer than this many spacings of the points around covers unseen
/// surface. Chosen: lower tears holes in uneven scans, higher bridges shadows.
const LONG: f64 = 5.0;
/// A vertex counts as sparse only if this many neighbours are as sparse; else it is an outlier.
/// Chosen: lower lets pairs of outliers bridge gaps, higher cuts off thin ends of scans.
const COMPANY: usize = 3;
/// Places along each side of a cell at which heights are taken and averaged. Chosen: one takes the
/// middle for the mean, more take time and memory with their square.
const PLACES: usize = 2;

/// The steepest triangle of a heap, as rise over run: 50°. A steeper one lies between two surfaces;
/// each place in it gets the height of the nearest corner.
const STEEPEST: f64 = 1.192;

struct Vertex(Point);

impl HasPosition for Vertex {
    type Scalar = f64;

    /// Called all the time while points are inserted, when no other code of this crate runs: the
    /// place to check for cancellation.
    fn position(&self) -> Point2<f64> {
        poll();
        Point2::new(self.0[0], self.0[1])
    }
}

type Network = DelaunayTriangulation<Vertex>;
type Face<'a> = FaceHandle<'a, InnerTag, Vertex, (), (), ()>;

/// The mean height, in each cell of width `cell_m`, of the linear surface between the points.
///
/// A cell's points count as one, at their mean. Cells outside the points, or in a hole that is wide
/// for the spacing around it, have no height. The same points give the same bits in any order.
///
/// # Errors
///
/// As [`crate::heightmap::height_map`].
///
/// # Examples
///
/// ```
/// use divespot_core::tin::height_map;
///
/// // Four corners of a roof that rises by 1 m over 1 m.
/// let corners = [[0.0, 0.0, 0.0], [1.0, 0.0, 1.0], [0.0, 1.0, 0.0], [1.0, 1.0, 1.0]];
/// let map = height_map(&corners, 0.1)?;
/// let middle = map.grid.columns / 2 + map.grid.columns * (map.grid.rows / 2);
/// assert!((map.heights_m[middle] - map.grid.center(middle)[0]).abs() < 0.05);
/// # Ok::<(), divespot_core::Error>(())
/// ```
pub fn height_map(points: &[Point], cell_m: f64) -> Result<HeightMap> {
    height_map_within(points, &bounds(points)?, cell_m)
}

/// As [`height_map`], on the cells over `bounds`, which hold all points.
///
/// # Errors
///
/// As [`height_map`].
pub fn height_map_within(points: &[Point], bounds: &Bounds, cell_m: f64) -> Result<HeightMap> {
    let cells = Cells::within(points, bounds, cell_m)?;
    let vertices = cells.means.iter().flatten().map(|&p| Vertex(p)).collect();
    let network = Network::bulk_load(vertices).map_err(|_| {
        Error::Degenerate(
            "coordinates are too large or too small to triangulate: lengths in m are needed",
        )
    })?;
    let spacings = spacings_of(&network);
    let mut lattice = Lattice::over(&cells.grid);
    for face in network.inner_faces().polled().filter(|face| seen(face, &spacings)) {
        lattice.draw(face.vertices().map(|v| v.data().0));
    }
    let heights_m = lattice.means();
    Ok(cells.with_heights(heights_m))
}

/// The spacing of the points at each vertex, in m.
///
/// It is the lower third of the vertex's edges, since beside a hole half of them may cross it. A
/// vertex is that sparse only if some neighbours are too: all edges of an outlier within a hole
/// cross it.
fn spacings_of(network: &Network) -> Vec<f64> {
    let own: Vec<f64> = network.vertices().polled().map(|vertex| lower_third(&vertex)).collect();
    let believed = network.vertices().polled().map(|vertex| {
        let mut around: Vec<f64> =
            vertex.out_edges().map(|edge| own[edge.to().fix().index()]).collect();
        around.sort_unstable_by(|a, b| b.total_cmp(a));
        let company = around.get(COMPANY - 1).copied().unwrap_or(0.0);
        own[vertex.fix().index()].min(company)
    });
    believed.collect()
}

fn lower_third(vertex: &VertexHandle<'_, Vertex>) -> f64 {
    let mut lengths: Vec<f64> = vertex.out_edges().map(|edge| edge.length_2().sqrt()).collect();
    lengths.sort_unstable_by(f64::total_cmp);
    lengths.get(lengths.len() / 3).copied().unwrap_or(0.0)
}

/// Whether a triangle is part of the seen surface.
///
/// Its edges are compared with the sparsest of its corners: where dense points border on sparse
/// ones, the triangles between are as long as those among the sparse. The rim of a hole is dense
/// all around.
fn seen(face: &Face<'_>, spacings: &[f64]) -> bool {
    let corners = face.vertices().map(|v| spacings[v.fix().index()]);
    let long = LONG * corners.into_iter().fold(0.0, f64::max);
    face.adjacent_edges().iter().all(|edge| edge.length_2() <= long * long)
}

/// Places at which the surface's height is taken, [`PLACES`] along each side of a cell.
struct Lattice<'a> {
    grid: &'a Grid,
    step_m: f64,
    columns: usize,
    /// Height at each place, and at the middle of its cell on the plane of the same triangle, in m.
    heights_m: Vec<[f64; 2]>,
}

impl<'a> Lattice<'a> {
    fn over(grid: &'a Grid) -> Self {
        let heights_m = vec![[f64::NAN; 2]; PLACES * PLACES * grid.len()];
        let step_m = grid.cell_m / PLACES as f64;
        Self { grid, step_m, columns: PLACES * grid.columns, heights_m }
    }

    /// Sets the places inside a triangle to the height of its plane.
    fn draw(&mut self, corners: [Point; 3]) {
        let [a, b, c] = corners;
        let double_area = cross(a, b, c);
        let weights = |p| [cross(b, c, p), cross(c, a, p), cross(a, b, p)];
        let plane = |p| (0..3).map(|k| weights(p)[k] * corners[k][2]).sum::<f64>() / double_area;
        let cliff = slope(corners) > STEEPEST;
        let (columns, rows) = (self.span(corners, 0), self.span(corners, 1));
        for row in rows.polled() {
            for column in columns.clone() {
                let p = [self.place(column, 0), self.place(row, 1), 0.0];
                if weights(p).iter().all(|w| w / double_area >= 0.0) {
                    let middle = [self.middle(column, 0), self.middle(row, 1), 0.0];
                    let heights =
                        if cliff { [nearest(corners, p)[2]; 2] } else { [plane(p), plane(middle)] };
                    self.heights_m[row * self.columns + column] = heights;
                }
            }
        }
    }

    /// The columns (`k` = 0) or rows (1) that a triangle may cover.
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)] // inside the grid
    fn span(&self, corners: [Point; 3], k: usize) -> std::ops::Range<usize> {
        let along = corners.map(|p| (p[k] - self.grid.origin_m[k]) / self.step_m - 0.5);
        let low = along.iter().copied().fold(f64::INFINITY, f64::min);
        let high = along.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let most = PLACES * [self.grid.columns, self.grid.rows][k];
        low.ceil().max(0.0) as usize..((high.floor() + 1.0).max(0.0) as usize).min(most)
    }

    fn place(&self, index: usize, k: usize) -> f64 {
        self.grid.origin_m[k] + (index as f64 + 0.5) * self.step_m
    }

    /// The middle of the cell of a place.
    fn middle(&self, index: usize, k: usize) -> f64 {
        self.grid.origin_m[k] + ((index / PLACES) as f64 + 0.5) * self.grid.cell_m
    }

    /// Mean of each cell's places, if at least half of them have a height. If some have none, the
    /// heights of the others are taken at the middle of the cell, on their triangles' planes.
    fn means(&self) -> Vec<f64> {
        let mean = |cell: usize| {
            let places = self.places(cell).map(|place| self.heights_m[place]);
            let drawn: Vec<[f64; 2]> = places.filter(|heights| !heights[0].is_nan()).collect();
            let which = usize::from(drawn.len() < PLACES * PLACES);
            let sum: f64 = drawn.iter().map(|heights| heights[which]).sum();
            if 2 * drawn.len() >= PLACES * PLACES { sum / drawn.len() as f64 } else { f64::NAN }
        };
        (0..self.grid.len()).map(mean).collect()
    }

    fn places(&self, cell: usize) -> impl Iterator<Item = usize> + '_ {
        let (column, row) = (cell % self.grid.columns, cell / self.grid.columns);
        let first = PLACES * (row * self.columns + column);
        (0..PLACES * PLACES).map(move |i| first + i / PLACES * self.columns + i % PLACES)
    }
}

/// Twice the signed area of the triangle, in m².
fn cross(a: Point, b: Point, c: Point) -> f64 {
    (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
}

/// Slope of the plane through the corners, as rise over run.
fn slope([a, b, c]: [Point; 3]) -> f64 {
    let [u, v] = [b, c].map(|p| [p[0] - a[0], p[1] - a[1], p[2] - a[2]]);
    let normal = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
    normal[0].hypotenuse(normal[1]) / normal[2].abs()
}

fn nearest(corners: [Point; 3], p: Point) -> Point {
    let distance = |q: &Point| (q[0] - p[0]).hypotenuse(q[1] - p[1]);
    let [a, b, c] = corners;
    let nearer = if distance(&b) < distance(&a) { b } else { a };
    if distance(&c) < distance(&nearer) { c } else { nearer }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::heightmap::integrate;
    use crate::sample::mix;

    fn random(count: u64, height: impl Fn(f64, f64) -> f64) -> Vec<Point> {
        let at = |i: u64| (mix(i) % 100_000) as f64 / 100_000.0;
        let scattered = (0..count).map(|i| [8.0 * at(2 * i), 6.0 * at(2 * i + 1)]);
        let corners = [[0.0, 0.0], [8.0, 0.0], [8.0, 6.0], [0.0, 6.0]];
        scattered.chain(corners).map(|[x, y]| [x, y, height(x, y)]).collect()
    }

    #[test]
    fn a_plane_through_sixty_points_is_itself_everywhere() {
        let plane = |x: f64, y: f64| 0.3 * x - 0.2 * y + 1.0;
        let map = height_map(&random(60, plane), 0.25).unwrap();
        let seen = (0..map.grid.len()).filter(|&cell| !map.heights_m[cell].is_nan());
        let inner = seen.filter(|&cell| !map.grid.is_border(cell));
        let off = inner.map(|cell| {
            let [x, y] = map.grid.center(cell);
            (map.heights_m[cell] - plane(x, y)).abs()
        });
        let off = off.fold(0.0, f64::max);
        assert!(off < 1e-9, "{off}");
        let volume = integrate(map.heights_m.iter().map(|h| h - 1.0), 0.25);
        assert!((volume.area_m2 - 48.0).abs() < 3.6, "{volume:?}");
    }

    #[test]
    fn a_cone_of_few_uneven_points_has_its_volume() {
        let cone = |x: f64, y: f64| (2.0 - 0.8 * (x - 4.0).hypot(y - 3.0)).max(0.0);
        let truth = std::f64::consts::PI * 6.25 * 2.0 / 3.0;
        let mut points = random(500, cone);
        points.extend(random(20_000, cone).into_iter().filter(|p| p[0] < 4.0));
        let volume = integrate(height_map(&points, 0.1).unwrap().heights_m, 0.1).net_m3();
        assert!((volume / truth - 1.0).abs() < 0.03, "{}", volume / truth);
    }

    #[test]
    fn a_hole_stays_a_hole_though_a_stray_lies_in_it() {
        let mut points = random(3000, |_, _| 1.0);
        points.retain(|p| (p[0] - 4.0).hypot(p[1] - 3.0) > 1.5);
        points.push([4.2, 2.9, 5.0]);
        let map = height_map(&points, 0.1).unwrap();
        for cell in 0..map.grid.len() {
            let [x, y] = map.grid.center(cell);
            let r = (x - 4.0).hypot(y - 3.0);
            assert!(r > 1.1 || map.heights_m[cell].is_nan(), "{x} {y} {}", map.heights_m[cell]);
        }
    }

    #[test]
    fn order_changes_no_bit_and_a_line_has_no_surface() {
        let mut points = random(200, |x, y| (x * y).sin());
        let first = height_map(&points, 0.2).unwrap();
        points.reverse();
        let second = height_map(&points, 0.2).unwrap();
        assert_eq!(
            first.heights_m.iter().map(|h| h.to_bits()).collect::<Vec<_>>(),
            second.heights_m.iter().map(|h| h.to_bits()).collect::<Vec<_>>()
        );
        let line: Vec<Point> = (0..9).map(|i| [f64::from(i), 2.0 * f64::from(i), 1.0]).collect();
        assert!(height_map(&line, 0.5).unwrap().heights_m.iter().all(|h| h.is_nan()));
        assert!(height_map(&[], 0.5).is_err());
    }

    /// The height that a map of these points has at a place.
    fn height_at(points: &[Point], cell_m: f64, x: f64, y: f64) -> f64 {
        let map = height_map(points, cell_m).unwrap();
        map.heights_m[map.grid.cell(&[x, y])]
    }

    #[test]
    fn what_is_five_spacings_wide_was_not_seen() {
        let crossed = |gap: f64| {
            let at = |i: i32| if i < 6 { f64::from(i) } else { f64::from(i - 6) + 5.0 + gap };
            let points: Vec<Point> =
                (0..144).map(|i| [at(i % 12), f64::from(i / 12), 1.0]).collect();
            height_at(&points, 0.5, 5.0 + 0.5 * gap, 5.5) == 1.0
        };
        assert!(crossed(4.0) && !crossed(7.0));
    }

    #[test]
    fn three_neighbours_as_sparse_are_no_strays() {
        let dense = (0..21 * 61).map(|i| [0.1 * f64::from(i % 21), 0.1 * f64::from(i / 21), 1.0]);
        let ladder = (0..14).map(|i| [4.0 + f64::from(i % 2), f64::from(i / 2), 1.0]);
        let points: Vec<Point> = dense.chain(ladder).collect();
        assert_eq!(height_at(&points, 0.1, 4.5, 3.1), 1.0);
    }

    #[test]
    fn what_is_steeper_than_50_degrees_is_a_step() {
        let quarter = |slope: f64| {
            let corners = [[0.0, 0.0, 0.0], [1.0, 0.0, slope], [0.0, 1.0, 0.0], [1.0, 1.0, slope]];
            height_at(&corners, 0.1, 0.25, 0.5) / slope
        };
        assert!(quarter(1.0) > 0.15 && quarter(1.6) == 0.0);
    }
}
