//! The rays of a depth camera's pixels, and the blocks of pixels that patches are fitted in.

use nalgebra::Vector3;

use crate::{Error, Point, Result};

/// The rays of a camera's pixels, row by row, and its blocks of pixels.
#[derive(Debug, Clone)]
pub struct Camera {
    /// Rows of pixels.
    pub rows: usize,
    /// Columns of pixels.
    pub columns: usize,
    /// Unit vectors: x right, y down, z forward. Not finite for pixels that are not used.
    pub(crate) rays: Vec<[f32; 3]>,
    /// Angle between the rays of a pixel and its right (or else lower) neighbour, in radians.
    pub(crate) pitch: Vec<f32>,
    /// Width of a block in pixels; a frame has about 5,000 blocks.
    pub(crate) block: usize,
    /// The axes of the blocks, row by row.
    pub(crate) blocks: Vec<Axes>,
    /// The ray of each pixel in the axes of its block: right and down relative to forward; forward.
    pub(crate) plan: Vec<[f32; 3]>,
}

/// The axes of a block of pixels: right, down, and forward, the ray in its middle.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Axes {
    pub(crate) across: Vector3<f64>,
    pub(crate) down: Vector3<f64>,
    pub(crate) ahead: Vector3<f64>,
}

/// Approximate number of patches of a frame. Chosen: they fix six unknowns to a small part of a
/// pixel's noise, at ten frames a second; fewer blur edges, more take time in proportion.
const PATCHES: f64 = 5000.0;

impl Camera {
    /// A camera with one ray for each pixel.
    ///
    /// # Errors
    ///
    /// [`Error::Degenerate`] unless there are `rows * columns` rays, and at least three rows and
    /// columns.
    pub fn new(rows: usize, columns: usize, rays: &[Point]) -> Result<Self> {
        if rows < 3 || columns < 3 || rays.len() != rows * columns {
            return Err(Error::Degenerate(
                "the camera has too few pixels or rays: 3 x 3 pixels or more, and a ray for each, \
                 are needed",
            ));
        }
        let exact: Vec<Vector3<f64>> = rays.iter().map(|&r| Vector3::from(r)).collect();
        let block = ((rays.len() as f64 / PATCHES).sqrt().round() as usize).clamp(2, 16);
        let mut camera = Self {
            rows,
            columns,
            rays: rays.iter().map(|ray| ray.map(|v| v as f32)).collect(),
            pitch: (0..rays.len()).map(|i| pitch(&exact, columns, i)).collect(),
            block,
            blocks: Vec::new(),
            plan: vec![[0.0; 3]; rays.len()],
        };
        camera.set_blocks(&exact);
        Ok(camera)
    }

    /// The number of pixels.
    #[must_use]
    pub fn pixels(&self) -> usize {
        self.rays.len()
    }

    /// Blocks in a row of blocks, and number of such rows.
    pub(crate) fn in_blocks(&self) -> (usize, usize) {
        (self.columns / self.block, self.rows / self.block)
    }

    fn set_blocks(&mut self, rays: &[Vector3<f64>]) {
        let (across, down) = self.in_blocks();
        for number in 0..across * down {
            let corner = (number / across * self.columns + number % across) * self.block;
            let axes = Axes::about(&rays[corner + self.block / 2 * (self.columns + 1)]);
            for k in 0..self.block * self.block {
                let pixel = corner + k / self.block * self.columns + k % self.block;
                self.plan[pixel] = axes.parts(&rays[pixel]).map(|v| v as f32);
            }
            self.blocks.push(axes);
        }
    }
}

impl Axes {
    fn about(ahead: &Vector3<f64>) -> Self {
        let aside = if ahead.x.abs() < 0.9 { Vector3::x() } else { Vector3::y() };
        let across = ahead.cross(&aside).normalize();
        Self { across, down: ahead.cross(&across), ahead: *ahead }
    }

    fn parts(&self, ray: &Vector3<f64>) -> [f64; 3] {
        let ahead = ray.dot(&self.ahead);
        [ray.dot(&self.across) / ahead, ray.dot(&self.down) / ahead, ahead]
    }

    /// The vector with these components.
    #[inline]
    pub(crate) fn joined(&self, across: f64, down: f64, ahead: f64) -> Vector3<f64> {
        self.across * across + self.down * down + self.ahead * ahead
    }
}

fn pitch(rays: &[Vector3<f64>], columns: usize, i: usize) -> f32 {
    let beside = if (i + 1).is_multiple_of(columns) { i - 1 } else { i + 1 };
    let below = if i + columns < rays.len() { i + columns } else { i - columns };
    let away = |other: usize| {
        let d = rays[i] - rays[other];
        d.dot(&d).sqrt()
    };
    away(beside).max(away(below)) as f32
}
