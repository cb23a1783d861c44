//! A simulated scan and one job a kernel, shared by the benches and the gate.

use std::hint::black_box;

use divespot_core::hdbscan::{self, Selection, hdbscan};
use divespot_core::heightmap::{HeightMap, height_map};
use divespot_core::piles::{self, Base, Found, Object};
use divespot_core::plane::{self, fit_plane};
use divespot_core::survey::survey;
use divespot_core::{
    GroundRule, Point, Result, ground_height, radius_outlier_mask, voxel_downsample,
};

const FLOOR_M: [f64; 2] = [3.0, 2.0];
const WALL_HEIGHT_M: f64 = 0.6;
const PILE_CENTER_M: [f64; 2] = [1.4, 0.9];
const PILE_RADIUS_M: f64 = 0.7;
const PILE_SLOPE: f64 = 0.45;
const NOISE_M: f64 = 0.001;
/// Cells this high above the floor belong to the pile or the wall.
const MARGIN_M: f64 = 0.01;

/// A floor, a conical pile on it and a wall behind it, with a millimetre of noise.
#[derive(Debug, Clone)]
pub struct Scan {
    points: Vec<Point>,
    heights_m: Vec<f64>,
    spacing_m: f64,
    map: HeightMap,
    found: Found<'static>,
}

impl Scan {
    /// A scan of `count` points: the same count, the same points.
    ///
    /// # Errors
    /// No points.
    pub fn new(count: u32) -> Result<Self> {
        let areas_m2 = (FLOOR_M[0] * FLOOR_M[1], FLOOR_M[0] * WALL_HEIGHT_M);
        let mut random = Random(u64::from(count));
        let wall_share = areas_m2.1 / (areas_m2.0 + areas_m2.1);
        let points: Vec<Point> = (0..count).map(|_| random.point(wall_share)).collect();
        let spacing_m = ((areas_m2.0 + areas_m2.1) / f64::from(count)).sqrt();
        let map = height_map(&points, 2.0 * spacing_m)?;
        let labels = (0..map.grid.len()).map(|cell| label(&map, cell)).collect();
        let found = Found { surface: points.clone().into(), ..Found::on_all_else(labels) };
        let heights_m = points.iter().map(|p| p[2]).collect();
        Ok(Self { points, heights_m, spacing_m, map, found })
    }
}

/// Pile 0, wall 1, floor -1.
fn label(map: &HeightMap, cell: usize) -> i32 {
    let center = map.grid.center(cell);
    let above = map.heights_m[cell] > MARGIN_M;
    let on_pile = above && pile_height_m(center) > 0.0;
    let on_wall = above && center[1] > FLOOR_M[1] - map.grid.cell_m;
    if on_wall { 1 } else { i32::from(on_pile) - 1 }
}

fn pile_height_m([x, y]: [f64; 2]) -> f64 {
    let [u, v] = [x - PILE_CENTER_M[0], y - PILE_CENTER_M[1]];
    PILE_SLOPE * (PILE_RADIUS_M - (u * u + v * v).sqrt()).max(0.0)
}

/// SplitMix64 (Steele, Lea, Flood 2014).
struct Random(u64);

impl Random {
    /// Uniform from 0 to 1.
    fn unit(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mixed = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((mixed ^ (mixed >> 31)) >> 11) as f64 / (1u64 << 53) as f64
    }

    /// Four uniform numbers, scaled to the deviation wanted, are normal enough.
    fn noise_m(&mut self) -> f64 {
        let sum: f64 = (0..4).map(|_| self.unit()).sum();
        (sum - 2.0) * 3.0_f64.sqrt() * NOISE_M
    }

    fn point(&mut self, wall_share: f64) -> Point {
        let on_wall = self.unit() < wall_share;
        let (x, across, noise_m) = (self.unit() * FLOOR_M[0], self.unit(), self.noise_m());
        if on_wall {
            return [x, FLOOR_M[1] + noise_m, across * WALL_HEIGHT_M];
        }
        let y = across * FLOOR_M[1];
        [x, y, pile_height_m([x, y]) + noise_m]
    }
}

/// A kernel with settings like those of a measurement.
#[derive(Debug, Clone, Copy)]
pub struct Job {
    /// The kernel.
    pub name: &'static str,
    /// Runs it on a scan with a number of threads, 0 for all.
    pub run: fn(&Scan, usize) -> Result<()>,
}

/// Every kernel that takes its share of a measurement's time.
pub const JOBS: [Job; 8] = [
    Job { name: "radius_outlier_mask", run: radius_filter },
    Job { name: "hdbscan", run: cluster },
    Job { name: "voxel_downsample", run: voxels },
    Job { name: "fit_plane", run: plane },
    Job { name: "survey", run: look },
    Job { name: "ground_height", run: ground },
    Job { name: "height_map", run: map },
    Job { name: "measure_piles", run: measure },
];

/// About 20 neighbours within the radius, half of them needed.
fn radius_filter(scan: &Scan, threads: usize) -> Result<()> {
    black_box(radius_outlier_mask(&scan.points, 2.5 * scan.spacing_m, 10, threads)?);
    Ok(())
}

fn cluster(scan: &Scan, threads: usize) -> Result<()> {
    let settings = hdbscan::Settings {
        min_cluster_size: 100,
        min_samples: 10,
        cluster_selection_epsilon: 0.0,
        selection: Selection::ExcessOfMass,
        allow_single_cluster: true,
        threads,
    };
    black_box(hdbscan(&scan.points, &settings)?);
    Ok(())
}

fn voxels(scan: &Scan, threads: usize) -> Result<()> {
    black_box(voxel_downsample(&scan.points, 2.0 * scan.spacing_m, threads)?);
    Ok(())
}

fn plane(scan: &Scan, threads: usize) -> Result<()> {
    let settings = plane::Settings {
        threshold_m: 4.0 * NOISE_M,
        hypotheses: 1000,
        cone: None,
        seed: 0,
        threads,
    };
    black_box(fit_plane(&scan.points, &settings)?);
    Ok(())
}

fn look(scan: &Scan, threads: usize) -> Result<()> {
    black_box(survey(&scan.points, 0, threads)?);
    Ok(())
}

fn ground(scan: &Scan, _threads: usize) -> Result<()> {
    black_box(ground_height(&scan.heights_m, NOISE_M, 5, GroundRule::Lower, 0.5)?);
    Ok(())
}

fn map(scan: &Scan, _threads: usize) -> Result<()> {
    black_box(height_map(&scan.points, 2.0 * scan.spacing_m)?);
    Ok(())
}

fn measure(scan: &Scan, _threads: usize) -> Result<()> {
    black_box(objects(scan)?);
    Ok(())
}

fn objects(scan: &Scan) -> Result<Vec<Object>> {
    let settings = piles::Settings {
        toe_cells: 3,
        annulus_share: 0.15,
        margin_m: MARGIN_M,
        base: None,
        compared: vec![],
        ground: Base::ground(0.0, NOISE_M, NOISE_M),
        link_cells: 1,
        fewest_cells: 20,
        threads: 1,
    };
    piles::measure(&scan.map.grid, &scan.map.heights_m, &scan.found, &settings)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_job_runs_and_the_pile_has_its_volume() {
        let scan = Scan::new(30_000).unwrap();
        JOBS.iter().for_each(|job| (job.run)(&scan, 1).unwrap());
        let found = objects(&scan).unwrap();
        let cone_m3 = std::f64::consts::FRAC_PI_3 * PILE_SLOPE * PILE_RADIUS_M.powi(3);
        assert!((found[0].volume.net_m3() / cone_m3 - 1.0).abs() < 0.02);
    }
}
