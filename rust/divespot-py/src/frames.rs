//! Binds depth frames: cameras, patches, registration, joint solution, fusion; lengths in m.

use divespot_core::frames::{
    Camera, Cutter, Fusion, Lost, Motion, Noise, NoiseTable, Patch, Placed, Still, Tracker,
    usable_pixels,
};
use nalgebra::{Matrix3, Vector3};
use numpy::{IntoPyArray, PyArray2};
use pyo3::prelude::*;

use crate::array::ReadonlyArray2;
use crate::errors::{DivespotError, raise};
use crate::interrupt::detached;
use crate::points::{Column, Rows, rows};

/// Coefficients of a noise model.
type Coefficients = (f64, f64, f64);

/// A pose as three rows of four numbers.
type Pose = [[f64; 4]; 3];

/// Overlap, share that agrees with the model, standard deviation, direction in which the frame
/// slides.
type PlacedParts = (f64, f64, f64, Option<[f64; 3]>);

/// The rays of a camera.
#[pyclass(frozen)]
pub(crate) struct RawCamera {
    camera: Camera,
}

#[pymethods]
impl RawCamera {
    #[new]
    fn new(rays: ReadonlyArray2<'_, f64>, shape: (usize, usize)) -> PyResult<Self> {
        let rays = rays.as_array();
        if rays.ncols() != 3 {
            return Err(DivespotError::new_err(format!(
                "the rays have {} numbers each: three are needed",
                rays.ncols()
            )));
        }
        let rays: Vec<[f64; 3]> = rays.rows().into_iter().map(|r| [r[0], r[1], r[2]]).collect();
        Ok(Self { camera: Camera::new(shape.0, shape.1, &rays).map_err(raise)? })
    }
}

/// Ranges in m, NaN where a pixel has no depth.
fn ranges(array: &ReadonlyArray2<'_, f32>, camera: &Camera) -> PyResult<Vec<f32>> {
    let array = array.as_array();
    if array.dim() != (camera.rows, camera.columns) {
        let (rows, columns) = array.dim();
        return Err(DivespotError::new_err(format!(
            "a frame has {rows} x {columns} pixels: {} x {}, as the others, are needed",
            camera.rows, camera.columns
        )));
    }
    let range = |&r: &f32| if r > 0.0 && r.is_finite() { r } else { f32::NAN };
    Ok(match array.as_slice() {
        Some(held) => held.iter().map(range).collect(),
        None => array.iter().map(range).collect(),
    })
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

fn noise_of((at_metre_m, power, incidence): Coefficients) -> Noise {
    Noise { at_metre_m, power, incidence }
}

/// The joint solution of all poses.
#[pyclass(frozen, get_all)]
pub(crate) struct RawJoint {
    poses: Vec<Option<Pose>>,
    solved: Vec<bool>,
    slides: Vec<bool>,
    offsets_m: Vec<f64>,
    offset_m: f64,
    u_offset_m: f64,
    between_m: f64,
    u_height_m: f64,
    u_place_m: f64,
    place_m: f64,
    uneven_m: f64,
    loops: usize,
    has_floor: bool,
    range_m: f64,
    noise: Coefficients,
}

/// The patches of a frame.
#[pyclass(frozen)]
pub(crate) struct RawPatches {
    patches: Vec<Patch>,
}

#[pyclass]
pub(crate) struct RawCutter {
    cutter: Cutter,
}

#[pymethods]
impl RawCutter {
    #[new]
    fn new(threads: usize) -> Self {
        Self { cutter: Cutter::new(None, threads) }
    }

    fn cut(
        &mut self,
        py: Python<'_>,
        camera: &RawCamera,
        ranges_m: ReadonlyArray2<'_, f32>,
    ) -> PyResult<RawPatches> {
        let ranges_m = ranges(&ranges_m, &camera.camera)?;
        let cutter = &mut self.cutter;
        let patches = detached(py, || cutter.cut(&camera.camera, &ranges_m))?;
        Ok(RawPatches { patches })
    }

    fn noise(&self) -> Coefficients {
        let noise = self.cutter.noise();
        (noise.at_metre_m, noise.power, noise.incidence)
    }
}

#[pyclass]
pub(crate) struct RawTracker {
    tracker: Tracker,
}

#[pymethods]
impl RawTracker {
    #[new]
    fn new(threads: usize) -> Self {
        Self { tracker: Tracker::new(threads) }
    }

    /// How the frame was placed, or why it was not.
    fn add(
        &mut self,
        py: Python<'_>,
        patches: Option<PyRef<'_, RawPatches>>,
        given: Option<Pose>,
        exact: bool,
    ) -> PyResult<(Option<PlacedParts>, &'static str)> {
        let given = given.as_ref().map(motion);
        let tracker = &mut self.tracker;
        let patches: &[Patch] = patches.as_ref().map_or(&[], |cut| &cut.patches);
        let found = detached(py, || tracker.add(patches, given, exact))?;
        Ok(match found {
            Ok(Placed { overlap, lying, sigma_m, sliding }) => {
                (Some((overlap, lying, sigma_m, sliding)), "")
            }
            Err(Lost::Empty) => (None, "empty"),
            Err(Lost::Overlap) => (None, "overlap"),
            Err(Lost::Fit) => (None, "fit"),
        })
    }

    /// The pose of a frame that was placed, but is not part of the joint solution.
    fn settled(&self, py: Python<'_>, number: usize, patches: &RawPatches) -> PyResult<Pose> {
        let found = detached(py, || self.tracker.settled(number, &patches.patches))?;
        found
            .as_ref()
            .map(pose)
            .ok_or_else(|| DivespotError::new_err("the frame was left out: a placed one is needed"))
    }

    /// Memory of the model and of the frames, in bytes.
    fn bytes(&self) -> (usize, usize) {
        self.tracker.bytes()
    }

    /// The poses as the frames were placed one by one.
    fn poses(&self) -> Vec<Option<Pose>> {
        self.tracker.poses().iter().map(|one| one.as_ref().map(pose)).collect()
    }

    fn solve(
        &mut self,
        py: Python<'_>,
        coefficients: Coefficients,
        exact: bool,
    ) -> PyResult<RawJoint> {
        let tracker = &mut self.tracker;
        let noise = noise_of(coefficients);
        let joint = detached(py, || tracker.solve(&noise, exact))?;
        Ok(RawJoint {
            poses: joint.poses.iter().map(|one| one.as_ref().map(pose)).collect(),
            solved: joint.solved,
            slides: joint.slides,
            offsets_m: joint.offsets_m,
            offset_m: joint.offset_m,
            u_offset_m: joint.u_offset_m,
            between_m: joint.between_m,
            u_height_m: joint.u_height_m,
            u_place_m: joint.u_place_m,
            place_m: joint.place_m,
            uneven_m: joint.uneven_m,
            loops: joint.loops,
            has_floor: joint.has_floor,
            range_m: self.tracker.range_m(),
            noise: coefficients,
        })
    }
}

/// Points, number of pixels and of frames of each, and standard deviation of its heights in m.
type FusedParts<'py> = (Rows<'py>, Column<'py, u32>, Column<'py, u32>, Column<'py, f64>);

#[pyclass]
pub(crate) struct RawFusion {
    fusion: Fusion,
    threads: usize,
}

#[pymethods]
impl RawFusion {
    #[new]
    fn new(
        voxel_m: f64,
        coefficients: Coefficients,
        range_m: f64,
        threads: usize,
    ) -> PyResult<Self> {
        let fusion = Fusion::new(voxel_m, &noise_of(coefficients), range_m).map_err(raise)?;
        Ok(Self { fusion, threads: divespot_core::thread_count(threads) })
    }

    fn add(
        &mut self,
        py: Python<'_>,
        camera: &RawCamera,
        ranges_m: ReadonlyArray2<'_, f32>,
        pose: Pose,
        offset_m: f64,
    ) -> PyResult<()> {
        let camera = &camera.camera;
        let ranges_m = ranges(&ranges_m, camera)?;
        let pose = motion(&pose);
        let Self { fusion, threads } = self;
        detached(py, || {
            let usable = usable_pixels(camera, &ranges_m, fusion.noise(), *threads);
            fusion.add(camera, &ranges_m, &usable, &pose, offset_m, *threads);
        })
    }

    /// Memory of the voxels, in bytes.
    fn bytes(&self) -> usize {
        self.fusion.bytes()
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

/// Mean ranges, standard deviations of a pixel and of a frame, share left out.
type AveragedParts<'py> = (Bound<'py, PyArray2<f32>>, f64, f64, f64);

/// The frames of a camera that does not move.
#[pyclass]
pub(crate) struct RawStill {
    shape: [usize; 2],
    still: Still,
}

impl RawStill {
    /// Runs `take` on a frame's ranges.
    fn seen(
        &mut self,
        py: Python<'_>,
        camera: &RawCamera,
        ranges_m: &ReadonlyArray2<'_, f32>,
        take: fn(&mut Still, &[f32]),
    ) -> PyResult<()> {
        let ranges_m = ranges(ranges_m, &camera.camera)?;
        detached(py, || take(&mut self.still, &ranges_m))
    }
}

#[pymethods]
impl RawStill {
    #[new]
    fn new(shape: [usize; 2], coefficients: Coefficients, threads: usize) -> Self {
        let noise = NoiseTable::new(&noise_of(coefficients));
        Self { shape, still: Still::new(shape[0] * shape[1], noise, threads) }
    }

    fn vote(
        &mut self,
        py: Python<'_>,
        camera: &RawCamera,
        ranges_m: ReadonlyArray2<'_, f32>,
    ) -> PyResult<()> {
        self.seen(py, camera, &ranges_m, Still::vote)
    }

    fn add(
        &mut self,
        py: Python<'_>,
        camera: &RawCamera,
        ranges_m: ReadonlyArray2<'_, f32>,
    ) -> PyResult<()> {
        self.seen(py, camera, &ranges_m, Still::add)
    }

    fn averaged<'py>(&self, py: Python<'py>) -> PyResult<AveragedParts<'py>> {
        let found = detached(py, || self.still.averaged())?;
        let ranges_m = found.ranges_m.into_pyarray(py);
        let shaped = numpy::PyArrayMethods::reshape(&ranges_m, self.shape)?;
        Ok((shaped, found.sigma_m, found.between_m, found.left_out))
    }

    /// Memory used, in bytes.
    fn bytes(&self) -> usize {
        self.still.bytes()
    }
}
