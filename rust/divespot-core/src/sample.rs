//! Random samples that depend on a seed and on the points, but not on their order.

use crate::fixed::Fixed;
use crate::moments::Spread;
use crate::parallel::map_chunks;
use crate::{Places, Point, thread_count};

/// A 64-bit hash of good quality (the finaliser of SplitMix64).
#[must_use]
pub(crate) fn mix(mut z: u64) -> u64 {
    z = z.wrapping_add(0x9e37_79b9_7f4a_7c15);
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

/// Points for a thread at a time. Decides no answer.
const CHUNK: usize = 1 << 14;
/// Shells of distance from the middle within one root mean square distance. Chosen: fine enough to
/// tell points apart; fewer give neighbours one rank.
const SHELLS: f64 = (1u64 << 20) as f64;

/// Up to `count` of `points`, drawn at random and in random order.
///
/// A point's rank follows from `seed` and its distance to the middle of the cloud, relative to the
/// root mean square of all distances. So a cloud that is shuffled, shifted, rotated or scaled gives
/// the same sample, except for a few points that rounding moves into another shell.
///
/// # Examples
///
/// ```
/// use divespot_core::Point;
/// use divespot_core::sample::sample;
///
/// let points: Vec<Point> = (0..1000).map(|i| [f64::from(i), 0.0, 0.0]).collect();
/// let drawn = sample(&points, 10, 7, 0);
/// let reversed: Vec<Point> = points.iter().rev().copied().collect();
/// assert_eq!(drawn.len(), 10);
/// assert_eq!(drawn, sample(&reversed, 10, 7, 0));
/// ```
#[must_use]
pub fn sample<'a>(
    points: impl Into<Places<'a>>,
    count: usize,
    seed: u64,
    threads: usize,
) -> Vec<Point> {
    let points = points.into();
    let mut drawn = lowest(points, count, seed, thread_count(threads));
    let by_place = |a: &u32, b: &u32| {
        let (p, q) = (points.at(*a as usize), points.at(*b as usize));
        p.partial_cmp(&q).unwrap_or(std::cmp::Ordering::Equal)
    };
    drawn.sort_unstable_by(|a, b| a.0.cmp(&b.0).then_with(|| by_place(&a.1, &b.1)));
    drawn.truncate(count);
    drawn.into_iter().map(|(_, i)| points.at(i as usize)).collect()
}

/// The points with the `count` lowest keys and a few more, each as its key and index.
///
/// Keys are uniform, so that a bound slightly above the expected one leaves little to sort.
fn lowest(points: Places<'_>, count: usize, seed: u64, threads: usize) -> Vec<(u64, u32)> {
    let Some(shells) = Shells::around(points, threads) else { return Vec::new() };
    let seed = mix(seed);
    let mut share = 1.2 * (count as f64 + 50.0) / points.len() as f64;
    loop {
        let bound = (share * u64::MAX as f64) as u64; // saturates at the largest key
        let below = map_chunks(points.len(), CHUNK, threads, |range| {
            let keys = points.within(range.clone()).map(|p| mix(seed ^ shells.of(&p)));
            let keyed = keys.zip(range.start as u32..);
            keyed.filter(|&(key, _)| key <= bound).collect::<Vec<_>>()
        });
        if below.iter().map(Vec::len).sum::<usize>() >= count.min(points.len()) {
            return below.concat();
        }
        share *= 2.0;
    }
}

/// Distances from the middle of a cloud, in steps relative to its size.
struct Shells {
    middle: Point,
    per_metre: f64,
}

impl Shells {
    fn around(points: Places<'_>, threads: usize) -> Option<Self> {
        let largest = points.bounds(threads)?.largest();
        let fixed = Fixed::new(largest, points.len());
        let spread = Spread::of_all(points, fixed, threads);
        let per_metre = SHELLS / spread.root_mean_square(fixed).max(f64::MIN_POSITIVE);
        Some(Self { middle: spread.mean(fixed), per_metre })
    }

    #[inline]
    fn of(&self, p: &Point) -> u64 {
        let square: f64 = (0..3).map(|k| (p[k] - self.middle[k]).powi(2)).sum();
        (square.sqrt() * self.per_metre) as i64 as u64 // faster than a cast straight to u64
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_moved_turned_or_scaled_cloud_gives_the_same_sample() {
        let wave = |i: i32| f64::from(i * i % 9973);
        let points: Vec<Point> =
            (0..5000).map(|i| [wave(i), wave(i + 7), wave(3 * i + 1)]).collect();
        let moved = |p: &Point| [0.5 * (7e5 - p[1]), 0.5 * (5e6 + p[0]), 0.5 * p[2]];
        let there: Vec<Point> = points.iter().map(moved).collect();
        let here: Vec<Point> = sample(&points, 500, 3, 1).iter().map(moved).collect();
        let same = sample(&there, 500, 3, 1).iter().filter(|p| here.contains(p)).count();
        assert!(same >= 495, "{same}");
    }

    #[test]
    fn a_shuffled_cloud_gives_the_same_sample() {
        let points: Vec<Point> = (0..500).map(|i| [f64::from(i), f64::from(i % 7), 0.5]).collect();
        let mut shuffled = points.clone();
        shuffled.reverse();
        shuffled.swap(3, 400);
        assert_eq!(sample(&points, 50, 3, 1), sample(&shuffled, 50, 3, 1));
        assert_ne!(sample(&points, 50, 3, 1), sample(&points, 50, 4, 1));
        assert_eq!(sample(&points, 900, 3, 1).len(), 500);
    }
}
