//! The model of the scene so far: surfels, the means of patches in cubes, and a search for the
//! nearest.

use kiddo::{ImmutableKdTree, SquaredEuclidean};
use nalgebra::Vector3;

use super::keys::{Cells, cell, number};
use super::motion::Motion;
use super::patches::Patch;

/// A surface element: mean place (m), normal, and number of pixels.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Surfel {
    pub(crate) at: Vector3<f64>,
    pub(crate) normal: Vector3<f64>,
    pub(crate) count: f64,
}

#[derive(Debug, Clone, Copy, Default)]
struct CubeSums {
    at: Vector3<f64>,
    normal: Vector3<f64>,
    count: f64,
}

/// CubeSums of patches, one for each cube.
#[derive(Debug, Clone)]
pub(crate) struct Model {
    cube_m: f64,
    cubes: Cells<CubeSums>,
}

/// Least length of the mean normal in a cube; if it is shorter, the cube holds an edge and has no
/// surfel. Chosen: two faces at a right angle have 0.71 (closed form: √½); higher loses noisy
/// surfaces.
const AGREEING: f64 = 0.8;
/// Two surfels nearer than this share of a cube's width are one, split by a face between cubes.
/// Chosen: lower leaves surfaces double, higher drops true neighbours, a width apart.
const APART: f64 = 0.6;

impl Model {
    pub(crate) fn new(cube_m: f64) -> Self {
        Self { cube_m, cubes: Cells::default() }
    }

    /// Adds the patches of a frame at `pose`.
    pub(crate) fn add(&mut self, patches: &[Patch], pose: &Motion) {
        for patch in patches {
            self.put(pose.apply(&patch.at), pose.rotation * patch.normal, patch.count);
        }
    }

    /// Adds a surface element of `count` pixels.
    pub(crate) fn put(&mut self, at: Vector3<f64>, normal: Vector3<f64>, count: f64) {
        let cell = std::array::from_fn(|k| (at[k] / self.cube_m).floor() as i64);
        if let Some(key) = number(cell) {
            let sums = self.cubes.entry(key).or_default();
            sums.at += at * count;
            sums.normal += normal * count;
            sums.count += count;
        }
    }

    /// The surfels in the order of their cubes; of those split by a face between cubes, the larger.
    pub(crate) fn surfels(&self) -> Vec<Surfel> {
        let mean = |(&key, sums): (&u64, &CubeSums)| {
            let length = sums.normal.norm();
            (length > AGREEING * sums.count).then(|| {
                let (at, normal) = (sums.at / sums.count, sums.normal / length);
                (key, Surfel { at, normal, count: sums.count })
            })
        };
        let all: Cells<Surfel> = self.cubes.iter().filter_map(mean).collect();
        let mut kept: Vec<(u64, Surfel)> = all
            .iter()
            .filter(|(key, one)| !self.is_beside_greater(**key, one, &all))
            .map(|(&key, &one)| (key, one))
            .collect();
        kept.sort_unstable_by_key(|&(key, _)| key);
        kept.into_iter().map(|(_, one)| one).collect()
    }

    /// Memory of the cubes, in bytes.
    pub(crate) fn bytes(&self) -> usize {
        self.cubes.capacity() * (size_of::<(u64, CubeSums)>() + 1)
    }

    /// Distance of a place from a cube, in m.
    fn away_m(&self, cube: &[i64; 3], at: &Vector3<f64>) -> f64 {
        let outside = |k: usize| {
            let low = cube[k] as f64 * self.cube_m;
            (low - at[k]).max(at[k] - low - self.cube_m).max(0.0)
        };
        Vector3::from_fn(|k, _| outside(k)).norm()
    }

    /// Whether a cube beside it holds more of the same surface; ties go to the lower key.
    fn is_beside_greater(&self, key: u64, one: &Surfel, all: &Cells<Surfel>) -> bool {
        let most = APART * self.cube_m;
        let own = cell(key);
        (0..27).filter(|&k| k != 13).any(|k: i64| {
            let other = [own[0] + k % 3 - 1, own[1] + k / 3 % 3 - 1, own[2] + k / 9 - 1];
            if self.away_m(&other, &one.at) > most {
                return false;
            }
            number(other).and_then(|other| Some((other, all.get(&other)?))).is_some_and(
                |(other, beside)| {
                    let is_greater =
                        beside.count > one.count || (beside.count == one.count && other < key);
                    is_greater && (beside.at - one.at).norm() < most
                },
            )
        })
    }
}

/// Surfels with a search by place.
#[derive(Debug)]
pub(crate) struct Index {
    pub(crate) surfels: Vec<Surfel>,
    pub(crate) cube_m: f64,
    tree: Option<ImmutableKdTree<f64, 3>>,
}

impl Index {
    pub(crate) fn new(surfels: Vec<Surfel>, cube_m: f64) -> Self {
        let places: Vec<[f64; 3]> = surfels.iter().map(|s| s.at.into()).collect();
        let tree = ImmutableKdTree::new_from_slice(&places).ok().filter(|_| !places.is_empty());
        Self { surfels, cube_m, tree }
    }

    /// Index of the surfel nearest to a place, within a distance.
    #[inline]
    pub(crate) fn nearest(&self, at: &Vector3<f64>, within_m: f64) -> Option<usize> {
        let place = [at.x, at.y, at.z];
        let query = self.tree.as_ref()?.query(&place);
        let found = query.nearest_one::<SquaredEuclidean<f64>>().execute();
        (found.distance <= within_m * within_m).then_some(found.item as usize)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn patch(at: [f64; 3]) -> Patch {
        Patch { at: at.into(), normal: Vector3::z(), count: 10.0, slope_var: 0.0, pixel: 0 }
    }

    #[test]
    fn a_floor_on_a_face_between_cubes_gives_one_surfel_a_place() {
        let mut model = Model::new(0.1);
        let floor: Vec<Patch> = (0..100)
            .map(|i| {
                patch([f64::from(i % 10) * 0.1 + 0.05, 0.05, if i < 60 { 0.001 } else { -0.001 }])
            })
            .collect();
        model.add(&floor, &Motion::default());
        let surfels = model.surfels();
        assert_eq!(surfels.len(), 10);
        assert!(surfels.iter().all(|s| s.at.z == 0.001));
    }

    #[test]
    fn the_index_finds_what_a_search_of_all_finds() {
        let at = |i: u64, k: u64| (crate::sample::mix(3 * i + k) % 1000) as f64 / 1000.0;
        let surfels: Vec<Surfel> = (0..500)
            .map(|i| Surfel {
                at: Vector3::new(at(i, 0), at(i, 1), at(i, 2)),
                normal: Vector3::z(),
                count: 1.0,
            })
            .collect();
        let index = Index::new(surfels.clone(), 0.1);
        for i in 1000..1100 {
            let place = Vector3::new(at(i, 0), at(i, 1), at(i, 2));
            let slow = (0..500).min_by(|&a, &b| {
                (surfels[a].at - place).norm().total_cmp(&(surfels[b].at - place).norm())
            });
            assert_eq!(index.nearest(&place, 9.0), slow);
        }
        assert_eq!(index.nearest(&Vector3::new(5.0, 0.0, 0.0), 0.1), None);
        assert_eq!(Index::new(Vec::new(), 0.1).nearest(&Vector3::zeros(), 1.0), None);
    }
}
