//! Selects clusters from the condensed tree: by excess of mass (Campello et al. 2013) or leaves,
//! above an epsilon (Malzer and Baum 2019).

use super::condense::{Cluster, NONE};
use super::{Selection, Settings};

/// The selected cluster that holds each cluster of the condensed tree, or `NONE`.
///
/// `epsilon` is the selection epsilon in the unit of the clusters' distances.
pub(super) fn select(clusters: &[Cluster], settings: &Settings, epsilon: f64) -> Vec<u32> {
    let Some(root) = clusters.len().checked_sub(1) else { return Vec::new() };
    let mut chosen = match settings.selection {
        Selection::ExcessOfMass => excess_of_mass(clusters, settings.allow_single_cluster),
        Selection::Leaf => leaves(clusters),
    };
    if epsilon > 0.0 && root > 0 && !chosen[root] {
        chosen = climb(clusters, &chosen, epsilon, settings.allow_single_cluster);
    }
    owners(clusters, &chosen)
}

/// Selects the clusters that are at least as stable as all below them together.
fn excess_of_mass(clusters: &[Cluster], allow_root: bool) -> Vec<bool> {
    let mut worth = vec![0.0f64; clusters.len()];
    let mut chosen = vec![false; clusters.len()];
    // The children of each cluster: the first, and the next of each.
    let (mut first, mut next) = (vec![NONE; clusters.len()], vec![NONE; clusters.len()]);
    let mut below = Vec::new();
    for (i, cluster) in clusters.iter().enumerate() {
        let child = |at: &u32| Some(next[*at as usize]).filter(|&at| at != NONE);
        let children = std::iter::successors(Some(first[i]).filter(|&at| at != NONE), child);
        below.clear();
        below.extend(children.map(|child| worth[child as usize]));
        // Sorted, because a sum of three or more depends on the order.
        below.sort_unstable_by(f64::total_cmp);
        let below: f64 = below.iter().sum();
        worth[i] = cluster.stability.max(below);
        chosen[i] = cluster.stability >= below && (allow_root || cluster.parent != NONE);
        if let Some(first) = first.get_mut(cluster.parent as usize) {
            next[i] = std::mem::replace(first, i as u32);
        }
    }
    chosen
}

/// The clusters that do not split; the root alone is none.
fn leaves(clusters: &[Cluster]) -> Vec<bool> {
    let mut leaf = vec![clusters.len() > 1; clusters.len()];
    for cluster in clusters.iter().filter(|cluster| cluster.parent != NONE) {
        leaf[cluster.parent as usize] = false;
    }
    leaf
}

/// Replaces clusters born below `epsilon` by their first ancestor born above it (Malzer and Baum
/// 2019).
fn climb(clusters: &[Cluster], chosen: &[bool], epsilon: f64, allow_root: bool) -> Vec<bool> {
    let mut out = vec![false; clusters.len()];
    let top = owners(clusters, chosen);
    for i in (0..clusters.len()).filter(|&i| top[i] == i as u32) {
        let mut at = i;
        while clusters[at].birth < epsilon || (at != i && clusters[at].birth <= epsilon) {
            let parent = clusters[at].parent as usize;
            if clusters[parent].parent == NONE && !allow_root {
                break;
            }
            at = parent;
        }
        out[at] = true;
    }
    out
}

/// The topmost selected cluster at or above each cluster.
fn owners(clusters: &[Cluster], chosen: &[bool]) -> Vec<u32> {
    let mut owner = vec![NONE; clusters.len()];
    for i in (0..clusters.len()).rev() {
        let above = match clusters[i].parent {
            NONE => NONE,
            parent => owner[parent as usize],
        };
        owner[i] = if above == NONE && chosen[i] { i as u32 } else { above };
    }
    owner
}
