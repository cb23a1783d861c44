//! Binds HDBSCAN clustering; distances in m.

use divespot_core::hdbscan::{Selection, Settings};
use numpy::{IntoPyArray, PyArray1};
use pyo3::prelude::*;

use crate::errors::DivespotError;
use crate::interrupt::attempted;
use crate::points::{cloud_for, need};

type Clusters<'py> =
    (Bound<'py, PyArray1<i64>>, Bound<'py, PyArray1<f64>>, Bound<'py, PyArray1<f64>>);

#[pyfunction]
#[allow(clippy::too_many_arguments)] // one for each keyword of the Python function
pub(crate) fn hdbscan<'py>(
    py: Python<'py>,
    points: &Bound<'py, PyAny>,
    min_cluster_size: usize,
    min_samples: usize,
    cluster_selection_epsilon: f64,
    cluster_selection_method: &str,
    allow_single_cluster: bool,
    threads: usize,
) -> PyResult<Clusters<'py>> {
    let settings = Settings {
        min_cluster_size,
        min_samples,
        cluster_selection_epsilon,
        selection: selection(cluster_selection_method)?,
        allow_single_cluster,
        threads,
    };
    let (cloud, count) = cloud_for(points, threads, need::HDBSCAN)?;
    let (labels, probabilities, mst_weights) = attempted(py, || {
        divespot_core::hdbscan::hdbscan(&cloud.points, &settings).map(|found| {
            let labels = found.labels.into_iter().map(i64::from).collect();
            (
                cloud.spread(labels, -1, count),
                cloud.spread(found.probabilities, 0.0, count),
                found.mst_weights,
            )
        })
    })?;
    Ok((labels.into_pyarray(py), probabilities.into_pyarray(py), mst_weights.into_pyarray(py)))
}

fn selection(method: &str) -> PyResult<Selection> {
    match method {
        "eom" => Ok(Selection::ExcessOfMass),
        "leaf" => Ok(Selection::Leaf),
        other => Err(DivespotError::new_err(format!(
            "cluster_selection_method is {other:?}: \"eom\" or \"leaf\" is needed"
        ))),
    }
}
