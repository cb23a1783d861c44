//! Binds height maps (m) and their integration (m³).

use divespot_core::{heightmap, tin};
use numpy::{IntoPyArray, PyArray2, PyArrayMethods};
use pyo3::prelude::*;

use crate::array::ReadonlyArray1;
use crate::errors::{DivespotError, raise};
use crate::interrupt::attempted;
use crate::points::{Near, need};

/// A height map as arrays of shape (rows, columns).
#[pyclass(frozen, get_all)]
pub(crate) struct RawHeightMap {
    heights_m: Py<PyArray2<f64>>,
    counts: Py<PyArray2<u32>>,
    origin_m: (f64, f64),
}

#[pyfunction]
#[allow(clippy::too_many_arguments)] // the kernel's, and whose the points are
pub(crate) fn height_map<'py>(
    py: Python<'py>,
    points: &Bound<'py, PyAny>,
    cell_m: f64,
    triangulated: bool,
    mask: Option<ReadonlyArray1<'_, bool>>,
    threads: usize,
    own: bool,
) -> PyResult<RawHeightMap> {
    let bytes = if triangulated { need::TRIANGLES } else { need::COPY };
    let near = Near::of(points, own, threads, bytes)?;
    let points = near.places();
    let all = heightmap::bounds(points).map_err(raise)?;
    let marks = mask.as_ref().map(|mask| mask.as_slice()).transpose()?;
    if marks.is_some_and(|marks| marks.len() != near.count() || points.len() != near.count()) {
        return Err(DivespotError::new_err(format!(
            "the mask does not fit {} finite of {} points: a value for each finite point is needed",
            points.len(),
            near.count()
        )));
    }
    let map = attempted(py, || {
        if !triangulated {
            return heightmap::height_map_of(points, marks, &all, cell_m, threads);
        }
        let mut kept = points.to_vec();
        if let Some(marks) = marks {
            let mut marks = marks.iter();
            kept.retain(|_| marks.next().copied().unwrap_or(false));
        }
        tin::height_map_within(&kept, &all, cell_m)
    })?;
    let shape = [map.grid.rows, map.grid.columns];
    let [x, y, z] = near.origin();
    let heights = map.heights_m.into_iter().map(|h| h + z).collect::<Vec<_>>();
    Ok(RawHeightMap {
        heights_m: heights.into_pyarray(py).reshape(shape)?.unbind(),
        counts: map.counts.into_pyarray(py).reshape(shape)?.unbind(),
        origin_m: (map.grid.origin_m[0] + x, map.grid.origin_m[1] + y),
    })
}

/// Cut and fill in m³, area in m².
#[pyfunction]
pub(crate) fn integrate(
    heights_above_base_m: ReadonlyArray1<'_, f64>,
    cell_m: f64,
) -> (f64, f64, f64) {
    let volume = heightmap::integrate(heights_above_base_m.as_array().iter().copied(), cell_m);
    (volume.cut_m3, volume.fill_m3, volume.area_m2)
}
