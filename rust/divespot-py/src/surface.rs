use divespot_core::both;
use divespot_core::surface::{self, Hills};
use divespot_core::voxel::voxels_and_rows;
use numpy::IntoPyArray;
use pyo3::prelude::*;

use crate::array::ReadonlyArray2;
use crate::interrupt::attempted;
use crate::piles::Map;
use crate::points::{Column, Rows, cloud_for, need, restored, rows};

/// Means of voxels, points in each, and the voxel of each point.
type VoxelParts<'py> = (Rows<'py>, Column<'py, u32>, Column<'py, u32>);

/// Which points lie on the surface that can be walked from the ground, or from anywhere; and the
/// points thinned to voxels, side by side.
#[pyfunction]
pub(crate) fn surface_and_voxels<'py>(
    py: Python<'py>,
    points: &Bound<'py, PyAny>,
    cell_m: f64,
    noise_m: f64,
    anywhere: bool,
    voxel_m: f64,
    threads: usize,
) -> PyResult<(Column<'py, bool>, VoxelParts<'py>)> {
    let (cloud, _) = cloud_for(points, threads, need::VOXELS)?;
    let walk = || surface::surface_points(&cloud.points, cell_m, noise_m, anywhere);
    let thin = || voxels_and_rows(&cloud.points, voxel_m, threads);
    let (mask, (voxels, of)) = attempted(py, || {
        let (mask, voxels) = both(threads, walk, thin);
        Ok((mask?, voxels?))
    })?;
    let means = rows(py, restored(cloud.origin, voxels.means))?;
    let parts = (means, voxels.counts.into_pyarray(py), of.into_pyarray(py));
    Ok((mask.into_pyarray(py), parts))
}

/// Labels of hills, ground cells, the ground's height in each cell and its noise.
type HillParts<'py> = (Column<'py, i32>, Column<'py, bool>, Column<'py, f64>, f64);

/// What stands on the ground, and where holes are wanted, those next.
#[pyfunction]
pub(crate) fn hills<'py>(
    py: Python<'py>,
    heights_m: ReadonlyArray2<'py, f64>,
    cell_m: f64,
    with_holes: bool,
    threads: usize,
) -> PyResult<Vec<HillParts<'py>>> {
    let map = Map::new(&heights_m, [0.0; 2], cell_m);
    let found = attempted(py, || match with_holes {
        true => surface::hills_and_holes(&map.grid, &map.heights_m, threads),
        false => surface::hills(&map.grid, &map.heights_m).map(|hills| vec![hills]),
    })?;
    let parts = |hills: Hills| {
        let Hills { labels, ground, terrain } = hills;
        (
            labels.into_pyarray(py),
            ground.into_pyarray(py),
            terrain.surface_m.into_pyarray(py),
            terrain.noise_m,
        )
    };
    Ok(found.into_iter().map(parts).collect())
}
