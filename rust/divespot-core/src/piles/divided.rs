//! Splits objects where walls part them, and labels what walls part from all ground.
//!
//! The fill of an open container is an object of its own, not part of a pile that leans on the
//! container.

use std::collections::BTreeMap;

use super::found::Found;
use super::scene::Scene;
use super::standing::GAP;
use crate::connectivity::components_joined;
use crate::connectivity::{FOUR, UNLABELLED};
use crate::count::to_f64;

/// Share of the perimeter of a square as large as the object, along which it must border on ground
/// to stand on it, or on walls to be held by them. Chosen on the scenes of `divespot evaluate`.
const ALONG: f64 = 0.1;

/// A part cut off by walls that is smaller than this share of its object is a residue of the walls.
/// Chosen on the scenes of `divespot evaluate`.
const CRUMB: f64 = 0.05;

/// Objects by cell, and the first label of those that walls part from all ground.
pub(crate) struct Divided {
    pub(crate) labels: Vec<i32>,
    pub(crate) first_apart: i32,
}

impl Divided {
    /// Splits the objects along walls; each part that walls part from all ground becomes an object
    /// of its own.
    pub(crate) fn of(scene: &Scene<'_>, found: &Found) -> Self {
        let (grid, labels) = (scene.grid, &found.labels);
        let (walls, retaining) = (&scene.faces.walls.cells, &scene.faces.walls.retaining);
        let first_apart = labels.iter().max().map_or(0, |most| most + 1);
        if !walls.contains(&true) && !retaining.contains(&true) {
            return Self { labels: labels.clone(), first_apart };
        }
        let mut labels = without_feet(scene, labels.clone());
        let free = labels.iter().zip(walls).map(|(&label, wall)| label != UNLABELLED && !wall);
        let parts = components_joined(grid, free.collect(), &FOUR, |a, b| labels[a] == labels[b]);
        let seen = largest_seen(scene, &parts);
        let mut largest = BTreeMap::new();
        for (part, seen) in parts.iter().zip(&seen) {
            let most = largest.entry(labels[part[0]]).or_insert(0);
            *most = seen.len().max(*most);
        }
        let mut next = first_apart;
        for (part, seen) in parts.iter().zip(&seen) {
            let most = largest[&labels[part[0]]];
            if to_f64(seen.len()) < CRUMB * to_f64(most) {
                part.iter().for_each(|&cell| labels[cell] = UNLABELLED);
            } else if is_apart(scene, found, seen) {
                part.iter().for_each(|&cell| labels[cell] = next);
                next += 1;
            }
        }
        (0..labels.len())
            .filter(|&cell| retaining[cell])
            .for_each(|cell| labels[cell] = UNLABELLED);
        Self { labels, first_apart }
    }
}

/// The largest connected component of seen cells in each part.
fn largest_seen(scene: &Scene<'_>, parts: &[Vec<usize>]) -> Vec<Vec<usize>> {
    let mut of = vec![usize::MAX; scene.grid.len()];
    let mut seen = vec![false; scene.grid.len()];
    for (number, &cell) in parts.iter().enumerate().flat_map(|(k, p)| p.iter().map(move |c| (k, c)))
    {
        of[cell] = number;
        seen[cell] = !scene.heights_m[cell].is_nan();
    }
    let mut largest = vec![Vec::new(); parts.len()];
    for piece in components_joined(scene.grid, seen, &FOUR, |a, b| of[a] == of[b]) {
        let most: &mut Vec<usize> = &mut largest[of[piece[0]]];
        if piece.len() > most.len() {
            *most = piece;
        }
    }
    largest
}

/// Whether walls hold the seen cells of a part and no ground borders on them. Only the largest
/// component counts, since small ones behind a container border on ground there.
fn is_apart(scene: &Scene<'_>, found: &Found, seen: &[usize]) -> bool {
    let along = |meets: &dyn Fn(usize) -> bool| {
        let at = |&&cell: &&usize| scene.grid.around(cell, GAP).any(meets);
        to_f64(seen.iter().filter(at).count()) > ALONG * 4.0 * to_f64(seen.len()).sqrt()
    };
    let is_ground = |cell: usize| found.ground[cell] && !scene.heights_m[cell].is_nan();
    along(&|cell| scene.faces.bars[cell]) && !along(&is_ground)
}

/// The labels without thin strips beside a face: there the face's foot and the ground share a cell.
fn without_feet(scene: &Scene<'_>, mut labels: Vec<i32>) -> Vec<i32> {
    let (grid, retaining) = (scene.grid, &scene.faces.walls.retaining);
    let beside =
        |cell: usize| labels[cell] != UNLABELLED && grid.around(cell, GAP).any(|n| retaining[n]);
    let own = |cell: usize, n: usize| labels[n] == labels[cell] && !scene.heights_m[n].is_nan();
    let full = |cell: usize| grid.around(cell, 1).all(|n| own(cell, n));
    let thin = |cell: &usize| beside(*cell) && !grid.around(*cell, 1).any(full);
    let feet: Vec<usize> = (0..labels.len()).filter(thin).collect();
    feet.into_iter().for_each(|cell| labels[cell] = UNLABELLED);
    labels
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::heightmap::Grid;

    const GRID: Grid = Grid { origin_m: [0.0; 2], cell_m: 1.0, columns: 60, rows: 20 };

    /// An object that fills a map of 60 by 20 cells.
    fn all() -> Found<'static> {
        Found::on_all_else(vec![0; GRID.len()])
    }

    fn scene_of() -> Scene<'static> {
        Scene::new(&GRID, &vec![1.0; GRID.len()], &all(), 0.03).unwrap()
    }

    #[test]
    fn what_walls_part_from_a_pile_is_left_from_them_up_to_a_twentieth_of_it() {
        let is_left = |column: usize| {
            let mut scene = scene_of();
            (0..GRID.len()).for_each(|c| scene.faces.walls.cells[c] = c % 60 == column);
            Divided::of(&scene, &all()).labels[0] == UNLABELLED
        };
        // 2 of 57 columns, 4 of 55.
        assert!(is_left(2) && !is_left(4));
    }

    #[test]
    fn walls_hold_what_meets_them_along_a_tenth_of_its_edge() {
        let held = |cells: usize| {
            let mut scene = scene_of();
            (6..6 + cells).for_each(|row| scene.faces.bars[row * 60 + 21] = true);
            let square: Vec<usize> = (0..GRID.len()).filter(|cell| cell % 60 < 20).collect();
            is_apart(&scene, &all(), &square)
        };
        // Within two cells of the wall lie four more than it has, of an edge of 80.
        assert!(held(8) && !held(2));
    }
}
