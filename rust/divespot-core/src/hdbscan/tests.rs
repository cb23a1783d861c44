//! Tests of the whole against slow twins, and of what must not change its result.

mod twin;

use proptest::prelude::*;

use super::*;
use crate::sample::mix;

use twin::{Twin, prim, reachability};

const PLAIN: Settings = Settings {
    min_cluster_size: 5,
    min_samples: 5,
    cluster_selection_epsilon: 0.0,
    selection: Selection::ExcessOfMass,
    allow_single_cluster: false,
    threads: 1,
};

fn run(points: &[Point], settings: &Settings) -> Clusters {
    hdbscan(points, settings).unwrap()
}

/// A pseudo-random number from 0 to 1.
fn noise(i: usize) -> f64 {
    (mix(i as u64) >> 11) as f64 / (1u64 << 53) as f64
}

fn uniform(count: usize) -> Vec<Point> {
    (0..count).map(|i| std::array::from_fn(|k| noise(3 * i + k))).collect()
}

/// Points around `centre`, denser in the middle.
fn ball(count: usize, centre: Point, radius: f64) -> Vec<Point> {
    let other = uniform(2 * count).split_off(count);
    let pairs = uniform(count).into_iter().zip(other);
    pairs.map(|(a, b)| std::array::from_fn(|k| centre[k] + radius * (a[k] + b[k] - 1.0))).collect()
}

/// Clouds with a special property each, as named.
fn clouds() -> Vec<(&'static str, Vec<Point>)> {
    let thin = |(i, p): (usize, Point)| if i % 50 == 0 { p } else { [p[0], p[1], 1e-3 * p[2]] };
    let balls = [
        ball(300, [0.0; 3], 0.2),
        ball(300, [3.0, 1.0, 0.0], 1.0),
        ball(300, [1.0, 4.0, 2.0], 0.5),
    ];
    vec![
        ("uniform", uniform(1000)),
        ("clustered", balls.concat()),
        ("planar", uniform(600).into_iter().map(|p| [p[0], p[1], 0.25]).collect()),
        ("collinear", uniform(500).into_iter().map(|p| [p[0], 2.0 * p[0], 0.0]).collect()),
        ("evenly spaced", (0..400).map(|i| [f64::from(i), 0.0, 0.0]).collect()),
        (
            "millimetres",
            uniform(800).iter().map(|p| p.map(|v| (30.0 * v).round() * 1e-3)).collect(),
        ),
        ("ten-fold", uniform(80).iter().flat_map(|&p| [p; 10]).collect()),
        ("two far", [ball(300, [0.0; 3], 1e-3), ball(200, [1e3, 0.0, 0.0], 1e-3)].concat()),
        ("sheet with strays", uniform(700).into_iter().enumerate().map(thin).collect()),
        ("all equal", vec![[0.5; 3]; 300]),
        ("tiny", uniform(17)),
        ("two", uniform(2)),
        ("one", uniform(1)),
        ("none", Vec::new()),
    ]
}

fn assert_tree(name: &str, points: &[Point], min_samples: usize) {
    let scale = Frame::around(points).unwrap().scale;
    let expected: Vec<f64> = prim(&reachability(points, min_samples))
        .iter()
        .map(|&w| f64::from(w).sqrt() / scale)
        .collect();
    let found = run(points, &Settings { min_samples, threads: 2, ..PLAIN });
    assert_eq!(found.mst_weights, expected, "{name}, min_samples {min_samples}");
}

#[test]
fn the_spanning_tree_is_that_of_prim() {
    for (name, points) in clouds() {
        for min_samples in [1, 10, 17, 40] {
            assert_tree(name, &points, min_samples);
        }
    }
    assert_tree("large", &uniform(3000), 10);
}

fn any_settings() -> impl Strategy<Value = Settings> {
    let epsilon = prop_oneof![Just(0.0), 0.0..2.0];
    let selection = prop_oneof![Just(Selection::ExcessOfMass), Just(Selection::Leaf)];
    (2..9usize, 1..20usize, epsilon, selection, any::<bool>(), 1..4usize).prop_map(
        |(min_cluster_size, min_samples, epsilon, selection, allow_single_cluster, threads)| {
            Settings {
                min_cluster_size,
                min_samples,
                cluster_selection_epsilon: epsilon,
                selection,
                allow_single_cluster,
                threads,
            }
        },
    )
}

/// Small clouds: on a coarse lattice, so with many ties and duplicates, or without.
fn any_points() -> impl Strategy<Value = Vec<Point>> {
    let lattice = prop::array::uniform3((0..6u8).prop_map(f64::from));
    let free = prop::array::uniform3(0.0..6.0);
    prop_oneof![prop::collection::vec(lattice, 0..70), prop::collection::vec(free, 0..70)]
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(300))]

    #[test]
    fn labels_are_those_of_the_definition(points in any_points(), settings in any_settings()) {
        let found = run(&points, &settings);
        let (labels, probabilities) = Twin::new(&points, &settings).labels(&points, &settings);
        prop_assert_eq!(&found.labels, &labels);
        for (a, b) in found.probabilities.iter().zip(&probabilities) {
            prop_assert!((a - b).abs() < 1e-12);
        }
    }

    #[test]
    fn order_threads_and_scale_change_nothing(
        points in any_points(), settings in any_settings(), exponent in -40..40i32
    ) {
        let found = run(&points, &settings);
        let scale = f64::from(exponent).exp2();
        let mut order: Vec<usize> = (0..points.len()).collect();
        order.sort_unstable_by_key(|&i| mix(i as u64));
        let moved: Vec<Point> = order.iter().map(|&i| points[i].map(|v| v * scale)).collect();
        let other = run(&moved, &Settings {
            threads: settings.threads + 1,
            cluster_selection_epsilon: settings.cluster_selection_epsilon * scale,
            ..settings
        });
        for (&i, (label, p)) in order.iter().zip(other.labels.iter().zip(&other.probabilities)) {
            prop_assert_eq!((found.labels[i], found.probabilities[i]), (*label, *p));
        }
        let weights: Vec<f64> = other.mst_weights.iter().map(|w| w / scale).collect();
        prop_assert_eq!(found.mst_weights, weights);
    }

    #[test]
    fn nothing_panics(
        points in prop::collection::vec(prop::array::uniform3(any::<f64>()), 0..60),
        settings in any_settings(),
    ) {
        let finite = points.iter().flatten().all(|v| v.is_finite());
        prop_assert_eq!(hdbscan(&points, &settings).is_ok(), finite);
    }
}

#[test]
fn larger_clouds_keep_their_labels_in_any_order_at_any_thread_count() {
    for (name, points) in clouds() {
        let found = run(&points, &PLAIN);
        let reversed: Vec<Point> = points.iter().rev().copied().collect();
        let mut other = run(&reversed, &Settings { threads: 3, ..PLAIN });
        other.labels.reverse();
        other.probabilities.reverse();
        assert_eq!(found, other, "{name}");
    }
}

#[test]
fn two_balls_and_a_far_stray_are_two_clusters_and_noise() {
    let points = [ball(200, [0.0; 3], 0.1), ball(300, [5.0; 3], 0.1), vec![[20.0; 3]]].concat();
    let labels = run(&points, &Settings { min_cluster_size: 50, ..PLAIN }).labels;
    assert!(labels[..200].iter().all(|&label| label == 1));
    assert!(labels[200..500].iter().all(|&label| label == 0));
    assert_eq!(labels[500], -1);
}

#[test]
fn what_is_wrong_is_said() {
    let say = |settings| hdbscan(&[], &settings).unwrap_err().to_string();
    assert_eq!(
        say(Settings { min_cluster_size: 1, ..PLAIN }),
        "min_cluster_size is 1: 2 or more is needed"
    );
    assert_eq!(say(Settings { min_samples: 0, ..PLAIN }), "min_samples is 0: 1 or more is needed");
    assert_eq!(
        say(Settings { cluster_selection_epsilon: f64::NAN, ..PLAIN }),
        "cluster_selection_epsilon is NaN: a finite number, 0 or more is needed"
    );
}

#[test]
fn a_set_flag_interrupts() {
    let run = || hdbscan(&uniform(1000), &PLAIN);
    let flag = crate::cancel::Flag::new(true.into());
    assert_eq!(crate::cancel::unless_called_off(&flag, run), Err(Error::Interrupted));
}
