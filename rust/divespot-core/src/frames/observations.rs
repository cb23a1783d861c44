//! The observations of a surfel's height, by frames and by the floor's plane, for the joint
//! solution.

use nalgebra::Vector3;

use super::keyframe::Keyframe;
use super::links::{Link, Sight};
use super::normal_equations::{Row, WIDTH};
use super::state::{ALIKE, State};

/// Residuals of more standard deviations lose weight. Chosen: of normal errors 1 in 370; lower
/// wastes sound observations, higher lets wrong links pull.
const HUBER: f64 = 3.0;
/// Largest distance of a floor's surfel from its plane, as a share of the range, and least cosine
/// of its angle to it: 10°. Chosen: lower loses uneven floors, higher flattens the toes of piles.
const FLOOR: f64 = 0.015;
pub(super) const LEVEL: f64 = 0.985;

impl State {
    /// Writes the observations of a surfel's height along its normal to `rows`, replacing its
    /// content.
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

    /// The place and the ray of an observation, in the scan's coordinates.
    #[inline]
    pub(super) fn place(&self, kept: &Keyframe, sight: &Sight) -> (Vector3<f64>, Vector3<f64>) {
        let (at, ray) = sight.at(self.offsets_m[sight.frame()]);
        (kept.pose.apply(&at), kept.pose.rotation * ray)
    }

    #[inline]
    pub(super) fn weight(&self, sight: &Sight) -> f64 {
        1.0 / (sight.noise_m2() + self.unexplained_m * self.unexplained_m)
    }

    /// The observation by the floor's plane, if the surfel belongs to the floor.
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

    /// Whether a surfel is level and near the floor's plane.
    pub(super) fn is_level(&self, link: Link<'_>) -> bool {
        let surfel = link.surfel;
        let height_m = surfel.at.z - self.plane.dot(&Vector3::new(1.0, surfel.at.x, surfel.at.y));
        height_m.abs() < FLOOR * self.range_m && surfel.normal.z > LEVEL
    }
}

/// Reduces the weight of rows that deviate from the others, in standard deviations.
fn lighten(rows: &mut [Row], is_settled: bool) {
    let middle = crate::robust::median(rows.iter().map(|r| r.off).collect());
    let off = |row: &Row| (row.off - middle).abs() * row.weight.sqrt();
    // Of two that disagree, neither is known to be right.
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
