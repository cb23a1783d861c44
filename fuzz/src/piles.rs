//! Measuring what stands on the ground.

use arbitrary::Arbitrary;
use divespot_core::heightmap::Grid;
use divespot_core::piles::{
    Base, Found, Kind, Region, Seen, Settings, Surface, base_map, measure, measure_difference,
    measure_inside,
};
use divespot_core::surface::hills;

use crate::{Number, Points, Relief};

#[derive(Debug, Arbitrary)]
pub struct Input {
    relief: Relief,
    earlier: Relief,
    loose: Points,
    labels: Vec<i8>,
    toe_cells: u8,
    annulus_share: u8,
    margin_m: Number,
    base: u8,
    level_m: Number,
    tilt: [Number; 2],
    corners: Vec<[i8; 2]>,
}

impl Input {
    pub fn run(&self) {
        let Some((grid, heights_m)) = self.relief.map() else { return };
        let Ok(found) = hills(&grid, &heights_m) else { return };
        let loose = self.loose.cloud().map_or_else(Vec::new, |cloud| cloud.points);
        let labels = found.labels.iter().zip(self.labels.iter().chain(std::iter::repeat(&0)));
        let labels = labels.map(|(own, &n)| if n > 0 { i32::from(n % 4) } else { *own }).collect();
        let apart = loose.iter().map(|p| p[0] > 1.0).collect();
        let surface = self.relief.points().into();
        let found = Found { labels, ground: found.ground, surface, loose: loose.clone(), apart };
        let settings = self.settings(&grid);
        if let Ok(objects) = measure(&grid, &heights_m, &found, &settings) {
            assert_eq!(base_map(&grid, &objects).len(), grid.len());
        }
        let ring = self.corners.iter().map(|c| c.map(|v| f64::from(v) / 16.0)).collect();
        let regions = [Region { rings: vec![ring] }];
        let _ = measure_inside(&grid, &heights_m, &regions, &found, &settings);
        let mut earlier = self.earlier.heights_m();
        earlier.resize(grid.len(), f64::NAN);
        let seen = |heights_m: &[f64]| Seen {
            heights_m: heights_m.to_vec(),
            counts: heights_m.iter().map(|h| u32::from(!h.is_nan())).collect(),
            loose: loose.clone(),
        };
        let (later, earlier) = (seen(&heights_m), seen(&earlier));
        let _ = measure_difference(&grid, &later, Some(&earlier), &settings);
        let _ = measure_difference(&grid, &later, None, &settings);
    }

    fn settings(&self, grid: &Grid) -> Settings {
        let (level, tilt) = (self.level_m.near(), self.tilt.map(|t| t.near().clamp(-1.0, 1.0)));
        let mut below = self.earlier.heights_m();
        below.resize(grid.len(), f64::NAN);
        let base = match self.base % 4 {
            0 => None,
            1 => Some(Base::plane(level, tilt, 0.01, 0.01, Kind::Given)),
            2 => Some(Base::plane(level, tilt, 0.01, 0.01, Kind::Ground)),
            _ => Surface::over(*grid, below).ok().map(|surface| Base::on(surface, 0.01)),
        };
        Settings {
            toe_cells: u32::from(self.toe_cells % 8),
            annulus_share: f64::from(self.annulus_share) / 256.0,
            margin_m: self.margin_m.near().abs().max(1e-6),
            base: base.clone(),
            compared: vec![None, base],
            ground: Base::ground(level, 0.01, 0.01),
            link_cells: u32::from(self.toe_cells % 3),
            fewest_cells: usize::from(self.annulus_share % 5),
            threads: 1 + usize::from(self.toe_cells % 2),
        }
    }
}
