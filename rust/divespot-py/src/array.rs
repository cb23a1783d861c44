//! NumPy arrays as arguments, borrowed where a view is sound.

#![allow(clippy::disallowed_types)] // the only file that may use them

use std::ops::Deref;

use numpy::ndarray::{Dimension, Ix1, Ix2};
use numpy::{
    Element, PyArray, PyArrayMethods, PyReadonlyArray, PyReadwriteArray2, PyUntypedArrayMethods,
};
use pyo3::prelude::*;

/// A [`ReadonlyArray`] of one dimension.
pub(crate) type ReadonlyArray1<'py, T> = ReadonlyArray<'py, T, Ix1>;

/// A [`ReadonlyArray`] of two dimensions.
pub(crate) type ReadonlyArray2<'py, T> = ReadonlyArray<'py, T, Ix2>;

/// An array that a kernel writes to.
pub(crate) type WritableArray2<'py, T> = PyReadwriteArray2<'py, T>;

/// An array as passed by Python if a view of it is sound, else a copy.
///
/// A view into packed records, as of a PLY body, has strides that are no multiple of the item's
/// size, or unaligned addresses. `ndarray` counts strides in items and would read elsewhere.
pub(crate) struct ReadonlyArray<'py, T: Element, D: Dimension>(PyReadonlyArray<'py, T, D>);

impl<'a, 'py, T: Element + 'a, D: Dimension + 'a> FromPyObject<'a, 'py>
    for ReadonlyArray<'py, T, D>
{
    type Error = PyErr;

    fn extract(object: Borrowed<'a, 'py, PyAny>) -> PyResult<Self> {
        let array = object.cast::<PyArray<T, D>>()?;
        if is_sound(&array) {
            return Ok(Self(array.try_readonly()?));
        }
        let copy = object.call_method0("copy")?;
        Ok(Self(copy.cast_into::<PyArray<T, D>>()?.try_readonly()?))
    }
}

impl<'py, T: Element, D: Dimension> Deref for ReadonlyArray<'py, T, D> {
    type Target = PyReadonlyArray<'py, T, D>;

    fn deref(&self) -> &Self::Target {
        &self.0
    }
}

fn is_sound<T: Element, D: Dimension>(array: &Bound<'_, PyArray<T, D>>) -> bool {
    let whole = |stride: &isize| stride.unsigned_abs().is_multiple_of(size_of::<T>());
    array.data().is_aligned() && array.strides().iter().all(whole)
}
