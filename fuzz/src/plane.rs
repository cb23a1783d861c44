//! Planes, the ground, and poses.

use arbitrary::Arbitrary;
use divespot_core::ground::{Axis, Frame, find_ground};
use divespot_core::plane::{Cone, Settings, fit_plane};
use divespot_core::{pose, survey};

use crate::{Number, Points};

#[derive(Debug, Arbitrary)]
pub struct Input {
    points: Points,
    threshold_m: Number,
    hypotheses: u16,
    cone: Option<([Number; 3], Number)>,
    sensor: Option<[Number; 3]>,
    axis: u8,
    seed: u64,
    threads: bool,
}

impl Input {
    pub fn run(&self) {
        let Some(cloud) = self.points.cloud() else { return };
        let threads = 1 + usize::from(self.threads);
        let cone = self.cone.map(|(axis, angle)| Cone {
            axis: axis.map(Number::near),
            half_angle_rad: angle.near().abs().min(1.6),
        });
        let cone = cone.filter(|c| c.axis != [0.0; 3]); // refused before
        let settings = Settings {
            threshold_m: self.threshold_m.value(),
            hypotheses: u32::from(self.hypotheses % 500) + 1,
            cone,
            seed: self.seed,
            threads,
        };
        if let Ok(plane) = fit_plane(&cloud.points, &settings) {
            let length = plane.normal.iter().map(|v| v * v).sum::<f64>();
            assert!((length - 1.0).abs() < 1e-6, "{plane:?}");
            assert!(plane.inliers <= cloud.points.len());
            let _ = pose::leveling(&cloud.points, plane.normal, threads);
        }
        let _ =
            pose::rotation_to_z(self.sensor.unwrap_or([self.threshold_m; 3]).map(Number::value));
        let Ok(found) = survey::survey(&cloud.points, self.seed, threads) else { return };
        let z = [Axis::Up, Axis::Ahead, Axis::Behind][usize::from(self.axis % 3)];
        let frame = Frame { sensor: self.sensor.map(|s| s.map(Number::near)), z };
        let _ = find_ground(&cloud.points, &found.normals, &settings, frame);
    }
}
