//! Clips objects at the walls they lean on, and at other steep things at their foot.
//!
//! The pile ends at their faces at full height and has no toe on that side. Where the line of the
//! face within a cell is unknown, it is taken to run anywhere through it (rectangular
//! distribution): half of the cell is the pile's.

use super::base::Base;
use super::part::Part;
use super::patch::{Patch, Zone};
use crate::connectivity::spread;

/// A pile leans on walls if they stand along more than this share of its edge; with less, they are
/// a rod or post in it. Chosen on the scenes of `divespot evaluate`.
const LEANS: f64 = 0.1;
/// The pile's share of a cell at a face that runs anywhere through it: rectangular from 0 to 1 (GUM
/// 4.3.7), 1/√12.
const HALF: Part = Part { share: 0.5, off_m: [0.0; 2], u_share: 0.289 };
/// The pile's share of a cell of a wall as high as the pile, whose face was not seen: the face runs
/// anywhere from the middle of the cell before, whose points may be of both, to the end of this
/// one. Rectangular over 1.5 cells, mean 0.75, of which 0.5 belong to the cell before; 1.5/√12.
const FLUSH: Part = Part { share: 0.25, off_m: [0.0; 2], u_share: 0.433 };

/// The pile's share of a cell of a wall of which only the top was seen: if the pile filled a
/// quarter of the cell, it would have a surface there. Rectangular from 0 to 0.25.
const TOP: Part = Part { share: 0.125, off_m: [0.0; 2], u_share: 0.072 };
/// The pile's share of its last cell before such a top: rectangular from 0.25 to 1.
const MIXED: Part = Part { share: 0.625, off_m: [0.0; 2], u_share: 0.217 };

/// The object with its part of each wall cell beside it, and no toe behind the walls.
pub(crate) fn up_to_walls(mut patch: Patch, base: &Base) -> Patch {
    let is_core = |n: usize| patch.zones[n] == Zone::Core;
    // Walls that the object encloses are gaps in it.
    let walls: Vec<usize> =
        (0..patch.walls.len()).filter(|&cell| patch.walls[cell] && !is_core(cell)).collect();
    if walls.is_empty() {
        patch.walls.fill(false);
        return patch;
    }
    let open = spread(&patch.grid, patch.cells(Zone::Core).collect(), |cell| {
        patch.zones[cell] == Zone::Toe && !patch.walls[cell]
    });
    let above: Vec<f64> = (0..patch.zones.len())
        .map(|cell| patch.heights_m[cell] - base.at(patch.grid.center(cell)))
        .collect();
    let beside: Vec<(usize, f64)> = walls
        .iter()
        .filter_map(|&cell| Some((cell, patch.mean_around(&above, cell, is_core)?)))
        .collect();
    for (zone, open) in patch.zones.iter_mut().zip(open) {
        if *zone == Zone::Toe && !open {
            *zone = Zone::Outside;
        }
    }
    patch.walls.fill(false);
    for (cell, height_m) in beside {
        patch.zones[cell] = Zone::Toe;
        patch.heights_m[cell] = base.at(patch.grid.center(cell)) + height_m;
        patch.walls[cell] = true;
        let part = match (patch.flush[cell], patch.tops[cell]) {
            (true, _) => FLUSH,
            (false, true) => TOP,
            (false, false) => HALF,
        };
        patch.count_part(cell, part);
    }
    before_tops(patch)
}

/// The object with a part of its last cells before walls of which only the top was seen.
fn before_tops(mut patch: Patch) -> Patch {
    let is_last = |&cell: &usize| {
        let at_top = || patch.around(cell, 1).any(|n| patch.walls[n] && patch.tops[n]);
        patch.mixed[cell] && patch.zones[cell] == Zone::Core && at_top()
    };
    for cell in (0..patch.zones.len()).filter(is_last).collect::<Vec<_>>() {
        patch.count_part(cell, MIXED);
    }
    patch
}

/// Whether walls stand along much of the core's edge.
pub(crate) fn leans(patch: &Patch) -> bool {
    let edge: Vec<usize> = patch.rim().collect();
    let walled = edge.iter().filter(|&&cell| is_beside(patch, cell)).count();
    walled as f64 > LEANS * edge.len() as f64
}

/// Whether a cell has a wall beside it.
pub(crate) fn is_beside(patch: &Patch, cell: usize) -> bool {
    patch.around(cell, 1).any(|n| patch.walls[n])
}
