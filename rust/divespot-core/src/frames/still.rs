//! Averages the frames of a camera that did not move; what moved through the view is left out.
//! Ranges in m.
//!
//! The frames are read twice, one at a time. First the frames vote for or against the range held by
//! each pixel, so that the surface seen by most of them remains (majority vote of Boyer and Moore
//! 1981). Then the ranges near it are summed, in integers.

use crate::parallel::fill_chunks;
use crate::robust::median;
use crate::thread_count;

use super::noise::NoiseTable;

/// The mean of frames.
#[derive(Debug, Clone, PartialEq)]
pub struct Averaged {
    /// Mean range of each pixel, in m; NaN if too few frames saw it.
    pub ranges_m: Vec<f32>,
    /// Typical standard deviation of a pixel between frames, in m.
    pub sigma_m: f64,
    /// Standard deviation of whole frames about their mean, in m.
    pub between_m: f64,
    /// Share of the valid pixels that were left out.
    pub left_out: f64,
}

/// Largest distance of a range from the one voted for on the same surface, in standard deviations
/// of a pixel: four, times √2 for a difference, times 1.5 for surfaces noisier than most. Chosen:
/// lower drops dark surfaces, higher mixes movers in.
const SAME: f64 = 4.0 * std::f64::consts::SQRT_2 * 1.5;
/// Least share of the frames in which a pixel saw its surface. Chosen: lower keeps what passed
/// through the view, higher loses dark surfaces.
const SEEN: f64 = 0.3;
/// Integer units of range in 1 m.
const PARTS: f64 = 65_536.0;
/// Pixels for a thread at a time. Decides no answer.
const CHUNK: usize = 1 << 13;
/// Approximate number of pixels whose deviation between frames is measured. Chosen: a frame's
/// offset, their median, is then known to 2 % of a pixel's noise (closed form: 1.25 / √4000).
const LOOKED_AT: usize = 4000;

/// A pixel of a camera that does not move.
#[derive(Debug, Clone, Copy, Default)]
struct Pixel {
    /// The range voted for, in m.
    anchor_m: f32,
    votes: u16,
    count: u16,
    valid: u16,
    /// Sum of ranges relative to the anchor, in integer units.
    sum: i32,
}

/// The frames so far of a camera that does not move.
#[derive(Debug)]
pub struct Still {
    pixels: Vec<Pixel>,
    noise: NoiseTable,
    threads: usize,
    frames: u32,
    /// Mean of each frame relative to the anchors, in m.
    offs_m: Vec<f64>,
    squares: Vec<f64>,
}

impl Still {
    /// Creates an empty average over this many pixels.
    #[must_use]
    pub fn new(pixels: usize, noise: NoiseTable, threads: usize) -> Self {
        Self {
            pixels: vec![Pixel::default(); pixels],
            noise,
            threads: thread_count(threads),
            frames: 0,
            offs_m: Vec::new(),
            squares: vec![0.0; pixels.div_ceil(stride(pixels))],
        }
    }

    /// First reading of a frame: the vote.
    pub fn vote(&mut self, ranges_m: &[f32]) {
        let noise = &self.noise;
        fill_chunks(&mut self.pixels, CHUNK, self.threads, |first, piece| {
            for (pixel, &range_m) in piece.iter_mut().zip(&ranges_m[first..]) {
                if !range_m.is_nan() {
                    pixel.vote(range_m, noise);
                }
            }
        });
    }

    /// Second reading of a frame, after the votes of all frames: the sum.
    pub fn add(&mut self, ranges_m: &[f32]) {
        let noise = &self.noise;
        self.frames += 1;
        fill_chunks(&mut self.pixels, CHUNK, self.threads, |first, piece| {
            for (pixel, &range_m) in piece.iter_mut().zip(&ranges_m[first..]) {
                if !range_m.is_nan() {
                    pixel.add(range_m, noise);
                }
            }
        });
        self.look_at(ranges_m);
    }

    /// Measures how far a frame, and some of its pixels, are off the anchors.
    fn look_at(&mut self, ranges_m: &[f32]) {
        let every = stride(self.pixels.len());
        let mut offs = Vec::with_capacity(self.squares.len());
        for (k, square) in self.squares.iter_mut().enumerate() {
            let pixel = &self.pixels[k * every];
            if let Some(off) = pixel.off(ranges_m[k * every], &self.noise) {
                *square += off * off;
                offs.push(off);
            }
        }
        self.offs_m.push(median(offs));
    }

    /// The mean.
    #[must_use]
    pub fn averaged(&self) -> Averaged {
        let least = (SEEN * f64::from(self.frames)).max(1.0);
        let mean = |pixel: &Pixel| {
            let is_enough = f64::from(pixel.count) >= least;
            if is_enough { (f64::from(pixel.anchor_m) + pixel.mean_m()) as f32 } else { f32::NAN }
        };
        let count = |part: fn(&Pixel) -> u16| self.pixels.iter().map(|p| u64::from(part(p))).sum();
        let (kept, valid): (u64, u64) = (count(|p| p.count), count(|p| p.valid));
        Averaged {
            ranges_m: self.pixels.iter().map(mean).collect(),
            sigma_m: self.sigma_m(),
            between_m: deviation(&self.offs_m),
            left_out: 1.0 - kept as f64 / valid.max(1) as f64,
        }
    }

    fn sigma_m(&self) -> f64 {
        let looked_at = self.pixels.iter().step_by(stride(self.pixels.len()));
        let own = looked_at.zip(&self.squares).filter(|(pixel, _)| pixel.count > 2);
        let variance = |(pixel, square): (&Pixel, &f64)| {
            let (count, mean) = (f64::from(pixel.count), pixel.mean_m());
            ((square - count * mean * mean) / (count - 1.0)).max(0.0)
        };
        median(own.map(variance).collect()).sqrt()
    }

    /// Memory used, in bytes.
    #[must_use]
    pub fn bytes(&self) -> usize {
        self.pixels.capacity() * size_of::<Pixel>() + self.squares.capacity() * size_of::<f64>()
    }
}

impl Pixel {
    fn vote(&mut self, range_m: f32, noise: &NoiseTable) {
        if self.votes == 0 {
            (self.anchor_m, self.votes) = (range_m, 1);
        } else if self.off(range_m, noise).is_some() {
            self.votes = self.votes.saturating_add(1);
        } else {
            self.votes -= 1;
        }
    }

    fn add(&mut self, range_m: f32, noise: &NoiseTable) {
        self.valid = self.valid.saturating_add(1);
        if let Some(off_m) = self.off(range_m, noise).filter(|_| self.count < u16::MAX) {
            self.sum += (off_m * PARTS).round() as i32;
            self.count += 1;
        }
    }

    /// A range relative to the anchor in m, if it is of the same surface.
    #[inline]
    fn off(&self, range_m: f32, noise: &NoiseTable) -> Option<f64> {
        let off_m = f64::from(range_m) - f64::from(self.anchor_m);
        (off_m.abs() <= SAME * noise.straight_m(self.anchor_m)).then_some(off_m)
    }

    fn mean_m(&self) -> f64 {
        f64::from(self.sum) / PARTS / f64::from(self.count.max(1))
    }
}

/// Every how many pixels one is measured.
fn stride(pixels: usize) -> usize {
    (pixels / LOOKED_AT).max(1)
}

fn deviation(values: &[f64]) -> f64 {
    let count = values.len();
    let mean = values.iter().sum::<f64>() / count.max(1) as f64;
    let square = values.iter().map(|v| (v - mean) * (v - mean)).sum::<f64>();
    (square / count.saturating_sub(1).max(1) as f64).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frames::noise::Noise;
    use crate::frames::noise::tests::normal;

    fn table() -> NoiseTable {
        NoiseTable::new(&Noise { at_metre_m: 0.001, power: 2.0, incidence: 0.0 })
    }

    fn averaged(frames: &[Vec<f32>], threads: usize) -> Averaged {
        let mut still = Still::new(frames[0].len(), table(), threads);
        frames.iter().for_each(|frame| still.vote(frame));
        frames.iter().for_each(|frame| still.add(frame));
        still.averaged()
    }

    #[test]
    fn noise_falls_with_the_root_of_the_frames_and_a_mover_leaves_no_trace() {
        let pixels = 5000;
        let frame = |f: usize| -> Vec<f32> {
            let range = |i: usize| {
                let covered = f < 10 && i / 500 == f % 10;
                let noise = 0.002 * normal((f * pixels + i) as u64);
                (if covered { 0.8 } else { 1.4 } + noise) as f32
            };
            (0..pixels).map(range).collect()
        };
        let frames: Vec<Vec<f32>> = (0..30).map(frame).collect();
        let found = averaged(&frames, 2);
        let square = |r: &f32| (f64::from(*r) - 1.4) * (f64::from(*r) - 1.4);
        let rms = (found.ranges_m.iter().map(square).sum::<f64>() / pixels as f64).sqrt();
        assert!(rms < 0.002 / 30_f64.sqrt() * 1.15, "{rms}");
        assert!((found.left_out - 1.0 / 30.0).abs() < 0.004, "{}", found.left_out);
        assert!((found.sigma_m / 0.002 - 1.0).abs() < 0.1);
        assert!(found.between_m < 2e-4);
        assert_eq!(averaged(&frames, 1), found);
        let turned: Vec<Vec<f32>> = frames.into_iter().rev().collect();
        let other = averaged(&turned, 1);
        let apart = |(a, b): (&f32, &f32)| f64::from((a - b).abs());
        assert!(other.ranges_m.iter().zip(&found.ranges_m).map(apart).fold(0.0, f64::max) < 1e-3);
    }

    #[test]
    fn a_pixel_that_sees_nothing_has_no_range() {
        let frames: Vec<Vec<f32>> =
            (0..4).map(|f| vec![f32::NAN, if f > 0 { f32::NAN } else { 1.0 }, 1.0]).collect();
        let found = averaged(&frames, 1);
        assert!(found.ranges_m[0].is_nan() && found.ranges_m[1].is_nan());
        assert_eq!(found.ranges_m[2], 1.0);
    }
}
