//! Small plane patches of a frame: means (m) and normals of blocks of pixels.

use nalgebra::Vector3;

use crate::parallel::map_chunks;

use super::camera::{Axes, Camera};

/// A block of pixels on one plane, in the camera's coordinates.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Patch {
    /// Mean of its points, in m.
    pub at: Vector3<f64>,
    /// Unit normal, towards the camera.
    pub normal: Vector3<f64>,
    /// Number of pixels.
    pub count: f64,
    /// Variance of the normal's slope, from the distances of its points from their plane.
    pub slope_var: f64,
    /// Index of a pixel in its middle.
    pub pixel: usize,
}

impl Patch {
    /// Cosine of the incidence.
    #[must_use]
    pub fn cosine(&self) -> f64 {
        -self.at.dot(&self.normal) / self.at.norm()
    }
}

/// Least share of a block's pixels that lie on a surface. Chosen above half, so that a block has
/// one surface: lower takes patches at edges, higher loses dark surfaces.
const FULL: f64 = 0.6;
/// Least cosine of the incidence: 80°, as at depth edges.
const GRAZING: f64 = 0.17;
/// Largest thickness of a plane patch, as a share of its width (both standard deviations). Chosen:
/// a sphere of points has 1; lower loses far, noisy patches, higher takes edges for planes.
const THICK: f64 = 0.5;
/// Rows of blocks for a thread at a time. Decides no answer.
const CHUNK: usize = 4;

/// The patches of a frame, row by row of its blocks.
#[must_use]
pub fn patches(camera: &Camera, ranges_m: &[f32], usable: &[bool], threads: usize) -> Vec<Patch> {
    let (across, down) = camera.in_blocks();
    let found = map_chunks(down, CHUNK, threads, |rows| {
        let blocks = rows.start * across..rows.end * across;
        blocks.filter_map(|block| patch(camera, ranges_m, usable, block)).collect::<Vec<_>>()
    });
    found.concat()
}

fn patch(camera: &Camera, ranges_m: &[f32], usable: &[bool], number: usize) -> Option<Patch> {
    let (across, _) = camera.in_blocks();
    let (block, columns) = (camera.block, camera.columns);
    let corner = (number / across * columns + number % across) * block;
    let pixel = corner + block / 2 * (columns + 1);
    if !usable[pixel] {
        return None;
    }
    let anchor = 1.0 / f64::from(ranges_m[pixel]);
    let mut sums = PatchSums::default();
    for row in 0..block {
        let own = corner + row * columns..corner + row * columns + block;
        let pixels = camera.plan[own.clone()].iter().zip(&ranges_m[own.clone()]);
        for ((plan, range_m), _) in pixels.zip(&usable[own]).filter(|(_, usable)| **usable) {
            sums.add(plan.map(f64::from), f64::from(*range_m), anchor);
        }
    }
    if sums.count < FULL * (block * block) as f64 {
        return None;
    }
    sums.patch(&camera.blocks[number], anchor, pixel)
}

/// The sums from which a plane through pixels follows, by regression of inverse ranges.
///
/// On a plane `n · p = d` seen along rays, `1 / range = n · ray / d` is linear in the ray, which is
/// known exactly. A least-squares plane of the points themselves would be tilted: their noise is
/// along the ray, and therefore both along and across a plane at oblique incidence.
#[derive(Default)]
struct PatchSums {
    count: f64,
    /// Right, down, their squares and product.
    rays: [f64; 5],
    /// Inverse forward distance less that of the anchor: its sum, times right, times down, squared.
    inverse: [f64; 4],
    /// Distances right, down and forward, in m.
    places: [f64; 3],
}

impl PatchSums {
    #[inline]
    fn add(&mut self, [u, v, ahead]: [f64; 3], range_m: f64, anchor: f64) {
        let away_m = range_m * ahead;
        let y = 1.0 / away_m - anchor;
        self.count += 1.0;
        add(&mut self.rays, [u, v, u * u, v * v, u * v]);
        add(&mut self.inverse, [y, y * u, y * v, y * y]);
        add(&mut self.places, [u * away_m, v * away_m, away_m]);
    }

    fn patch(&self, axes: &Axes, anchor: f64, pixel: usize) -> Option<Patch> {
        let mean = |sum: f64| sum / self.count;
        let [u, v, uu, vv, uv] = self.rays.map(mean);
        let [y, yu, yv, yy] = self.inverse.map(mean);
        let (uu, vv, uv) = (uu - u * u, vv - v * v, uv - u * v);
        let (yu, yv, yy) = (yu - y * u, yv - y * v, yy - y * y);
        let area = uu * vv - uv * uv;
        let slope = [(yu * vv - yv * uv) / area, (yv * uu - yu * uv) / area];
        let level = y + anchor - slope[0] * u - slope[1] * v;
        if !(area > 0.0 && level > 0.0) {
            return None;
        }
        let [x_m, y_m, away_m] = self.places.map(mean);
        let at = axes.joined(x_m, y_m, away_m);
        let normal = -axes.joined(slope[0], slope[1], level).normalize();
        let patch = Patch { at, normal, count: self.count, slope_var: 0.0, pixel };
        let cosine = patch.cosine();
        let square = (yy - slope[0] * yu - slope[1] * yv).max(0.0);
        let rms_m = square.sqrt() / level * away_m * cosine;
        let wide_m = uu.min(vv).max(0.0).sqrt() * away_m / cosine;
        let is_flat = cosine > GRAZING && rms_m < THICK * wide_m;
        let slope_var = rms_m * rms_m / (self.count * wide_m * wide_m);
        is_flat.then_some(Patch { slope_var, ..patch })
    }
}

#[inline]
fn add<const N: usize>(sums: &mut [f64; N], values: [f64; N]) {
    (0..N).for_each(|k| sums[k] += values[k]);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frames::noise::tests::{camera_of, plane};

    #[test]
    fn patches_of_a_plane_lie_on_it_and_face_the_camera() {
        let camera = camera_of(96, 128);
        let ranges = plane(&camera, [0.3, 0.0, 1.0], 2.0);
        let usable = vec![true; ranges.len()];
        let found = patches(&camera, &ranges, &usable, 2);
        assert!(found.len() > 2000);
        let n = Vector3::new(-0.3, 0.0, -1.0).normalize();
        for one in &found {
            assert!((one.normal - n).norm() < 1e-4 && one.cosine() > 0.5);
            assert!((n.dot(&one.at) + 2.0 * -n.z).abs() < 1e-6, "{one:?}");
        }
        assert_eq!(found, patches(&camera, &ranges, &usable, 1));
    }

    #[test]
    fn nothing_comes_of_pixels_that_are_not_usable() {
        let camera = camera_of(20, 20);
        let ranges = plane(&camera, [0.0, 0.0, 1.0], 2.0);
        assert!(patches(&camera, &ranges, &vec![false; 400], 1).is_empty());
    }
}
