//! NumPy arrays of points in and out.

use std::borrow::Cow;

use divespot_core::cloud::Outermost;
use divespot_core::{Bounds, Cloud, Places, Point, memory_for};
use numpy::{IntoPyArray, PyArray1, PyArray2, PyArrayMethods};
use pyo3::prelude::*;

use crate::array::{ReadonlyArray1, ReadonlyArray2};
use crate::errors::{DivespotError, raise};

/// An array of shape `(n,)`.
pub(crate) type Column<'py, T> = Bound<'py, PyArray1<T>>;

/// An array of shape `(n, 3)`.
pub(crate) type Rows<'py> = Bound<'py, PyArray2<f64>>;

/// Largest extent in m: beyond it, coordinates near the origin would not resolve micrometres.
const LARGEST_EXTENT: f64 = 1e9;

/// Address space of the thread that a kernel runs on, in bytes: a stack of 8 MiB, and as much for a
/// heap.
const THREAD: usize = 1 << 24;

/// Memory of kernels for each point in bytes, including their own copy of it: measured as the
/// growth of the address space at a million points, plus a tenth.
pub(crate) mod need {
    /// Bounds, planes, poses, cells.
    pub(crate) const COPY: usize = 80;
    pub(crate) const VOXELS: usize = 120;
    pub(crate) const NEIGHBORS: usize = 220;
    pub(crate) const HDBSCAN: usize = 256;
    pub(crate) const STRAYS: usize = 310;
    pub(crate) const TRIANGLES: usize = 820;
}

/// Calls `make(count, threads, row)` with the rows of an `(n, 3)` array of either dtype and any
/// strides.
///
/// They are copied while attached to the interpreter: another thread may write to the array as soon
/// as the kernel runs detached.
macro_rules! copied {
    ($points:expr, $threads:expr, $make:path) => {
        if let Ok(array) = $points.extract::<ReadonlyArray2<'_, f64>>() {
            copied!(rows array.as_array(), $threads, $make)
        } else if let Ok(array) = $points.extract::<ReadonlyArray2<'_, f32>>() {
            copied!(rows array.as_array(), $threads, $make)
        } else {
            None
        }
    };
    (rows $rows:expr, $threads:expr, $make:path) => {{
        let rows = $rows;
        let count = rows.nrows();
        if rows.ncols() != 3 || u32::try_from(count).is_err() {
            None
        } else if let Some((flat, _)) = rows.as_slice().map(<[_]>::as_chunks::<3>) {
            Some(($make(count, $threads, |i| flat[i].map(Into::into)), count))
        } else {
            Some(($make(count, $threads, |i| std::array::from_fn(|k| rows[[i, k]].into())), count))
        }
    }};
}

/// Raises `MemoryError` if there is not enough memory for a kernel on these points.
fn reserve(points: &Bound<'_, PyAny>, bytes: usize) -> PyResult<()> {
    let count = points.len().unwrap_or(0);
    memory_for(count.saturating_mul(bytes).saturating_add(THREAD), || format!("{count} points"))
        .map_err(raise)
}

/// The finite points of an `(n, 3)` array and the number of its rows, for a kernel that needs this
/// many bytes for each.
pub(crate) fn cloud_for(
    points: &Bound<'_, PyAny>,
    threads: usize,
    bytes: usize,
) -> PyResult<(Cloud, usize)> {
    reserve(points, bytes)?;
    let (cloud, count) = copied!(points, threads, Cloud::new).ok_or_else(|| wrong_array(points))?;
    check_extent(&cloud)?;
    Ok((cloud, count))
}

/// Finite points near an origin: a copy, or the array itself if nothing else holds it.
pub(crate) struct Near<'py> {
    array: Option<ReadonlyArray2<'py, f64>>,
    cloud: Cloud,
    count: usize,
}

impl<'py> Near<'py> {
    /// As `cloud_for`; `own` promises that no other thread of the interpreter can write to
    /// `points`.
    pub(crate) fn of(
        points: &Bound<'py, PyAny>,
        own: bool,
        threads: usize,
        bytes: usize,
    ) -> PyResult<Self> {
        reserve(points, bytes)?;
        if let Some(array) = own.then(|| points.extract().ok()).flatten()
            && let Some(empty) = empty_about(&array, threads)
        {
            check_extent(&empty)?;
            return Ok(Self { count: array.as_array().nrows(), array: Some(array), cloud: empty });
        }
        let (cloud, count) = cloud_for(points, threads, bytes)?;
        Ok(Self { array: None, cloud, count })
    }

    /// The points relative to the origin.
    pub(crate) fn places(&self) -> Places<'_> {
        match self.array.as_ref().and_then(flat) {
            Some(points) => Places::about(points, self.cloud.origin),
            None => Places::from(&self.cloud.points),
        }
    }

    /// The same in a slice; copied if they are relative to another origin.
    pub(crate) fn points(&self) -> Cow<'_, [Point]> {
        match self.array.as_ref().and_then(flat) {
            None => Cow::Borrowed(&self.cloud.points),
            Some(points) if self.cloud.origin == [0.0; 3] => Cow::Borrowed(points),
            Some(_) => Cow::Owned(self.places().to_vec()),
        }
    }

    pub(crate) fn origin(&self) -> Point {
        self.cloud.origin
    }

    pub(crate) fn count(&self) -> usize {
        self.count
    }

    /// As `Cloud::spread`.
    pub(crate) fn spread<T: Copy>(&self, values: Vec<T>, missing: T) -> Vec<T> {
        self.cloud.spread(values, missing, self.count)
    }
}

/// The points of a contiguous array.
fn flat<'a>(array: &'a ReadonlyArray2<'_, f64>) -> Option<&'a [Point]> {
    let values = array.as_slice().ok().filter(|_| array.as_array().ncols() == 3)?;
    Some(values.as_chunks::<3>().0)
}

/// A cloud with the origin and extent of an array's points, but without the points; `None` unless
/// all are finite.
fn empty_about(array: &ReadonlyArray2<'_, f64>, threads: usize) -> Option<Cloud> {
    let points = flat(array)?;
    let bounds = Bounds::of_finite(points, threads)?;
    let (origin, extent_m) = (bounds.min, bounds.extent());
    Some(Cloud { origin, extent_m, points: Vec::new(), rows: None })
}

/// As `cloud_for`, for kernels that hold little more than a copy.
pub(crate) fn cloud(points: &Bound<'_, PyAny>, threads: usize) -> PyResult<(Cloud, usize)> {
    cloud_for(points, threads, need::COPY)
}

/// All rows of an `(n, 3)` array, copied while attached.
pub(crate) fn taken(points: &Bound<'_, PyAny>) -> PyResult<Vec<Point>> {
    reserve(points, size_of::<Point>())?;
    let (taken, _) = copied!(points, 1, every_row).ok_or_else(|| wrong_array(points))?;
    Ok(taken)
}

fn every_row(count: usize, _threads: usize, row: impl Fn(usize) -> Point) -> Vec<Point> {
    (0..count).map(row).collect()
}

/// A place as a tuple.
type Place = (f64, f64, f64);

/// Points near their origin, the origin, the highest corner of their box relative to it, and the
/// numbers of non-finite and of zero rows.
type SeenParts<'py> = (Rows<'py>, Place, Place, usize, usize);

#[pyfunction]
pub(crate) fn seen<'py>(
    py: Python<'py>,
    points: &Bound<'py, PyAny>,
    threads: usize,
) -> PyResult<SeenParts<'py>> {
    reserve(points, need::COPY)?;
    let (seen, _) = copied!(points, threads, Cloud::seen).ok_or_else(|| wrong_array(points))?;
    check_extent(&seen.cloud)?;
    let (origin, extent_m) = (seen.cloud.origin.into(), seen.cloud.extent_m.into());
    Ok((rows(py, seen.cloud.points)?, origin, extent_m, seen.nonfinite, seen.zero))
}

/// The lowest and highest coordinates, and how many points share the lowest and highest z.
#[pyfunction]
pub(crate) fn outermost(
    points: &Bound<'_, PyAny>,
    threads: usize,
) -> PyResult<(Place, Place, usize, usize)> {
    let (found, _) = copied!(points, threads, Outermost::of).ok_or_else(|| wrong_array(points))?;
    Ok((found.low.into(), found.high.into(), found.lowest, found.highest))
}

fn wrong_array(points: &Bound<'_, PyAny>) -> PyErr {
    DivespotError::new_err(format!(
        "points have {}: shape (n, 3) with n below 2**32 and dtype float32 or float64 are needed",
        described(points)
    ))
}

fn described(array: &Bound<'_, PyAny>) -> String {
    let text = |name| Ok::<_, PyErr>(array.getattr(name)?.str()?.to_string());
    match (text("shape"), text("dtype")) {
        (Ok(shape), Ok(dtype)) => format!("shape {shape} and dtype {dtype}"),
        _ => "no shape".into(),
    }
}

fn check_extent(cloud: &Cloud) -> PyResult<()> {
    let extent = cloud.extent_m.into_iter().fold(0.0, f64::max);
    if extent <= LARGEST_EXTENT {
        return Ok(());
    }
    Err(DivespotError::new_err(format!(
        "the points span {extent:.3e} m: at most {LARGEST_EXTENT:.0e} m is needed, crop them first"
    )))
}

/// The finite values of an array of shape `(n,)`, copied while attached.
pub(crate) fn heights_of(values: &Bound<'_, PyAny>) -> PyResult<Vec<f64>> {
    if let Ok(array) = values.extract::<ReadonlyArray1<'_, f64>>() {
        return Ok(finite(array.as_array().iter().copied()));
    }
    if let Ok(array) = values.extract::<ReadonlyArray1<'_, f32>>() {
        return Ok(finite(array.as_array().iter().copied()));
    }
    Err(DivespotError::new_err(format!(
        "heights_m have {}: shape (n,) and dtype float32 or float64 are needed",
        described(values)
    )))
}

fn finite(values: impl Iterator<Item = impl Into<f64>>) -> Vec<f64> {
    values.map(Into::into).filter(|v| v.is_finite()).collect()
}

/// Points near `origin` moved back to their own place.
pub(crate) fn restored(origin: Point, mut points: Vec<Point>) -> Vec<Point> {
    points.iter_mut().for_each(|p| *p = std::array::from_fn(|k| p[k] + origin[k]));
    points
}

/// Points as an `(n, 3)` array, without a copy.
pub(crate) fn rows(py: Python<'_>, points: Vec<Point>) -> PyResult<Rows<'_>> {
    let count = points.len();
    points.into_flattened().into_pyarray(py).reshape([count, 3])
}
