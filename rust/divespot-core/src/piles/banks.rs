//! The base below a pile that leans on a bank or wall: the bank's face, continued below the pile.
//!
//! Method: a plane is fitted to the bank's cells beside the pile and continued below it, cell by
//! cell, until it meets the base. Heights in m.

use std::sync::Arc;

use super::bank::{Bank, SUPPORT, TOE};
use super::base::Base;
use super::buried::buried;
use super::window::{Window, Zone};
use crate::connectivity::FOUR;
use crate::count::to_f64;
use crate::hypotenuse::Hypotenuse;
use crate::material::GENTLE;
use crate::near_plane::{places_about, value, weighted_plane};

/// The steepest face that is continued, as rise over run: 74°. Chosen: on a steeper face the
/// material above it has no volume worth counting; lower leaves the material on steep banks out.
const STEEPEST: f64 = 3.5;
/// The mean height over a cell is integrated over this many places along each of its edges
/// (midpoint rule). Chosen: exact for planes unless they cross within the cell; fewer err more
/// there, more take time.
const PARTS: usize = 4;
/// The fewest cells for the plane of a face: twice its three parameters.
const FEWEST: usize = 6;

/// The base with the banks that continue below an object. A surface that was given contains them
/// already.
pub(crate) fn with_banks(base: Base, window: &Window) -> Base {
    if base.is_surface() {
        return base;
    }
    let bank = under(window, &base);
    base.with_bank(bank)
}

/// The banks and walls above the base below an object and its toe; `None` where there are none.
fn under(window: &Window, base: &Base) -> Option<Arc<Bank>> {
    let mut heights_m = vec![f64::NAN; window.zones.len()];
    let mut front = Vec::new();
    for cell in (0..heights_m.len()).filter(|&cell| window.banks[cell]) {
        if held(window, cell) {
            heights_m[cell] =
                go_on(window, cell, cell).map_or(f64::NAN, |face| face.above(base, window, cell));
        }
        front.push((cell, cell));
    }
    while let Some((bank, cell)) = front.pop() {
        for n in four(window, cell).filter(|&n| held(window, n) && !window.banks[n]) {
            let Some(face) = go_on(window, bank, n) else { continue };
            let height_m = face.above(base, window, n);
            let lower = face.height_m < window.heights_m[bank] && height_m < window.heights_m[n];
            let known = heights_m[n].is_nan() || heights_m[n] < height_m;
            if lower && known && height_m > base.at(window.grid.center(n)) {
                heights_m[n] = height_m;
                front.push((bank, n));
            }
        }
    }
    let mut u_m = vec![0.0; heights_m.len()];
    for wall in buried(window) {
        let high_m = wall.top_m - base.at(window.grid.center(wall.cell));
        heights_m[wall.cell] = wall.top_m.max(heights_m[wall.cell]);
        u_m[wall.cell] = wall.u_share * high_m.max(0.0);
    }
    let any = heights_m.iter().any(|h| !h.is_nan());
    any.then(|| Arc::new(Bank { grid: window.grid, heights_m, u_m }))
}

/// The object with its toe extended onto the banks beside it: cells where pile and bank meet hold
/// some of both.
pub(crate) fn with_toe(mut window: Window) -> Window {
    let beside = |&cell: &usize| {
        let near = || window.around(cell, TOE).any(|n| window.zones[n] == Zone::Core);
        window.banks[cell] && window.zones[cell] == Zone::Outside && near()
    };
    let toe: Vec<usize> = (0..window.zones.len())
        .filter(beside)
        .filter(|&cell| go_on(&window, cell, cell).is_some())
        .collect();
    toe.into_iter().for_each(|cell| window.zones[cell] = Zone::Toe);
    window
}

/// The plane of a bank's face at one cell.
struct Face {
    height_m: f64,
    slope: [f64; 2],
}

impl Face {
    /// The mean over a cell of the higher of face and base, in m.
    fn above(&self, base: &Base, window: &Window, cell: usize) -> f64 {
        let [x, y] = window.grid.center(cell);
        let at = |k: usize| (to_f64(k) + 0.5) / to_f64(PARTS) - 0.5;
        let height = |k: usize| {
            let off = [at(k % PARTS), at(k / PARTS)].map(|part| part * window.grid.cell_m);
            let face_m = self.height_m + self.slope[0] * off[0] + self.slope[1] * off[1];
            face_m.max(base.at([x + off[0], y + off[1]]))
        };
        (0..PARTS * PARTS).map(height).sum::<f64>() / to_f64(PARTS * PARTS)
    }
}

fn held(window: &Window, cell: usize) -> bool {
    matches!(window.zones[cell], Zone::Core | Zone::Toe)
}

fn four(window: &Window, cell: usize) -> impl Iterator<Item = usize> {
    window.grid.neighbors(cell, &FOUR)
}

/// The face at a cell, from a plane through the bank's cells around `bank`; `None` if the plane is
/// level or steeper than [`STEEPEST`]. Cells beside the object are left out, since they hold some
/// of its points.
fn go_on(window: &Window, bank: usize, cell: usize) -> Option<Face> {
    let beside = |n: usize| window.around(n, TOE).any(|n| window.zones[n] == Zone::Core);
    let clean = window.around(bank, SUPPORT).filter(|&n| window.banks[n] && !beside(n));
    let local = places_about(&window.grid, &window.heights_m, cell, clean);
    if local.len() < FEWEST {
        return None;
    }
    let plane = weighted_plane(&local, std::iter::repeat(1.0), true)?;
    let slope = [plane[1], plane[2]];
    let lies = (GENTLE..STEEPEST).contains(&slope[0].hypotenuse(slope[1]));
    lies.then_some(Face { height_m: value(&plane, &[0.0; 3]), slope })
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::super::tests::{CELL, exact, window_of};
    use super::*;

    /// An object up to 4 m, and behind it a bank of this slope in the cells that are; places count in
    /// cells from where they meet.
    fn leaning(slope: impl Fn(f64) -> f64, is_bank: impl Fn(isize, isize) -> bool) -> Window {
        let map = exact(|x, _| slope(x - 4.0));
        let mut window = window_of(&map, |x, y| (x - 3.5).abs() < 0.5 && (y - 3.0).abs() < 1.0);
        for cell in 0..window.zones.len() {
            let at = window.grid.center(cell);
            let [x, y] = [at[0] - 4.0, at[1] - 3.0].map(|v| (v / CELL).floor() as isize);
            if x >= 0 && is_bank(x, y) {
                Arc::make_mut(&mut window.banks)[cell] = true;
                window.zones[cell] = Zone::Outside;
            }
        }
        window
    }

    fn at(window: &Window, x: isize, y: isize) -> usize {
        window.grid.cell(&[4.0 + (x as f64 + 0.5) * CELL, 3.0 + (y as f64 + 0.5) * CELL])
    }

    fn face(window: &Window, x: isize) -> Option<Face> {
        go_on(window, at(window, x, 0), at(window, x, 0))
    }

    #[test]
    fn a_face_steeper_than_74_degrees_holds_nothing_and_a_gentle_one_is_none() {
        let lies = |slope: f64| face(&leaning(|x| slope * x, |_, _| true), 3).is_some();
        assert!(lies(2.5) && !lies(4.5));
        assert!(lies(0.2) && !lies(0.09));
    }

    #[test]
    fn of_fewer_than_six_cells_no_slope_is_known() {
        let of = |cells: isize| {
            face(&leaning(|x| x, |x, y| (2..5).contains(&x) && 3 * y + x - 2 < cells && y >= 0), 3)
        };
        assert!(of(7).is_some() && of(5).is_none());
    }

    #[test]
    fn a_bank_goes_on_as_it_is_in_its_cells_four_columns_away() {
        // Near its middle nothing was seen of it, and farther away it is level.
        let bent = |x: f64| x.min(11.0 * CELL);
        let window = leaning(bent, |x, _| !(4..9).contains(&x));
        let truth_m = window.grid.center(at(&window, 6, 0))[0] - 4.0;
        assert!((face(&window, 6).unwrap().height_m - truth_m).abs() < 1e-9);
    }

    #[test]
    fn a_toe_lies_on_two_cells_of_a_bank() {
        let window = with_toe(leaning(|x| x, |_, _| true));
        let zones = [0, 1, 2].map(|x| window.zones[at(&window, x, 0)]);
        assert_eq!(zones, [Zone::Toe, Zone::Toe, Zone::Outside]);
    }

    #[test]
    fn a_cell_holds_the_higher_of_the_face_and_the_base() {
        let window = leaning(|x| x, |_, _| true);
        let cell = at(&window, 3, 0);
        let above = |off: f64| {
            let face = Face { height_m: -off * CELL, slope: [1.0, 0.0] };
            face.above(&Base::ground(0.0, 0.0, 0.0), &window, cell) / CELL
        };
        // The face meets the base at these shares of the cell from its middle.
        for off in [-0.25, 0.0, 0.1, 0.25] {
            assert!(
                (above(off) - 0.5 * (0.5 - off).powi(2)).abs() < 0.006,
                "{off}: {}",
                above(off)
            );
        }
    }
}
