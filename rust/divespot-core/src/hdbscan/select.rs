//! Which clusters of the condensed tree are the answer.

use super::condense::{Cluster, NONE};
use super::{Selection, Settings};

/// For each cluster of the condensed tree the selected one that it belongs to, or `NONE`.
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

/// Keeps the clusters that are more stable than all below them together.
fn excess_of_mass(clusters: &[Cluster], allow_root: bool) -> Vec<bool> {
    let mut below = vec![0.0; clusters.len()];
    let mut chosen = vec![false; clusters.len()];
    for (i, cluster) in clusters.iter().enumerate() {
        let is_root = cluster.parent == NONE;
        chosen[i] = cluster.stability >= below[i] && (allow_root || !is_root);
        if !is_root {
            below[cluster.parent as usize] += cluster.stability.max(below[i]);
        }
    }
    chosen
}

/// Clusters that do not split; the root alone is none.
fn leaves(clusters: &[Cluster]) -> Vec<bool> {
    let mut leaf = vec![clusters.len() > 1; clusters.len()];
    for cluster in clusters.iter().filter(|cluster| cluster.parent != NONE) {
        leaf[cluster.parent as usize] = false;
    }
    leaf
}

/// Replaces clusters born below `epsilon` by their first ancestor born above it (Malzer and
/// Baum 2019).
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

/// The topmost chosen cluster above each cluster or itself.
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
