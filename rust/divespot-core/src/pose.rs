//! Levels a scan (paper, Algorithm 2, lines 4 to 6): the ground's normal is rotated onto +z.

use nalgebra::{Matrix3, Rotation3, Unit, Vector3};

use crate::error::{Error, Result};
use crate::parallel::{fill_chunks, map_chunks};
use crate::{Bounds, Places, Point, thread_count};

/// Points for a thread at a time. Decides no answer.
const CHUNK: usize = 1 << 14;
/// Sine of the angle to the z axis below which no rotation is needed: rounding.
const PARALLEL: f64 = 1e-14;

/// A rotation as its three rows; `rotation · p` for a column vector.
pub type Rotation = [[f64; 3]; 3];

/// The shortest rotation of `normal` onto +z (Rodrigues' formula).
///
/// The axis is the unit vector along `normal × z`, not z itself as printed in the paper. A normal
/// along z needs no rotation; one along -z is rotated about x, since all axes are equally short.
///
/// # Errors
///
/// A normal of length zero or with non-finite components.
///
/// # Examples
///
/// ```
/// use divespot_core::pose::{rotate, rotation_to_z};
///
/// let rotation = rotation_to_z([2.0, 0.0, 0.0])?;
/// let turned = rotate(&[[1.0, 0.0, 0.0]], &rotation, 1);
/// assert!((turned[0][2] - 1.0).abs() < 1e-12);
/// # Ok::<(), divespot_core::Error>(())
/// ```
pub fn rotation_to_z(normal: Point) -> Result<Rotation> {
    let normal = Vector3::from(normal);
    let unit = Unit::try_new(normal / normal.amax(), 0.0)
        .filter(|unit| unit.iter().all(|v| v.is_finite()))
        .ok_or(Error::Degenerate(
            "the normal is no direction: finite components that are not all zero are needed",
        ))?;
    let across = unit.cross(&Vector3::z());
    let rotation = match Unit::try_new(across, PARALLEL) {
        Some(axis) => Rotation3::from_axis_angle(&axis, libm::atan2(across.norm(), unit.z)),
        None if unit.z > 0.0 => Rotation3::identity(),
        None => Rotation3::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI),
    };
    Ok(rows(rotation.matrix()))
}

/// The rotation that levels a plane with this normal and aligns the scan with x.
///
/// # Errors
///
/// As [`rotation_to_z`].
///
/// # Examples
///
/// ```
/// use divespot_core::pose::{leveling, rotate};
///
/// // The corners of an upright rectangle, 2 m long and 1 m high.
/// let wall = [[0.0; 3], [0.0, 2.0, 0.0], [0.0, 2.0, 1.0], [0.0, 0.0, 1.0]];
/// let laid = rotate(&wall, &leveling(&wall, [1.0, 0.0, 0.0], 1)?, 1);
/// assert!(laid.iter().all(|p| p[2].abs() < 1e-12));
/// assert!(((laid[1][0] - laid[0][0]).abs() - 2.0).abs() < 1e-12, "the longer side is along x");
/// # Ok::<(), divespot_core::Error>(())
/// ```
pub fn leveling<'a>(
    points: impl Into<Places<'a>>,
    normal: Point,
    threads: usize,
) -> Result<Rotation> {
    let points = points.into();
    let upright = rotation_to_z(normal)?;
    let turned = |row: usize| times(&upright, &points.at(row));
    let along = align_to_rectangle(points.len(), turned, threads);
    let column = |k: usize| upright.map(|row| row[k]);
    let dot = |a: Point, b: Point| (0..3).map(|k| a[k] * b[k]).sum();
    Ok(std::array::from_fn(|r| std::array::from_fn(|c| dot(along[r], column(c)))))
}

/// The rotation about z that aligns the longer side of the points' smallest enclosing rectangle
/// with x.
///
/// A grid may have any orientation. This one rotates with the scan, so that a rotated scan gets the
/// same cells and the same volume.
fn align_to_rectangle(
    count: usize,
    point: impl Fn(usize) -> Point + Sync,
    threads: usize,
) -> Rotation {
    let hull = hull_of(count, point, thread_count(threads));
    let edges = hull.iter().zip(hull.iter().cycle().skip(1));
    let boxes = edges.map(|(a, b)| enclosing(&hull, libm::atan2(b[1] - a[1], b[0] - a[0])));
    let smallest = boxes.min_by(|a, b| a.area.total_cmp(&b.area));
    let angle = smallest.map_or(0.0, |r| r.angle_rad);
    rows(Rotation3::from_axis_angle(&Vector3::z_axis(), -angle).matrix())
}

/// Area of the points' convex hull in plan, in m².
pub(crate) fn hull_area(points: &[Point]) -> f64 {
    let hull = convex_hull(points, 1);
    let corners = hull.iter().zip(hull.iter().cycle().skip(1));
    0.5 * corners.map(|(a, b)| a[0] * b[1] - b[0] * a[1]).sum::<f64>()
}

/// `rotation · p` for each point.
#[must_use]
pub fn rotate(points: &[Point], rotation: &Rotation, threads: usize) -> Vec<Point> {
    let mut out = points.to_vec();
    fill_chunks(&mut out, CHUNK, thread_count(threads), |_, piece| {
        piece.iter_mut().for_each(|p| *p = times(rotation, p));
    });
    out
}

/// Rotates points about an origin near them, which is rotated itself, and lowers them by an offset.
pub fn level(
    points: &mut [Point],
    origin: Point,
    rotation: &Rotation,
    offset_m: f64,
    threads: usize,
) {
    let [x, y, z] = times(rotation, &origin);
    fill_chunks(points, CHUNK, thread_count(threads), |_, piece| {
        for p in piece {
            let turned = times(rotation, &std::array::from_fn(|k| p[k] - origin[k]));
            *p = [turned[0] + x, turned[1] + y, turned[2] + z - offset_m];
        }
    });
}

#[inline]
fn times(rotation: &Rotation, p: &Point) -> Point {
    rotation.map(|row| row[0] * p[0] + row[1] * p[1] + row[2] * p[2])
}

struct Rectangle {
    area: f64,
    angle_rad: f64,
}

fn enclosing(hull: &[[f64; 2]], angle_rad: f64) -> Rectangle {
    let (sin, cos) = libm::sincos(angle_rad);
    let turned = hull.iter().map(|p| [cos * p[0] + sin * p[1], cos * p[1] - sin * p[0], 0.0]);
    let [width, depth, _] = Bounds::of(turned).map_or([0.0; 3], |b| b.extent());
    let upright = if depth > width { std::f64::consts::FRAC_PI_2 } else { 0.0 };
    Rectangle { area: width * depth, angle_rad: angle_rad + upright }
}

/// The convex hull in plan, counter-clockwise (Andrew's monotone chain).
pub(crate) fn convex_hull(points: &[Point], threads: usize) -> Vec<[f64; 2]> {
    hull_of(points.len(), |row| points[row], threads)
}

fn hull_of(count: usize, point: impl Fn(usize) -> Point + Sync, threads: usize) -> Vec<[f64; 2]> {
    let mut plan = outer_rows(count, point, threads);
    plan.sort_unstable_by(|a, b| a[0].total_cmp(&b[0]).then(a[1].total_cmp(&b[1])));
    plan.dedup();
    let mut hull = chain(plan.iter());
    hull.extend(chain(plan.iter().rev()));
    hull
}

/// Half of the hull, without its last point.
fn chain<'a>(plan: impl Iterator<Item = &'a [f64; 2]>) -> Vec<[f64; 2]> {
    let mut half: Vec<[f64; 2]> = Vec::new();
    for &p in plan {
        while half.len() > 1 && !turns_left(half[half.len() - 2], half[half.len() - 1], p) {
            half.pop();
        }
        half.push(p);
    }
    half.pop();
    half
}

fn turns_left(a: [f64; 2], b: [f64; 2], c: [f64; 2]) -> bool {
    (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]) > 0.0
}

/// Points that are tested together: hardly any is farther out than all before. Decides no answer.
const BLOCK: usize = 64;

/// The points that can be on the hull: none inside the octagon of the outermost points is.
fn outer_rows(
    count: usize,
    point: impl Fn(usize) -> Point + Sync,
    threads: usize,
) -> Vec<[f64; 2]> {
    let mut corners = farthest(count, &point, threads);
    let amid = box_amid(&corners);
    corners.dedup(); // a side of no length has no inside
    if corners.len() > 1 && corners.first() == corners.last() {
        corners.pop();
    }
    let sides: Vec<_> =
        corners.iter().copied().zip(corners.iter().copied().cycle().skip(1)).collect();
    let within_sides = |p: [f64; 2]| sides.iter().all(|&(a, b)| turns_left(a, b, p));
    let amid = amid.filter(|[low, high]| {
        let [x, y] = [0, 1].map(|k| [low[k], high[k]]);
        x.iter().all(|&x| y.iter().all(|&y| within_sides([x, y])))
    });
    let is_amid = |p: [f64; 2]| {
        amid.is_some_and(|[low, high]| (0..2).all(|k| low[k] <= p[k] && p[k] <= high[k]))
    };
    let inside = |p: [f64; 2]| is_amid(p) || within_sides(p);
    let outside = map_chunks(count, CHUNK, threads, |range| {
        let plan = range.map(&point).map(|[x, y, _]| [x, y]);
        plan.filter(|&p| !inside(p)).collect::<Vec<_>>()
    });
    outside.concat()
}

/// A box, as its lowest and highest corner, inside the octagon of the eight corners; most points
/// are in it.
fn box_amid(corners: &[[f64; 2]]) -> Option<[[f64; 2]; 2]> {
    let [_, right_top, _, left_top, _, left_low, _, right_low]: [_; 8] = corners.try_into().ok()?;
    let low = [left_top[0].max(left_low[0]), left_low[1].max(right_low[1])];
    let high = [right_top[0].min(right_low[0]), left_top[1].min(right_top[1])];
    Some([low, high])
}

/// The outermost points in eight directions, counter-clockwise from +x.
fn farthest(count: usize, point: impl Fn(usize) -> Point + Sync, threads: usize) -> Vec<[f64; 2]> {
    let parts = map_chunks(count, CHUNK, threads, |range| {
        let mut all = Farthest::one(point(range.start));
        for at in range.clone().step_by(BLOCK) {
            let block = at..range.end.min(at + BLOCK);
            if all.is_passed(block.clone().map(&point)) {
                all = block.map(&point).map(Farthest::one).fold(all, Farthest::or);
            }
        }
        all
    });
    parts.into_iter().reduce(Farthest::or).map_or(Vec::new(), |all| all.places.to_vec())
}

/// The outermost places in eight directions, and their distances.
struct Farthest {
    along: [f64; 8],
    places: [[f64; 2]; 8],
}

impl Farthest {
    fn one([x, y, _]: Point) -> Self {
        let [a, b, c, d] = [x, x + y, y, y - x];
        Self { along: [a, b, c, d, -a, -b, -c, -d], places: [[x, y]; 8] }
    }

    /// Whether any of some points is farther out.
    fn is_passed(&self, points: impl Iterator<Item = Point>) -> bool {
        let start = ([f64::NEG_INFINITY; 4], [f64::INFINITY; 4]);
        let (most, least): ([f64; 4], [f64; 4]) = points.fold(start, |(most, least), [x, y, _]| {
            let along = [x, x + y, y, y - x];
            let more = |k: usize| if along[k] > most[k] { along[k] } else { most[k] };
            let less = |k: usize| if along[k] < least[k] { along[k] } else { least[k] };
            (std::array::from_fn(more), std::array::from_fn(less))
        });
        (0..4).any(|k| most[k] > self.along[k] || -least[k] > self.along[k + 4])
    }

    /// The farther out of both; ties go to the first.
    fn or(mut self, other: Self) -> Self {
        for k in 0..8 {
            if other.along[k] > self.along[k] {
                (self.along[k], self.places[k]) = (other.along[k], other.places[k]);
            }
        }
        self
    }
}

fn rows(matrix: &Matrix3<f64>) -> Rotation {
    std::array::from_fn(|r| std::array::from_fn(|c| matrix[(r, c)]))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn aligned(points: &[Point]) -> Rotation {
        align_to_rectangle(points.len(), |row| points[row], 1)
    }

    fn near(a: Point, b: Point) -> bool {
        a.iter().zip(b).all(|(x, y)| (x - y).abs() < 1e-12)
    }

    #[test]
    fn a_normal_is_taken_onto_z_without_bending_space() {
        let along = [
            [0.0, 0.0, 2.0],
            [0.0, 0.0, -1.0],
            [1.0, 0.0, 0.0],
            [0.3, -0.4, 0.1],
            [1e-9, 0.0, -1.0],
        ];
        for normal in along {
            let rotation = rotation_to_z(normal).unwrap();
            let length = normal.iter().map(|v| v * v).sum::<f64>().sqrt();
            assert!(near(rotate(&[normal], &rotation, 1)[0], [0.0, 0.0, length]), "{normal:?}");
            let matrix = Matrix3::from_fn(|r, c| rotation[r][c]);
            assert!((matrix.determinant() - 1.0).abs() < 1e-12);
        }
    }

    #[test]
    fn no_direction_is_refused() {
        assert!(rotation_to_z([0.0; 3]).is_err());
        assert!(rotation_to_z([f64::NAN, 0.0, 1.0]).is_err());
    }

    #[test]
    fn a_turned_rectangle_is_laid_along_x() {
        let grid: Vec<Point> =
            (0..600).map(|i| [f64::from(i % 30), f64::from(i / 30), 1.0]).collect();
        for angle in [0.0, 0.4, 1.5, 3.0] {
            let turn = Rotation3::from_axis_angle(&Vector3::z_axis(), angle);
            let turned = rotate(&grid, &rows(turn.matrix()), 1);
            let laid = rotate(&turned, &aligned(&turned), 1);
            let [width, depth, _] = Bounds::of(laid).unwrap().extent();
            assert!((width - 29.0).abs() < 1e-9 && (depth - 19.0).abs() < 1e-9, "{angle}");
        }
    }

    #[test]
    fn few_points_are_left_for_the_hull() {
        let disc = (0..10_000).map(f64::from).map(|i| (i, i.sqrt() / 100.0));
        let points: Vec<Point> = disc.map(|(i, r)| [r * i.cos(), r * i.sin(), 0.0]).collect();
        let outer = outer_rows(points.len(), |row| points[row], 2).len();
        assert!((8..1500).contains(&outer), "{outer}");
    }

    #[test]
    fn points_on_a_line_or_none_are_no_trap() {
        let line: Vec<Point> = (0..9).map(|i| [f64::from(i), f64::from(i), 0.0]).collect();
        let extent = Bounds::of(rotate(&line, &aligned(&line), 1)).unwrap().extent();
        assert!(extent[1] < 1e-12 && extent[0] > 11.0);
        assert_eq!(aligned(&[]), aligned(&[[3.0; 3]]));
    }
}
