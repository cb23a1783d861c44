//! The window of the height map around one object, with the zone of each of its cells.

use std::sync::Arc;

use super::bank;
use super::base::Base;
use super::coverage::Coverage;
use super::nearest_label::NearestLabel;
use super::scene::Scene;
use crate::cancel::{Polled, poll};
use crate::connectivity::{UNLABELLED, flood};
use crate::heightmap::Grid;

/// The zone of a cell relative to the object.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Zone {
    /// Not used.
    Outside,
    /// Found by its height, or enclosed by such cells.
    Core,
    /// Near enough to the core to hold the object's toe.
    Toe,
    /// The annulus of ground around the toe, which carries the base.
    Annulus,
    /// Ground beyond the annulus, used only by the kriging.
    Far,
}

/// A window of the height map with the zone of every cell. Copies share the layers that no step
/// changes.
#[derive(Debug, Clone)]
pub(crate) struct Window {
    pub(crate) grid: Grid,
    pub(crate) heights_m: Vec<f64>,
    pub(crate) zones: Vec<Zone>,
    /// Cells beyond the scan's edge.
    pub(crate) off_scan: Arc<[bool]>,
    /// Cells on the border of the whole map: there the toe of a core cell is cut off.
    pub(crate) border: Arc<[bool]>,
    /// Cells at which a face rises.
    pub(crate) walls: Vec<bool>,
    /// Walls that are as high as the surface before them.
    pub(crate) flush: Arc<[bool]>,
    /// Walls of which only the top was seen.
    pub(crate) tops: Arc<[bool]>,
    /// Height of the wall's top in cells without a surface over it, in m; NaN elsewhere.
    pub(crate) wall_tops_m: Arc<[f64]>,
    /// Cells of a surface with points of something higher.
    pub(crate) mixed: Arc<[bool]>,
    /// Cells of walls and of the gaps in them: no flank continues across them.
    pub(crate) bars: Arc<[bool]>,
    /// Cells of banks that lead to higher ground.
    pub(crate) banks: Arc<[bool]>,
    /// The plane through the annulus, if it was fitted; valid while the core is unchanged.
    pub(crate) plane: Option<Base>,
    /// The counted part of each cell, where an outline or wall cuts cells.
    parts: Option<Vec<Coverage>>,
}

/// The widths of the zones around an object's core, in steps.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Reach {
    pub(crate) toe: u32,
    pub(crate) annulus: u32,
    /// Beyond the annulus.
    pub(crate) far: u32,
}

/// Width of the ground used by the kriging, as a share of the edge of a square as large as the
/// object. Ground farther off is correlated less with that below the object than steps between
/// frames disturb it. Chosen on the scenes of `divespot evaluate`.
const WAVES_SHARE: f64 = 1.0;
/// Least width of the annulus, in steps. Chosen: less leaves small piles too little ground, more
/// reaches their neighbours.
const FEWEST_STEPS: u32 = 3;

impl Reach {
    /// The zones of each object. The annulus is a share of the edge of a square as large as the
    /// object.
    pub(crate) fn each(labels: &[i32], toe: u32, annulus_share: f64) -> Vec<Self> {
        let mut cells: Vec<u32> = Vec::new();
        for label in labels.iter().filter_map(|&l| usize::try_from(l).ok()) {
            cells.resize(cells.len().max(label + 1), 0);
            cells[label] += 1;
        }
        let reach = |&cells: &u32| {
            let share = |share: f64| (share * f64::from(cells).sqrt()) as u32;
            let annulus = share(annulus_share).max(FEWEST_STEPS);
            Self { toe, annulus, far: share(WAVES_SHARE).saturating_sub(annulus) }
        };
        cells.iter().map(reach).collect()
    }

    /// Steps to the farthest cell that is used.
    pub(crate) fn farthest(self) -> u32 {
        self.toe + self.annulus + self.far
    }
}

#[derive(Debug, Clone, Copy)]
struct Rectangle {
    columns: (usize, usize),
    rows: (usize, usize),
}

impl Window {
    /// One window for each label that has cells, in the order of labels.
    pub(crate) fn all(
        scene: &Scene<'_>,
        labels: &[i32],
        nearest: &NearestLabel,
        reach: &[Reach],
    ) -> Vec<(i32, Self)> {
        let rectangles = rectangles_of(scene.grid, nearest, reach);
        let labelled = (0i32..)
            .zip(rectangles.into_iter().zip(reach))
            .filter_map(|(label, (rectangle, reach))| Some((label, rectangle?, *reach)));
        labelled
            .map(|(label, rectangle, reach)| {
                poll();
                let cells = rectangle.cells(scene.grid);
                let zones = zones_of(&cells, nearest, reach, label);
                let mut window = Self::cut(scene, &cells, zones, rectangle);
                window.fill_enclosed(|i| ![UNLABELLED, label].contains(&labels[cells[i]]));
                (label, window)
            })
            .collect()
    }

    fn cut(scene: &Scene<'_>, cells: &[usize], zones: Vec<Zone>, rectangle: Rectangle) -> Self {
        let [x, y] = scene.grid.center(cells[0]);
        let half = 0.5 * scene.grid.cell_m;
        let [columns, rows] = rectangle.size();
        Self {
            grid: Grid { origin_m: [x - half, y - half], columns, rows, ..*scene.grid },
            heights_m: cells.iter().map(|&cell| scene.heights_m[cell]).collect(),
            border: cells.iter().map(|&cell| scene.grid.is_border(cell)).collect(),
            walls: cells.iter().map(|&cell| scene.faces.walls.is[cell]).collect(),
            flush: cells.iter().map(|&cell| scene.faces.walls.flush[cell]).collect(),
            tops: cells.iter().map(|&cell| scene.faces.walls.tops[cell]).collect(),
            wall_tops_m: cells.iter().map(|&cell| scene.faces.walls.tops_m[cell]).collect(),
            mixed: cells.iter().map(|&cell| scene.faces.walls.mixed[cell]).collect(),
            bars: cells.iter().map(|&cell| scene.faces.bars[cell]).collect(),
            banks: cells.iter().map(|&cell| scene.banks[cell]).collect(),
            off_scan: cells.iter().map(|&cell| scene.off_scan[cell]).collect(),
            zones,
            plane: None,
            parts: None,
        }
    }

    /// The window with the plane through its annulus.
    pub(crate) fn with_plane(self, plane: Option<Base>) -> Self {
        Self { plane, ..self }
    }

    /// Counts only a part of each cell, given by the cell's middle.
    pub(crate) fn count_parts(&mut self, part: impl Fn([f64; 2]) -> Coverage) {
        let cells = 0..self.zones.len();
        self.parts = Some(cells.map(|cell| part(self.grid.center(cell))).collect());
    }

    /// Counts only a part of one cell.
    pub(crate) fn count_part(&mut self, cell: usize, part: Coverage) {
        let whole = || vec![Coverage::WHOLE; self.zones.len()];
        self.parts.get_or_insert_with(whole)[cell] = part;
    }

    /// The counted part of a cell.
    pub(crate) fn counted(&self, cell: usize) -> Coverage {
        match (self.zones[cell], &self.parts) {
            (Zone::Annulus | Zone::Far | Zone::Outside, _) => Coverage::default(),
            (Zone::Core | Zone::Toe, Some(parts)) => parts[cell],
            (Zone::Core | Zone::Toe, None) => Coverage::WHOLE,
        }
    }

    /// The cells of which any part counts.
    pub(crate) fn held(&self) -> impl Iterator<Item = usize> + '_ {
        (0..self.zones.len()).filter(|&cell| self.counted(cell).share > 0.0)
    }

    /// Adds cells that the core encloses to it, seen or not, unless they are another object's.
    fn fill_enclosed(&mut self, others: impl Fn(usize) -> bool) {
        let open = flood(&self.grid, |cell| self.zones[cell] != Zone::Core);
        for (cell, zone) in self.zones.iter_mut().enumerate() {
            if !open[cell] && !others(cell) {
                *zone = Zone::Core;
            }
        }
    }

    /// The object restricted to the cells whose middles are `kept`, with the same ground around it.
    pub(crate) fn part(&self, kept: impl Fn([f64; 2]) -> bool) -> Self {
        let zone = |(cell, &zone): (usize, &Zone)| match zone {
            Zone::Core | Zone::Toe if !kept(self.grid.center(cell)) => Zone::Outside,
            _ => zone,
        };
        let zones = self.zones.iter().enumerate().map(zone).collect();
        Self { zones, ..self.clone() }
    }

    /// The cells of a zone.
    pub(crate) fn cells(&self, wanted: Zone) -> impl Iterator<Item = usize> + '_ {
        (0..self.zones.len()).filter(move |&cell| self.zones[cell] == wanted)
    }

    /// Core cells with a neighbour outside the core, or on the map's border.
    pub(crate) fn rim(&self) -> impl Iterator<Item = usize> + '_ {
        let is_core = |&n: &usize| self.zones[n] == Zone::Core;
        self.cells(Zone::Core).filter(move |&cell| self.around(cell, 1).filter(is_core).count() < 9)
    }

    /// Mean of the known values in a cell and its neighbours, over the cells for which `counts`
    /// holds.
    pub(crate) fn mean_around(
        &self,
        values: &[f64],
        cell: usize,
        counts: impl Fn(usize) -> bool,
    ) -> Option<f64> {
        let near = self.around(cell, 1).filter(|&n| counts(n));
        let known = near.map(|n| values[n]).filter(|v| !v.is_nan());
        let (sum, count) = known.fold((0.0, 0.0), |(sum, count), v| (sum + v, count + 1.0));
        (count > 0.0).then(|| sum / count)
    }

    /// The cells up to `reach` columns and rows away, including the cell itself.
    pub(crate) fn around(&self, cell: usize, reach: usize) -> impl Iterator<Item = usize> + use<> {
        self.grid.around(cell, reach)
    }
}

impl Rectangle {
    fn size(&self) -> [usize; 2] {
        [self.columns.1 - self.columns.0 + 1, self.rows.1 - self.rows.0 + 1]
    }

    /// The map's cells in the window, row by row.
    fn cells(&self, grid: &Grid) -> Vec<usize> {
        let row = |r: usize| (self.columns.0..=self.columns.1).map(move |c| r * grid.columns + c);
        (self.rows.0..=self.rows.1).flat_map(row).collect()
    }
}

fn zones_of(cells: &[usize], nearest: &NearestLabel, reach: Reach, label: i32) -> Vec<Zone> {
    let zone = |&cell: &usize| match nearest.steps[cell] {
        _ if nearest.owner[cell] != label => Zone::Outside,
        0 => Zone::Core,
        steps if steps <= reach.toe => Zone::Toe,
        steps if steps <= reach.toe + reach.annulus => Zone::Annulus,
        steps if steps <= reach.farthest() => Zone::Far,
        _ => Zone::Outside,
    };
    cells.iter().map(zone).collect()
}

/// The smallest window around each label's zones. Its own cells get a margin of [`bank::REACH`],
/// since a bank beside an object may be nearer to another one.
fn rectangles_of(grid: &Grid, nearest: &NearestLabel, reach: &[Reach]) -> Vec<Option<Rectangle>> {
    let mut rectangles: Vec<Option<Rectangle>> = vec![None; reach.len()];
    for (cell, (&label, &steps)) in nearest.owner.iter().zip(&nearest.steps).enumerate().polled() {
        let Ok(label) = usize::try_from(label) else { continue };
        if steps > reach[label].farthest() {
            continue;
        }
        let about = if steps == 0 { bank::REACH } else { 0 };
        let span =
            |at: usize, count: usize| (at.saturating_sub(about), (at + about).min(count - 1));
        let columns = span(cell % grid.columns, grid.columns);
        let rows = span(cell / grid.columns, grid.rows);
        let rectangle = rectangles[label].get_or_insert(Rectangle { columns, rows });
        rectangle.columns =
            (rectangle.columns.0.min(columns.0), rectangle.columns.1.max(columns.1));
        rectangle.rows = (rectangle.rows.0.min(rows.0), rectangle.rows.1.max(rows.1));
    }
    rectangles
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn zones_reach_as_far_as_an_object_is_large() {
        let reach = |cells: usize| Reach::each(&vec![0; cells], 4, 0.2)[0];
        let all = |Reach { toe, annulus, far }: Reach| [toe, annulus, far];
        // A square of 20 by 20 cells has a ring of a fifth of that, and waves are looked for as far off
        // as it is wide; a ring has three steps at least.
        assert_eq!(all(reach(400)), [4, 4, 16]);
        assert_eq!(all(reach(25)), [4, 3, 2]);
    }
}
