//! A straight line under an object along which the floor is folded or stepped.
//!
//! The ring of ground crosses such a line twice. Across the inside a film would be right at its
//! rim alone: it rounds a fold off and turns a step into a ramp, by some per cent of a low pile.

use nalgebra::{DMatrix, DVector};

/// Nodes along the longer side of the ring, into which its cells are gathered.
const NODES: f64 = 24.0;
/// Directions and places of a line that are tried first.
const DIRECTIONS: u32 = 18;
const PLACES: u32 = 16;
/// Rounds in which the best line is moved by ever half as much.
const ROUNDS: usize = 6;
/// A line must leave this share of the ring on either side.
const LEAST_SIDE: f64 = 0.1;
/// A crease must leave this share at most of what a floor bent smoothly, with as many parameters,
/// leaves in squares.
const CLEARER: f64 = 0.35;
/// A bent floor that leaves less than this share of the cells' noise needs no crease.
const NOTICED: f64 = 0.5;
/// What is further off than this many standard deviations tells nothing.
const STRAY: f64 = 4.0;
/// Standard deviation of normal values in median absolute ones.
const NORMAL: f64 = 1.4826;

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
}

/// The line of the places `p` with `p · (cos, sin) = at_m`.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Line {
    angle_rad: f64,
    at_m: f64,
}

impl Line {
    /// The distance beyond the line.
    fn beyond(self, x: f64, y: f64) -> f64 {
        x * self.angle_rad.cos() + y * self.angle_rad.sin() - self.at_m
    }
}

impl Kind {
    fn value(self, beyond: f64) -> f64 {
        match self {
            Self::Fold => beyond.max(0.0),
            Self::Step if beyond > 0.0 => 1.0,
            Self::Step => 0.0,
        }
    }
}

impl Crease {
    /// What the crease adds to the plane at a place.
    pub(crate) fn at(&self, x: f64, y: f64) -> f64 {
        self.rise * self.kind.value(self.line.beyond(x, y))
    }

    /// The crease that a ring (x, y, height, about its centre) shows, if there is one.
    pub(crate) fn found(ring: &[[f64; 3]]) -> Option<Self> {
        let nodes = Nodes::of(ring);
        let plane = nodes.basis(|x, y| vec![1.0, x, y])?;
        let bent = nodes.basis(|x, y| vec![1.0, x, y, x * x, x * y, y * y])?;
        let left = without(&plane, &nodes.heights);
        let smooth = without(&bent, &nodes.heights);
        if (smooth.norm_squared() / nodes.roots.norm_squared()).sqrt() < NOTICED * nodes.noise_m {
            return None;
        }
        let crease = nodes.best(&plane, &left)?;
        let rest = &left - nodes.across(&plane, crease.kind, crease.line) * crease.rise;
        let spread = STRAY * NORMAL * median(rest.iter().map(|r| r.abs()).collect());
        let capped = |v: &DVector<f64>| v.iter().map(|r| r.abs().min(spread).powi(2)).sum::<f64>();
        (capped(&rest) < CLEARER * capped(&smooth)).then(|| crease.settled(ring, &nodes))
    }

    /// The crease with its line moved to where it leaves least of the single cells.
    fn settled(self, ring: &[[f64; 3]], nodes: &Nodes) -> Self {
        let most = STRAY * nodes.noise_m;
        let cost = |line: Line| {
            let crease = Self { line, ..self };
            let Some(plane) = nodes.plane_under(&crease) else { return f64::INFINITY };
            let off = |p: &[f64; 3]| {
                p[2] - plane[0] - plane[1] * p[0] - plane[2] * p[1] - crease.at(p[0], p[1])
            };
            ring.iter().map(|p| off(p).abs().min(most).powi(2)).sum()
        };
        Self { line: moved(self.line, 0.5 * nodes.step_m, 0.05, cost), ..self }
    }
}

/// The ring's cells gathered into squares, each weighted by the root of their number.
struct Nodes {
    places: Vec<[f64; 2]>,
    roots: DVector<f64>,
    heights: DVector<f64>,
    step_m: f64,
    /// Standard deviation of a cell about the middle of its node.
    noise_m: f64,
}

impl Nodes {
    fn of(ring: &[[f64; 3]]) -> Self {
        let range = |k: usize| {
            let ends = ring.iter().map(|p| p[k]);
            (ends.clone().fold(f64::INFINITY, f64::min), ends.fold(f64::NEG_INFINITY, f64::max))
        };
        let (x, y) = (range(0), range(1));
        let step_m = ((x.1 - x.0).max(y.1 - y.0) / NODES).max(f64::MIN_POSITIVE);
        let mut cells: std::collections::BTreeMap<(usize, usize), Vec<[f64; 3]>> =
            std::collections::BTreeMap::new();
        for p in ring {
            let key = (((p[0] - x.0) / step_m) as usize, ((p[1] - y.0) / step_m) as usize);
            cells.entry(key).or_default().push(*p);
        }
        let mut off = Vec::new();
        let (mut places, mut roots, mut heights) = (Vec::new(), Vec::new(), Vec::new());
        for cells in cells.values() {
            let count = to_f64(cells.len());
            let middle = median(cells.iter().map(|p| p[2]).collect());
            off.extend(cells.iter().map(|p| (p[2] - middle).abs()));
            places.push([0, 1].map(|k| cells.iter().map(|p| p[k]).sum::<f64>() / count));
            roots.push(count.sqrt());
            heights.push(count.sqrt() * middle);
        }
        let noise_m = NORMAL * median(off);
        Self { places, roots: roots.into(), heights: heights.into(), step_m, noise_m }
    }

    /// Orthonormal columns that span the weighted values of functions at the nodes; `None` where
    /// there are too few nodes.
    fn basis(&self, functions: impl Fn(f64, f64) -> Vec<f64>) -> Option<DMatrix<f64>> {
        let rows: Vec<Vec<f64>> = self.places.iter().map(|p| functions(p[0], p[1])).collect();
        let width = rows.first()?.len();
        let matrix =
            DMatrix::from_fn(rows.len(), width, |row, column| self.roots[row] * rows[row][column]);
        (rows.len() > 2 * width).then(|| matrix.qr().q())
    }

    /// What a plane leaves of a unit crease.
    fn across(&self, plane: &DMatrix<f64>, kind: Kind, line: Line) -> DVector<f64> {
        let value = |i: usize| kind.value(line.beyond(self.places[i][0], self.places[i][1]));
        without(plane, &DVector::from_fn(self.places.len(), |i, _| self.roots[i] * value(i)))
    }

    /// The crease that explains most of what a plane leaves.
    fn best(&self, plane: &DMatrix<f64>, left: &DVector<f64>) -> Option<Crease> {
        let cost = |kind: Kind, line: Line| {
            let across = self.across(plane, kind, line);
            -across.dot(left).powi(2) / across.norm_squared().max(f64::MIN_POSITIVE)
        };
        let tried = self.lines().into_iter().flat_map(|line| {
            [Kind::Fold, Kind::Step].map(|kind| (cost(kind, line), kind, line))
        });
        let (_, kind, line) = tried.min_by(|a, b| a.0.total_cmp(&b.0))?;
        let size_m = NODES * self.step_m;
        let turn = std::f64::consts::PI / f64::from(DIRECTIONS);
        let line = moved(line, size_m / f64::from(PLACES), turn, |line| cost(kind, line));
        let across = self.across(plane, kind, line);
        let rise = across.dot(left) / across.norm_squared().max(f64::MIN_POSITIVE);
        Some(Crease { kind, line, rise })
    }

    /// Lines in all directions that leave something of the ring on either side.
    fn lines(&self) -> Vec<Line> {
        let along = |angle_rad: f64| {
            let line = Line { angle_rad, at_m: 0.0 };
            let mut off: Vec<f64> = self.places.iter().map(|p| line.beyond(p[0], p[1])).collect();
            off.sort_unstable_by(f64::total_cmp);
            let end = |share: f64| off[(share * to_f64(off.len() - 1)) as usize];
            let (low, high) = (end(LEAST_SIDE), end(1.0 - LEAST_SIDE));
            (0..=PLACES).map(move |i| {
                let at_m = low + (high - low) * f64::from(i) / f64::from(PLACES);
                Line { angle_rad, at_m }
            })
        };
        let angle = |i: u32| std::f64::consts::PI * f64::from(i) / f64::from(DIRECTIONS);
        (0..DIRECTIONS).flat_map(|i| along(angle(i))).collect()
    }

    /// Height at the centre and slopes of the plane that fits what a crease leaves of the nodes.
    fn plane_under(&self, crease: &Crease) -> Option<[f64; 3]> {
        let (mut matrix, mut right) = (nalgebra::Matrix3::zeros(), nalgebra::Vector3::zeros());
        for (i, &[x, y]) in self.places.iter().enumerate() {
            let row = nalgebra::Vector3::new(1.0, x, y) * self.roots[i];
            matrix += row * row.transpose();
            right += row * (self.heights[i] - self.roots[i] * crease.at(x, y));
        }
        matrix.cholesky().map(|c| c.solve(&right).into())
    }
}

/// The line of least cost, from moving and turning one by steps that are halved in each round.
fn moved(mut line: Line, mut step_m: f64, mut turn: f64, cost: impl Fn(Line) -> f64) -> Line {
    let mut least = cost(line);
    for _ in 0..ROUNDS {
        step_m *= 0.5;
        turn *= 0.5;
        let from = line;
        for (right, left) in (-1..=1).flat_map(|a| (-1..=1).map(move |b| (a, b))) {
            let near = Line {
                angle_rad: from.angle_rad + f64::from(left) * turn,
                at_m: from.at_m + f64::from(right) * step_m,
            };
            let value = cost(near);
            if value < least {
                (least, line) = (value, near);
            }
        }
    }
    line
}

/// The part of `values` that lies across all columns of an orthonormal basis.
fn without(basis: &DMatrix<f64>, values: &DVector<f64>) -> DVector<f64> {
    values - basis * basis.tr_mul(values)
}

fn median(mut values: Vec<f64>) -> f64 {
    if values.is_empty() {
        return 0.0;
    }
    let middle = values.len() / 2;
    *values.select_nth_unstable_by(middle, f64::total_cmp).1
}

#[allow(clippy::cast_precision_loss)] // counts of cells
fn to_f64(n: usize) -> f64 {
    n as f64
}
