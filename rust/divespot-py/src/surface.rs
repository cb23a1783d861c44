//! Binds the walk over the surface, the clusters and the hills; lengths in m.

use divespot_core::hdbscan::{Selection, Settings, hdbscan};
use divespot_core::surface::{self, Hills};
use divespot_core::voxel::voxels_and_rows;
use divespot_core::{Cloud, Point, both, thread_count};
use numpy::IntoPyArray;
use pyo3::prelude::*;

use crate::array::ReadonlyArray2;
use crate::interrupt::attempted;
use crate::piles::Map;
use crate::points::{Column, Near, Rows, need, restored, rows};

/// Means of voxels, unless they were clustered; number of points in each, and the voxel of each
/// point.
type VoxelParts<'py> = (Rows<'py>, Column<'py, u32>, Column<'py, u32>);

/// Fewest points of a cluster, the neighbour whose distance is the core distance, and the distance
/// in m below which clusters are not split.
type Clustering = (usize, usize, f64);

/// Which points lie on the surface that can be walked from the ground, or from `anywhere`; and,
/// computed in parallel, the points thinned to voxels and, if wanted, the clusters of their means.
#[pyfunction]
#[allow(clippy::too_many_arguments)] // the walk's, the voxels' and the clusters'
pub(crate) fn surface_and_clusters<'py>(
    py: Python<'py>,
    points: &Bound<'py, PyAny>,
    cell_m: f64,
    noise_m: f64,
    anywhere: bool,
    voxel_m: f64,
    clustering: Option<Clustering>,
    threads: usize,
) -> PyResult<(Column<'py, bool>, VoxelParts<'py>, Option<Column<'py, i32>>)> {
    let near = Near::of(points, true, threads, need::VOXELS)?;
    let (points, origin) = (near.places(), near.origin());
    let half = thread_count(threads).div_ceil(2);
    let walk = || surface::surface_points_on(half, points, cell_m, noise_m, anywhere);
    let thin = || {
        let (mut voxels, of) = voxels_and_rows(points, voxel_m, threads)?;
        voxels.means = restored(origin, voxels.means);
        let mut label = |c| clusters(std::mem::take(&mut voxels.means), c, threads);
        let labels = clustering.map(&mut label).transpose()?;
        Ok((voxels, of, labels))
    };
    let (mask, (voxels, of, labels)) = attempted(py, || {
        let (mask, thinned) = both(threads, walk, thin);
        let (mask, (voxels, of, labels)) = (mask?, thinned?);
        Ok((mask, (voxels, of.of(points, threads), labels)))
    })?;
    let parts = (rows(py, voxels.means)?, voxels.counts.into_pyarray(py), of.into_pyarray(py));
    Ok((mask.into_pyarray(py), parts, labels.map(|labels| labels.into_pyarray(py))))
}

/// The clusters of points connected across gaps below a distance; all points may be one.
fn clusters(
    points: Vec<Point>,
    (min_cluster_size, min_samples, cluster_selection_epsilon): Clustering,
    threads: usize,
) -> divespot_core::Result<Vec<i32>> {
    if points.len() < min_cluster_size {
        return Ok(vec![-1; points.len()]);
    }
    let cloud = Cloud::new(points.len(), threads, |row| points[row]);
    drop(points); // before clustering, which takes the most memory
    let settings = Settings {
        min_cluster_size,
        min_samples,
        cluster_selection_epsilon,
        selection: Selection::ExcessOfMass,
        allow_single_cluster: true,
        threads,
    };
    hdbscan(&cloud.points, &settings).map(|found| found.labels)
}

/// Labels of hills, ground cells, height of the ground in each cell in m, and its noise in m.
type HillParts<'py> = (Column<'py, i32>, Column<'py, bool>, Column<'py, f64>, f64);

/// The hills on the ground, then the holes if they are wanted.
#[pyfunction]
pub(crate) fn hills<'py>(
    py: Python<'py>,
    heights_m: ReadonlyArray2<'py, f64>,
    cell_m: f64,
    with_holes: bool,
    threads: usize,
) -> PyResult<Vec<HillParts<'py>>> {
    let map = Map::new(&heights_m, [0.0; 2], cell_m);
    let found = attempted(py, || match with_holes {
        true => surface::hills_and_holes(&map.grid, &map.heights_m, threads),
        false => surface::hills(&map.grid, &map.heights_m).map(|hills| vec![hills]),
    })?;
    let parts = |hills: Hills| {
        let Hills { labels, ground, terrain } = hills;
        (
            labels.into_pyarray(py),
            ground.into_pyarray(py),
            terrain.surface_m.into_pyarray(py),
            terrain.noise_m,
        )
    };
    Ok(found.into_iter().map(parts).collect())
}
