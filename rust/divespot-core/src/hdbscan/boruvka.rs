//! The minimum spanning tree of the mutual reachability graph, by Borůvka's algorithm with searches
//! in a kd-tree.

use crate::cancel::poll;
use crate::parallel::share;

use super::knn::Neighbors;
use super::rounds::{CHUNK, Edge, Rounds};
use super::search::Search;
use super::tree::{BlockTree, LEAF};

/// The `n - 1` edges of a minimum spanning tree, unsorted.
///
/// Which of several edges of equal weight is taken may vary; the sorted weights do not.
pub(super) fn spanning_tree(tree: &BlockTree, neighbors: Neighbors, threads: usize) -> Vec<Edge> {
    let mut rounds = Rounds::new(tree, neighbors, threads);
    rounds.join_nearest();
    while rounds.live.len() > 1 {
        rounds.relabel();
        rounds.offer_neighbors();
        search(&mut rounds);
        rounds.join_best();
    }
    rounds.edges
}

/// Second pass of a round: edges that are in no list of neighbours are searched in the tree.
fn search(rounds: &mut Rounds<'_>) {
    let mut exits = std::mem::take(&mut rounds.exits);
    let pieces = exits.chunks_mut(CHUNK * LEAF).enumerate();
    share(pieces, rounds.threads, |(chunk, exits)| {
        for (leaf, exits) in (chunk * CHUNK..).zip(exits.chunks_mut(LEAF)) {
            poll();
            Search::run(rounds, leaf, exits);
        }
    });
    rounds.exits = exits;
}
