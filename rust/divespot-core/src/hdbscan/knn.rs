//! The nearest neighbours of every point, a leaf at a time.

use std::sync::atomic::AtomicBool;

use crate::parallel::share;

use super::stop;
use super::tree::{LEAF, Node, Tree, Visitor, larger, smaller};

/// Leaves handed to a thread at a time.
const CHUNK: usize = 64;

/// Neighbours kept for a point; those beyond would cost more memory than they save time.
const KEPT: usize = 16;

/// Core distances and nearest neighbours, all in tree order.
pub(super) struct Neighbors {
    /// Squared distance to the `k`-th neighbour; infinite in places past the last point.
    pub(super) cores: Vec<[f32; LEAF]>,
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
    let width = k.min(KEPT);
    let mut cores = vec![[f32::INFINITY; LEAF]; tree.blocks.len()];
    let mut lists = vec![0; tree.rows.len() * width];
    let pieces = cores.chunks_mut(CHUNK).zip(lists.chunks_mut(CHUNK * LEAF * width));
    share(pieces.enumerate(), threads, |(chunk, (cores, lists))| {
        let out = cores.iter_mut().zip(lists.chunks_mut(LEAF * width));
        let leaves = (chunk * CHUNK..).zip(out).take_while(|_| stop(cancel).is_ok());
        match k {
            ..=8 => fill(tree, leaves, &mut Sorted::<8>::new(k)),
            9..=12 => fill(tree, leaves, &mut Sorted::<12>::new(k)),
            13..=16 => fill(tree, leaves, &mut Sorted::<16>::new(k)),
            _ => fill(tree, leaves, &mut Pool::new(k)),
        }
    });
    stop(cancel)?;
    Ok(Neighbors { cores, lists, width })
}

fn fill<'a>(
    tree: &Tree,
    leaves: impl Iterator<Item = (usize, (&'a mut [f32; LEAF], &'a mut [u32]))>,
    nearest: &mut impl Nearest,
) {
    for (leaf, (cores, lists)) in leaves {
        let lanes = LEAF.min(tree.rows.len() - leaf * LEAF);
        let own = &tree.nodes[tree.leaf_nodes[leaf] as usize];
        let points = std::array::from_fn(|lane| tree.blocks[leaf].point(lane.min(lanes - 1)));
        nearest.clear();
        let mut search = Search { tree, own: leaf, points, lanes, bound: f32::INFINITY, nearest };
        search.look(own, leaf);
        tree.walk(own, &mut search);
        let width = lists.len() / lanes;
        for (lane, list) in lists.chunks_mut(width).enumerate() {
            cores[lane] = nearest.finish(lane, list);
        }
    }
}

/// The neighbours found so far of the 16 points of a leaf.
trait Nearest {
    fn clear(&mut self);
    /// Squared distance that a further neighbour must be below.
    fn worst(&self, lane: usize) -> f32;
    fn offer(&mut self, lane: usize, distance: f32, place: u32);
    /// Writes the nearest neighbours out; returns the core distance.
    fn finish(&mut self, lane: usize, list: &mut [u32]) -> f32;
}

/// Neighbours in sorted rows, for few of them: an insertion moves the whole row in a few vector
/// instructions. Entries in front that are never used are minus infinity, so the worst is last.
struct Sorted<const L: usize> {
    distances: [[f32; L]; LEAF],
    places: [[u32; L]; LEAF],
    empty: [f32; L],
}

impl<const L: usize> Sorted<L> {
    fn new(k: usize) -> Self {
        let empty =
            std::array::from_fn(|i| if i + k < L { f32::NEG_INFINITY } else { f32::INFINITY });
        Self { distances: [empty; LEAF], places: [[0; L]; LEAF], empty }
    }
}

impl<const L: usize> Nearest for Sorted<L> {
    fn clear(&mut self) {
        self.distances = [self.empty; LEAF];
    }

    #[inline]
    fn worst(&self, lane: usize) -> f32 {
        self.distances[lane][L - 1]
    }

    #[inline]
    fn offer(&mut self, lane: usize, distance: f32, place: u32) {
        let (row, places) = (&mut self.distances[lane], &mut self.places[lane]);
        let (old, old_places) = (*row, *places);
        let (mut before, mut before_places) = ([f32::NEG_INFINITY; L], [0; L]);
        before[1..].copy_from_slice(&old[..L - 1]);
        before_places[1..].copy_from_slice(&old_places[..L - 1]);
        for i in 0..L {
            row[i] = smaller(old[i], larger(before[i], distance));
            let moved = if before[i] <= distance { place } else { before_places[i] };
            places[i] = if old[i] <= distance { old_places[i] } else { moved };
        }
    }

    fn finish(&mut self, lane: usize, list: &mut [u32]) -> f32 {
        list.copy_from_slice(&self.places[lane][L - list.len()..]);
        self.worst(lane)
    }
}

/// Neighbours in a heap of candidates that is cut back to the best `k` whenever it is full.
struct Pool {
    k: usize,
    /// Bits of the distance above the place: sorts as the distance does.
    found: Vec<Vec<u64>>,
    worst: [f32; LEAF],
}

impl Pool {
    fn new(k: usize) -> Self {
        let found = (0..LEAF).map(|_| Vec::with_capacity(2 * k + LEAF)).collect();
        Self { k, found, worst: [f32::INFINITY; LEAF] }
    }

    fn cut(&mut self, lane: usize) {
        let found = &mut self.found[lane];
        let (_, last, _) = found.select_nth_unstable(self.k - 1);
        self.worst[lane] = f32::from_bits((*last >> 32) as u32);
        found.truncate(self.k);
    }
}

impl Nearest for Pool {
    fn clear(&mut self) {
        self.found.iter_mut().for_each(Vec::clear);
        self.worst = [f32::INFINITY; LEAF];
    }

    #[inline]
    fn worst(&self, lane: usize) -> f32 {
        self.worst[lane]
    }

    #[inline]
    fn offer(&mut self, lane: usize, distance: f32, place: u32) {
        self.found[lane].push(u64::from(distance.to_bits()) << 32 | u64::from(place));
        if self.found[lane].len() == 2 * self.k + LEAF {
            self.cut(lane);
        }
    }

    fn finish(&mut self, lane: usize, list: &mut [u32]) -> f32 {
        self.cut(lane);
        let found = &mut self.found[lane];
        if list.len() < self.k {
            found.select_nth_unstable(list.len());
        }
        list.iter_mut().zip(found).for_each(|(place, key)| *place = *key as u32);
        self.worst[lane]
    }
}

struct Search<'a, N> {
    tree: &'a Tree,
    own: usize,
    points: [[f32; 3]; LEAF],
    lanes: usize,
    bound: f32,
    nearest: &'a mut N,
}

impl<N: Nearest> Search<'_, N> {
    fn look(&mut self, node: &Node, leaf: usize) {
        let block = &self.tree.blocks[leaf];
        let first = (leaf * LEAF) as u32;
        let mut bound = 0.0;
        for lane in 0..self.lanes {
            let p = self.points[lane];
            if node.gap_to(p) < self.nearest.worst(lane) {
                let mut distances = block.distances(p);
                if leaf == self.own {
                    distances[lane] = f32::INFINITY;
                }
                let nearest = distances.iter().fold(f32::INFINITY, |m, &d| smaller(m, d));
                if nearest < self.nearest.worst(lane) {
                    for (place, &distance) in (first..).zip(&distances) {
                        if distance < self.nearest.worst(lane) {
                            self.nearest.offer(lane, distance, place);
                        }
                    }
                }
            }
            bound = larger(bound, self.nearest.worst(lane));
        }
        self.bound = bound;
    }
}

impl<N: Nearest> Visitor for Search<'_, N> {
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
