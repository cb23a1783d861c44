//! A kd-tree with leaves of 16 points, so that distances to a whole leaf are vectorised.

use std::sync::Mutex;

use crate::Point;
use crate::cancel::{Polled, poll};
use crate::parallel::{into_inner, lock, share};

/// Points in a leaf; only the last leaf may hold fewer.
pub(super) const LEAF: usize = 16;

/// The points of a leaf, one array for each axis; unused places are infinitely far away.
pub(super) struct Block {
    axes: [[f32; LEAF]; 3],
}

impl Block {
    fn new(items: &[Item]) -> Self {
        let mut axes = [[f32::INFINITY; LEAF]; 3];
        for (lane, item) in items.iter().enumerate() {
            (0..3).for_each(|k| axes[k][lane] = item.at[k]);
        }
        Self { axes }
    }

    /// The point in a place of the leaf.
    #[inline]
    pub(super) fn point(&self, lane: usize) -> [f32; 3] {
        std::array::from_fn(|k| self.axes[k][lane])
    }

    /// Squared distances from `p` to every place.
    #[inline]
    pub(super) fn distances(&self, p: [f32; 3]) -> [f32; LEAF] {
        let [x, y, z] = &self.axes;
        let mut out = [0.0; LEAF];
        for (out, ((x, y), z)) in out.iter_mut().zip(x.iter().zip(y).zip(z)) {
            let (dx, dy, dz) = (x - p[0], y - p[1], z - p[2]);
            *out = dx * dx + dy * dy + dz * dz;
        }
        out
    }
}

/// A box of the tree. Nodes are in pre-order: the left child follows its parent.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Node {
    lo: [f32; 3],
    hi: [f32; 3],
    /// The right child, or 0 in a leaf.
    right: u32,
    /// The first leaf below.
    leaf: u32,
}

impl Node {
    /// Both children; `None` in a leaf.
    #[inline]
    pub(super) fn children(&self, own: usize) -> Option<(usize, usize)> {
        (self.right != 0).then_some((own + 1, self.right as usize))
    }

    /// The first leaf below.
    #[inline]
    pub(super) fn first_leaf(&self) -> usize {
        self.leaf as usize
    }

    /// Squared distance between two boxes, rounded as in [`Block::distances`], so never above the
    /// distance of two points inside.
    #[inline]
    fn gap(&self, other: &Self) -> f32 {
        let gap =
            |k: usize| larger(larger(self.lo[k] - other.hi[k], other.lo[k] - self.hi[k]), 0.0);
        let (dx, dy, dz) = (gap(0), gap(1), gap(2));
        dx * dx + dy * dy + dz * dz
    }

    /// Squared distances from the points of a leaf to the box.
    #[inline]
    pub(super) fn gaps(&self, block: &Block) -> [f32; LEAF] {
        let mut out = [0.0; LEAF];
        let [x, y, z] = &block.axes;
        for (out, ((x, y), z)) in out.iter_mut().zip(x.iter().zip(y).zip(z)) {
            let gap = |v: f32, k: usize| larger(larger(self.lo[k] - v, v - self.hi[k]), 0.0);
            let (dx, dy, dz) = (gap(*x, 0), gap(*y, 1), gap(*z, 2));
            *out = dx * dx + dy * dy + dz * dz;
        }
        out
    }
}

/// `f32::max` for numbers that are not NaN: one instruction.
#[inline]
pub(super) fn larger(a: f32, b: f32) -> f32 {
    if a > b { a } else { b }
}

/// `f32::min` for numbers that are not NaN: one instruction.
#[inline]
pub(super) fn smaller(a: f32, b: f32) -> f32 {
    if a < b { a } else { b }
}

#[derive(Clone, Copy)]
struct Item {
    at: [f32; 3],
    row: u32,
}

/// The points in tree order: place `p` is lane `p % 16` of leaf `p / 16`.
pub(super) struct BlockTree {
    pub(super) nodes: Vec<Node>,
    pub(super) blocks: Vec<Block>,
    /// The input's row of each place.
    pub(super) rows: Vec<u32>,
    /// The node of each leaf.
    pub(super) leaf_nodes: Vec<u32>,
}

impl BlockTree {
    /// Builds the tree of `points`, each first mapped into `f32`.
    pub(super) fn new(points: &[Point], map: impl Fn(&Point) -> [f32; 3], threads: usize) -> Self {
        let mut items: Vec<Item> =
            (0u32..).zip(points).polled().map(|(row, p)| Item { at: map(p), row }).collect();
        let leaves = items.len().div_ceil(LEAF);
        let mut nodes = vec![Node::default(); (2 * leaves).saturating_sub(1)];
        if leaves > 0 {
            let whole = Half { items: &mut items, nodes: &mut nodes, node: 0, leaf: 0 };
            split_all(whole, threads);
        }
        let blocks = items.chunks(LEAF).polled().map(Block::new).collect();
        let rows = items.iter().map(|item| item.row).collect();
        let is_leaf = |&(_, node): &(u32, &Node)| node.right == 0;
        let leaf_nodes = (0u32..).zip(&nodes).filter(is_leaf).map(|(i, _)| i).collect();
        Self { nodes, blocks, rows, leaf_nodes }
    }

    /// The input's row of each place; frees the rest.
    pub(super) fn into_rows(self) -> Vec<u32> {
        self.rows
    }

    /// Squared distance between two places, rounded as in [`Block::distances`].
    #[inline]
    pub(super) fn distance(&self, a: usize, b: usize) -> f32 {
        let point = |place: usize| self.blocks[place / LEAF].point(place % LEAF);
        let (a, b) = (point(a), point(b));
        let (dx, dy, dz) = (a[0] - b[0], a[1] - b[1], a[2] - b[2]);
        dx * dx + dy * dy + dz * dz
    }

    /// Leads `visitor` through the tree, the nearer child first.
    #[inline]
    pub(super) fn walk(&self, from: &Node, visitor: &mut impl Visitor) {
        let mut waiting = [(0.0f32, 0usize); 64];
        let mut count = 0;
        let mut next = (visitor.enters(0, 0.0)).then_some(0);
        while let Some(own) = next {
            let node = &self.nodes[own];
            next = None;
            if let Some((left, right)) = node.children(own) {
                let (a, b) = (from.gap(&self.nodes[left]), from.gap(&self.nodes[right]));
                let (near, far) =
                    if b < a { ((b, right), (a, left)) } else { ((a, left), (b, right)) };
                if visitor.enters(far.1, far.0) {
                    waiting[count] = far;
                    count += 1;
                }
                next = visitor.enters(near.1, near.0).then_some(near.1);
            } else {
                visitor.leaf(node, node.leaf as usize);
            }
            while next.is_none() && count > 0 {
                count -= 1;
                let (gap, other) = waiting[count];
                next = visitor.enters(other, gap).then_some(other);
            }
        }
    }
}

/// The actions on a walk through the tree.
pub(super) trait Visitor {
    /// Whether to enter a node at this squared distance.
    fn enters(&mut self, node: usize, gap: f32) -> bool;
    /// Visits the points of a leaf.
    fn leaf(&mut self, node: &Node, leaf: usize);
}

/// A subtree to be built.
struct Half<'a> {
    items: &'a mut [Item],
    nodes: &'a mut [Node],
    node: u32,
    leaf: u32,
}

impl<'a> Half<'a> {
    /// Writes the subtree's first node; splits the rest along its longest axis.
    fn split(self) -> Option<[Half<'a>; 2]> {
        let (lo, hi) = bounds(self.items);
        let (first, below) = self.nodes.split_first_mut()?;
        *first = Node { lo, hi, right: 0, leaf: self.leaf };
        let left_leaves = self.items.len().div_ceil(LEAF) / 2;
        if left_leaves == 0 {
            return None;
        }
        let axis = longest(self.items);
        let middle = left_leaves * LEAF;
        self.items.select_nth_unstable_by(middle, |a, b| a.at[axis].total_cmp(&b.at[axis]));
        let left_nodes = 2 * left_leaves - 1;
        let (left_leaves, right_node) = (left_leaves as u32, self.node + 1 + left_nodes as u32);
        first.right = right_node;
        let (left, right) = self.items.split_at_mut(middle);
        let (left_below, right_below) = below.split_at_mut(left_nodes);
        Some([
            Half { items: left, nodes: left_below, node: self.node + 1, leaf: self.leaf },
            Half {
                items: right,
                nodes: right_below,
                node: right_node,
                leaf: self.leaf + left_leaves,
            },
        ])
    }
}

fn split_all(whole: Half<'_>, threads: usize) {
    let mut parts = vec![whole];
    while !parts.is_empty() && parts.len() < 4 * threads {
        let halves = Mutex::new(Vec::with_capacity(2 * parts.len()));
        share(parts.into_iter(), threads, |part| {
            if let Some(pair) = part.split() {
                lock(&halves).extend(pair);
            }
        });
        parts = into_inner(halves);
    }
    share(parts.into_iter(), threads, |part| {
        let mut stack = vec![part];
        while let Some(part) = stack.pop() {
            poll();
            stack.extend(part.split().into_iter().flatten());
        }
    });
}

/// The axis along which a sample of the items extends most, without the outermost item at either
/// end, so that a single outlier beside a wall does not split the wall into sheets.
fn longest(items: &[Item]) -> usize {
    let (mut least, mut low) = ([f32::INFINITY; 3], [f32::INFINITY; 3]);
    let (mut most, mut high) = ([f32::NEG_INFINITY; 3], [f32::NEG_INFINITY; 3]);
    for item in items.iter().step_by(items.len().div_ceil(SAMPLE)) {
        for k in 0..3 {
            low[k] = smaller(low[k], larger(least[k], item.at[k]));
            least[k] = smaller(least[k], item.at[k]);
            high[k] = larger(high[k], smaller(most[k], item.at[k]));
            most[k] = larger(most[k], item.at[k]);
        }
    }
    (1..3).fold(0, |a, k| if high[k] - low[k] > high[a] - low[a] { k } else { a })
}

/// Items in the sample for the choice of an axis. Decides no answer.
const SAMPLE: usize = 16;

fn bounds(items: &[Item]) -> ([f32; 3], [f32; 3]) {
    let empty = ([f32::INFINITY; 3], [f32::NEG_INFINITY; 3]);
    items.iter().fold(empty, |(lo, hi), item| {
        let at = item.at;
        (
            std::array::from_fn(|k| smaller(lo[k], at[k])),
            std::array::from_fn(|k| larger(hi[k], at[k])),
        )
    })
}
