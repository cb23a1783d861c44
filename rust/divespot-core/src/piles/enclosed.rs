//! Removes walls inside a given outline, and what they cover, from the volume.

use super::base::Base;
use super::coverage::Coverage;
use super::face::continued_to_faces;
use super::scene::Scene;
use super::wall;
use super::window::{Window, Zone};
use crate::connectivity::components;
use crate::connectivity::{EIGHT, FOUR};

/// The region, clipped at the faces of the walls in it.
///
/// Steep points are a wall if they split the region or run out of it; the cells that a wall covers
/// do not count. An object inside the region with surface all around it is a gap in the surface,
/// and so are other unseen cells. `covered` says whether points off the surface lie over the cell
/// at a place.
pub(crate) fn up_to_faces(
    mut window: Window,
    covered: impl Fn([f64; 2]) -> bool,
    scene: &Scene<'_>,
    base: &Base,
    margin_m: f64,
) -> Window {
    let counted: Vec<Coverage> = (0..window.zones.len()).map(|cell| window.counted(cell)).collect();
    let walls = walls_of(&window, covered);
    if walls.is_empty() {
        window.walls.fill(false);
        return window;
    }
    // Of a cell that the outline only touches, most may lie behind a wall.
    for (zone, part) in window.zones.iter_mut().zip(&counted) {
        if *zone == Zone::Core && part.share < 0.5 {
            *zone = Zone::Toe;
        }
    }
    for &cell in &walls {
        window.zones[cell] = if window.walls[cell] { Zone::Toe } else { Zone::Outside };
    }
    let mut window = continued_to_faces(wall::up_to_walls(window, base), scene, base, margin_m);
    for (cell, outlined) in counted.into_iter().enumerate() {
        if matches!(window.zones[cell], Zone::Core | Zone::Toe) {
            let part = window.counted(cell);
            let smaller = if part.share < outlined.share { part } else { outlined };
            window.count_part(cell, smaller);
            window.zones[cell] = if smaller.share > 0.0 { Zone::Core } else { Zone::Outside };
        }
    }
    window
}

/// The cells of a region that belong to walls.
fn walls_of(window: &Window, covered: impl Fn([f64; 2]) -> bool) -> Vec<usize> {
    let (grid, core) = (&window.grid, |cell: usize| window.zones[cell] == Zone::Core);
    let seen = |cell: usize| !window.heights_m[cell].is_nan();
    let off = |cell: usize| !seen(cell) && (window.walls[cell] || covered(grid.center(cell)));
    let cells = || 0..window.zones.len();
    let mut side = vec![usize::MAX; window.zones.len()];
    let sides = components(grid, cells().map(|c| core(c) && seen(c)).collect(), &FOUR);
    for (number, cells) in sides.iter().enumerate() {
        cells.iter().for_each(|&cell| side[cell] = number);
    }
    let is_wall = |covered: &Vec<usize>| {
        let around = || {
            covered
                .iter()
                .flat_map(|&cell| EIGHT.iter().map(move |&(dx, dy)| grid.neighbor(cell, dx, dy)))
        };
        let runs_out = around().any(|n| n.is_none_or(|n| !core(n)));
        let mut beside = around().flatten().map(|n| side[n]).filter(|&s| s != usize::MAX);
        let first = beside.next();
        let parts = first.is_some_and(|first| beside.any(|other| other != first));
        covered.iter().any(|&cell| window.walls[cell]) && (runs_out || parts)
    };
    let covered = components(grid, cells().map(|c| core(c) && off(c)).collect(), &EIGHT);
    covered.into_iter().filter(is_wall).flatten().collect()
}
