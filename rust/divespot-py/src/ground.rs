use divespot_core::survey::Normal;
use divespot_core::{Point, ground, pose};
use pyo3::prelude::*;

use crate::array::ReadonlyArray2;
use crate::errors::raise;
use crate::plane::{PlaneParts, parts, settings};
use crate::points::{Rows, cloud, restored, rows};

/// Spacing, whether it is regular, roughness, places and normals.
type Surveyed<'py> = (f64, bool, f64, Rows<'py>, Rows<'py>);

#[pyfunction]
pub(crate) fn survey<'py>(
    py: Python<'py>,
    points: &Bound<'py, PyAny>,
    seed: u64,
    threads: usize,
) -> PyResult<Surveyed<'py>> {
    let (cloud, _) = cloud(points, threads)?;
    let survey =
        py.detach(|| divespot_core::survey::survey(&cloud.points, seed, threads)).map_err(raise)?;
    let (at, normals): (Vec<Point>, Vec<Point>) =
        survey.normals.into_iter().map(|n| (n.at, n.normal)).unzip();
    let at = rows(py, restored(cloud.origin, at))?;
    Ok((survey.spacing_m, survey.regular, survey.roughness_m, at, rows(py, normals)?))
}

#[pyfunction]
#[allow(clippy::too_many_arguments)] // one for each of the plane's settings, named in Python
pub(crate) fn find_ground<'py>(
    py: Python<'py>,
    points: &Bound<'py, PyAny>,
    at: ReadonlyArray2<'py, f64>,
    normals: ReadonlyArray2<'py, f64>,
    threshold_m: f64,
    hypotheses: u32,
    cone: Option<(Point, f64)>,
    seed: u64,
    threads: usize,
) -> PyResult<(PlaneParts, Rows<'py>)> {
    let (cloud, _) = cloud(points, threads)?;
    let (at, normals) = (at.as_array(), normals.as_array());
    let normal = |i: usize| Normal {
        at: std::array::from_fn(|k| at[[i, k]] - cloud.origin[k]),
        normal: std::array::from_fn(|k| normals[[i, k]]),
    };
    let normals: Vec<Normal> = (0..normals.nrows()).map(normal).collect();
    let settings = settings(threshold_m, hypotheses, cone, seed, threads);
    let found = py.detach(|| {
        let plane = ground::find_ground(&cloud.points, &normals, &settings)?;
        Ok((plane, pose::leveling(&cloud.points, plane.normal, threads)?))
    });
    let (plane, rotation) = found.map_err(raise)?;
    Ok((parts(&plane, cloud.origin), rows(py, rotation.to_vec())?))
}
