//! Objects in one piece.
//!
//! A cluster that HDBSCAN keeps whole takes along what lies as far off as its nearest neighbour
//! cluster does: single cells of noise, each of which would be given a toe of its own.

use super::territory::{FOUR, NOBODY};
use crate::heightmap::Grid;

/// Splits every object into pieces with no gap wider than `gap` cells, numbered by size.
///
/// Pieces of fewer than `fewest` cells are nobody's. Of two pieces of equal size the one with the
/// lower first cell comes first.
#[must_use]
pub fn pieces(grid: &Grid, labels: &[i32], gap: u32, fewest: usize) -> Vec<i32> {
    let mut left = labels.to_vec();
    let mut found: Vec<Vec<usize>> = (0..labels.len())
        .filter_map(|first| take_piece(grid, &mut left, first, gap))
        .filter(|piece| piece.len() >= fewest)
        .collect();
    found.sort_by_key(|piece| std::cmp::Reverse(piece.len()));
    let mut out = vec![NOBODY; labels.len()];
    for (label, piece) in (0..).zip(found) {
        piece.into_iter().for_each(|cell| out[cell] = label);
    }
    out
}

/// The labels with every object given the nobody's cells that lie downhill of its own, as far as
/// they are `clear` of the ground for it.
///
/// Points are far apart on a steep flank, so that clusters end where it begins. Uphill nothing is
/// taken: a wall that an object leans on is not its own.
pub(crate) fn flow_down(
    grid: &Grid,
    heights_m: &[f64],
    labels: &[i32],
    clear: impl Fn(i32, usize) -> bool,
) -> Vec<i32> {
    let mut labels = labels.to_vec();
    let mut front: Vec<usize> = (0..labels.len()).filter(|&cell| labels[cell] != NOBODY).collect();
    front.sort_by_key(|&cell| labels[cell]);
    while !front.is_empty() {
        let mut next = Vec::new();
        for cell in front {
            for n in FOUR.iter().filter_map(|&(dx, dy)| grid.neighbor(cell, dx, dy)) {
                let downhill = heights_m[n] <= heights_m[cell];
                if labels[n] == NOBODY && downhill && clear(labels[cell], n) {
                    labels[n] = labels[cell];
                    next.push(n);
                }
            }
        }
        front = next;
    }
    labels
}

/// The piece that `first` belongs to, taken out of `left`.
fn take_piece(grid: &Grid, left: &mut [i32], first: usize, gap: u32) -> Option<Vec<usize>> {
    let label = std::mem::replace(&mut left[first], NOBODY);
    if label == NOBODY {
        return None;
    }
    let reach = gap as isize + 1;
    let mut piece = vec![first];
    let mut next = 0;
    while next < piece.len() {
        for (dx, dy) in (-reach..=reach).flat_map(|y| (-reach..=reach).map(move |x| (x, y))) {
            let Some(n) = grid.neighbor(piece[next], dx, dy) else { continue };
            if left[n] == label {
                left[n] = NOBODY;
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
        assert_eq!(pieces(&grid, &labels, 1, 2), whole);
        assert_eq!(pieces(&grid, &labels, 1, 7), [-1; 20]);
        assert_eq!(pieces(&grid, &labels, 2, 6)[16], 0);
    }

    #[test]
    fn a_flank_is_taken_and_a_wall_is_not() {
        let grid = Grid { origin_m: [0.0; 2], cell_m: 1.0, columns: 7, rows: 1 };
        let heights = [0.0, 3.0, 7.0, 9.0, 9.5, f64::NAN, 1.0];
        let labels = [-1, -1, -1, 4, -1, -1, -1];
        let labels = flow_down(&grid, &heights, &labels, |_, cell| heights[cell] > 1.0);
        assert_eq!(labels, [-1, 4, 4, 4, -1, -1, -1]);
    }
}
