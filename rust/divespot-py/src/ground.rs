//! Binds the survey of a cloud, the search for the ground and the test for a sensor; lengths in m.

use divespot_core::ground::{Axis, Frame, Up};
use divespot_core::survey::Normal;
use divespot_core::{Point, ground, pose, sensor};
use pyo3::prelude::*;

use crate::array::ReadonlyArray2;
use crate::errors::DivespotError;
use crate::interrupt::{attempted, detached};
use crate::plane::{PlaneParts, parts, settings_of};
use crate::points::{Near, Rows, need, restored, rows};

/// Spacing, whether it is regular, roughness, places, normals, spacing where points are sparse,
/// number of distinct positions.
type Surveyed<'py> = (f64, bool, f64, Rows<'py>, Rows<'py>, f64, usize);

#[pyfunction]
pub(crate) fn survey<'py>(
    py: Python<'py>,
    points: &Bound<'py, PyAny>,
    seed: u64,
    threads: usize,
    own: bool,
) -> PyResult<Surveyed<'py>> {
    let near = Near::of(points, own, threads, need::COPY)?;
    let points = &*near.points();
    let survey = attempted(py, || divespot_core::survey::survey(points, seed, threads))?;
    let (at, normals): (Vec<Point>, Vec<Point>) =
        survey.normals.into_iter().map(|n| (n.at, n.normal)).unzip();
    let at = rows(py, restored(near.origin(), at))?;
    let normals = rows(py, normals)?;
    let (spacing_m, regular, roughness_m) = (survey.spacing_m, survey.regular, survey.roughness_m);
    Ok((spacing_m, regular, roughness_m, at, normals, survey.sparse_m, survey.positions))
}

/// The plane, the evidence for which side is up, and whether the scan lies as if the other were.
type GroundParts = (PlaneParts, &'static str, bool);

#[pyfunction]
#[allow(clippy::too_many_arguments)] // one for each of the plane's settings, named in Python
pub(crate) fn find_ground(
    py: Python<'_>,
    points: &Bound<'_, PyAny>,
    at: ReadonlyArray2<'_, f64>,
    normals: ReadonlyArray2<'_, f64>,
    threshold_m: f64,
    hypotheses: u32,
    cone: Option<(Point, f64)>,
    sensor: Option<Point>,
    z: &str,
    seed: u64,
    threads: usize,
) -> PyResult<GroundParts> {
    let near = Near::of(points, true, threads, need::COPY)?;
    let (points, origin) = (near.places(), near.origin());
    let (at, normals) = (at.as_array(), normals.as_array());
    let normal = |i: usize| Normal {
        at: std::array::from_fn(|k| at[[i, k]] - origin[k]),
        normal: std::array::from_fn(|k| normals[[i, k]]),
    };
    let normals: Vec<Normal> = (0..normals.nrows()).map(normal).collect();
    let sensor = sensor.map(|s| std::array::from_fn(|k| s[k] - origin[k]));
    let frame = Frame { sensor, z: axis(z)? };
    let settings = settings_of(threshold_m, hypotheses, cone, seed, threads);
    let ground = attempted(py, || ground::find_ground(points, &normals, &settings, frame))?;
    Ok((parts(&ground.plane, origin), reason(ground.up), ground.doubted))
}

fn axis(name: &str) -> PyResult<Axis> {
    match name {
        "up" => Ok(Axis::Up),
        "ahead" => Ok(Axis::Ahead),
        "behind" => Ok(Axis::Behind),
        _ => Err(DivespotError::new_err(format!("z is {name:?}: up, ahead or behind is needed"))),
    }
}

fn reason(up: Up) -> &'static str {
    match up {
        Up::Given => "given",
        Up::Sensor => "sensor",
        Up::SmallTilt => "small tilt",
        Up::NothingBelow => "nothing below",
    }
}

#[pyfunction]
pub(crate) fn leveling<'py>(
    py: Python<'py>,
    points: &Bound<'py, PyAny>,
    normal: Point,
    threads: usize,
) -> PyResult<Rows<'py>> {
    let near = Near::of(points, true, threads, need::COPY)?;
    let points = near.places();
    let rotation = attempted(py, || pose::leveling(points, normal, threads))?;
    rows(py, rotation.to_vec())
}

#[pyfunction]
pub(crate) fn unevenness_of_rays(
    py: Python<'_>,
    points: &Bound<'_, PyAny>,
    place: Point,
    seed: u64,
    threads: usize,
) -> PyResult<Option<f64>> {
    let near = Near::of(points, true, threads, need::COPY)?;
    let (points, origin) = (&*near.points(), near.origin());
    let place = std::array::from_fn(|k| place[k] - origin[k]);
    detached(py, || sensor::unevenness_of_rays(points, place, seed, threads))
}
