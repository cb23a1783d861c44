//! Where the pixels of a depth camera look.

use nalgebra::Vector3;

use crate::{Error, Point, Result};

/// The rays of a camera's pixels, row by row.
#[derive(Debug, Clone)]
pub struct Camera {
    /// Rows of pixels.
    pub rows: usize,
    /// Columns of pixels.
    pub columns: usize,
    /// Unit vectors: x right, y down, z ahead. Not finite where a pixel sees nothing.
    pub(crate) rays: Vec<Vector3<f64>>,
    /// Angle between the rays of a pixel and of its right, or else its lower, neighbour.
    pub(crate) pitch: Vec<f64>,
}

impl Camera {
    /// A camera with one ray a pixel.
    ///
    /// # Errors
    ///
    /// [`Error::Degenerate`] unless there are `rows * columns` rays, three each way at least.
    pub fn new(rows: usize, columns: usize, rays: &[Point]) -> Result<Self> {
        if rows < 3 || columns < 3 || rays.len() != rows * columns {
            return Err(Error::Degenerate(
                "a camera needs 3 x 3 pixels or more, and a ray for each",
            ));
        }
        let rays: Vec<Vector3<f64>> = rays.iter().map(|&r| Vector3::from(r)).collect();
        let pitch = |i: usize| {
            let beside = if (i + 1).is_multiple_of(columns) { i - 1 } else { i + 1 };
            let below = if i + columns < rays.len() { i + columns } else { i - columns };
            distance(&rays[i], &rays[beside]).max(distance(&rays[i], &rays[below]))
        };
        let pitch = (0..rays.len()).map(pitch).collect();
        Ok(Self { rows, columns, rays, pitch })
    }

    /// The number of pixels.
    #[must_use]
    pub fn pixels(&self) -> usize {
        self.rays.len()
    }

    /// Edge in pixels of a patch: about 5,000 of them make up a frame.
    pub(crate) fn block(&self) -> usize {
        let per = self.pixels() as f64 / PATCHES;
        (per.sqrt().round() as usize).clamp(2, 16)
    }
}

/// Patches of a frame, about: enough to fix six unknowns to a small part of a pixel's noise, and
/// few enough for ten frames a second.
const PATCHES: f64 = 5000.0;

fn distance(a: &Vector3<f64>, b: &Vector3<f64>) -> f64 {
    let d = a - b;
    d.dot(&d).sqrt()
}
