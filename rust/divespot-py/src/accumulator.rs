//! Binds the accumulator: points summed in voxels; lengths in m.

use divespot_core::accumulator::{Accumulator, Class, Held, Records, Returns, Told, Wanted};
use numpy::{IntoPyArray, PyArray2};
use pyo3::prelude::*;
use pyo3::types::PyBytes;

use crate::array::ReadonlyArray1;
use crate::errors::raise;
use crate::interrupt::{attempted, detached};
use crate::points::{Column, Rows, rows, taken};

/// Means, numbers of points and bounds of height of voxels.
type HeldParts<'py> = (Rows<'py>, Column<'py, u32>, Bound<'py, PyArray2<f64>>);

/// Length of a record, whether its format is 6 or higher, scale factors, offsets, length of the
/// file's unit along each axis in m.
type Layout = (usize, bool, [f64; 3], [f64; 3], [f64; 3]);

/// For each class 0 (take), 1 (noise) or 2 (leave out); returns (all, first, last); two corners
/// in m.
type WantedParts = ([u8; 256], String, Option<[[f64; 3]; 2]>);

/// Kept, of those outside the box, withheld, noise, unwanted; number of points of each class.
type ToldParts = ([u64; 5], Vec<u64>);

fn wanted_from((classes, returns, within): WantedParts) -> Wanted {
    let class = |mark| match mark {
        0 => Class::Wanted,
        1 => Class::Noise,
        _ => Class::Unwanted,
    };
    let returns = match returns.as_str() {
        "first" => Returns::First,
        "last" => Returns::Last,
        _ => Returns::All,
    };
    Wanted { classes: classes.map(class), returns, within }
}

/// Where a block lies, and what it holds.
type Block<'py> = ((i32, i32, i32), Bound<'py, PyBytes>);

#[pyclass]
pub(crate) struct RawAccumulator(Accumulator);

#[pymethods]
impl RawAccumulator {
    #[new]
    fn new(origin_m: [f64; 3], voxel_m: f64, most: usize) -> PyResult<Self> {
        Accumulator::new(origin_m, voxel_m, most).map(Self).map_err(raise)
    }

    #[staticmethod]
    fn from_bytes(py: Python<'_>, data: &[u8]) -> PyResult<Self> {
        attempted(py, || Accumulator::from_bytes(data)).map(Self)
    }

    fn empty(&self) -> Self {
        Self(self.0.empty())
    }

    fn add(&mut self, py: Python<'_>, points: &Bound<'_, PyAny>) -> PyResult<()> {
        let points = taken(points)?;
        attempted(py, || self.0.add(points))
    }

    /// Adds records from a buffer that nothing else writes to.
    fn add_records(
        &mut self,
        py: Python<'_>,
        records: ReadonlyArray1<'_, u8>,
        layout: Layout,
        kept: WantedParts,
    ) -> PyResult<ToldParts> {
        let bytes = records.as_slice()?;
        let (stride, is_extended, scales, offsets, metres) = layout;
        let records = Records { bytes, stride, is_extended, scales, offsets, metres };
        let wanted = wanted_from(kept);
        let told = attempted(py, || self.0.add_records(&records, &wanted))?;
        let Told { kept, outside, withheld, noise, unwanted, classes } = told;
        Ok(([kept, outside, withheld, noise, unwanted], classes.to_vec()))
    }

    fn merge(&mut self, py: Python<'_>, other: PyRef<'_, Self>) -> PyResult<()> {
        let other = &other.0;
        attempted(py, || self.0.merge(other))
    }

    fn to_bytes<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyBytes>> {
        let bytes = detached(py, || self.0.to_bytes())?;
        Ok(PyBytes::new(py, &bytes))
    }

    fn blocks<'py>(&self, py: Python<'py>) -> PyResult<Vec<Block<'py>>> {
        let blocks = detached(py, || self.0.blocks())?;
        Ok(blocks.into_iter().map(|(at, bytes)| (at.into(), PyBytes::new(py, &bytes))).collect())
    }

    fn held<'py>(&self, py: Python<'py>, joined: bool) -> PyResult<HeldParts<'py>> {
        let Held { means, counts, bounds_m } =
            detached(py, || if joined { self.0.surfaces() } else { self.0.held() })?;
        let bounds = numpy::PyArrayMethods::reshape(
            &bounds_m.into_flattened().into_pyarray(py),
            [counts.len(), 2],
        )?;
        Ok((rows(py, means)?, counts.into_pyarray(py), bounds))
    }

    #[getter]
    fn voxel_m(&self) -> f64 {
        self.0.voxel_m()
    }

    #[getter]
    fn voxels(&self) -> usize {
        self.0.voxels()
    }

    #[getter]
    fn points(&self) -> u64 {
        self.0.points()
    }

    #[getter]
    fn dropped(&self) -> [u64; 2] {
        self.0.dropped()
    }
}
