use std::collections::BTreeMap;

use proptest::prelude::*;

use super::*;
use crate::sample::mix;
use crate::{Error, Point};

fn cloud(count: u64, size: Point) -> Vec<Point> {
    let coordinate = |n: u64| (mix(n) >> 11) as f64 / (1_u64 << 53) as f64;
    (0..count).map(|i| std::array::from_fn(|k| size[k] * coordinate(3 * i + k as u64))).collect()
}

fn of(points: &[Point], voxel_m: f64, most: usize) -> Accumulator {
    let mut all = Accumulator::new([0.0; 3], voxel_m, most).unwrap();
    all.add(points.iter().copied()).unwrap();
    all
}

/// Mean, count and bounds of height by voxel, by definition.
fn slow(points: &[Point], voxel_m: f64) -> BTreeMap<[i64; 3], (Point, u32, [f64; 2])> {
    let mut voxels: BTreeMap<[i64; 3], Vec<Point>> = BTreeMap::new();
    for p in points {
        voxels.entry(p.map(|v| (v / voxel_m).floor() as i64)).or_default().push(*p);
    }
    let mean =
        |held: &[Point], k: usize| held.iter().map(|p| p[k]).sum::<f64>() / held.len() as f64;
    let bound =
        |held: &[Point], pick: fn(f64, f64) -> f64| held.iter().map(|p| p[2]).reduce(pick).unwrap();
    let all = |held: Vec<Point>| {
        let at = std::array::from_fn(|k| mean(&held, k));
        (at, held.len() as u32, [bound(&held, f64::min), bound(&held, f64::max)])
    };
    voxels.into_iter().map(|(voxel, held)| (voxel, all(held))).collect()
}

#[test]
fn means_counts_and_bounds_are_those_of_the_definition() {
    let points: Vec<Point> =
        cloud(5000, [4.0, 4.0, 1.0]).iter().map(|p| p.map(|v| v - 1.5)).collect();
    for most in [100_000, 700, 60, 8] {
        let found = of(&points, 0.1, most);
        let edge = found.voxel_m();
        let expected = slow(&points, edge);
        assert!(found.voxels() <= most && expected.len() == found.voxels(), "{most}");
        assert!(
            most == 100_000 || slow(&points, 0.5 * edge).len() > most,
            "no coarser than needed"
        );
        assert_eq!(found.points(), 5000);
        let held = found.held();
        for ((mean, count), bounds) in held.means.iter().zip(&held.counts).zip(&held.bounds_m) {
            let voxel = mean.map(|v| (v / edge).floor() as i64);
            let (at, number, ends) = expected[&voxel];
            let off = (0..3).map(|k| (mean[k] - at[k]).abs()).fold(0.0, f64::max);
            assert!(*count == number && off < 1e-6, "{mean:?} {at:?}");
            assert!(
                (0..2).all(|k| (bounds[k] - ends[k]).abs() < 2e-5 * edge),
                "{bounds:?} {ends:?}"
            );
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(60))]

    #[test]
    fn order_chunks_and_merges_change_no_bit(
        order in Just((0..600_usize).collect::<Vec<_>>()).prop_shuffle(),
        cuts in prop::collection::vec(0..600_usize, 0..8),
        most in prop::sample::select(vec![2_usize, 40, 300, 5000]),
        first in 0..9_usize,
    ) {
        let points = cloud(600, [3.0, 2.0, 0.2]);
        let expected = of(&points, 0.07, most);
        let shuffled: Vec<Point> = order.iter().map(|&i| points[i]).collect();
        let mut cuts = cuts;
        cuts.extend([0, 600]);
        cuts.sort_unstable();
        let mut parts: Vec<_> =
            cuts.windows(2).map(|w| of(&shuffled[w[0]..w[1]], 0.07, most)).collect();
        let mut all = parts.swap_remove(first % parts.len());
        while let Some(part) = parts.pop() {
            all.merge(&part).unwrap();
        }
        prop_assert_eq!(all.to_bytes(), expected.to_bytes());
        prop_assert_eq!(all.surfaces(), expected.surfaces());
    }

    #[test]
    fn bytes_of_any_kind_are_read_or_refused(at in 0..2000_usize, bit in 0..8_u8, end in 0..2000_usize) {
        let mut bytes = of(&cloud(200, [1.0; 3]), 0.3, 100).to_bytes();
        let whole = bytes.len();
        bytes.truncate(whole.max(end) - end);
        if let Some(byte) = bytes.get_mut(at) {
            *byte ^= 1 << bit;
        }
        if let Ok(read) = Accumulator::from_bytes(&bytes) {
            prop_assert_eq!(read.to_bytes(), bytes);
        }
    }
}

#[test]
fn blocks_hold_what_lies_in_them_and_add_up_to_the_whole() {
    let points: Vec<Point> =
        cloud(5000, [4.0, 3.0, 1.0]).iter().map(|p| p.map(|v| v - 1.5)).collect();
    let whole = of(&points, 0.01, 10_000);
    let blocks = whole.blocks();
    assert_eq!(blocks.len(), 4 * 4 * 2);
    let mut all = whole.empty();
    for (at, bytes) in blocks.iter().rev() {
        let block = Accumulator::from_bytes(bytes).unwrap();
        let inside = |p: &Point| (0..3).all(|k| (p[k] / 1.28).floor() as i32 == at[k]);
        assert!(block.held().means.iter().all(inside));
        all.merge(&block).unwrap();
    }
    assert_eq!(all, whole);
}

#[test]
fn bytes_that_promise_more_than_they_hold_are_refused() {
    let bytes = of(&cloud(200, [1.0; 3]), 0.3, 100).to_bytes();
    assert!(Accumulator::from_bytes(&bytes).is_ok());
    for (at, lie) in [(72, u64::MAX), (72, 1 << 40), (72, 0), (48, 1)] {
        let mut lying = bytes.clone();
        lying[at..at + 8].copy_from_slice(&lie.to_le_bytes());
        assert!(matches!(Accumulator::from_bytes(&lying), Err(Error::Corrupt(_))), "{at} {lie}");
    }
    assert!(matches!(Accumulator::from_bytes(b"dvspacc"), Err(Error::Corrupt(_))));
    assert!(matches!(Accumulator::from_bytes(&[0; 96]), Err(Error::Corrupt(_))));
}

#[test]
fn what_was_not_seen_is_dropped_and_counted() {
    let all = of(&[[0.0; 3], [f64::NAN, 1.0, 1.0], [1.0, f64::INFINITY, 0.0], [1.0; 3]], 0.5, 9);
    assert_eq!((all.points(), all.dropped()), (1, [2, 1]));
    let mut twice = all.clone();
    twice.merge(&all).unwrap();
    assert_eq!((twice.points(), twice.voxels(), twice.dropped()), (2, 1, [4, 2]));
}

#[test]
fn a_floor_on_the_face_between_voxels_is_one_surface_and_a_wall_is_none() {
    let floor = |i: usize| [0.01 * (i % 100) as f64, 0.01 * (i / 100) as f64, 0.0];
    let noise = |i: usize| 0.02 * ((mix(i as u64) >> 11) as f64 / (1_u64 << 53) as f64 - 0.5);
    let points: Vec<Point> = (0..10_000).map(|i| [floor(i)[0], floor(i)[1], noise(i)]).collect();
    let found = of(&points, 0.2, 1000);
    assert_eq!((found.held().means.len(), found.surfaces().means.len()), (50, 25));
    assert!(found.surfaces().means.iter().all(|p| p[2].abs() < 2e-3));
    assert_eq!(found.surfaces().counts.iter().sum::<u32>(), 10_000);
    let wall: Vec<Point> = (1..1000).map(|i| [0.5, 0.1, 0.002 * f64::from(i)]).collect();
    assert_eq!(of(&wall, 0.2, 1000).surfaces().means.len(), 10);
}

#[test]
fn memory_goes_with_voxels_and_not_with_the_box() {
    let far = [[0.005, 0.0, 0.0], [1e6, 1e6, 0.0], [-1e6, 0.0, 50.0]];
    let all = of(&far, 0.01, 100);
    assert_eq!((all.voxels(), all.voxel_m()), (3, 0.01));
    let off = all
        .held()
        .means
        .iter()
        .zip([far[2], far[0], far[1]])
        .all(|(a, b)| (0..3).all(|k| (a[k] - b[k]).abs() < 1e-6));
    assert!(off, "{:?}", all.held().means);
}

#[test]
fn what_has_no_voxel_is_refused() {
    let new = |origin: Point, voxel_m: f64, most: usize| Accumulator::new(origin, voxel_m, most);
    for voxel_m in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        assert!(matches!(new([0.0; 3], voxel_m, 1), Err(Error::Setting { name: "voxel_m", .. })));
    }
    assert!(matches!(new([0.0, f64::NAN, 0.0], 1.0, 1), Err(Error::Setting { .. })));
    assert!(matches!(new([0.0; 3], 1.0, 0), Err(Error::Setting { .. })));
    let mut all = new([0.0; 3], 1e-6, 9).unwrap();
    assert!(matches!(all.add([[1e6, 0.0, 0.0]]), Err(Error::GridTooLarge { .. })));
    let mut two = new([0.0; 3], 1e-6, 1).unwrap();
    assert!(matches!(two.add([[1.0; 3], [2.0; 3]]), Err(Error::GridTooLarge { .. })));
    assert!(matches!(two.merge(&all), Err(Error::Degenerate(_))));
}

/// A record of format 0 (20 bytes) or 6 (30 bytes).
fn record(
    whole: [i32; 3],
    class: u8,
    (number, of): (u8, u8),
    withheld: bool,
    new: bool,
) -> Vec<u8> {
    let mut bytes: Vec<u8> = whole.iter().flat_map(|v| v.to_le_bytes()).collect();
    bytes.extend([0; 2]);
    if new {
        bytes.extend([number | of << 4, u8::from(withheld) << 2, class]);
    } else {
        bytes.extend([number | of << 3, class | u8::from(withheld) << 7]);
    }
    bytes.resize(if new { 30 } else { 20 }, 0);
    bytes
}

#[test]
fn records_are_judged_by_class_return_and_place() {
    let mut classes = [Class::Wanted; 256];
    classes[7] = Class::Noise;
    classes[5] = Class::Unwanted;
    let within = Some([[-1.0; 3], [9.0; 3]]);
    let wanted = Wanted { classes, returns: Returns::Last, within };
    for new in [false, true] {
        let bytes = [
            record([1000, 2000, -500], 2, (1, 1), false, new),
            record([1000, 2000, 1500], 2, (1, 2), false, new),
            record([1000, 2000, 1500], 2, (2, 2), true, new),
            record([1000, 2000, 1500], 7, (1, 1), false, new),
            record([1000, 2000, 1500], 5, (1, 1), false, new),
            record([20_000, 2000, 1500], 0, (0, 0), false, new),
        ]
        .concat();
        let records = Records {
            bytes: &bytes,
            stride: if new { 30 } else { 20 },
            is_extended: new,
            scales: [0.001; 3],
            offsets: [0.5, 0.0, 0.0],
            metres: [2.0, 1.0, 1.0],
        };
        let mut all = Accumulator::new([0.0; 3], 0.01, 100).unwrap();
        let told = all.add_records(&records, &wanted).unwrap();
        assert_eq!((told.kept, told.outside, told.withheld), (2, 1, 1));
        assert_eq!((told.noise, told.unwanted, told.classes[2]), (1, 2, 3));
        let held = all.held().means;
        assert!(held.len() == 1 && (0..3).all(|k| (held[0][k] - [3.0, 2.0, -0.5][k]).abs() < 1e-6));
        let cut = Records { bytes: &bytes[1..], ..records };
        assert!(matches!(all.add_records(&cut, &wanted), Err(Error::Corrupt(_))));
    }
}
