use numpy::{IntoPyArray, PyArray1};
use pyo3::prelude::*;

use crate::array::ReadonlyArray2;
use crate::errors::raise;
use crate::piles::Map;

/// The ground in each cell, and its noise.
#[pyfunction]
pub(crate) fn terrain<'py>(
    py: Python<'py>,
    heights_m: ReadonlyArray2<'py, f64>,
    cell_m: f64,
    level_m: f64,
    near_m: f64,
) -> PyResult<(Bound<'py, PyArray1<f64>>, f64)> {
    let map = Map::new(&heights_m, [0.0; 2], cell_m);
    let found = py
        .detach(|| divespot_core::terrain::terrain(&map.grid, &map.heights_m, level_m, near_m))
        .map_err(raise)?;
    Ok((found.surface_m.into_pyarray(py), found.noise_m))
}
