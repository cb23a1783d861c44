//! Finds the ground's plane, and which side of it is up.
//!
//! The paper takes the plane with the most points, which may be a wall. Here several planes
//! (RANSAC) are scored by how much of the scan each explains as the ground: below the ground there
//! is (almost) nothing; things on it are upright or level; poured material lies on it at its angle
//! of repose, facing all sides, wide at the foot. Seen from a wall, a pile's surface has none of
//! these properties.

use std::cmp::Ordering;

use nalgebra::{Matrix3, Vector3};

use crate::count::to_f64;
use crate::error::Result;
use crate::parallel::{both, map_each};
use crate::plane::{Cone, Plane, Settings, fit_plane, settled, with_score};
use crate::pose::{hull_area, rotate, rotation_to_z};
use crate::survey::Normal;
use crate::{Error, Places, Point, thread_count};

/// Most planes that are compared. Chosen: a room has five, and one more; fewer miss a floor smaller
/// than its walls, more take time.
const CANDIDATES: usize = 6;
/// Points on which planes are searched and compared: shares are known to about 1 % (closed form:
/// 0.5 / √2000).
const COMPARED: usize = 2000;
/// Smallest share of the points on a candidate plane: 40 of those compared. Chosen: lower compares
/// chance planes, higher loses a floor of which little shows.
const LEAST_SHARE: f64 = 0.02;
/// A point is below a plane if it is this many thresholds off it. Chosen: lower counts noise and
/// waves of the ground, higher overlooks ground just below a plateau.
const CLEAR: f64 = 2.0;
/// A point is below the ground only if it is deeper than a fold or slope of the ground would take
/// it, for its distance from the middle of the plane's points; rise over run, 6°. Chosen: lower
/// counts ground that falls away, higher overlooks ground far beside a plateau.
const GENTLE: f64 = 0.1;
/// Angles to the ground between which a slope is taken for bulk material, in radians: 15° to 50°
/// (angles of repose of 20° to 45°). A flatter surface counts as level, and one within 15° of the
/// vertical as upright.
const SLOPES_RAD: (f64, f64) = (0.26, 0.87);
/// Share of the surface that lies on a plane as poured, with which the plane is half proven to be
/// the ground. Chosen on the scenes of `divespot evaluate`.
const HALF_PROVEN: f64 = 0.01;
/// Least number of such places, since the normals of single sparse points are unreliable. Chosen:
/// lower lets chance normals prove a plane, higher leaves small piles without a say.
const FEWEST_PROVING: f64 = 10.0;
/// Weights of upright and level surfaces above the plane, and of points below it, relative to a
/// point on it. Complete evidence of poured material has a weight of 1, as much as all points.
/// Chosen on the scenes of `divespot evaluate`.
const SQUARE: f64 = 0.5;
const BELOW: f64 = 2.0;
/// Weight of z being up, which decides only between equals. Chosen about as large as the error of a
/// share ([`COMPARED`]): more turns scans whose z is not up, less leaves the choice to noise.
const UPRIGHT: f64 = 0.02;
/// Quantile of the heights of poured slopes that is their top; higher ones may be flying pixels.
/// Chosen: nearer 1 a few flying pixels raise the top, lower cuts off peaks.
const TOP: f64 = 0.95;

/// A floor whose normal is within this angle (radians, 0.5°) of z shows that z is up: instruments
/// that are levelled at all are levelled so well, and floors fall by less than 1 in 100. A random
/// frame passes by chance in 1 of 26,000 cases (closed form: 1 - cos 0.5°).
const LEVEL_RAD: f64 = 0.009;
/// A floor whose normal is within this angle (radians, 2°) of z is the ground and no wall: yards
/// fall by at most 1 in 40 (1.4°) for drainage. Whether z is up or down is then decided by the
/// scan.
const NEARLY_LEVEL_RAD: f64 = 0.035;

/// The evidence for which way is up.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Up {
    /// A given cone of directions.
    Given,
    /// The sensor's position: no sensor sees a floor from below.
    Sensor,
    /// A floor that is (almost) level in the scan's own frame, whose z is up.
    SmallTilt,
    /// The scan lies on one side of the ground.
    NothingBelow,
}

/// The ground's plane and the evidence for which way is up.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ground {
    /// The plane; its normal points up.
    pub plane: Plane,
    /// The evidence.
    pub up: Up,
    /// Whether the scan lies as if the other side of the plane were up.
    pub doubted: bool,
}

/// What the scan's z axis may be.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Axis {
    /// Up, if a floor is level in it.
    Up,
    /// Forward for a camera at the origin: a wall may be perpendicular to it, a floor face either
    /// way.
    Ahead,
    /// Up for a sensor at the origin above the scan, or backward for a camera; up if the ground is
    /// nearly level in it.
    Behind,
}

/// What is known of the scan's frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Frame {
    /// The sensor's position, in m.
    pub sensor: Option<Point>,
    /// What z may be.
    pub z: Axis,
}

/// Finds the ground and orients its normal upwards.
///
/// The first evidence that exists decides: `settings.cone`, a cone of directions around up; the
/// side of the plane on which the sensor is; z, if a floor is level in it; the side of the plane on
/// which the scan lies. `normals` are surface normals at some of the points.
///
/// # Errors
///
/// As [`fit_plane`].
///
/// # Examples
///
/// ```
/// use divespot_core::Point;
/// use divespot_core::ground::{Axis, Frame, Up, find_ground};
/// use divespot_core::plane::Settings;
/// use divespot_core::survey::survey;
///
/// // A floor of 40 by 40 points, 2 cm apart.
/// let floor: Vec<Point> =
///     (0..1600).map(|i| [f64::from(i % 40) * 0.02, f64::from(i / 40) * 0.02, 0.0]).collect();
/// let settings =
///     Settings { threshold_m: 0.01, hypotheses: 1000, cone: None, seed: 0, threads: 0 };
/// let frame = Frame { sensor: None, z: Axis::Up };
/// let ground = find_ground(&floor, &survey(&floor, 0, 0)?.normals, &settings, frame)?;
/// assert_eq!(ground.up, Up::SmallTilt);
/// assert!(ground.plane.normal[2] > 0.999);
/// # Ok::<(), divespot_core::Error>(())
/// ```
pub fn find_ground<'a>(
    points: impl Into<Places<'a>>,
    normals: &[Normal],
    settings: &Settings,
    frame: Frame,
) -> Result<Ground> {
    let points = points.into();
    let scored = with_score(points, settings);
    let drawn = &scored[..scored.len().min(COMPARED)];
    let scene = Scene { drawn, normals, settings, frame };
    let (plane, up) = match settings.cone {
        Some(_) => (scene.best(scene.candidates(settings.cone)?)?, Up::Given),
        None => scene.unaided()?,
    };
    let score = |plane| scene.score(&plane);
    let (other, own) = both(settings.threads, || score(turned(plane)), || score(plane));
    let doubted = other > own;
    let tight = Cone { axis: plane.normal, half_angle_rad: 0.1 };
    let plane = settled(points, &scored, plane, &Settings { cone: Some(tight), ..*settings });
    Ok(Ground { plane, up, doubted })
}

/// The plane with its normal reversed.
fn turned(plane: Plane) -> Plane {
    Plane { normal: plane.normal.map(|v| -v), offset_m: -plane.offset_m, ..plane }
}

/// The data on which planes are compared.
struct Scene<'a> {
    drawn: &'a [Point],
    normals: &'a [Normal],
    settings: &'a Settings,
    frame: Frame,
}

impl Scene<'_> {
    /// The ground, where no direction of up was given.
    fn unaided(&self) -> Result<(Plane, Up)> {
        let (plane, otherwise) = match self.level() {
            Some(found) => found,
            None => {
                let plane = self.best(self.sides(self.candidates(None)?))?;
                (plane, if self.is_side_by_z(&plane) { Up::SmallTilt } else { Up::NothingBelow })
            }
        };
        let sensor_above = self.sensor_height(&plane) == Ordering::Greater;
        Ok((plane, if sensor_above { Up::Sensor } else { otherwise }))
    }

    /// The floor that is level in the scan's own frame.
    fn level(&self) -> Option<(Plane, Up)> {
        if self.frame.z != Axis::Up {
            return None;
        }
        let about_z = Cone { axis: [0.0, 0.0, 1.0], half_angle_rad: SLOPES_RAD.0 };
        let sides = self.sides(self.candidates(Some(about_z)).ok()?);
        let upright = sides.iter().filter(|side| side.normal[2] > 0.0).copied().collect();
        let is_floor = |plane: &Plane, within_rad: f64| {
            plane.normal[2].abs() >= libm::cos(within_rad) && self.is_surface(plane)
        };
        let floor = |planes, within_rad| self.best(planes).ok().filter(|p| is_floor(p, within_rad));
        floor(upright, LEVEL_RAD)
            .map(|plane| (plane, Up::SmallTilt))
            .or_else(|| Some((floor(sides, NEARLY_LEVEL_RAD)?, Up::NothingBelow)))
    }

    /// Whether the surfaces at the plane's points are parallel to it; a plane can be laid through a
    /// heap too.
    fn is_surface(&self, plane: &Plane) -> bool {
        let on = self.normals.iter().filter(|n| {
            plane.height(&n.at).abs() <= self.settings.threshold_m
                && Slope::of(n, plane).level >= libm::cos(SLOPES_RAD.0)
        });
        to_f64(on.count()) >= LEAST_SHARE * to_f64(self.normals.len().max(1))
    }

    /// The planes with the most support, each searched among the points off the planes before.
    fn candidates(&self, cone: Option<Cone>) -> Result<Vec<Plane>> {
        let settings = &Settings { cone, ..*self.settings };
        let mut rest = self.drawn.to_vec();
        let mut found = vec![fit_plane(&rest, settings)?];
        while found.len() < CANDIDATES {
            let last = found[found.len() - 1];
            rest.retain(|p| last.height(p).abs() > settings.threshold_m);
            match fit_plane(&rest, settings) {
                Ok(plane) if to_f64(plane.inliers) >= LEAST_SHARE * to_f64(self.drawn.len()) => {
                    found.push(plane);
                }
                _ => break,
            }
        }
        Ok(found)
    }

    /// Each plane with the side up on which the sensor is, or which z indicates; with both sides if
    /// neither is known.
    fn sides(&self, planes: Vec<Plane>) -> Vec<Plane> {
        let sides = planes.into_iter().flat_map(|plane| [plane, turned(plane)]);
        let may_be_up = |side: &Plane| {
            self.sensor_height(side) != Ordering::Less && !self.is_side_by_z(&turned(*side))
        };
        sides.filter(may_be_up).collect()
    }

    /// Whether z alone shows that this side of a plane is up.
    fn is_side_by_z(&self, plane: &Plane) -> bool {
        self.frame.z == Axis::Behind && plane.normal[2] >= libm::cos(SLOPES_RAD.0)
    }

    /// Whether the sensor is known to be above or below a plane.
    fn sensor_height(&self, plane: &Plane) -> Ordering {
        let height_m = self.frame.sensor.map_or(0.0, |sensor| plane.height(&sensor));
        let clear = height_m.abs() > self.settings.threshold_m;
        if clear { height_m.total_cmp(&0.0) } else { Ordering::Equal }
    }

    fn best(&self, planes: Vec<Plane>) -> Result<Plane> {
        let threads = thread_count(self.settings.threads);
        let scores = map_each(&planes, threads, |plane| self.score(plane));
        let best = scores.into_iter().zip(planes).max_by(|a, b| a.0.total_cmp(&b.0));
        best.map(|(_, plane)| plane).ok_or(Error::Degenerate(
            "no plane goes through the points: points on a plane are needed",
        ))
    }

    /// The score of a plane as the ground: how much of the scan it explains, times the share of the
    /// scan's extent that its points cover, less the points below it. Without that share, the top
    /// of a dome turned over would score high.
    fn score(&self, plane: &Plane) -> f64 {
        let Self { drawn, normals, settings: &Settings { threshold_m, .. }, .. } = *self;
        let on: Vec<Point> =
            drawn.iter().filter(|p| plane.height(p).abs() <= threshold_m).copied().collect();
        let share = |count: usize, of: usize| to_f64(count) / to_f64(of.max(1));
        let above: Vec<Slope> = normals
            .iter()
            .filter(|n| plane.height(&n.at) > threshold_m)
            .map(|n| Slope::of(n, plane))
            .collect();
        let poured = poured_on(&above, threshold_m);
        let half = FEWEST_PROVING.max(HALF_PROVEN * to_f64(normals.len()));
        let square = above.iter().filter(|s| s.is_square()).count();
        let explained = share(on.len(), drawn.len())
            + SQUARE * share(square, normals.len())
            + poured / (poured + half);
        reach(plane, &on, drawn) * explained
            - BELOW * share(below(plane, &on, drawn, threshold_m), drawn.len())
            + UPRIGHT * plane.normal[2]
    }
}

/// Share of the scan's extent, seen along the normal, that the plane's points cover.
fn reach(plane: &Plane, on: &[Point], drawn: &[Point]) -> f64 {
    let Ok(rotation) = rotation_to_z(plane.normal) else { return 0.0 };
    let area = |points: &[Point]| hull_area(&rotate(points, &rotation, 1));
    area(on) / area(drawn).max(f64::MIN_POSITIVE)
}

/// Number of points below the plane, except where a gentle slope leads.
fn below(plane: &Plane, on: &[Point], drawn: &[Point], threshold_m: f64) -> usize {
    let sum: Vector3<f64> = on.iter().map(|p| Vector3::from(*p)).sum();
    let middle = sum / to_f64(on.len().max(1));
    let is_below = |p: &&Point| {
        let depth = -plane.height(p);
        depth > CLEAR * threshold_m && depth > GENTLE * (Vector3::from(**p) - middle).norm()
    };
    drawn.iter().filter(is_below).count()
}

/// A piece of surface relative to a plane.
struct Slope {
    height_m: f64,
    /// Cosine of the angle between its normal and the plane's, 0 to 1.
    level: f64,
    /// Unit vector downhill, in the plane.
    downhill: Vector3<f64>,
}

impl Slope {
    fn of(surface: &Normal, plane: &Plane) -> Self {
        let (up, normal) = (Vector3::from(plane.normal), Vector3::from(surface.normal));
        let along = normal.dot(&up);
        let outward = if along < 0.0 { -normal } else { normal };
        let downhill = (outward - along.abs() * up).try_normalize(0.0).unwrap_or_default();
        Self { height_m: plane.height(&surface.at), level: along.abs(), downhill }
    }

    fn is_poured(&self) -> bool {
        (libm::cos(SLOPES_RAD.1)..libm::cos(SLOPES_RAD.0)).contains(&self.level)
    }

    fn is_square(&self) -> bool {
        self.level >= libm::cos(SLOPES_RAD.0) || self.level <= libm::sin(SLOPES_RAD.0)
    }
}

/// Number of slopes that may be poured material, reduced if they do not face all sides or are
/// mostly at the top: one flank seen from another, or a floor seen from the top of a box, is no
/// pile.
fn poured_on(above: &[Slope], threshold_m: f64) -> f64 {
    let slopes: Vec<&Slope> = above.iter().filter(|s| s.is_poured()).collect();
    if slopes.is_empty() {
        return 0.0;
    }
    all_round(&slopes) * (2.0 * low(&slopes, threshold_m)).min(to_f64(slopes.len()))
}

/// How evenly slopes face all sides: 1 for a cone or half of one, 0 for a ramp or a roof.
///
/// It is twice the smaller eigenvalue of the directions' scatter, whose eigenvalues are a, 1 - a
/// and 0.
fn all_round(slopes: &[&Slope]) -> f64 {
    let scatter: Matrix3<f64> = slopes.iter().map(|s| s.downhill * s.downhill.transpose()).sum();
    let squares = (scatter / to_f64(slopes.len())).norm_squared();
    1.0 - (2.0 * squares - 1.0).clamp(0.0, 1.0).sqrt()
}

/// Number of slopes in the lower half between the threshold and the top of the slopes.
fn low(slopes: &[&Slope], threshold_m: f64) -> f64 {
    let mut heights: Vec<f64> = slopes.iter().map(|s| s.height_m).collect();
    heights.sort_unstable_by(f64::total_cmp);
    let top = heights[(TOP * to_f64(heights.len() - 1)) as usize];
    to_f64(heights.partition_point(|&h| h < threshold_m.midpoint(top)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pose::Rotation;
    use crate::survey::survey;

    /// Points of a floor of 2 m by 1 m and a wall, `wall_m` high, behind it, on a raster of `STEP`.
    fn room(wall_m: f64) -> Vec<Point> {
        let at = |i: i32| (f64::from(i) + 0.5) * STEP;
        let cone = |x: f64, y: f64| (0.5 * (0.3 - (x - 1.0).hypot(y - 0.45))).max(0.0);
        let floor = (0..80).flat_map(|i| (0..40).map(move |j| (at(i), at(j))));
        let wall = (0..80).flat_map(|i| (0..80).map(move |j| (at(i), at(j))));
        floor
            .map(|(x, y)| [x, y, cone(x, y)])
            .chain(wall.filter(|w| w.1 < wall_m).map(|(x, z)| [x, 1.0, z]))
            .collect()
    }

    const STEP: f64 = 0.025;
    const UNKNOWN: Frame = Frame { sensor: None, z: Axis::Ahead };

    fn settings(seed: u64, cone: Option<Cone>) -> Settings {
        Settings { threshold_m: 0.01, hypotheses: 1000, cone, seed, threads: 1 }
    }

    fn ground(points: &[Point], seed: u64, cone: Option<Cone>) -> Plane {
        let normals = survey(points, seed, 1).unwrap().normals;
        find_ground(points, &normals, &settings(seed, cone), UNKNOWN).unwrap().plane
    }

    fn along(a: Point, b: Point) -> f64 {
        Vector3::from(a).dot(&Vector3::from(b))
    }

    #[test]
    fn a_wall_twice_the_floor_is_not_the_ground_whichever_way_the_scan_lies() {
        let points = room(2.0);
        for (seed, up) in
            (0..).zip([[0.0, 0.0, 1.0], [0.0, 0.0, -1.0], [0.3, -0.9, 0.1], [1.0, 1.0, -2.0]])
        {
            let turn: Rotation = rotation_to_z(up).unwrap();
            let turned = rotate(&points, &turn, 1);
            let floor = rotate(&[[0.0, 0.0, 1.0]], &turn, 1)[0];
            let plane = ground(&turned, seed, None);
            assert!(along(plane.normal, floor) > 0.999, "{up:?}: {plane:?}");
        }
    }

    fn unaided(points: &[Point], frame: Frame) -> Ground {
        let normals = survey(points, 5, 1).unwrap().normals;
        find_ground(points, &normals, &settings(5, None), frame).unwrap()
    }

    #[test]
    fn a_sensor_sees_no_floor_from_below() {
        let points = room(0.0);
        for (height_m, up_z) in [(2.0, 1.0), (-2.0, -1.0)] {
            let sensor = Some([1.0, 0.5, height_m]);
            let ground = unaided(&points, Frame { sensor, z: Axis::Ahead });
            assert!(ground.plane.normal[2] * up_z > 0.999, "{ground:?}");
            assert_eq!((ground.up, ground.doubted), (Up::Sensor, up_z < 0.0));
        }
    }

    #[test]
    fn a_floor_that_is_level_in_z_says_that_z_is_up() {
        let hanging: Vec<Point> = room(0.0).iter().map(|p| [p[0], p[1], -p[2]]).collect();
        for (z, up, up_z) in [
            (Axis::Up, Up::SmallTilt, 1.0),
            (Axis::Behind, Up::SmallTilt, 1.0),
            (Axis::Ahead, Up::NothingBelow, -1.0),
        ] {
            let ground = unaided(&hanging, Frame { sensor: None, z });
            assert!(ground.plane.normal[2] * up_z > 0.999, "{ground:?}");
            assert_eq!((ground.up, ground.doubted), (up, up_z > 0.0));
        }
    }

    #[test]
    fn a_cone_of_directions_beats_what_lies_on_the_floor() {
        let cone = Some(Cone { axis: [0.0, -1.0, 0.1], half_angle_rad: 0.5 });
        let plane = ground(&room(2.0), 1, cone);
        assert!(plane.normal[1] < -0.999 && (plane.offset_m + 1.0).abs() < 0.005, "{plane:?}");
    }

    #[test]
    fn the_top_of_a_box_is_not_the_ground_from_either_side() {
        let on = |p: &Point| (0.2..0.7).contains(&p[0]) && (0.2..0.7).contains(&p[1]);
        let raise = |p: Point| if on(&p) { [p[0], p[1], 0.3] } else { p };
        let points: Vec<Point> = room(0.0).into_iter().map(raise).collect();
        let plane = ground(&points, 2, None);
        assert!(plane.normal[2] > 0.999 && plane.offset_m.abs() < 0.005, "{plane:?}");
    }

    #[test]
    fn half_of_a_ridge_has_nothing_below_it() {
        let fold = |p: Point| [p[0], p[1], p[2] - 0.05 * (p[0] - 1.0).max(0.0)];
        let points: Vec<Point> = room(1.0).into_iter().map(fold).collect();
        let plane = ground(&points, 3, None);
        assert!(plane.normal[2] > 0.998, "{plane:?}");
    }

    /// The score of the floor z = 0, 1 m wide, of a scene of these points and normals.
    fn score(drawn: &[Point], normals: &[Normal]) -> f64 {
        let scene = Scene { drawn, normals, settings: &settings(0, None), frame: UNKNOWN };
        let normal = [0.0, 0.0, 1.0];
        scene.score(&Plane { normal, offset_m: 0.0, inliers: 400, rms_m: 0.0 })
    }

    /// A floor of 20 by 20 points.
    fn floor() -> Vec<Point> {
        (0..400).map(|i| [f64::from(i % 20) * 0.05, f64::from(i / 20) * 0.05, 0.0]).collect()
    }

    /// Pieces of surface up to 1 m above the floor, turned from it by an angle, to all sides.
    fn above(count: u32, turn_deg: f64) -> Vec<Normal> {
        let (sin, cos) = turn_deg.to_radians().sin_cos();
        let piece = |i: u32| {
            let (y, x) = (f64::from(i) * 2.399_963).sin_cos();
            let z = 0.02 + 0.98 * f64::from(i) / f64::from(count);
            Normal { at: [0.5, 0.5, z], normal: [sin * x, sin * y, cos] }
        };
        (0..count).map(piece).collect()
    }

    #[test]
    fn upright_and_level_surfaces_weigh_half_as_much_as_points_on_the_plane() {
        let more = |turn_deg: f64| score(&floor(), &above(100, turn_deg)) - score(&floor(), &[]);
        assert!((more(0.0) - 0.5).abs() < 1e-9 && (more(90.0) - 0.5).abs() < 1e-9);
        // 15° from either is neither.
        assert!((more(12.0) - 0.5).abs() < 1e-9 && (more(78.0) - 0.5).abs() < 1e-9);
        assert!(more(17.5) > 0.7, "poured: {}", more(17.5));
        assert!(more(60.0).abs() < 1e-9, "steeper than anything poured, less than upright");
    }

    #[test]
    fn poured_slopes_prove_by_half_from_a_hundredth_of_all_and_by_ten_of_few() {
        let proof = |poured: u32, all: u32| {
            let normals = [above(poured, 35.0), above(all - poured, 60.0)].concat();
            score(&floor(), &normals) - score(&floor(), &[])
        };
        // All of them lie all round; half of their heights count twice.
        assert!((proof(20, 20) - 20.0 / 30.0).abs() < 0.08, "{}", proof(20, 20));
        assert!((proof(40, 4000) - 0.5).abs() < 0.05, "{}", proof(40, 4000));
    }

    #[test]
    fn a_point_below_weighs_twice_as_much_as_one_on_the_plane() {
        let with = |z: f64, x: f64| {
            let points = [floor(), vec![[x, 0.5, z]; 40]].concat();
            (score(&points, &[]) - score(&[floor(), vec![[x, 0.5, 1.0]; 40]].concat(), &[])) * 11.0
        };
        assert!((with(-1.0, 0.5) + 2.0).abs() < 0.1, "{}", with(-1.0, 0.5));
    }

    #[test]
    fn below_is_what_lies_deeper_than_noise_and_than_the_ground_may_slope() {
        let plane = Plane { normal: [0.0, 0.0, 1.0], offset_m: 0.0, inliers: 400, rms_m: 0.0 };
        let is_below = |x: f64, z: f64| below(&plane, &floor(), &[[x, 0.475, z]], 0.01) == 1;
        // Two thresholds in the middle of the floor, and a tenth of the way to 10 m off.
        assert!(is_below(0.475, -0.028) && !is_below(0.475, -0.014));
        assert!(is_below(10.475, -1.4) && !is_below(10.475, -0.7));
    }

    #[test]
    fn where_nothing_else_decides_z_is_up() {
        let scene =
            Scene { drawn: &floor(), normals: &[], settings: &settings(0, None), frame: UNKNOWN };
        let plane = Plane { normal: [0.0, 0.0, 1.0], offset_m: 0.0, inliers: 400, rms_m: 0.0 };
        let more = scene.score(&plane) - scene.score(&turned(plane));
        assert!((more - 2.0 * 0.02).abs() < 1e-9, "{more}");
    }

    #[test]
    fn a_plane_rests_on_a_fiftieth_of_the_points_and_six_are_looked_at() {
        // Floors above each other, the lowest with most points.
        let stack = |counts: &[usize]| {
            let level = |(k, &n): (usize, &usize)| {
                (0..n).map(move |i| [(i % 10) as f64 * 0.1, (i / 10) as f64 * 0.1, k as f64])
            };
            let drawn: Vec<Point> = counts.iter().enumerate().flat_map(level).collect();
            let scene =
                Scene { drawn: &drawn, normals: &[], settings: &settings(0, None), frame: UNKNOWN };
            scene.candidates(None).unwrap().len()
        };
        assert_eq!(stack(&[970, 30]), 2);
        assert_eq!(stack(&[985, 15]), 1);
        assert_eq!(stack(&[170, 160, 150, 140, 130, 120, 110]), 6);
    }

    #[test]
    fn of_poured_slopes_a_twentieth_may_be_higher_than_their_top() {
        let slope = |height_m: f64| Slope { height_m, level: 0.8, downhill: Vector3::x() };
        let slopes: Vec<Slope> = (0..100)
            .map(|i| {
                slope(if i < 60 {
                    0.3
                } else if i < 92 {
                    0.9
                } else {
                    9.0
                })
            })
            .collect();
        // Of 100 slopes 8 are too many strays: the top is theirs, and all others lie low.
        assert_eq!(low(&slopes.iter().collect::<Vec<_>>(), 0.0), 92.0);
        let few: Vec<&Slope> = slopes.iter().take(95).collect();
        assert_eq!(low(&few, 0.0), 60.0);
    }

    #[test]
    fn a_floor_within_half_a_degree_of_z_says_that_z_is_up_and_within_two_it_is_the_ground() {
        let tilted = |degrees: f64| {
            let (sin, cos) = degrees.to_radians().sin_cos();
            let points: Vec<Point> = (0..1600)
                .map(|i| [f64::from(i % 40) * 0.05, f64::from(i / 40) * 0.05])
                .map(|[x, y]| [cos * x, y, sin * x])
                .collect();
            let normals = survey(&points, 0, 1).unwrap().normals;
            let frame = Frame { sensor: None, z: Axis::Up };
            let scene =
                Scene { drawn: &points, normals: &normals, settings: &settings(0, None), frame };
            scene.level().map(|(_, up)| up)
        };
        assert_eq!(tilted(0.35), Some(Up::SmallTilt));
        assert_eq!(tilted(0.75), Some(Up::NothingBelow));
        assert_eq!(tilted(1.4), Some(Up::NothingBelow));
        assert_eq!(tilted(3.0), None);
    }
}
