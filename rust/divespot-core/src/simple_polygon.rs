//! Whether a closed line is simple, and what lies inside of it.
//!
//! Two edges can cross only where their projections on every line overlap. Sorted along the one of
//! a few directions that leaves the fewest such pairs, n edges of an outline take n log n: the
//! sweep and prune of collision detection (Cohen et al. 1995, I-COLLIDE).

use std::f64::consts::PI;

use crate::cancel::poll;
use crate::{Error, Result};

/// A place in the plane.
pub type Place = [f64; 2];

/// Directions that are tried: a comb's teeth overlap from all sides but one.
const DIRECTIONS: u32 = 8;

/// Pairs of edges that are compared at most, some seconds of work; no line around an area needs so
/// many.
const MOST_PAIRS: usize = 1_000_000_000;

/// An edge's projection, and which edge it is.
#[derive(Debug, Clone, Copy)]
struct Span {
    low: f64,
    high: f64,
    edge: usize,
}

/// The first corner of a closed line whose edge crosses another edge; `None` if no two cross.
///
/// Edges may touch. The last corner is not the first one again.
///
/// # Errors
///
/// The line is so intricate that its edges overlap from all sides.
pub fn first_crossing(line: &[Place]) -> Result<Option<usize>> {
    let sorted = (0..DIRECTIONS).map(|k| spans(line, f64::from(k) * PI / f64::from(DIRECTIONS)));
    let Some((pairs, spans)) = sorted.map(|s| (count(&s), s)).min_by_key(|(pairs, _)| *pairs)
    else {
        return Ok(None);
    };
    if pairs > MOST_PAIRS {
        return Err(Error::Degenerate(
            "is too intricate: fewer corners, or a line around an area, are needed",
        ));
    }
    let crossings = spans.iter().enumerate().flat_map(|(i, one)| {
        poll();
        let near = spans[i + 1..].iter().take_while(|other| other.low <= one.high);
        near.filter(|other| cross(line, one.edge, other.edge)).map(|o| o.edge.min(one.edge))
    });
    Ok(crossings.min())
}

/// The projections of all edges on a direction, by where they begin.
fn spans(line: &[Place], angle: f64) -> Vec<Span> {
    let (sin, cos) = angle.sin_cos();
    let origin = line.first().copied().unwrap_or_default();
    let along = |p: Place| cos * (p[0] - origin[0]) + sin * (p[1] - origin[1]);
    let span = |edge: usize| {
        let (from, to) = edge_of(line, edge);
        let (a, b) = (along(from), along(to));
        Span { low: a.min(b), high: a.max(b), edge }
    };
    let mut spans: Vec<Span> = (0..line.len()).map(span).collect();
    spans.sort_unstable_by(|a, b| a.low.total_cmp(&b.low).then(a.edge.cmp(&b.edge)));
    spans
}

/// The pairs of spans that overlap.
fn count(spans: &[Span]) -> usize {
    let after = |one: &Span| spans.partition_point(|other| other.low <= one.high);
    spans.iter().enumerate().map(|(i, one)| after(one) - i - 1).sum()
}

fn edge_of(line: &[Place], edge: usize) -> (Place, Place) {
    (line[edge], line[(edge + 1) % line.len()])
}

/// Whether two edges cross, rather than touch or share a corner.
fn cross(line: &[Place], one: usize, other: usize) -> bool {
    let ((a, b), (c, d)) = (edge_of(line, one), edge_of(line, other));
    let apart = |k: usize| a[k].max(b[k]) < c[k].min(d[k]) || c[k].max(d[k]) < a[k].min(b[k]);
    if apart(0) || apart(1) {
        return false;
    }
    side(a, b, c) * side(a, b, d) < 0.0 && side(c, d, a) * side(c, d, b) < 0.0
}

/// On which side of the line from `a` to `b` a place lies: 1, -1, or 0 on it.
fn side(a: Place, b: Place, p: Place) -> f64 {
    let turn = (b[0] - a[0]) * (p[1] - a[1]) - (b[1] - a[1]) * (p[0] - a[0]);
    if turn == 0.0 { 0.0 } else { turn.signum() }
}

/// Whether a place lies inside an odd number of closed lines.
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

    #[test]
    fn a_comb_from_any_side_is_quick() {
        for turn in [0.0, 0.5 * PI, 0.25 * PI] {
            let (sin, cos) = f64::sin_cos(turn);
            let tooth = |i: u32| {
                let [x, y] = [f64::from(i) * 1e-4, f64::from(i % 2)];
                [cos * x - sin * y, sin * x + cos * y]
            };
            let line: Vec<Place> = (0..20_000).map(tooth).collect();
            assert!(count(&spans(&line, turn)) < 100_000);
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
