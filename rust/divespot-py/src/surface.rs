use divespot_core::surface;
use numpy::IntoPyArray;
use pyo3::prelude::*;

use crate::array::ReadonlyArray2;
use crate::interrupt::attempted;
use crate::piles::Map;
use crate::points::{Column, cloud};

/// Which points lie on the surface that can be walked from the ground, or from anywhere.
#[pyfunction]
pub(crate) fn surface_points<'py>(
    py: Python<'py>,
    points: &Bound<'py, PyAny>,
    cell_m: f64,
    noise_m: f64,
    anywhere: bool,
    threads: usize,
) -> PyResult<Column<'py, bool>> {
    let (cloud, _) = cloud(points, threads)?;
    let mask = attempted(py, || surface::surface_points(&cloud.points, cell_m, noise_m, anywhere))?;
    Ok(mask.into_pyarray(py))
}

/// Labels of hills, ground cells, the ground's height in each cell and its noise.
type HillParts<'py> = (Column<'py, i32>, Column<'py, bool>, Column<'py, f64>, f64);

#[pyfunction]
pub(crate) fn hills<'py>(
    py: Python<'py>,
    heights_m: ReadonlyArray2<'py, f64>,
    cell_m: f64,
) -> PyResult<HillParts<'py>> {
    let map = Map::new(&heights_m, [0.0; 2], cell_m);
    let found = attempted(py, || surface::hills(&map.grid, &map.heights_m))?;
    let terrain = found.terrain;
    Ok((
        found.labels.into_pyarray(py),
        found.ground.into_pyarray(py),
        terrain.surface_m.into_pyarray(py),
        terrain.noise_m,
    ))
}
