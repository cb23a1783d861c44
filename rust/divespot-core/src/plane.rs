//! The plane with the most support (paper, Algorithm 2, lines 2 and 3): RANSAC, then least squares;
//! distances in m.

use nalgebra::Vector3;

use crate::cancel::poll;
use crate::error::{Error, Result, positive};
use crate::fixed::Fixed;
use crate::moments::Moments;
use crate::parallel::map_chunks;
use crate::sample::{mix, sample};
use crate::{Places, Point, thread_count};

/// Number of random points on which hypotheses are scored: the standard error of a share is below
/// 1 % (closed form: 0.5 / √4096), and the sample fits in the cache.
const SCORED: usize = 4096;
/// Points scored between two comparisons with the best score. Decides no answer.
const BLOCK: usize = 256;
/// Hypotheses scored side by side, so that no sum waits for its predecessor. Decides no answer.
const ABREAST: usize = 4;
/// Points for a thread at a time. Decides no answer.
const CHUNK: usize = 1 << 14;
/// Fewest hypotheses, whatever the support; and accepted probability of missing the best plane.
/// Chosen: fewer settle on the first clear plane, not the best one; more take time.
const LEAST_HYPOTHESES: u32 = 100;
const MISSED: f64 = 1e-6;
/// Most refits to all inliers. Chosen: the inliers settle after two or three; fewer leave the plane
/// where three random points put it.
const REFITS: usize = 8;

/// A plane `normal · p = offset_m` and its inliers.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Plane {
    /// Unit normal; its sign follows the caller's axis, or else z ≥ 0.
    pub normal: Point,
    /// Distance from the cloud's origin along the normal, in m.
    pub offset_m: f64,
    /// Number of points within the threshold.
    pub inliers: usize,
    /// Root mean square distance of the inliers, in m.
    pub rms_m: f64,
}

impl Plane {
    /// Signed distance of a point in m, positive on the normal's side.
    #[must_use]
    pub fn height(&self, p: &Point) -> f64 {
        let [a, b, c] = self.normal;
        a * p[0] + b * p[1] + c * p[2] - self.offset_m
    }
}

/// A cone of directions for a normal.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cone {
    /// The axis; the fitted normal points to its side.
    pub axis: Point,
    /// Largest angle between normal and axis, in radians.
    pub half_angle_rad: f64,
}

/// The settings of [`fit_plane`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Settings {
    /// Largest distance of an inlier, in m.
    pub threshold_m: f64,
    /// Most planes through three random points that are tried.
    pub hypotheses: u32,
    /// If given, only planes with a normal in this cone are considered.
    pub cone: Option<Cone>,
    /// Seed of the random draws.
    pub seed: u64,
    /// Number of threads.
    pub threads: usize,
}

/// Fits the plane that most points support.
///
/// Hypotheses through three random points are scored by MSAC (sum of squared distances, each capped
/// at the threshold; Torr and Zisserman 2000) on a fixed random sample. The best is refitted to all
/// points within the threshold until its inliers settle. The same points give the same bits in any
/// order.
///
/// # Errors
///
/// Fewer than three points, all points on one line, no plane inside the cone, or a setting outside
/// its range.
///
/// # Examples
///
/// ```
/// use divespot_core::Point;
/// use divespot_core::plane::{Settings, fit_plane};
///
/// // A floor of 40 by 40 points, 2 cm apart.
/// let floor: Vec<Point> =
///     (0..1600).map(|i| [f64::from(i % 40) * 0.02, f64::from(i / 40) * 0.02, 0.0]).collect();
/// let settings =
///     Settings { threshold_m: 0.01, hypotheses: 1000, cone: None, seed: 0, threads: 0 };
/// let plane = fit_plane(&floor, &settings)?;
/// assert_eq!(plane.inliers, 1600);
/// assert!((plane.normal[2] - 1.0).abs() < 1e-12 && plane.offset_m.abs() < 1e-12);
/// # Ok::<(), divespot_core::Error>(())
/// ```
pub fn fit_plane(points: &[Point], settings: &Settings) -> Result<Plane> {
    positive("threshold_m", settings.threshold_m)?;
    if points.len() < 3 {
        return Err(Error::TooFewPoints { what: "a plane", given: points.len(), needed: 3 });
    }
    let scored = with_score(points, settings);
    Ok(settled(points, &scored, best_hypothesis(&scored, settings)?, settings))
}

/// The points on which hypotheses are scored.
pub(crate) fn with_score<'a>(points: impl Into<Places<'a>>, settings: &Settings) -> Vec<Point> {
    sample(points, SCORED, settings.seed, settings.threads)
}

/// Refits a plane until its inliers stay the same or it would leave the cone; first to the scored
/// points, so that few rounds on all points remain.
pub(crate) fn settled<'a>(
    points: impl Into<Places<'a>>,
    scored: &[Point],
    plane: Plane,
    settings: &Settings,
) -> Plane {
    let points = points.into();
    let bounds = points.bounds(thread_count(settings.threads));
    let fixed = Fixed::new(bounds.map_or(0.0, |b| b.largest()), points.len());
    settle(points, settle(scored.into(), plane, fixed, settings), fixed, settings)
}

fn settle(points: Places<'_>, mut plane: Plane, fixed: Fixed, settings: &Settings) -> Plane {
    for _ in 0..REFITS {
        let Some(next) = refit(points, &plane, fixed, settings) else { break };
        let settled = next.inliers == plane.inliers;
        plane = next;
        if settled {
            break;
        }
    }
    plane
}

fn best_hypothesis(drawn: &[Point], settings: &Settings) -> Result<Plane> {
    let mut best: Option<(f64, Plane)> = None;
    let (mut i, mut enough) = (0, settings.hypotheses);
    while i < enough {
        poll();
        let planes = std::array::from_fn(|k| hypothesis(drawn, settings, u64::from(i) + k as u64));
        let bound = best.map_or(f64::INFINITY, |(cost, _)| cost);
        let costs = msac(drawn, &planes, settings.threshold_m, bound);
        for (plane, cost) in planes.into_iter().zip(costs) {
            let least = best.map_or(f64::INFINITY, |(least, _)| least);
            if let Some(plane) = plane.filter(|_| i < enough && cost < least) {
                best = Some((cost, plane));
                let further = still_needed(drawn, &plane, settings.threshold_m);
                enough = i.saturating_add(further).max(LEAST_HYPOTHESES).min(settings.hypotheses);
            }
            i = i.saturating_add(1);
        }
    }
    let reason = if settings.cone.is_some() {
        "no plane within the admissible tilt goes through the points: another axis is needed"
    } else {
        "all points lie on one line: points off it are needed for a plane"
    };
    best.map(|(_, plane)| plane).ok_or(Error::Degenerate(reason))
}

/// How many more hypotheses are needed until one was free of outliers, if no plane has more
/// support.
fn still_needed(drawn: &[Point], plane: &Plane, threshold_m: f64) -> u32 {
    let on = drawn.iter().filter(|p| plane.height(p).abs() <= threshold_m).count();
    let clean = (on as f64 / drawn.len() as f64).powi(3);
    (libm::log(MISSED) / libm::log1p(-clean)).ceil().min(f64::from(u32::MAX)) as u32
}

/// The plane through three points drawn for hypothesis `i`; `None` if they are (almost) on one line
/// or the plane is outside the cone.
fn hypothesis(drawn: &[Point], settings: &Settings, i: u64) -> Option<Plane> {
    let draw = |k: u64| {
        #[allow(clippy::cast_possible_truncation)] // the remainder is an index
        let index = (mix(settings.seed ^ mix(3 * i + k)) % drawn.len() as u64) as usize;
        Vector3::from(drawn[index])
    };
    let (a, b, c) = (draw(0), draw(1), draw(2));
    let (ab, ac) = (b - a, c - a);
    let cross = ab.cross(&ac);
    let slim = 0.05 * ab.norm() * ac.norm();
    if cross.norm() <= slim.max(f64::MIN_POSITIVE) {
        return None;
    }
    oriented(cross.normalize(), &a, settings.cone).map(|(normal, offset_m)| Plane {
        normal,
        offset_m,
        inliers: 0,
        rms_m: f64::NAN,
    })
}

/// The normal with its sign decided, and the offset of the plane through `on`.
fn oriented(normal: Vector3<f64>, on: &Vector3<f64>, cone: Option<Cone>) -> Option<(Point, f64)> {
    let axis = cone.map_or(Vector3::z(), |c| Vector3::from(c.axis).normalize());
    let along = normal.dot(&axis);
    if cone.is_some_and(|c| along.abs() < libm::cos(c.half_angle_rad)) {
        return None;
    }
    let normal = if along < 0.0 { -normal } else { normal };
    Some((normal.into(), normal.dot(on)))
}

/// For each plane the sum of squared distances in m², each capped at the squared threshold; stops
/// once all are above `bound`.
fn msac(
    drawn: &[Point],
    planes: &[Option<Plane>; ABREAST],
    threshold_m: f64,
    bound: f64,
) -> [f64; ABREAST] {
    let most = threshold_m * threshold_m;
    let axis = |axis: usize| planes.map(|plane| plane.map_or(0.0, |plane| plane.normal[axis]));
    let (a, b, c) = (axis(0), axis(1), axis(2));
    let offset = planes.map(|plane| plane.map_or(f64::INFINITY, |plane| plane.offset_m));
    let mut costs = [0.0; ABREAST];
    for block in drawn.chunks(BLOCK) {
        let mut sums = [0.0; ABREAST];
        for [x, y, z] in block {
            for (k, sum) in sums.iter_mut().enumerate() {
                let height = a[k] * x + b[k] * y + c[k] * z - offset[k];
                let square = height * height;
                *sum += if square < most { square } else { most };
            }
        }
        costs.iter_mut().zip(sums).for_each(|(cost, sum)| *cost += sum);
        if costs.iter().all(|&cost| cost >= bound) {
            break;
        }
    }
    costs
}

/// The least-squares plane of all points near `plane`; `None` if it leaves the cone.
fn refit(points: Places<'_>, plane: &Plane, fixed: Fixed, settings: &Settings) -> Option<Plane> {
    let near = |p: &Point| plane.height(p).abs() <= settings.threshold_m;
    let parts = map_chunks(points.len(), CHUNK, thread_count(settings.threads), |range| {
        Moments::of(points.within(range).filter(near), fixed)
    });
    let moments = parts.iter().fold(Moments::default(), Moments::merge);
    let (normal, variance) = moments.flattest(fixed)?;
    let (normal, offset_m) = oriented(normal, &moments.mean(fixed), settings.cone)?;
    Some(Plane { normal, offset_m, inliers: moments.count() as usize, rms_m: variance.sqrt() })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn settings() -> Settings {
        Settings { threshold_m: 0.01, hypotheses: 500, cone: None, seed: 1, threads: 1 }
    }

    fn floor_and_wall() -> Vec<Point> {
        let noise = |i: u64| (mix(i) % 1000) as f64 * 1e-5 - 0.005;
        let floor =
            (0..2000u64).map(|i| [(i % 50) as f64 * 0.02, (i / 50) as f64 * 0.02, noise(i)]);
        let wall = (0..4000u64).map(|i| [noise(i), (i % 50) as f64 * 0.02, (i / 50) as f64 * 0.02]);
        floor.chain(wall).collect()
    }

    #[test]
    fn the_plane_with_most_support_is_found_and_a_cone_selects_another() {
        let points = floor_and_wall();
        let wall = fit_plane(&points, &settings()).unwrap();
        assert!(wall.normal[0].abs() > 0.9999, "{wall:?}");
        let cone = Some(Cone { axis: [0.0, 0.0, -1.0], half_angle_rad: 0.3 });
        let floor = fit_plane(&points, &Settings { cone, ..settings() }).unwrap();
        assert!(floor.normal[2] < -0.9999, "{floor:?}");
        assert!(floor.inliers >= 2000 && floor.rms_m < 0.004);
    }

    /// The best of all hypotheses as far as they are needed, one after the other.
    fn one_by_one(drawn: &[Point], settings: &Settings) -> Option<Plane> {
        let mut best: Option<(f64, Plane)> = None;
        let (mut i, mut enough) = (0, settings.hypotheses);
        while i < enough {
            let scored = hypothesis(drawn, settings, u64::from(i)).map(|plane| {
                let alone = [Some(plane), None, None, None];
                (msac(drawn, &alone, settings.threshold_m, f64::INFINITY)[0], plane)
            });
            if let Some(found) = scored.filter(|found| best.is_none_or(|b| found.0 < b.0)) {
                best = Some(found);
                let further = still_needed(drawn, &found.1, settings.threshold_m);
                enough = (i + further).max(LEAST_HYPOTHESES).min(settings.hypotheses);
            }
            i += 1;
        }
        best.map(|(_, plane)| plane)
    }

    #[test]
    fn hypotheses_side_by_side_give_what_one_after_the_other_gives() {
        let points = floor_and_wall();
        for (seed, hypotheses) in (0..20).zip([1, 2, 3, 5, 100, 101, 102, 103, 499, 500]) {
            let settings = Settings { seed, hypotheses, ..settings() };
            let bits = |plane: Plane| (plane.normal, plane.offset_m);
            let found = best_hypothesis(&points, &settings).ok().map(bits);
            assert_eq!(found, one_by_one(&points, &settings).map(bits), "{hypotheses}");
        }
    }

    #[test]
    fn order_and_threads_change_no_bit() {
        let points = floor_and_wall();
        let mut shuffled = points.clone();
        shuffled.reverse();
        shuffled.swap(17, 4711);
        let plane = fit_plane(&points, &settings()).unwrap();
        assert_eq!(plane, fit_plane(&shuffled, &settings()).unwrap());
        assert_eq!(plane, fit_plane(&points, &Settings { threads: 3, ..settings() }).unwrap());
    }

    #[test]
    fn clouds_without_a_plane_are_refused() {
        let line: Vec<Point> = (0..50).map(|i| [f64::from(i), f64::from(i), 0.0]).collect();
        assert!(matches!(fit_plane(&line, &settings()), Err(Error::Degenerate(_))));
        assert!(matches!(fit_plane(&[[1.0; 3]; 40], &settings()), Err(Error::Degenerate(_))));
        assert!(matches!(fit_plane(&line[..2], &settings()), Err(Error::TooFewPoints { .. })));
        let wrong = Settings { threshold_m: f64::NAN, ..settings() };
        assert!(matches!(fit_plane(&line, &wrong), Err(Error::Setting { .. })));
    }

    #[test]
    fn hypotheses_go_on_until_one_in_a_million_would_miss() {
        let plane = Plane { normal: [0.0, 0.0, 1.0], offset_m: 0.0, inliers: 0, rms_m: 0.0 };
        let drawn: Vec<Point> = (0..100).map(|i| [0.0, 0.0, f64::from(i / 50)]).collect();
        // Half of the points lie on it: one hypothesis in eight is free of others.
        assert_eq!(still_needed(&drawn, &plane, 0.1), 104);
    }
}
