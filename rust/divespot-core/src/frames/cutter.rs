//! Fits patches to frames, with the camera's noise estimated from the first frame.

use super::camera::Camera;
use super::edges::usable_pixels;
use super::noise::{Noise, NoiseTable};
use super::patches::{Patch, patches};

/// Fewest patches of a usable frame: ten for each of six unknowns. Chosen: with fewer, noise of
/// single patches moves the frame; more lose frames that see little.
pub(crate) const FEWEST: usize = 60;

/// Fits patches to frames.
#[derive(Debug)]
pub struct Cutter {
    noise: Option<Noise>,
    table: NoiseTable,
    threads: usize,
}

impl Cutter {
    /// Creates a cutter; `noise` is estimated from the first frame if it is not given.
    #[must_use]
    pub fn new(noise: Option<Noise>, threads: usize) -> Self {
        let table = NoiseTable::new(&noise.unwrap_or_default());
        Self { noise, table, threads: crate::thread_count(threads) }
    }

    /// The noise of the camera.
    #[must_use]
    pub fn noise(&self) -> Noise {
        self.noise.unwrap_or_default()
    }

    /// The patches of a frame.
    pub fn cut(&mut self, camera: &Camera, ranges_m: &[f32]) -> Vec<Patch> {
        let found = cut(camera, ranges_m, &self.table, self.threads);
        if self.noise.is_some() {
            return found;
        }
        let noise = Noise::of(camera, ranges_m, &found);
        let table = NoiseTable::new(&noise);
        let found = cut(camera, ranges_m, &table, self.threads);
        if found.len() >= FEWEST {
            (self.noise, self.table) = (Some(noise), table);
        }
        found
    }
}

fn cut(camera: &Camera, ranges_m: &[f32], noise: &NoiseTable, threads: usize) -> Vec<Patch> {
    let usable = usable_pixels(camera, ranges_m, noise, threads);
    patches(camera, ranges_m, &usable, threads)
}
