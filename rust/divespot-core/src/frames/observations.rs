//! What frames, and the floor's plane, say of the height of a surfel.

use nalgebra::Vector3;

use super::links::{Link, Sight};
use super::normal_equations::{Row, WIDTH};
use super::state::{ALIKE, State};
use super::track::Kept;

/// A residual of more standard deviations counts less.
const HUBER: f64 = 3.0;
/// The floor is within this part of the range of its plane, and so many degrees (cosine) of it.
const FLOOR: f64 = 0.015;
const LEVEL: f64 = 0.985;

impl State {
    /// What is known of the height of a surfel, along its normal.
    pub(super) fn rows(
        &self,
        frames: &[Option<Kept>],
        middles: &[Vector3<f64>],
        link: &Link,
    ) -> Vec<Row> {
        let n = link.surfel.normal;
        let mut rows: Vec<Row> = Vec::with_capacity(link.sights.len() + 1);
        for sight in &link.sights {
            let (Some(kept), Some(first)) = (&frames[sight.frame], self.places[sight.frame]) else {
                continue;
            };
            let at = self.place(kept, sight);
            let turn = (at - middles[sight.frame]).cross(&n);
            let ray = n.dot(&(kept.pose.rotation * sight.ray));
            let row = [turn.x, turn.y, turn.z, n.x, n.y, n.z, ray];
            let weight = 1.0 / (sight.noise_m2 + self.unexplained_m * self.unexplained_m);
            let off = n.dot(&(at - link.surfel.at));
            rows.push(Row { first, len: WIDTH, row, off, weight });
        }
        lighten(&mut rows, self.is_settled);
        rows.iter_mut().for_each(|row| row.weight /= self.excess);
        rows.extend(self.floor_row(link));
        rows
    }

    pub(super) fn place(&self, kept: &Kept, sight: &Sight) -> Vector3<f64> {
        kept.pose.apply(&(sight.at + sight.ray * self.offsets_m[sight.frame]))
    }

    /// What the plane of the floor says of a surfel that is of it.
    fn floor_row(&self, link: &Link) -> Option<Row> {
        if !self.is_floor(link) {
            return None;
        }
        let at = link.surfel.at;
        let cells = (ALIKE * self.range_m / self.cube_m) * (ALIKE * self.range_m / self.cube_m);
        let weight = 1.0 / (self.uneven_m * self.uneven_m * cells);
        let mut row = [0.0; WIDTH];
        row[..3].copy_from_slice(&[1.0, at.x, at.y]);
        let off = self.plane.dot(&Vector3::new(1.0, at.x, at.y)) - at.z;
        Some(Row { first: self.unknowns - 3, len: 3, row, off, weight })
    }

    pub(super) fn is_floor(&self, link: &Link) -> bool {
        let surfel = &link.surfel;
        let height_m = surfel.at.z - self.plane.dot(&Vector3::new(1.0, surfel.at.x, surfel.at.y));
        self.has_floor
            && !self.is_exact
            && height_m.abs() < FLOOR * self.range_m
            && surfel.normal.z > LEVEL
    }
}

/// Takes weight from rows that are far from what the others say, in their standard deviations.
fn lighten(rows: &mut [Row], is_settled: bool) {
    let middle = crate::robust::median(rows.iter().map(|r| r.off).collect());
    let off = |row: &Row| (row.off - middle).abs() * row.weight.sqrt();
    // Of two that disagree, none is known to be right.
    let is_pair = rows.len() == 2;
    let apart = rows.iter().map(off).fold(0.0, f64::max);
    for row in &mut *rows {
        let deviations = if is_pair { apart } else { off(row) };
        if deviations > HUBER {
            let by = HUBER / deviations;
            row.weight *= if is_settled { by * by * by } else { by };
        }
    }
}
