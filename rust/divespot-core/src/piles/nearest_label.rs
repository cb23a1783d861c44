//! The nearest-label map: which object each cell is nearest to, and how many steps away.

use crate::cancel::Polled;
use crate::connectivity::{EIGHT, FOUR, UNLABELLED};
use crate::heightmap::Grid;

/// The nearest object of every cell and the distance to it, in steps.
///
/// Steps alternate between four and eight neighbours, which makes distances octagonal: within 8 %
/// of the straight line.
pub(crate) struct NearestLabel {
    pub(crate) owner: Vec<i32>,
    pub(crate) steps: Vec<u32>,
    /// The last cell on the path that has a known height.
    pub(crate) last: Vec<u32>,
}

impl NearestLabel {
    /// Grows every labelled object by up to `reach` steps over `open` cells. A cell belongs to the
    /// object that reaches it first; the lower label wins a tie.
    pub(crate) fn grow(
        grid: &Grid,
        labels: &[i32],
        open: impl Fn(usize) -> bool,
        reach: u32,
    ) -> Self {
        Self::grow_along(grid, labels, |_, cell| open(cell), |_| true, reach)
    }

    /// The same, where whether a cell is `open` depends on the last cell of the path for which
    /// `tells` holds.
    pub(crate) fn grow_along(
        grid: &Grid,
        labels: &[i32],
        open: impl Fn(usize, usize) -> bool,
        tells: impl Fn(usize) -> bool,
        reach: u32,
    ) -> Self {
        let mut last: Vec<u32> = (0..labels.len() as u32).collect();
        let mut owner = labels.to_vec();
        let mut steps: Vec<u32> =
            labels.iter().map(|&l| if l < 0 { u32::MAX } else { 0 }).collect();
        let mut front: Vec<usize> = (0..labels.len()).filter(|&cell| labels[cell] >= 0).collect();
        front.sort_by_key(|&cell| labels[cell]);
        for step in 1..=reach {
            let around: &[(isize, isize)] = if step % 2 == 1 { &FOUR } else { &EIGHT };
            let mut next = Vec::new();
            for &cell in front.iter().polled() {
                let (way, from) = (grid.ways(cell), last[cell] as usize);
                // No step passes between two closed cells that touch at a corner.
                let passes = |(dx, dy): (isize, isize)| {
                    let side = |by| way(by).is_some_and(|n| open(from, n));
                    dx == 0 || dy == 0 || side((dx, 0)) || side((0, dy))
                };
                for &by in around {
                    let Some(n) = way(by) else { continue };
                    if owner[n] == UNLABELLED && open(from, n) && passes(by) {
                        if !tells(n) {
                            last[n] = last[cell];
                        }
                        owner[n] = owner[cell];
                        steps[n] = step;
                        next.push(n);
                    }
                }
            }
            front = if step % 2 == 1 { front.into_iter().chain(next).collect() } else { next };
        }
        Self { owner, steps, last }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn grid() -> Grid {
        Grid { origin_m: [0.0; 2], cell_m: 1.0, columns: 41, rows: 41 }
    }

    #[test]
    fn a_cell_grows_to_a_near_circle() {
        let mut labels = vec![UNLABELLED; grid().len()];
        labels[20 * 41 + 20] = 0;
        let nearest = NearestLabel::grow(&grid(), &labels, |_| true, 16);
        for (cell, &steps) in nearest.steps.iter().enumerate().filter(|(_, s)| **s <= 16) {
            let [x, y] = grid().center(cell);
            let distance = (x - 20.5).hypot(y - 20.5);
            assert!(
                (f64::from(steps) - distance).abs() <= 0.1 * distance + 1.0,
                "{steps} {distance}"
            );
        }
    }

    #[test]
    fn no_way_leads_between_closed_cells_that_touch_at_a_corner() {
        let mut labels = vec![UNLABELLED; grid().len()];
        labels[10 * 41 + 10] = 0;
        let open = |cell: usize| cell % 41 + cell / 41 != 30;
        let nearest = NearestLabel::grow(&grid(), &labels, open, 80);
        let beyond = (0..grid().len()).filter(|cell| cell % 41 + cell / 41 >= 30);
        assert!(beyond.into_iter().all(|cell| nearest.owner[cell] == UNLABELLED));
    }

    #[test]
    fn two_objects_meet_halfway() {
        let mut labels = vec![UNLABELLED; grid().len()];
        labels[20 * 41 + 10] = 1;
        labels[20 * 41 + 30] = 0;
        let nearest = NearestLabel::grow(&grid(), &labels, |_| true, 30);
        assert_eq!(nearest.owner[20 * 41 + 19], 1);
        assert_eq!(nearest.owner[20 * 41 + 20], 0);
        assert_eq!(nearest.owner[20 * 41 + 21], 0);
    }
}
