//! Harmonic interpolation of heights on a grid, in m: across gaps, and smoothed through noisy
//! cells.
//!
//! Method: the discrete Laplace equation, solved by successive over-relaxation.

use crate::cancel::{Polled, poll};

/// Nodes along the longer side. Chosen: finer undulations, within a pile's width, are not a
/// floor's; coarser nodes cut off true ones.
const NODES: usize = 48;
/// Weight of one cell of ground relative to one neighbouring node. Chosen: lower smooths
/// undulations away, higher follows the noise of cells.
const PULL: f64 = 0.2;
/// Over-relaxation factor, near the optimum for this number of nodes (speed of convergence).
const RELAXATION: f64 = 1.85;
/// Most sweeps, and the change in a sweep, as a share of the largest height, that ends them.
/// Chosen: fewer, or a larger change, leave wide gaps half filled; more take time.
const SWEEPS: usize = 1000;
const SETTLED: f64 = 1e-5;

/// A smooth surface through heights that it need not meet exactly: it averages their noise, follows
/// their undulations and crosses gaps harmonically.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Harmonic {
    origin_m: [f64; 2],
    step_m: f64,
    columns: usize,
    heights_m: Vec<f64>,
}

/// A free node, with the weight and weighted sum of its data.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Node {
    at: usize,
    weight: f64,
    sum: f64,
}

impl Node {
    /// A node without data of its own.
    pub(crate) fn free(at: usize) -> Self {
        Self { at, weight: 0.0, sum: 0.0 }
    }
}

/// Solves for the `nodes` of a grid: each becomes the weighted mean of its neighbours and its data.
/// All other nodes are fixed; those without a height (NaN) have no weight. `largest_m` is the scale
/// of the heights, in m.
///
/// Nodes are updated by diagonals. The result is the same as row by row, but the nodes of a
/// diagonal do not depend on each other, which is faster.
pub(crate) fn relax(heights_m: &mut [f64], columns: usize, nodes: &[Node], largest_m: f64) {
    let mut field = Field::around(heights_m, columns);
    let mut nodes: Vec<Pulled> = nodes.iter().filter_map(|node| field.pulled(node)).collect();
    nodes.sort_by_key(|node| node.diagonal);
    for _ in 0..SWEEPS {
        poll();
        if field.sweep(&nodes) <= SETTLED * largest_m {
            break;
        }
    }
    nodes.iter().for_each(|node| heights_m[node.at] = field.heights_m[node.framed]);
}

/// Heights with a border around them, so that every node has four neighbours.
struct Field {
    columns: usize,
    /// Number of columns including the border.
    width: usize,
    /// 0 in the border and where no height is known, so that it adds nothing.
    heights_m: Vec<f64>,
    /// 1 where a height is known, 0 elsewhere.
    known: Vec<f64>,
}

/// A free node with the weight of its neighbours and data.
struct Pulled {
    at: usize,
    /// Its index in the bordered field.
    framed: usize,
    diagonal: usize,
    sum: f64,
    weight: f64,
}

impl Field {
    fn around(heights_m: &[f64], columns: usize) -> Self {
        let width = columns + 2;
        let size = width * (heights_m.len().div_ceil(columns.max(1)) + 2);
        let mut field = Self { columns, width, heights_m: vec![0.0; size], known: vec![0.0; size] };
        for (at, &height) in heights_m.iter().enumerate().filter(|(_, h)| !h.is_nan()) {
            let framed = field.framed(at);
            (field.heights_m[framed], field.known[framed]) = (height, 1.0);
        }
        field
    }

    fn framed(&self, at: usize) -> usize {
        (at / self.columns + 1) * self.width + at % self.columns + 1
    }

    /// The sum of the four neighbours' values.
    fn four(&self, values: &[f64], at: usize) -> f64 {
        values[at - 1] + values[at + 1] + values[at - self.width] + values[at + self.width]
    }

    fn pulled(&self, node: &Node) -> Option<Pulled> {
        let framed = self.framed(node.at);
        let diagonal = node.at / self.columns + node.at % self.columns;
        let weight = self.four(&self.known, framed) + node.weight;
        (weight > 0.0).then_some(Pulled { at: node.at, framed, diagonal, sum: node.sum, weight })
    }

    /// Updates every node once; returns the largest change in m.
    fn sweep(&mut self, nodes: &[Pulled]) -> f64 {
        let mut largest = 0.0_f64;
        for node in nodes {
            let balance = (self.four(&self.heights_m, node.framed) + node.sum) / node.weight;
            let step = RELAXATION * (balance - self.heights_m[node.framed]);
            self.heights_m[node.framed] += step;
            largest = largest.max(step.abs());
        }
        largest
    }
}

impl Harmonic {
    /// The surface over `size_m` from `origin_m`, through the cells `annulus` (x, y, height) of width
    /// `cell_m`.
    pub(crate) fn stretched(
        origin_m: [f64; 2],
        size_m: [f64; 2],
        cell_m: f64,
        annulus: impl Iterator<Item = [f64; 3]> + Clone,
    ) -> Self {
        let step_m = (size_m[0].max(size_m[1]) / NODES as f64).max(cell_m);
        let nodes = size_m.map(|s| (s / step_m).ceil() as usize + 1);
        let mut harmonic =
            Self { origin_m, step_m, columns: nodes[0], heights_m: vec![0.0; nodes[0] * nodes[1]] };
        let nodes = harmonic.gather(annulus.clone());
        let largest = annulus.map(|p| p[2].abs()).fold(0.0, f64::max);
        relax(&mut harmonic.heights_m, harmonic.columns, &nodes, largest);
        harmonic
    }

    /// The surface that samples `height` over a square.
    pub(crate) fn sampled(
        origin_m: [f64; 2],
        side_m: f64,
        height: impl Fn([f64; 2]) -> f64,
    ) -> Self {
        let (columns, step_m) = (NODES + 1, side_m / NODES as f64);
        let along = |k: usize, n: usize| origin_m[k] + step_m * n as f64;
        let node = |n: usize| height([along(0, n % columns), along(1, n / columns)]);
        Self { origin_m, step_m, columns, heights_m: (0..columns * columns).map(node).collect() }
    }

    /// The surface, shifted in plan.
    pub(crate) fn moved(mut self, by_m: [f64; 2]) -> Self {
        self.origin_m.iter_mut().zip(by_m).for_each(|(origin, by)| *origin += by);
        self
    }

    /// Adds every cell to the data of its nearest node.
    fn gather(&self, annulus: impl Iterator<Item = [f64; 3]>) -> Vec<Node> {
        let mut data: Vec<Node> = (0..self.heights_m.len()).map(Node::free).collect();
        for p in annulus.polled() {
            let (x, y) = self.place([p[0], p[1]]);
            let node = y.round() as usize * self.columns + x.round() as usize;
            data[node].weight += PULL;
            data[node].sum += PULL * p[2];
        }
        data
    }

    /// Height of the surface at a place in m, bilinear between nodes.
    pub(crate) fn at(&self, p: [f64; 2]) -> f64 {
        let (x, y) = self.place(p);
        let row = self.columns;
        let most = [row - 1, self.heights_m.len() / row - 1].map(|n| n.saturating_sub(1));
        let (column, line) = ((x as usize).min(most[0]), (y as usize).min(most[1]));
        let (right, above) = (x - column as f64, y - line as f64);
        let node = |dx: usize, dy: usize| {
            self.heights_m.get((line + dy) * row + column + dx).copied().unwrap_or(0.0)
        };
        let low = node(0, 0) * (1.0 - right) + node(1, 0) * right;
        let high = node(0, 1) * (1.0 - right) + node(1, 1) * right;
        low * (1.0 - above) + high * above
    }

    /// A place in steps from the first node, clamped to the surface.
    fn place(&self, p: [f64; 2]) -> (f64, f64) {
        let rows = self.heights_m.len() / self.columns;
        let along = |k: usize, nodes: usize| {
            ((p[k] - self.origin_m[k]) / self.step_m).clamp(0.0, (nodes - 1) as f64)
        };
        (along(0, self.columns), along(1, rows))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn annulus(height: impl Fn(f64, f64) -> f64) -> Vec<[f64; 3]> {
        let cells = (0..40).flat_map(|i| (0..40).map(move |j| [f64::from(i), f64::from(j)]));
        let on = |p: &[f64; 2]| ((p[0] - 19.5).hypot(p[1] - 19.5) - 16.0).abs() < 2.0;
        cells.filter(on).map(|[x, y]| [x, y, height(x, y)]).collect()
    }

    #[test]
    fn a_saddle_is_crossed_as_a_soap_film_would() {
        let saddle = |x: f64, y: f64| 0.01 * ((x - 19.5).powi(2) - (y - 19.5).powi(2));
        let harmonic = Harmonic::stretched([0.0; 2], [40.0; 2], 1.0, annulus(saddle).into_iter());
        for [x, y] in [[19.5, 19.5], [25.0, 19.5], [19.5, 10.0], [12.0, 14.0]] {
            assert!(
                (harmonic.at([x, y]) - saddle(x, y)).abs() < 0.2,
                "{x} {y} {}",
                harmonic.at([x, y])
            );
        }
    }

    #[test]
    fn noise_is_averaged_and_a_level_ring_gives_a_level_film() {
        let noisy = annulus(|x, y| if (x + y) as i32 % 2 == 0 { 1.1 } else { 0.9 });
        let harmonic = Harmonic::stretched([0.0; 2], [40.0; 2], 1.0, noisy.into_iter());
        assert!((harmonic.at([19.5, 19.5]) - 1.0).abs() < 0.01);
        let level = Harmonic::stretched([0.0; 2], [4.0; 2], 1.0, [[0.0, 0.0, 0.25]].into_iter());
        assert!((level.at([3.0, 1.0]) - 0.25).abs() < 1e-4);
    }

    #[test]
    fn a_film_of_given_heights_has_them_wherever_it_is_moved() {
        let plane = |[x, y]: [f64; 2]| 0.3 * x - 0.1 * y;
        let harmonic = Harmonic::sampled([-2.0, 1.0], 4.0, plane).moved([10.0, 20.0]);
        for p in [[-1.9, 1.1], [0.03, 2.2], [1.99, 4.9]] {
            assert!((harmonic.at([p[0] + 10.0, p[1] + 20.0]) - plane(p)).abs() < 1e-12, "{p:?}");
        }
    }

    #[test]
    fn a_gap_is_crossed_and_what_is_unknown_pulls_at_nothing() {
        let plane = |node: usize| 0.3 * (node % 9) as f64 - 0.1 * (node / 9) as f64;
        let mut heights: Vec<f64> = (0..81).map(plane).collect();
        let gap: Vec<usize> = (0..81).filter(|n| (2..7).contains(&(n % 9)) && *n > 17).collect();
        gap.iter().for_each(|&node| heights[node] = 0.0);
        heights[80] = f64::NAN;
        let nodes: Vec<Node> = gap.iter().filter(|n| **n < 63).map(|&n| Node::free(n)).collect();
        (63..81).for_each(|node| heights[node] = plane(node));
        relax(&mut heights, 9, &nodes, 1.0);
        gap.iter().for_each(|&n| assert!((heights[n] - plane(n)).abs() < 1e-3, "{n}"));
        let mut alone = [f64::NAN, 0.5, f64::NAN];
        relax(&mut alone, 3, &[Node::free(1)], 1.0);
        assert_eq!(alone[1], 0.5);
    }

    #[test]
    fn a_film_has_48_nodes_a_side_and_is_straight_between_them() {
        // Halfway between nodes a step apart a chord of x² lies a quarter of a square step too high.
        let harmonic = Harmonic::sampled([0.0; 2], 48.0, |[x, _]| x * x);
        assert!((harmonic.at([0.5, 3.0]) - 0.5).abs() < 1e-12);
        let wide = Harmonic::stretched([0.0; 2], [96.0, 1.0], 1.0, [[0.0, 0.0, 1.0]].into_iter());
        assert_eq!((wide.columns, wide.step_m), (49, 2.0));
    }

    #[test]
    fn a_cell_pulls_a_fifth_as_much_as_a_neighbouring_node() {
        // a = (b + 0.2) / 1.2 and b = a / 1.2.
        let harmonic = Harmonic::stretched(
            [0.0; 2],
            [1.0, 0.0],
            1.0,
            [[0.0, 0.0, 1.0], [1.0, 0.0, 0.0]].into_iter(),
        );
        assert!((harmonic.at([0.0; 2]) - 0.24 / 0.44).abs() < 1e-4, "{}", harmonic.at([0.0; 2]));
    }
}
