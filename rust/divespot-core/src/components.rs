//! Splits objects into connected components of cells.
//!
//! An HDBSCAN cluster can hold isolated cells of noise as far away as the next cluster. Each would
//! get a toe of its own.

use crate::cancel::Polled;
use crate::connectivity::UNLABELLED;
use crate::heightmap::Grid;

/// Splits every object into components with no gap wider than `gap` cells, numbered by size.
///
/// Components of fewer than `fewest` cells are unlabelled. Of two components of equal size the one
/// with the lower first cell comes first.
///
/// # Examples
///
/// ```
/// use divespot_core::heightmap::Grid;
/// use divespot_core::piles::label_components;
///
/// let grid = Grid { origin_m: [0.0, 0.0], cell_m: 1.0, columns: 6, rows: 1 };
/// let labels = label_components(&grid, &[0, 0, -1, -1, 0, -1], 1, 1);
/// assert_eq!(labels, [0, 0, -1, -1, 1, -1]);
/// ```
#[must_use]
pub fn label_components(grid: &Grid, labels: &[i32], gap: u32, fewest: usize) -> Vec<i32> {
    let mut left = labels.to_vec();
    let mut found: Vec<Vec<usize>> = (0..labels.len())
        .polled()
        .filter_map(|first| take_piece(grid, &mut left, first, gap))
        .filter(|piece| piece.len() >= fewest)
        .collect();
    found.sort_by_key(|piece| std::cmp::Reverse(piece.len()));
    let mut out = vec![UNLABELLED; labels.len()];
    for (label, piece) in (0..).zip(found) {
        piece.into_iter().for_each(|cell| out[cell] = label);
    }
    out
}

/// The component that holds `first`, removed from `left`.
fn take_piece(grid: &Grid, left: &mut [i32], first: usize, gap: u32) -> Option<Vec<usize>> {
    let label = std::mem::replace(&mut left[first], UNLABELLED);
    if label == UNLABELLED {
        return None;
    }
    let reach = gap as usize + 1;
    let mut piece = vec![first];
    let mut next = 0;
    while next < piece.len() {
        for n in grid.around(piece[next], reach).polled() {
            if left[n] == label {
                left[n] = UNLABELLED;
                piece.push(n);
            }
        }
        next += 1;
    }
    Some(piece)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn far_pieces_part_near_ones_stay_and_crumbs_go() {
        let grid = Grid { origin_m: [0.0; 2], cell_m: 1.0, columns: 10, rows: 2 };
        #[rustfmt::skip]
        let labels = [
            0, 0, -1, 0, -1, -1, -1, 1, 1, 1,
            0, 0, -1, -1, -1, -1, 0, 1, 1, 1,
        ];
        #[rustfmt::skip]
        let whole = [
            1, 1, -1, 1, -1, -1, -1, 0, 0, 0,
            1, 1, -1, -1, -1, -1, -1, 0, 0, 0,
        ];
        assert_eq!(label_components(&grid, &labels, 1, 2), whole);
        assert_eq!(label_components(&grid, &labels, 1, 7), [-1; 20]);
        assert_eq!(label_components(&grid, &labels, 2, 6)[16], 0);
    }
}
