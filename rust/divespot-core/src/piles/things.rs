//! Things: objects other than material, which rise from the surface or hang over it.
//!
//! Method: connected components of the cells with points above the surface.

use super::found::Found;
use super::object::Object;
use super::reason::Reason;
use super::settings::Settings;
use super::{flat_top, floating};
use crate::cancel::Polled;
use crate::components::label_components;
use crate::connectivity::UNLABELLED;
use crate::fixed::Fixed;
use crate::heightmap::Grid;

/// The connected components of the points above a surface.
pub(crate) struct Things<'a> {
    grid: &'a Grid,
    all: &'a Found<'a>,
    above: Above,
    /// The things, with the ground they stand on.
    pub(crate) found: Found<'static>,
    /// Mean height of the things where there are any, and of the surface elsewhere, in m.
    pub(crate) with_things_m: Vec<f64>,
}

impl<'a> Things<'a> {
    pub(crate) fn of(
        grid: &'a Grid,
        surface_m: &'a [f64],
        found: &'a Found<'a>,
        settings: &Settings,
    ) -> Self {
        let above = Above::of(grid, surface_m, found);
        let labels =
            label_components(grid, &above.labels(), settings.link_cells, settings.fewest_cells);
        let is_thing = |cell: usize| labels[cell] != UNLABELLED;
        let height = |cell| if is_thing(cell) { above.mean(cell) } else { surface_m[cell] };
        let with_things_m = (0..grid.len()).map(height).collect();
        let ground = (0..grid.len()).map(|c| found.ground[c] && !is_thing(c)).collect();
        let standing = Found { ground, ..Found::on_all_else(labels) };
        Self { grid, all: found, above, found: standing, with_things_m }
    }

    /// The measured things, each with its reason: none is a pile.
    pub(crate) fn judged(&self, mut objects: Vec<Object>, settings: &Settings) -> Vec<Object> {
        for object in &mut objects {
            object.reason.get_or_insert(Reason::Apart);
        }
        flat_top::trim(self.grid, &self.all.loose, &mut objects, settings.margin_m);
        floating::mark(self.grid, self.all, &mut objects);
        for object in objects.iter_mut().filter(|object| self.is_apart(object)) {
            object.reason = Some(Reason::Apart);
        }
        objects
    }

    /// Whether most of an object's points belong to clusters apart from that of the ground.
    fn is_apart(&self, object: &Object) -> bool {
        let cells = || object.covers_m.iter().map(|p| self.grid.cell(&p[..]));
        let sum = |counts: &[u32]| cells().map(|cell| u64::from(counts[cell])).sum::<u64>();
        2 * sum(&self.above.apart) > sum(&self.above.counts)
    }
}

/// The points above the surface, by cell.
struct Above {
    fixed: Fixed,
    sums: Vec<i64>,
    counts: Vec<u32>,
    /// Number of points in clusters apart from that of the ground.
    apart: Vec<u32>,
}

impl Above {
    /// Only points above the surface: those below it are mirror images and other outliers.
    fn of(grid: &Grid, heights_m: &[f64], found: &Found) -> Self {
        let largest = found.loose.iter().fold(0.0_f64, |most, p| most.max(p[2].abs()));
        let fixed = Fixed::new(largest, found.loose.len());
        let (sums, none) = (vec![0; grid.len()], vec![0; grid.len()]);
        let mut above = Self { fixed, sums, counts: none.clone(), apart: none };
        let apart = found.apart.iter().copied().chain(std::iter::repeat(false));
        for (p, apart) in found.loose.iter().zip(apart).filter(|(p, _)| grid.holds(p)).polled() {
            let cell = grid.cell(p);
            if heights_m[cell].is_nan() || p[2] > heights_m[cell] {
                above.sums[cell] += fixed.encode(p[2]);
                above.counts[cell] += 1;
                above.apart[cell] += u32::from(apart);
            }
        }
        above
    }

    fn labels(&self) -> Vec<i32> {
        self.counts.iter().map(|&count| if count > 0 { 0 } else { UNLABELLED }).collect()
    }

    fn mean(&self, cell: usize) -> f64 {
        self.fixed.mean(self.sums[cell] as f64, self.counts[cell])
    }
}
