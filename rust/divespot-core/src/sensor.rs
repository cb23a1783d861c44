//! Whether a cloud was taken from one place.
//!
//! A sensor measures one range in each direction, with pixels or pulses evenly spaced in direction.
//! On a surface their spacing grows with range and incidence. A cloud that was fused, flown,
//! resampled or made from heights is more even in space or in plan than in directions from any
//! place.

use crate::count::to_f64;
use crate::nearest::KdTree;
use crate::parallel::{map_chunks, map_each};
use crate::sample::sample;
use crate::{Point, thread_count};

/// Number of points drawn, and every how many of them its neighbourhood is examined. Chosen: 1,000
/// spacings give each end of a spread 100; more take time.
const DRAWN: usize = 10_000;
const EVERY: usize = 10;
/// The fewest points for a spread of spacings. Chosen: 50 spacings give each end of a spread 5
/// (closed form: [`TAIL`] / [`EVERY`]).
const FEWEST: usize = 500;
/// The neighbour whose distance is the local spacing. Among random points it is known to an eighth
/// (closed form: 1 / (2 √16)).
const NEIGHBOR: usize = 16;
/// Neighbours in direction whose ranges are compared: those around a point of a square grid.
const BESIDE: usize = 8;
/// Neighbours in direction lie on different surfaces if their ranges differ by this many times
/// their distance across, and by this share of the range, which is above any sensor's noise: a
/// surface seen at an angle of 6° or less, or one behind another.
const APART: f64 = 10.0;
const NOISE: f64 = 0.02;
/// Largest share of directions next to such a step in range. Chosen: edges, as long as they are
/// lines; lower refuses scans with many edges, higher takes places from which the scan was not
/// taken.
const EDGES: f64 = 0.2;
/// Share of the points within a sensor's view; the rest may be outliers. Chosen: nearer 1 outliers
/// open the view, lower narrows it.
const IN_VIEW: f64 = 0.99;
/// Smallest and largest half angle of a view, in radians. At the smallest, perspective differs from
/// a parallel projection by a tenth of an octave; the largest is about a half space, beyond which
/// no camera sees.
const VIEW_RAD: (f64, f64) = (0.09, 1.5);
/// Share of a distribution that its spread leaves out on either side. Chosen: lower takes in
/// outliers, higher leaves little of the spread.
const TAIL: f64 = 0.1;

type Vector = nalgebra::Vector3<f64>;

/// The spread of spacings as seen from a place, divided by the smaller of those in space and in
/// plan.
///
/// Below 1, the points are most even in direction. `None` if no sensor can have been there: it
/// would see one surface behind another, look to all sides, or have too few points.
///
/// # Examples
///
/// ```
/// use divespot_core::Point;
/// use divespot_core::sensor::unevenness_of_rays;
///
/// // What a camera at the origin sees of a floor aslant: rays at equal steps.
/// let seen: Vec<Point> = (0..10_000)
///     .map(|i| [f64::from(i % 100) * 0.01 - 0.5, f64::from(i / 100) * 0.01 - 0.5, 1.0])
///     .map(|ray| ray.map(|v| v * 2.0 / (1.0 + ray[1])))
///     .collect();
/// let uneven = unevenness_of_rays(&seen, [0.0; 3], 0, 0);
/// assert!(uneven.is_some_and(|uneven| uneven < 0.5));
/// ```
#[must_use]
pub fn unevenness_of_rays(points: &[Point], from: Point, seed: u64, threads: usize) -> Option<f64> {
    let threads = thread_count(threads);
    let mut drawn = sample(points, DRAWN, seed, threads);
    drawn.iter_mut().for_each(|p| (0..3).for_each(|k| p[k] -= from[k]));
    let axis = view_axis(&drawn).filter(|_| drawn.len() >= FEWEST)?;
    let rays: Vec<Point> = drawn.iter().map(|p| Vector::from(*p).normalize().into()).collect();
    if hidden_share(&drawn, &rays, threads) > EDGES {
        return None;
    }
    let plane: Vec<Point> = drawn.iter().map(|p| p.map(|v| v / p[axis])).collect();
    let plan: Vec<Point> = drawn.iter().map(|p| without(*p, axis)).collect();
    let spreads = map_each(&[&rays, &plane, &drawn, &plan], threads, |points| spread(points));
    let (seen, lies) = (spreads[0].min(spreads[1]), spreads[2].min(spreads[3]));
    Some(seen / lies.max(f64::MIN_POSITIVE))
}

/// The coordinate axis nearest to the middle of the view; `None` if the points are in no view.
fn view_axis(points: &[Point]) -> Option<usize> {
    let sum: Vector = points.iter().map(|p| Vector::from(*p).normalize()).sum();
    let middle = sum.try_normalize(0.0)?;
    let cosines = sorted(points.iter().map(|p| Vector::from(*p).normalize().dot(&middle)));
    let half_rad = libm::acos(quantile(&cosines, 1.0 - IN_VIEW).clamp(-1.0, 1.0));
    (VIEW_RAD.0..VIEW_RAD.1).contains(&half_rad).then(|| middle.iamax())
}

fn without(mut p: Point, axis: usize) -> Point {
    p[axis] = 0.0;
    p
}

/// Share of places next to which, as seen from the origin, another surface lies at another range.
fn hidden_share(points: &[Point], rays: &[Point], threads: usize) -> f64 {
    let range = |row: usize| Vector::from(points[row]).norm();
    let apart = around(rays, BESIDE, threads, |row, near| {
        let across =
            near.iter().map(|&k| distance(&rays[row], &rays[k as usize])).fold(0.0, f64::max);
        let depth =
            near.iter().map(|&k| (range(row) - range(k as usize)).abs()).fold(0.0, f64::max);
        depth > (APART * across).max(NOISE) * range(row)
    });
    to_f64(apart.iter().filter(|apart| **apart).count()) / to_f64(apart.len().max(1))
}

/// Logarithm of the ratio of the widest to the narrowest spacings.
fn spread(points: &[Point]) -> f64 {
    let spacings = around(points, NEIGHBOR, 1, |row, near| {
        let farthest = near.last().map_or(0.0, |&k| distance(&points[row], &points[k as usize]));
        libm::log(farthest.max(f64::MIN_POSITIVE))
    });
    let spacings = sorted(spacings.into_iter());
    quantile(&spacings, 1.0 - TAIL) - quantile(&spacings, TAIL)
}

/// The results of `look` for every tenth row and its nearest neighbours.
fn around<T: Send>(
    points: &[Point],
    neighbors: usize,
    threads: usize,
    look: impl Fn(usize, &[u32]) -> T + Sync,
) -> Vec<T> {
    let tree = KdTree::new(points, LEAF, threads);
    let parts = map_chunks(points.len() / EVERY, CHUNK, threads, |range| {
        let rows = range.map(|i| i * EVERY);
        rows.map(|row| look(row, &tree.nearest_rows(&points[row], neighbors + 1)))
            .collect::<Vec<_>>()
    });
    parts.into_iter().flatten().collect()
}

/// Points in a leaf of the tree, and places for a thread at a time. Decide no answer.
const LEAF: usize = 32;
const CHUNK: usize = 100;

fn distance(a: &Point, b: &Point) -> f64 {
    (Vector::from(*a) - Vector::from(*b)).norm()
}

fn sorted(values: impl Iterator<Item = f64>) -> Vec<f64> {
    let mut sorted: Vec<f64> = values.collect();
    sorted.sort_unstable_by(f64::total_cmp);
    sorted
}

fn quantile(sorted: &[f64], share: f64) -> f64 {
    let place = share * to_f64(sorted.len().saturating_sub(1));
    sorted.get(place as usize).copied().unwrap_or(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sample::mix;

    fn chance(i: u64) -> f64 {
        (mix(i) % 1_000_000) as f64 / 1e6
    }

    /// Height of a heap of 0.3 m on a floor.
    fn heap(x: f64, y: f64) -> f64 {
        (0.3 - 0.5 * x.hypot(y)).max(0.0)
    }

    /// The view of a camera 2 m above the floor, tilted down by 45°, with z forward and y up.
    fn frame() -> Vec<Point> {
        let slant = std::f64::consts::FRAC_1_SQRT_2;
        (0..6000)
            .map(|i| [1.2 * chance(2 * i) - 0.6, 0.9 * chance(2 * i + 1) - 0.45])
            .map(|[u, v]| {
                let (ahead, down) = (slant * (1.0 + v), slant * (1.0 - v));
                let meets = |range: f64| (2.0 - heap(u * range, ahead * range - 2.0)) / down;
                let range = (0..50).fold(2.0, |range, _| 0.5 * (range + meets(range)));
                [u * range, v * range, range]
            })
            .collect()
    }

    #[test]
    fn a_frame_lies_most_evenly_in_directions() {
        let share = unevenness_of_rays(&frame(), [0.0; 3], 0, 1).unwrap();
        assert!(share < 0.7, "{share}");
    }

    #[test]
    fn a_cloud_of_even_places_lies_most_evenly_in_plan() {
        let place = |i: u64| [4.0 * chance(2 * i) - 2.0, 4.0 * chance(2 * i + 1) - 1.0];
        let points: Vec<Point> =
            (0..6000).map(place).map(|[x, y]| [x, y, heap(x, y) - 2.0]).collect();
        let share = unevenness_of_rays(&points, [0.0; 3], 0, 1).unwrap();
        assert!(share > 0.9, "{share}");
    }

    #[test]
    fn what_lies_behind_something_or_all_around_was_not_seen_from_the_origin() {
        let near = frame();
        let through: Vec<Point> = near.iter().flat_map(|p| [*p, p.map(|v| 1.7 * v)]).collect();
        assert_eq!(unevenness_of_rays(&through, [0.0; 3], 0, 1), None);
        let around: Vec<Point> = near.iter().flat_map(|p| [*p, p.map(|v| -v)]).collect();
        assert_eq!(unevenness_of_rays(&around, [0.0; 3], 0, 1), None);
        assert_eq!(unevenness_of_rays(&near[..100], [0.0; 3], 0, 1), None);
    }

    #[test]
    fn order_and_threads_change_no_bit() {
        let points = frame();
        let mut shuffled = points.clone();
        shuffled.reverse();
        let share = unevenness_of_rays(&points, [0.0; 3], 3, 1);
        assert_eq!(share, unevenness_of_rays(&shuffled, [0.0; 3], 3, 2));
    }

    /// A square raster of so many places a side, of this step.
    fn raster(side: usize, step: f64) -> impl Iterator<Item = Point> {
        let half = 0.5 * side as f64;
        (0..side * side).map(move |i| {
            [((i % side) as f64 - half) * step, ((i / side) as f64 - half) * step, 1.0]
        })
    }

    #[test]
    fn a_tenth_of_the_spacings_on_either_side_are_left_out_of_their_spread() {
        // 900 places a step apart, and others e times as far.
        let of = |side: usize| {
            let wide = raster(side, std::f64::consts::E).map(|p| [p[0] + 1e3, p[1], p[2]]);
            spread(&raster(30, 1.0).chain(wide).collect::<Vec<_>>())
        };
        assert!(of(13) > 0.8 && of(8) < 0.6, "{} {}", of(13), of(8));
    }

    #[test]
    fn the_sixteenth_neighbour_tells_the_spacing_of_every_tenth_point() {
        // Clumps of 12 and of 24.
        let clump = |k: u64, count: u64| {
            (0..count).map(move |i| {
                let [x, y] = [chance(100 * k + 2 * i), chance(100 * k + 2 * i + 1)];
                [x + 100.0 * (k % 8) as f64, y + 100.0 * (k / 8) as f64, 1.0]
            })
        };
        let points: Vec<Point> =
            (0..64).flat_map(|k| clump(k, if k % 2 == 0 { 12 } else { 24 })).collect();
        assert!(spread(&points) > 3.0, "{}", spread(&points));
        assert_eq!(around(&points[..1000], 4, 1, |_, _| ()).len(), 100);
    }

    /// The share of rays, a step apart, beside which something lies at another range.
    fn hidden(step: f64, range: impl Fn(usize, usize) -> f64) -> f64 {
        let rays: Vec<Point> =
            raster(31, step).map(|p| Vector::from(p).normalize().into()).collect();
        let at = |(i, ray): (usize, &Point)| ray.map(|v| v * range(i % 31, i / 31));
        let points: Vec<Point> = rays.iter().enumerate().map(at).collect();
        hidden_share(&points, &rays, 1)
    }

    #[test]
    fn ranges_are_apart_by_ten_times_the_way_across_and_more_than_noise() {
        // From column to column, where eight neighbours lie up to a diagonal away.
        let steep = |slope: f64| {
            let growth = 1.0 + slope * 0.01 * std::f64::consts::SQRT_2;
            hidden(0.01, |x, _| growth.powi(x as i32))
        };
        assert!(steep(14.0) > 0.9 && steep(7.0) < 0.1, "{} {}", steep(14.0), steep(7.0));
        let noisy =
            |off: f64| hidden(1e-4, |x, y| if x % 5 + y % 5 == 0 { 1.0 + off } else { 1.0 });
        assert!(noisy(0.03) > 0.2 && noisy(0.014) == 0.0);
    }

    #[test]
    fn of_what_a_sensor_saw_a_fifth_may_lie_at_edges() {
        let seen = |one_in: usize| {
            let mut points = frame();
            points.iter_mut().step_by(one_in).for_each(|p| *p = p.map(|v| 1.3 * v));
            unevenness_of_rays(&points, [0.0; 3], 0, 1).is_some()
        };
        assert!(seen(75) && !seen(30));
    }

    #[test]
    fn of_fewer_than_five_hundred_points_nothing_is_known() {
        let seen = |count: usize| unevenness_of_rays(&frame()[..count], [0.0; 3], 0, 1).is_some();
        assert!(seen(700) && !seen(350));
    }

    #[test]
    fn a_view_is_wide_enough_for_perspective_and_holds_nearly_all_points() {
        // Points all round an axis at these angles to it, so many at each.
        let is_view = |rings: &[(usize, f64)]| {
            let ring = |&(count, angle): &(usize, f64)| {
                (0..count).map(move |i| {
                    let (y, x) = (std::f64::consts::TAU * i as f64 / count as f64).sin_cos();
                    [angle.sin() * x, angle.sin() * y, angle.cos()]
                })
            };
            view_axis(&rings.iter().flat_map(ring).collect::<Vec<_>>()).is_some()
        };
        assert!(is_view(&[(1000, 0.13)]) && !is_view(&[(1000, 0.06)]));
        assert!(is_view(&[(993, 0.2), (7, 2.0)]) && !is_view(&[(700, 0.2), (300, 2.0)]));
    }
}
