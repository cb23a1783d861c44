//! What changed between a scan and a surface that was given: gained and lost volumes, in m³.
//!
//! No pile is looked for. Each change is measured from the lower surface up to the higher. Cells
//! below their detection limit do not start a change (Wheaton et al. 2010, ESPL 35:136). Around
//! those above it, differences are summed with their sign, as in the toe of a pile, because a sum
//! over only the cells above the limit is biased (Anderson 2019, ESPL 44:1015).

use super::base::Base;
use super::detection_limit::DETECTED;
use super::earlier::noise;
use super::face::continued_to_faces;
use super::faces::Faces;
use super::found::Found;
use super::nearest_label::NearestLabel;
use super::object::{Object, above_base, object_of};
use super::reason::Reason;
use super::scene::Scene;
use super::settings::Settings;
use super::surface::Surface;
use super::window::{Reach, Window};
use super::{cut, gaps, wall, watershed};
use crate::Point;
use crate::components::label_components;
use crate::connectivity::UNLABELLED;
use crate::connectivity::flood;
use crate::error::{Error, Result};
use crate::extent;
use crate::heightmap::{Grid, Volume};
use crate::hypotenuse::Hypotenuse;

/// Detection limit of a cell, in standard deviations of the mean over the cell and its neighbours.
/// Chosen on the scenes of `divespot evaluate`.
const CLEAR: f64 = 4.0;
/// Difference between two grids without noise at an edge of the surface, as a share of a cell's
/// width. Chosen: lower finds edges changed that did not change, higher overlooks thin gains.
const EDGE: f64 = 0.1;

/// What is said where nothing tells the surface that heights are held against.
const NO_BASE: &str = "no base was given: one to take differences from is needed";

/// A scan on the cells of a grid.
#[derive(Debug, Clone, PartialEq)]
pub struct Seen {
    /// Height of the surface in each cell, in m; NaN where it was not seen.
    pub heights_m: Vec<f64>,
    /// Number of points in each cell.
    pub counts: Vec<u32>,
    /// The points off the surface.
    pub loose: Vec<Point>,
}

impl Seen {
    /// The distance, in cells, from which cells have no points in common: 1, or 3 for a
    /// triangulated map, where three cells are as wide as the point spacing and most have no points.
    fn independent(&self) -> isize {
        let seen = || self.heights_m.iter().zip(&self.counts).filter(|(h, _)| !h.is_nan());
        let empty = seen().filter(|(_, count)| **count == 0).count();
        if 2 * empty > seen().count() { 3 } else { 1 }
    }
}

/// Measures where `later` stands above the base in force and, with an `earlier` scan which that
/// base represents, also where it lies below.
///
/// A lost volume is negative.
///
/// # Errors
///
/// No base, numbers of heights or points that are not the number of cells, or too few heights for
/// a surface.
///
/// # Examples
///
/// ```
/// use divespot_core::heightmap::height_map;
/// use divespot_core::piles::{Base, Seen, Settings, Surface, measure_difference};
///
/// // A cone 0.2 m high and 0.8 m wide on a floor, a point each 2 cm.
/// let cone = |x: f64, y: f64| (0.2 - 0.5 * (x - 1.0).hypot(y - 1.0)).max(0.0);
/// let places = (0..10_000).map(|i| [f64::from(i % 100) * 0.02, f64::from(i / 100) * 0.02]);
/// let points: Vec<_> = places.map(|[x, y]| [x, y, cone(x, y)]).collect();
/// let map = height_map(&points, 0.04)?;
/// let seen = |heights_m: Vec<f64>| Seen { heights_m, counts: map.counts.clone(), loose: Vec::new() };
/// let empty = seen(vec![0.0; map.grid.len()]);
/// let grid = &map.grid;
/// let ground = Base::ground(0.0, 0.001, 0.001);
/// let settings = Settings {
///     toe_cells: 3,
///     annulus_share: 0.15,
///     margin_m: 0.02,
///     base: Some(Base::on(Surface::over(*grid, empty.heights_m.clone())?, 0.001)),
///     compared: Vec::new(),
///     ground,
///     link_cells: 2,
///     fewest_cells: 20,
///     threads: 0,
/// };
/// let later = seen(map.heights_m.clone());
/// let objects = measure_difference(grid, &later, Some(&empty), &settings)?;
/// let truth_m3 = std::f64::consts::PI * 0.4_f64.powi(2) * 0.2 / 3.0;
/// assert!((objects[0].volume.net_m3() / truth_m3 - 1.0).abs() < 0.02);
/// # Ok::<(), divespot_core::Error>(())
/// ```
pub fn measure_difference(
    grid: &Grid,
    later: &Seen,
    earlier: Option<&Seen>,
    settings: &Settings,
) -> Result<Vec<Object>> {
    for seen in [Some(later), earlier].into_iter().flatten() {
        grid.require_each("heights", seen.heights_m.len())?;
        grid.require_each("counts", seen.counts.len())?;
    }
    let base = settings.base.as_ref().ok_or(Error::Degenerate(NO_BASE))?;
    let gain = Rise::of(grid, later, base, earlier, settings);
    let loss = match earlier {
        Some(earlier) => {
            let below = Base::on(Surface::over(*grid, later.heights_m.clone())?, 0.0);
            Some((Rise::of(grid, earlier, &below, Some(later), settings), below))
        }
        None => None,
    };
    let mut labels = label_components(grid, &gain.risen(), 0, settings.fewest_cells);
    let gained = labels.iter().max().map_or(0, |most| most + 1);
    if let Some((loss, _)) = &loss {
        let lost = label_components(grid, &loss.risen(), 0, settings.fewest_cells);
        for (label, lost) in labels.iter_mut().zip(lost).filter(|(label, _)| **label == UNLABELLED)
        {
            *label = if lost == UNLABELLED { UNLABELLED } else { lost + gained };
        }
    }
    let mut objects = gain.measured(&labels, |label| label < gained, settings);
    objects.iter_mut().for_each(|object| placed(object, base, base));
    if let Some((loss, below)) = &loss {
        let lost = loss.measured(&labels, |label| label >= gained, settings);
        objects.extend(lost.into_iter().map(|mut object| {
            placed(&mut object, below, base);
            negative(object)
        }));
    }
    Ok(objects)
}

/// A scan above another surface.
struct Rise<'a> {
    /// Heights of the scan above the other surface.
    scene: Scene<'a>,
    upper: &'a Seen,
    /// The other surface, at height 0.
    base: Base,
}

impl<'a> Rise<'a> {
    fn of(
        grid: &'a Grid,
        upper: &'a Seen,
        lower: &Base,
        other: Option<&Seen>,
        settings: &Settings,
    ) -> Self {
        let raised = |p: &Point| [p[0], p[1], p[2] - lower.at(grid.center(grid.cell(p)))];
        let loose = |seen: &Seen| -> Vec<Point> {
            seen.loose.iter().filter(|p| grid.holds(p)).map(raised).collect()
        };
        let above = |(cell, h): (usize, &f64)| h - lower.at(grid.center(cell));
        let above_m: Vec<f64> = upper.heights_m.iter().enumerate().map(above).collect();
        let mut heights_m = extent::without_lone(grid, &above_m);
        let (upper_loose, other_loose) = (loose(upper), other.map_or_else(Vec::new, loose));
        let level = Faces::of(
            grid,
            &vec![0.0; grid.len()],
            &standing(grid, other_loose.clone()),
            settings.margin_m,
        );
        let all = [upper_loose, other_loose].concat();
        let mut faces = Faces::of(grid, &above_m, &standing(grid, all), settings.margin_m);
        faces.walls.is.iter_mut().zip(&level.walls.is).for_each(|(is, other)| *is |= *other);
        (0..grid.len()).filter(|&c| faces.walls.is[c]).for_each(|c| heights_m[c] = f64::NAN);
        let outside = flood(grid, |cell| heights_m[cell].is_nan() && !faces.walls.is[cell]);
        let hull = extent::off_scan_cells(grid, &heights_m);
        let unseen = |cell: usize| heights_m[cell].is_nan() && outside[cell];
        let off_scan = (0..grid.len()).map(|cell| hull[cell] || unseen(cell)).collect();
        let base = lower.flattened(noise(grid, &heights_m, upper.independent()));
        let banks = vec![false; grid.len()];
        Self { scene: Scene { grid, heights_m, off_scan, faces, banks }, upper, base }
    }

    /// The cells above their detection limit, as one object.
    fn risen(&self) -> Vec<i32> {
        let Scene { grid, heights_m, .. } = &self.scene;
        let rises = |cell: usize| {
            let near = grid.around(cell, 1).map(|n| heights_m[n]).filter(|h| !h.is_nan());
            let (sum, count) = near.fold((0.0, 0.0), |(sum, count), h| (sum + h, count + 1.0));
            let u_unknown_m = self.base.u_unknown_m(grid.center(cell));
            let limit_m = CLEAR * (self.base.noise_m / f64::sqrt(count)).hypotenuse(u_unknown_m);
            !heights_m[cell].is_nan() && sum / count > limit_m.max(EDGE * grid.cell_m)
        };
        (0..grid.len()).map(|cell| if rises(cell) { 0 } else { UNLABELLED }).collect()
    }

    fn measured(
        &self,
        labels: &[i32],
        is_own: impl Fn(i32) -> bool,
        settings: &Settings,
    ) -> Vec<Object> {
        let reach = Reach::each(labels, settings.toe_cells, settings.annulus_share);
        let farthest = reach.iter().map(|r| r.farthest()).max().unwrap_or(0);
        let nearest = NearestLabel::grow(self.scene.grid, labels, |_| true, farthest);
        let windows = Window::all(&self.scene, labels, &nearest, &reach);
        let own = windows.into_iter().filter(|(label, _)| is_own(*label));
        own.flat_map(|(label, window)| self.objects(label, window, settings)).collect()
    }

    /// The objects of one connected component: clipped at walls, and parted by the watershed.
    fn objects(&self, label: i32, window: Window, settings: &Settings) -> Vec<Object> {
        let window = wall::up_to_walls(window, &self.base);
        let mut window = continued_to_faces(window, &self.scene, &self.base, settings.margin_m);
        let count = |center: [f64; 2]| self.upper.counts[self.scene.grid.cell(&center)];
        cut::count_what_was_seen(&mut window, count);
        let above_m = gaps::heights(&window, &above_base(&window, &self.base));
        let settings =
            Settings { base: Some(self.base.clone()), compared: vec![], ..settings.clone() };
        let Some(mut parts) = watershed::parts(&window, &above_m, settings.margin_m) else {
            return vec![self.object(label, &window, &settings)];
        };
        let count = parts.iter().flatten().max().map_or(0, |most| most + 1);
        for k in 1..count {
            if parts.iter().filter(|part| **part == Some(k)).count() < settings.fewest_cells {
                parts.iter_mut().filter(|part| **part == Some(k)).for_each(|part| *part = Some(0));
            }
        }
        let whole = (0..count).filter(|&k| parts.contains(&Some(k)));
        let part = |k: usize| window.part(|p| parts[window.grid.cell(&p)] == Some(k));
        whole.map(|k| self.object(label, &part(k), &settings)).collect()
    }

    /// An object of any shape is a change. Only its detection limit and too little seen surface
    /// speak against it.
    fn object(&self, label: i32, window: &Window, settings: &Settings) -> Object {
        let object = object_of(label, window, window, settings);
        let is_clear = object.volume.net_m3() > DETECTED * object.budget.combined_m3();
        let reason = match object.reason {
            Some(Reason::TooLittleSeen) => Some(Reason::TooLittleSeen),
            _ if is_clear => None,
            _ => Some(Reason::NotClear),
        };
        Object { reason, ..object }
    }
}

fn standing(grid: &Grid, loose: Vec<Point>) -> Found<'static> {
    Found { loose, ..Found::on_all_else(vec![UNLABELLED; grid.len()]) }
}

/// Raises an object, measured above `lower` at height 0, to its true height; it stands on `base`.
fn placed(object: &mut Object, lower: &Base, base: &Base) {
    object.centroid_m[2] += lower.at([object.centroid_m[0], object.centroid_m[1]]);
    object.outline_m.iter_mut().for_each(|p| p[2] += base.at([p[0], p[1]]));
    object.base_m.iter_mut().for_each(|p| p[2] = base.at([p[0], p[1]]));
}

fn negative(object: Object) -> Object {
    let Volume { cut_m3, fill_m3, .. } = object.volume;
    let volume = Volume { cut_m3: fill_m3, fill_m3: cut_m3, ..object.volume };
    Object { volume, max_height_m: 0.0, ..object }
}

#[cfg(test)]
mod tests {
    use super::super::tests::{CELL, exact, settings};
    use super::*;

    type Height = fn(f64, f64) -> f64;

    fn cone(x: f64, y: f64, height: f64) -> f64 {
        height * (1.0 - x.hypot(y)).max(0.0)
    }

    /// A scan with its own noise, unseen where `height` is NaN.
    fn seen(height: impl Fn(f64, f64) -> f64, seed: u64) -> (Grid, Seen) {
        let map = exact(height);
        let noise = |i: u64| {
            0.002 * ((crate::sample::mix(seed + i) >> 11) as f64 / (1_u64 << 53) as f64 - 0.5)
        };
        let heights_m = (0..).zip(&map.heights_m).map(|(i, h)| h + noise(i)).collect();
        let counts = map.heights_m.iter().map(|h| if h.is_nan() { 0 } else { 4 }).collect();
        (map.grid, Seen { heights_m, counts, loose: vec![] })
    }

    fn objects(later: Height, earlier: Height) -> Vec<Object> {
        let ((grid, later), (_, earlier)) = (seen(later, 1), seen(earlier, 1 << 40));
        let surface = Surface::over(grid, earlier.heights_m.clone()).unwrap();
        let settings = Settings { base: Some(Base::on(surface, 0.0)), ..settings() };
        measure_difference(&grid, &later, Some(&earlier), &settings).unwrap()
    }

    #[test]
    fn what_was_gained_and_what_was_lost_are_apart_and_what_stayed_is_nothing() {
        let floor: Height = |x, _| 0.1 * x;
        let found = objects(
            |x, y| 0.1 * x + cone(x - 2.0, y - 3.0, 0.6) + cone(x - 5.0, y - 4.5, 0.5),
            |x, y| 0.1 * x + cone(x - 5.0, y - 1.5, 0.3) + cone(x - 5.0, y - 4.5, 0.5),
        );
        let truths = [0.6, -0.3].map(|h| std::f64::consts::PI * h / 3.0);
        assert_eq!(found.len(), 2);
        for (object, truth) in found.iter().zip(truths) {
            let off = (object.volume.net_m3() / truth - 1.0).abs();
            assert!(off < 0.01 && object.reason.is_none(), "{off} {:?}", object.reason);
            assert!(off < 2.0 * object.budget.combined_m3() / truth.abs());
        }
        assert!(found[1].volume.fill_m3 > 50.0 * found[1].volume.cut_m3);
        assert!(objects(floor, floor).is_empty());
    }

    #[test]
    fn a_cloud_that_was_cut_out_counts_as_far_as_it_was_seen() {
        let inside = |x: f64, y: f64| (x - 4.0).hypot(y - 3.0) < 2.0;
        let (grid, scan) = seen(|x, y| if inside(x, y) { 1.0 } else { f64::NAN }, 1);
        let area_m2 = scan.heights_m.iter().filter(|h| !h.is_nan()).count() as f64 * CELL * CELL;
        let given = Base::plane(0.0, [0.0; 2], 0.0, 0.0, super::super::Kind::Given);
        let settings = Settings { base: Some(given), ..settings() };
        let found = measure_difference(&grid, &scan, None, &settings).unwrap();
        assert_eq!(found.len(), 1);
        assert!((found[0].volume.net_m3() / area_m2 - 1.0).abs() < 1e-3);
        assert!(found[0].reason.is_none() && found[0].touches_edge);
        let ends = |x: f64, y: f64| (x - 4.0).hypot(y - 3.0) > 1.95;
        let mut half = scan.clone();
        for cell in 0..grid.len() {
            let [x, y] = grid.center(cell);
            half.counts[cell] /= if ends(x, y) { 2 } else { 1 };
        }
        let less = measure_difference(&grid, &half, None, &settings).unwrap().remove(0);
        assert!(less.volume.net_m3() < 0.98 * area_m2, "{}", less.volume.net_m3());
    }

    #[test]
    fn a_base_is_needed() {
        let (grid, scan) = seen(|_, _| 0.0, 1);
        assert!(measure_difference(&grid, &scan, None, &settings()).is_err());
    }

    /// How much of a scan with so many times the noise rises above a base that is so far below it.
    fn risen(times: f64, rise_m: f64) -> f64 {
        let (grid, mut scan) = seen(|_, _| 0.0, 1);
        scan.heights_m.iter_mut().for_each(|h| *h *= times);
        let base = Base::plane(-rise_m, [0.0; 2], 0.0, 0.0, super::super::Kind::Given);
        let labels = Rise::of(&grid, &scan, &base, None, &settings()).risen();
        labels.iter().filter(|&&label| label == 0).count() as f64 / grid.len() as f64
    }

    #[test]
    fn cells_differ_where_the_mean_of_nine_does_by_four_of_its_deviations() {
        let sigma_m = 50.0 * 0.002 / 12.0_f64.sqrt() / 3.0;
        assert!(risen(50.0, 7.0 * sigma_m) > 0.9 && risen(50.0, 3.0 * sigma_m) < 0.25);
    }

    #[test]
    fn a_tenth_of_a_cell_is_no_difference() {
        assert!(risen(1.0, 0.15 * CELL) == 1.0 && risen(1.0, 0.07 * CELL) == 0.0);
    }
}
