//! Binds voxel downsampling; lengths in m.

use numpy::IntoPyArray;
use pyo3::prelude::*;

use crate::interrupt::attempted;
use crate::points::{Column, Rows, cloud_for, need, restored, rows};

#[pyfunction]
pub(crate) fn voxel_downsample<'py>(
    py: Python<'py>,
    points: &Bound<'py, PyAny>,
    voxel_m: f64,
    threads: usize,
) -> PyResult<(Rows<'py>, Column<'py, u32>)> {
    let (cloud, _) = cloud_for(points, threads, need::VOXELS)?;
    let voxels =
        attempted(py, || divespot_core::voxel_downsample(&cloud.points, voxel_m, threads))?;
    Ok((rows(py, restored(cloud.origin, voxels.means))?, voxels.counts.into_pyarray(py)))
}
