//! Binds the tests of polygons.

use divespot_core::simple_polygon;
use numpy::{IntoPyArray, PyArray1};
use pyo3::prelude::*;

use crate::array::ReadonlyArray2;
use crate::interrupt::{attempted, detached};

type Line<'py> = ReadonlyArray2<'py, f64>;

fn places(line: &Line<'_>) -> Vec<[f64; 2]> {
    line.as_array().rows().into_iter().map(|row| [row[0], row[1]]).collect()
}

/// The first corner of a line, shape (n, 2), whose edge crosses another one.
#[pyfunction]
pub(crate) fn first_crossing(py: Python<'_>, line: Line<'_>) -> PyResult<Option<usize>> {
    let line = places(&line);
    attempted(py, || simple_polygon::first_crossing(&line))
}

/// Which places, shape (n, 2), lie inside an odd number of lines.
#[pyfunction]
pub(crate) fn inside<'py>(
    py: Python<'py>,
    lines: Vec<Line<'py>>,
    at: Line<'py>,
) -> PyResult<Bound<'py, PyArray1<bool>>> {
    let lines: Vec<_> = lines.iter().map(places).collect();
    let at = places(&at);
    let all = || at.iter().map(|&place| simple_polygon::contains(&lines, place)).collect();
    Ok(detached::<Vec<bool>>(py, all)?.into_pyarray(py))
}
