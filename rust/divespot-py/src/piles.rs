use divespot_core::heightmap::Grid;
use divespot_core::piles::{self, Base, Kind, Object, Reason, Settings};
use numpy::{IntoPyArray, PyArray1, PyReadonlyArray1, PyReadonlyArray2};
use pyo3::prelude::*;

use crate::errors::raise;

/// A position as a tuple.
type Place = (f64, f64, f64);

/// What the core knows of one object; lengths in the levelled frame.
#[pyclass(frozen, get_all)]
pub(crate) struct RawObject {
    label: i32,
    cut_m3: f64,
    fill_m3: f64,
    footprint_m2: f64,
    max_height_m: f64,
    centroid_m: Place,
    outline_m: Vec<Place>,
    seen_fraction: f64,
    touches_edge: bool,
    base: &'static str,
    reason: Option<&'static str>,
    noise_m3: f64,
    base_m3: f64,
    footprint_m3: f64,
    filled_m3: f64,
    grid_m3: f64,
}

impl From<Object> for RawObject {
    fn from(object: Object) -> Self {
        Self {
            label: object.label,
            cut_m3: object.volume.cut_m3,
            fill_m3: object.volume.fill_m3,
            footprint_m2: object.footprint_m2,
            max_height_m: object.max_height_m,
            centroid_m: object.centroid_m.into(),
            outline_m: object.outline_m.into_iter().map(Place::from).collect(),
            seen_fraction: object.seen_fraction,
            touches_edge: object.touches_edge,
            base: match object.base.kind {
                Kind::Ring => "ring",
                Kind::RingLevel => "ring level",
                Kind::Ground => "ground",
            },
            reason: object.reason.map(|reason| match reason {
                Reason::SteepSides => "steep sides",
                Reason::Thin => "thin",
                Reason::TooLittleSeen => "too little seen",
            }),
            noise_m3: object.budget.noise_m3,
            base_m3: object.budget.base_m3,
            footprint_m3: object.budget.footprint_m3,
            filled_m3: object.budget.filled_m3,
            grid_m3: object.budget.grid_m3,
        }
    }
}

#[pyfunction]
pub(crate) fn pieces<'py>(
    py: Python<'py>,
    labels: PyReadonlyArray2<'py, i32>,
    gap: u32,
    fewest: usize,
) -> Bound<'py, PyArray1<i32>> {
    let labels = labels.as_array();
    let grid = grid(labels.dim(), [0.0; 2], 1.0);
    let labels: Vec<i32> = labels.iter().copied().collect();
    py.detach(|| piles::pieces(&grid, &labels, gap, fewest)).into_pyarray(py)
}

fn grid((rows, columns): (usize, usize), origin_m: [f64; 2], cell_m: f64) -> Grid {
    Grid { origin_m, cell_m, columns, rows }
}

#[pyfunction]
#[allow(clippy::too_many_arguments)] // the map's parts and the settings, named in Python
pub(crate) fn measure_objects(
    py: Python<'_>,
    heights_m: PyReadonlyArray2<'_, f64>,
    origin_m: [f64; 2],
    cell_m: f64,
    labels: PyReadonlyArray1<'_, i32>,
    toe_cells: u32,
    ring_share: f64,
    margin_m: f64,
    ground: (f64, f64, f64),
    local: bool,
) -> PyResult<Vec<RawObject>> {
    let grid = grid(heights_m.as_array().dim(), origin_m, cell_m);
    let heights: Vec<f64> = heights_m.as_array().iter().copied().collect();
    let labels: Vec<i32> = labels.as_array().iter().copied().collect();
    let ground = Base::ground(ground.0, ground.1, ground.2);
    let base = (!local).then(|| ground.clone());
    let settings = Settings { toe_cells, ring_share, margin_m, base, ground };
    let objects =
        py.detach(|| piles::measure(&grid, &heights, &labels, &settings)).map_err(raise)?;
    Ok(objects.into_iter().map(RawObject::from).collect())
}
