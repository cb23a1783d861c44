use divespot_core::{heightmap, tin};
use numpy::{IntoPyArray, PyArray2, PyArrayMethods};
use pyo3::prelude::*;

use crate::array::ReadonlyArray1;
use crate::errors::{DivespotError, raise};
use crate::interrupt::attempted;
use crate::points::{cloud_for, need};

/// A height map as arrays of shape (rows, columns).
#[pyclass(frozen, get_all)]
pub(crate) struct RawHeightMap {
    heights_m: Py<PyArray2<f64>>,
    counts: Py<PyArray2<u32>>,
    origin_m: (f64, f64),
}

#[pyfunction]
pub(crate) fn height_map(
    py: Python<'_>,
    points: &Bound<'_, PyAny>,
    cell_m: f64,
    triangulated: bool,
    mask: Option<ReadonlyArray1<'_, bool>>,
) -> PyResult<RawHeightMap> {
    let bytes = if triangulated { need::TRIANGLES } else { need::COPY };
    let (mut cloud, count) = cloud_for(points, 1, bytes)?;
    let all = heightmap::bounds(&cloud.points).map_err(raise)?;
    if let Some(mask) = mask {
        let mask = mask.as_array();
        if mask.len() != count || cloud.points.len() != count {
            return Err(DivespotError::new_err("one value of the mask for each point is needed"));
        }
        let mut kept = mask.iter();
        cloud.points.retain(|_| kept.next().copied().unwrap_or(false));
    }
    let make = if triangulated { tin::height_map_within } else { heightmap::height_map_within };
    let map = attempted(py, || make(&cloud.points, &all, cell_m))?;
    let shape = [map.grid.rows, map.grid.columns];
    let [x, y, z] = cloud.origin;
    let heights = map.heights_m.into_iter().map(|h| h + z).collect::<Vec<_>>();
    Ok(RawHeightMap {
        heights_m: heights.into_pyarray(py).reshape(shape)?.unbind(),
        counts: map.counts.into_pyarray(py).reshape(shape)?.unbind(),
        origin_m: (map.grid.origin_m[0] + x, map.grid.origin_m[1] + y),
    })
}

/// Cut, fill and area.
#[pyfunction]
pub(crate) fn integrate(
    heights_above_base_m: ReadonlyArray1<'_, f64>,
    cell_m: f64,
) -> (f64, f64, f64) {
    let volume = heightmap::integrate(heights_above_base_m.as_array().iter().copied(), cell_m);
    (volume.cut_m3, volume.fill_m3, volume.area_m2)
}
