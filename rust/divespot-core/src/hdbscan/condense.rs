//! The condensed tree of clusters, from the spanning tree (Campello et al. 2013).

use crate::cancel::poll;

use super::forest::Forest;
use super::rounds::Edge;

/// Marks no cluster.
pub(super) const NONE: u32 = u32::MAX;

/// A cluster of the condensed tree. Children come before their parents; the root is last.
#[derive(Debug, Clone, Copy)]
pub(super) struct Cluster {
    /// The cluster that this one splits off from; `NONE` for the root.
    pub(super) parent: u32,
    /// Distance at which it splits off; infinite for the root.
    pub(super) birth: f64,
    /// Distance at which it splits itself, or its last points separate.
    pub(super) death: f64,
    /// Excess of mass: sum over its points of 1 / (distance of leaving) - 1 / birth.
    pub(super) stability: f64,
}

/// How a point leaves the condensed tree.
#[derive(Debug, Clone, Copy)]
pub(super) struct Leave {
    /// The cluster that it leaves last; `NONE` if there is no cluster at all.
    pub(super) cluster: u32,
    /// The weight at which it leaves.
    pub(super) weight: f32,
}

/// The condensed tree: its clusters, and how each point leaves it.
pub(super) struct Condensed {
    pub(super) clusters: Vec<Cluster>,
    pub(super) leaves: Vec<Leave>,
}

/// The distance of a weight. Coinciding points get the smallest positive distance, so that
/// densities stay finite.
pub(super) fn distance(weight: f32) -> f64 {
    f64::from(weight.max(f32::MIN_POSITIVE)).sqrt()
}

/// Condenses the hierarchy of `count` places with the spanning tree `edges`, sorted by weight.
///
/// All edges of equal weight are merged at once, so the result does not depend on their order.
pub(super) fn condense(edges: &[Edge], count: usize, min_cluster_size: usize) -> Condensed {
    let mut growth = Growth::new(count, min_cluster_size);
    for level in edges.chunk_by(|a, b| a.weight == b.weight) {
        poll();
        match level {
            [edge] => growth.merge_pair(edge),
            _ => growth.merge_level(level),
        }
    }
    growth.condensed
}

/// A component in a merger.
#[derive(Clone, Copy)]
struct Branch {
    /// Root of the component it merges into.
    into: u32,
    root: u32,
    size: u32,
}

/// A place as a member of its component.
#[derive(Clone, Copy)]
struct Member {
    /// The next member, in a circular list; maintained while the component is too small for a
    /// cluster.
    next: u32,
    /// In a root: the component's cluster, or `NONE`.
    cluster: u32,
}

struct Growth {
    min_size: u32,
    forest: Forest,
    members: Vec<Member>,
    parts: Vec<Branch>,
    condensed: Condensed,
}

impl Growth {
    fn new(count: usize, min_cluster_size: usize) -> Self {
        let leave = Leave { cluster: NONE, weight: 0.0 };
        Self {
            min_size: u32::try_from(min_cluster_size).unwrap_or(u32::MAX),
            forest: Forest::new(count),
            members: (0..count as u32).map(|next| Member { next, cluster: NONE }).collect(),
            parts: Vec::new(),
            condensed: Condensed { clusters: Vec::new(), leaves: vec![leave; count] },
        }
    }

    /// The component of a place, before a merger.
    fn part(&mut self, place: u32) -> Branch {
        let root = self.forest.find(place);
        Branch { into: root, root, size: self.forest.size(root) }
    }

    fn merge_pair(&mut self, edge: &Edge) {
        let mut parts = [self.part(edge.a), self.part(edge.b)];
        let into = self.forest.join(parts[0].root, parts[1].root);
        parts.iter_mut().for_each(|part| part.into = into);
        self.merge(&parts, edge.weight);
    }

    fn merge_level(&mut self, level: &[Edge]) {
        let mut parts = std::mem::take(&mut self.parts);
        parts.clear();
        parts.extend(level.iter().flat_map(|edge| [edge.a, edge.b]).map(|end| self.part(end)));
        for edge in level {
            let (a, b) = (self.forest.find(edge.a), self.forest.find(edge.b));
            self.forest.join(a, b);
        }
        parts.iter_mut().for_each(|part| part.into = self.forest.find(part.root));
        parts.sort_unstable_by_key(|part| (part.into, part.root));
        parts.dedup_by_key(|part| part.root);
        for parts in parts.chunk_by(|a, b| a.into == b.into) {
            self.merge(parts, level[0].weight);
        }
        self.parts = parts;
    }

    /// Merges all of `parts` at one weight.
    fn merge(&mut self, parts: &[Branch], weight: f32) {
        let min_size = self.min_size;
        let mut large = parts.iter().filter(|part| part.size >= min_size);
        let cluster = match (large.next(), large.next()) {
            (Some(only), None) => self.members[only.root as usize].cluster,
            (None, _) if parts.iter().map(|part| part.size).sum::<u32>() < min_size => {
                return self.link(parts);
            }
            _ => self.found(weight),
        };
        let mut joined = 0;
        for part in parts {
            let child = self.members[part.root as usize].cluster;
            if child == cluster {
                continue;
            }
            joined += part.size;
            if part.size < min_size {
                self.dismiss(part.root, Leave { cluster, weight });
            } else {
                let child = &mut self.condensed.clusters[child as usize];
                (child.parent, child.birth) = (cluster, distance(weight));
                child.stability -= f64::from(part.size) / distance(weight);
            }
        }
        // One integer sum and one addition, so the order of the parts does not matter.
        self.condensed.clusters[cluster as usize].stability += f64::from(joined) / distance(weight);
        self.members[parts[0].into as usize].cluster = cluster;
    }

    /// Starts a cluster that dies at `weight`.
    fn found(&mut self, weight: f32) -> u32 {
        let clusters = &mut self.condensed.clusters;
        let (birth, death) = (f64::INFINITY, distance(weight));
        clusters.push(Cluster { parent: NONE, birth, death, stability: 0.0 });
        clusters.len() as u32 - 1
    }

    /// Links the members of components that are no cluster yet into one circular list.
    fn link(&mut self, parts: &[Branch]) {
        for pair in parts.windows(2) {
            let (a, b) = (pair[0].root as usize, pair[1].root as usize);
            let next = self.members[a].next;
            self.members[a].next = self.members[b].next;
            self.members[b].next = next;
        }
    }

    /// The members of a small component leave.
    fn dismiss(&mut self, root: u32, leave: Leave) {
        let mut member = root;
        loop {
            self.condensed.leaves[member as usize] = leave;
            member = self.members[member as usize].next;
            if member == root {
                return;
            }
        }
    }
}
