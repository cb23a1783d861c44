//! The height of the ground: a peak in the distribution of heights.

use crate::fixed::Fixed;
use crate::histogram::{HeightHistogram, bin_of, height_histogram};
use crate::{Error, Result};

/// A peak ends where the counts fall to this share of it; lower ones are none of a series.
const PEAK_SHARE: f64 = 0.5;

/// The same for the first peak: a box's top may hold many more points than the ground.
const FIRST_PEAK_SHARE: f64 = 0.1;

/// The share of the heights that may lie astray at either end.
const STRAY_SHARE: f64 = 0.01;

/// Which peak is the ground.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum GroundRule {
    /// The lowest peak that reaches a tenth of the highest and then falls to half of itself.
    First,
    /// The highest peak in the lower part.
    Lower,
    /// Midway between the lowest and the highest of the peaks in the lower part that reach half
    /// of the highest one there: for a floor that registration split into several levels (paper,
    /// "When the ground becomes uneven").
    Midpoint,
}

/// The height of the ground (paper, Algorithm 3), by `rule`.
///
/// The lower part is the first `lower_fraction` of the range from the 1st to the 99th percentile
/// of the heights, so that a stray point does not move it; a peak that it cuts through is
/// followed upward to its top. Finer than a bin: the result is the mean of the heights in the
/// `window` bins around the peak.
///
/// # Errors
/// As [`height_histogram`]; [`Error::Setting`] unless `lower_fraction` is above 0 and up to 1.
pub fn ground_height(
    heights: &[f64],
    bin_m: f64,
    window: usize,
    rule: GroundRule,
    lower_fraction: f64,
) -> Result<f64> {
    if !(lower_fraction > 0.0 && lower_fraction <= 1.0) {
        let needed = "a number above 0 and up to 1";
        return Err(Error::Setting { name: "lower_fraction", given: lower_fraction, needed });
    }
    let histogram = height_histogram(heights, bin_m, window)?;
    let smoothed = &histogram.smoothed;
    let part = lower_part(&histogram, heights.len(), lower_fraction);
    let (first, last) = match rule {
        GroundRule::First => [first_peak(smoothed); 2].into(),
        GroundRule::Lower => [highest_peak(smoothed, part); 2].into(),
        GroundRule::Midpoint => series_of_peaks(smoothed, part),
    };
    let around = |peak| mean_around(&histogram, heights, peak);
    Ok(0.5 * (around(first) + around(last)))
}

/// The first and the last bin of the lower part.
fn lower_part(histogram: &HeightHistogram, total: usize, fraction: f64) -> (usize, usize) {
    let stray = STRAY_SHARE * total as f64;
    let reached = |share: f64| {
        let mut sum = 0.0;
        let passes = |&count: &u32| {
            sum += f64::from(count);
            sum > share
        };
        histogram.counts.iter().position(passes).unwrap_or(0)
    };
    let (low, high) = (reached(stray), reached(total as f64 - stray - 1.0));
    (low, low + ((high - low) as f64 * fraction) as usize)
}

/// The top of the highest peak within `part`, and a little beyond where the part cuts it.
fn highest_peak(smoothed: &[f64], (low, high): (usize, usize)) -> usize {
    let mut peak = low;
    for i in low..=high {
        if smoothed[i] > smoothed[peak] {
            peak = i;
        }
    }
    while peak >= high && smoothed.get(peak + 1).is_some_and(|&next| next > smoothed[peak]) {
        peak += 1;
    }
    middle_of_top(smoothed, peak)
}

/// The middle of the equally high bins that begin at `peak`: one full bin smooths to many.
fn middle_of_top(smoothed: &[f64], peak: usize) -> usize {
    let top = smoothed[peak..].iter().take_while(|&&v| v == smoothed[peak]).count();
    peak + (top - 1) / 2
}

fn first_peak(smoothed: &[f64]) -> usize {
    let highest = smoothed.iter().copied().fold(0.0, f64::max);
    let mut peak = 0;
    for (i, &value) in smoothed.iter().enumerate() {
        if value > smoothed[peak] {
            peak = i;
        }
        let stands = smoothed[peak] >= FIRST_PEAK_SHARE * highest;
        if stands && value < PEAK_SHARE * smoothed[peak] {
            break;
        }
    }
    middle_of_top(smoothed, peak)
}

/// The lowest and the highest of the peaks in `part` that belong with its highest.
fn series_of_peaks(smoothed: &[f64], part: (usize, usize)) -> (usize, usize) {
    let highest = highest_peak(smoothed, part);
    let is_peak = |&i: &usize| {
        let below = i.checked_sub(1).map_or(0.0, |j| smoothed[j]);
        let end = i + smoothed[i..].iter().take_while(|&&v| v == smoothed[i]).count();
        let above = smoothed.get(end).copied().unwrap_or(0.0);
        smoothed[i] >= PEAK_SHARE * smoothed[highest] && smoothed[i] > below && smoothed[i] > above
    };
    let mut peaks = (part.0..=part.1.max(highest)).filter(is_peak);
    let first = peaks.next().map_or(highest, |i| middle_of_top(smoothed, i));
    let last = peaks.next_back().map_or(first, |i| middle_of_top(smoothed, i));
    (first, last.max(highest))
}

/// The mean of the heights in the window around bin `peak`, the same bits in any order.
fn mean_around(histogram: &HeightHistogram, heights: &[f64], peak: usize) -> f64 {
    let HeightHistogram { lowest_m, bin_m, .. } = *histogram;
    let half = (histogram.window / 2).min(histogram.counts.len()) as f64;
    let fixed = Fixed::new((half + 1.0) * bin_m, heights.len());
    let middle = peak as f64 * bin_m;
    let (mut sum, mut count) = (0, 0);
    for height in heights {
        if (bin_of(*height, lowest_m, bin_m) - peak as f64).abs() <= half {
            sum += fixed.encode(height - lowest_m - middle);
            count += 1;
        }
    }
    lowest_m + middle + fixed.mean(sum, count)
}
