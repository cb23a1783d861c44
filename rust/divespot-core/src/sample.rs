//! Random draws that depend on a seed and on the points, never on their order.

use crate::Point;

/// A 64-bit mix of good quality (the finaliser of SplitMix64).
#[must_use]
pub(crate) fn mix(mut z: u64) -> u64 {
    z = z.wrapping_add(0x9e37_79b9_7f4a_7c15);
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

fn key(seed: u64, p: &Point) -> u64 {
    // + 0.0 turns -0.0 into 0.0: equal points get equal keys.
    p.iter().fold(mix(seed), |hash, v| mix(hash ^ (v + 0.0).to_bits()))
}

/// Up to `count` of `points`, drawn at random and in random order.
///
/// Each point's place follows from its coordinates and `seed` alone, so a shuffled cloud gives
/// the same sample.
#[must_use]
pub fn sample(points: &[Point], count: usize, seed: u64) -> Vec<Point> {
    let mut keyed: Vec<(u64, Point)> = points.iter().map(|p| (key(seed, p), *p)).collect();
    let by_key = |a: &(u64, Point), b: &(u64, Point)| {
        a.0.cmp(&b.0).then_with(|| a.1.partial_cmp(&b.1).unwrap_or(std::cmp::Ordering::Equal))
    };
    if count < keyed.len() {
        keyed.select_nth_unstable_by(count, by_key);
        keyed.truncate(count);
    }
    keyed.sort_unstable_by(by_key);
    keyed.into_iter().map(|(_, p)| p).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_shuffled_cloud_gives_the_same_sample() {
        let points: Vec<Point> = (0..500).map(|i| [f64::from(i), f64::from(i % 7), 0.5]).collect();
        let mut shuffled = points.clone();
        shuffled.reverse();
        shuffled.swap(3, 400);
        assert_eq!(sample(&points, 50, 3), sample(&shuffled, 50, 3));
        assert_ne!(sample(&points, 50, 3), sample(&points, 50, 4));
        assert_eq!(sample(&points, 900, 3).len(), 500);
    }
}
