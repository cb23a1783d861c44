//! Exact HDBSCAN clustering of points (Campello, Moulavi and Sander 2013); distances in m.
//!
//! The conventions are those of the Python package `hdbscan`. The result does not depend on the
//! order of the points, on the number of threads, or on which of several equal edges is in the
//! spanning tree.

mod boruvka;
mod condense;
mod forest;
mod found;
mod knn;
mod label;
mod rounds;
mod search;
mod select;
mod tree;

#[cfg(test)]
mod tests;

use crate::order::sort_by;
use crate::{Bounds, Error, Point, Result, memory_for, thread_count};

/// How clusters are selected from the hierarchy.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Selection {
    /// The clusters that are more stable than those below them (excess of mass).
    ExcessOfMass,
    /// The clusters that do not split further.
    Leaf,
}

/// The definition of a cluster, and the number of threads.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Settings {
    /// Fewest points of a cluster, at least 2.
    pub min_cluster_size: usize,
    /// The neighbour whose distance is a point's core distance, at least 1; the point itself does
    /// not count. Clouds of fewer points take their last neighbour.
    pub min_samples: usize,
    /// Distance in m below which clusters are not split; 0 splits at any distance.
    pub cluster_selection_epsilon: f64,
    /// How clusters are selected from the hierarchy.
    pub selection: Selection,
    /// Whether the whole cloud may be one cluster.
    pub allow_single_cluster: bool,
    /// Number of threads, 0 for all that the process may use.
    pub threads: usize,
}

/// The clusters of a cloud.
#[derive(Debug, Clone, PartialEq)]
pub struct Clusters {
    /// Cluster of each point, 0 for the largest, -1 for noise.
    pub labels: Vec<i32>,
    /// Membership of each point in its cluster, 0 (noise) to 1.
    pub probabilities: Vec<f64>,
    /// Weights of the spanning tree's edges in m, ascending.
    pub mst_weights: Vec<f64>,
}

/// Clusters `points` by density.
///
/// Clusters are numbered by size, and those of equal size by their first point in the order of x,
/// y, z. Coinciding points are infinitely dense: they are treated as if 10⁻¹⁹ of the cloud's extent
/// apart. Distances have the precision of `f32`.
///
/// # Errors
///
/// [`Error::Setting`] for settings out of range, [`Error::Degenerate`] for coordinates that are
/// not finite or more than 2³¹ points.
///
/// # Examples
///
/// ```
/// use divespot_core::Point;
/// use divespot_core::hdbscan::{Selection, Settings, hdbscan};
///
/// // Two rows of ten points, a metre apart, and a stray.
/// let row = |y: f64| (0..10).map(move |i| [f64::from(i) * 0.01, y, 0.0]);
/// let points: Vec<Point> = row(0.0).chain(row(1.0)).chain([[9.0; 3]]).collect();
/// let settings = Settings {
///     min_cluster_size: 5,
///     min_samples: 3,
///     cluster_selection_epsilon: 0.0,
///     selection: Selection::ExcessOfMass,
///     allow_single_cluster: false,
///     threads: 0,
/// };
/// let found = hdbscan(&points, &settings)?;
/// assert_eq!(found.labels[..10], [0; 10]);
/// assert_eq!(found.labels[10..20], [1; 10]);
/// assert_eq!(found.labels[20], -1);
/// # Ok::<(), divespot_core::Error>(())
/// ```
pub fn hdbscan(points: &[Point], settings: &Settings) -> Result<Clusters> {
    settings.check()?;
    let frame = Frame::around(points)?;
    if points.len() < 2 {
        let (labels, probabilities) = (vec![-1; points.len()], vec![0.0; points.len()]);
        return Ok(Clusters { labels, probabilities, mst_weights: Vec::new() });
    }
    let threads = thread_count(settings.threads);
    let tree = tree::BlockTree::new(points, |p| frame.map(p), threads);
    let k = settings.min_samples.min(points.len() - 1);
    memory_for(threads.saturating_mul(k).saturating_mul(knn::BYTES_A_NEIGHBOR), || {
        format!("the search for {k} neighbours on {threads} threads")
    })?;
    let neighbors = knn::all_neighbors(&tree, k, threads);
    let edges = boruvka::spanning_tree(&tree, neighbors, threads);
    let rows = tree.into_rows();
    let edges = sort_by(edges, |edge| u64::from(edge.weight.to_bits()));
    let condensed = condense::condense(&edges, points.len(), settings.min_cluster_size);
    let epsilon = settings.cluster_selection_epsilon * frame.scale;
    let owners = select::select(&condensed.clusters, settings, epsilon);
    let (labels, probabilities) = label::label(points, &rows, &condensed, &owners, epsilon);
    let metres = |edge: &rounds::Edge| f64::from(edge.weight).sqrt() / frame.scale;
    Ok(Clusters { labels, probabilities, mst_weights: edges.iter().map(metres).collect() })
}

impl Settings {
    fn check(&self) -> Result<()> {
        let setting = |name, given, needed| Err(Error::Setting { name, given, needed });
        if self.min_cluster_size < 2 {
            return setting("min_cluster_size", self.min_cluster_size as f64, "2 or more");
        }
        if self.min_samples < 1 {
            return setting("min_samples", 0.0, "1 or more");
        }
        let epsilon = self.cluster_selection_epsilon;
        if !(epsilon.is_finite() && epsilon >= 0.0) {
            return setting("cluster_selection_epsilon", epsilon, "a finite number, 0 or more");
        }
        Ok(())
    }
}

/// The working coordinates: centred, and scaled by a power of two into [-1, 1], where squares of
/// `f32` neither overflow nor underflow.
struct Frame {
    centre: Point,
    scale: f64,
}

impl Frame {
    fn around(points: &[Point]) -> Result<Self> {
        if points.len() > 1 << 31 {
            return Err(Error::Degenerate(
                "more than 2147483648 points were given: at most so many are needed",
            ));
        }
        if !points.iter().flatten().all(|v| v.is_finite()) {
            return Err(Error::Degenerate(
                "a coordinate is not finite: finite coordinates are needed",
            ));
        }
        let bounds = Bounds::of(points.iter().copied());
        let Bounds { min, max } = bounds.unwrap_or(Bounds { min: [0.0; 3], max: [0.0; 3] });
        let centre = std::array::from_fn(|k| 0.5 * min[k] + 0.5 * max[k]);
        let half = (0..3).fold(0.0, |most, k| (0.5 * max[k] - 0.5 * min[k]).max(most));
        let scale = (-half.log2().ceil()).clamp(-1020.0, 1020.0).exp2();
        Ok(Self { centre, scale })
    }

    fn map(&self, p: &Point) -> [f32; 3] {
        std::array::from_fn(|k| ((p[k] - self.centre[k]) * self.scale) as f32)
    }
}
