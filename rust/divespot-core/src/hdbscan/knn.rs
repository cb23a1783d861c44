//! The nearest neighbours of every point, a leaf at a time.

use std::sync::atomic::AtomicBool;

use crate::parallel::share;

use super::stop;
use super::tree::{LEAF, Node, Tree, Visitor, larger};

/// Leaves handed to a thread at a time.
const CHUNK: usize = 64;

/// Neighbours kept for a point. More would save searches later and cost memory.
const KEPT: usize = 16;

const QUANTILE: usize = 11;
const FACTOR: f32 = 1.3;
/// Marks a neighbour that lies beyond the core distance.
pub(super) const BEYOND: u32 = 1 << 31;

/// Core distances and nearest neighbours, all in tree order.
pub(super) struct Neighbors {
    /// Squared distance to the `k`-th neighbour; infinite in places past the last point.
    pub(super) cores: Vec<[f32; LEAF]>,
    /// Squared distance below which no neighbour is missing from the list.
    pub(super) reaches: Vec<f32>,
    /// The `width` nearest neighbours of each point, in no order.
    pub(super) lists: Vec<u32>,
    /// Neighbours kept for a point.
    pub(super) width: usize,
}

/// Finds the `k` nearest others of every point; `k` must be below the number of points.
pub(super) fn all_neighbors(
    tree: &Tree,
    k: usize,
    threads: usize,
    cancel: &AtomicBool,
) -> crate::Result<Neighbors> {
    let others = tree.rows.len() - 1;
    let width = others.min(KEPT);
    let mut cores = vec![[f32::INFINITY; LEAF]; tree.blocks.len()];
    let mut reaches = vec![0.0; tree.rows.len()];
    let mut lists = vec![0; tree.rows.len() * width];
    let pieces = cores
        .chunks_mut(CHUNK)
        .zip(reaches.chunks_mut(CHUNK * LEAF))
        .zip(lists.chunks_mut(CHUNK * LEAF * width));
    share(pieces.enumerate(), threads, |(chunk, ((cores, reaches), lists))| {
        let out =
            cores.iter_mut().zip(reaches.chunks_mut(LEAF)).zip(lists.chunks_mut(LEAF * width));
        let mut search = Search::new(tree, k, width);
        for (leaf, ((cores, reaches), lists)) in (chunk * CHUNK..).zip(out) {
            if stop(cancel).is_err() {
                return;
            }
            search.run(leaf);
            for (lane, list) in lists.chunks_mut(width).enumerate() {
                (cores[lane], reaches[lane]) = search.finish(lane, list);
            }
            search.guess_from(&cores[..reaches.len()], reaches);
        }
    });
    stop(cancel)?;
    Ok(Neighbors { cores, reaches, lists, width })
}

/// The search of the points of one leaf for their neighbours.
///
/// All points nearer than a bound are collected, and sorted out at the end. The bound is guessed
/// from the leaf before; where it was too small, the search is repeated with a larger one.
struct Search<'a> {
    tree: &'a Tree,
    k: usize,
    width: usize,
    /// Neighbours to be found.
    wanted: usize,
    own: usize,
    points: [[f32; 3]; LEAF],
    /// What was found for each lane.
    found: [Found; LEAF],
    /// Squared distance that a neighbour of each lane must be below.
    bounds: [f32; LEAF],
    /// The largest of the bounds.
    bound: f32,
    guess: f32,
}

/// Neighbours found for a point.
#[derive(Default)]
struct Found {
    count: usize,
    distances: Vec<f32>,
    places: Vec<u32>,
    sorted: Vec<u64>,
}

impl<'a> Search<'a> {
    fn new(tree: &'a Tree, k: usize, width: usize) -> Self {
        let wanted = k.max(width + 1).min(tree.rows.len() - 1);
        let room = 2 * wanted + 2 * LEAF;
        Self {
            tree,
            k,
            width,
            wanted,
            own: 0,
            points: [[0.0; 3]; LEAF],
            found: std::array::from_fn(|_| Found {
                count: 0,
                distances: vec![0.0; room],
                places: vec![0; room],
                sorted: vec![0; room.max(64)],
            }),
            bounds: [0.0; LEAF],
            bound: 0.0,
            guess: f32::INFINITY,
        }
    }

    fn run(&mut self, leaf: usize) {
        let tree = self.tree;
        let lanes = LEAF.min(tree.rows.len() - leaf * LEAF);
        let own = &tree.nodes[tree.leaf_nodes[leaf] as usize];
        self.own = leaf;
        self.points = std::array::from_fn(|lane| tree.blocks[leaf].point(lane));
        self.bounds = std::array::from_fn(|lane| if lane < lanes { self.guess } else { -1.0 });
        self.found.iter_mut().for_each(|found| found.count = 0);
        let mut bound = self.guess;
        loop {
            self.bound = bound;
            self.look(own, leaf);
            tree.walk(own, self);
            bound = if bound < 64.0 * self.guess { 4.0 * bound } else { f32::INFINITY };
            let mut short = false;
            for lane in 0..lanes {
                let found = &mut self.found[lane];
                if found.count < self.wanted {
                    short = true;
                    found.count = 0;
                    self.bounds[lane] = bound;
                } else {
                    self.bounds[lane] = -1.0;
                }
            }
            if !short {
                break;
            }
        }
    }

    /// Guesses the next leaf's bound: most of its points should find enough at once.
    fn guess_from(&mut self, cores: &[f32], reaches: &[f32]) {
        let mut ends = [0.0; LEAF];
        let known = cores.iter().zip(reaches).map(|(&core, &reach)| larger(core, reach));
        ends.iter_mut().zip(known).for_each(|(end, known)| *end = known);
        ends.sort_unstable_by(f32::total_cmp);
        self.guess = ends[QUANTILE] * FACTOR;
    }

    /// Writes the neighbours of a lane out; returns its core distance and its reach.
    #[inline(never)]
    fn finish(&mut self, lane: usize, list: &mut [u32]) -> (f32, f32) {
        let (k, width) = (self.k, self.width);
        let sorted = self.found[lane].sorted(self.wanted);
        let distance = |i: usize| f32::from_bits((sorted[i] >> 32) as u32);
        for (i, (entry, key)) in list.iter_mut().zip(sorted.iter()).enumerate() {
            *entry = *key as u32 | if i < k { 0 } else { BEYOND };
        }
        (distance(k - 1), if width < self.wanted { distance(width) } else { f32::INFINITY })
    }

    fn look(&mut self, node: &Node, leaf: usize) {
        let block = &self.tree.blocks[leaf];
        let first = (leaf * LEAF) as u32;
        let gaps = node.gaps(&self.tree.blocks[self.own]);
        for lane in 0..LEAF {
            let p = self.points[lane];
            let bound = self.bounds[lane];
            if gaps[lane] < bound {
                let mut distances = block.distances(p);
                if leaf == self.own {
                    distances[lane] = f32::INFINITY;
                }
                let found = &mut self.found[lane];
                found.push(&distances, first, bound);
                if found.count + LEAF > found.distances.len() {
                    self.bounds[lane] = found.cut(self.wanted);
                    self.bound = self.bounds.iter().fold(0.0, |a, &b| larger(a, b));
                }
            }
        }
    }
}

impl Found {
    #[inline]
    fn push(&mut self, distances: &[f32; LEAF], first: u32, bound: f32) {
        let mut count = self.count;
        let Some(ds) = self.distances[count..].first_chunk_mut::<LEAF>() else { return };
        let Some(ps) = self.places[count..].first_chunk_mut::<LEAF>() else { return };
        let mut n = 0;
        for i in 0..LEAF {
            ds[n & 15] = distances[i];
            ps[n & 15] = first + i as u32;
            n += usize::from(distances[i] < bound);
        }
        count += n;
        self.count = count;
    }

    /// Keeps the nearest `wanted`; returns the distance of the last of them.
    #[cold]
    fn cut(&mut self, wanted: usize) -> f32 {
        let mut keys = self.keys();
        let (_, &mut last, _) = keys.select_nth_unstable(wanted - 1);
        for (i, key) in keys[..wanted].iter().enumerate() {
            self.distances[i] = f32::from_bits((key >> 32) as u32);
            self.places[i] = *key as u32;
        }
        self.count = wanted;
        f32::from_bits((last >> 32) as u32)
    }

    fn keys(&self) -> Vec<u64> {
        let pairs = self.distances.iter().zip(&self.places).take(self.count);
        pairs.map(|(d, &p)| u64::from(d.to_bits()) << 32 | u64::from(p)).collect()
    }

    /// The nearest in ascending order, as keys of distance and place.
    fn sorted(&mut self, wanted: usize) -> &[u64] {
        if self.count > 64 {
            let mut keys = self.keys();
            keys.select_nth_unstable(wanted - 1);
            keys[..wanted].sort_unstable();
            self.sorted[..wanted].copy_from_slice(&keys[..wanted]);
            return &self.sorted;
        }
        let mut ranks = [0u32; 64];
        self.rank(&mut ranks);
        for i in 0..self.count {
            self.sorted[ranks[i] as usize & 63] =
                u64::from(self.distances[i].to_bits()) << 32 | u64::from(self.places[i]);
        }
        &self.sorted
    }

    /// Counts for each distance those before it; of equal ones the first found comes first.
    #[inline(never)]
    fn rank(&mut self, ranks: &mut [u32; 64]) {
        let padded = self.count.next_multiple_of(8);
        self.distances[self.count..padded].fill(f32::INFINITY);
        let all = &self.distances[..padded];
        for (block, ranks) in ranks.as_chunks_mut::<8>().0[..padded / 8].iter_mut().enumerate() {
            let own: &[f32; 8] = &all.as_chunks::<8>().0[block];
            let (before, rest) = all.split_at(8 * block);
            let (_, after) = rest.split_at(8);
            for &other in before {
                for i in 0..8 {
                    ranks[i] += u32::from(other <= own[i]);
                }
            }
            for j in 0..8 {
                for i in 0..8 {
                    ranks[i] += u32::from(if j < i { own[j] <= own[i] } else { own[j] < own[i] });
                }
            }
            for &other in after {
                for i in 0..8 {
                    ranks[i] += u32::from(other < own[i]);
                }
            }
        }
    }
}

impl Visitor for Search<'_> {
    #[inline]
    fn enters(&mut self, _: usize, gap: f32) -> bool {
        gap < self.bound
    }

    #[inline]
    fn leaf(&mut self, node: &Node, leaf: usize) {
        if leaf != self.own {
            self.look(node, leaf);
        }
    }
}
