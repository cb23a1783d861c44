//! Parts touching piles along the valley between them, by a watershed.
//!
//! Two equal cones of height h and radius r with summits d apart meet in a saddle of height h (1 -
//! d / 2r). If the saddle is below half the height of the lower summit, neither summit lies on the
//! other cone's footprint: two piles whose feet overlap. A higher saddle joins the lobes of one
//! pile. Summits and saddles come from the merge tree of the heights, as in a watershed transform
//! that keeps a basin by its relative depth. Grains and noise have saddles just below their summits
//! and part nothing. Heights in m.

use std::cmp::Ordering;

use super::window::{Window, Zone};
use crate::cancel::Polled;

/// Fewest cells of a pile above its saddle: a block of three by three.
const FEWEST: usize = 9;
/// Largest height of the saddle between two piles, as a share of the lower summit. Closed form: one
/// half for two cones; less a tenth, since rounded summits and lobed flanks change saddle or summit
/// by that much.
const DEEP: f64 = 0.45;

/// The part that each core or toe cell of `window` belongs to, 0 for that with the highest summit;
/// `None` if there is only one.
///
/// `above` holds the heights above the base in m, NaN where unknown. A summit must be more than
/// `margin_m` above its saddle.
pub(crate) fn parts(window: &Window, above: &[f64], margin_m: f64) -> Option<Vec<Option<usize>>> {
    let heights_m = smoothed(window, above);
    let mut order: Vec<usize> = (0..heights_m.len()).filter(|&c| !heights_m[c].is_nan()).collect();
    order.sort_by(|&a, &b| higher_first(&heights_m, a, b));
    let cells = vec![0; heights_m.len()];
    let joined = (0..heights_m.len()).collect();
    let summit = vec![None; heights_m.len()];
    let mut tree = MergeTree { summit, joined, cells, heights_m, margin_m, near: Vec::new() };
    for cell in order.into_iter().polled() {
        tree.pour(window, cell);
    }
    tree.numbered()
}

fn higher_first(heights_m: &[f64], a: usize, b: usize) -> Ordering {
    heights_m[b].total_cmp(&heights_m[a]).then(a.cmp(&b))
}

/// The mean of each core or toe cell and its neighbours: nine cells, a third of the noise.
fn smoothed(window: &Window, above: &[f64]) -> Vec<f64> {
    let held = |cell: usize| matches!(window.zones[cell], Zone::Core | Zone::Toe);
    let mean = |cell| window.mean_around(above, cell, held).filter(|_| !above[cell].is_nan());
    (0..above.len())
        .polled()
        .map(|c| if held(c) { mean(c) } else { None }.unwrap_or(f64::NAN))
        .collect()
}

/// The merge tree: a basin of cells around each summit, and the basins joined at saddles.
struct MergeTree {
    heights_m: Vec<f64>,
    margin_m: f64,
    /// The basin of each cell, named by the cell of its summit.
    summit: Vec<Option<usize>>,
    /// The basin that each basin was joined to; itself if to none.
    joined: Vec<usize>,
    /// Number of cells in each basin so far.
    cells: Vec<usize>,
    /// The cells around one, with their basins; kept for its memory.
    near: Vec<(usize, usize)>,
}

impl MergeTree {
    fn root(&self, mut basin: usize) -> usize {
        while self.joined[basin] != basin {
            basin = self.joined[basin];
        }
        basin
    }

    /// Adds the next lower cell to the basin of its highest neighbour, and joins the basins around
    /// it unless it is a valley between them.
    fn pour(&mut self, window: &Window, cell: usize) {
        let mut near = std::mem::take(&mut self.near);
        near.clear();
        near.extend(window.around(cell, 1).filter_map(|n| Some((n, self.root(self.summit[n]?)))));
        let own = match near.first() {
            // Nearly everywhere, and sooner known.
            Some(&(_, basin)) if near.iter().all(|n| n.1 == basin) => basin,
            _ => self.joined_at(cell, &mut near),
        };
        self.near = near;
        self.summit[cell] = Some(own);
        let root = self.root(own);
        self.cells[root] += 1;
    }

    /// The basin of the highest of the cells `near` with their basins, which are joined as far as this
    /// cell is no valley between them.
    fn joined_at(&mut self, cell: usize, near: &mut Vec<(usize, usize)>) -> usize {
        near.sort_by(|a, b| higher_first(&self.heights_m, a.0, b.0));
        let own = near.first().map_or(cell, |n| n.1);
        near.sort_by(|a, b| higher_first(&self.heights_m, a.1, b.1));
        near.dedup_by_key(|n| n.1);
        let mut kept: Vec<usize> = Vec::new();
        for &mut (_, basin) in near {
            match kept.iter().copied().find(|&other| !self.valley(cell, other, basin)) {
                Some(higher) => self.join(higher, basin),
                None => kept.push(basin),
            }
        }
        own
    }

    /// Whether a cell is a valley between two basins, not a saddle within one pile.
    fn valley(&self, cell: usize, higher: usize, lower: usize) -> bool {
        let (saddle, summit) = (self.heights_m[cell], self.heights_m[lower]);
        let large = self.cells[lower].min(self.cells[higher]) >= FEWEST;
        large && saddle < DEEP * summit && summit - saddle > self.margin_m
    }

    fn join(&mut self, higher: usize, lower: usize) {
        self.joined[lower] = higher;
        self.cells[higher] += self.cells[lower];
    }

    fn numbered(&self) -> Option<Vec<Option<usize>>> {
        let basins: Vec<Option<usize>> =
            self.summit.iter().map(|summit| Some(self.root((*summit)?))).collect();
        let mut roots: Vec<usize> = basins.iter().flatten().copied().collect();
        roots.sort_by(|&a, &b| higher_first(&self.heights_m, a, b));
        roots.dedup();
        let number = |root: usize| roots.iter().position(|&r| r == root);
        (roots.len() > 1).then(|| basins.iter().map(|b| b.and_then(number)).collect())
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::{CELL, exact, measured};
    use super::MergeTree;

    /// Two cones of radius 1 m, `apart` m from each other along an oblique line.
    fn cones(apart: f64, lower: f64) -> Vec<f64> {
        let (dx, dy) = (0.8 * apart / 2.0, 0.6 * apart / 2.0);
        let cone = |x: f64, y: f64, h: f64| 0.5 * (h - (x - 4.0).hypot(y - 3.0));
        let height = |x, y| cone(x + dx, y + dy, 1.0).max(cone(x - dx, y - dy, lower)).max(0.0);
        let objects = measured(&exact(height), |x, y| height(x, y) > 0.05);
        objects.iter().map(|o| o.volume.net_m3()).collect()
    }

    /// Volume of a cone of radius r beyond a plane at distance d from its axis, by the midpoint
    /// rule.
    fn beyond(r: f64, d: f64) -> f64 {
        let step = CELL / 4.0;
        let at = |i: i32| (f64::from(i) + 0.5) * step;
        let cells = (0..200).flat_map(|i| (-200..200).map(move |j| (at(i) + d, at(j))));
        cells.map(|(x, y)| 0.5 * (r - x.hypot(y)).max(0.0) * step * step).sum()
    }

    #[test]
    fn cones_whose_feet_touch_are_two_and_share_the_valley() {
        let whole = std::f64::consts::PI * 0.5 / 3.0;
        for apart in [1.3, 1.5, 1.8] {
            let truth = whole - beyond(1.0, apart / 2.0);
            let found = cones(apart, 1.0);
            assert_eq!(found.len(), 2, "{apart}");
            assert!(found.iter().all(|v| (v / truth - 1.0).abs() < 0.02), "{apart} {found:?}");
        }
    }

    #[test]
    fn lobes_of_one_pile_stay_together() {
        assert_eq!(cones(0.9, 1.0).len(), 1);
        assert_eq!(cones(0.8, 0.8).len(), 1);
        assert_eq!(cones(1.4, 0.8).len(), 2);
    }

    #[test]
    fn noise_and_crumbs_part_nothing() {
        let noise = |x: f64, y: f64| 0.02 * (37.0 * x).sin() * (41.0 * y).cos();
        let height = |x: f64, y: f64| (0.5 * (1.2 - (x - 4.0).hypot(y - 3.0))).max(0.0);
        let objects =
            measured(&exact(|x, y| height(x, y) + noise(x, y)), |x, y| height(x, y) > 0.05);
        assert_eq!(objects.len(), 1);
    }

    #[test]
    fn a_part_of_fewer_than_nine_cells_is_no_pile() {
        let is_valley = |cells: usize| {
            let (heights_m, joined) = (vec![1.0, 1.0, 0.1], vec![0, 1, 2]);
            let (summit, cells) = (vec![None; 3], vec![50, cells, 0]);
            MergeTree { heights_m, margin_m: 0.0, summit, joined, cells, near: vec![] }
                .valley(2, 0, 1)
        };
        assert!(is_valley(12) && !is_valley(6));
    }
}
