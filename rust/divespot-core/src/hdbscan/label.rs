//! Cluster labels and membership probabilities of the points.

use std::cmp::Ordering;

use crate::Point;
use crate::cancel::Polled;

use super::condense::{Condensed, Leave, NONE, distance};

/// Labels and probabilities of `points`.
///
/// `rows` is the row of each place, `owners` the selected cluster that holds each cluster,
/// `epsilon` the selection epsilon in the unit of the clusters' distances.
pub(super) fn label(
    points: &[Point],
    rows: &[u32],
    condensed: &Condensed,
    owners: &[u32],
    epsilon: f64,
) -> (Vec<i32>, Vec<f64>) {
    let reaches = reaches_of(condensed, epsilon);
    let owner = |leave: &Leave| {
        let &cluster = owners.get(leave.cluster as usize)?;
        let &reach = reaches.get(cluster as usize)?;
        (distance(leave.weight) <= reach).then_some(cluster as usize)
    };
    let members = || {
        let places = rows.iter().zip(&condensed.leaves);
        places
            .polled()
            .filter_map(|(&row, leave)| Some((row as usize, owner(leave)?, leave.weight)))
    };
    let numbers = number(points, owners.len(), || members().map(|(row, of, _)| (row, of)));
    let (mut labels, mut probabilities) = (vec![-1; rows.len()], vec![0.0; rows.len()]);
    for (row, cluster, weight) in members() {
        let death = condensed.clusters[cluster].death;
        labels[row] = numbers[cluster];
        probabilities[row] = (death / distance(weight)).min(1.0);
    }
    (labels, probabilities)
}

/// The distance within which a selected cluster keeps its points. If the whole cloud is the
/// cluster, it keeps points as dense as epsilon, or as its own core.
fn reaches_of(condensed: &Condensed, epsilon: f64) -> Vec<f64> {
    let reach = |cluster: &super::condense::Cluster| match cluster.parent {
        NONE if epsilon > 0.0 => epsilon,
        NONE => cluster.death,
        _ => f64::INFINITY,
    };
    condensed.clusters.iter().map(reach).collect()
}

/// Numbers the clusters by size, then by first point.
fn number<I: Iterator<Item = (usize, usize)>>(
    points: &[Point],
    count: usize,
    members: impl Fn() -> I,
) -> Vec<i32> {
    let mut sizes = vec![0u32; count];
    members().for_each(|(_, cluster)| sizes[cluster] += 1);
    let mut order: Vec<usize> = (0..count).filter(|&cluster| sizes[cluster] > 0).collect();
    order.sort_unstable_by_key(|&cluster| u32::MAX - sizes[cluster]);
    if order.windows(2).any(|pair| sizes[pair[0]] == sizes[pair[1]]) {
        let mut firsts = vec![[f64::INFINITY; 3]; count];
        for (row, cluster) in members() {
            if compare(&points[row], &firsts[cluster]) == Ordering::Less {
                firsts[cluster] = points[row];
            }
        }
        order.sort_unstable_by(|&a, &b| {
            sizes[b].cmp(&sizes[a]).then_with(|| compare(&firsts[a], &firsts[b]))
        });
    }
    let mut numbers = vec![-1; count];
    order.iter().zip(0..).for_each(|(&cluster, number)| numbers[cluster] = number);
    numbers
}

/// Order by x, then y, then z.
fn compare(a: &Point, b: &Point) -> Ordering {
    a.iter().zip(b).fold(Ordering::Equal, |order, (a, b)| order.then_with(|| a.total_cmp(b)))
}
