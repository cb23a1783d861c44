//! The base surface of an object: a smooth surface fitted to the annulus of ground around it, in m.
//!
//! Method: a robust plane (Tukey's biweight, iteratively reweighted least squares) over twelve
//! sectors of equal weight, a breakline under the object if the ground shows one (`breakline`), and
//! block kriging of its undulations (`kriging`). A surface that was given takes their place.

use std::sync::Arc;

use nalgebra::Vector3;

use super::bank::Bank;
use super::breakline::Breakline;
use super::kriging::{Footprint, Kriging};
use super::nodes::Nodes;
use super::sectors::Sectors;
use super::surface::Surface;
use crate::count::to_f64;
use crate::harmonic::Harmonic;
use crate::heightmap::Grid;
use crate::hypotenuse::Hypotenuse;
use crate::near_plane::{value, weighted_plane};
use crate::robust::{median, scale};

/// The fewest cells for a plane: four for each of its three parameters.
pub(crate) const FEWEST: usize = 12;
/// With this many of the twelve sectors unseen in a row (half a turn) the annulus does not enclose
/// the object. Its tilt would be extrapolated, and the tilt of the whole ground is used instead.
const ONE_SIDE: usize = 6;
/// The levels of neighbouring sectors are correlated: this many count as one independent value.
/// Chosen on the scenes of `divespot evaluate`.
const CORRELATED: f64 = 3.0;
/// Cut-off of Tukey's biweight, in standard deviations: 95 % efficiency for normal noise (Holland
/// and Welsch 1977, Commun. Stat. A 6:813).
const REACH: f64 = 4.685;
/// Iterations of the reweighting. It converges in about five.
const ROUNDS: usize = 10;

/// A base surface and its uncertainty: a plane `level_m + tilt · (p - center)`, a breakline under
/// the object, and an interpolated surface of the undulations above both; or a surface that was
/// given.
#[derive(Debug, Clone, PartialEq)]
pub struct Base {
    /// The place in plan where the height is `level_m`, in m.
    pub center_m: [f64; 2],
    /// Height at the centre, in m.
    pub level_m: f64,
    /// Slope along x and y, as rise over run.
    pub tilt: [f64; 2],
    /// Standard deviation of the ground cells about the base, in m.
    pub noise_m: f64,
    /// Standard uncertainty of the mean height below the object, in m.
    pub u_level_m: f64,
    /// What the base is fitted to.
    pub kind: Kind,
    breakline: Option<Breakline>,
    /// Scatter of the ground around the object about the plane, in m: of its cells or of its
    /// sectors, whichever is larger.
    wander_m: f64,
    harmonic: Option<Harmonic>,
    surface: Option<Arc<Surface>>,
    bank: Option<Arc<Bank>>,
}

/// What a base is fitted to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// The annulus of ground around the object.
    Annulus,
    /// The level of the annulus and the tilt of the whole ground: half or more of the annulus was
    /// unseen.
    AnnulusLevel,
    /// The height of the ground in the whole scan, or another surface meant to be the ground.
    Ground,
    /// A height that was given, whatever the ground around the object is like.
    Given,
}

impl Base {
    /// A level base, the same for every object.
    #[must_use]
    pub fn ground(level_m: f64, noise_m: f64, u_level_m: f64) -> Self {
        Self::plane(level_m, [0.0; 2], noise_m, u_level_m, Kind::Ground)
    }

    /// A plane of height `level_m` at (0, 0), the same for every object.
    #[must_use]
    pub fn plane(level_m: f64, tilt: [f64; 2], noise_m: f64, u_level_m: f64, kind: Kind) -> Self {
        Self {
            center_m: [0.0; 2],
            level_m,
            tilt,
            noise_m,
            u_level_m,
            kind,
            breakline: None,
            wander_m: noise_m,
            harmonic: None,
            surface: None,
            bank: None,
        }
    }

    /// A base on a surface that was given; `noise_m` is the noise of the scan that is measured
    /// above it.
    #[must_use]
    pub fn on(surface: Surface, noise_m: f64) -> Self {
        let noise_m = noise_m.hypotenuse(surface.noise_m);
        let level = Self::ground(0.0, noise_m, 0.0);
        Self { surface: Some(Arc::new(surface)), ..level }
    }

    /// The same base at height 0, for heights above it with this noise.
    pub(crate) fn flattened(&self, noise_m: f64) -> Self {
        match &self.surface {
            Some(surface) => Self::on(surface.flattened(), noise_m),
            None => Self::plane(0.0, [0.0; 2], noise_m, noise_m, self.kind),
        }
    }

    /// Height of the base at a place in plan, in m.
    #[must_use]
    pub fn at(&self, p: [f64; 2]) -> f64 {
        let surface = self.surface.as_ref().map_or(0.0, |surface| surface.at(p));
        let ground = self.plane_at(p)
            + self.harmonic.as_ref().map_or(0.0, |harmonic| harmonic.at(p))
            + surface;
        self.bank.as_ref().map_or(ground, |bank| ground.max(bank.at(p)))
    }

    /// The base with banks that continue below an object.
    pub(super) fn with_bank(self, bank: Option<Arc<Bank>>) -> Self {
        Self { bank, ..self }
    }

    /// Whether the base is a surface that was given.
    pub(super) fn is_surface(&self) -> bool {
        self.surface.is_some()
    }

    /// Whether the base was seen or given at this place.
    #[must_use]
    pub fn is_known(&self, p: [f64; 2]) -> bool {
        self.surface.as_ref().is_none_or(|surface| surface.is_known(p))
    }

    /// Standard uncertainty of the base at an unseen place, in m, in addition to that of its level.
    pub(crate) fn u_unknown_m(&self, p: [f64; 2]) -> f64 {
        let u_bank_m = self.bank.as_ref().map_or(0.0, |bank| bank.u_m(p));
        self.surface.as_ref().map_or(u_bank_m, |surface| surface.u_unknown_m(p))
    }

    /// The base for one object. If it is the ground of the whole scan, its level is at least as
    /// uncertain as the ground around this object deviates from it.
    pub(crate) fn held_against(self, center_m: [f64; 2], annulus: &[[f64; 3]]) -> Self {
        if self.kind != Kind::Ground || annulus.len() < FEWEST {
            return self;
        }
        let local = about(center_m, annulus);
        let off: Vec<f64> = annulus.iter().map(|p| p[2] - self.at([p[0], p[1]])).collect();
        let levels = Sectors::of(&local).medians(&off).iter().map(|level| level.abs()).collect();
        Self { u_level_m: self.u_level_m.max(median(levels)), ..self }
    }

    fn plane_at(&self, [x, y]: [f64; 2]) -> f64 {
        let [cx, cy] = self.center_m;
        let breakline = self.breakline.map_or(0.0, |breakline| breakline.at(x - cx, y - cy));
        self.level_m + self.tilt[0] * (x - cx) + self.tilt[1] * (y - cy) + breakline
    }

    /// Adds the harmonic interpolation over `window` of how the annulus deviates from the plane.
    /// Outliers are left out.
    pub(crate) fn with_harmonic(mut self, window: &Grid, annulus: &[[f64; 3]]) -> Self {
        let off = |p: &[f64; 3]| [p[0], p[1], p[2] - self.plane_at([p[0], p[1]])];
        let stray = REACH * self.wander_m;
        let left: Vec<_> = annulus.iter().map(off).filter(|p| p[2].abs() <= stray).collect();
        let size = [window.columns, window.rows].map(|n| n as f64 * window.cell_m);
        self.harmonic =
            Some(Harmonic::stretched(window.origin_m, size, window.cell_m, left.into_iter()));
        self
    }

    /// The base under a footprint, from block kriging of the `ground` around it.
    pub(crate) fn with_kriging(self, ground: &[[f64; 3]], footprint: &Footprint) -> Self {
        let off_line = |p| off_breakline(self.breakline, relative_to(self.center_m, p));
        let nodes = Nodes::of(ground.iter().map(off_line));
        let points = nodes.points();
        let sectors = Sectors::of(&points);
        let Some(plane) = robust_plane(&points, &sectors, self.kind) else { return self };
        let off = residuals(&points, &plane);
        let reach = REACH * wander(&off, &sectors);
        let nodes = nodes.kept(|i| off[i].abs() <= reach);
        let line = self.breakline.map(|breakline| breakline.line);
        let waves = Kriging::new(&nodes, footprint, self.kind == Kind::Annulus, line);
        let Some(expected) = waves.expected() else { return self };
        let base = Self {
            level_m: expected.level_m,
            tilt: expected.tilt,
            breakline: self.breakline.map(|breakline| breakline.raised(expected.rises)),
            u_level_m: expected.u_mean_m,
            harmonic: Some(expected.harmonic.moved(self.center_m)),
            ..self
        };
        // The noise is what the kriging does not explain.
        let off = ground.iter().map(|p| p[2] - base.at([p[0], p[1]]));
        Self { noise_m: scale(off).min(base.noise_m), ..base }
    }

    /// The plane through the cells `annulus` (x, y, height) of width `cell_m`, with the
    /// breakline that it shows; outliers have no weight. Kriging is not part of it yet.
    ///
    /// `None` where the annulus has too few cells.
    pub(crate) fn around(center_m: [f64; 2], annulus: &[[f64; 3]], cell_m: f64) -> Option<Self> {
        if annulus.len() < FEWEST {
            return None;
        }
        let local = about(center_m, annulus);
        let sectors = Sectors::of(&local);
        let kind = if sectors.widest_gap() < ONE_SIDE { Kind::Annulus } else { Kind::AnnulusLevel };
        let breakline = if kind == Kind::Annulus { Breakline::found(&local, cell_m) } else { None };
        let local: Vec<_> = local.into_iter().map(|p| off_breakline(breakline, p)).collect();
        let plane = robust_plane(&local, &sectors, kind)?;
        let mut off = residuals(&local, &plane);
        let noise_m = scale(off.iter().copied());
        let wander_m = wander(&off, &sectors);
        let ground = |&off: &f64| if off.abs() <= REACH * wander_m { off } else { f64::NAN };
        off = off.iter().map(ground).collect();
        let levels = sectors.medians(&off);
        let spread = (levels.iter().map(|m| m * m).sum::<f64>() / to_f64(levels.len())).sqrt();
        Some(Self {
            center_m,
            level_m: plane[0],
            tilt: [plane[1], plane[2]],
            noise_m,
            u_level_m: spread / (to_f64(levels.len()) / CORRELATED).sqrt(),
            kind,
            breakline,
            wander_m,
            harmonic: None,
            surface: None,
            bank: None,
        })
    }
}

/// The cells, in plan relative to a centre.
fn about(center_m: [f64; 2], cells: &[[f64; 3]]) -> Vec<[f64; 3]> {
    cells.iter().map(|p| relative_to(center_m, p)).collect()
}

fn relative_to(center_m: [f64; 2], p: &[f64; 3]) -> [f64; 3] {
    [p[0] - center_m[0], p[1] - center_m[1], p[2]]
}

/// A cell with its height relative to the breakline, if there is one.
fn off_breakline(breakline: Option<Breakline>, [x, y, z]: [f64; 3]) -> [f64; 3] {
    [x, y, breakline.map_or(z, |breakline| z - breakline.at(x, y))]
}

fn residuals(local: &[[f64; 3]], plane: &Vector3<f64>) -> Vec<f64> {
    local.iter().map(|p| p[2] - value(plane, p)).collect()
}

/// Level and tilt by iteratively reweighted least squares (Tukey's biweight), from the median on.
fn robust_plane(local: &[[f64; 3]], sectors: &Sectors, kind: Kind) -> Option<Vector3<f64>> {
    let mut plane = Vector3::new(median(local.iter().map(|p| p[2]).collect()), 0.0, 0.0);
    let even = sectors.even_weights(local.len());
    for _ in 0..ROUNDS {
        let off = residuals(local, &plane);
        let reach = REACH * wander(&off, sectors).max(f64::MIN_POSITIVE);
        let weigh = |r: &f64| (1.0 - (r / reach).powi(2)).max(0.0).powi(2);
        let weights = off.iter().zip(&even).map(|(r, even)| even * weigh(r));
        plane = weighted_plane(local, weights, kind == Kind::Annulus)?;
    }
    Some(plane)
}

/// Scatter of the ground about a plane, in m: of the cells, or of whole sectors' levels where that
/// is larger. So a sector that lies lower than the others counts as ground, not as outliers.
fn wander(off: &[f64], sectors: &Sectors) -> f64 {
    scale(off.iter().copied()).max(scale(sectors.medians(off)))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn annulus(height: impl Fn(f64, f64) -> f64) -> Vec<[f64; 3]> {
        let at = |i: i32| (f64::from(i) * 0.1, 2.0 + f64::from(i % 5) * 0.05);
        let on = |(angle, r): (f64, f64)| (5.0 + r * angle.cos(), 7.0 + r * angle.sin());
        (0..63 * 5).map(at).map(on).map(|(x, y)| [x, y, height(x, y)]).collect()
    }

    #[test]
    fn a_sloping_floor_with_debris_is_found() {
        let mut cells = annulus(|x, y| 0.5 + 0.03 * x - 0.01 * y);
        cells.iter_mut().step_by(4).for_each(|c| c[2] += 0.4);
        let base = Base::around([5.0, 7.0], &cells, 0.1).unwrap();
        assert!((base.at([5.0, 7.0]) - 0.58).abs() < 1e-9, "{base:?}");
        assert!((base.at([6.0, 9.0]) - (0.5 + 0.18 - 0.09)).abs() < 1e-9);
        assert_eq!(base.kind, Kind::Annulus);
    }

    #[test]
    fn a_ring_seen_on_one_side_keeps_the_grounds_tilt() {
        let cells: Vec<_> = annulus(|_, _| 0.25).into_iter().filter(|p| p[0] > 6.0).collect();
        let base = Base::around([5.0, 7.0], &cells, 0.1).unwrap();
        assert_eq!((base.kind, base.tilt, base.level_m), (Kind::AnnulusLevel, [0.0; 2], 0.25));
        assert_eq!(Base::around([5.0, 7.0], &cells[..5], 0.1), None);
    }

    #[test]
    fn fewer_than_twelve_cells_carry_no_plane() {
        let cells = annulus(|x, _| 0.1 * x);
        let carried = |count: usize| Base::around([5.0, 7.0], &cells[..count], 0.1).is_some();
        assert!(carried(13) && !carried(11));
    }

    #[test]
    fn three_sectors_in_a_row_waver_as_one() {
        let sector =
            |x: f64, y: f64| ((y - 7.0).atan2(x - 5.0) * 6.0 / std::f64::consts::PI).floor();
        let cells = annulus(|x, y| if sector(x, y) as i32 % 2 == 0 { 0.01 } else { -0.01 });
        let base = Base::around([5.0, 7.0], &cells, 0.1).unwrap();
        // Twelve of them as four that are independent.
        assert!((base.u_level_m / (0.01 / 2.0) - 1.0).abs() < 0.1, "{base:?}");
    }

    #[test]
    fn cells_count_less_the_further_they_are_off_and_nothing_from_4_685_deviations_on() {
        let level_m = |off_m: f64| {
            let mut cells = annulus(|_, _| 0.0);
            for (i, cell) in cells.iter_mut().enumerate() {
                let stray = i % 20 == 0 || i % 20 == 11;
                cell[2] = if stray { off_m } else { 0.01 - 0.02 * (i % 2) as f64 };
            }
            Base::around([5.0, 7.0], &cells, 0.1).unwrap().at([5.0, 7.0])
        };
        // Of what is 0.05 off, until that settles.
        let settled_m = (0..50).fold(0.0_f64, |level_m, _| {
            let reach_m = 4.685 * 1.4826 * (0.01 + level_m);
            let weight = |off_m: f64| (1.0 - ((off_m - level_m) / reach_m).powi(2)).powi(2);
            let all = [(0.1, 0.05), (0.45, 0.01), (0.45, -0.01)];
            let sum = |of: &dyn Fn(f64) -> f64| all.iter().map(|(n, z)| n * of(*z)).sum::<f64>();
            sum(&|z| weight(z) * z) / sum(&weight)
        });
        assert!((level_m(0.05) / settled_m - 1.0).abs() < 0.15, "{} {settled_m}", level_m(0.05));
        assert!(level_m(0.08).abs() < 1e-4, "{}", level_m(0.08));
    }
}
