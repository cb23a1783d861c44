//! Twelve sectors of the ground around an object, for statistics in which all directions weigh
//! alike.

use crate::robust::median_in;

/// Number of sectors, 30° each. Chosen: fewer even out ground that tilts, more hold too few cells
/// of a small pile's annulus.
const SECTORS: usize = 12;

/// The places around a centre, grouped by sector.
pub(crate) struct Sectors([Vec<usize>; SECTORS]);

impl Sectors {
    /// The sectors of places about (0, 0).
    pub(crate) fn of(local: &[[f64; 3]]) -> Self {
        let mut sectors = Self(std::array::from_fn(|_| Vec::new()));
        for (i, p) in local.iter().enumerate() {
            let turn = libm::atan2(p[1], p[0]) / std::f64::consts::TAU + 0.5;
            sectors.0[((turn * SECTORS as f64) as usize).min(SECTORS - 1)].push(i);
        }
        sectors
    }

    /// The median of the known `values`, one for each place, in every sector that has any.
    pub(crate) fn medians(&self, values: &[f64]) -> Vec<f64> {
        let mut known = Vec::new();
        let median = |places: &Vec<usize>| {
            known.clear();
            known.extend(places.iter().map(|&i| values[i]).filter(|v| !v.is_nan()));
            (!known.is_empty()).then(|| median_in(&mut known))
        };
        self.0.iter().filter_map(median).collect()
    }

    /// Weights for `count` places with which every sector has the same total.
    pub(crate) fn even_weights(&self, count: usize) -> Vec<f64> {
        let mut weights = vec![0.0; count];
        for places in &self.0 {
            places.iter().for_each(|&i| weights[i] = 1.0 / places.len() as f64);
        }
        weights
    }

    /// The longest run of sectors without places.
    pub(crate) fn widest_gap(&self) -> usize {
        let empty = |k: usize| self.0[k % SECTORS].is_empty();
        let empty_from = |from: usize| (0..SECTORS).take_while(|k| empty(from + k)).count();
        (0..SECTORS).map(empty_from).max().unwrap_or(0)
    }
}
