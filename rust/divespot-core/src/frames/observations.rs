//! What frames, and the floor's plane, say of the height of a surfel.

use nalgebra::Vector3;

use super::keyframe::Keyframe;
use super::links::{Link, Sight};
use super::normal_equations::{Row, WIDTH};
use super::state::{ALIKE, State};

/// A residual of more standard deviations counts less.
const HUBER: f64 = 3.0;
/// The floor is within this part of the range of its plane, and so many degrees (cosine) of it.
const FLOOR: f64 = 0.015;
pub(super) const LEVEL: f64 = 0.985;

impl State {
    /// What is known of the height of a surfel, along its normal, instead of what `rows` held.
    pub(super) fn rows(
        &self,
        frames: &[Option<Keyframe>],
        middles: &[Vector3<f64>],
        link: Link<'_>,
        rows: &mut Vec<Row>,
    ) {
        let n = link.surfel.normal;
        rows.clear();
        for sight in link.sights {
            let number = sight.frame();
            let (Some(kept), Some(first)) = (&frames[number], self.places[number]) else {
                continue;
            };
            let (at, ray) = self.place(kept, sight);
            let turn = (at - middles[number]).cross(&n);
            let row = [turn.x, turn.y, turn.z, n.x, n.y, n.z, n.dot(&ray)];
            let off = n.dot(&(at - link.surfel.at));
            rows.push(Row { first, len: WIDTH, row, off, weight: self.weight(sight) });
        }
        lighten(rows, self.is_settled);
        rows.iter_mut().for_each(|row| row.weight /= self.excess);
        rows.extend(self.floor_row(link));
    }

    /// Where a sight is, and along which ray.
    #[inline]
    pub(super) fn place(&self, kept: &Keyframe, sight: &Sight) -> (Vector3<f64>, Vector3<f64>) {
        let (at, ray) = sight.at(self.offsets_m[sight.frame()]);
        (kept.pose.apply(&at), kept.pose.rotation * ray)
    }

    #[inline]
    pub(super) fn weight(&self, sight: &Sight) -> f64 {
        1.0 / (sight.noise_m2() + self.unexplained_m * self.unexplained_m)
    }

    /// What the plane of the floor says of a surfel that is of it.
    fn floor_row(&self, link: Link<'_>) -> Option<Row> {
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

    pub(super) fn is_floor(&self, link: Link<'_>) -> bool {
        self.has_floor && !self.is_exact && self.is_level(link)
    }

    /// Whether a surfel is level, and near the floor's plane.
    pub(super) fn is_level(&self, link: Link<'_>) -> bool {
        let surfel = link.surfel;
        let height_m = surfel.at.z - self.plane.dot(&Vector3::new(1.0, surfel.at.x, surfel.at.y));
        height_m.abs() < FLOOR * self.range_m && surfel.normal.z > LEVEL
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
