//! Which plane is the ground, and which side of it is up.
//!
//! The paper takes the plane with the most points. That may be a wall. Seen from the ground there
//! is (nearly) nothing below; what stands on it is upright or level; and poured material lies on it
//! as nothing else does: at its angle of repose, to all sides, wide at the foot. Seen from a wall,
//! a pile's surface does none of this, whichever way the scan lies.

use std::cmp::Ordering;

use nalgebra::{Matrix3, Vector3};

use crate::count::to_f64;
use crate::error::Result;
use crate::plane::{Cone, Plane, Settings, fit_plane, scored, settled};
use crate::pose::{hull_area, rotate, rotation_to_z};
use crate::survey::Normal;
use crate::{Error, Places, Point};

/// Planes that are looked at; a room shows five.
const CANDIDATES: usize = 6;
/// Candidates are searched and compared on this many points.
const COMPARED: usize = 2000;
/// The smallest share of the points that a candidate may rest on.
const LEAST_SHARE: f64 = 0.02;
/// A point counts as below when it is this many thresholds off the plane.
const CLEAR: f64 = 2.0;
/// A point below counts where it lies deeper than a fold or a slope of the ground takes it, for
/// its distance from the middle of the plane's points: an angle of 6°.
const GENTLE: f64 = 0.1;
/// Slopes between these angles to the ground are taken for bulk material (repose 20° to 45°);
/// what is flatter counts as level, and what is as near to the vertical as upright.
const SLOPES_RAD: (f64, f64) = (0.26, 0.87);
/// A plane on which this share of the surface lies as poured is half proven to be the ground.
const HALF_PROVEN: f64 = 0.01;
/// Of few places so many: the normals of single ones among sparse points may be anything.
const FEWEST_PROVING: f64 = 10.0;
/// What upright and level surfaces above the plane, and what points below weigh, against a point
/// on it. The whole proof by poured material weighs as much as all points together.
const SQUARE: f64 = 0.5;
const BELOW: f64 = 2.0;
/// Where nothing else decides, z is up.
const UPRIGHT: f64 = 0.02;
/// The share of the poured slopes that stays below their height; the rest may be flying pixels.
const TOP: f64 = 0.95;

/// A floor that is level within this angle of z, 0.5°, says that z is up: instruments that are
/// levelled at all are levelled so well, and floors fall by less than 1 in 100. Chance lays one of
/// 26,000 frames so.
const LEVEL_RAD: f64 = 0.009;
/// A floor that is level within this angle, 2°, is the ground, and not a wall; yards fall by at most
/// 1 in 40 (1.4°), so that water drains. Whether z is up or down, the scan decides.
const NEARLY_LEVEL_RAD: f64 = 0.035;

/// What says which way is up.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Up {
    /// The cone of directions that was given.
    Given,
    /// The sensor, which cannot see a floor from below.
    Sensor,
    /// A floor that is (all but) level in the scan's own frame, whose z is up.
    SmallTilt,
    /// The scan, which lies on one side of the ground.
    NothingBelow,
}

/// The ground, and why it is that way up.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ground {
    /// The plane; its normal is up.
    pub plane: Plane,
    /// What says so.
    pub up: Up,
    /// Whether the scan lies as if the other side of that plane were up.
    pub doubted: bool,
}

/// What the scan's z axis may be.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Axis {
    /// Up, if a floor lies level in it.
    Up,
    /// Ahead of a camera at the origin: a wall may lie across it, a floor face the other way.
    Ahead,
    /// Up for a sensor at the origin above the scan, or backward for a camera: up if the ground
    /// lies nearly level in it.
    Behind,
}

/// What is known of the scan's frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Frame {
    /// Where the sensor stood.
    pub sensor: Option<Point>,
    /// What z may be.
    pub z: Axis,
}

/// Finds the ground and orients its normal upwards.
///
/// `settings.cone`, where given, says where up is, more or less; otherwise the sensor's side of a
/// plane is, where its place is known. Where it is not, z is up if a floor lies level in it, and
/// else the side of the plane on which the scan lies. `normals` are surface normals at some of the
/// points.
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
    let scored = scored(points, settings);
    let drawn = &scored[..scored.len().min(COMPARED)];
    let scene = Scene { drawn, normals, settings, frame };
    let (plane, up) = match settings.cone {
        Some(_) => (scene.best(scene.candidates(settings.cone)?)?, Up::Given),
        None => scene.unaided()?,
    };
    let doubted = scene.score(&turned(plane)) > scene.score(&plane);
    let tight = Cone { axis: plane.normal, half_angle_rad: 0.1 };
    let plane = settled(points, &scored, plane, &Settings { cone: Some(tight), ..*settings });
    Ok(Ground { plane, up, doubted })
}

/// The plane seen from its other side.
fn turned(plane: Plane) -> Plane {
    Plane { normal: plane.normal.map(|v| -v), offset_m: -plane.offset_m, ..plane }
}

/// What planes are compared on.
struct Scene<'a> {
    drawn: &'a [Point],
    normals: &'a [Normal],
    settings: &'a Settings,
    frame: Frame,
}

impl Scene<'_> {
    /// The ground where nobody says which way is up.
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

    /// The floor that lies level in the scan's own frame.
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

    /// Whether surfaces lie along the plane; through a heap, too, a plane can be laid.
    fn is_surface(&self, plane: &Plane) -> bool {
        let on = self.normals.iter().filter(|n| {
            plane.height(&n.at).abs() <= self.settings.threshold_m
                && Slope::of(n, plane).level >= libm::cos(SLOPES_RAD.0)
        });
        to_f64(on.count()) >= LEAST_SHARE * to_f64(self.normals.len().max(1))
    }

    /// The planes with the most support, each found among the points that the ones before left.
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

    /// The planes with the side up on which the sensor is, or that z says; with either, where
    /// neither is known.
    fn sides(&self, planes: Vec<Plane>) -> Vec<Plane> {
        let sides = planes.into_iter().flat_map(|plane| [plane, turned(plane)]);
        let may_be_up = |side: &Plane| {
            self.sensor_height(side) != Ordering::Less && !self.is_side_by_z(&turned(*side))
        };
        sides.filter(may_be_up).collect()
    }

    /// Whether z alone decides that this side of a plane is up.
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
        let scored = planes.into_iter().map(|plane| (self.score(&plane), plane));
        let best = scored.max_by(|a, b| a.0.total_cmp(&b.0));
        best.map(|(_, plane)| plane).ok_or(Error::Degenerate("no plane goes through the points"))
    }

    /// How much speaks for this plane being the ground: what its being the ground explains of the
    /// scan, as far as the plane reaches. The top of a dome, with its other side up, explains much.
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
        let poured = poured(&above, threshold_m);
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

/// The part of the scan's extent, seen along the normal, over which the plane's points reach.
fn reach(plane: &Plane, on: &[Point], drawn: &[Point]) -> f64 {
    let Ok(rotation) = rotation_to_z(plane.normal) else { return 0.0 };
    let area = |points: &[Point]| hull_area(&rotate(points, &rotation, 1));
    area(on) / area(drawn).max(f64::MIN_POSITIVE)
}

/// The number of points below the plane, unless a gentle slope leads there.
fn below(plane: &Plane, on: &[Point], drawn: &[Point], threshold_m: f64) -> usize {
    let sum: Vector3<f64> = on.iter().map(|p| Vector3::from(*p)).sum();
    let middle = sum / to_f64(on.len().max(1));
    let is_below = |p: &&Point| {
        let depth = -plane.height(p);
        depth > CLEAR * threshold_m && depth > GENTLE * (Vector3::from(**p) - middle).norm()
    };
    drawn.iter().filter(is_below).count()
}

/// A piece of surface as seen from a plane.
struct Slope {
    height_m: f64,
    /// Cosine of the angle between its normal and the plane's, not below 0.
    level: f64,
    /// Unit vector in the plane, downhill.
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

/// The slopes that can be poured material's, discounted by how little they face all sides and how
/// much of them is at the top: one flank seen from another, or a floor seen from a box's top, is
/// no pile.
fn poured(above: &[Slope], threshold_m: f64) -> f64 {
    let slopes: Vec<&Slope> = above.iter().filter(|s| s.is_poured()).collect();
    if slopes.is_empty() {
        return 0.0;
    }
    all_round(&slopes) * (2.0 * low(&slopes, threshold_m)).min(to_f64(slopes.len()))
}

/// How evenly slopes face all sides: 1 for a cone or a half of one, 0 for a ramp or a roof.
///
/// Twice the smaller eigenvalue of the directions' scatter, whose eigenvalues are a, 1 - a and 0.
fn all_round(slopes: &[&Slope]) -> f64 {
    let scatter: Matrix3<f64> = slopes.iter().map(|s| s.downhill * s.downhill.transpose()).sum();
    let squares = (scatter / to_f64(slopes.len())).norm_squared();
    1.0 - (2.0 * squares - 1.0).clamp(0.0, 1.0).sqrt()
}

/// The number of slopes in the lower half of the heights from the threshold to their top.
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

    /// Points of a floor of 2 m by 1 m and a wall of `wall_m` behind it, on a raster of `STEP`.
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
}
