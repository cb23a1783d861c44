//! Binds base surfaces that are given or shared by all objects; heights in m.

use divespot_core::piles::{Base, Kind, Surface};
use numpy::{IntoPyArray, PyArray2, PyArrayMethods};
use pyo3::prelude::*;

use crate::array::ReadonlyArray2;
use crate::interrupt::{attempted, detached};
use crate::piles::{Map, grid_of};

/// A base surface other than the local one from the ground around each object.
#[pyclass(frozen)]
pub(crate) struct RawBase(pub(crate) Base);

#[pymethods]
impl RawBase {
    /// Height of the base in the middle of each cell, in m; NaN where it is unknown.
    fn over<'py>(
        &self,
        py: Python<'py>,
        shape: (usize, usize),
        origin_m: [f64; 2],
        cell_m: f64,
    ) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let grid = grid_of(shape, origin_m, cell_m);
        let at = |p: [f64; 2]| if self.0.is_known(p) { self.0.at(p) } else { f64::NAN };
        let all = || (0..grid.len()).map(|cell| at(grid.center(cell))).collect::<Vec<f64>>();
        let base = detached(py, all)?;
        base.into_pyarray(py).reshape([shape.0, shape.1])
    }
}

/// A plane of height `level_m` at (0, 0) of the levelled frame. With `given` it need not be the
/// ground around the objects.
#[pyfunction]
pub(crate) fn plane_base(
    level_m: f64,
    tilt: [f64; 2],
    noise_m: f64,
    u_level_m: f64,
    given: bool,
) -> RawBase {
    let kind = if given { Kind::Given } else { Kind::Ground };
    RawBase(Base::plane(level_m, tilt, noise_m, u_level_m, kind))
}

/// The surface through heights in the levelled frame, in m; NaN where unseen.
#[pyfunction]
pub(crate) fn surface_base(
    py: Python<'_>,
    heights_m: ReadonlyArray2<'_, f64>,
    origin_m: [f64; 2],
    cell_m: f64,
    noise_m: f64,
) -> PyResult<RawBase> {
    let Map { grid, heights_m } = Map::new(&heights_m, origin_m, cell_m);
    let surface = attempted(py, || Surface::over(grid, heights_m))?;
    Ok(RawBase(Base::on(surface, noise_m)))
}
