//! How well a joint solution of poses is known: from what frames differ by, and from its covariance.

use std::collections::BTreeMap;

use nalgebra::DVector;

use super::links::Link;
use super::state::{ALIKE, OFFSET_M, State, middles};
use super::track::Kept;

/// Places at which heights are asked for their uncertainty.
const ASKED: usize = 48;
/// Frames that share so many surfels see the same.
const SHARED: usize = 200;

impl State {
    /// How frames differ over places that are a few cubes wide.
    pub(super) fn spread(&self, frames: &[Option<Kept>], found: &[Link]) -> Spread {
        let wide_m = ALIKE * self.range_m;
        let mut sums: BTreeMap<([i32; 3], usize), [f64; 3]> = Default::default();
        for link in found.iter().filter(|link| link.sights.len() > 1) {
            let place = link.surfel.at.map(|v| (v / wide_m).floor() as i32).into();
            for (sight, off) in link.sights.iter().zip(self.residuals(frames, link)) {
                let sum = sums.entry((place, sight.frame)).or_default();
                let variance = sight.noise_m2 + self.unexplained_m * self.unexplained_m;
                *sum = [sum[0] + off, sum[1] + 1.0, sum[2] + variance];
            }
        }
        let mut places: BTreeMap<[i32; 3], Vec<[f64; 3]>> = Default::default();
        for ((place, _), sum) in sums.into_iter().filter(|(_, sum)| sum[1] >= 8.0) {
            places.entry(place).or_default().push(sum);
        }
        Spread::of(places.into_values().filter(|own| own.len() > 1))
    }

    /// Uncertainties of heights above the floor, and of the common offset.
    pub(super) fn by_covariance(&self, frames: &[Option<Kept>], found: &[Link]) -> (f64, f64) {
        let Some(solved) = &self.solved else { return (0.0, OFFSET_M) };
        let middles = middles(frames);
        let seen: Vec<&Link> = found.iter().filter(|link| !link.sights.is_empty()).collect();
        let every = seen.len().div_ceil(ASKED).max(1);
        let mut variances = Vec::new();
        for link in seen.iter().step_by(every) {
            let rows = self.rows(frames, &middles, link);
            let weight: f64 = rows.iter().map(|r| r.weight).sum();
            let mut combination = DVector::zeros(solved.unknowns());
            for r in &rows {
                (0..r.len).for_each(|k| combination[r.first + k] += r.weight / weight * r.row[k]);
            }
            let at = link.surfel.at;
            let floor = [1.0, at.x, at.y].map(|v| v * link.surfel.normal.z);
            (0..3).for_each(|k| combination[self.unknowns - 3 + k] -= floor[k]);
            variances.push(solved.variance(&combination));
        }
        let mean = variances.iter().sum::<f64>() / variances.len().max(1) as f64;
        let mut common = DVector::zeros(solved.unknowns());
        common[self.unknowns - 4] = 1.0;
        let u_offset_m = solved.variance(&common).sqrt();
        // Held, it is as unknown as it was.
        (mean.sqrt(), if self.has_offset && u_offset_m < OFFSET_M { u_offset_m } else { OFFSET_M })
    }
}

/// What frames differ by.
pub(crate) struct Spread {
    pub(super) between_m: f64,
    pub(super) of_mean_m: f64,
    /// Variance of places over that of surfels whose errors have nothing in common.
    pub(super) excess: f64,
}

impl Spread {
    /// Of the sums of each frame, place by place.
    fn of(places: impl Iterator<Item = Vec<[f64; 3]>>) -> Self {
        let (mut squares, mut expected, mut free) = (0.0, 0.0, 0.0);
        let (mut of_mean, mut count) = (0.0, 0.0);
        for own in places {
            let frames = own.len() as f64;
            let means: Vec<f64> = own.iter().map(|sum| sum[0] / sum[1]).collect();
            let middle = means.iter().sum::<f64>() / frames;
            let square: f64 = means.iter().map(|m| (m - middle) * (m - middle)).sum();
            squares += square;
            free += frames - 1.0;
            of_mean += square / (frames - 1.0) / frames;
            count += 1.0;
            expected += own.iter().map(|sum| sum[2] / (sum[1] * sum[1])).sum::<f64>() / frames
                * (frames - 1.0);
        }
        if count == 0.0 {
            return Self { between_m: 0.0, of_mean_m: 0.0, excess: 1.0 };
        }
        let excess = squares / expected;
        Self {
            between_m: (squares / free).sqrt(),
            of_mean_m: (of_mean / count).sqrt(),
            excess: if excess > 1.0 { excess } else { 1.0 },
        }
    }
}

/// Pairs of frames that share surfels, neighbours aside.
pub(crate) fn loops(found: &[Link]) -> usize {
    let mut shared: BTreeMap<(usize, usize), usize> = Default::default();
    for link in found {
        for (i, one) in link.sights.iter().enumerate() {
            for other in &link.sights[..i] {
                *shared.entry((other.frame, one.frame)).or_default() += 1;
            }
        }
    }
    shared.iter().filter(|((a, b), count)| b - a > 1 && **count >= SHARED).count()
}
