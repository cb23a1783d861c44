//! The search for the lightest edges from one leaf's points out of their components.

use super::rounds::{Exit, NONE, Rounds, offer};
use super::tree::{LEAF, Node, Visitor, larger, smaller};

/// A point that searches for the lightest edge out of its component.
#[derive(Clone, Copy, Default)]
struct Query {
    lane: usize,
    at: [f32; 3],
    core: f32,
    component: u32,
    /// Lightest weight seen or pruned so far.
    least: f32,
}

/// The search of one leaf's points.
pub(super) struct Search<'a> {
    rounds: &'a Rounds<'a>,
    exits: &'a mut [Exit],
    first: usize,
    queries: [Query; LEAF],
    count: usize,
    /// The component of all queries, or `NONE`.
    only: u32,
    bound: f32,
    /// Least weight that a pruned node may hold.
    least: f32,
}

impl<'a> Search<'a> {
    /// Finds edges lighter than the known ones, and offers them.
    pub(super) fn run(rounds: &'a Rounds<'a>, leaf: usize, exits: &'a mut [Exit]) {
        let mut search = Self {
            rounds,
            exits,
            first: leaf * LEAF,
            queries: [Query::default(); LEAF],
            count: 0,
            only: NONE,
            bound: 0.0,
            least: f32::INFINITY,
        };
        search.gather(leaf);
        if search.count > 0 {
            let tree = rounds.tree;
            tree.walk(&tree.nodes[tree.leaf_nodes[leaf] as usize], &mut search);
            search.keep();
        }
    }

    /// Collects the points of the leaf that may have an edge below their component's best.
    fn gather(&mut self, leaf: usize) {
        let rounds = self.rounds;
        for (lane, exit) in self.exits.iter().enumerate() {
            let component = rounds.components[leaf][lane];
            if component == rounds.largest || exit.least >= rounds.bound(component) {
                continue;
            }
            self.queries[self.count] = Query {
                lane,
                at: rounds.tree.blocks[leaf].point(lane),
                core: rounds.cores[leaf][lane],
                component,
                least: f32::INFINITY,
            };
            self.only = if self.count == 0 || self.only == component { component } else { NONE };
            self.count += 1;
        }
        self.set_bound();
    }

    fn set_bound(&mut self) {
        let bounds = self.queries[..self.count].iter().map(|q| self.rounds.bound(q.component));
        self.bound = bounds.fold(0.0, larger);
    }

    /// Stores the lower bounds found, which stay valid because components only grow.
    fn keep(&mut self) {
        for query in &self.queries[..self.count] {
            let exit = &mut self.exits[query.lane];
            exit.least = larger(exit.least, smaller(query.least, self.least));
        }
    }

    #[inline]
    fn look(&mut self, node: &Node, leaf: usize) {
        let rounds = self.rounds;
        let first = leaf * LEAF;
        let (cores, components) = (&rounds.cores[leaf], &rounds.components[leaf]);
        let gaps = node.gaps(&rounds.tree.blocks[self.first / LEAF]);
        for query in &mut self.queries[..self.count] {
            let bound = rounds.bound(query.component);
            let gap = gaps[query.lane];
            if gap >= bound {
                query.least = smaller(query.least, gap);
                continue;
            }
            let distances = rounds.tree.blocks[leaf].distances(query.at);
            let weights: [f32; LEAF] = std::array::from_fn(|i| {
                let weight = larger(larger(distances[i], cores[i]), query.core);
                if components[i] == query.component { f32::INFINITY } else { weight }
            });
            let least = weights.iter().fold(f32::INFINITY, |m, &w| smaller(m, w));
            query.least = smaller(query.least, least);
            if least < bound {
                let lane = weights.iter().position(|&w| w == least).unwrap_or(0);
                let exit = &mut self.exits[query.lane];
                (exit.weight, exit.to) = (least, (first + lane) as u32);
                offer(&rounds.best[query.component as usize], least, self.first + query.lane);
            }
        }
        self.set_bound();
    }
}

impl Visitor for Search<'_> {
    #[inline]
    fn enters(&mut self, node: usize, gap: f32) -> bool {
        let component = self.rounds.node_components[node];
        if component != NONE && component == self.only {
            return false;
        }
        let weight = larger(gap, self.rounds.node_cores[node]);
        if weight >= self.bound {
            self.least = smaller(self.least, weight);
            return false;
        }
        true
    }

    #[inline]
    fn leaf(&mut self, node: &Node, leaf: usize) {
        self.look(node, leaf);
    }
}
