//! HDBSCAN.

use arbitrary::Arbitrary;
use divespot_core::hdbscan::{Selection, Settings, hdbscan};

use crate::{Number, Points};

#[derive(Debug, Arbitrary)]
pub struct Input {
    points: Points,
    min_cluster_size: u8,
    min_samples: u8,
    epsilon: Number,
    leaf: bool,
    single: bool,
    threads: bool,
}

impl Input {
    pub fn run(&self) {
        let Some(cloud) = self.points.cloud() else { return };
        let settings = Settings {
            min_cluster_size: self.min_cluster_size.into(),
            min_samples: self.min_samples.into(),
            cluster_selection_epsilon: self.epsilon.value(),
            selection: if self.leaf { Selection::Leaf } else { Selection::ExcessOfMass },
            allow_single_cluster: self.single,
            threads: 1 + usize::from(self.threads),
        };
        let Ok(found) = hdbscan(&cloud.points, &settings) else { return };
        assert_eq!(found.labels.len(), cloud.points.len());
        assert_eq!(found.mst_weights.len(), cloud.points.len().saturating_sub(1));
        assert!(found.probabilities.iter().all(|p| (0.0..=1.0).contains(p)));
        assert!(found.mst_weights.is_sorted());
    }
}
