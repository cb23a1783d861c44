//! Which plane is the ground, and which side of it is up.
//!
//! The paper takes the plane with the most points. That may be a wall. The ground is a plane with
//! (nearly) nothing below it, on which something slopes as bulk material does.

use crate::error::Result;
use crate::plane::{Cone, Plane, Settings, fit_plane, fit_scored, scored};
use crate::pose::{hull_area, rotate, rotation_to_z};
use crate::survey::Normal;
use crate::{Error, Point};

/// Planes that are looked at; a room shows five.
const CANDIDATES: usize = 6;
/// Candidates are searched and compared on this many points.
const COMPARED: usize = 2000;
/// The smallest share of the points that a candidate may rest on.
const LEAST_SHARE: f64 = 0.02;
/// A point counts as above or below when it is this many thresholds off the plane.
const CLEAR: f64 = 2.0;
/// Slopes between these angles to the ground are taken for bulk material (repose 20° to 45°);
/// below lies the noise of the floor's normals.
const SLOPES_RAD: (f64, f64) = (0.26, 0.87);
/// What a sloping point and a point below weigh, against one on the plane.
const SLOPING: f64 = 2.0;
const BELOW: f64 = 2.0;
/// Where nothing else decides, z is up.
const UPRIGHT: f64 = 0.05;

/// Finds the ground and orients its normal upwards.
///
/// `settings.cone`, where given, says where up is, more or less; otherwise up is the side of the
/// plane on which the scan lies. `normals` are surface normals at some of the points.
///
/// # Errors
///
/// As [`fit_plane`].
pub fn find_ground(points: &[Point], normals: &[Normal], settings: &Settings) -> Result<Plane> {
    let scored = scored(points, settings);
    let drawn = &scored[..scored.len().min(COMPARED)];
    let best = candidates(drawn, settings)?
        .into_iter()
        .flat_map(|plane| sides(plane, settings.cone))
        .map(|plane| (score(&plane, drawn, normals, settings.threshold_m), plane))
        .max_by(|a, b| a.0.total_cmp(&b.0))
        .ok_or(Error::Degenerate("no plane goes through the points"))?;
    let tight = Cone { axis: best.1.normal, half_angle_rad: 0.1 };
    fit_scored(points, &scored, &Settings { cone: Some(tight), ..*settings })
}

/// The planes with the most support, each found among the points that the ones before left.
fn candidates(drawn: &[Point], settings: &Settings) -> Result<Vec<Plane>> {
    let mut rest = drawn.to_vec();
    let mut found = vec![fit_plane(&rest, settings)?];
    while found.len() < CANDIDATES {
        let last = found[found.len() - 1];
        rest.retain(|p| last.height(p).abs() > settings.threshold_m);
        match fit_plane(&rest, settings) {
            Ok(plane) if to_f64(plane.inliers) >= LEAST_SHARE * to_f64(drawn.len()) => {
                found.push(plane);
            }
            _ => break,
        }
    }
    Ok(found)
}

/// The plane with either sign, or with the sign that the cone decides.
fn sides(plane: Plane, cone: Option<Cone>) -> Vec<Plane> {
    let turned = Plane { normal: plane.normal.map(|v| -v), offset_m: -plane.offset_m, ..plane };
    if cone.is_some() { vec![plane] } else { vec![plane, turned] }
}

/// How much speaks for this plane being the ground.
///
/// For it: points on it and slopes above it, as far as it reaches. Against it: points below. The
/// flank of a pile or the top of a box, with its other side up, has nothing below it and much
/// above, but reaches nowhere.
fn score(plane: &Plane, drawn: &[Point], normals: &[Normal], threshold_m: f64) -> f64 {
    let on: Vec<Point> =
        drawn.iter().filter(|p| plane.height(p).abs() <= threshold_m).copied().collect();
    let below = drawn.iter().filter(|p| plane.height(p) < -CLEAR * threshold_m).count();
    let share = |count: usize| count as f64 / drawn.len() as f64;
    let support = share(on.len()) + SLOPING * sloping(plane, normals, threshold_m);
    reach(plane, &on, drawn) * support - BELOW * share(below) + UPRIGHT * plane.normal[2]
}

/// The part of the scan's extent, seen along the normal, over which the plane's points reach.
fn reach(plane: &Plane, on: &[Point], drawn: &[Point]) -> f64 {
    let Ok(rotation) = rotation_to_z(plane.normal) else { return 0.0 };
    let area = |points: &[Point]| hull_area(&rotate(points, &rotation, 1));
    area(on) / area(drawn).max(f64::MIN_POSITIVE)
}

/// The share of the normals that stand on a slope above the plane.
fn sloping(plane: &Plane, normals: &[Normal], threshold_m: f64) -> f64 {
    let (least, most) = (SLOPES_RAD.0.cos(), SLOPES_RAD.1.cos());
    let slopes = |n: &&Normal| {
        let along: f64 = (0..3).map(|k| n.normal[k] * plane.normal[k]).sum();
        (most..least).contains(&along.abs()) && plane.height(&n.at) > CLEAR * threshold_m
    };
    to_f64(normals.iter().filter(slopes).count()) / to_f64(normals.len().max(1))
}

#[allow(clippy::cast_precision_loss)] // counts of points
fn to_f64(n: usize) -> f64 {
    n as f64
}
