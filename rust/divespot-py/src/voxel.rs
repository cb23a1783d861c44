use divespot_core::voxel::voxel_rows;
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

/// As `voxel_downsample`, with the voxel of each point.
#[pyfunction]
pub(crate) fn voxels<'py>(
    py: Python<'py>,
    points: &Bound<'py, PyAny>,
    voxel_m: f64,
    threads: usize,
) -> PyResult<(Rows<'py>, Column<'py, u32>)> {
    let (cloud, _) = cloud_for(points, threads, need::VOXELS)?;
    let (voxels, of) = attempted(py, || {
        let voxels = divespot_core::voxel_downsample(&cloud.points, voxel_m, threads)?;
        let of = voxel_rows(&cloud.points, &voxels, voxel_m, threads)?;
        Ok((voxels, of))
    })?;
    Ok((rows(py, restored(cloud.origin, voxels.means))?, of.into_pyarray(py)))
}
