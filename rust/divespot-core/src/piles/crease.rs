//! A straight line under an object along which the floor is folded or stepped.
//!
//! The ring of ground crosses such a line twice.

use nalgebra::{DMatrix, DVector};

use super::nodes::{Nodes, without};
use crate::robust::scale;
use crate::terrain::GENTLE;

/// Directions and places of a line that are tried first.
const DIRECTIONS: u32 = 18;
const PLACES: u32 = 16;
/// Rounds in which the best line is moved and turned by ever half as much.
const ROUNDS: usize = 6;
/// Rounds of fitting the line to single cells and the rest to nodes.
const SETTLINGS: usize = 2;
/// A line must leave this share of the ring on either side.
const LEAST_SIDE: f64 = 0.1;
/// What is further off than this many standard deviations tells nothing.
const STRAY: f64 = 4.0;

/// How the floor changes across a line.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Kind {
    /// Its slope.
    Fold,
    /// Its height.
    Step,
}

/// A fold or a step, to be added to a plane.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Crease {
    kind: Kind,
    line: Line,
    /// The height of a step; the change of slope across a fold.
    rise: f64,
    /// Edge of the squares whose heights it is to meet.
    width_m: f64,
}

/// The line of the places `p` with `p · across = at_m`.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Line {
    angle_rad: f64,
    /// Cosine and sine of the angle.
    across: [f64; 2],
    at_m: f64,
}

impl Line {
    fn new(angle_rad: f64, at_m: f64) -> Self {
        Self { angle_rad, across: [angle_rad.cos(), angle_rad.sin()], at_m }
    }

    /// The distance beyond the line.
    fn beyond(self, x: f64, y: f64) -> f64 {
        x * self.across[0] + y * self.across[1] - self.at_m
    }
}

impl Kind {
    /// What a unit crease adds at this distance beyond the line, on average over a square as wide.
    fn value(self, beyond: f64, width_m: f64) -> f64 {
        match self {
            Self::Fold => beyond.max(0.0),
            Self::Step => (beyond / width_m + 0.5).clamp(0.0, 1.0),
        }
    }
}

impl Crease {
    /// What the crease adds to the plane at a place.
    pub(crate) fn at(&self, x: f64, y: f64) -> f64 {
        self.rise * self.kind.value(self.line.beyond(x, y), self.width_m)
    }

    /// The crease that explains most of `left`, which is what `plane` leaves of the heights.
    pub(crate) fn best(nodes: &Nodes, plane: &DMatrix<f64>, left: &DVector<f64>) -> Option<Self> {
        let cost = |kind: Kind, line: Line| {
            let across = across(nodes, plane, kind, line);
            -across.dot(left).powi(2) / across.norm_squared().max(f64::MIN_POSITIVE)
        };
        let tried = lines(nodes)
            .into_iter()
            .flat_map(|line| [Kind::Fold, Kind::Step].map(|kind| (cost(kind, line), kind, line)));
        let (_, kind, line) = tried.min_by(|a, b| a.0.total_cmp(&b.0))?;
        let turn = std::f64::consts::PI / f64::from(DIRECTIONS);
        let line = moved(line, nodes.size_m / f64::from(PLACES), turn, |line| cost(kind, line));
        let rise = rise(nodes, plane, left, kind, line);
        Some(Self { kind, line, rise, width_m: nodes.step_m })
    }

    /// Whether it can be a floor's: gentle on either side of a fold, low for the size of the ring.
    pub(crate) fn is_floor(&self, nodes: &Nodes) -> bool {
        let most = match self.kind {
            Kind::Fold => 2.0 * GENTLE,
            Kind::Step => GENTLE * nodes.size_m,
        };
        self.rise.abs() <= most
    }

    /// The squares that the crease leaves of `left`, as a share of those of `smooth`; nodes that
    /// are far off count no more than strays.
    pub(crate) fn leaves(
        &self,
        nodes: &Nodes,
        plane: &DMatrix<f64>,
        left: &DVector<f64>,
        smooth: &DVector<f64>,
    ) -> f64 {
        let rest = left - across(nodes, plane, self.kind, self.line) * self.rise;
        let most = STRAY * scale(rest.iter().copied());
        let squares = |v: &DVector<f64>| v.iter().map(|r| r.abs().min(most).powi(2)).sum::<f64>();
        squares(&rest) / squares(smooth)
    }

    /// The crease with its line moved to where it leaves least of the ring's single cells, whose
    /// edge is `cell_m`; those far off count no more than strays.
    pub(crate) fn settled(
        mut self,
        ring: &[[f64; 3]],
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
                let crease = Self { line, width_m: cell_m, ..self };
                let off =
                    |&[x, y, z]: &[f64; 3]| z - level - along * x - across * y - crease.at(x, y);
                ring.iter().map(|p| off(p).abs().min(most).powi(2)).sum()
            };
            let line = moved(self.line, nodes.step_m, nodes.step_m / nodes.size_m, cost);
            let rise = rise(nodes, plane, left, self.kind, line);
            self = Self { line, rise, width_m: cell_m, ..self };
        }
        self
    }
}

/// What a plane leaves of a unit crease.
fn across(nodes: &Nodes, plane: &DMatrix<f64>, kind: Kind, line: Line) -> DVector<f64> {
    without(plane, &nodes.values(|x, y| kind.value(line.beyond(x, y), nodes.step_m)))
}

/// How much of a unit crease explains most of `left`.
fn rise(nodes: &Nodes, plane: &DMatrix<f64>, left: &DVector<f64>, kind: Kind, line: Line) -> f64 {
    let across = across(nodes, plane, kind, line);
    across.dot(left) / across.norm_squared().max(f64::MIN_POSITIVE)
}

/// Lines in all directions that leave something of the ring on either side.
fn lines(nodes: &Nodes) -> Vec<Line> {
    let along = |angle_rad: f64| {
        let line = Line::new(angle_rad, 0.0);
        let mut off: Vec<f64> = nodes.places.iter().map(|p| line.beyond(p[0], p[1])).collect();
        off.sort_unstable_by(f64::total_cmp);
        let end = |share: f64| off[(share * (off.len() - 1) as f64) as usize];
        let (low, high) = (end(LEAST_SIDE), end(1.0 - LEAST_SIDE));
        let at_m = move |i: u32| low + (high - low) * f64::from(i) / f64::from(PLACES);
        (0..=PLACES).map(move |i| Line { at_m: at_m(i), ..line })
    };
    let angle = |i: u32| std::f64::consts::PI * f64::from(i) / f64::from(DIRECTIONS);
    (0..DIRECTIONS).flat_map(|i| along(angle(i))).collect()
}

/// The line of least cost, from moving and turning one by steps that are halved in each round.
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
