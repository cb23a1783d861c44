//! A breakline under an object: a straight line along which the floor has a fold or a step.
//!
//! The annulus of ground crosses the line twice. Kriging alone would round off a fold and make a
//! ramp of a step, an error of some per cent for a low pile. Method: least squares over lines in
//! all directions, refined by halving steps, against a smoothly bent floor with as many parameters.
//! Lengths in m.

use nalgebra::{DMatrix, DVector};

use super::nodes::{Nodes, without};
use crate::material::GENTLE;
use crate::robust::scale;

/// Directions of the lines that are tried first, 10° apart, and places for each. Chosen: the
/// refinement starts from the best; fewer start it in the wrong valley, more take time.
const DIRECTIONS: u32 = 18;
const PLACES: u32 = 16;
/// Rounds of refinement; each halves the steps in place and angle. Chosen: down to 0.16° and a
/// thousandth of the annulus (closed form: 10° / 2⁶, 1 / (16 · 2⁶)).
const ROUNDS: usize = 6;
/// Iterations between the line, fitted to single cells, and the rest, fitted to nodes. Chosen: one
/// leaves the line where the nodes put it, a node's width off; more take time.
const SETTLINGS: usize = 2;
/// The smallest share of the annulus on either side of a line. Chosen: lower fits a step to a few
/// cells at the rim, higher misses breaks that touch a pile's edge.
const LEAST_SIDE: f64 = 0.1;
/// Cut-off for outliers, in standard deviations. Chosen: of normal errors 1 in 16,000 is beyond;
/// lower hides the break itself, higher lets one outlier place it.
const STRAY: f64 = 4.0;

/// The sum of squares left by a breakline is at most this share of that left by a smoothly bent
/// floor. Chosen on the scenes of `divespot evaluate`.
const CLEARER: f64 = 0.35;
/// A breakline is looked for only if the smoothly bent floor leaves more than this share of the
/// cells' noise. Chosen on the scenes of `divespot evaluate`.
const NOTICED: f64 = 0.5;

/// What changes across the line.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Kind {
    /// The height.
    Step,
    /// The slope.
    Fold,
}

/// A fold or a step, added to a plane.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Breakline {
    kind: Kind,
    pub(crate) line: Line,
    /// Height of the step in m, and change of slope across the fold as rise over run.
    rises: [f64; 2],
    /// Width of the squares over which the step is averaged, in m.
    width_m: f64,
}

/// A line in plan: the places `p` with `p · across = at_m`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Line {
    angle_rad: f64,
    /// Unit normal of the line: cosine and sine of the angle.
    across: [f64; 2],
    at_m: f64,
}

impl Line {
    pub(crate) fn new(angle_rad: f64, at_m: f64) -> Self {
        Self { angle_rad, across: [libm::cos(angle_rad), libm::sin(angle_rad)], at_m }
    }

    /// Signed distance from the line, in m.
    pub(crate) fn across(self, x: f64, y: f64) -> f64 {
        x * self.across[0] + y * self.across[1] - self.at_m
    }
}

impl Kind {
    /// Step and fold for a breakline of this kind alone.
    fn rises(self, rise: f64) -> [f64; 2] {
        match self {
            Self::Step => [rise, 0.0],
            Self::Fold => [0.0, rise],
        }
    }

    /// Height added by a unit step or fold at a signed distance, averaged over a square of this
    /// width.
    fn value(self, across: f64, width_m: f64) -> f64 {
        match self {
            Self::Fold => across.max(0.0),
            Self::Step => (across / width_m + 0.5).clamp(0.0, 1.0),
        }
    }
}

impl Breakline {
    /// The breakline in an annulus of cells (x, y, height, relative to its centre) of width
    /// `cell_m`, if there is one.
    ///
    /// It must fit clearly better than a smoothly bent floor with as many parameters.
    pub(crate) fn found(annulus: &[[f64; 3]], cell_m: f64) -> Option<Self> {
        let nodes = Nodes::of(annulus.iter().copied());
        let plane = nodes.basis(|x, y| vec![1.0, x, y])?;
        let bent = nodes.basis(|x, y| vec![1.0, x, y, x * x, y * y, x * y])?;
        let left = without(&plane, &nodes.heights);
        let smooth = without(&bent, &nodes.heights);
        if smooth.norm_squared() <= nodes.roots.norm_squared() * (NOTICED * nodes.noise_m).powi(2) {
            return None;
        }
        let breakline =
            Self::best(&nodes, &plane, &left).filter(|breakline| breakline.is_floor(&nodes))?;
        let clear = breakline.leaves(&nodes, &plane, &left, &smooth) < CLEARER;
        clear.then(|| breakline.settled(annulus, cell_m, &nodes, &plane, &left))
    }

    /// The height that the breakline adds to the plane at a place, in m.
    pub(crate) fn at(&self, x: f64, y: f64) -> f64 {
        let across = self.line.across(x, y);
        let value = |kind: Kind| self.rises[kind as usize] * kind.value(across, self.width_m);
        value(Kind::Step) + value(Kind::Fold)
    }

    /// The breakline with `more` added to its step and its fold.
    pub(crate) fn raised(mut self, more: [f64; 2]) -> Self {
        self.rises.iter_mut().zip(more).for_each(|(rise, more)| *rise += more);
        self
    }

    /// The best breakline for `left`, the residuals of the plane.
    fn best(nodes: &Nodes, plane: &DMatrix<f64>, left: &DVector<f64>) -> Option<Self> {
        let cost = |kind: Kind, line: Line| {
            let across = residuals_across(nodes, plane, kind, line);
            -across.dot(left).powi(2) / across.norm_squared().max(f64::MIN_POSITIVE)
        };
        let tried = lines(nodes)
            .into_iter()
            .flat_map(|line| [Kind::Fold, Kind::Step].map(|kind| (cost(kind, line), kind, line)));
        let (_, kind, line) = tried.min_by(|a, b| a.0.total_cmp(&b.0))?;
        let turn = std::f64::consts::PI / f64::from(DIRECTIONS);
        let line = moved(line, nodes.size_m / f64::from(PLACES), turn, |line| cost(kind, line));
        let rises = kind.rises(rise_of(nodes, plane, left, kind, line));
        Some(Self { kind, line, rises, width_m: nodes.step_m })
    }

    /// Whether a floor can have it: a fold between two gentle slopes, or a step that is low for the
    /// size of the annulus.
    fn is_floor(&self, nodes: &Nodes) -> bool {
        let most = match self.kind {
            Kind::Fold => 2.0 * GENTLE,
            Kind::Step => GENTLE * nodes.size_m,
        };
        self.rises[self.kind as usize].abs() <= most
    }

    /// The sum of squares that the breakline leaves of `left`, as a share of that of `smooth`.
    /// Residuals are capped at [`STRAY`] standard deviations.
    fn leaves(
        &self,
        nodes: &Nodes,
        plane: &DMatrix<f64>,
        left: &DVector<f64>,
        smooth: &DVector<f64>,
    ) -> f64 {
        let rest = left
            - residuals_across(nodes, plane, self.kind, self.line) * self.rises[self.kind as usize];
        let most = STRAY * scale(rest.iter().copied());
        let squares = |v: &DVector<f64>| v.iter().map(|r| r.abs().min(most).powi(2)).sum::<f64>();
        squares(&rest) / squares(smooth)
    }

    /// The breakline with its line refined on the single cells, of width `cell_m`. Residuals are
    /// capped at [`STRAY`] standard deviations.
    fn settled(
        mut self,
        annulus: &[[f64; 3]],
        cell_m: f64,
        nodes: &Nodes,
        plane: &DMatrix<f64>,
        left: &DVector<f64>,
    ) -> Self {
        for _ in 0..SETTLINGS {
            let rough = Self { width_m: nodes.step_m, ..self };
            let Some([level, along, across]) = nodes.plane_under(|x, y| rough.at(x, y)) else {
                break;
            };
            let most = STRAY * nodes.noise_m;
            let cost = |line: Line| {
                let breakline = Self { line, width_m: cell_m, ..self };
                let off =
                    |&[x, y, z]: &[f64; 3]| z - level - along * x - across * y - breakline.at(x, y);
                annulus.iter().map(|p| off(p).abs().min(most).powi(2)).sum()
            };
            let line = moved(self.line, nodes.step_m, nodes.step_m / nodes.size_m, cost);
            let rise = rise_of(nodes, plane, left, self.kind, line);
            self = Self { line, rises: self.kind.rises(rise), width_m: cell_m, ..self };
        }
        self
    }
}

/// A unit breakline less its least-squares plane.
fn residuals_across(nodes: &Nodes, plane: &DMatrix<f64>, kind: Kind, line: Line) -> DVector<f64> {
    without(plane, &nodes.values(|x, y| kind.value(line.across(x, y), nodes.step_m)))
}

/// The least-squares rise of the breakline for `left`.
fn rise_of(
    nodes: &Nodes,
    plane: &DMatrix<f64>,
    left: &DVector<f64>,
    kind: Kind,
    line: Line,
) -> f64 {
    let across = residuals_across(nodes, plane, kind, line);
    across.dot(left) / across.norm_squared().max(f64::MIN_POSITIVE)
}

/// Lines in all directions with at least [`LEAST_SIDE`] of the annulus on either side.
fn lines(nodes: &Nodes) -> Vec<Line> {
    let along = |angle_rad: f64| {
        let line = Line::new(angle_rad, 0.0);
        let mut off: Vec<f64> = nodes.places.iter().map(|p| line.across(p[0], p[1])).collect();
        off.sort_unstable_by(f64::total_cmp);
        let end = |share: f64| off[(share * (off.len() - 1) as f64) as usize];
        let (low, high) = (end(LEAST_SIDE), end(1.0 - LEAST_SIDE));
        let at_m = move |i: u32| low + (high - low) * f64::from(i) / f64::from(PLACES);
        (0..=PLACES).map(move |i| Line { at_m: at_m(i), ..line })
    };
    let angle = |i: u32| std::f64::consts::PI * f64::from(i) / f64::from(DIRECTIONS);
    (0..DIRECTIONS).flat_map(|i| along(angle(i))).collect()
}

/// The line of least cost, from shifting and turning one by steps that are halved in each round.
fn moved(mut line: Line, mut step_m: f64, mut turn: f64, cost: impl Fn(Line) -> f64) -> Line {
    let mut least = cost(line);
    for _ in 0..ROUNDS {
        step_m *= 0.5;
        turn *= 0.5;
        let from = line;
        for (right, left) in (-1..=1).flat_map(|a| (-1..=1).map(move |b| (a, b))) {
            let angle_rad = from.angle_rad + f64::from(left) * turn;
            let near = Line::new(angle_rad, from.at_m + f64::from(right) * step_m);
            let value = cost(near);
            if value < least {
                (least, line) = (value, near);
            }
        }
    }
    line
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::count::to_f64;
    use crate::sample::mix;

    const CELL: f64 = 0.0137;

    /// The cells between 0.45 m and 0.56 m from the centre, on an unaligned raster.
    fn annulus(height: impl Fn(f64, f64) -> f64) -> Vec<[f64; 3]> {
        let at = |i: i32| 0.0031 + f64::from(i) * CELL;
        let places = (-45..45).flat_map(|i| (-45..45).map(move |j| (at(i), at(j))));
        let on = |&(x, y): &(f64, f64)| (0.45..0.56).contains(&x.hypot(y));
        places
            .filter(on)
            .zip(0..)
            .map(|((x, y), i)| [x, y, height(x, y) + 0.001 * noise(i)])
            .collect()
    }

    /// Roughly normal noise.
    fn noise(i: u64) -> f64 {
        (0..12).map(|k| (mix(12 * i + k) >> 11) as f64 / (1u64 << 53) as f64).sum::<f64>() - 6.0
    }

    /// Mean error of the base over the disc within the annulus, in m.
    fn error(height: impl Fn(f64, f64) -> f64 + Copy) -> f64 {
        let mut local = annulus(height);
        let bend = Breakline::found(&local, CELL);
        let bend_at = |x: f64, y: f64| bend.map_or(0.0, |b| b.at(x, y));
        local.iter_mut().for_each(|p| p[2] -= bend_at(p[0], p[1]));
        let plane = Nodes::of(local.iter().copied()).plane_under(|_, _| 0.0).unwrap();
        let at = |i: i32| f64::from(i) * 0.005;
        let disc = (-90..90).flat_map(|i| (-90..90).map(move |j| (at(i), at(j))));
        let inside = disc.filter(|(x, y)| x.hypot(*y) < 0.45);
        let off = |(x, y): (f64, f64)| {
            plane[0] + plane[1] * x + plane[2] * y + bend_at(x, y) - height(x, y)
        };
        let (sum, count) = inside.fold((0.0, 0.0), |(s, n), p| (s + off(p), n + 1.0));
        sum / count
    }

    #[test]
    fn a_step_is_found_wherever_it_runs() {
        for (angle, at) in [(0.0, 0.0), (0.5, 0.2), (1.3, -0.15), (2.9, 0.1), (0.03, -0.21)] {
            let line = Edge { angle, at };
            let off =
                error(|x, y| 0.7 + 0.02 * x + if line.across(x, y) > 0.0 { 0.03 } else { 0.0 });
            assert!(off.abs() < 4e-4, "{angle} {at}: {off}");
        }
    }

    #[test]
    fn a_fold_up_or_down_is_found() {
        for (slope, at) in [(0.05, 0.0), (-0.05, 0.2), (0.08, -0.1)] {
            let line = Edge { angle: 0.7, at };
            let off = error(|x, y| 0.7 - 0.01 * y + slope * line.across(x, y).max(0.0));
            assert!(off.abs() < 3e-4, "{slope} {at}: {off}");
        }
    }

    #[test]
    fn a_plane_a_saddle_and_a_bowl_are_no_crease() {
        for height in [
            |x, y| 0.1 * x - 0.05 * y,
            |x, y| 0.03 * (x * x - y * y),
            |x, y| 0.03 * (x * x + y * y),
        ] {
            assert_eq!(Breakline::found(&annulus(height), CELL), None);
        }
    }

    #[test]
    fn debris_and_the_foot_of_a_wall_are_no_bend() {
        let debris = |x: f64, y: f64| if (x - 0.5).hypot(y) < 0.06 { 0.05 } else { 0.0 };
        let bend = Breakline::found(&annulus(debris), CELL);
        assert!(bend.is_none_or(|bend| bend.at(0.0, 0.0).abs() < 1e-3), "{bend:?}");
        let wall = |x: f64, _| if x > 0.5 { 3.0 * (x - 0.5) } else { 0.0 };
        let bend = Breakline::found(&annulus(wall), CELL);
        assert!(bend.is_none_or(|bend| bend.at(0.0, 0.0).abs() < 1e-3), "{bend:?}");
    }

    #[test]
    fn lines_are_tried_each_ten_degrees_and_sixteenth_of_what_leaves_a_tenth_beyond() {
        let nodes = Nodes::of(annulus(|_, _| 0.0).into_iter());
        let tried = lines(&nodes);
        let upright: Vec<&Line> = tried.iter().filter(|line| line.angle_rad == 0.0).collect();
        let turned = tried.iter().map(|line| line.angle_rad).find(|angle| *angle > 0.0);
        assert!((turned.unwrap().to_degrees() - 10.0).abs() < 1e-9);
        assert_eq!(upright.len(), 17);
        let last = upright.iter().map(|line| line.at_m).fold(f64::MIN, f64::max);
        let across = nodes.places.iter().filter(|p| p[0] > last).count();
        assert!((to_f64(across) / to_f64(nodes.places.len()) - 0.1).abs() < 0.02);
    }

    #[test]
    fn a_line_is_found_to_a_hundredth_of_the_first_step() {
        let cost = |line: Line| (line.at_m - 0.56).abs() + (line.angle_rad - 0.44).abs();
        let line = moved(Line::new(0.0, 0.0), 1.0, 1.0, cost);
        assert!(cost(line) < 0.02, "{line:?}");
    }

    #[test]
    fn what_is_four_deviations_off_counts_no_more_than_strays() {
        let nodes = Nodes::of(annulus(|_, _| 0.0).into_iter());
        let plane = nodes.basis(|x, y| vec![1.0, x, y]).unwrap();
        let count = nodes.places.len();
        let left = DVector::from_fn(count, |i, _| if i % 10 == 0 { 100.0 } else { 1.0 });
        let fives = DVector::from_element(count, 5.0);
        let line = Line::new(0.0, 0.0);
        let nothing = Breakline { kind: Kind::Step, line, rises: [0.0; 2], width_m: nodes.step_m };
        let strays = to_f64(count.div_ceil(10));
        let squares = to_f64(count) - strays + strays * (4.0_f64 * 1.4826).powi(2);
        let found = nothing.leaves(&nodes, &plane, &left, &fives);
        assert!((found / (squares / (25.0 * to_f64(count))) - 1.0).abs() < 0.01, "{found}");
    }

    /// What the best crease leaves of a ring, as a share of what a bent floor does; and what that
    /// leaves, in the noise of a cell.
    fn left(annulus: &[[f64; 3]]) -> (f64, f64) {
        let nodes = Nodes::of(annulus.iter().copied());
        let plane = nodes.basis(|x, y| vec![1.0, x, y]).unwrap();
        let bent = nodes.basis(|x, y| vec![1.0, x, y, x * x, y * y, x * y]).unwrap();
        let left = without(&plane, &nodes.heights);
        let smooth = without(&bent, &nodes.heights);
        let breakline = Breakline::best(&nodes, &plane, &left).unwrap();
        let noise = smooth.norm() / nodes.roots.norm() / nodes.noise_m;
        (breakline.leaves(&nodes, &plane, &left, &smooth), noise)
    }

    /// A step of 2 cm amid waves of this height.
    fn wavy(height_m: f64) -> Vec<[f64; 3]> {
        annulus(|x, y| {
            height_m * (12.0 * x).sin() * (9.0 * y).cos() + if x > 0.05 { 0.02 } else { 0.0 }
        })
    }

    #[test]
    fn a_crease_leaves_a_third_of_what_a_bent_floor_does() {
        let found = |range: std::ops::Range<f64>| {
            let mut rings = (0..100).map(|k| wavy(2e-4 * f64::from(k)));
            let annulus = rings.find(|annulus| range.contains(&left(annulus).0)).unwrap();
            Breakline::found(&annulus, CELL).is_some()
        };
        assert!(found(0.22..0.3) && !found(0.42..0.55));
    }

    #[test]
    fn a_floor_that_leaves_most_of_the_noise_of_a_cell_is_looked_at() {
        let mut rings =
            (0..100).map(|k| annulus(move |x, _| if x > 0.05 { 1e-4 * f64::from(k) } else { 0.0 }));
        let annulus = rings.find(|annulus| left(annulus).1 > 0.93).unwrap();
        assert!(
            left(&annulus).1 < 1.0 && Breakline::found(&annulus, CELL).is_some(),
            "{:?}",
            left(&annulus)
        );
    }

    struct Edge {
        angle: f64,
        at: f64,
    }

    impl Edge {
        fn across(&self, x: f64, y: f64) -> f64 {
            x * self.angle.cos() + y * self.angle.sin() - self.at
        }
    }
}
