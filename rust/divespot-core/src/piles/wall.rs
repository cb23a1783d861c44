//! Walls that a pile leans on, and other steep things at its foot.
//!
//! The pile ends at their faces, at full height, and has no toe on that side. Where it is not known
//! where in a cell the face runs, it runs anywhere, on average through the middle: half of such a
//! cell is the pile's.

use super::base::Base;
use super::part::Part;
use super::patch::{Patch, Zone};
use crate::connectivity::spread;

/// A pile with walls along this share of its edge leans on them; with less, a rod stands in it.
const LEANS: f64 = 0.1;
/// The face runs anywhere through a cell: a rectangular distribution (GUM 4.3.7).
const HALF: Part = Part { share: 0.5, off_m: [0.0; 2], u_share: 0.289 };
/// Where a pile is as high as a wall, the face was not seen: it runs anywhere from the middle of the
/// cell before, whose points may be of both, to the end of this one: a cell and a half, of which a
/// quarter of a cell is this one's on average.
const FLUSH: Part = Part { share: 0.25, off_m: [0.0; 2], u_share: 0.433 };

/// Where of a wall the top alone was seen, nearly all of its cell is the wall's: with points on a
/// quarter of it, the pile would have a surface there (rectangular, as below).
const TOP: Part = Part { share: 0.125, off_m: [0.0; 2], u_share: 0.072 };
/// The wall's top begins somewhere in the last cell of the pile, beyond that quarter.
const MIXED: Part = Part { share: 0.625, off_m: [0.0; 2], u_share: 0.217 };

/// The object with half of each cell in which a wall rises beside it, and no toe behind the walls.
pub(crate) fn up_to_walls(mut patch: Patch, base: &Base) -> Patch {
    let is_core = |n: usize| patch.zones[n] == Zone::Core;
    // What the object encloses is a gap in it.
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

/// The object with a part of its last cells before walls of which the top alone was seen.
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
