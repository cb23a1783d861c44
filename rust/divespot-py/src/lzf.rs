//! Binds the decompression of LZF.

use numpy::IntoPyArray;
use pyo3::prelude::*;

use crate::interrupt::attempted;
use crate::points::Column;

#[pyfunction]
pub(crate) fn lzf_decompress<'py>(
    py: Python<'py>,
    packed: &[u8],
    size: usize,
) -> PyResult<Column<'py, u8>> {
    Ok(attempted(py, || divespot_core::lzf::decompress(packed, size))?.into_pyarray(py))
}
