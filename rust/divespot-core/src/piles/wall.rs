//! Clips objects at the walls they lean on, and at other steep things at their foot.
//!
//! The pile ends at their faces at full height and has no toe on that side. Where the line of the
//! face within a cell is unknown, it is taken to run anywhere through it (rectangular
//! distribution): half of the cell is the pile's.

use super::base::Base;
use super::coverage::Coverage;
use super::window::{Window, Zone};
use crate::connectivity::spread;

/// A pile leans on walls if they stand along more than this share of its edge; with less, they are
/// a rod or post in it. Chosen on the scenes of `divespot evaluate`.
const LEANS: f64 = 0.1;
/// The pile's share of a cell at a face that runs anywhere through it: rectangular from 0 to 1 (GUM
/// 4.3.7), 1/√12.
const HALF: Coverage = Coverage { share: 0.5, off_m: [0.0; 2], u_share: 0.289 };
/// The pile's share of a cell of a wall as high as the pile, whose face was not seen: the face runs
/// anywhere from the middle of the cell before, whose points may be of both, to the end of this
/// one. Rectangular over 1.5 cells, mean 0.75, of which 0.5 belong to the cell before; 1.5/√12.
const FLUSH: Coverage = Coverage { share: 0.25, off_m: [0.0; 2], u_share: 0.433 };

/// The pile's share of a cell of a wall of which only the top was seen: if the pile filled a
/// quarter of the cell, it would have a surface there. Rectangular from 0 to 0.25.
const TOP: Coverage = Coverage { share: 0.125, off_m: [0.0; 2], u_share: 0.072 };
/// The pile's share of its last cell before such a top: rectangular from 0.25 to 1.
const MIXED: Coverage = Coverage { share: 0.625, off_m: [0.0; 2], u_share: 0.217 };

/// The object with its part of each wall cell beside it, and no toe behind the walls.
pub(crate) fn up_to_walls(mut window: Window, base: &Base) -> Window {
    let is_core = |n: usize| window.zones[n] == Zone::Core;
    // Walls that the object encloses are gaps in it.
    let walls: Vec<usize> =
        (0..window.walls.len()).filter(|&cell| window.walls[cell] && !is_core(cell)).collect();
    if walls.is_empty() {
        window.walls.fill(false);
        return window;
    }
    let open = spread(&window.grid, window.cells(Zone::Core).collect(), |cell| {
        window.zones[cell] == Zone::Toe && !window.walls[cell]
    });
    let mut above = vec![f64::NAN; window.zones.len()];
    for cell in walls.iter().flat_map(|&wall| window.around(wall, 1)) {
        if above[cell].is_nan() {
            above[cell] = window.heights_m[cell] - base.at(window.grid.center(cell));
        }
    }
    let beside: Vec<(usize, f64)> = walls
        .iter()
        .filter_map(|&cell| Some((cell, window.mean_around(&above, cell, is_core)?)))
        .collect();
    for (zone, open) in window.zones.iter_mut().zip(open) {
        if *zone == Zone::Toe && !open {
            *zone = Zone::Outside;
        }
    }
    window.walls.fill(false);
    for (cell, height_m) in beside {
        window.zones[cell] = Zone::Toe;
        window.heights_m[cell] = base.at(window.grid.center(cell)) + height_m;
        window.walls[cell] = true;
        let part = match (window.flush[cell], window.tops[cell]) {
            (true, _) => FLUSH,
            (false, true) => TOP,
            (false, false) => HALF,
        };
        window.count_part(cell, part);
    }
    before_tops(window)
}

/// The object with a part of its last cells before walls of which only the top was seen.
fn before_tops(mut window: Window) -> Window {
    let is_last = |&cell: &usize| {
        let at_top = || window.around(cell, 1).any(|n| window.walls[n] && window.tops[n]);
        window.mixed[cell] && window.zones[cell] == Zone::Core && at_top()
    };
    for cell in (0..window.zones.len()).filter(is_last).collect::<Vec<_>>() {
        window.count_part(cell, MIXED);
    }
    window
}

/// Whether walls stand along much of the core's edge.
pub(crate) fn leans(window: &Window) -> bool {
    let edge: Vec<usize> = window.rim().collect();
    let walled = edge.iter().filter(|&&cell| is_beside(window, cell)).count();
    walled as f64 > LEANS * edge.len() as f64
}

/// Whether a cell has a wall beside it.
pub(crate) fn is_beside(window: &Window, cell: usize) -> bool {
    window.around(cell, 1).any(|n| window.walls[n])
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::super::tests::{CELL, exact, window_of};
    use super::*;

    /// A block of 2 m beside whose right edge lies a wall, of a kind.
    fn walled(kind: impl Fn(&mut Window, usize)) -> (Window, usize) {
        let is_block = |x: f64, y: f64| (x - 4.0).abs().max((y - 3.0).abs()) < 1.0;
        let mut window = window_of(&exact(|x, y| if is_block(x, y) { 1.0 } else { 0.0 }), is_block);
        for cell in 0..window.zones.len() {
            let [x, y] = window.grid.center(cell);
            if (5.0..5.0 + CELL).contains(&x) && (y - 3.0).abs() < 1.0 {
                window.walls[cell] = true;
                kind(&mut window, cell);
            }
        }
        let beside = window.grid.cell(&[5.0 + 0.5 * CELL, 3.0 + 0.5 * CELL]);
        (up_to_walls(window, &Base::ground(0.0, 0.0, 0.0)), beside)
    }

    /// Whether a part is what lies before a face that runs anywhere from one place in a cell to another.
    fn runs(part: Coverage, from: f64, to: f64) -> bool {
        let (share, u_share) = (0.5 * (from + to), (to - from) / 12.0_f64.sqrt());
        (part.share - share).abs() < 1e-3 && (part.u_share - u_share).abs() < 1e-3
    }

    #[test]
    fn a_face_runs_anywhere_through_its_cell_or_as_far_as_was_not_seen() {
        let (window, beside) = walled(|_, _| {});
        assert!(runs(window.counted(beside), 0.0, 1.0), "{:?}", window.counted(beside));
        // From the middle of the cell before.
        let (window, beside) = walled(|window, cell| Arc::make_mut(&mut window.flush)[cell] = true);
        assert!(runs(window.counted(beside), -0.5, 1.0), "{:?}", window.counted(beside));
        let (window, beside) = walled(|window, cell| {
            Arc::make_mut(&mut window.tops)[cell] = true;
            Arc::make_mut(&mut window.mixed)[cell - 1] = true;
        });
        assert!(runs(window.counted(beside), 0.0, 0.25), "{:?}", window.counted(beside));
        assert!(runs(window.counted(beside - 1), 0.25, 1.0), "{:?}", window.counted(beside - 1));
    }

    #[test]
    fn a_pile_leans_on_walls_along_a_tenth_of_its_edge() {
        let leaning = |cells: usize| {
            let mut window =
                window_of(&exact(|_, _| 0.0), |x, y| (x - 4.0).abs().max((y - 3.0).abs()) < 1.0);
            // 124 cells have an edge; a wall lies beside two more than it has itself.
            let first = window.grid.cell(&[5.0 + 0.5 * CELL, 3.0]);
            (0..cells).for_each(|k| window.walls[first + k * window.grid.columns] = true);
            leans(&window)
        };
        assert!(leaning(15) && !leaning(6));
    }
}
