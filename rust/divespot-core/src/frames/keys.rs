//! Cells of space as integer keys, and maps by them.

use std::collections::HashMap;
use std::hash::BuildHasherDefault;

use crate::hashing::Mixed;

/// A map from cells.
pub(crate) type Cells<T> = HashMap<u64, T, BuildHasherDefault<Mixed>>;

/// Cells along an axis on either side of the origin.
pub(crate) const SPAN: i64 = 1 << 20;
/// Bits of a coordinate in a key.
const BITS: u32 = 21;

/// The key of a cell, sorted by x, y, z; `None` if it is too far away.
#[inline]
pub(crate) fn number(cell: [i64; 3]) -> Option<u64> {
    let [x, y, z] = cell.map(|v| v + SPAN);
    let is_near = (x | y | z) as u64 >> BITS == 0;
    is_near.then_some((x << (2 * BITS) | y << BITS | z) as u64)
}

/// The cell of a key.
#[inline]
pub(crate) fn cell(number: u64) -> [i64; 3] {
    [2 * BITS, BITS, 0].map(|by| (number >> by & ((1 << BITS) - 1)) as i64 - SPAN)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_number_gives_back_its_cell_and_what_is_too_far_has_none() {
        for at in [[0, 0, 0], [-1, 5, SPAN - 1], [-SPAN, 1, -7]] {
            assert_eq!(number(at).map(cell), Some(at));
        }
        assert_eq!(number([SPAN, 0, 0]), None);
        assert_eq!(number([0, -SPAN - 1, 0]), None);
        assert!(number([1, 0, 0]) > number([0, 9, 9]));
    }
}
