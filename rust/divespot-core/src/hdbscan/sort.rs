//! Edges in ascending order.

use super::boruvka::Edge;

/// Bits of the weight sorted in a pass.
const BITS: u32 = 11;

/// Sorts edges by weight: three counting passes over the bits, which sort as the weights do.
pub(super) fn by_weight(mut edges: Vec<Edge>) -> Vec<Edge> {
    let mut other = vec![Edge::default(); edges.len()];
    for shift in [0, BITS, 2 * BITS] {
        let digit = |edge: &Edge| (edge.weight.to_bits() >> shift) as usize & ((1 << BITS) - 1);
        let mut next = [0u32; 1 << BITS];
        edges.iter().for_each(|edge| next[digit(edge)] += 1);
        let mut sum = 0;
        for count in &mut next {
            sum += std::mem::replace(count, sum);
        }
        for edge in &edges {
            let place = &mut next[digit(edge)];
            other[*place as usize] = *edge;
            *place += 1;
        }
        std::mem::swap(&mut edges, &mut other);
    }
    edges
}
