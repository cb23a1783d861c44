//! Turns the core's errors into Python exceptions.

use divespot_core::Error;
use pyo3::PyErr;
use pyo3::exceptions::{PyKeyboardInterrupt, PyMemoryError};

pyo3::import_exception!(divespot.errors, DivespotError);

/// The Python exception for `error`.
pub(crate) fn raise(error: Error) -> PyErr {
    match error {
        Error::Interrupted => PyKeyboardInterrupt::new_err(()),
        Error::Memory(_) => PyMemoryError::new_err(error.to_string()),
        other => DivespotError::new_err(other.to_string()),
    }
}
