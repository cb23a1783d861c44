//! Which frames saw each surfel, and where each of them puts it.

use nalgebra::Vector3;

use crate::parallel::map_each;

use super::keyframe::{Held, Keyframe};
use super::model::{Index, Model, Surfel};
use super::motion::Motion;
use super::noise::NoiseTable;

/// A frame's observation of a surfel, in the camera's coordinates.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Sight {
    frame: u32,
    at: [f32; 3],
    /// Variance of its distance from the surfel's plane due to the pixels' noise, in m².
    noise_m2: f32,
}

impl Sight {
    pub(crate) fn frame(&self) -> usize {
        self.frame as usize
    }

    pub(crate) fn noise_m2(&self) -> f64 {
        f64::from(self.noise_m2)
    }

    /// Its place if `offset_m` is added to the ranges, and its ray.
    #[inline]
    pub(crate) fn at(&self, offset_m: f64) -> (Vector3<f64>, Vector3<f64>) {
        let at = Vector3::from(self.at.map(f64::from));
        let ray = at / at.norm();
        (at + ray * offset_m, ray)
    }
}

/// A surfel and its observations.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Link<'a> {
    pub(crate) surfel: &'a Surfel,
    pub(crate) sights: &'a [Sight],
}

/// The surfels of all frames, with their observations.
#[derive(Debug, Default)]
pub(crate) struct Links {
    surfels: Vec<Surfel>,
    /// The start of each surfel's observations, and the end of the last.
    starts: Vec<usize>,
    sights: Vec<Sight>,
}

/// Least cosine of the angle between normals of one surface: 26°. Chosen: lower links both sides of
/// an edge, higher loses noisy normals.
const ALIKE: f64 = 0.9;
/// A patch belongs to a surfel within this share of a cube's width. Chosen: from a cube's middle to
/// its corner (closed form: √3 / 2 = 0.87); higher links patches of the cubes beside.
const NEAR: f64 = 0.9;

/// A frame, its number, and the offset of its ranges.
#[derive(Clone, Copy)]
pub(crate) struct Seen<'a> {
    pub(crate) number: usize,
    pub(crate) frame: &'a Keyframe,
    pub(crate) offset_m: f64,
}

impl Links {
    /// The links of patches within `along_m` of a surfel's plane.
    pub(crate) fn of(
        frames: &[Seen<'_>],
        cube_m: f64,
        along_m: f64,
        noise: &NoiseTable,
        threads: usize,
    ) -> Self {
        let index = Index::new(model(frames, cube_m).surfels(), cube_m);
        let seen = map_each(frames, threads, |frame| sights(&index, frame, along_m, noise));
        Self::sorted(index.surfels, &seen)
    }

    fn sorted(surfels: Vec<Surfel>, seen: &[Vec<(usize, Sight)>]) -> Self {
        let mut starts = vec![0; surfels.len() + 1];
        seen.iter().flatten().for_each(|(surfel, _)| starts[surfel + 1] += 1);
        (0..surfels.len()).for_each(|k| starts[k + 1] += starts[k]);
        let mut next = starts.clone();
        let none = Sight { frame: 0, at: [0.0; 3], noise_m2: 0.0 };
        let mut sights = vec![none; starts[surfels.len()]];
        for (surfel, sight) in seen.iter().flatten() {
            sights[next[*surfel]] = *sight;
            next[*surfel] += 1;
        }
        Self { surfels, starts, sights }
    }

    pub(crate) fn len(&self) -> usize {
        self.surfels.len()
    }

    pub(crate) fn get(&self, number: usize) -> Link<'_> {
        let sights = &self.sights[self.starts[number]..self.starts[number + 1]];
        Link { surfel: &self.surfels[number], sights }
    }

    pub(crate) fn iter(&self) -> impl Iterator<Item = Link<'_>> {
        (0..self.len()).map(|number| self.get(number))
    }

    /// Moves the surfels together with the frames.
    pub(crate) fn turn(&mut self, by: &Motion) {
        for surfel in &mut self.surfels {
            surfel.at = by.apply(&surfel.at);
            surfel.normal = by.rotation * surfel.normal;
        }
    }
}

/// The model made of the frames.
pub(crate) fn model(frames: &[Seen<'_>], cube_m: f64) -> Model {
    let mut model = Model::new(cube_m);
    for Seen { frame, offset_m, .. } in frames {
        for held in &frame.patches {
            let at = frame.pose.apply(&held.at(*offset_m));
            model.put(at, frame.pose.rotation * held.normal(), held.count());
        }
    }
    model
}

#[derive(Clone, Copy, Default)]
struct Sum {
    at: Vector3<f64>,
    count: f64,
    noise_m2: f64,
}

/// A frame's observations, with the index of their surfels.
fn sights(index: &Index, seen: &Seen<'_>, along_m: f64, noise: &NoiseTable) -> Vec<(usize, Sight)> {
    let mut sums = vec![Sum::default(); index.surfels.len()];
    for held in &seen.frame.patches {
        let Some(surfel) = home(index, held, seen, along_m) else { continue };
        let (at, count, cosine) = (held.at(0.0), held.count(), held.cosine());
        let sigma_m = noise.sigma_m(at.norm() as f32, cosine) * cosine;
        let sum = &mut sums[surfel];
        sum.at += at * count;
        sum.count += count;
        sum.noise_m2 += sigma_m * sigma_m * count;
    }
    let found = sums.iter().enumerate().filter(|(_, sum)| sum.count > 0.0);
    let sight = |sum: &Sum| Sight {
        frame: seen.number as u32,
        at: (sum.at / sum.count).map(|v| v as f32).into(),
        noise_m2: (sum.noise_m2 / sum.count / sum.count) as f32,
    };
    found.map(|(surfel, sum)| (surfel, sight(sum))).collect()
}

fn home(index: &Index, held: &Held, seen: &Seen<'_>, along_m: f64) -> Option<usize> {
    let pose = &seen.frame.pose;
    let at = pose.apply(&held.at(seen.offset_m));
    let number = index.nearest(&at, NEAR * index.cube_m)?;
    let surfel = &index.surfels[number];
    let alike = surfel.normal.dot(&(pose.rotation * held.normal())) > ALIKE;
    let off_m = surfel.normal.dot(&(at - surfel.at)).abs();
    (alike && off_m < along_m).then_some(number)
}
