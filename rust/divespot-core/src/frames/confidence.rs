//! How well a joint solution of poses is known: from what frames differ by, and from its covariance.

use nalgebra::DVector;

use super::keyframe::Keyframe;
use super::keys::{Cells, number};
use super::links::{Link, Links};
use super::state::{ALIKE, OFFSET_M, State, middles};

/// Places at which heights are asked for their uncertainty.
const ASKED: usize = 48;
/// Frames that share so many surfels see the same.
const SHARED: usize = 200;

impl State {
    /// How frames differ over places that are a few cubes wide.
    pub(super) fn spread(&self, frames: &[Option<Keyframe>], found: &Links) -> Spread {
        let wide_m = ALIKE * self.range_m;
        let mut places: Cells<usize> = Cells::default();
        // Of each place in turn, of each frame: the sum, the count, the sum of variances.
        let mut sums: Vec<[f64; 3]> = Vec::new();
        for link in found.iter().filter(|link| link.sights.len() > 1) {
            let at = link.surfel.at.map(|v| (v / wide_m).floor() as i64).into();
            let Some(key) = number(at) else { continue };
            let place = *places.entry(key).or_insert(sums.len());
            if place == sums.len() {
                sums.resize(place + frames.len(), [0.0; 3]);
            }
            for (sight, off) in link.sights.iter().zip(self.residuals(frames, link)) {
                let sum = &mut sums[place + sight.frame()];
                *sum = [sum[0] + off, sum[1] + 1.0, sum[2] + 1.0 / self.weight(sight)];
            }
        }
        let enough = |place: &[[f64; 3]]| -> Vec<[f64; 3]> {
            place.iter().copied().filter(|sum| sum[1] >= 8.0).collect()
        };
        Spread::of(sums.chunks(frames.len().max(1)).map(enough).filter(|own| own.len() > 1))
    }

    /// Uncertainties of heights above the floor, and of the common offset.
    pub(super) fn by_covariance(&self, frames: &[Option<Keyframe>], found: &Links) -> (f64, f64) {
        let Some(solved) = &self.solved else { return (0.0, OFFSET_M) };
        let middles = middles(frames);
        let seen: Vec<Link<'_>> = found.iter().filter(|link| !link.sights.is_empty()).collect();
        let every = seen.len().div_ceil(ASKED).max(1);
        let (mut variances, mut rows) = (Vec::new(), Vec::new());
        for link in seen.iter().step_by(every) {
            self.rows(frames, &middles, *link, &mut rows);
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
pub(crate) fn loops(frames: usize, found: &Links) -> usize {
    let mut shared = vec![0; frames * frames];
    for link in found.iter() {
        for (i, one) in link.sights.iter().enumerate() {
            for other in &link.sights[..i] {
                shared[other.frame() * frames + one.frame()] += 1;
            }
        }
    }
    let apart = |at: usize| at / frames + 1 < at % frames;
    shared.iter().enumerate().filter(|&(at, &count)| count >= SHARED && apart(at)).count()
}
