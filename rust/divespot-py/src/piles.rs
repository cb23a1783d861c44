//! Binds the measuring of objects; lengths in m, volumes in m³.

use divespot_core::heightmap::Grid;
use divespot_core::piles::{
    self, Base, Budget, Found, Inside, Kind, Marked, Object, Region, Seen, Settings, Standing,
};
use numpy::{IntoPyArray, PyArray1, PyArray2, PyArrayMethods};
use pyo3::prelude::*;
use pyo3::types::{IntoPyDict, PyDict, PyList};

use crate::array::{ReadonlyArray1, ReadonlyArray2};
use crate::bases::RawBase;
use crate::interrupt::{attempted, detached};

/// A position as a tuple.
type Place = (f64, f64, f64);

/// The terms of an uncertainty budget; in Python a dict.
#[derive(Clone)]
struct Terms(Budget);

impl<'py> IntoPyObject<'py> for Terms {
    type Target = PyDict;
    type Output = Bound<'py, PyDict>;
    type Error = PyErr;

    fn into_pyobject(self, py: Python<'py>) -> PyResult<Self::Output> {
        self.0.terms().into_py_dict(py)
    }
}

/// One measured object; lengths in m in the levelled frame.
#[pyclass(frozen, get_all)]
#[derive(Clone)]
pub(crate) struct RawObject {
    label: i32,
    cut_m3: f64,
    fill_m3: f64,
    compared_m3: Vec<f64>,
    footprint_m2: f64,
    max_height_m: f64,
    centroid_m: Place,
    outline_m: Vec<Place>,
    seen_fraction: f64,
    touches_edge: bool,
    leans_on_wall: bool,
    base_from: Option<&'static str>,
    reason: Option<String>,
    budget: Terms,
}

#[pymethods]
impl RawObject {
    /// The same object with another registration uncertainty and reason.
    fn judged(&self, registration_m3: f64, reason: Option<String>) -> Self {
        let budget = Terms(Budget { registration_m3, ..self.budget.0 });
        Self { budget, reason, ..self.clone() }
    }

    /// Combined standard uncertainty of the volume, in m³.
    fn combined_m3(&self) -> f64 {
        self.budget.0.combined_m3()
    }

    /// The object, measured as a hill of the surface turned upside down, as a hole.
    fn as_hole(&self) -> Self {
        let turned = |(x, y, z): Place| (x, y, -z);
        Self {
            cut_m3: self.fill_m3,
            fill_m3: self.cut_m3,
            max_height_m: -self.max_height_m,
            centroid_m: turned(self.centroid_m),
            outline_m: self.outline_m.iter().copied().map(turned).collect(),
            reason: Some("hole".to_owned()),
            ..self.clone()
        }
    }
}

impl From<Object> for RawObject {
    fn from(object: Object) -> Self {
        Self {
            label: object.label,
            cut_m3: object.volume.cut_m3,
            fill_m3: object.volume.fill_m3,
            compared_m3: object.compared_m3,
            footprint_m2: object.footprint_m2,
            max_height_m: object.max_height_m,
            centroid_m: object.centroid_m.into(),
            outline_m: object.outline_m.into_iter().map(Place::from).collect(),
            seen_fraction: object.seen_fraction,
            touches_edge: object.touches_edge,
            leans_on_wall: object.leans_on_wall,
            base_from: match object.base.kind {
                Kind::Annulus => Some("annulus"),
                Kind::AnnulusLevel => Some("annulus level"),
                Kind::Ground => Some("ground"),
                Kind::Given => None,
            },
            reason: object.reason.map(|reason| reason.text().to_owned()),
            budget: Terms(object.budget),
        }
    }
}

#[pyfunction]
pub(crate) fn label_components<'py>(
    py: Python<'py>,
    labels: ReadonlyArray2<'py, i32>,
    gap: u32,
    fewest: usize,
) -> PyResult<Bound<'py, PyArray1<i32>>> {
    let labels = labels.as_array();
    let grid = grid_of(labels.dim(), [0.0; 2], 1.0);
    let labels: Vec<i32> = labels.iter().copied().collect();
    Ok(detached(py, || piles::label_components(&grid, &labels, gap, fewest))?.into_pyarray(py))
}

pub(crate) fn grid_of((rows, columns): (usize, usize), origin_m: [f64; 2], cell_m: f64) -> Grid {
    Grid { origin_m, cell_m, columns, rows }
}

/// A height map, copied while attached.
pub(crate) struct Map {
    pub(crate) grid: Grid,
    pub(crate) heights_m: Vec<f64>,
}

impl Map {
    pub(crate) fn new(
        heights_m: &ReadonlyArray2<'_, f64>,
        origin_m: [f64; 2],
        cell_m: f64,
    ) -> Self {
        let heights = heights_m.as_array();
        Self {
            grid: grid_of(heights.dim(), origin_m, cell_m),
            heights_m: heights.iter().copied().collect(),
        }
    }
}

/// Steps of the toe; width of the annulus by object size; margin; ground (height, noise,
/// uncertainty); link and fewest cells of a thing; the bases: the one in force, then those to
/// compare, `None` for a local base; number of threads.
type Measuring<'py> =
    (u32, f64, f64, (f64, f64, f64), (u32, usize), Vec<Option<PyRef<'py, RawBase>>>, usize);

fn settings_of(measuring: Measuring<'_>) -> Settings {
    let (toe_cells, annulus_share, margin_m, ground, things, bases, threads) = measuring;
    let (link_cells, fewest_cells) = things;
    let ground = Base::ground(ground.0, ground.1, ground.2);
    let mut bases = bases.into_iter().map(|base| base.map(|base| base.0.clone()));
    let base = bases.next().flatten();
    Settings {
        toe_cells,
        annulus_share,
        margin_m,
        base,
        compared: bases.collect(),
        ground,
        link_cells,
        fewest_cells,
        threads,
    }
}

/// Objects, and height of the base in each measured cell.
type Measured<'py> = (Vec<RawObject>, Bound<'py, PyArray2<f64>>);

fn measured<'py>(
    py: Python<'py>,
    map: &Map,
    measure: impl FnOnce() -> divespot_core::Result<Vec<Object>> + Send,
) -> PyResult<Measured<'py>> {
    let (base_m, objects) =
        attempted(py, || measure().map(|objects| (piles::base_map(&map.grid, &objects), objects)))?;
    let base_m = base_m.into_pyarray(py).reshape([map.grid.rows, map.grid.columns])?;
    Ok((objects.into_iter().map(RawObject::from).collect(), base_m))
}

/// Labels and marks of ground of the cells; and a list of points, which are on the surface, and
/// which are apart from the ground. The list is emptied, and what it held is freed once it has been
/// used.
type FoundArrays<'py> = (ReadonlyArray1<'py, i32>, ReadonlyArray1<'py, bool>, Bound<'py, PyList>);

/// The objects that stand on the ground.
#[pyfunction]
pub(crate) fn measure_objects<'py>(
    py: Python<'py>,
    heights_m: ReadonlyArray2<'py, f64>,
    origin_m: [f64; 2],
    cell_m: f64,
    found: FoundArrays<'py>,
    measuring: Measuring<'py>,
) -> PyResult<Measured<'py>> {
    let map = Map::new(&heights_m, origin_m, cell_m);
    let (labels, ground, points) = found;
    let points = taken(&points)?;
    let found = found_from(&labels, &ground, &points)?;
    let settings = settings_of(measuring);
    let standing = attempted(py, || Standing::of(&map.grid, &map.heights_m, &found, &settings))?;
    let found = found.without_points();
    drop(points);
    measured(py, &map, || Ok(standing.measured(&found, &settings)))
}

/// Points, which of them are on the surface, and which are apart from the ground.
type Points<'py> = (ReadonlyArray2<'py, f64>, ReadonlyArray1<'py, bool>, ReadonlyArray1<'py, bool>);

/// The arrays of a list, which is left empty.
fn taken<'py>(list: &Bound<'py, PyList>) -> PyResult<Points<'py>> {
    let points = list.to_tuple().extract()?;
    list.del_slice(0, list.len())?;
    Ok(points)
}

/// The points are borrowed, since nothing else holds them.
fn found_from<'a>(
    labels: &ReadonlyArray1<'_, i32>,
    ground: &ReadonlyArray1<'_, bool>,
    (points, is_on, is_apart): &'a Points<'_>,
) -> PyResult<Found<'a>> {
    let labels: Vec<i32> = labels.as_array().iter().copied().collect();
    let ground: Vec<bool> = ground.as_array().iter().copied().collect();
    let all = points.as_slice()?.as_chunks::<3>().0;
    let is_on = is_on.as_slice()?;
    let (mut loose, mut apart) = (vec![], vec![]);
    for ((p, _), is_apart) in
        all.iter().zip(is_on).zip(is_apart.as_array()).filter(|((_, is_on), _)| !**is_on)
    {
        loose.push(*p);
        apart.push(*is_apart);
    }
    Ok(Found { labels, ground, surface: Marked::among(all, is_on), loose, apart })
}

/// Heights, number of points in each cell, and points off the surface.
type SeenArrays<'py> =
    (ReadonlyArray2<'py, f64>, ReadonlyArray2<'py, u32>, ReadonlyArray2<'py, f64>);

fn seen((heights_m, counts, loose): &SeenArrays<'_>) -> PyResult<Seen> {
    Ok(Seen {
        heights_m: heights_m.as_array().iter().copied().collect(),
        counts: counts.as_array().iter().copied().collect(),
        loose: loose.as_slice()?.as_chunks::<3>().0.to_vec(),
    })
}

/// As `measure_objects`, wherever a scan differs from the base in force: above it, and with an
/// earlier scan below it too.
#[pyfunction]
pub(crate) fn measure_difference<'py>(
    py: Python<'py>,
    later: SeenArrays<'py>,
    earlier: Option<SeenArrays<'py>>,
    origin_m: [f64; 2],
    cell_m: f64,
    measuring: Measuring<'py>,
) -> PyResult<Measured<'py>> {
    let map = Map::new(&later.0, origin_m, cell_m);
    let (later, earlier) = (seen(&later)?, earlier.as_ref().map(seen).transpose()?);
    let settings = settings_of(measuring);
    let earlier = earlier.as_ref();
    measured(py, &map, || piles::measure_difference(&map.grid, &later, earlier, &settings))
}

/// As `measure_objects`, inside outlines; for each region the lines around it, then its holes.
#[pyfunction]
pub(crate) fn measure_inside<'py>(
    py: Python<'py>,
    heights_m: ReadonlyArray2<'py, f64>,
    origin_m: [f64; 2],
    cell_m: f64,
    regions: Vec<Vec<Vec<[f64; 2]>>>,
    found: FoundArrays<'py>,
    measuring: Measuring<'py>,
) -> PyResult<Measured<'py>> {
    let map = Map::new(&heights_m, origin_m, cell_m);
    let regions: Vec<Region> = regions.into_iter().map(|rings| Region { rings }).collect();
    let (labels, ground, points) = found;
    let points = taken(&points)?;
    let found = found_from(&labels, &ground, &points)?;
    let settings = settings_of(measuring);
    let inside = attempted(py, || Inside::of(&map.grid, &map.heights_m, &found, &settings))?;
    let found = found.without_points();
    drop(points);
    measured(py, &map, || inside.measured(&regions, &found, &settings))
}
