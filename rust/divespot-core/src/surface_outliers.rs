//! Removes outliers among few points: those that lie in no common plane with their neighbours.
//!
//! Thinning by voxels leaves one point of the surface for hundreds, but every outlier. In a cloud
//! of a few hundred points half may be outliers, and each would be a corner of the triangulated
//! surface. A point of the surface lies in one plane with most of its neighbours, within the slope
//! and curvature of bulk material. An outlier does not, and its neighbours do.

use crate::Point;
use crate::hypotenuse::Hypotenuse;
use crate::nearest::KdTree;
use crate::parallel::map_chunks;

/// Neighbours in plan that are compared with a point: those around it on a square grid.
const AROUND: usize = 8;
/// Neighbours that are found beforehand: four times [`AROUND`], so that enough remain if three
/// quarters are outliers. Chosen: more take time and memory.
const KNOWN: usize = 32;
/// Slopes of the planes tried, as rise over run, each in several directions, besides the level one:
/// up to 42°, which with [`BEND`] covers every angle of repose.
const SLOPES: [f64; 3] = [0.3, 0.6, 0.9];
const DIRECTIONS: u32 = 8;
/// Largest deviation of a neighbour from the plane, as rise over run: half the step between the
/// slopes tried, and as much again for curvature.
const BEND: f64 = 0.3;
/// A point with less than this share of its neighbours in its plane may be an outlier. Chosen:
/// half; lower keeps pairs of outliers, higher drops points on ridges.
const LEAST: f64 = 0.5;
/// Points in a leaf of the tree. Decides no answer.
const LEAF: usize = 16;
/// Points for a thread at a time. Decides no answer.
const CHUNK: usize = 256;

/// Which of levelled points lie on the surface that they are samples of.
///
/// Of two points that cannot both lie on the surface, the one with less support is an outlier,
/// unless at least half of its neighbours support it. The same points give the same mask in any
/// order.
///
/// # Examples
///
/// ```
/// use divespot_core::Point;
/// use divespot_core::surface_outliers::surface_mask;
///
/// // A floor of 40 by 40 points, 2 cm apart.
/// let mut points: Vec<Point> =
///     (0..1600).map(|i| [f64::from(i % 40) * 0.02, f64::from(i / 40) * 0.02, 0.0]).collect();
/// points.push([0.4, 0.4, 0.5]); // half a metre above the floor
/// let mask = surface_mask(&points, 0);
/// assert!(!mask[1600]);
/// assert!(mask.iter().filter(|&&on| on).count() > 1500);
/// ```
#[must_use]
pub fn surface_mask(points: &[Point], threads: usize) -> Vec<bool> {
    let mut rows: Vec<u32> = (0..points.len() as u32).collect();
    rows.sort_unstable_by(|&a, &b| compare(&points[a as usize], &points[b as usize]));
    let sorted: Vec<Point> = rows.iter().map(|&row| points[row as usize]).collect();
    let left = Left::of(&sorted, threads).without_strays();
    let mut mask = vec![false; points.len()];
    rows.iter().zip(left).for_each(|(&row, left)| mask[row as usize] = left);
    mask
}

fn compare(a: &Point, b: &Point) -> std::cmp::Ordering {
    a.iter().zip(b).fold(std::cmp::Ordering::Equal, |order, (a, b)| order.then(a.total_cmp(b)))
}

/// The support of a point by its neighbours.
#[derive(Debug, Clone, Copy, Default)]
struct Support {
    /// Share of the neighbours in its plane, each weighted by how close it is to it.
    share: f64,
    /// The neighbours off that plane, as bits by their position among the known ones.
    against: u32,
}

/// The points that are left.
struct Left<'a> {
    points: &'a [Point],
    threads: usize,
    tilts: Vec<[f64; 2]>,
    /// The nearest points in plan of each point, nearest first.
    known: Vec<Vec<u32>>,
    left: Vec<bool>,
}

impl<'a> Left<'a> {
    fn of(points: &'a [Point], threads: usize) -> Self {
        let plan: Vec<Point> = points.iter().map(|p| [p[0], p[1], 0.0]).collect();
        let tree = KdTree::new(&plan, LEAF, threads);
        let known = |row: usize| -> Vec<u32> {
            let found = tree.nearest_rows(&plan[row], KNOWN + 1);
            found.into_iter().filter(|&other| other as usize != row).take(KNOWN).collect()
        };
        let known = map_chunks(points.len(), CHUNK, threads, |r| r.map(known).collect::<Vec<_>>());
        let known = known.into_iter().flatten().collect();
        Self { points, threads, tilts: tilts(), known, left: vec![true; points.len()] }
    }

    /// Removes outliers, those with the least support among their neighbours first, until none is
    /// left.
    fn without_strays(mut self) -> Vec<bool> {
        let mut supports = vec![Support::default(); self.points.len()];
        let mut stale: Vec<usize> = (0..self.points.len()).collect();
        while !stale.is_empty() {
            let fresh = map_chunks(stale.len(), CHUNK, self.threads, |range| {
                range.map(|i| self.support(stale[i])).collect::<Vec<_>>()
            });
            stale.iter().zip(fresh.into_iter().flatten()).for_each(|(&i, s)| supports[i] = s);
            let strays: Vec<usize> =
                (0..self.points.len()).filter(|&i| self.is_stray(i, &supports)).collect();
            let mut gone = vec![false; self.points.len()];
            strays.into_iter().for_each(|i| (self.left[i], gone[i]) = (false, true));
            let lost = |&i: &usize| self.known[i].iter().any(|&other| gone[other as usize]);
            stale = (0..self.points.len()).filter(|&i| self.left[i]).filter(lost).collect();
        }
        self.left
    }

    /// Whether a point has too little support, and no neighbour off its plane has less.
    fn is_stray(&self, i: usize, supports: &[Support]) -> bool {
        let share = supports[i].share;
        let weaker = |(k, &other): (usize, &u32)| {
            let other = other as usize;
            supports[i].against >> k & 1 == 1 && self.left[other] && supports[other].share < share
        };
        self.left[i] && share < LEAST && !self.known[i].iter().enumerate().any(weaker)
    }

    /// The support of a point by the plane through it that holds most of its neighbours, or by the
    /// first plane with enough of them.
    fn support(&self, i: usize) -> Support {
        let alive = self.known[i].iter().zip(0..).filter(|&(&o, _)| self.left[o as usize]);
        let near: Vec<Near> = alive
            .take(AROUND)
            .map(|(&o, place)| Near::of(&self.points[i], &self.points[o as usize], place))
            .collect();
        let mut best = Support::default();
        for support in self.tilts.iter().map(|&tilt| in_plane(&near, tilt)) {
            if support.share > best.share {
                best = support;
            }
            if best.share >= LEAST {
                break;
            }
        }
        best
    }
}

/// A neighbour relative to a point.
struct Near {
    away: Point,
    /// Largest distance off a plane through the point, in m.
    most: f64,
    place: u32,
}

impl Near {
    fn of(here: &Point, there: &Point, place: u32) -> Self {
        let away: Point = std::array::from_fn(|k| there[k] - here[k]);
        Self { away, most: BEND * away[0].hypotenuse(away[1]), place }
    }
}

fn in_plane(near: &[Near], tilt: [f64; 2]) -> Support {
    let mut support = Support::default();
    for &Near { away: [dx, dy, dz], most, place } in near {
        let off = dz - tilt[0] * dx - tilt[1] * dy;
        if off.abs() > most {
            support.against |= 1 << place;
        } else if most > 0.0 {
            support.share += 1.0 - (off / most).powi(2);
        } else {
            support.share += 1.0;
        }
    }
    support.share /= near.len().max(1) as f64;
    support
}

fn tilts() -> Vec<[f64; 2]> {
    let turn = std::f64::consts::TAU / f64::from(DIRECTIONS);
    let ways = (0..DIRECTIONS).map(|i| libm::sincos(turn * f64::from(i)));
    let sloped = ways.flat_map(|(sin, cos)| SLOPES.map(|slope| [slope * cos, slope * sin]));
    std::iter::once([0.0; 2]).chain(sloped).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sample::mix;

    fn uniform(i: u64) -> f64 {
        (mix(i) >> 11) as f64 / (1_u64 << 53) as f64
    }

    fn cone(x: f64, y: f64) -> f64 {
        (1.2 - 0.6 * (x - 4.0).hypot(y - 3.0)).max(0.0)
    }

    /// Points on a cone, then as many outliers in the box around it.
    fn cloud(count: u64) -> Vec<Point> {
        let place = |i: u64| [8.0 * uniform(3 * i), 6.0 * uniform(3 * i + 1)];
        let on = (0..count).map(|i| (place(i), cone(place(i)[0], place(i)[1])));
        let off = (count..2 * count).map(|i| (place(i), 4.0 * uniform(3 * i + 2)));
        on.chain(off).map(|([x, y], z)| [x, y, z]).collect()
    }

    #[test]
    fn half_of_the_points_may_be_strays() {
        let points = cloud(600);
        let mask = surface_mask(&points, 2);
        let kept = mask[..600].iter().filter(|&&kept| kept).count();
        assert!(kept > 570, "{kept}");
        let strays = points.iter().zip(&mask).skip(600).filter(|&(_, &kept)| kept);
        let far = strays.filter(|(p, _)| (p[2] - cone(p[0], p[1])).abs() > 0.15).count();
        assert!(far < 12, "{far}");
    }

    #[test]
    fn a_clean_cone_and_a_step_lose_nothing_but_corners() {
        let clean = &cloud(600)[..600];
        let mask = surface_mask(clean, 1);
        assert!(mask.iter().filter(|&&kept| !kept).count() < 6);
        let step: Vec<Point> =
            clean.iter().map(|p| [p[0], p[1], if p[0] > 4.0 { 1.0 } else { 0.0 }]).collect();
        let lost = surface_mask(&step, 1).iter().filter(|&&kept| !kept).count();
        assert!(lost < 30, "{lost}");
    }

    #[test]
    fn order_and_threads_change_nothing_and_few_points_stay() {
        let mut points = cloud(200);
        points.extend_from_within(..20);
        let first = surface_mask(&points, 1);
        points.reverse();
        let mut second = surface_mask(&points, 3);
        second.reverse();
        let kept = |mask: &[bool]| mask.iter().filter(|&&kept| kept).count();
        assert_eq!(kept(&first), kept(&second));
        assert_eq!(first[20..400], second[20..400]);
        assert!(surface_mask(&[], 1).is_empty());
        let one = surface_mask(&[[0.0; 3]], 1);
        assert_eq!(one.len(), 1);
    }

    #[test]
    fn a_neighbour_counts_by_how_well_it_lies_in_a_plane_that_may_bend_by_17_degrees() {
        let near = [Near::of(&[0.0; 3], &[1.0, 0.0, 0.25], 0)];
        assert!((in_plane(&near, [0.0; 2]).share - (1.0 - (0.25_f64 / 0.3).powi(2))).abs() < 1e-12);
    }

    #[test]
    fn planes_are_tried_to_all_sides_up_to_42_degrees() {
        let all = tilts();
        let steepest = all.iter().map(|t| t[0].hypot(t[1])).fold(0.0, f64::max);
        assert!((steepest.atan().to_degrees() - 42.0).abs() < 0.1, "{steepest}");
        // In the middle between two of eight directions a plane is off by at most half a step.
        assert_eq!(all.len(), 1 + 3 * 8);
    }

    /// Points along a line, of which those that are stand off it.
    fn line(count: usize, stands: impl Fn(usize) -> bool) -> Vec<Point> {
        (0..count).map(|i| [i as f64, 0.0, if stands(i) { 1e3 } else { 0.0 }]).collect()
    }

    #[test]
    fn the_eight_nearest_that_are_left_say_whether_a_point_is_a_stray() {
        let points = line(40, |i| (5..9).contains(&i));
        let left = Left::of(&points, 1);
        assert!((left.support(0).share - 0.5).abs() < 1e-12, "{:?}", left.support(0));
        assert_eq!(left.known[0].len(), 32);
        let is_stray = |share: f64| {
            let mut supports = vec![Support { share: 1.0, against: 0 }; 40];
            supports[0].share = share;
            left.is_stray(0, &supports)
        };
        assert!(is_stray(0.35) && !is_stray(0.65));
    }
}
