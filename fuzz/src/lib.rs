//! What the kernels of divespot-core are given by a fuzzer.
//!
//! Each module is a target: an input that is decoded from bytes, and what is called with it. Points
//! reach the kernels as they do from Python, through [`Cloud`]; what they need beside is asserted
//! here, so that a wrong answer counts as a crash too.

pub mod clustering;
pub mod heights;
pub mod maps;
pub mod outlines;
pub mod piles;
pub mod plane;
pub mod points;
pub mod surface;

use arbitrary::Arbitrary;
use divespot_core::heightmap::Grid;
use divespot_core::{Cloud, Point};

/// Points of one input, at most.
pub const MOST_POINTS: usize = 400;
/// Beyond this the binding refuses a cloud.
pub const LARGEST_EXTENT: f64 = 1e9;

/// A number as inputs hold them: mostly on a coarse grid, so that points coincide and line up, and
/// sometimes any bits.
#[derive(Debug, Clone, Copy, Arbitrary)]
pub enum Number {
    Grid(i8),
    Fine(i16),
    Any(f64),
    Nothing,
}

impl Number {
    #[must_use]
    pub fn value(self) -> f64 {
        match self {
            Self::Grid(n) => f64::from(n) / 8.0,
            Self::Fine(n) => f64::from(n) / 4096.0,
            Self::Any(v) => v,
            Self::Nothing => f64::NAN,
        }
    }

    /// The same, finite and not far off.
    #[must_use]
    pub fn near(self) -> f64 {
        let value = self.value();
        if value.is_finite() { value.clamp(-1e6, 1e6) } else { 0.0 }
    }
}

/// Points as Python gives them.
#[derive(Debug, Clone, Arbitrary)]
pub struct Points(Vec<[Number; 3]>);

impl Points {
    /// The finite ones near their origin; `None` where the binding refuses them.
    #[must_use]
    pub fn cloud(&self) -> Option<Cloud> {
        let rows = &self.0[..self.0.len().min(MOST_POINTS)];
        let cloud = Cloud::new(rows.len(), 1, |i| rows[i].map(Number::value));
        cloud.extent_m.iter().all(|extent| *extent <= LARGEST_EXTENT).then_some(cloud)
    }
}

/// Points of a surface over a raster, as height maps come from.
#[derive(Debug, Clone, Arbitrary)]
pub struct Relief {
    columns: u8,
    heights: Vec<Number>,
}

impl Relief {
    #[must_use]
    pub fn columns(&self) -> usize {
        usize::from(self.columns % 24).max(1)
    }

    /// Heights of whole rows, NaN where nothing was seen.
    #[must_use]
    pub fn heights_m(&self) -> Vec<f64> {
        let height = |number: &Number| match number.value() {
            v if v.is_infinite() => f64::NAN,
            v => v.clamp(-1e6, 1e6),
        };
        let whole = self.heights.len().min(MOST_POINTS) / self.columns() * self.columns();
        self.heights[..whole].iter().map(height).collect()
    }

    /// The same over a grid; `None` where there is no row.
    #[must_use]
    pub fn map(&self) -> Option<(Grid, Vec<f64>)> {
        let (columns, heights_m) = (self.columns(), self.heights_m());
        let rows = heights_m.len() / columns;
        let grid = Grid { origin_m: [0.0; 2], cell_m: 0.125, columns, rows };
        (rows > 0).then_some((grid, heights_m))
    }

    #[must_use]
    pub fn points(&self) -> Vec<Point> {
        let at =
            |cell: usize| [cell % self.columns(), cell / self.columns()].map(|n| n as f64 / 8.0);
        let heights = self.heights_m();
        let seen = heights.iter().enumerate().filter(|(_, h)| !h.is_nan());
        seen.map(|(cell, h)| [at(cell)[0], at(cell)[1], *h]).collect()
    }
}
