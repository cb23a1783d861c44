//! The histogram of heights, and its moving average (paper, Algorithm 3).

use std::ops::Range;

use crate::cancel::Polled;
use crate::error::positive;
use crate::voxel::ANCHOR;
use crate::{Error, Result};

/// Most bins. More result from a wrong unit or a distant outlier.
const MOST_BINS: f64 = 16_777_216.0;

/// Numbers of points by height.
#[derive(Debug, Clone, PartialEq)]
pub struct HeightHistogram {
    /// The lowest height, in m. The first bin begins slightly below it.
    pub lowest_m: f64,
    /// Height of a bin, in m.
    pub bin_m: f64,
    /// Number of bins in the moving average.
    pub window: usize,
    /// Number of heights in each bin.
    pub counts: Vec<u32>,
    /// Mean count in the window around each bin.
    pub smoothed: Vec<f64>,
}

impl HeightHistogram {
    /// The middle of bin `index`, in m.
    #[must_use]
    pub fn center_m(&self, index: usize) -> f64 {
        self.lowest_m + (index as f64 + 0.5 - ANCHOR) * self.bin_m
    }

    /// The bin of a height within the histogram.
    pub(crate) fn bin_of(&self, height: f64) -> usize {
        cells(height - self.lowest_m, self.bin_m) as usize
    }

    /// The bins in the window around bin `index`.
    pub(crate) fn around(&self, index: usize) -> Range<usize> {
        around(index, self.window, self.counts.len())
    }
}

fn around(index: usize, window: usize, bins: usize) -> Range<usize> {
    let half = window / 2;
    index.saturating_sub(half)..bins.min(index.saturating_add(half + 1))
}

/// Position of a height, `above` m over the lowest, in bins.
fn cells(above: f64, bin_m: f64) -> f64 {
    above / bin_m + ANCHOR
}

/// Counts `heights` in bins of `bin_m` and smooths them over `window` bins.
///
/// In the paper's Algorithm 3, the window sums `step` + 1 bins, divides by `step` and shifts the
/// result by half a window. Here `smoothed[i]` belongs to bin `i` and is a true mean; at the ends
/// it is over the bins that exist. Heights in whole multiples of a fraction of `bin_m` stay clear
/// of the edges of the bins.
///
/// # Errors
/// [`Error::Setting`] unless `bin_m` is finite and above zero and `window` odd,
/// [`Error::TooFewPoints`] without heights, [`Error::GridTooLarge`] beyond 2²⁴ bins.
///
/// # Examples
///
/// ```
/// use divespot_core::height_histogram;
///
/// let histogram = height_histogram(&[0.0, 0.0, 0.0, 1.0], 1.0, 1)?;
/// assert_eq!(histogram.counts, [3, 1]);
/// # Ok::<(), divespot_core::Error>(())
/// ```
pub fn height_histogram(heights: &[f64], bin_m: f64, window: usize) -> Result<HeightHistogram> {
    positive("bin_m", bin_m)?;
    if window.is_multiple_of(2) {
        let needed = "an odd number of bins";
        return Err(Error::Setting { name: "window", given: window as f64, needed });
    }
    let none = Error::TooFewPoints { what: "a height histogram", given: 0, needed: 1 };
    let lowest_m = heights.iter().copied().polled().reduce(f64::min).ok_or(none)?;
    let highest_m = heights.iter().copied().polled().fold(lowest_m, f64::max);
    let most = cells(highest_m - lowest_m, bin_m) + 1.0;
    if most > MOST_BINS {
        return Err(Error::GridTooLarge { name: "bin_m", cells: most });
    }
    let mut counts = vec![0; most as usize];
    heights
        .iter()
        .polled()
        .for_each(|height| counts[cells(height - lowest_m, bin_m) as usize] += 1);
    let smoothed = moving_average(&counts, window);
    Ok(HeightHistogram { lowest_m, bin_m, window, counts, smoothed })
}

fn moving_average(counts: &[u32], window: usize) -> Vec<f64> {
    let up_to = |sum: &mut u64, &count: &u32| {
        *sum += u64::from(count);
        Some(*sum)
    };
    let sums: Vec<u64> = std::iter::once(0).chain(counts.iter().scan(0, up_to)).collect();
    let mean = |bins: Range<usize>| (sums[bins.end] - sums[bins.start]) as f64 / bins.len() as f64;
    (0..counts.len()).polled().map(|i| mean(around(i, window, counts.len()))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sample::mix;

    fn slow_average(counts: &[u32], window: usize) -> Vec<f64> {
        let half = window as i64 / 2;
        let bins =
            |i: i64| (i - half..=i + half).filter_map(|j| counts.get(usize::try_from(j).ok()?));
        (0..counts.len() as i64)
            .map(|i| bins(i).map(|&c| f64::from(c)).sum::<f64>() / bins(i).count() as f64)
            .collect()
    }

    #[test]
    fn the_average_belongs_to_its_own_bin() {
        let counts: Vec<u32> = (0..50).map(|i| (mix(i) % 100) as u32).collect();
        for window in [1, 3, 7, 49, 99, 101, usize::MAX] {
            let slow = slow_average(&counts, window.min(1001));
            assert_eq!(moving_average(&counts, window), slow, "{window}");
        }
    }

    #[test]
    fn heights_in_steps_of_a_fraction_of_a_bin_fall_evenly() {
        for per_bin in 1..=8 {
            let step = 0.01 / f64::from(per_bin);
            let heights: Vec<f64> =
                (0..per_bin * 50).map(|i| 312.7 + f64::from(i) * step).collect();
            let histogram = height_histogram(&heights, 0.01, 1).unwrap();
            let inner = &histogram.counts[1..histogram.counts.len() - 1];
            assert!(inner.iter().all(|&c| c == per_bin as u32), "{per_bin}: {inner:?}");
        }
    }

    #[test]
    fn bins_count_every_height_once_and_near_their_middle() {
        let heights: Vec<f64> = (0..5000).map(|i| (mix(i) % 9999) as f64 / 777.0).collect();
        let histogram = height_histogram(&heights, 0.37, 5).unwrap();
        assert_eq!(histogram.counts.iter().sum::<u32>(), 5000);
        for (i, &count) in histogram.counts.iter().enumerate() {
            let near = heights.iter().filter(|&h| (h - histogram.center_m(i)).abs() < 0.185);
            assert_eq!(near.count(), count as usize);
        }
    }

    #[test]
    fn what_cannot_be_counted_is_said() {
        assert!(matches!(height_histogram(&[], 0.1, 1), Err(Error::TooFewPoints { .. })));
        assert!(matches!(height_histogram(&[1.0], 0.0, 1), Err(Error::Setting { .. })));
        assert!(matches!(height_histogram(&[1.0], f64::NAN, 1), Err(Error::Setting { .. })));
        assert!(matches!(height_histogram(&[1.0], 0.1, 4), Err(Error::Setting { .. })));
        let far = [0.0, 1e300];
        assert!(matches!(height_histogram(&far, 1e-300, 1), Err(Error::GridTooLarge { .. })));
    }
}
