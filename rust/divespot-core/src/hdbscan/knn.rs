//! The k nearest neighbours of every point, one leaf of the kd-tree at a time.

use crate::cancel::poll;
use crate::parallel::share;

use super::found::{Found, distance_of};
use super::tree::{BlockTree, LEAF, Node, Visitor, larger};

/// Leaves for a thread at a time. Decides no answer.
const CHUNK: usize = 64;

/// Memory of a thread for each neighbour asked for, in bytes: 16 points at a time, with room for
/// twice as many neighbours of 8 bytes, and a buffer to sort them.
pub(super) const BYTES_A_NEIGHBOR: usize = 300;

/// Neighbours kept for each point: one more than its core distance needs, and at most so many. More
/// would save later searches and cost memory. Decides no answer.
const KEPT: usize = 12;

/// Marks a neighbour farther than the core distance.
pub(super) const BEYOND: u32 = 1 << 31;

/// Core distances and nearest neighbours, in tree order.
pub(super) struct Neighbors {
    /// Squared distance to the `k`-th neighbour; infinite in places past the last point.
    pub(super) cores: Vec<[f32; LEAF]>,
    /// Squared distance below which no neighbour is missing from the list.
    pub(super) reaches: Vec<f32>,
    /// The nearest neighbours of each point in ascending order, some marked `BEYOND`.
    pub(super) lists: Vec<u32>,
    /// The length of each list.
    pub(super) width: usize,
}

/// Finds the `k` nearest others of every point; `k` must be below the number of points.
pub(super) fn all_neighbors(tree: &BlockTree, k: usize, threads: usize) -> Neighbors {
    let count = tree.rows.len();
    let width = KEPT.min(k + 1).min(count - 1);
    let mut cores = vec![[f32::INFINITY; LEAF]; tree.blocks.len()];
    let mut reaches = vec![0.0; count];
    let mut lists = vec![0; count * width];
    let pieces = cores
        .chunks_mut(CHUNK)
        .zip(reaches.chunks_mut(CHUNK * LEAF))
        .zip(lists.chunks_mut(CHUNK * LEAF * width));
    share(pieces.enumerate(), threads, |(chunk, ((cores, reaches), lists))| {
        let mut search = Search::new(tree, k, width);
        let out =
            cores.iter_mut().zip(reaches.chunks_mut(LEAF)).zip(lists.chunks_mut(LEAF * width));
        for (leaf, ((cores, reaches), lists)) in (chunk * CHUNK..).zip(out) {
            poll();
            search.run(leaf);
            for (lane, list) in lists.chunks_mut(width).enumerate() {
                (cores[lane], reaches[lane]) = search.finish(lane, list);
            }
            search.guess_from(cores, reaches);
        }
    });
    Neighbors { cores, reaches, lists, width }
}

/// The search for the neighbours of one leaf's points.
///
/// All points nearer than a bound are collected, and sorted at the end, which is cheaper than
/// keeping them sorted. The bound is guessed from the leaf before. If it was too small, the search
/// is repeated with a larger one.
struct Search<'a> {
    tree: &'a BlockTree,
    k: usize,
    width: usize,
    own: usize,
    found: [Found; LEAF],
    /// Squared distance below which neighbours of each point are collected; negative once it has
    /// enough.
    bounds: [f32; LEAF],
    /// The largest of the bounds.
    bound: f32,
    guess: f32,
    /// The nearest neighbours of a point as keys, as many as are wanted.
    sorted: Vec<u64>,
}

impl<'a> Search<'a> {
    fn new(tree: &'a BlockTree, k: usize, width: usize) -> Self {
        // One more than the list holds, which shows how far the list reaches.
        let wanted = k.max(width + 1).min(tree.rows.len() - 1);
        Self {
            tree,
            k,
            width,
            own: 0,
            found: std::array::from_fn(|_| Found::new(wanted)),
            bounds: [0.0; LEAF],
            bound: 0.0,
            guess: f32::INFINITY,
            sorted: vec![0; wanted],
        }
    }

    /// Collects at least the wanted number of neighbours for every point of a leaf.
    fn run(&mut self, leaf: usize) {
        let tree = self.tree;
        let own = &tree.nodes[tree.leaf_nodes[leaf] as usize];
        let lanes = LEAF.min(tree.rows.len() - leaf * LEAF);
        self.own = leaf;
        self.found.iter_mut().for_each(|found| found.count = 0);
        self.bounds = [-1.0; LEAF];
        let mut bound = self.guess;
        while self.aim(lanes, bound) {
            self.bound = bound;
            tree.walk(own, self);
            bound = if bound < 16.0 * self.guess { 2.0 * bound } else { f32::INFINITY };
        }
    }

    /// Sets the bound of the points that lack neighbours; returns false if none does.
    fn aim(&mut self, lanes: usize, bound: f32) -> bool {
        let mut any = false;
        for (found, own) in self.found.iter_mut().zip(&mut self.bounds).take(lanes) {
            let lacks = found.count < self.sorted.len();
            *own = if lacks { bound } else { -1.0 };
            found.count = if lacks { 0 } else { found.count };
            any |= lacks;
        }
        any
    }

    /// Guesses the next leaf's bound, so that most of its points find enough at once.
    fn guess_from(&mut self, cores: &[f32; LEAF], reaches: &[f32]) {
        let mut ends = [0.0; LEAF];
        for (end, (&core, &reach)) in ends.iter_mut().zip(cores.iter().zip(reaches)) {
            *end = if reach.is_finite() { larger(core, reach) } else { core };
        }
        ends.sort_unstable_by(f32::total_cmp);
        // The upper third instead of the mean, since one outlier must not decide.
        self.guess = 1.3 * ends[11];
    }

    /// Writes the neighbours of a point; returns its core distance and its list's reach.
    fn finish(&mut self, lane: usize, list: &mut [u32]) -> (f32, f32) {
        self.found[lane].sort_into(&mut self.sorted);
        for (i, (entry, &key)) in list.iter_mut().zip(&self.sorted).enumerate() {
            *entry = key as u32 | if i < self.k { 0 } else { BEYOND };
        }
        let reach = self.sorted.get(self.width).map_or(f32::INFINITY, |&key| distance_of(key));
        (distance_of(self.sorted[self.k - 1]), reach)
    }
}

impl Visitor for Search<'_> {
    #[inline]
    fn enters(&mut self, _: usize, gap: f32) -> bool {
        gap < self.bound
    }

    #[inline]
    fn leaf(&mut self, node: &Node, leaf: usize) {
        let (own, block) = (&self.tree.blocks[self.own], &self.tree.blocks[leaf]);
        for (lane, gap) in node.gaps(own).into_iter().enumerate() {
            let bound = self.bounds[lane];
            if gap >= bound {
                continue;
            }
            let mut distances = block.distances(own.point(lane));
            if leaf == self.own {
                distances[lane] = f32::INFINITY;
            }
            let found = &mut self.found[lane];
            found.add(&distances, (leaf * LEAF) as u32, bound);
            if found.is_full() {
                self.bounds[lane] = found.cut(self.sorted.len());
                self.bound = self.bounds.iter().fold(0.0, |most, &bound| larger(most, bound));
            }
        }
    }
}
