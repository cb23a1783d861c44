//! Labels and membership of the points.

use std::cmp::Ordering;

use crate::Point;

use super::condense::{Condensed, NONE, distance};

/// Labels and probabilities of `points`; `rows` is the row of each place, `owners` the selected
/// cluster of each cluster.
pub(super) fn label(
    points: &[Point],
    rows: &[u32],
    condensed: &Condensed,
    owners: &[u32],
    epsilon: f64,
) -> (Vec<i32>, Vec<f64>) {
    let root = condensed.clusters.len() as u32;
    let root = root.wrapping_sub(1);
    let reach = |cluster: u32| match cluster {
        _ if cluster != root => f64::INFINITY,
        // The whole cloud as a cluster keeps what is as dense as epsilon or its own core.
        _ if epsilon > 0.0 => epsilon,
        _ => condensed.clusters[cluster as usize].death,
    };
    let owner = |place: usize| {
        let cluster = *owners.get(condensed.owners[place] as usize)?;
        let inside = cluster != NONE && distance(condensed.leaves[place]) <= reach(cluster);
        inside.then_some(cluster)
    };
    let numbers = number(points, rows, owners.len(), owner);
    let (mut labels, mut probabilities) = (vec![-1; rows.len()], vec![0.0; rows.len()]);
    for (place, &row) in rows.iter().enumerate() {
        if let Some(cluster) = owner(place) {
            labels[row as usize] = numbers[cluster as usize];
            let death = condensed.clusters[cluster as usize].death;
            probabilities[row as usize] = (death / distance(condensed.leaves[place])).min(1.0);
        }
    }
    (labels, probabilities)
}

/// Numbers of the clusters by size, then by first point.
fn number(
    points: &[Point],
    rows: &[u32],
    count: usize,
    owner: impl Fn(usize) -> Option<u32>,
) -> Vec<i32> {
    let mut members = vec![(0u32, [f64::INFINITY; 3]); count];
    for (place, &row) in rows.iter().enumerate() {
        if let Some(cluster) = owner(place) {
            let (size, first) = &mut members[cluster as usize];
            *size += 1;
            let point = points[row as usize];
            if before(&point, first) == Ordering::Less {
                *first = point;
            }
        }
    }
    let mut order: Vec<usize> = (0..count).collect();
    order.sort_unstable_by(|&a, &b| {
        members[b].0.cmp(&members[a].0).then_with(|| before(&members[a].1, &members[b].1))
    });
    let mut numbers = vec![-1; count];
    order.iter().zip(0..).for_each(|(&cluster, number)| numbers[cluster] = number);
    numbers
}

fn before(a: &Point, b: &Point) -> Ordering {
    a.iter().zip(b).fold(Ordering::Equal, |order, (a, b)| order.then_with(|| a.total_cmp(b)))
}
