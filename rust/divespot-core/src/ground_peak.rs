//! The height of the ground, in m: a peak in the histogram of heights (paper, Algorithm 3).

use crate::cancel::Polled;
use crate::fixed::Fixed;
use crate::histogram::{HeightHistogram, height_histogram};
use crate::{Error, Result};

/// A peak ends where the counts fall to this share of it; lower peaks are not in its series.
/// Chosen: half its height; lower joins the peaks of two levels, higher ends at noise.
const PEAK_SHARE: f64 = 0.5;

/// Height of the first peak, at least, as a share of the highest: the top of a box may hold many
/// more points than the ground. Chosen: lower takes outliers for ground, higher skips small
/// grounds.
const FIRST_PEAK_SHARE: f64 = 0.1;

/// Share of the heights that may be outliers at either end. Chosen: lower lets outliers stretch the
/// range, higher cuts into ground that is little of the scan.
const STRAY_SHARE: f64 = 0.01;

/// Most moves of a peak's window. Decides no answer: it converges sooner.
const MOST_MOVES: usize = 8;

/// Which peak is the ground.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum GroundRule {
    /// The lowest peak that reaches a tenth of the highest and then falls to half of its own
    /// height.
    First,
    /// The highest peak in the lower part.
    Lower,
    /// Midway between the lowest and highest of those peaks in the lower part that reach half of
    /// the highest one there: for a floor that registration split into several levels (paper, "When
    /// the ground becomes uneven").
    Midpoint,
}

/// The height of the ground in m (paper, Algorithm 3), by `rule`.
///
/// The lower part is the first `lower_fraction` of the range from the 1st to the 99th percentile of
/// the heights, so that outliers do not move it. A peak at its end is followed upwards to its top.
/// The result is finer than a bin: the mean of the heights in the `window` bins around the peak.
///
/// # Errors
/// As [`height_histogram`]; [`Error::Setting`] unless `lower_fraction` is above 0 and up to 1.
///
/// # Examples
///
/// ```
/// use divespot_core::{GroundRule, ground_height};
///
/// // A hundred heights on the ground, and ten of a pile above it.
/// let heights: Vec<f64> =
///     (0..110).map(|i| if i < 100 { 0.25 } else { 0.3 + f64::from(i - 100) * 0.01 }).collect();
/// let ground = ground_height(&heights, 0.01, 5, GroundRule::Lower, 0.5)?;
/// assert!((ground - 0.25).abs() < 0.01);
/// # Ok::<(), divespot_core::Error>(())
/// ```
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
    let sums = Cumulative::new(&histogram, heights);
    Ok(sums.top_m(first).midpoint(sums.top_m(last)))
}

/// The first and last bin of the lower part.
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

/// The top of the highest peak within `part`, followed beyond its end if it still rises there.
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

/// The middle of the equally high bins from `peak` on: smoothing spreads one full bin over many.
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

/// The lowest and highest peak in `part` of the series that holds the highest one.
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

/// The sum of the heights in each bin, relative to the bin's lower edge.
///
/// Cumulative sums of integers: the same bits in any order.
struct Cumulative<'a> {
    histogram: &'a HeightHistogram,
    fixed: Fixed,
    sums: Vec<i64>,
}

impl<'a> Cumulative<'a> {
    fn new(histogram: &'a HeightHistogram, heights: &[f64]) -> Self {
        let fixed = Fixed::new(2.0 * histogram.bin_m, heights.len());
        let mut sums = vec![0; histogram.counts.len()];
        for &height in heights.iter().polled() {
            let above = height - histogram.lowest_m;
            let bin = histogram.bin_of(height);
            sums[bin] += fixed.encode(above - bin as f64 * histogram.bin_m);
        }
        Self { histogram, fixed, sums }
    }

    /// The top of a peak in m, finer than a bin: the mean of the heights in the window around it.
    ///
    /// The window moves to the bin of the mean until it stays there. Where counts fluctuate, or the
    /// histogram ends within the window, the highest average is a few bins off the top.
    fn top_m(&self, mut peak: usize) -> f64 {
        let mut mean = self.mean_around(peak);
        for _ in 0..MOST_MOVES {
            let bin = self.histogram.bin_of(mean);
            if bin == peak {
                break;
            }
            peak = bin;
            mean = self.mean_around(peak);
        }
        mean
    }

    fn mean_around(&self, peak: usize) -> f64 {
        let HeightHistogram { lowest_m, bin_m, ref counts, .. } = *self.histogram;
        let bins = self.histogram.around(peak);
        let sum: i64 = self.sums[bins.clone()].iter().sum();
        let count: u32 = counts[bins.clone()].iter().sum();
        let feet = bins.map(|bin| (bin as f64 - peak as f64) * f64::from(counts[bin])).sum::<f64>();
        let above_peak = feet / f64::from(count) * bin_m + self.fixed.mean(sum as f64, count);
        lowest_m + (peak as f64 * bin_m + above_peak)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sample::mix;

    const RULES: [GroundRule; 3] = [GroundRule::First, GroundRule::Lower, GroundRule::Midpoint];

    /// Numbers between 0 and 1.
    fn uniform(count: u64, seed: u64) -> impl Iterator<Item = f64> {
        (0..count).map(move |i| (mix(i + (seed << 32)) >> 11) as f64 / (1_u64 << 53) as f64)
    }

    /// Roughly normal heights around `height`, standard deviation 1 mm.
    fn floor(count: u64, height: f64, seed: u64) -> impl Iterator<Item = f64> {
        let draws = (0..12).map(move |k| uniform(count, 100 * seed + k).collect::<Vec<_>>());
        let draws: Vec<_> = draws.collect();
        (0..count as usize)
            .map(move |i| height + 0.001 * (draws.iter().map(|d| d[i]).sum::<f64>() - 6.0))
    }

    /// A floor at 0.25 m with a cone of 0.3 m on it: fewer points higher up.
    fn scene() -> Vec<f64> {
        let cone = uniform(20_000, 1).map(|u| 0.25 + 0.3 * (1.0 - u.sqrt()));
        floor(30_000, 0.25, 2).chain(cone).collect()
    }

    fn ground(heights: &[f64], rule: GroundRule) -> f64 {
        ground_height(heights, 0.001, 5, rule, 0.5).unwrap()
    }

    #[test]
    fn every_rule_finds_the_floor_under_a_cone() {
        for rule in RULES {
            let error = ground(&scene(), rule) - 0.25;
            assert!(error.abs() < 3e-4, "{rule:?}: {error}");
        }
    }

    #[test]
    fn an_even_floor_is_found_exactly() {
        let mut heights = vec![0.8125; 500];
        assert!(RULES.iter().all(|&rule| ground(&heights, rule) == 0.8125));
        heights.extend((0..500).map(|i| 0.8125 + f64::from(i) / 1024.0));
        for rule in RULES {
            assert!((ground(&heights, rule) - 0.8125).abs() < 1e-4);
        }
    }

    #[test]
    fn stray_points_do_not_move_it() {
        let clean = scene();
        for stray in [-7.0, 95.0] {
            let mut heights = clean.clone();
            heights.extend([stray; 20]);
            for rule in RULES {
                let moved = ground(&heights, rule) - ground(&clean, rule);
                assert!(moved.abs() < 3e-4, "{rule:?} {stray}: {moved}");
            }
        }
    }

    #[test]
    fn order_does_not_count_nor_does_an_exact_offset() {
        let heights = scene();
        let mut sorted = heights.clone();
        sorted.sort_by(f64::total_cmp);
        let shifted: Vec<f64> =
            heights.iter().map(|h| (h * 1e6).round() / 65536.0 + 4096.0).collect();
        let unshifted: Vec<f64> = shifted.iter().map(|h| h - 4096.0).collect();
        for rule in RULES {
            assert_eq!(ground(&heights, rule), ground(&sorted, rule));
            let moved = ground(&shifted, rule) - ground(&unshifted, rule);
            assert!((moved - 4096.0).abs() < 1e-12);
        }
    }

    #[test]
    fn a_box_with_a_larger_top_is_not_the_ground() {
        let heights: Vec<f64> = floor(5000, 0.0, 3).chain(floor(20_000, 0.3, 4)).collect();
        assert!(ground(&heights, GroundRule::First).abs() < 2e-4);
        assert!(ground(&heights, GroundRule::Lower).abs() < 2e-4);
        let whole = ground_height(&heights, 0.001, 5, GroundRule::Lower, 1.0).unwrap();
        assert!((whole - 0.3).abs() < 2e-4);
    }

    #[test]
    fn the_midpoint_lies_between_the_levels_of_a_split_floor() {
        let levels = [(0.0, 9000), (0.012, 7000), (0.02, 8000), (0.5, 3000)];
        let heights: Vec<f64> =
            (0..).zip(levels).flat_map(|(i, (z, count))| floor(count, z, 10 + i)).collect();
        assert!((ground(&heights, GroundRule::Midpoint) - 0.01).abs() < 3e-4);
        assert!(ground(&heights, GroundRule::Lower).abs() < 3e-4);
        assert!(ground(&heights, GroundRule::First).abs() < 3e-4);
    }

    #[test]
    fn a_fraction_outside_its_range_is_refused() {
        for fraction in [0.0, -0.1, 1.01, f64::NAN] {
            let result = ground_height(&[1.0], 0.1, 1, GroundRule::Lower, fraction);
            assert!(matches!(result, Err(Error::Setting { name: "lower_fraction", .. })));
        }
    }

    #[test]
    fn a_peak_ends_where_half_of_it_is_left_and_the_first_reaches_a_tenth_of_the_highest() {
        assert_eq!(first_peak(&[10.0, 4.0, 20.0, 0.0]), 0);
        assert_eq!(first_peak(&[10.0, 6.0, 20.0, 0.0]), 2);
        assert_eq!(first_peak(&[14.0, 0.0, 100.0, 0.0]), 0);
        assert_eq!(first_peak(&[7.0, 0.0, 100.0, 0.0]), 2);
    }

    #[test]
    fn a_hundredth_of_the_heights_may_lie_astray() {
        let last = |strays: usize| {
            let height = |i: usize| if i < strays { 10.0 } else { 0.001 * (i % 100) as f64 };
            let heights: Vec<f64> = (0..1000).map(height).collect();
            lower_part(&height_histogram(&heights, 0.1, 1).unwrap(), 1000, 1.0).1
        };
        assert!(last(7) < 3 && last(14) > 90);
    }

    #[test]
    fn a_window_moves_eight_times_at_most() {
        // Each bin holds twice as much as the one before: the mean lies in the next.
        let bin = |k: i32| vec![f64::from(k) + 0.4; 1 << k];
        let heights: Vec<f64> = [0.0].into_iter().chain((0..17).flat_map(bin)).collect();
        let histogram = height_histogram(&heights, 1.0, 3).unwrap();
        let top_m = Cumulative::new(&histogram, &heights).top_m(2);
        assert!((top_m - 10.4 - 1.5 / 3.5).abs() < 0.01, "{top_m}");
    }
}
