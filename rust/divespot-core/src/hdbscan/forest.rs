//! Disjoint sets (union-find).

/// Disjoint sets of `0..count`, each named by its root.
pub(super) struct Forest {
    trees: Vec<Member>,
}

#[derive(Clone, Copy)]
struct Member {
    parent: u32,
    /// Number of members; valid only in roots.
    size: u32,
}

impl Forest {
    pub(super) fn new(count: usize) -> Self {
        Self { trees: (0..count as u32).map(|parent| Member { parent, size: 1 }).collect() }
    }

    /// The root of the set that holds `i`; halves the path on the way.
    #[inline]
    pub(super) fn find(&mut self, mut i: u32) -> u32 {
        loop {
            let parent = self.trees[i as usize].parent;
            if parent == i {
                return i;
            }
            let next = self.trees[parent as usize].parent;
            self.trees[i as usize].parent = next;
            i = next;
        }
    }

    /// The root of the set that holds `i`.
    #[inline]
    pub(super) fn root(&self, mut i: u32) -> u32 {
        while !self.is_root(i) {
            i = self.trees[i as usize].parent;
        }
        i
    }

    #[inline]
    pub(super) fn is_root(&self, i: u32) -> bool {
        self.trees[i as usize].parent == i
    }

    /// Number of members of the set with this root.
    #[inline]
    pub(super) fn size(&self, root: u32) -> u32 {
        self.trees[root as usize].size
    }

    /// Joins two sets, given by their roots; returns the new root.
    #[inline]
    pub(super) fn join(&mut self, a: u32, b: u32) -> u32 {
        let (small, large) = if self.size(a) < self.size(b) { (a, b) } else { (b, a) };
        if small != large {
            self.trees[large as usize].size += self.size(small);
            self.trees[small as usize].parent = large;
        }
        large
    }
}
