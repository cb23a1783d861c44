//! The uncertainty of jointly solved poses: from the differences between frames, and from the
//! covariance of the solution. Lengths in m.

use std::collections::HashSet;

use nalgebra::{DVector, Matrix2, Vector2};

use super::keyframe::Keyframe;
use super::keys::{Cells, number};
use super::links::{Link, Links};
use super::normal_equations::WIDTH;
use super::observations::LEVEL;
use super::state::{ALIKE, OFFSET_M, State, middles_of};

/// Surfels whose height's uncertainty is computed, and fewest surfels above a floor. Chosen: of
/// fewer, a few stand for all; more take time.
const ASKED: usize = 400;
const FEWEST: usize = 20;
/// A frame slides if the standard uncertainty of its place along the floor is more than this share
/// of the range: 2 mm at 1 m. Chosen: lower warns of frames that lie well, higher leaves displaced
/// ones unsaid.
const SLIDING: f64 = 0.002;
/// Cosine of the steepest bulk material, 60°: steeper surfels are left out of mean heights.
const STEEP: f64 = 0.5;
/// Frames that share at least this many surfels see the same place. Chosen: it decides only how
/// many loops are told.
const SHARED: usize = 200;

impl State {
    /// The differences of frames over places that are a few cubes wide.
    pub(super) fn spread(&self, frames: &[Option<Keyframe>], found: &Links) -> Spread {
        let wide_m = ALIKE * self.range_m;
        let mut places: Cells<usize> = Cells::default();
        // For each place and frame: sum, number, and sum of variances.
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

    /// Whether the surfels that each frame shares with others do not fix it along the floor; true
    /// for all if there is no floor, or the poses were given.
    ///
    /// Only slopes count, because the noise of a floor's normals looks like small slopes.
    pub(super) fn slides(&self, frames: usize, found: &Links) -> Vec<bool> {
        let mut known = vec![Matrix2::<f64>::zeros(); frames];
        for link in found.iter().filter(|l| l.sights.len() > 1 && l.surfel.normal.z < LEVEL) {
            let along = link.surfel.normal.xy();
            for sight in link.sights {
                let weight = self.weight(sight) / self.excess;
                known[sight.frame()] += along * along.transpose() * weight;
            }
        }
        let most_m = SLIDING * self.range_m;
        let is_fixed =
            |own: &Matrix2<f64>| own.symmetric_eigenvalues().min() * most_m * most_m > 1.0;
        let is_told = self.has_floor && !self.is_exact;
        known.iter().map(|own| !(is_told && is_fixed(own))).collect()
    }

    /// Standard uncertainties, in m, of the mean height of surfels above the floor relative to the
    /// floor around them, and of the mean offset of all ranges.
    pub(super) fn by_covariance(&self, frames: &[Option<Keyframe>], found: &Links) -> (f64, f64) {
        let Some(solved) = &self.solved else { return (0.0, OFFSET_M) };
        let is_seen = |link: &Link<'_>| !link.sights.is_empty() && link.surfel.normal.z > STEEP;
        let seen = found.iter().filter(is_seen);
        let (floor, risen): (Vec<Link<'_>>, Vec<Link<'_>>) =
            seen.partition(|link| self.is_level(*link));
        let around = self.around(&risen, floor);
        let middle = middle_of(&risen);
        let mut above = self.mean_height(frames, &risen, &middle);
        if around.len() >= FEWEST && risen.len() >= FEWEST {
            above -= self.mean_height(frames, &around, &middle);
        }
        let mut offset = DVector::zeros(self.unknowns);
        let places: Vec<usize> = self.places.iter().flatten().copied().collect();
        places.iter().for_each(|at| offset[at + 6] = 1.0 / places.len() as f64);
        let u_offset_m = solved.variance(&offset).sqrt();
        // If the offset is held at 0, its uncertainty is still the prior one.
        let is_known = self.has_offset && u_offset_m < OFFSET_M;
        (solved.variance(&above).sqrt(), if is_known { u_offset_m } else { OFFSET_M })
    }

    /// The floor's surfels in places next to those of the others.
    fn around<'a>(&self, risen: &[Link<'_>], mut floor: Vec<Link<'a>>) -> Vec<Link<'a>> {
        let wide_m = ALIKE * self.range_m;
        let place = |link: &Link<'_>| {
            [link.surfel.at.x, link.surfel.at.y].map(|v| (v / wide_m).floor() as i64)
        };
        let taken: HashSet<[i64; 2]> = risen.iter().map(place).collect();
        floor.retain(|link| {
            let [x, y] = place(link);
            (0..9).any(|k| taken.contains(&[x + k % 3 - 1, y + k / 3 - 1]))
        });
        floor
    }

    /// The mean height of surfels, by a plane through them at `middle`, as a linear combination of
    /// the unknowns.
    fn mean_height(
        &self,
        frames: &[Option<Keyframe>],
        links: &[Link<'_>],
        middle: &Vector2<f64>,
    ) -> DVector<f64> {
        let (middles, mut rows) = (middles_of(frames), Vec::new());
        let mut sum = DVector::zeros(self.unknowns);
        let asked: Vec<Link<'_>> =
            links.iter().copied().step_by(links.len().div_ceil(ASKED).max(1)).collect();
        let (own, count) = (middle_of(&asked), asked.len() as f64);
        let off = |link: &Link<'_>| link.surfel.at.xy() - own;
        let square: Matrix2<f64> = asked.iter().map(|l| off(l) * off(l).transpose()).sum();
        let lean = square.try_inverse().map_or_else(Vector2::zeros, |by| by * (middle - own));
        for link in &asked {
            self.rows(frames, &middles, *link, &mut rows);
            rows.retain(|row| row.len == WIDTH);
            let weight: f64 = rows.iter().map(|r| r.weight).sum();
            let share = (1.0 / count + lean.dot(&off(link))) / link.surfel.normal.z / weight;
            for r in &rows {
                (0..r.len).for_each(|k| sum[r.first + k] += share * r.weight * r.row[k]);
            }
        }
        sum
    }
}

/// The mean place of surfels in plan, in m.
fn middle_of(links: &[Link<'_>]) -> Vector2<f64> {
    let sum: Vector2<f64> = links.iter().map(|link| link.surfel.at.xy()).sum();
    sum / links.len().max(1) as f64
}

/// The differences between frames.
pub(crate) struct Spread {
    pub(super) between_m: f64,
    pub(super) of_mean_m: f64,
    /// Variance of places' means, relative to that expected from surfels with independent errors.
    pub(super) excess: f64,
}

impl Spread {
    /// The spread, from the sums of each frame, place by place.
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

/// Number of pairs of frames that share surfels and are not consecutive.
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
