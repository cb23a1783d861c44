//! Small plane patches of a frame: means and normals of blocks of pixels.

use nalgebra::{Matrix3, Vector3};

use crate::parallel::map_chunks;

use super::camera::Camera;

/// A block of pixels on one plane, in the camera's frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Patch {
    /// The mean of its points, in metres.
    pub at: Vector3<f64>,
    /// The mean of its rays: where it moves if all ranges grow.
    pub ray: Vector3<f64>,
    /// The normal, towards the camera.
    pub normal: Vector3<f64>,
    /// Pixels.
    pub count: f64,
    /// Root mean square distance of the points from their plane.
    pub rms_m: f64,
    /// Variance of the normal's slope by that.
    pub slope_var: f64,
    /// A pixel in its middle.
    pub pixel: usize,
}

impl Patch {
    /// Cosine of the incidence.
    #[must_use]
    pub fn cosine(&self) -> f64 {
        -self.ray.dot(&self.normal)
    }
}

/// Share of a block's pixels that must lie on a surface.
const FULL: f64 = 0.6;
/// Least cosine of the incidence: 80°, as at depth edges.
const GRAZING: f64 = 0.17;
/// A patch is no plane if it is thicker than this part of its width, both as standard deviations.
const THICK: f64 = 0.5;
/// Rows of blocks that a thread takes at a time.
const CHUNK: usize = 4;

/// The patches of a frame, row by row of its blocks.
#[must_use]
pub fn patches(camera: &Camera, ranges_m: &[f64], usable: &[bool], threads: usize) -> Vec<Patch> {
    let block = camera.block();
    let across = camera.columns / block;
    let found = map_chunks(camera.rows / block, CHUNK, threads, |rows| {
        let mut found = Vec::new();
        for row in rows {
            for column in 0..across {
                let corner = row * block * camera.columns + column * block;
                found.extend(patch(camera, ranges_m, usable, corner, block));
            }
        }
        found
    });
    found.concat()
}

fn patch(
    camera: &Camera,
    ranges_m: &[f64],
    usable: &[bool],
    corner: usize,
    block: usize,
) -> Option<Patch> {
    let pixels = (0..block * block).map(|k| corner + k / block * camera.columns + k % block);
    let middle = corner + block / 2 * camera.columns + block / 2;
    let anchor = camera.rays[middle] * ranges_m[middle];
    if !usable[middle] {
        return None;
    }
    let kept: Vec<usize> = pixels.filter(|&i| usable[i]).collect();
    if (kept.len() as f64) < FULL * (block * block) as f64 {
        return None;
    }
    let count = kept.len() as f64;
    let at = kept.iter().map(|&i| camera.rays[i] * ranges_m[i] - anchor).sum::<Vector3<f64>>()
        / count
        + anchor;
    let ray = kept.iter().map(|&i| camera.rays[i]).sum::<Vector3<f64>>().normalize();
    let plane = Plane::of(&ray, kept.iter().map(|&i| (camera.rays[i], ranges_m[i])))?;
    let cosine = -ray.dot(&plane.normal);
    let rms_m = plane.rms * at.dot(&ray) * cosine;
    let wide_m = plane.wide * at.dot(&ray) / cosine;
    let is_flat = cosine > GRAZING && rms_m < THICK * wide_m;
    let slope_var = rms_m * rms_m / (count * wide_m * wide_m);
    is_flat.then_some(Patch {
        at,
        ray,
        normal: plane.normal,
        count,
        rms_m,
        slope_var,
        pixel: middle,
    })
}

/// A plane through pixels, by regression of inverse ranges.
///
/// On a plane `n · p = d` seen along rays, `1 / range = n · ray / d` is linear in the ray, which is
/// known exactly. The flattest axis of the points themselves would be tilted: their noise moves
/// them along the ray, and so at once along and across a plane that is seen at an angle.
struct Plane {
    normal: Vector3<f64>,
    /// Root mean square residual, as a share of the range.
    rms: f64,
    /// Spread of the rays, in radians, across the narrower way.
    wide: f64,
}

impl Plane {
    fn of(
        ray: &Vector3<f64>,
        pixels: impl Iterator<Item = (Vector3<f64>, f64)> + Clone,
    ) -> Option<Self> {
        let aside = if ray.x.abs() < 0.9 { Vector3::x() } else { Vector3::y() };
        let across = ray.cross(&aside).normalize();
        let down = ray.cross(&across);
        let row = |(one, range): (Vector3<f64>, f64)| {
            let ahead = one.dot(ray);
            let at = Vector3::new(1.0, one.dot(&across) / ahead, one.dot(&down) / ahead);
            (at, 1.0 / (range * ahead))
        };
        let (mut normal, mut right) = (Matrix3::zeros(), Vector3::zeros());
        for (at, inverse) in pixels.clone().map(row) {
            normal += at * at.transpose();
            right += at * inverse;
        }
        let found = normal.cholesky()?.solve(&right);
        let square: f64 =
            pixels.map(row).map(|(at, y)| (y - at.dot(&found)) * (y - at.dot(&found))).sum();
        let count = normal[(0, 0)];
        let spread =
            |k: usize| normal[(k, k)] / count - (normal[(0, k)] / count) * (normal[(0, k)] / count);
        let direction = ray * found.x + across * found.y + down * found.z;
        (found.x > 0.0).then(|| Self {
            normal: -direction.normalize(),
            rms: (square / count).sqrt() / found.x,
            wide: spread(1).min(spread(2)).max(0.0).sqrt(),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frames::noise::tests::{camera, plane};

    #[test]
    fn patches_of_a_plane_lie_on_it_and_face_the_camera() {
        let camera = camera(96, 128);
        let ranges = plane(&camera, [0.3, 0.0, 1.0], 2.0);
        let usable = vec![true; ranges.len()];
        let found = patches(&camera, &ranges, &usable, 2);
        assert!(found.len() > 2000);
        let n = Vector3::new(-0.3, 0.0, -1.0).normalize();
        for one in &found {
            assert!((one.normal - n).norm() < 1e-6 && one.cosine() > 0.5);
            assert!((n.dot(&one.at) + 2.0 * -n.z).abs() < 1e-9, "{one:?}");
        }
        assert_eq!(found, patches(&camera, &ranges, &usable, 1));
    }

    #[test]
    fn nothing_comes_of_pixels_that_are_not_usable() {
        let camera = camera(20, 20);
        let ranges = plane(&camera, [0.0, 0.0, 1.0], 2.0);
        assert!(patches(&camera, &ranges, &vec![false; 400], 1).is_empty());
    }
}
