use super::*;
use crate::Point;
use crate::sample::mix;

const CELL: f64 = 0.02;
/// Points along a cell.
const ALONG: i32 = 3;
const STEP: f64 = CELL / ALONG as f64;

/// Points over a raster of 1.2 m by 0.9 m, at one height or none.
fn raster(height: impl Fn(f64, f64) -> f64) -> Vec<Point> {
    let place = |i: i32| [(f64::from(i % 180) + 0.5) * STEP, (f64::from(i / 180) + 0.5) * STEP];
    let points = (0..180 * 135).map(place).map(|[x, y]| [x, y, height(x, y)]);
    points.filter(|p| !p[2].is_nan()).collect()
}

fn cone(x: f64, y: f64) -> f64 {
    (0.2 - 0.5 * (x - 0.6).hypot(y - 0.45)).max(0.0)
}

/// Points along z over a place, from one height to another.
fn upright(x: f64, y: f64, low: f64, high: f64) -> impl Iterator<Item = Point> {
    let count = ((high - low) / STEP).ceil() as i32;
    (0..count).map(move |k| [x, y, low + f64::from(k) * STEP])
}

/// How many points of each part lie on the surface.
fn on(parts: &[Vec<Point>]) -> Vec<usize> {
    let mask = surface_points(&parts.concat(), CELL, 0.001, false).unwrap();
    let mut left = mask.into_iter();
    parts.iter().map(|part| left.by_ref().take(part.len()).filter(|&is| is).count()).collect()
}

#[test]
fn a_heap_is_on_the_surface_and_what_hangs_over_it_is_not() {
    let heap = raster(cone);
    let body = raster(|x, y| if (x - 0.7).hypot(y - 0.45) < 0.15 { 0.35 } else { f64::NAN });
    let below: Vec<Point> = heap.iter().step_by(97).map(|p| [p[0], p[1], -0.4]).collect();
    let whole = heap.len();
    assert_eq!(on(&[heap, body, below]), [whole, 0, 0]);
}

#[test]
fn legs_are_off_the_surface_but_at_their_feet() {
    let heap = raster(cone);
    let whole = heap.len();
    let around = (0..40).map(|k| f64::from(k) * 0.157);
    let leg: Vec<Point> = around
        .map(|turn| (0.7 + 0.04 * turn.cos(), 0.45 + 0.04 * turn.sin()))
        .flat_map(|(x, y)| upright(x, y, cone(x, y), 0.8))
        .collect();
    let count = leg.len();
    let found = on(&[heap, leg]);
    assert!(found[0] > whole - whole / 200, "{found:?} of {whole}");
    assert!(found[1] < count / 20, "{found:?} of {count}");
}

#[test]
fn a_wall_is_off_the_surface_and_the_face_of_a_bench_is_on_it() {
    let face: Vec<Point> =
        (0..135).flat_map(|i| upright(0.9, (f64::from(i) + 0.5) * STEP, 0.0, 0.3)).collect();
    let floor = raster(|x, y| if x < 0.9 { cone(x, y) } else { f64::NAN });
    let (whole, count) = (floor.len(), face.len());
    let wall = on(&[floor, face]);
    assert!(wall[0] > whole - whole / 50 && wall[1] < count / 5, "{wall:?}");
    // 70°: a rise of 2.75 for each cell.
    let bench = raster(|x, y| cone(x, y).max((2.75 * (x - 0.85)).clamp(0.0, 0.3)));
    let count = bench.len();
    assert_eq!(on(&[bench]), [count]);
}

#[test]
fn a_board_that_a_heap_reaches_up_to_is_off_the_surface() {
    let heap = raster(cone);
    let whole = heap.len();
    // From the summit outwards, level with it, a cell and a half wide.
    let board =
        raster(|x, y| if x > 0.6 && (y - 0.45).abs() < 0.75 * CELL { 0.2 } else { f64::NAN });
    let hidden = |p: &Point| p[0] > 0.6 && (p[1] - 0.45).abs() < 0.75 * CELL;
    let seen: Vec<Point> = heap.into_iter().filter(|p| !hidden(p)).collect();
    let (count, seen_count) = (board.len(), seen.len());
    let found = on(&[seen, board]);
    assert!(found[0] > seen_count - whole / 100, "{found:?} of {seen_count}");
    assert!(found[1] < count / 4, "{found:?} of {count}");
}

#[test]
fn the_order_of_the_points_changes_nothing() {
    let noise = |k: usize| 0.004 * ((mix(k as u64) >> 11) as f64 / (1_u64 << 53) as f64 - 0.5);
    let body = raster(|x, y| if (x - 0.7).hypot(y - 0.45) < 0.15 { 0.22 } else { f64::NAN });
    let mut points = [raster(cone), body].concat();
    points.iter_mut().enumerate().for_each(|(k, p)| p[2] += noise(k));
    let mask = surface_points(&points, CELL, 0.001, false).unwrap();
    let mut order: Vec<usize> = (0..points.len()).collect();
    order.sort_by_key(|&k| mix(k as u64));
    let shuffled: Vec<Point> = order.iter().map(|&k| points[k]).collect();
    let other = surface_points(&shuffled, CELL, 0.001, false).unwrap();
    assert!(order.iter().zip(other).all(|(&k, is)| mask[k] == is));
}

/// The seed in the middle of a floor whose cells hold these heights.
fn seed(heights: &[f64], noise_m: f64) -> f64 {
    let grid = Grid { origin_m: [0.0; 2], cell_m: 1.0, columns: 20, rows: 20 };
    let over = |cell: usize| {
        let [x, y] = grid.center(cell);
        heights.iter().map(move |&z| [x, y, z])
    };
    let columns = Columns::of(&(0..grid.len()).flat_map(over).collect::<Vec<Point>>(), grid, 1);
    let needs = Needs { of_block: vec![4; grid.len()], columns: grid.columns };
    seeds(&grid, &lowest_layer(&columns, &needs, noise_m, 1))[210]
}

#[test]
fn a_layer_is_as_thick_as_a_slope_across_a_cell_or_as_the_noise() {
    let rough = [0.0, 0.1, 0.3, 0.45];
    assert!((seed(&rough, 0.0) - 0.2125).abs() < 1e-12);
    assert!((seed(&rough.map(|z| 10.0 * z), 1.0) - 2.125).abs() < 1e-12);
    let flat_and_more = [0.0, 0.0, 0.0, 0.0, 0.9, 0.9];
    assert_eq!(seed(&flat_and_more, 0.0), 0.0);
    assert_eq!(seed(&flat_and_more.map(|z| 10.0 * z), 1.0), 0.0);
}

#[test]
fn strays_below_are_no_layer() {
    assert_eq!(seed(&[-7.0, -3.0, 0.0, 0.0, 0.0, 0.0], 0.0), 0.0);
    assert!(seed(&[0.0, 2.0, 4.0, 6.0], 0.0).is_nan());
}

/// The expected height of a cell: the mean of those around it on the surface the walk comes from.
fn twin_expected(grid: &Grid, heights_m: &[f64], cell: usize, from: usize, most_m: f64) -> f64 {
    let (mut sum, mut count) = (0.0, 0.0);
    for dy in -1..=1 {
        for dx in -1..=1 {
            let Some(n) = grid.neighbor(cell, dx, dy) else { continue };
            if (heights_m[n] - heights_m[from]).abs() <= most_m {
                (sum, count) = (sum + heights_m[n], count + 1.0);
            }
        }
    }
    sum / count
}

/// The walk by its definition: of all cells reached and not yet left, the one with the best
/// agreement goes first.
fn twin_walk(columns: &Columns, heights_m: &mut [f64], needs: &Needs, reach_m: f64) {
    let grid = &columns.grid;
    let mut waiting: Vec<(f64, usize)> =
        (0..grid.len()).filter(|&c| !heights_m[c].is_nan()).map(|c| (0.0, c)).collect();
    while !waiting.is_empty() {
        let order = |a: &usize, b: &usize| {
            let (a, b) = (waiting[*a], waiting[*b]);
            a.0.total_cmp(&b.0).then(a.1.cmp(&b.1))
        };
        let best = (0..waiting.len()).min_by(order).unwrap();
        let (_, cell) = waiting.remove(best);
        for (dx, dy) in [(1, 0), (-1, 0), (0, 1), (0, -1)] {
            let Some(n) = grid.neighbor(cell, dx, dy).filter(|&n| heights_m[n].is_nan()) else {
                continue;
            };
            let expected = twin_expected(grid, heights_m, n, cell, 2.0 * reach_m);
            let all = columns.heights(n).iter().copied();
            let near: Vec<f64> = all.clone().filter(|z| (z - expected).abs() <= reach_m).collect();
            if near.len() < needs.of(n) {
                continue;
            }
            heights_m[n] = mean(&near);
            let over = all.clone().find(|z| z - heights_m[n] > reach_m);
            if over.is_none_or(|z| z - heights_m[n] > 2.0 * reach_m) {
                waiting.push(((heights_m[n] - expected).abs(), n));
            }
        }
    }
}

#[test]
fn the_walk_does_what_its_definition_says() {
    let unit = |k: u64| (mix(k) >> 11) as f64 / (1_u64 << 53) as f64;
    for seed in 0..20 {
        let random = |k: u64| unit(1_000_000 * seed + k);
        let grid = Grid { origin_m: [0.0; 2], cell_m: 1.0, columns: 17, rows: 13 };
        let hill = |x: f64, y: f64| 0.3 * (x - 8.0).abs().min((y - 5.0).abs()) * random(7);
        let points: Vec<Point> = (0..1500)
            .map(|k| {
                let (x, y) = (17.0 * random(10 + 3 * k), 13.0 * random(11 + 3 * k));
                let off = 12.0 * (random(12 + 3 * k) - 0.3);
                [x, y, hill(x, y) + if k % 4 == 0 { off } else { 0.02 * off }]
            })
            .collect();
        let columns = Columns::of(&points, grid, 1);
        let needs = columns.needs();
        let start = |cell: usize| if cell % 91 == 40 { hill(8.5, 5.5) } else { f64::NAN };
        let mut heights: Vec<f64> = (0..grid.len()).map(start).collect();
        let mut twin = heights.clone();
        let reach = Reach::of(1.0, 0.05);
        walk(&columns, &mut heights, &needs, reach);
        twin_walk(&columns, &mut twin, &needs, reach.far_m);
        let bits = |all: &[f64]| all.iter().map(|h| h.to_bits()).collect::<Vec<_>>();
        assert_eq!(bits(&heights), bits(&twin), "{seed}");
        assert!(heights.iter().filter(|h| !h.is_nan()).count() > 60, "{seed}");
    }
}

#[test]
fn the_reach_is_the_steepest_step_and_three_standard_deviations() {
    let reach = Reach::of(2.0, 0.1);
    assert!((reach.far_m - (2.0 * 3.0_f64.sqrt() + 0.3)).abs() < 1e-3);
    // A slope that changes by 30 % (17°) within a cell.
    assert!((reach.near_m - 0.9).abs() < 1e-12);
}
