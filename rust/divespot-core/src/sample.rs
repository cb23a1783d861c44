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
    let keys: Vec<u64> = points.iter().map(|p| key(seed, p)).collect();
    let mut drawn = lowest(&keys, count);
    let by_place = |a: &u32, b: &u32| {
        let (p, q) = (points[*a as usize], points[*b as usize]);
        p.partial_cmp(&q).unwrap_or(std::cmp::Ordering::Equal)
    };
    drawn.sort_unstable_by(|a, b| a.0.cmp(&b.0).then_with(|| by_place(&a.1, &b.1)));
    drawn.truncate(count);
    drawn.into_iter().map(|(_, i)| points[i as usize]).collect()
}

/// The `count` lowest keys and few more, each with its index.
///
/// Keys are spread evenly, so a bound a little above the expected one leaves little to sort.
fn lowest(keys: &[u64], count: usize) -> Vec<(u64, u32)> {
    let mut share = 1.2 * (count as f64 + 50.0) / keys.len().max(1) as f64;
    loop {
        let bound = (share * u64::MAX as f64) as u64; // saturates at the largest key
        let below: Vec<(u64, u32)> =
            keys.iter().copied().zip(0..).filter(|&(key, _)| key <= bound).collect();
        if below.len() >= count.min(keys.len()) {
            return below;
        }
        share *= 2.0;
    }
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
