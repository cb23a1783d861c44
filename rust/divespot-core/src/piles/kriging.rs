//! Block kriging of the ground under an object from the ground around it; heights in m.
//!
//! The floor is modelled as a plane, with undulations longer than the object is wide and small
//! steps at the edges of fused frames; each is a random field of known spectrum. Their variances
//! and lengths (the variogram) are weighted by the likelihood of the seen ground and averaged over.
//! The mean height under the object and its standard error have a closed form (block kriging:
//! Chilès and Delfiner 2012, *Geostatistics*, section 3.5; fields as sums of cosines: Solin and
//! Särkkä 2020, Stat. Comput. 30:419; likelihood: Rasmussen and Williams 2006, section 5.4).

use std::f64::consts::{PI, TAU};

use nalgebra::{DMatrix, DVector};

use super::breakline::Line;
use super::nodes::Nodes;
use crate::count::to_f64;
use crate::harmonic::Harmonic;
use crate::robust::median;

/// Most half waves across the domain. Chosen: shorter undulations, within an object's width, are
/// not a floor's; fewer leave true ones out, twice take four times the modes.
const HIGHEST: usize = 6;
/// Width of the domain relative to the seen ground, an eighth beyond it on either side, so that the
/// cosines' zero slope at its border does not matter. Chosen: 1 flattens the ground at its rim,
/// more spends modes where nothing is.
const WIDER: f64 = 1.25;
/// Correlation lengths of the undulations, in edges of a square as large as the object. Chosen on
/// the scenes of `divespot evaluate`.
const LENGTHS: [f64; 2] = [0.8, 1.3];
/// Variances of the undulations, in variances of a node's noise: a grid of decades.
const SWELLS: [f64; 5] = [1.0, 10.0, 1e2, 1e3, 1e4];
/// Strengths of the small steps, in the same unit; their spectrum falls with the third power of the
/// wave number, as an edge's does. A grid of decades.
const SEAMS: [f64; 3] = [0.03, 0.3, 3.0];
/// Prior variance of level, slope, step and fold, in the same unit: large enough to be
/// uninformative.
const UNKNOWN: f64 = 1e9;
/// Neighbouring nodes have registration errors in common: this many count as one independent node.
/// Chosen on the scenes of `divespot evaluate`.
const CORRELATED: f64 = 6.0;
/// Number of coefficients of the plane: level and two slopes.
const PLANE: usize = 3;

/// The estimated ground, relative to the object's centre.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Expected {
    pub(crate) level_m: f64,
    pub(crate) tilt: [f64; 2],
    /// Step in m and change of slope along the given line.
    pub(crate) rises: [f64; 2],
    /// Undulations and small steps, in m.
    pub(crate) harmonic: Harmonic,
    /// Standard uncertainty of the mean height under the object, in m.
    pub(crate) u_mean_m: f64,
    /// Logarithm of the marginal likelihood of the seen ground, up to a constant.
    pub(crate) evidence: f64,
}

/// The footprint of an object.
#[derive(Debug)]
pub(crate) struct Footprint {
    /// Places spread over it, in m.
    pub(crate) places: Vec<[f64; 2]>,
    /// Edge of a square as large, in m.
    pub(crate) size_m: f64,
}

/// The model of the ground.
pub(crate) struct Kriging<'a> {
    pub(crate) nodes: &'a Nodes,
    footprint: &'a Footprint,
    /// Whether its slope is estimated; if not, it is that of the whole ground.
    tilted: bool,
    line: Option<Line>,
    low_m: [f64; 2],
    side_m: f64,
    /// Half waves along x and y of each cosine.
    modes: Vec<(usize, usize)>,
}

/// The normal equations, which are the same for all priors.
struct Equations {
    gram: DMatrix<f64>,
    right: DVector<f64>,
    squares: f64,
    freedom: f64,
    /// Mean of each column under the object.
    under: DVector<f64>,
}

/// The solution for one choice of variances and length.
struct Choice {
    evidence: f64,
    amplitudes: DVector<f64>,
    mean_m: f64,
    variance_m2: f64,
}

impl<'a> Kriging<'a> {
    /// The model for ground seen at `nodes` and unseen under an object.
    pub(crate) fn new(
        nodes: &'a Nodes,
        footprint: &'a Footprint,
        tilted: bool,
        line: Option<Line>,
    ) -> Self {
        let all = || nodes.places.iter().chain(&footprint.places);
        let low = |k: usize| all().map(|p| p[k]).fold(f64::INFINITY, f64::min);
        let high = |k: usize| all().map(|p| p[k]).fold(f64::NEG_INFINITY, f64::max);
        let span = [0, 1].map(|k| high(k) - low(k));
        let side_m = WIDER * span[0].max(span[1]).max(footprint.size_m);
        let low_m = [0, 1].map(|k| low(k) - 0.5 * (side_m - span[k]));
        Self { nodes, footprint, tilted, line, low_m, side_m, modes: modes().collect() }
    }

    /// The estimated ground; `None` if too little was seen.
    pub(crate) fn expected(&self) -> Option<Expected> {
        let equations = self.equations()?;
        let choice = |(length, swell, seams): (f64, f64, f64)| {
            equations.solved(&self.prior(length, swell, seams))
        };
        let still = SEAMS.iter().map(|&seams| (1.0, 0.0, seams));
        let waves = LENGTHS.iter().flat_map(|&l| SWELLS.iter().map(move |&s| (l, s)));
        let wavy = waves.flat_map(|(l, s)| SEAMS.iter().map(move |&seams| (l, s, seams)));
        let choices: Vec<Choice> = still.chain(wavy).filter_map(choice).collect();
        self.averaged(&choices)
    }

    fn equations(&self) -> Option<Equations> {
        let (nodes, under) = (self.nodes, &self.footprint.places);
        let freedom = to_f64(nodes.places.len()) / CORRELATED - to_f64(PLANE);
        if freedom < 1.0 || under.is_empty() {
            return None;
        }
        let usual = CORRELATED.sqrt() * median(nodes.roots.iter().copied().collect());
        let rows: Vec<Vec<f64>> = nodes.places.iter().map(|&p| self.columns(p)).collect();
        let design = DMatrix::from_fn(rows.len(), rows[0].len(), |row, column| {
            nodes.roots[row] / usual * rows[row][column]
        });
        let heights = &nodes.heights / usual;
        let mut mean = DVector::zeros(design.ncols());
        for &p in under {
            mean.iter_mut().zip(self.columns(p)).for_each(|(sum, value)| *sum += value);
        }
        Some(Equations {
            gram: design.tr_mul(&design),
            right: design.tr_mul(&heights),
            squares: heights.norm_squared(),
            freedom,
            under: mean / to_f64(under.len()),
        })
    }

    /// Number of columns before the cosines.
    fn fields(&self) -> usize {
        if self.line.is_some() { PLANE + 2 } else { PLANE }
    }

    /// Slope for a unit of a slope's coefficient, in 1/m.
    fn slope(&self) -> f64 {
        if self.tilted { 1.0 / self.footprint.size_m } else { 0.0 }
    }

    /// The columns of the model at a place: level, slopes, step and fold, cosines.
    fn columns(&self, p: [f64; 2]) -> Vec<f64> {
        let slope = self.slope();
        let mut columns = vec![1.0, slope * p[0], slope * p[1]];
        if let Some(line) = self.line {
            let across = line.across(p[0], p[1]);
            columns.extend([f64::from(across > 0.0), across.max(0.0) / self.footprint.size_m]);
        }
        columns.extend(self.waves(p));
        columns
    }

    /// The cosines at a place.
    fn waves(&self, p: [f64; 2]) -> impl Iterator<Item = f64> {
        let turns = [0, 1].map(|k| libm::cos(PI * (p[k] - self.low_m[k]) / self.side_m));
        let [x, y] = turns.map(cosines);
        self.modes.iter().map(move |&(j, k)| x[j] * y[k])
    }

    /// Prior variances of the coefficients, in variances of a node's noise.
    fn prior(&self, length: f64, swell: f64, seams: f64) -> DVector<f64> {
        let side = self.side_m / self.footprint.size_m;
        let mut variances = vec![UNKNOWN; self.fields()];
        variances.extend(self.modes.iter().map(|&(j, k)| {
            let number = PI / side * to_f64(j * j + k * k).sqrt();
            let wave = swell * length * length * libm::exp(-0.5 * (length * number).powi(2));
            let both = if j > 0 && k > 0 { 4.0 } else { 2.0 };
            TAU * both / (side * side) * (wave + seams / number.powi(3))
        }));
        variances.into()
    }

    /// The mean over all choices, weighted by likelihood.
    fn averaged(&self, choices: &[Choice]) -> Option<Expected> {
        let best = choices.iter().map(|c| c.evidence).reduce(f64::max)?;
        let weigh = |c: &Choice| libm::exp(c.evidence - best);
        let sum: f64 = choices.iter().map(weigh).sum();
        let mean = |value: &dyn Fn(&Choice) -> f64| {
            choices.iter().map(|c| weigh(c) * value(c)).sum::<f64>() / sum
        };
        let mean_m = mean(&|c| c.mean_m);
        let variance = mean(&|c| c.variance_m2 + (c.mean_m - mean_m).powi(2));
        let amplitude = |i: usize| mean(&|c| c.amplitudes[i]);
        let fields = self.fields();
        let waves: Vec<f64> = (fields..fields + self.modes.len()).map(amplitude).collect();
        let height = |p| self.waves(p).zip(&waves).map(|(value, wave)| value * wave).sum();
        let slope = self.slope();
        Some(Expected {
            level_m: amplitude(0),
            tilt: [1, 2].map(|i| slope * amplitude(i)),
            rises: match self.line {
                Some(_) => [amplitude(PLANE), amplitude(PLANE + 1) / self.footprint.size_m],
                None => [0.0; 2],
            },
            harmonic: Harmonic::sampled(self.low_m, self.side_m, height),
            u_mean_m: variance.sqrt(),
            evidence: best + libm::log(sum / to_f64(choices.len())),
        })
    }
}

/// cos(k·a) for k from 0 to `HIGHEST`, from cos(a), by recurrence.
fn cosines(first: f64) -> [f64; HIGHEST + 1] {
    let mut all = [1.0; HIGHEST + 1];
    all[1] = first;
    for i in 2..all.len() {
        all[i] = 2.0 * first * all[i - 1] - all[i - 2];
    }
    all
}

/// Half waves along x and y of each cosine.
fn modes() -> impl Iterator<Item = (usize, usize)> {
    let all = (0..=HIGHEST).flat_map(|j| (0..=HIGHEST).map(move |k| (j, k)));
    all.filter(|(j, k)| (1..=HIGHEST * HIGHEST).contains(&(j * j + k * k)))
}

impl Equations {
    /// The solution for these prior variances, in variances of a node's noise, which is estimated
    /// with it.
    fn solved(&self, prior: &DVector<f64>) -> Option<Choice> {
        let roots = prior.map(f64::sqrt);
        let size = roots.len();
        let scaled = DMatrix::from_fn(size, size, |i, j| {
            roots[i] * self.gram[(i, j)] * roots[j] + if i == j { 1.0 } else { 0.0 }
        });
        let cholesky = scaled.cholesky()?;
        let lower = cholesky.l_dirty();
        let right = lower.solve_lower_triangular(&roots.component_mul(&self.right))?;
        let left = (self.squares - right.norm_squared()).max(self.squares * f64::EPSILON);
        let noise_m2 = (left / self.freedom).max(f64::MIN_POSITIVE);
        let scatter: f64 = (0..size).map(|i| libm::log(lower[(i, i)])).sum();
        let amplitudes = roots.component_mul(&lower.tr_solve_lower_triangular(&right)?);
        let known = lower.solve_lower_triangular(&roots.component_mul(&self.under))?;
        Some(Choice {
            evidence: -0.5 * self.freedom * libm::log(noise_m2) - scatter,
            mean_m: amplitudes.dot(&self.under),
            variance_m2: noise_m2 * known.norm_squared(),
            amplitudes,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sample::mix;

    const CELL: f64 = 0.04;
    const NOISE: f64 = 0.001;

    fn uniform(seed: u64) -> f64 {
        (mix(seed) >> 11) as f64 / (1u64 << 53) as f64
    }

    /// Roughly normal noise.
    fn normal(seed: u64) -> f64 {
        (0..12).map(|k| uniform(12 * seed + k)).sum::<f64>() - 6.0
    }

    fn places_of() -> impl Iterator<Item = [f64; 2]> {
        let at = |i: i32| 0.003 + f64::from(i) * CELL;
        (-40..40).flat_map(move |i| (-40..40).map(move |j| [at(i), at(j)]))
    }

    /// Error of the estimated mean height below an object 0.5 m wide with ground within 1.2 m of
    /// it, and its standard uncertainty, in m.
    fn off(height: impl Fn([f64; 2]) -> f64, line: Option<Line>, seed: u64) -> (f64, f64) {
        let radius = |p: &[f64; 2]| p[0].hypot(p[1]);
        let ground = places_of().filter(|p| (0.5..1.2).contains(&radius(p)));
        let seen = |(p, i): ([f64; 2], u64)| {
            [p[0], p[1], height(p) + NOISE * normal(seed.wrapping_mul(1 << 20) + i)]
        };
        let nodes = Nodes::of(ground.zip(0..).map(seen).collect::<Vec<_>>().into_iter());
        let places: Vec<_> = places_of().filter(|p| radius(p) < 0.5).collect();
        let footprint = Footprint { size_m: CELL * to_f64(places.len()).sqrt(), places };
        let found = Kriging::new(&nodes, &footprint, true, line).expected().unwrap();
        let [step, fold] = found.rises;
        let at = |p: &[f64; 2]| {
            let across = line.map_or(-1.0, |line| line.across(p[0], p[1]));
            let breakline = if across > 0.0 { step + fold * across } else { 0.0 };
            let [x, y] = *p;
            found.level_m
                + found.tilt[0] * x
                + found.tilt[1] * y
                + breakline
                + found.harmonic.at(*p)
        };
        let errors = footprint.places.iter().map(|p| at(p) - height(*p));
        (errors.sum::<f64>() / to_f64(footprint.places.len()), found.u_mean_m)
    }

    #[test]
    fn a_plane_and_a_creased_plane_are_found() {
        let (error, u) = off(|[x, y]| 0.7 + 0.03 * x - 0.01 * y, None, 1);
        assert!(error.abs() < 2e-4 && u < 2e-4, "{error} {u}");
        let line = Line::new(0.4, 0.1);
        let creased = |[x, y]: [f64; 2]| match line.across(x, y) {
            across if across > 0.0 => 0.03 + 0.05 * across,
            _ => 0.0,
        };
        let (error, u) = off(creased, Some(line), 2);
        assert!(error.abs() < 1e-3 && u < 1e-3, "{error} {u}");
    }

    #[test]
    fn a_bowl_is_as_deep_as_its_rim_bends() {
        let (error, u) = off(|[x, y]| 0.02 * (x * x + y * y), None, 3);
        assert!(error.abs() < 1.2e-3 && error.abs() < 2.0 * u, "{error} {u}");
    }

    #[test]
    fn the_uncertainty_holds_on_floors_that_waver_and_on_level_ones() {
        let wave = |seed: u64, k: u64, [x, y]: [f64; 2]| {
            let draw = |i: u64| uniform(100 * seed + 10 * k + i);
            let (heading, number) = (TAU * draw(0), TAU / (2.0 * (0.7 + 0.7 * draw(1))));
            (number * (x * heading.cos() + y * heading.sin()) + TAU * draw(2)).sin()
        };
        for (height, most) in [(0.0, 2e-4), (0.002, 1e-3)] {
            let floor = |seed: u64| {
                move |p: [f64; 2]| height * (0..4).map(|k| wave(seed, k, p)).sum::<f64>()
            };
            let all: Vec<(f64, f64)> = (0..60).map(|seed| off(floor(seed), None, seed)).collect();
            let held = all.iter().filter(|(error, u)| error.abs() <= 2.0 * u).count();
            let mean = (all.iter().map(|(error, _)| error * error).sum::<f64>() / 60.0).sqrt();
            assert!(held >= 54, "{held} of 60 within u95 at waves of {height}");
            assert!(mean < most, "{mean} at waves of {height}");
        }
    }
}
