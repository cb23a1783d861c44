//! From the spanning tree to the condensed tree of clusters (Campello et al. 2013).

use super::boruvka::Edge;
use super::forest::Forest;

/// No cluster.
pub(super) const NONE: u32 = u32::MAX;

/// A cluster of the condensed tree. Children come before their parents; the root is last.
#[derive(Debug, Clone, Copy)]
pub(super) struct Cluster {
    /// The cluster that this one splits off; `NONE` for the root.
    pub(super) parent: u32,
    /// Distance at which it splits off; infinite for the root.
    pub(super) birth: f64,
    /// Distance at which it splits in turn, or its last points fall apart.
    pub(super) death: f64,
    /// Excess of mass: the sum over its points of 1 / (distance of leaving) - 1 / birth.
    pub(super) stability: f64,
}

/// The condensed tree: clusters, and for each point the cluster that it leaves last.
pub(super) struct Condensed {
    pub(super) clusters: Vec<Cluster>,
    /// For each place its cluster; `NONE` where there is no cluster at all.
    pub(super) owners: Vec<u32>,
    /// For each place the distance at which it leaves its cluster.
    pub(super) leaves: Vec<f32>,
}

/// Weight as a distance. Coinciding points get the smallest distance that there is, so that
/// densities stay finite.
pub(super) fn distance(weight: f32) -> f64 {
    f64::from(weight.max(f32::MIN_POSITIVE)).sqrt()
}

/// Condenses the hierarchy of `count` places whose spanning tree is `edges`, sorted by weight.
///
/// All edges of one weight merge at once: what comes out does not depend on their order.
pub(super) fn condense(edges: &[Edge], count: usize, min_cluster_size: usize) -> Condensed {
    let mut growth = Growth::new(count, min_cluster_size);
    for level in edges.chunk_by(|a, b| a.weight == b.weight) {
        growth.merge_level(level);
    }
    growth.condensed
}

/// A component that takes part in a merger.
#[derive(Clone, Copy)]
struct Part {
    /// Root of the component merged into.
    into: u32,
    root: u32,
    size: u32,
}

struct Growth {
    min_size: u32,
    forest: Forest,
    /// The next member of the same component, in a ring; kept up while there is no cluster.
    ring: Vec<u32>,
    /// For each root the cluster that its component is, or `NONE`.
    cluster: Vec<u32>,
    parts: Vec<Part>,
    condensed: Condensed,
}

impl Growth {
    fn new(count: usize, min_cluster_size: usize) -> Self {
        Self {
            min_size: u32::try_from(min_cluster_size).unwrap_or(u32::MAX),
            forest: Forest::new(count),
            ring: (0..count as u32).collect(),
            cluster: vec![NONE; count],
            parts: Vec::new(),
            condensed: Condensed {
                clusters: Vec::new(),
                owners: vec![NONE; count],
                leaves: vec![0.0; count],
            },
        }
    }

    fn merge_level(&mut self, level: &[Edge]) {
        let mut parts = std::mem::take(&mut self.parts);
        parts.clear();
        for end in level.iter().flat_map(|edge| [edge.a, edge.b]) {
            let root = self.forest.find(end);
            parts.push(Part { into: root, root, size: self.forest.size(root) });
        }
        for edge in level {
            self.forest.join(edge.a, edge.b);
        }
        if level.len() > 1 {
            parts.iter_mut().for_each(|part| part.into = self.forest.find(part.root));
            parts.sort_unstable_by_key(|part| (part.into, part.root));
            parts.dedup_by_key(|part| part.root);
        } else {
            let into = self.forest.find(level[0].a);
            parts.iter_mut().for_each(|part| part.into = into);
        }
        let weight = level[0].weight;
        parts.chunk_by(|a, b| a.into == b.into).for_each(|parts| self.merge(parts, weight));
        self.parts = parts;
    }

    fn merge(&mut self, parts: &[Part], weight: f32) {
        let min_size = self.min_size;
        let is_cluster = |part: &&Part| part.size >= min_size;
        let mut grown = parts.iter().filter(is_cluster);
        let cluster = match (grown.next(), grown.next()) {
            (None, _) if self.forest.size(parts[0].into) < self.min_size => {
                return self.link(parts);
            }
            (Some(only), None) => self.cluster[only.root as usize],
            _ => self.found(weight),
        };
        let density = distance(weight).recip();
        for part in parts {
            if part.size < self.min_size {
                self.take_in(part.root, cluster, weight);
                self.condensed.clusters[cluster as usize].stability +=
                    density * f64::from(part.size);
            } else if self.cluster[part.root as usize] != cluster {
                let child = &mut self.condensed.clusters[self.cluster[part.root as usize] as usize];
                child.parent = cluster;
                child.birth = distance(weight);
                child.stability -= density * f64::from(part.size);
                self.condensed.clusters[cluster as usize].stability +=
                    density * f64::from(part.size);
            }
        }
        self.cluster[parts[0].into as usize] = cluster;
    }

    /// Starts a cluster that falls apart at `weight`.
    fn found(&mut self, weight: f32) -> u32 {
        let clusters = &mut self.condensed.clusters;
        clusters.push(Cluster {
            parent: NONE,
            birth: f64::INFINITY,
            death: distance(weight),
            stability: 0.0,
        });
        clusters.len() as u32 - 1
    }

    /// Makes one ring of the members of components that are no cluster yet.
    fn link(&mut self, parts: &[Part]) {
        for pair in parts.windows(2) {
            self.ring.swap(pair[0].root as usize, pair[1].root as usize);
        }
    }

    /// The members of a small component leave `cluster` at `weight`.
    fn take_in(&mut self, root: u32, cluster: u32, weight: f32) {
        let mut member = root;
        loop {
            self.condensed.owners[member as usize] = cluster;
            self.condensed.leaves[member as usize] = weight;
            member = self.ring[member as usize];
            if member == root {
                return;
            }
        }
    }
}
