//! The state of Borůvka's rounds: the components, and the lightest known edges out of them.

use std::sync::atomic::{AtomicU64, Ordering};

use crate::cancel::Polled;
use crate::parallel::{fill_chunks, share};

use super::forest::Forest;
use super::knn::{BEYOND, Neighbors};
use super::tree::{BlockTree, LEAF, larger, smaller};

/// Leaves for a thread at a time. Decides no answer.
pub(super) const CHUNK: usize = 64;

/// Marks no neighbour, or more than one component.
pub(super) const NONE: u32 = u32::MAX;

/// An edge of the spanning tree between two places in tree order.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Edge {
    /// Squared mutual reachability distance.
    pub(super) weight: f32,
    pub(super) a: u32,
    pub(super) b: u32,
}

/// The known edges of a point out of its component.
#[derive(Clone, Copy)]
pub(super) struct Exit {
    /// Lower bound on the weight of edges out of the component, except those to listed neighbours.
    pub(super) least: f32,
    /// The weight of the edge to `to`.
    pub(super) weight: f32,
    /// The best known point outside; `NONE` if there is none.
    pub(super) to: u32,
    /// Entries of the list of neighbours that may still be outside.
    listed: u32,
}

/// The state of the rounds.
pub(super) struct Rounds<'a> {
    pub(super) tree: &'a BlockTree,
    pub(super) threads: usize,
    pub(super) cores: Vec<[f32; LEAF]>,
    lists: Vec<u32>,
    width: usize,
    /// Smallest core distance below each node.
    pub(super) node_cores: Vec<f32>,
    /// The component of each place, named by its root's place.
    pub(super) components: Vec<[u32; LEAF]>,
    /// The component of all places below a node, or `NONE`.
    pub(super) node_components: Vec<u32>,
    pub(super) exits: Vec<Exit>,
    /// For each root the lightest edge out: bits of the weight above the place it starts from.
    pub(super) best: Vec<AtomicU64>,
    forest: Forest,
    /// Roots of the components.
    pub(super) live: Vec<u32>,
    /// The component that need not search, since all others will join it.
    pub(super) largest: u32,
    pub(super) edges: Vec<Edge>,
}

impl<'a> Rounds<'a> {
    pub(super) fn new(tree: &'a BlockTree, neighbors: Neighbors, threads: usize) -> Self {
        let count = tree.rows.len();
        let Neighbors { cores, reaches, lists, width } = neighbors;
        let exit = |(&core, &reach): (&f32, &f32)| Exit {
            least: larger(core, reach),
            weight: f32::INFINITY,
            to: NONE,
            listed: width as u32,
        };
        let flat = cores.as_flattened();
        Self {
            threads,
            node_cores: up(tree, f32::INFINITY, |place| flat[place], smaller),
            components: vec![[NONE; LEAF]; cores.len()],
            node_components: vec![NONE; tree.nodes.len()],
            exits: flat.iter().zip(&reaches).polled().map(exit).collect(),
            best: (0..count).map(|_| AtomicU64::new(u64::MAX)).collect(),
            forest: Forest::new(count),
            live: (0..count as u32).collect(),
            largest: NONE,
            edges: Vec::with_capacity(count.saturating_sub(1)),
            tree,
            cores,
            lists,
            width,
        }
    }

    /// Joins every point with a neighbour whose core distance is not larger: this edge weighs as
    /// much as the point's own core distance, and none of its edges weighs less.
    pub(super) fn join_nearest(&mut self) {
        let cores = self.cores.as_flattened();
        for (place, list) in self.lists.chunks_exact(self.width).enumerate().polled() {
            let weight = cores[place];
            let below = |&&other: &&u32| other & BEYOND == 0 && cores[other as usize] <= weight;
            if let Some(&other) = list.iter().find(below) {
                add(&mut self.edges, &mut self.forest, Edge { weight, a: place as u32, b: other });
            }
        }
        self.thin_out();
    }

    /// Adds the lightest edge out of every component that has searched.
    pub(super) fn join_best(&mut self) {
        for &root in self.live.iter().polled() {
            let best = self.best[root as usize].swap(u64::MAX, Ordering::Relaxed);
            if let Some(exit) = self.exits.get(best as u32 as usize) {
                let edge = Edge { weight: exit.weight, a: best as u32, b: exit.to };
                add(&mut self.edges, &mut self.forest, edge);
            }
        }
        self.thin_out();
    }

    /// Keeps the remaining roots.
    fn thin_out(&mut self) {
        let forest = &self.forest;
        self.live.retain(|&root| forest.is_root(root));
        self.largest =
            self.live.iter().copied().max_by_key(|&root| forest.size(root)).unwrap_or(NONE);
    }

    /// Gives every place the root of its component, and every node that of its places.
    pub(super) fn relabel(&mut self) {
        let count = self.exits.len();
        let forest = &self.forest;
        fill_chunks(
            &mut self.components.as_flattened_mut()[..count],
            CHUNK * LEAF,
            self.threads,
            |first, part| {
                for (place, component) in (first as u32..).zip(part) {
                    *component = forest.root(if *component == NONE { place } else { *component });
                }
            },
        );
        let both = |a, b| if a == b { a } else { NONE };
        let components = self.components.as_flattened();
        self.node_components = up(self.tree, NONE, |place| components[place.min(count - 1)], both);
    }

    /// First pass of a round: listed neighbours that are still outside.
    pub(super) fn offer_neighbors(&mut self) {
        let mut exits = std::mem::take(&mut self.exits);
        let mut lists = std::mem::take(&mut self.lists);
        let width = self.width;
        let pieces = exits.chunks_mut(CHUNK * LEAF).zip(lists.chunks_mut(CHUNK * LEAF * width));
        share(pieces.enumerate(), self.threads, |(chunk, (exits, lists))| {
            let points = exits.iter_mut().zip(lists.chunks_exact_mut(width));
            for (place, (exit, list)) in (chunk * CHUNK * LEAF..).zip(points) {
                self.offer_neighbor(place, exit, list);
            }
        });
        (self.exits, self.lists) = (exits, lists);
    }

    #[inline]
    fn offer_neighbor(&self, place: usize, exit: &mut Exit, list: &mut [u32]) {
        let components = self.components.as_flattened();
        let own = components[place];
        if own == self.largest {
            return;
        }
        let leads_out = |exit: &Exit| exit.to != NONE && components[exit.to as usize] != own;
        if !leads_out(exit) && self.cores.as_flattened()[place] < self.bound(own) {
            self.refresh(place, exit, list);
        }
        if leads_out(exit) {
            offer(&self.best[own as usize], exit.weight, place);
        }
    }

    /// Finds the best exit among the listed neighbours; those inside are removed from the list.
    #[inline]
    fn refresh(&self, place: usize, exit: &mut Exit, list: &mut [u32]) {
        let (components, cores) = (self.components.as_flattened(), self.cores.as_flattened());
        let (own, core) = (components[place], cores[place]);
        let listed = exit.listed as usize;
        *exit = Exit { to: NONE, weight: f32::INFINITY, listed: 0, ..*exit };
        for i in 0..listed {
            let entry = list[i];
            let other = entry & !BEYOND;
            if components[other as usize] == own {
                continue;
            }
            list[exit.listed as usize] = entry;
            exit.listed += 1;
            let mut weight = larger(core, cores[other as usize]);
            if entry != other && weight < exit.weight {
                weight = larger(weight, self.tree.distance(place, other as usize));
            }
            if weight < exit.weight {
                (exit.weight, exit.to) = (weight, other);
            }
            if exit.weight <= core {
                // Nothing can be lighter, so the rest of the list stays for later.
                list.copy_within(i + 1..listed, exit.listed as usize);
                exit.listed += (listed - i - 1) as u32;
                return;
            }
        }
    }

    /// The weight of the lightest known edge out of a component.
    #[inline]
    pub(super) fn bound(&self, component: u32) -> f32 {
        weight(self.best[component as usize].load(Ordering::Relaxed))
    }
}

/// Adds an edge unless it closes a cycle.
fn add(edges: &mut Vec<Edge>, forest: &mut Forest, edge: Edge) {
    let (a, b) = (forest.find(edge.a), forest.find(edge.b));
    if a != b {
        forest.join(a, b);
        edges.push(edge);
    }
}

/// Merges the values of places upwards to every node of the tree.
fn up<T: Copy>(
    tree: &BlockTree,
    empty: T,
    value: impl Fn(usize) -> T,
    merge: impl Fn(T, T) -> T,
) -> Vec<T> {
    let mut out = vec![empty; tree.nodes.len()];
    for own in (0..out.len()).rev().polled() {
        out[own] = match tree.nodes[own].children(own) {
            Some((left, right)) => merge(out[left], out[right]),
            None => {
                let first = tree.nodes[own].first_leaf() * LEAF;
                (first + 1..first + LEAF).fold(value(first), |all, i| merge(all, value(i)))
            }
        };
    }
    out
}

/// Offers an edge to its component.
#[inline]
pub(super) fn offer(best: &AtomicU64, weight: f32, place: usize) {
    let key = u64::from(weight.to_bits()) << 32 | place as u64;
    if key < best.load(Ordering::Relaxed) {
        best.fetch_min(key, Ordering::Relaxed);
    }
}

/// The weight in a key of `best`; infinite if nothing was offered.
#[inline]
fn weight(key: u64) -> f32 {
    if key == u64::MAX { f32::INFINITY } else { f32::from_bits((key >> 32) as u32) }
}
