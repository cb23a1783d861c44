//! Walls that a pile leans on, and other steep things at its foot.
//!
//! No bulk material lies steeper than 60°. What rises from the pile's edge more steeply than that
//! is not the pile's: the pile ends there, at full height, and has no toe on that side. By heights
//! alone the face runs anywhere through the cells in which it was seen, on average through their
//! middles: half of such a cell is the pile's.

use super::base::Base;
use super::patch::{Patch, Zone, spread};
use super::region::Part;
use super::shape::STEEPEST;

/// A pile with walls along this share of its edge leans on them; with less, a rod stands in it.
const LEANS: f64 = 0.1;
/// The pile's own height beside a cell is the highest of its cells so many columns and rows away.
const NEAR: usize = 2;
/// The face runs anywhere through a cell: a rectangular distribution (GUM 4.3.7).
const HALF: Part = Part { share: 0.5, off_m: [0.0; 2], u_share: 0.289 };

/// The object without the walls at its edge and the toe behind them.
pub(crate) fn without_walls(mut patch: Patch, base: &Base, margin_m: f64) -> Patch {
    let above: Vec<f64> = (0..patch.zones.len())
        .map(|cell| patch.heights_m[cell] - base.at(patch.grid.center(cell)))
        .collect();
    let walls: Vec<bool> =
        (0..above.len()).map(|cell| is_wall(&patch, &above, cell, margin_m)).collect();
    if !walls.contains(&true) {
        return patch;
    }
    // Toe cells to be reached from the core without crossing a wall.
    let open = spread(&patch.grid, patch.cells(Zone::Core).collect(), |cell| {
        patch.zones[cell] == Zone::Toe && !walls[cell]
    });
    let is_core = |n: usize| patch.zones[n] == Zone::Core;
    let beside: Vec<(usize, f64)> = (0..above.len())
        .filter(|&cell| walls[cell])
        .filter_map(|cell| Some((cell, patch.mean_around(&above, cell, is_core)?)))
        .collect();
    for (zone, open) in patch.zones.iter_mut().zip(open) {
        if *zone == Zone::Toe && !open {
            *zone = Zone::Outside;
        }
    }
    for (cell, height) in beside {
        patch.zones[cell] = Zone::Toe;
        patch.heights_m[cell] = base.at(patch.grid.center(cell)) + height;
        patch.count_part(cell, HALF);
    }
    patch.walls = walls;
    patch
}

/// The object with the walls that were found as a part of it given to its toe.
///
/// Where cells are large, a pile and the wall it leans on hang together. At the core's edge, what
/// rises too steeply from the rest of the core is the wall.
pub(crate) fn without_found_walls(mut patch: Patch, margin_m: f64) -> Patch {
    for _ in 0..NEAR {
        let walls: Vec<usize> = patch.rim().filter(|&c| overtops(&patch, c, margin_m)).collect();
        walls.into_iter().for_each(|cell| patch.zones[cell] = Zone::Toe);
    }
    patch
}

/// The middles of the cells of these walls.
pub(crate) fn found_walls(patch: &Patch, margin_m: f64) -> Vec<[f64; 2]> {
    let free = without_found_walls(patch.clone(), margin_m);
    let walls = patch.cells(Zone::Core).filter(|&cell| free.zones[cell] != Zone::Core);
    walls.map(|cell| patch.grid.center(cell)).collect()
}

/// Whether a cell lies higher than bulk material could above one of the core's cells near it.
fn overtops(patch: &Patch, cell: usize, margin_m: f64) -> bool {
    let mut core = patch.around(cell, NEAR).filter(|&n| patch.zones[n] == Zone::Core);
    core.any(|n| {
        let ([x, y], [u, v]) = (patch.grid.center(cell), patch.grid.center(n));
        let run = (u - x).hypot(v - y);
        patch.heights_m[cell] - patch.heights_m[n] > margin_m + STEEPEST * run
    })
}

/// Whether a cell in the toe, or of another object at the core's edge, rises too steeply from the
/// core to be bulk material.
fn is_wall(patch: &Patch, above: &[f64], cell: usize, margin_m: f64) -> bool {
    let is_core = |&n: &usize| patch.zones[n] == Zone::Core;
    let at_edge = || patch.around(cell, 1).any(|n| is_core(&n));
    let may_be = match patch.zones[cell] {
        Zone::Toe => true,
        Zone::Outside => at_edge(),
        Zone::Core | Zone::Ring | Zone::Beyond => false,
    };
    let core = || patch.around(cell, NEAR).filter(is_core).map(|n| above[n]);
    let rise = STEEPEST * patch.grid.cell_m;
    may_be && above[cell] > core().fold(margin_m, f64::max) + rise.max(margin_m)
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

#[cfg(test)]
mod tests {
    use super::super::tests::{CELL, exact, measured};

    /// A cone cut by a wall of one cell whose face lies `beyond` its axis, in the middle of a cell.
    fn cone_at_wall(beyond: f64) -> Vec<super::super::Object> {
        let cone = |x: f64, y: f64| (0.5 * (1.2 - (x - 4.0).hypot(y - 3.0))).max(0.0);
        let wall = move |x: f64| (x - 4.0 - beyond).abs() < CELL / 2.0;
        let behind = move |x: f64| x > 4.0 + beyond;
        let height = move |x: f64, y: f64| match (wall(x), behind(x)) {
            (true, _) => 1.0,
            (_, true) => f64::NAN,
            _ => cone(x, y),
        };
        measured(&exact(height), |x, y| !wall(x) && !behind(x) && cone(x, y) > 0.05)
    }

    #[test]
    fn a_pile_ends_at_the_face_of_the_wall_that_it_leans_on() {
        let objects = cone_at_wall(0.5 * CELL);
        let half = std::f64::consts::PI * 1.44 * 0.6 / 6.0;
        // The middle of the wall cell lies three quarters of a cell beyond the axis.
        let strip = 0.75 * CELL * 0.72;
        let volume = objects[0].volume.net_m3();
        assert!((volume / (half + strip) - 1.0).abs() < 0.02, "{volume} {half} {strip}");
        assert!(objects[0].leans_on_wall && !objects[0].touches_edge);
        assert_eq!(objects[0].reason, None);
    }

    #[test]
    fn a_wall_beyond_the_toe_is_not_leaned_on() {
        let whole = std::f64::consts::PI * 1.44 * 0.6 / 3.0;
        let objects = cone_at_wall(1.5);
        assert!((objects[0].volume.net_m3() / whole - 1.0).abs() < 0.01);
        assert!(!objects[0].leans_on_wall && !objects[0].touches_edge);
    }
}
