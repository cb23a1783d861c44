use super::nearest_label::NearestLabel;
use super::scene::Scene;
use super::window::{Reach, Window};
use super::*;
use crate::heightmap::{HeightMap, height_map};

pub(crate) const CELL: f64 = 0.0625;

fn map_of(height: impl Fn(f64, f64) -> f64) -> HeightMap {
    let at = |i: i32| (f64::from(i) + 0.5) * CELL;
    let place = |i: i32| (at(i % 128), at(i / 128));
    let points: Vec<_> = (0..128 * 96).map(place).map(|(x, y)| [x, y, height(x, y)]).collect();
    height_map(&points, CELL).unwrap()
}

/// A map with the exact height in the middle of each cell; NaN is unseen.
pub(crate) fn exact(height: impl Fn(f64, f64) -> f64) -> HeightMap {
    let mut map = map_of(|_, _| 0.0);
    let middles = (0..map.grid.len()).map(|cell| map.grid.center(cell));
    map.heights_m = middles.map(|[x, y]| height(x, y)).collect();
    map
}

/// The objects of a map: the connected components of the cells that are `found`.
pub(crate) fn measured(map: &HeightMap, found: impl Fn(f64, f64) -> bool) -> Vec<Object> {
    let labels = labels_of(map, |x, y| if found(x, y) { 0 } else { UNLABELLED });
    let labels = label_components(&map.grid, &labels, 0, 9);
    measure(&map.grid, &map.heights_m, &Found::on_all_else(labels.clone()), &settings()).unwrap()
}

/// Only ground.
fn nothing(map: &HeightMap) -> Found<'static> {
    Found::on_all_else(vec![UNLABELLED; map.grid.len()])
}

fn labels_of(map: &HeightMap, label: impl Fn(f64, f64) -> i32) -> Vec<i32> {
    (0..map.grid.len()).map(|c| map.grid.center(c)).map(|[x, y]| label(x, y)).collect()
}

/// What is known of the object on the cells that are `found`, and of the ground around it.
pub(crate) fn window_of(map: &HeightMap, found: impl Fn(f64, f64) -> bool) -> Window {
    let labels = labels_of(map, |x, y| if found(x, y) { 0 } else { UNLABELLED });
    let on_all_else = Found::on_all_else(labels.clone());
    let Settings { margin_m, toe_cells, annulus_share, .. } = settings();
    let scene = Scene::new(&map.grid, &map.heights_m, &on_all_else, margin_m).unwrap();
    let reach = Reach::each(&labels, toe_cells, annulus_share);
    let nearest = NearestLabel::grow(&map.grid, &labels, |_| true, reach[0].farthest());
    Window::all(&scene, &labels, &nearest, &reach).remove(0).1
}

pub(crate) fn settings() -> Settings {
    let ground = Base::ground(0.0, 0.0, 0.0);
    Settings {
        toe_cells: 4,
        annulus_share: 0.2,
        margin_m: 0.03,
        base: None,
        compared: vec![],
        ground,
        link_cells: 1,
        fewest_cells: 20,
        threads: 1,
    }
}

fn cone(x: f64, y: f64) -> f64 {
    (0.5 * (1.2 - (x - 4.0).hypot(y - 3.0))).max(0.0)
}

const CONE_M3: f64 = std::f64::consts::PI * 1.44 * 0.6 / 3.0;

fn cone_on(floor: impl Fn(f64, f64) -> f64) -> Object {
    let map = map_of(|x, y| cone(x, y) + floor(x, y));
    let labels = labels_of(&map, |x, y| if cone(x, y) > 0.05 { 0 } else { UNLABELLED });
    measure(&map.grid, &map.heights_m, &Found::on_all_else(labels.clone()), &settings())
        .unwrap()
        .remove(0)
}

use crate::connectivity::UNLABELLED;

#[test]
fn a_cone_on_a_sloping_floor_keeps_its_toe() {
    let object = cone_on(|x, y| 3.0 + 0.04 * x - 0.02 * y);
    assert!((object.volume.net_m3() / CONE_M3 - 1.0).abs() < 2e-3, "{object:?}");
    assert_eq!(
        (object.reason, object.touches_edge, object.base.kind),
        (None, false, Kind::Annulus)
    );
    let footprint = object.footprint_m2 / (std::f64::consts::PI * 1.44);
    assert!((footprint - 1.0).abs() < 0.08, "{footprint}");
    assert!((object.centroid_m[0] - 4.0).abs() < 0.01 && (object.centroid_m[1] - 3.0).abs() < 0.01);
    assert!((object.seen_fraction - 1.0).abs() < 1e-12);
    assert!(object.outline_m.len() > 20);
}

#[test]
fn a_box_and_a_wall_are_no_piles_and_a_low_cone_beside_them_is() {
    let inside = |x: f64, y: f64| (1.0..2.0).contains(&x) && (1.0..2.0).contains(&y);
    let wall = |x: f64| x > 7.9;
    let map = map_of(|x, y| {
        if inside(x, y) {
            0.8
        } else if wall(x) {
            1.5
        } else {
            cone(x, y)
        }
    });
    let label = |x, y| {
        if inside(x, y) {
            1
        } else if wall(x) {
            2
        } else if cone(x, y) > 0.05 {
            0
        } else {
            UNLABELLED
        }
    };
    let objects = measure(
        &map.grid,
        &map.heights_m,
        &Found::on_all_else(labels_of(&map, label)),
        &settings(),
    )
    .unwrap();
    let reasons: Vec<_> = objects.iter().map(|o| o.reason).collect();
    assert_eq!(reasons, [None, Some(Reason::SteepSides), Some(Reason::Thin)]);
    assert!((objects[1].volume.net_m3() - 0.8).abs() < 1e-9);
    assert!((objects[1].footprint_m2 - 1.0).abs() < 1e-9);
    assert!(objects[2].touches_edge && !objects[1].touches_edge);
}

#[test]
fn a_rod_with_a_skirt_is_no_pile() {
    let rod = |x: f64, y: f64| (1.5 - 4.0 * (x - 4.0).hypot(y - 3.0)).max(0.0);
    let map = map_of(rod);
    let labels = labels_of(&map, |x, y| if rod(x, y) > 0.05 { 0 } else { UNLABELLED });
    let object =
        measure(&map.grid, &map.heights_m, &Found::on_all_else(labels.clone()), &settings())
            .unwrap()
            .remove(0);
    assert_eq!(object.reason, Some(Reason::SteepSides));
}

#[test]
fn a_gap_in_the_core_is_filled_counted_and_paid_for() {
    let mut map = map_of(|x, y| cone(x, y) + 1.0);
    let labels = labels_of(&map, |x, y| if cone(x, y) > 0.05 { 0 } else { UNLABELLED });
    let whole =
        measure(&map.grid, &map.heights_m, &Found::on_all_else(labels.clone()), &settings())
            .unwrap()
            .remove(0);
    for cell in 0..map.grid.len() {
        let [x, y] = map.grid.center(cell);
        if (x - 4.5).hypot(y - 3.0) < 0.2 {
            map.heights_m[cell] = f64::NAN;
        }
    }
    let holed =
        measure(&map.grid, &map.heights_m, &Found::on_all_else(labels.clone()), &settings())
            .unwrap()
            .remove(0);
    assert!((holed.volume.net_m3() / whole.volume.net_m3() - 1.0).abs() < 0.01);
    assert!(holed.seen_fraction < 0.98 && holed.seen_fraction > 0.95);
    assert!(whole.budget.filled_m3 == 0.0 && holed.budget.filled_m3 > 0.0);
    assert!(holed.budget.combined_m3() > whole.budget.combined_m3());
}

#[test]
fn labels_must_match_the_map_and_may_name_nothing() {
    let map = map_of(|_, _| 0.0);
    assert!(
        measure(&map.grid, &map.heights_m, &Found::on_all_else(vec![0; 3]), &settings()).is_err()
    );
    assert!(
        measure(
            &map.grid,
            &map.heights_m,
            &Found::on_all_else(vec![UNLABELLED; map.grid.len()]),
            &settings()
        )
        .unwrap()
        .is_empty()
    );
}

fn ring(corners: &[[f64; 2]]) -> Region {
    Region { rings: vec![corners.to_vec()] }
}

#[test]
fn an_outline_cuts_a_wedge_where_it_runs() {
    let wedge = |x: f64, _: f64| 0.25 * x;
    let map = map_of(wedge);
    let square = ring(&[[2.03, 1.07], [5.51, 1.07], [5.51, 4.99], [2.03, 4.99]]);
    let level = Base::ground(0.0, 0.0, 0.0);
    let settings = Settings { base: Some(level), ..settings() };
    let object = measure_inside(&map.grid, &map.heights_m, &[square], &nothing(&map), &settings)
        .unwrap()
        .remove(0);
    let truth = 0.125 * (5.51_f64.powi(2) - 2.03_f64.powi(2)) * 3.92;
    assert!((object.volume.net_m3() / truth - 1.0).abs() < 1e-9, "{object:?}");
    assert!((object.footprint_m2 - 3.48 * 3.92).abs() < 1e-9);
    assert!(!object.touches_edge && object.reason.is_none() && object.outline_m.len() == 4);
}

#[test]
fn the_base_of_an_outline_rests_on_the_ring_outside_and_a_hole_stays_one() {
    let map = map_of(|x, y| cone(x, y) + 1.0 + 0.03 * x);
    let mut region = ring(&[[2.5, 1.5], [5.5, 1.5], [5.5, 4.5], [2.5, 4.5]]);
    let found = |region: &Region| {
        let regions = std::slice::from_ref(region);
        measure_inside(&map.grid, &map.heights_m, regions, &nothing(&map), &settings())
            .unwrap()
            .remove(0)
    };
    let whole = found(&region).volume.net_m3();
    assert!((whole / CONE_M3 - 1.0).abs() < 2e-3, "{whole}");
    region.rings.push(vec![[3.75, 2.75], [3.75, 3.25], [4.25, 3.25], [4.25, 2.75]]);
    let holed = found(&region).volume.net_m3();
    // Mean distance from the middle of a square of 0.5 m: 0.3826 times its edge.
    let core = 0.25 * 0.5 * (1.2 - 0.5 * 0.382_6);
    assert!(((whole - holed) / core - 1.0).abs() < 0.01, "{whole} {holed} {core}");
}

#[test]
fn outlines_beyond_the_scan_are_refused_or_flagged() {
    let map = map_of(cone);
    let inside = |x0: f64, x1: f64| {
        let region = ring(&[[x0, 2.0], [x1, 2.0], [x1, 4.0], [x0, 4.0]]);
        measure_inside(&map.grid, &map.heights_m, &[region], &nothing(&map), &settings())
    };
    assert!(inside(20.0, 22.0).is_err());
    let over = inside(6.0, 10.0).unwrap().remove(0);
    assert!(over.touches_edge && (over.seen_fraction - 0.5).abs() < 0.01, "{over:?}");
}

#[test]
fn bases_are_compared_and_what_all_share_is_held_against_the_ground_around() {
    let map = map_of(|x, y| cone(x, y) + 0.02);
    let labels = labels_of(&map, |x, y| if cone(x, y) > 0.05 { 0 } else { UNLABELLED });
    let compared =
        vec![None, Some(Base::ground(0.0, 0.0, 0.001)), Some(Base::ground(0.02, 0.0, 0.001))];
    let settings = Settings { compared, base: Some(Base::ground(0.0, 0.0, 0.001)), ..settings() };
    let object = measure(&map.grid, &map.heights_m, &Found::on_all_else(labels.clone()), &settings)
        .unwrap()
        .remove(0);
    let [local, low, level] = object.compared_m3[..] else { panic!("{object:?}") };
    assert!((local - level).abs() < 1e-6 && low == object.volume.net_m3());
    assert!((object.base.u_level_m - 0.02).abs() < 1e-9);
    assert!(object.budget.base_m3 > 0.9 * (low - level));
    let given = Base::plane(0.0, [0.0; 2], 0.0, 0.001, Kind::Given);
    let settings = Settings { base: Some(given), ..settings };
    let object = measure(&map.grid, &map.heights_m, &Found::on_all_else(labels.clone()), &settings)
        .unwrap()
        .remove(0);
    assert!((object.base.u_level_m - 0.001).abs() < 1e-12);
    let below = base_map(&map.grid, &[object]);
    assert!(below.iter().any(|b| b.is_nan()) && below.contains(&0.0));
}

#[test]
fn an_earlier_surface_is_the_base_waves_and_all() {
    let floor = |x: f64, y: f64| 0.05 * (1.5 * x).sin() + 0.02 * y;
    let empty = map_of(floor);
    let full = map_of(|x, y| cone(x, y) + floor(x, y));
    let labels = labels_of(&full, |x, y| if cone(x, y) > 0.05 { 0 } else { UNLABELLED });
    let volume = |empty_m: Vec<f64>| {
        let base = Base::on(Surface::over(full.grid, empty_m).unwrap(), 0.0);
        let settings = Settings { base: Some(base), ..settings() };
        measure(&full.grid, &full.heights_m, &Found::on_all_else(labels.clone()), &settings)
            .unwrap()
            .remove(0)
    };
    let whole = volume(empty.heights_m.clone());
    assert!((whole.volume.net_m3() / CONE_M3 - 1.0).abs() < 2e-3);
    let hole = |cell: usize| {
        let [x, y] = empty.grid.center(cell);
        (x - 4.0).hypot(y - 3.0) < 0.5
    };
    let seen = empty.heights_m.iter().enumerate();
    let holed = volume(seen.map(|(cell, &h)| if hole(cell) { f64::NAN } else { h }).collect());
    assert!(holed.budget.base_m3 > whole.budget.base_m3 + 0.001);
    let off = (holed.volume.net_m3() - whole.volume.net_m3()).abs();
    assert!(off < 2.0 * holed.budget.base_m3, "{off} {:?}", holed.budget);
}

/// The cone on a sloping floor, seen only where `seen` holds.
fn half_seen(seen: impl Fn(f64, f64) -> bool) -> Object {
    let mut map = map_of(|x, y| cone(x, y) + 1.0 + 0.01 * x);
    for cell in 0..map.grid.len() {
        let [x, y] = map.grid.center(cell);
        if !seen(x, y) {
            map.heights_m[cell] = f64::NAN;
        }
    }
    let labels: Vec<i32> = (0..map.grid.len())
        .map(|cell| (map.grid.center(cell), map.heights_m[cell]))
        .map(|([x, y], h)| if h > 1.05 + 0.01 * x && cone(x, y) > 0.05 { 0 } else { UNLABELLED })
        .collect();
    measure(&map.grid, &map.heights_m, &Found::on_all_else(labels.clone()), &settings())
        .unwrap()
        .remove(0)
}

/// Everything but the shadow behind the cone, which begins `from` m from its axis.
fn lit(from: f64) -> impl Fn(f64, f64) -> bool {
    move |x, y| x < 4.0 + from || (y - 3.0).abs() > 1.6 || x > 6.2
}

#[test]
fn a_cone_with_its_far_half_hidden_has_its_volume() {
    // At the crest itself the rim is known to within a cell, a tenth of the cone's height.
    for (from, within) in [(0.0, 0.07), (0.2, 0.05), (0.5, 0.05)] {
        let object = half_seen(lit(from));
        let off = object.volume.net_m3() - CONE_M3;
        assert!(off.abs() < within * CONE_M3, "{from} {}", off / CONE_M3);
        assert!(off.abs() < 2.0 * object.budget.combined_m3(), "{from} {off} {:?}", object.budget);
        assert!(object.budget.filled_m3 < 0.1 * CONE_M3, "{from} {:?}", object.budget);
        assert_eq!((object.reason, object.touches_edge), (None, false), "{from}");
    }
    assert!((half_seen(lit(0.0)).seen_fraction - 0.5).abs() < 0.05);
}

#[test]
fn strays_in_the_shadow_are_no_evidence() {
    let stray =
        |x: f64, y: f64| ((x / CELL) as usize * 7 + (y / CELL) as usize * 3).is_multiple_of(23);
    let object = half_seen(|x, y| lit(0.2)(x, y) || stray(x, y));
    let clean = half_seen(lit(0.2));
    assert!((object.volume.net_m3() / clean.volume.net_m3() - 1.0).abs() < 0.01);
}

#[test]
fn a_pile_of_which_too_little_was_seen_is_refused() {
    let object = half_seen(|x, y| (y - 3.0).abs() < 0.25 || (x - 4.0).hypot(y - 3.0) > 1.5);
    assert!(object.seen_fraction < 0.4, "{}", object.seen_fraction);
    assert_eq!(object.reason, Some(Reason::TooLittleSeen));
}

#[test]
fn a_large_pile_far_away_changes_nothing() {
    let crumb = |x: f64, y: f64| (0.5 * (0.4 - (x - 7.0).hypot(y - 0.8))).max(0.0);
    let map = map_of(|x, y| cone(x, y) + crumb(x, y) + 0.01 * (3.0 * x).sin() * (2.0 * y).cos());
    let measured = |label: &dyn Fn(f64, f64) -> i32| {
        let labels = labels_of(&map, label);
        measure(&map.grid, &map.heights_m, &Found::on_all_else(labels.clone()), &settings())
            .unwrap()
    };
    let is_crumb = |x, y| crumb(x, y) > 0.05;
    let alone = measured(&|x, y| if is_crumb(x, y) { 0 } else { UNLABELLED });
    let both = measured(&|x, y| match (cone(x, y) > 0.05, is_crumb(x, y)) {
        (true, _) => 0,
        (_, true) => 1,
        _ => UNLABELLED,
    });
    assert_eq!(both.len(), 2);
    assert_eq!((both[1].volume, both[1].budget), (alone[0].volume, alone[0].budget));
}
