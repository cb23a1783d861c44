//! Which frames saw the same piece of a surface, and where each of them puts it.

use std::collections::BTreeMap;

use nalgebra::Vector3;

use crate::parallel::map_each;

use super::model::{Index, Model, Surfel};
use super::motion::Motion;
use super::noise::Noise;
use super::patches::Patch;
use super::track::Kept;

/// What a frame saw of a surfel, in the frame of its camera.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Sight {
    pub(crate) frame: usize,
    pub(crate) at: Vector3<f64>,
    pub(crate) ray: Vector3<f64>,
    pub(crate) count: f64,
    /// Variance of its distance from the surfel's plane by the noise of the pixels.
    pub(crate) noise_m2: f64,
}

/// A surfel, and what saw it.
#[derive(Debug, Clone)]
pub(crate) struct Link {
    pub(crate) surfel: Surfel,
    pub(crate) sights: Vec<Sight>,
}

/// Cosine of the angle between normals of one surface.
const ALIKE: f64 = 0.9;
/// A patch belongs to a surfel within this part of a cube.
const NEAR: f64 = 0.9;

/// The surfels of all frames, with the frames that saw each within `along_m` of its plane.
pub(crate) fn links(
    frames: &[(usize, &Kept)],
    cube_m: f64,
    along_m: f64,
    noise: &Noise,
    threads: usize,
) -> Vec<Link> {
    let mut model = Model::new(cube_m);
    frames.iter().for_each(|(_, kept)| model.add(&kept.patches, &kept.pose));
    let index = Index::new(model.surfels(), cube_m);
    let seen =
        map_each(frames, threads, |(frame, kept)| sights(&index, *frame, kept, along_m, noise));
    let mut found: Vec<Link> =
        index.surfels.iter().map(|&surfel| Link { surfel, sights: Vec::new() }).collect();
    for (surfel, sight) in seen.into_iter().flatten() {
        found[surfel].sights.push(sight);
    }
    found
}

/// What a frame saw, surfel by surfel.
fn sights(
    index: &Index,
    frame: usize,
    kept: &Kept,
    along_m: f64,
    noise: &Noise,
) -> Vec<(usize, Sight)> {
    let mut found: BTreeMap<usize, Sight> = BTreeMap::new();
    for patch in &kept.patches {
        let Some(surfel) = home(index, patch, &kept.pose, along_m) else { continue };
        let none =
            Sight { frame, at: Vector3::zeros(), ray: Vector3::zeros(), count: 0.0, noise_m2: 0.0 };
        let sight = found.entry(surfel).or_insert(none);
        sight.at += patch.at * patch.count;
        sight.ray += patch.ray * patch.count;
        sight.count += patch.count;
        let sigma_m = noise.sigma_m(patch.at.norm(), patch.cosine()) * patch.cosine();
        sight.noise_m2 += sigma_m * sigma_m * patch.count;
    }
    let mean = |sight: Sight| Sight {
        at: sight.at / sight.count,
        ray: sight.ray / sight.count,
        noise_m2: sight.noise_m2 / sight.count / sight.count,
        ..sight
    };
    found.into_iter().map(|(surfel, sight)| (surfel, mean(sight))).collect()
}

fn home(index: &Index, patch: &Patch, pose: &Motion, along_m: f64) -> Option<usize> {
    let at = pose.apply(&patch.at);
    let number = index.nearest(&at, NEAR * index.cube_m)?;
    let surfel = &index.surfels[number];
    let alike = surfel.normal.dot(&(pose.rotation * patch.normal)) > ALIKE;
    let off_m = surfel.normal.dot(&(at - surfel.at)).abs();
    (alike && off_m < along_m).then_some(number)
}
