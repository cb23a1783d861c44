//! Whether a polygon is simple (no two edges cross), and whether a place lies inside polygons.
//!
//! Two edges can cross only if their projections on every line overlap. Consecutive edges are near
//! each other, so a tree over the edges holds the extent of ever longer stretches in a few
//! directions (discrete orientation polytopes: Klosowski et al. 1998, IEEE TVCG 4:21). The tree is
//! joined with itself where these extents overlap. An outline of n edges takes n log n. The teeth
//! of a comb overlap with a few of a hundred others, the more the closer they are.

use std::f64::consts::PI;

use robust::{Coord, orient2d};

use crate::cancel::poll;
use crate::{Error, Result};

/// A place in plan, in m.
pub type Place = [f64; 2];

/// Directions of the projections. Chosen: the teeth of a comb overlap in all directions but one;
/// fewer compare more pairs of edges, more cost memory and time for each.
const DIRECTIONS: usize = 8;

/// Most pairs of tree nodes that are compared, some seconds of work. Chosen: no outline around an
/// area needs so many; lower refuses ragged ones, higher takes longer to refuse a scribble.
const MOST_PAIRS: usize = 1_000_000_000;

/// Bound on the rounding of projections, relative to the distance from the line's first corner.
const ROUNDING: f64 = 8.0 * f64::EPSILON;

/// Pairs between two checks for cancellation. Decides no answer.
const POLLED: usize = 1 << 16;

/// The extents of some edges in each direction.
#[derive(Debug, Clone, Copy)]
struct Spans {
    low: [f64; DIRECTIONS],
    high: [f64; DIRECTIONS],
}

impl Spans {
    fn of(along: [[f64; DIRECTIONS]; 2]) -> Self {
        let [a, b] = along;
        let slack =
            ROUNDING * along.as_flattened().iter().fold(0.0, |most: f64, v| most.max(v.abs()));
        Self {
            low: std::array::from_fn(|k| a[k].min(b[k]) - slack),
            high: std::array::from_fn(|k| a[k].max(b[k]) + slack),
        }
    }

    fn with(&self, other: &Self) -> Self {
        Self {
            low: std::array::from_fn(|k| self.low[k].min(other.low[k])),
            high: std::array::from_fn(|k| self.high[k].max(other.high[k])),
        }
    }

    fn meet(&self, other: &Self) -> bool {
        (0..DIRECTIONS).all(|k| self.low[k] <= other.high[k] && other.low[k] <= self.high[k])
    }
}

/// The first corner of a polygon whose edge crosses another edge; `None` if no two cross.
///
/// Edges may touch. The first corner is not repeated at the end.
///
/// # Errors
///
/// The line is so intricate that its edges overlap in all directions.
///
/// # Examples
///
/// ```
/// use divespot_core::simple_polygon::first_crossing;
///
/// let square = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
/// assert_eq!(first_crossing(&square)?, None);
/// let bow_tie = [[0.0, 0.0], [1.0, 1.0], [1.0, 0.0], [0.0, 1.0]];
/// assert_eq!(first_crossing(&bow_tie)?, Some(0));
/// # Ok::<(), divespot_core::Error>(())
/// ```
pub fn first_crossing(line: &[Place]) -> Result<Option<usize>> {
    let mut join = Join { line, tree: tree(line), pairs: 0, first: None };
    let mut waiting = vec![(1, 1)];
    while let Some((one, other)) = waiting.pop() {
        if join.pairs > MOST_PAIRS {
            return Err(Error::Degenerate(
                "is too intricate: fewer corners, or a line around an area, are needed",
            ));
        }
        join.part(one, other, &mut waiting);
    }
    Ok(join.first)
}

/// A tree joined with itself. The children of node i are 2 i and 2 i + 1; the edges are the leaves.
struct Join<'a> {
    line: &'a [Place],
    tree: Vec<Option<Spans>>,
    pairs: usize,
    first: Option<usize>,
}

impl Join<'_> {
    /// Compares two nodes, and queues their children.
    fn part(&mut self, one: usize, other: usize, waiting: &mut Vec<(usize, usize)>) {
        self.pairs += 1;
        if self.pairs.is_multiple_of(POLLED) {
            poll();
        }
        let (Some(a), Some(b)) = (self.spans(one), self.spans(other)) else { return };
        let leaves = self.tree.len() / 2;
        if one == other {
            if one < leaves {
                let (left, right) = (2 * one, 2 * one + 1);
                waiting.extend([(left, right), (right, right), (left, left)]);
            }
        } else if a.meet(&b) {
            match (one < leaves, other < leaves) {
                (true, _) => waiting.extend([(2 * one, other), (2 * one + 1, other)]),
                (false, true) => waiting.extend([(one, 2 * other), (one, 2 * other + 1)]),
                (false, false) => self.compare(one - leaves, other - leaves),
            }
        }
    }

    fn spans(&self, node: usize) -> Option<Spans> {
        self.tree.get(node).copied().flatten()
    }

    fn compare(&mut self, one: usize, other: usize) {
        if cross(self.line, one, other) {
            let edge = one.min(other);
            self.first = Some(self.first.map_or(edge, |first| first.min(edge)));
        }
    }
}

/// The extents of all edges, and of each node's.
fn tree(line: &[Place]) -> Vec<Option<Spans>> {
    let turns: [(f64, f64); DIRECTIONS] =
        std::array::from_fn(|k| libm::sincos(k as f64 * PI / DIRECTIONS as f64));
    let origin = line.first().copied().unwrap_or_default();
    let along =
        |p: Place| turns.map(|(sin, cos)| cos * (p[0] - origin[0]) + sin * (p[1] - origin[1]));
    let leaves = line.len().next_power_of_two();
    let mut tree = vec![None; 2 * leaves];
    for edge in 0..line.len() {
        let (from, to) = edge_of(line, edge);
        tree[leaves + edge] = Some(Spans::of([along(from), along(to)]));
    }
    for node in (1..leaves).rev() {
        tree[node] = match (tree[2 * node], tree[2 * node + 1]) {
            (Some(a), Some(b)) => Some(a.with(&b)),
            (one, other) => one.or(other),
        };
    }
    tree
}

fn edge_of(line: &[Place], edge: usize) -> (Place, Place) {
    (line[edge], line[(edge + 1) % line.len()])
}

/// Whether two edges cross, as opposed to touching or sharing a corner.
fn cross(line: &[Place], one: usize, other: usize) -> bool {
    let ((a, b), (c, d)) = (edge_of(line, one), edge_of(line, other));
    let apart = |k: usize| a[k].max(b[k]) < c[k].min(d[k]) || c[k].max(d[k]) < a[k].min(b[k]);
    if apart(0) || apart(1) {
        return false;
    }
    side(a, b, c) * side(a, b, d) < 0.0 && side(c, d, a) * side(c, d, b) < 0.0
}

/// The side of the line from `a` to `b` on which a place lies: 1, -1, or 0 on it; exact.
fn side(a: Place, b: Place, p: Place) -> f64 {
    let turn = orient2d(coord(a), coord(b), coord(p));
    if turn == 0.0 { 0.0 } else { turn.signum() }
}

fn coord([x, y]: Place) -> Coord<f64> {
    Coord { x, y }
}

/// Whether a place lies inside an odd number of polygons.
///
/// # Examples
///
/// ```
/// use divespot_core::simple_polygon::contains;
///
/// let square = vec![[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
/// assert!(contains(&[square.clone()], [0.5, 0.5]));
/// assert!(!contains(&[square], [1.5, 0.5]));
/// ```
#[must_use]
pub fn contains(lines: &[Vec<Place>], place: Place) -> bool {
    lines.iter().fold(false, |inside, line| inside ^ is_inside(line, place))
}

fn is_inside(line: &[Place], [x, y]: Place) -> bool {
    let passes = |edge: usize| {
        let (a, b) = edge_of(line, edge);
        (a[1] > y) != (b[1] > y) && x < a[0] + (y - a[1]) * (b[0] - a[0]) / (b[1] - a[1])
    };
    poll();
    (0..line.len()).filter(|&edge| passes(edge)).count() % 2 == 1
}

#[cfg(test)]
mod tests {
    use super::*;

    /// All pairs, one by one.
    fn slow(line: &[Place]) -> Option<usize> {
        (0..line.len()).find(|&i| (i + 1..line.len()).any(|j| cross(line, i, j)))
    }

    fn star(corners: usize, seed: u64, waver: f64) -> Vec<Place> {
        let mut state = seed;
        let mut random = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888);
            (state >> 40) as f64 / f64::from(1 << 24)
        };
        let corner = |i: usize| {
            let angle = 2.0 * PI * (i as f64 + waver * random()) / corners as f64;
            let radius = 1.0 + 0.3 * random();
            [radius * angle.cos(), radius * angle.sin()]
        };
        (0..corners).map(corner).collect()
    }

    #[test]
    fn agrees_with_all_pairs() {
        for seed in 0..40 {
            for waver in [0.0, 0.9, 1.5, 9.0] {
                let line = star(60, seed, waver);
                assert_eq!(first_crossing(&line), Ok(slow(&line)));
            }
        }
    }

    #[test]
    fn lines_that_touch_do_not_cross() {
        let touching = [[0.0, 0.0], [2.0, 0.0], [2.0, 2.0], [1.0, 0.0], [0.0, 2.0]];
        assert_eq!(first_crossing(&touching), Ok(None));
        assert_eq!(first_crossing(&[[0.0, 0.0], [1.0, 1.0], [1.0, 0.0], [0.0, 1.0]]), Ok(Some(0)));
        assert_eq!(first_crossing(&[]), Ok(None));
        assert_eq!(first_crossing(&[[1.0, 2.0]]), Ok(None));
    }

    /// Number of pairs that are compared for a line.
    fn pairs(line: &[Place]) -> usize {
        let mut join = Join { line, tree: tree(line), pairs: 0, first: None };
        let mut waiting = vec![(1, 1)];
        while let Some((one, other)) = waiting.pop() {
            join.part(one, other, &mut waiting);
        }
        join.pairs
    }

    #[test]
    fn a_comb_from_any_side_is_quick() {
        for turn in [0.0, 0.5 * PI, 0.25 * PI, 0.2] {
            let (sin, cos) = f64::sin_cos(turn);
            let tooth = |i: u32| {
                let [x, y] = [f64::from(i) * 1e-4, f64::from(i % 2)];
                [cos * x - sin * y, sin * x + cos * y]
            };
            let line: Vec<Place> = (0..20_000).map(tooth).collect();
            // Halfway between two directions a tooth overlaps with all within a fifth of its
            // length.
            let most = if turn == 0.2 { 5000 } else { 40 };
            assert!(pairs(&line) < most * line.len(), "{turn}: {}", pairs(&line));
        }
    }

    #[test]
    fn the_work_grows_with_the_corners() {
        let spiky = |corners| star(corners, 0, 0.9);
        for (corners, line) in [4000, 16_000].map(|corners| (corners, spiky(corners))) {
            assert!(pairs(&line) < 2000 * corners, "{corners}: {}", pairs(&line));
        }
    }

    #[test]
    fn holes_are_outside() {
        let square = |r: f64| vec![[-r, -r], [r, -r], [r, r], [-r, r]];
        let lines = [square(2.0), square(1.0)];
        assert!(contains(&lines, [1.5, 0.25]));
        assert!(!contains(&lines, [0.5, 0.25]));
        assert!(!contains(&lines, [2.5, 0.25]));
    }
}
