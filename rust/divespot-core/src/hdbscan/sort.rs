//! Edges in ascending order.

use crate::order::{Keyed, sort_by_key};

use super::boruvka::Edge;

/// Sorts edges by weight; the bits of numbers of one sign sort as the numbers do.
pub(super) fn by_weight(edges: &[Edge]) -> Vec<Edge> {
    let key = |(edge, row): (&Edge, u32)| Keyed { key: u64::from(edge.weight.to_bits()), row };
    let keyed = edges.iter().zip(0..).map(key).collect();
    sort_by_key(keyed).iter().map(|keyed| edges[keyed.row as usize]).collect()
}
