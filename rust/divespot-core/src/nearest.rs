//! Nearest neighbours among points (a kd-tree).
//!
//! The tree is split at medians of a small sample of the points, and is as coarse as its user asks:
//! sorting points into many leaves would take longer than a few thousand searches.

use std::cmp::Ordering;

use crate::Point;
use crate::cancel::{Polled, poll};
use crate::parallel::fill_chunks;
use crate::sample::mix;

/// Points sampled for each leaf when a split's median is found. Decides no answer.
const DRAWN: usize = 8;
/// Points for a thread at a time. Decides no answer.
const CHUNK: usize = 1 << 13;
/// Points that go down the tree together, so that their memory accesses overlap. Decides no answer.
const ABREAST: usize = 16;

/// A kd-tree of points. The neighbours found do not depend on its splits.
pub(crate) struct KdTree<'a> {
    points: &'a [Point],
    /// Axis and position of each split; the children of `i` are `2 i + 1` and `2 i + 2`. There is
    /// one less than leaves, whose number is a power of two.
    splits: Vec<(usize, f64)>,
    /// Indices of the points, leaf by leaf.
    rows: Vec<u32>,
    /// The end of each leaf in `rows`.
    ends: Vec<u32>,
}

impl<'a> KdTree<'a> {
    /// A tree with about `leaf` points in a leaf.
    pub(crate) fn new(points: &'a [Point], leaf: usize, threads: usize) -> Self {
        let leaves = (points.len() / leaf).max(1).next_power_of_two();
        let splits = splits_of(points, leaves, points.len() * DRAWN / leaf);
        let mut homes = vec![0_u32; points.len()];
        fill_chunks(&mut homes, CHUNK, threads, |first, piece| {
            for (homes, points) in piece.chunks_mut(ABREAST).zip(points[first..].chunks(ABREAST)) {
                find_homes(&splits, homes, points);
            }
        });
        let (rows, ends) = dealt(&homes, leaves);
        Self { points, splits, rows, ends }
    }

    /// The `count` positions nearest to `at` with their squared distances in m², nearest first;
    /// ties go to the lowest coordinates.
    pub(crate) fn nearest(&self, at: &Point, count: usize) -> Vec<(f64, Point)> {
        let found = self.found(at, count).into_iter();
        found.map(|(distance, row)| (distance, self.points[row as usize])).collect()
    }

    /// The rows of the `count` nearest positions, in the same order; equal positions by row.
    pub(crate) fn nearest_rows(&self, at: &Point, count: usize) -> Vec<u32> {
        self.found(at, count).into_iter().map(|(_, row)| row).collect()
    }

    /// The numbers of some places, those in a leaf one after the other: what is looked at around them
    /// is still at hand.
    pub(crate) fn leaf_by_leaf(&self, places: &[Point]) -> Vec<u32> {
        let mut homes = vec![0; places.len()];
        for (homes, places) in homes.chunks_mut(ABREAST).zip(places.chunks(ABREAST)) {
            find_homes(&self.splits, homes, places);
        }
        let mut numbers: Vec<u32> = (0..places.len() as u32).collect();
        numbers.sort_unstable_by_key(|&i| (homes[i as usize], i));
        numbers
    }

    fn found(&self, at: &Point, count: usize) -> Vec<Found> {
        let mut search = Search { tree: self, at, count, found: Vec::with_capacity(count + 1) };
        search.below(0, [0.0; 3]);
        search.found
    }

    fn leaf(&self, leaf: usize) -> &[u32] {
        let start = if leaf == 0 { 0 } else { self.ends[leaf - 1] };
        &self.rows[start as usize..self.ends[leaf] as usize]
    }
}

/// Squared distance and row.
type Found = (f64, u32);

struct Search<'a> {
    tree: &'a KdTree<'a>,
    at: &'a Point,
    count: usize,
    found: Vec<Found>,
}

impl Search<'_> {
    /// Searches below a node whose box is `away` along each axis.
    fn below(&mut self, node: usize, away: Point) {
        let Some(&(axis, split)) = self.tree.splits.get(node) else {
            self.tree.leaf(node - self.tree.splits.len()).iter().for_each(|&row| self.offer(row));
            return;
        };
        let past = self.at[axis] - split;
        let far_is_left = usize::from(past >= 0.0);
        self.below(2 * node + 1 + far_is_left, away);
        let mut across = away;
        across[axis] = past;
        // Rounded as the distances are, so never above the distance of a point there.
        if !self.full() || square(across) <= self.worst() {
            self.below(2 * node + 2 - far_is_left, across);
        }
    }

    fn full(&self) -> bool {
        self.found.len() == self.count
    }

    fn worst(&self) -> f64 {
        self.found.last().map_or(f64::INFINITY, |last| last.0)
    }

    #[inline]
    fn offer(&mut self, row: u32) {
        let p = &self.tree.points[row as usize];
        let distance = square(std::array::from_fn(|k| p[k] - self.at[k]));
        let new = (distance, row);
        let is_before = |other: &Found| match distance.partial_cmp(&other.0) {
            Some(Ordering::Equal) => (p, row) < (&self.tree.points[other.1 as usize], other.1),
            order => order == Some(Ordering::Less),
        };
        if self.full() {
            if !self.found.last().is_some_and(is_before) {
                return;
            }
            self.found.pop();
        }
        let place = self.found.iter().rposition(|other| !is_before(other)).map_or(0, |k| k + 1);
        self.found.insert(place, new);
    }
}

#[inline]
fn square([x, y, z]: Point) -> f64 {
    x * x + y * y + z * z
}

/// Splits that divide `points` into a number of leaves, a power of two, of about equal size.
fn splits_of(points: &[Point], leaves: usize, drawn: usize) -> Vec<(usize, f64)> {
    let draw = |i: u64| points[(mix(i) % points.len() as u64) as usize];
    let mut sample: Vec<Point> = (0..drawn as u64).map(draw).collect();
    let mut splits = Vec::with_capacity(leaves - 1);
    let mut level: Vec<&mut [Point]> = vec![&mut sample];
    while level.len() < leaves {
        level = level.into_iter().flat_map(|part| halves(part, &mut splits)).collect();
    }
    splits
}

/// The two halves of some points, divided along the axis of their largest extent.
fn halves<'a>(part: &'a mut [Point], splits: &mut Vec<(usize, f64)>) -> [&'a mut [Point]; 2] {
    poll();
    let axis = widest(part);
    let middle = part.len() / 2;
    if middle > 0 {
        part.select_nth_unstable_by(middle, |a, b| a[axis].total_cmp(&b[axis]));
    }
    splits.push((axis, part.get(middle).map_or(0.0, |p| p[axis])));
    part.split_at_mut(middle).into()
}

fn widest(part: &[Point]) -> usize {
    let extent = crate::Bounds::of(part.iter().copied()).map_or([0.0; 3], |b| b.extent());
    (0..3).fold(0, |widest, k| if extent[k] > extent[widest] { k } else { widest })
}

/// The leaves of a few points.
#[inline]
fn find_homes(splits: &[(usize, f64)], homes: &mut [u32], points: &[Point]) {
    let mut nodes = [0_usize; ABREAST];
    for _ in 0..(splits.len() + 1).ilog2() {
        for (node, p) in nodes.iter_mut().zip(points) {
            let (axis, split) = splits[*node];
            *node = 2 * *node + 1 + usize::from(p[axis] >= split);
        }
    }
    homes.iter_mut().zip(nodes).for_each(|(home, node)| *home = (node - splits.len()) as u32);
}

/// The rows sorted by leaf, and the end of each leaf.
fn dealt(homes: &[u32], leaves: usize) -> (Vec<u32>, Vec<u32>) {
    let mut ends = vec![0_u32; leaves];
    homes.iter().polled().for_each(|&home| ends[home as usize] += 1);
    let mut start = 0;
    for end in &mut ends {
        start += std::mem::replace(end, start);
    }
    let mut rows = vec![0; homes.len()];
    for (row, &home) in (0..).zip(homes).polled() {
        let next = &mut ends[home as usize];
        rows[*next as usize] = row;
        *next += 1;
    }
    (rows, ends)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn slow(points: &[Point], at: &Point, count: usize) -> Vec<(f64, Point)> {
        let away = |p: &Point| square(std::array::from_fn(|k| p[k] - at[k]));
        let mut all: Vec<(f64, Point)> = points.iter().map(|p| (away(p), *p)).collect();
        all.sort_by(|a, b| a.partial_cmp(b).unwrap());
        all.truncate(count);
        all
    }

    /// Coordinates on `levels` levels for each axis, so that many are equal.
    fn cloud(count: u64, levels: [u64; 3]) -> Vec<Point> {
        let coordinate = |i: u64, k: usize| (mix(3 * i + k as u64) % levels[k]) as f64 / 1000.0;
        (0..count).map(|i| std::array::from_fn(|k| coordinate(i, k))).collect()
    }

    #[test]
    fn leaf_by_leaf_comes_every_place_once() {
        let points = cloud(700, [1000; 3]);
        let tree = KdTree::new(&points, 16, 1);
        let numbers = tree.leaf_by_leaf(&points);
        let leaf = |number| (0..tree.ends.len()).find(|&leaf| tree.leaf(leaf).contains(number));
        assert!(numbers.iter().map(leaf).is_sorted());
        let mut sorted = numbers;
        sorted.sort_unstable();
        assert!(sorted.into_iter().eq(0..700));
    }

    #[test]
    fn the_tree_finds_what_a_search_of_all_finds() {
        let shapes =
            [[1 << 40; 3], [30, 30, 3], [1000, 1, 1], [1, 1000, 1], [1, 1, 5000], [2, 2, 2000]];
        for shape in shapes {
            for (count, leaf) in
                [1, 5, 31, 511, 512, 3000, 9000].into_iter().zip([16, 128].into_iter().cycle())
            {
                let points = cloud(count, shape);
                let tree = KdTree::new(&points, leaf, 2);
                for at in points.iter().step_by(count as usize / 40 + 1).chain(&[[0.1; 3]]) {
                    assert_eq!(tree.nearest(at, 17), slow(&points, at, 17), "{shape:?} {count}");
                }
            }
        }
    }
}
