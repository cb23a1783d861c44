use pyo3::prelude::*;

use crate::errors::raise;
use crate::points::cloud;

#[pyfunction]
pub(crate) fn point_spacing(py: Python<'_>, points: &Bound<'_, PyAny>, seed: u64) -> PyResult<f64> {
    let (cloud, _) = cloud(points)?;
    py.detach(|| divespot_core::point_spacing(&cloud.points, seed)).map_err(raise)
}
