//! Disjoint sets.

/// Sets of `0..count`, each known by its root.
pub(super) struct Forest {
    parents: Vec<u32>,
    sizes: Vec<u32>,
}

impl Forest {
    pub(super) fn new(count: usize) -> Self {
        Self { parents: (0..count as u32).collect(), sizes: vec![1; count] }
    }

    /// The root of the set that holds `i`; halves the path on the way.
    #[inline]
    pub(super) fn find(&mut self, mut i: u32) -> u32 {
        loop {
            let parent = self.parents[i as usize];
            if parent == i {
                return i;
            }
            let next = self.parents[parent as usize];
            self.parents[i as usize] = next;
            i = next;
        }
    }

    /// The root of the set that holds `i`.
    #[inline]
    pub(super) fn root(&self, mut i: u32) -> u32 {
        while !self.is_root(i) {
            i = self.parents[i as usize];
        }
        i
    }

    #[inline]
    pub(super) fn is_root(&self, i: u32) -> bool {
        self.parents[i as usize] == i
    }

    /// Members of the set whose root is `root`.
    #[inline]
    pub(super) fn size(&self, root: u32) -> u32 {
        self.sizes[root as usize]
    }

    /// Joins the sets of `a` and `b`; false where they are one already.
    pub(super) fn join(&mut self, a: u32, b: u32) -> bool {
        let (a, b) = (self.find(a), self.find(b));
        if a == b {
            return false;
        }
        let (small, large) =
            if self.sizes[a as usize] < self.sizes[b as usize] { (a, b) } else { (b, a) };
        self.parents[small as usize] = large;
        self.sizes[large as usize] += self.sizes[small as usize];
        true
    }
}
