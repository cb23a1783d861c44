//! Frames of a camera that did not move, averaged; what moved through the view is left out.

use crate::parallel::map_chunks;
use crate::robust::{median, median_in, scale};
use crate::thread_count;

/// The mean of frames.
#[derive(Debug, Clone, PartialEq)]
pub struct Averaged {
    /// Mean range of each pixel; NaN where too few frames saw it.
    pub ranges_m: Vec<f64>,
    /// Frames in each mean.
    pub counts: Vec<u32>,
    /// Typical standard deviation of a pixel from frame to frame.
    pub sigma_m: f64,
    /// Standard deviation of whole frames about their mean.
    pub between_m: f64,
    /// Share of the valid pixels that were left out.
    pub left_out: f64,
}

/// Ranges within so many standard deviations of the median are of the same surface.
const SAME: f64 = 4.0;
/// Least share of the frames in which a pixel must have seen its surface.
const SEEN: f64 = 0.3;
/// The deviation of a pixel is at least this part of the typical one, as of few frames.
const TYPICAL: f64 = 0.7;
/// Pixels that a thread takes at a time.
const CHUNK: usize = 1 << 12;

/// The mean range of each pixel over frames; none of their pixels is kept that a mover covered.
///
/// `frame(f, i)` is the range of pixel `i` in frame `f`.
#[must_use]
pub fn averaged(
    frames: usize,
    pixels: usize,
    frame: impl Fn(usize, usize) -> f64 + Sync,
    threads: usize,
) -> Averaged {
    let threads = thread_count(threads);
    let typical_m = typical(frames, pixels, &frame);
    let parts = map_chunks(pixels, CHUNK, threads, |range| {
        range.map(|i| mean(frames, |f| frame(f, i), typical_m)).collect::<Vec<_>>()
    });
    let means: Vec<Mean> = parts.into_iter().flatten().collect();
    let (valid, kept) =
        means.iter().fold((0, 0), |(valid, kept), m| (valid + m.valid, kept + m.kept));
    Averaged {
        ranges_m: means.iter().map(|m| m.range_m).collect(),
        counts: means.iter().map(|m| m.kept).collect(),
        sigma_m: typical_m,
        between_m: between(frames, &means, &frame),
        left_out: 1.0 - f64::from(kept) / f64::from(valid.max(1)),
    }
}

struct Mean {
    range_m: f64,
    valid: u32,
    kept: u32,
}

/// The typical deviation of a pixel about its median, from some of the pixels.
fn typical(frames: usize, pixels: usize, frame: &impl Fn(usize, usize) -> f64) -> f64 {
    let every = (pixels / 4000).max(1);
    let deviation = |i: usize| {
        let own: Vec<f64> = (0..frames).map(|f| frame(f, i)).filter(|r| r.is_finite()).collect();
        (own.len() > 2).then(|| {
            let middle = median(own.clone());
            scale(own.into_iter().map(|r| r - middle))
        })
    };
    median((0..pixels).step_by(every).filter_map(deviation).collect())
}

fn mean(frames: usize, range_m: impl Fn(usize) -> f64, typical_m: f64) -> Mean {
    let mut own: Vec<f64> = (0..frames).map(range_m).filter(|r| r.is_finite()).collect();
    let valid = own.len() as u32;
    let nothing = Mean { range_m: f64::NAN, valid, kept: 0 };
    if (own.len() as f64) < SEEN * frames as f64 || own.is_empty() {
        return nothing;
    }
    let middle = median_in(&mut own);
    let sigma_m = scale(own.iter().map(|r| r - middle)).max(TYPICAL * typical_m);
    // In the order of their ranges: the same sum for frames in any order.
    own.sort_unstable_by(f64::total_cmp);
    let (mut sum, mut kept) = (0.0, 0);
    for off in own.iter().map(|r| r - middle).filter(|off| off.abs() <= SAME * sigma_m) {
        sum += off;
        kept += 1;
    }
    if f64::from(kept) < SEEN * frames as f64 || kept == 0 {
        return nothing;
    }
    Mean { range_m: middle + sum / f64::from(kept), valid, kept }
}

/// How far whole frames are off their mean: the median over pixels, frame by frame.
fn between(frames: usize, means: &[Mean], frame: &impl Fn(usize, usize) -> f64) -> f64 {
    let every = (means.len() / 4000).max(1);
    let off = |f: usize| {
        let pixels = (0..means.len()).step_by(every);
        median(pixels.map(|i| frame(f, i) - means[i].range_m).filter(|v| v.is_finite()).collect())
    };
    let offs: Vec<f64> = (0..frames).map(off).collect();
    let mean = offs.iter().sum::<f64>() / frames.max(1) as f64;
    let square = offs.iter().map(|v| (v - mean) * (v - mean)).sum::<f64>();
    (square / frames.saturating_sub(1).max(1) as f64).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frames::noise::tests::normal;

    #[test]
    fn noise_falls_with_the_root_of_the_frames_and_a_mover_leaves_no_trace() {
        let (frames, pixels) = (30, 5000);
        let covered = |f: usize, i: usize| f < 10 && i / 500 == f % 10;
        let frame = |f: usize, i: usize| {
            let noise = 0.002 * normal((f * pixels + i) as u64);
            if covered(f, i) { 0.8 + noise } else { 1.4 + noise }
        };
        let found = averaged(frames, pixels, frame, 2);
        let off: Vec<f64> = found.ranges_m.iter().map(|r| r - 1.4).collect();
        let rms = (off.iter().map(|v| v * v).sum::<f64>() / pixels as f64).sqrt();
        assert!(rms < 0.002 / 30_f64.sqrt() * 1.15, "{rms}");
        assert!((found.left_out - 1.0 / 30.0).abs() < 0.004, "{}", found.left_out);
        assert!((found.sigma_m / 0.002 - 1.0).abs() < 0.1);
        assert!(found.between_m < 2e-4);
        let turned = averaged(frames, pixels, |f, i| frame(29 - f, i), 1);
        assert_eq!(turned.ranges_m, found.ranges_m);
    }

    #[test]
    fn a_pixel_that_sees_nothing_has_no_range() {
        let found =
            averaged(4, 3, |f, i| if i == 0 || f > 0 && i == 1 { f64::NAN } else { 1.0 }, 1);
        assert!(found.ranges_m[0].is_nan() && found.ranges_m[1].is_nan());
        assert_eq!(found.ranges_m[2], 1.0);
    }
}
