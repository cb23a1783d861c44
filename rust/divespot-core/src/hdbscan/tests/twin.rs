//! HDBSCAN by its definition, slow.

use super::super::condense::distance;
use super::*;

/// Squared mutual reachability distances by their definition.
pub(super) fn reachability(points: &[Point], min_samples: usize) -> Vec<Vec<f32>> {
    let frame = Frame::around(points).unwrap();
    let at: Vec<[f32; 3]> = points.iter().map(|p| frame.map(p)).collect();
    let square = |a: [f32; 3], b: [f32; 3]| {
        let (dx, dy, dz) = (a[0] - b[0], a[1] - b[1], a[2] - b[2]);
        dx * dx + dy * dy + dz * dz
    };
    let mut all: Vec<Vec<f32>> =
        at.iter().map(|&a| at.iter().map(|&b| square(a, b)).collect()).collect();
    let core = |row: &Vec<f32>| {
        let place = min_samples.min(row.len() - 1);
        *row.clone().select_nth_unstable_by(place, f32::total_cmp).1
    };
    let cores: Vec<f32> = all.iter().map(core).collect();
    for (i, row) in all.iter_mut().enumerate() {
        row.iter_mut().zip(&cores).for_each(|(w, core)| *w = w.max(cores[i]).max(*core));
    }
    all
}

/// Sorted weights of a minimum spanning tree, by Prim's algorithm.
pub(super) fn prim(all: &[Vec<f32>]) -> Vec<f32> {
    let mut waiting: Vec<(usize, f32)> = (1..all.len()).map(|i| (i, f32::INFINITY)).collect();
    let mut out = Vec::new();
    let mut at = 0;
    while !waiting.is_empty() {
        let mut best = 0;
        for i in 0..waiting.len() {
            waiting[i].1 = waiting[i].1.min(all[at][waiting[i].0]);
            best = if waiting[i].1 < waiting[best].1 { i } else { best };
        }
        let (next, weight) = waiting.swap_remove(best);
        at = next;
        out.push(weight);
    }
    out.sort_unstable_by(f32::total_cmp);
    out
}

/// The clusters of a cloud, from all points down, one distance at a time.
pub(super) struct Twin {
    all: Vec<Vec<f32>>,
    min_size: usize,
    /// The root is last.
    clusters: Vec<Whole>,
}

/// A cluster with all its members.
struct Whole {
    members: Vec<usize>,
    birth: f64,
    death: f64,
    /// The distance at which each member leaves this cluster or those below.
    leaves: Vec<f64>,
    children: Vec<usize>,
}

impl Twin {
    pub(super) fn new(points: &[Point], settings: &Settings) -> Self {
        let all = reachability(points, settings.min_samples);
        let mut twin = Self { all, min_size: settings.min_cluster_size, clusters: Vec::new() };
        if points.len() >= twin.min_size {
            twin.grow((0..points.len()).collect(), f64::INFINITY);
        }
        twin
    }

    /// The connected components below a weight.
    fn components(&self, members: &[usize], below: f32) -> Vec<Vec<usize>> {
        let mut waiting = members.to_vec();
        let mut out = Vec::new();
        while let Some(first) = waiting.pop() {
            let mut component = vec![first];
            let mut next = 0;
            while next < component.len() {
                let row = &self.all[component[next]];
                component.extend(waiting.extract_if(.., |&mut i| row[i] < below));
                next += 1;
            }
            out.push(component);
        }
        out
    }

    /// The weight at which members first separate.
    fn level(&self, members: &[usize]) -> f32 {
        let row = |&a: &usize| members.iter().map(|&b| self.all[a][b]).collect();
        let weights = prim(&members.iter().map(row).collect::<Vec<Vec<f32>>>());
        weights[weights.len() - 1]
    }

    /// Follows a cluster until it splits or dies, then its children. Returns its number.
    fn grow(&mut self, members: Vec<usize>, birth: f64) -> usize {
        let mut leaves = vec![0.0; members.len()];
        let mut now = members.clone();
        loop {
            let weight = self.level(&now);
            let parts = self.components(&now, weight);
            let (mut large, small): (Vec<_>, Vec<_>) =
                parts.into_iter().partition(|part| part.len() >= self.min_size);
            let death = distance(weight);
            set(&members, &mut leaves, small.iter().flatten().map(|&i| (i, death)));
            if large.len() == 1 {
                now = large.remove(0);
                continue;
            }
            let children: Vec<usize> =
                large.into_iter().map(|part| self.grow(part, death)).collect();
            for child in children.iter().map(|&child| &self.clusters[child]) {
                let left = child.members.iter().copied().zip(child.leaves.iter().copied());
                set(&members, &mut leaves, left);
            }
            self.clusters.push(Whole { members, birth, death, leaves, children });
            return self.clusters.len() - 1;
        }
    }

    fn stability(&self, at: usize) -> f64 {
        let cluster = &self.clusters[at];
        let excess = |leave: f64| leave.max(cluster.death).recip() - cluster.birth.recip();
        cluster.leaves.iter().map(|&leave| excess(leave)).sum()
    }

    /// The stability of a cluster and those below it, and the selection among them.
    fn choose(&self, at: usize, settings: &Settings) -> (f64, Vec<usize>) {
        let children = &self.clusters[at].children;
        let root = at + 1 == self.clusters.len();
        let below: Vec<_> = children.iter().map(|&child| self.choose(child, settings)).collect();
        let worth: f64 = below.iter().map(|(worth, _)| worth).sum();
        let chosen = below.into_iter().flat_map(|(_, chosen)| chosen).collect();
        let own = self.stability(at);
        let takes = match settings.selection {
            Selection::Leaf => children.is_empty() && !root,
            Selection::ExcessOfMass => own >= worth && (settings.allow_single_cluster || !root),
        };
        if takes { (own, vec![at]) } else { (worth.max(own), chosen) }
    }

    /// The selected clusters, raised to the selection epsilon.
    fn chosen(&self, settings: &Settings, epsilon: f64) -> Vec<usize> {
        let Some(root) = self.clusters.len().checked_sub(1) else { return Vec::new() };
        let mut chosen = self.choose(root, settings).1;
        if epsilon > 0.0 && chosen != [root] {
            let raised = |at: &usize| self.raised(*at, epsilon, settings.allow_single_cluster);
            chosen = chosen.iter().map(raised).collect();
            chosen.sort_unstable();
            chosen.dedup();
        }
        chosen
    }

    fn raised(&self, mut at: usize, epsilon: f64, allow_root: bool) -> usize {
        let root = self.clusters.len() - 1;
        let parent = |at| self.clusters.iter().position(|c| c.children.contains(&at));
        if self.clusters[at].birth >= epsilon {
            return at;
        }
        while let Some(up) = parent(at) {
            if up == root && !allow_root {
                return at;
            }
            at = up;
            if self.clusters[at].birth > epsilon {
                return at;
            }
        }
        at
    }

    /// Labels and probabilities.
    pub(super) fn labels(&self, points: &[Point], settings: &Settings) -> (Vec<i32>, Vec<f64>) {
        let epsilon = settings.cluster_selection_epsilon * Frame::around(points).unwrap().scale;
        let mut found: Vec<Vec<(usize, f64)>> = Vec::new();
        for at in self.chosen(settings, epsilon) {
            let cluster = &self.clusters[at];
            let reach = match epsilon {
                _ if at + 1 < self.clusters.len() => f64::INFINITY,
                0.0 => cluster.death,
                epsilon => epsilon,
            };
            let left = cluster.members.iter().copied().zip(cluster.leaves.iter().copied());
            let kept = left.filter(|(_, leave)| *leave <= reach);
            found.push(kept.map(|(i, leave)| (i, (cluster.death / leave).min(1.0))).collect());
        }
        let smallest = |i: usize| points[i].map(|v| (v * 1e9) as i64);
        found.sort_by_key(|of| (usize::MAX - of.len(), of.iter().map(|&(i, _)| smallest(i)).min()));
        let (mut labels, mut probabilities) = (vec![-1; points.len()], vec![0.0; points.len()]);
        for (label, members) in (0..).zip(found) {
            for (i, probability) in members {
                (labels[i], probabilities[i]) = (label, probability);
            }
        }
        (labels, probabilities)
    }
}

fn set(members: &[usize], values: &mut [f64], new: impl Iterator<Item = (usize, f64)>) {
    for (i, value) in new {
        let place = members.iter().position(|&j| j == i).unwrap();
        values[place] = value;
    }
}
