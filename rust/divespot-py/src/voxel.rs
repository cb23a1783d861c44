use numpy::{IntoPyArray, PyArray1, PyArray2};
use pyo3::prelude::*;

use crate::errors::raise;
use crate::points::{cloud, restored, rows};

#[pyfunction]
pub(crate) fn voxel_downsample<'py>(
    py: Python<'py>,
    points: &Bound<'py, PyAny>,
    voxel_m: f64,
    threads: usize,
) -> PyResult<(Bound<'py, PyArray2<f64>>, Bound<'py, PyArray1<u32>>)> {
    let (cloud, _) = cloud(points)?;
    let voxels = py
        .detach(|| divespot_core::voxel_downsample(&cloud.points, voxel_m, threads))
        .map_err(raise)?;
    Ok((rows(py, restored(cloud.origin, voxels.means))?, voxels.counts.into_pyarray(py)))
}
