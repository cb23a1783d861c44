use divespot_core::frames::{
    Camera, Fusion, Lost, Motion, Noise, Placed, Tracker, averaged, usable,
};
use nalgebra::{Matrix3, Vector3};
use numpy::{IntoPyArray, PyArray2};
use pyo3::prelude::*;

use crate::array::ReadonlyArray2;
use crate::errors::{DivespotError, raise};
use crate::interrupt::{attempted, detached};
use crate::points::{Column, Rows, rows};

/// Coefficients of a noise model.
type Coefficients = (f64, f64, f64);

/// A pose, three rows of four numbers.
type Pose = [[f64; 4]; 3];

/// Overlap, share that lies on the model, deviation, direction in which the frame slides.
type PlacedParts = (f64, f64, f64, Option<[f64; 3]>);

fn camera(rays: &ReadonlyArray2<'_, f64>, shape: (usize, usize)) -> PyResult<Camera> {
    let rays = rays.as_array();
    if rays.ncols() != 3 {
        return Err(DivespotError::new_err("three numbers a ray are needed"));
    }
    let rays: Vec<[f64; 3]> = rays.rows().into_iter().map(|r| [r[0], r[1], r[2]]).collect();
    Camera::new(shape.0, shape.1, &rays).map_err(raise)
}

/// Ranges, NaN where a pixel saw nothing.
fn ranges(array: &ReadonlyArray2<'_, f32>, camera: &Camera) -> PyResult<Vec<f64>> {
    let array = array.as_array();
    if array.dim() != (camera.rows, camera.columns) {
        let (rows, columns) = array.dim();
        return Err(DivespotError::new_err(format!(
            "a frame has {rows} x {columns} pixels: {} x {}, as the others, are needed",
            camera.rows, camera.columns
        )));
    }
    let range = |&r: &f32| if r > 0.0 && r.is_finite() { f64::from(r) } else { f64::NAN };
    Ok(array.iter().map(range).collect())
}

fn motion(pose: &Pose) -> Motion {
    Motion {
        rotation: Matrix3::from_fn(|i, k| pose[i][k]),
        shift: Vector3::from_fn(|i, _| pose[i][3]),
    }
}

fn pose(motion: &Motion) -> Pose {
    let row = |i: usize| {
        let r = &motion.rotation;
        [r[(i, 0)], r[(i, 1)], r[(i, 2)], motion.shift[i]]
    };
    [row(0), row(1), row(2)]
}

fn noise((at_metre_m, power, incidence): Coefficients) -> Noise {
    Noise { at_metre_m, power, incidence }
}

/// What a joint solution of all poses gives.
#[pyclass(frozen, get_all)]
pub(crate) struct RawJoint {
    poses: Vec<Option<Pose>>,
    offsets_m: Vec<f64>,
    offset_m: f64,
    u_offset_m: f64,
    between_m: f64,
    u_height_m: f64,
    uneven_m: f64,
    loops: usize,
    has_floor: bool,
    range_m: f64,
    noise: Coefficients,
}

#[pyclass]
pub(crate) struct RawTracker {
    camera: Camera,
    tracker: Tracker,
}

#[pymethods]
impl RawTracker {
    #[new]
    fn new(rays: ReadonlyArray2<'_, f64>, shape: (usize, usize), threads: usize) -> PyResult<Self> {
        let camera = camera(&rays, shape)?;
        Ok(Self { tracker: Tracker::new(camera.clone(), None, threads), camera })
    }

    /// How the frame was placed, or why it was not.
    fn add(
        &mut self,
        py: Python<'_>,
        ranges_m: ReadonlyArray2<'_, f32>,
        given: Option<Pose>,
        exact: bool,
    ) -> PyResult<(Option<PlacedParts>, &'static str)> {
        let ranges_m = ranges(&ranges_m, &self.camera)?;
        let given = given.as_ref().map(motion);
        let tracker = &mut self.tracker;
        let found = detached(py, || tracker.add(&ranges_m, given, exact))?;
        Ok(match found {
            Ok(Placed { overlap, lying, sigma_m, sliding }) => {
                (Some((overlap, lying, sigma_m, sliding)), "")
            }
            Err(Lost::Empty) => (None, "empty"),
            Err(Lost::Overlap) => (None, "overlap"),
            Err(Lost::Fit) => (None, "fit"),
        })
    }

    /// The poses as the frames were placed one by one.
    fn poses(&self) -> Vec<Option<Pose>> {
        self.tracker.poses().iter().map(|one| one.as_ref().map(pose)).collect()
    }

    fn solve(&mut self, py: Python<'_>, exact: bool) -> PyResult<RawJoint> {
        let tracker = &mut self.tracker;
        let joint = detached(py, || tracker.solve(exact))?;
        let noise = self.tracker.noise();
        Ok(RawJoint {
            poses: joint.poses.iter().map(|one| one.as_ref().map(pose)).collect(),
            offsets_m: joint.offsets_m,
            offset_m: joint.offset_m,
            u_offset_m: joint.u_offset_m,
            between_m: joint.between_m,
            u_height_m: joint.u_height_m,
            uneven_m: joint.uneven_m,
            loops: joint.loops,
            has_floor: joint.has_floor,
            range_m: self.tracker.range_m(),
            noise: (noise.at_metre_m, noise.power, noise.incidence),
        })
    }
}

/// Points, pixels and frames of each, and the standard deviation of its heights.
type FusedParts<'py> = (Rows<'py>, Column<'py, u32>, Column<'py, u32>, Column<'py, f64>);

#[pyclass]
pub(crate) struct RawFusion {
    camera: Camera,
    noise: Noise,
    fusion: Fusion,
    threads: usize,
}

#[pymethods]
impl RawFusion {
    #[new]
    fn new(
        rays: ReadonlyArray2<'_, f64>,
        shape: (usize, usize),
        voxel_m: f64,
        coefficients: Coefficients,
        range_m: f64,
        threads: usize,
    ) -> PyResult<Self> {
        let (camera, noise) = (camera(&rays, shape)?, noise(coefficients));
        let fusion = Fusion::new(voxel_m, &noise, range_m).map_err(raise)?;
        Ok(Self { camera, noise, fusion, threads: divespot_core::thread_count(threads) })
    }

    fn add(
        &mut self,
        py: Python<'_>,
        ranges_m: ReadonlyArray2<'_, f32>,
        pose: Pose,
        offset_m: f64,
    ) -> PyResult<()> {
        let ranges_m = ranges(&ranges_m, &self.camera)?;
        let pose = motion(&pose);
        let Self { camera, noise, fusion, threads } = self;
        detached(py, || {
            let usable = usable(camera, &ranges_m, noise, *threads);
            fusion.add(camera, &ranges_m, &usable, &pose, offset_m, *threads);
        })
    }

    fn merge(&mut self, other: PyRef<'_, Self>) {
        self.fusion.merge(&other.fusion);
    }

    fn points<'py>(&self, py: Python<'py>) -> PyResult<FusedParts<'py>> {
        let fusion = &self.fusion;
        let fused = detached(py, || fusion.points())?;
        Ok((
            rows(py, fused.points)?,
            fused.counts.into_pyarray(py),
            fused.frames.into_pyarray(py),
            fused.spreads_m.into_pyarray(py),
        ))
    }
}

/// Mean ranges, counts, deviations of a pixel and of a frame, share left out.
type AveragedParts<'py> = (Bound<'py, PyArray2<f32>>, Column<'py, u32>, f64, f64, f64);

/// The mean of frames of a camera that stands still, each a row.
#[pyfunction]
pub(crate) fn average_frames<'py>(
    py: Python<'py>,
    frames: ReadonlyArray2<'py, f32>,
    columns: usize,
    threads: usize,
) -> PyResult<AveragedParts<'py>> {
    let (count, pixels) = frames.as_array().dim();
    let held: Vec<f32> = frames.as_array().iter().copied().collect();
    if columns == 0 || !pixels.is_multiple_of(columns) {
        return Err(DivespotError::new_err("whole rows of pixels are needed"));
    }
    let frame = |f: usize, i: usize| {
        let r = held[f * pixels + i];
        if r > 0.0 && r.is_finite() { f64::from(r) } else { f64::NAN }
    };
    let found = attempted(py, || Ok(averaged(count, pixels, frame, threads)))?;
    let means: Vec<f32> = found.ranges_m.iter().map(|&r| r as f32).collect();
    let shaped =
        numpy::PyArrayMethods::reshape(&means.into_pyarray(py), [pixels / columns, columns])?;
    Ok((shaped, found.counts.into_pyarray(py), found.sigma_m, found.between_m, found.left_out))
}
