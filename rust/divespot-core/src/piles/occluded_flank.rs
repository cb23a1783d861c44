//! The occluded flank of a pile: the flank in the pile's own shadow.
//!
//! From one side a sensor sees a pile's near flank, then nothing, then the ground behind. Without
//! the far flank much of the volume is missing; with a straight line to the ground behind, there is
//! far too much. Poured material runs down from the last seen cell at its angle of repose. Heights
//! in m.

use std::cmp::Reverse;
use std::collections::{BTreeMap, BinaryHeap};

use super::base::Base;
use super::repose::Repose;
use super::scene::Scene;
use crate::cancel::{Polled, poll};
use crate::connectivity::spread;
use crate::connectivity::{EIGHT, FOUR, UNLABELLED};
use crate::extent::NEAR;
use crate::heightmap::Grid;
use crate::hypotenuse::Hypotenuse;

/// The unseen cells that are connected to the map's edge or to a seen cell outside the `object`.
/// Unseen cells that the object encloses are gaps in it, not its shadow.
pub(crate) fn open_cells(
    grid: &Grid,
    unseen: impl Fn(usize) -> bool,
    object: impl Fn(usize) -> bool,
) -> Vec<bool> {
    let four = |cell: usize| grid.neighbors(cell, &FOUR);
    let beside_ground = |c: usize| four(c).any(|n| !unseen(n) && !object(n));
    let opens = |&c: &usize| unseen(c) && (grid.is_border(c) || beside_ground(c));
    let seeds = (0..grid.len()).filter(opens).collect();
    spread(grid, seeds, unseen)
}

/// The highest flank in every unseen cell, and its pile: from each seen cell at the shadow's rim a
/// cone runs down at the angle of repose.
pub(crate) struct Flank {
    /// Label of the pile in each cell; unlabelled where no flank reaches.
    pub(crate) owner: Vec<i32>,
    /// Height above that pile's base, in m; 0 where no flank reaches.
    pub(crate) above_m: Vec<f64>,
}

/// The start of a flank.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Rim {
    /// The last seen cell.
    last: usize,
    /// The cell from which distance counts, and its height above the base in m.
    from: usize,
    above_m: f64,
    owner: i32,
}

/// The height at which a flank starts.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Edge {
    /// Height of the last seen cell. It is mostly too high, because its points are a mix of the
    /// surfaces before and behind the shadow.
    Last,
    /// The same; where no cell near by is higher, `rise_m` is added, since the crest may lie a cell
    /// farther on.
    Crest { rise_m: f64 },
    /// Height of the highest cell near by whose neighbours were all seen. It is too low where the
    /// crest is the rim.
    Sure,
}

impl Flank {
    /// Runs down from `rims` through the `unseen` cells; `slope` gives each pile's.
    ///
    /// Cells are settled from the highest down (Dijkstra's order), each from the rim of the
    /// neighbour it was reached from, at the straight distance to that rim.
    pub(crate) fn down(
        grid: &Grid,
        rims: &[Rim],
        slope: impl Fn(i32) -> f64,
        unseen: impl Fn(usize) -> bool,
    ) -> Self {
        let nothing = vec![UNLABELLED; grid.len()];
        let mut flank = Self { owner: nothing, above_m: vec![0.0; grid.len()] };
        // Positive floats sort as their bits do. Of equal heights that of the first rim wins.
        let mut best = vec![(0, Reverse(usize::MAX)); grid.len()];
        let mut heap = BinaryHeap::new();
        let mut reach = |heap: &mut BinaryHeap<_>, from: usize, rim: usize| {
            let Rim { from: start, owner, above_m, .. } = rims[rim];
            for n in grid.neighbors(from, &EIGHT) {
                if !unseen(n) {
                    continue;
                }
                let height = above_m - slope(owner) * distance(grid, start, n);
                if height > 0.0 && (height.to_bits(), Reverse(rim)) > best[n] {
                    best[n] = (height.to_bits(), Reverse(rim));
                    heap.push((height.to_bits(), Reverse(n), Reverse(rim)));
                }
            }
        };
        (0..rims.len()).for_each(|rim| reach(&mut heap, rims[rim].last, rim));
        while let Some((bits, Reverse(cell), Reverse(rim))) = heap.pop() {
            poll();
            if flank.owner[cell] == UNLABELLED {
                flank.owner[cell] = rims[rim].owner;
                flank.above_m[cell] = f64::from_bits(bits);
                reach(&mut heap, cell, rim);
            }
        }
        flank
    }
}

fn distance(grid: &Grid, a: usize, b: usize) -> f64 {
    let ([ax, ay], [bx, by]) = (grid.center(a), grid.center(b));
    (ax - bx).hypotenuse(ay - by)
}

/// The cells of `object` that border on unseen ones, as starts of flanks.
pub(crate) fn rims_of(
    grid: &Grid,
    object: impl Iterator<Item = (usize, i32)>,
    edge: Edge,
    above: impl Fn(i32, usize) -> f64,
    unseen: impl Fn(usize) -> bool,
) -> Vec<Rim> {
    let at_rim = |cell: usize| grid.neighbors(cell, &EIGHT).any(&unseen);
    let last = object.filter(|&(cell, _)| !unseen(cell) && at_rim(cell));
    let rim = |(last, owner): (usize, i32)| {
        let height = |cell: usize| above(owner, cell);
        let from = if edge == Edge::Sure { sure(grid, last, height)? } else { last };
        let rise_m = match edge {
            Edge::Crest { rise_m } if is_crest(grid, last, height) => rise_m,
            _ => 0.0,
        };
        Some(Rim { last, from, above_m: height(from) + rise_m, owner })
    };
    last.polled().filter_map(rim).filter(|rim| rim.above_m > 0.0).collect()
}

/// Whether no seen cell near `last` is higher.
fn is_crest(grid: &Grid, last: usize, above: impl Fn(usize) -> f64) -> bool {
    let near = square(grid, last, NEAR as isize).flatten();
    !near.map(&above).any(|height| height > above(last))
}

/// The highest cell near `last` whose neighbours were all seen.
fn sure(grid: &Grid, last: usize, above: impl Fn(usize) -> f64) -> Option<usize> {
    let seen = |cell: Option<usize>| cell.is_some_and(|cell| !above(cell).is_nan());
    let near = square(grid, last, NEAR as isize).flatten();
    let inner = near.filter(|&cell| square(grid, cell, 1).all(seen));
    inner.max_by(|&a, &b| above(a).total_cmp(&above(b)))
}

/// The cells up to `reach` columns and rows away, including the cell itself.
fn square(grid: &Grid, cell: usize, reach: isize) -> impl Iterator<Item = Option<usize>> + '_ {
    let span = -reach..=reach;
    span.clone().flat_map(move |dy| span.clone().map(move |dx| grid.neighbor(cell, dx, dy)))
}

/// The labels, extended over the unseen cells that the piles' flanks run down over.
///
/// `piles` holds the bases of the objects that are piles: only they stand at an angle of repose.
pub(crate) fn with_occluded_flanks(
    scene: &Scene<'_>,
    labels: &[i32],
    piles: &BTreeMap<i32, Base>,
) -> Vec<i32> {
    let grid = scene.grid;
    let unseen = |cell: usize| {
        scene.heights_m[cell].is_nan() && !scene.off_scan[cell] && !scene.faces.bars[cell]
    };
    let open = open_cells(grid, unseen, |cell| labels[cell] != UNLABELLED);
    let above = |label: i32, cell: usize| {
        piles.get(&label).map_or(f64::NAN, |b| scene.heights_m[cell] - b.at(grid.center(cell)))
    };
    let labelled = labels.iter().copied().enumerate().filter(|(_, n)| piles.contains_key(n));
    let rims = rims_of(grid, labelled, Edge::Last, above, |cell| open[cell]);
    let slopes = slopes_of(grid, labels, &rims, above);
    let slope = |label: i32| slopes.get(&label).map_or(f64::INFINITY, |r: &Repose| r.slope);
    let flank = Flank::down(grid, &rims, slope, |cell| open[cell]);
    let owner =
        |(cell, &label): (usize, &i32)| if label == UNLABELLED { flank.owner[cell] } else { label };
    labels.iter().enumerate().map(owner).collect()
}

/// The angle of repose of every pile that has a rim.
fn slopes_of(
    grid: &Grid,
    labels: &[i32],
    rims: &[Rim],
    above: impl Fn(i32, usize) -> f64,
) -> BTreeMap<i32, Repose> {
    let mut cells: BTreeMap<i32, Vec<usize>> =
        rims.iter().map(|rim| (rim.owner, Vec::new())).collect();
    for (cell, label) in labels.iter().enumerate() {
        if let Some(cells) = cells.get_mut(label) {
            cells.push(cell);
        }
    }
    cells
        .into_iter()
        .map(|(label, cells)| (label, Repose::of(grid, &cells, |cell| above(label, cell))))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    const GRID: Grid = Grid { origin_m: [0.0; 2], cell_m: 0.5, columns: 20, rows: 20 };

    #[test]
    fn a_flank_is_the_highest_of_the_cones_below_its_rims() {
        let rim = |cell, owner, above_m| Rim { last: cell, from: cell, above_m, owner };
        let rims = [rim(45, 0, 2.0), rim(194, 3, 1.5)];
        let slope = |owner| if owner == 0 { 0.5 } else { 1.0 };
        let flank = Flank::down(&GRID, &rims, slope, |cell| cell != 46);
        for cell in (0..GRID.len()).filter(|&cell| cell != 46) {
            let from = |r: &Rim| r.above_m - slope(r.owner) * distance(&GRID, r.from, cell);
            let highest = rims.iter().map(from).fold(0.0, f64::max);
            assert!((flank.above_m[cell] - highest).abs() < 1e-9, "{:?}", GRID.center(cell));
        }
        assert_eq!(
            (flank.owner[46], flank.owner[195], flank.owner[399]),
            (UNLABELLED, 3, UNLABELLED)
        );
    }
}
