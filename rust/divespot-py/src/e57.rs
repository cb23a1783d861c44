//! Reads E57 files (ASTM E2807) with the crate `e57`: coordinates as stored, and poses.

use std::any::Any;
use std::cell::Cell;
use std::io::{self, Cursor, Read, Seek, SeekFrom};
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::rc::Rc;

use ::e57::{E57Reader, PointCloud, RecordName, Transform};
use divespot_core::cancel::poll;
use divespot_core::memory_for;
use numpy::{PyArray1, PyArray2, PyArrayMethods};
use pyo3::prelude::*;
use pyo3::types::PyBytes;

use crate::errors::DivespotError;
use crate::interrupt::attempted;

/// The columns that are read, and their names in the standard.
const WANTED: [(RecordName, &str); 8] = [
    (RecordName::CartesianX, "cartesianX"),
    (RecordName::CartesianY, "cartesianY"),
    (RecordName::CartesianZ, "cartesianZ"),
    (RecordName::CartesianInvalidState, "cartesianInvalidState"),
    (RecordName::SphericalRange, "sphericalRange"),
    (RecordName::SphericalAzimuth, "sphericalAzimuth"),
    (RecordName::SphericalElevation, "sphericalElevation"),
    (RecordName::SphericalInvalidState, "sphericalInvalidState"),
];

/// Bytes without a point after which a file is corrupt: packets hold at most 64 kB. Values of a
/// column that is ahead of the others are buffered, 24 bytes for each bit.
const MOST_WITHOUT_POINTS: usize = 1 << 21;

/// Points between two checks for cancellation. Decides no answer.
const EVERY: usize = 1 << 14;

struct Scan {
    names: Vec<&'static str>,
    /// One row for each point.
    values: Vec<f64>,
    /// Quaternion w, x, y, z, and translation in m.
    pose: Option<[f64; 7]>,
}

type RawScan<'py> = (Vec<&'static str>, Bound<'py, PyArray2<f64>>, Option<[f64; 7]>);

/// The coordinate system of a file; and for each scan the names of its columns, their values of
/// shape (n, columns), and its pose.
#[pyfunction]
pub(crate) fn read_e57<'py>(
    py: Python<'py>,
    data: &Bound<'py, PyBytes>,
) -> PyResult<(Option<String>, Vec<RawScan<'py>>)> {
    let bytes = data.as_bytes();
    let found = attempted(py, || caught(|| read(bytes)))?;
    let (system, scans) = found.map_err(DivespotError::new_err)?;
    let rows = scans.into_iter().map(|scan| {
        let shape = [scan.values.len() / scan.names.len(), scan.names.len()];
        let values = PyArray1::from_vec(py, scan.values).reshape(shape)?;
        Ok((scan.names, values, scan.pose))
    });
    Ok((system, rows.collect::<PyResult<_>>()?))
}

type Outcome = Result<(Option<String>, Vec<Scan>), String>;

/// Runs `work`; a panic of the crate becomes an error, a cancellation continues.
fn caught(work: impl FnOnce() -> divespot_core::Result<Outcome>) -> divespot_core::Result<Outcome> {
    catch_unwind(AssertUnwindSafe(work)).unwrap_or_else(|payload| match said(&*payload) {
        Some(sentence) => Ok(Err(sentence)),
        None => resume_unwind(payload),
    })
}

fn said(payload: &(dyn Any + Send)) -> Option<String> {
    let text = payload.downcast_ref::<&str>().map(ToString::to_string);
    text.or_else(|| payload.downcast_ref::<String>().cloned())
}

fn read(bytes: &[u8]) -> divespot_core::Result<Outcome> {
    let budget = Budget(Rc::new(Cell::new(MOST_WITHOUT_POINTS.max(bytes.len()))));
    let source = Source { bytes: Cursor::new(bytes), budget: budget.clone() };
    let mut file = match E57Reader::new(source) {
        Ok(file) => file,
        Err(error) => return Ok(Err(error.to_string())),
    };
    let mut scans = Vec::new();
    for cloud in file.pointclouds() {
        match read_scan(&mut file, &cloud, bytes.len(), &budget)? {
            Ok(scan) => scans.push(scan),
            Err(sentence) => return Ok(Err(sentence)),
        }
    }
    Ok(Ok((file.coordinate_metadata().map(str::to_owned), scans)))
}

fn read_scan(
    file: &mut E57Reader<Source<'_>>,
    cloud: &PointCloud,
    size: usize,
    budget: &Budget,
) -> divespot_core::Result<Result<Scan, String>> {
    let at: Vec<_> = WANTED.iter().filter_map(|(name, text)| place(cloud, name, text)).collect();
    let names: Vec<_> = at.iter().map(|&(_, text)| text).collect();
    let pose = cloud.transform.as_ref().map(numbers);
    let mut scan = Scan { names, values: Vec::new(), pose };
    let records = usize::try_from(cloud.records).unwrap_or(usize::MAX);
    if let Some(doubt) = doubt(cloud, records, size) {
        return Ok(Err(doubt));
    }
    if records == 0 {
        return Ok(Ok(scan));
    }
    let bytes = records.saturating_mul(8 * at.len());
    memory_for(bytes, || format!("{records} points of an E57 file"))?;
    scan.values.reserve_exact(records * at.len());
    let points = match file.pointcloud_raw(cloud) {
        Ok(points) => points,
        Err(error) => return Ok(Err(error.to_string())),
    };
    for (count, point) in points.enumerate() {
        if count % EVERY == 0 {
            poll();
        }
        budget.0.set(MOST_WITHOUT_POINTS);
        let row = point.and_then(|point| {
            at.iter()
                .map(|&(i, _)| point[i].to_f64(&cloud.prototype[i].data_type))
                .collect::<::e57::Result<Vec<_>>>()
        });
        match row {
            Ok(row) => scan.values.extend(row),
            Err(error) => return Ok(Err(error.to_string())),
        }
    }
    Ok(Ok(scan))
}

fn place(
    cloud: &PointCloud,
    name: &RecordName,
    text: &'static str,
) -> Option<(usize, &'static str)> {
    Some((cloud.prototype.iter().position(|record| record.name == *name)?, text))
}

/// What is wrong with the counts of a scan, found before memory is allocated: a point takes at
/// least one bit.
fn doubt(cloud: &PointCloud, records: usize, size: usize) -> Option<String> {
    if records > size.saturating_mul(8) {
        return Some(format!("it promises {records} points in {size} bytes"));
    }
    if !WANTED.iter().any(|(name, text)| place(cloud, name, text).is_some()) {
        return Some("a scan has neither Cartesian nor spherical coordinates".to_owned());
    }
    let constant = cloud.prototype.iter().all(|record| is_constant(&record.data_type));
    constant.then(|| "all of its points are one and the same".to_owned())
}

/// Whether a column takes no space, so that the crate would produce values without end.
fn is_constant(kind: &::e57::RecordDataType) -> bool {
    use ::e57::RecordDataType::{Integer, ScaledInteger};
    matches!(*kind, Integer { min, max } | ScaledInteger { min, max, .. } if min == max)
}

fn numbers(pose: &Transform) -> [f64; 7] {
    let (q, t) = (&pose.rotation, &pose.translation);
    [q.w, q.x, q.y, q.z, t.x, t.y, t.z]
}

/// Bytes that may still be read before the next point.
#[derive(Clone)]
struct Budget(Rc<Cell<usize>>);

/// A file in memory.
struct Source<'a> {
    bytes: Cursor<&'a [u8]>,
    budget: Budget,
}

impl Read for Source<'_> {
    fn read(&mut self, into: &mut [u8]) -> io::Result<usize> {
        let count = self.bytes.read(into)?;
        let left = self.budget.0.get().checked_sub(count);
        self.budget.0.set(left.ok_or_else(|| io::Error::other("no point for 2 MB"))?);
        Ok(count)
    }
}

impl Seek for Source<'_> {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        self.bytes.seek(to)
    }
}
