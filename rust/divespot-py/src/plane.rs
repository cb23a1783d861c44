//! Binds the plane fit, the rotation and the levelling of points; lengths in m.

use divespot_core::plane::{self, Cone, Settings};
use divespot_core::{Bounds, Point, pose};
use numpy::{IntoPyArray, PyArray2, PyArrayMethods};
use pyo3::prelude::*;

use crate::array::WritableArray2;
use crate::errors::raise;
use crate::interrupt::{attempted, detached};
use crate::points::cloud;

/// Normal, offset in m, number of inliers and their root mean square distance in m.
pub(crate) type PlaneParts = ((f64, f64, f64), f64, usize, f64);

/// A plane of centred points, in the points' own coordinates.
pub(crate) fn parts(plane: &plane::Plane, origin: Point) -> PlaneParts {
    let shift: f64 = (0..3).map(|k| plane.normal[k] * origin[k]).sum();
    (plane.normal.into(), plane.offset_m + shift, plane.inliers, plane.rms_m)
}

#[pyfunction]
pub(crate) fn fit_plane(
    py: Python<'_>,
    points: &Bound<'_, PyAny>,
    threshold_m: f64,
    hypotheses: u32,
    cone: Option<(Point, f64)>,
    seed: u64,
    threads: usize,
) -> PyResult<PlaneParts> {
    let (cloud, _) = cloud(points, threads)?;
    let settings = settings_of(threshold_m, hypotheses, cone, seed, threads);
    let fit = attempted(py, || plane::fit_plane(&cloud.points, &settings))?;
    Ok(parts(&fit, cloud.origin))
}

pub(crate) fn settings_of(
    threshold_m: f64,
    hypotheses: u32,
    cone: Option<(Point, f64)>,
    seed: u64,
    threads: usize,
) -> Settings {
    let cone = cone.map(|(axis, half_angle_rad)| Cone { axis, half_angle_rad });
    Settings { threshold_m, hypotheses, cone, seed, threads }
}

#[pyfunction]
pub(crate) fn rotation_to_z(py: Python<'_>, normal: Point) -> PyResult<Bound<'_, PyArray2<f64>>> {
    matrix(py, pose::rotation_to_z(normal).map_err(raise)?)
}

/// Rotates points and lowers them by an offset, in an array that nothing else holds.
#[pyfunction]
pub(crate) fn level(
    py: Python<'_>,
    mut points: WritableArray2<'_, f64>,
    rotation: [[f64; 3]; 3],
    offset_m: f64,
    threads: usize,
) -> PyResult<()> {
    let points = points.as_slice_mut()?.as_chunks_mut::<3>().0;
    detached(py, || {
        let low = Bounds::of_finite(points, threads).map_or([0.0; 3], |bounds| bounds.min);
        pose::level(points, low, &rotation, offset_m, threads);
    })
}

fn matrix(py: Python<'_>, rows: [[f64; 3]; 3]) -> PyResult<Bound<'_, PyArray2<f64>>> {
    rows.concat().into_pyarray(py).reshape([3, 3])
}
