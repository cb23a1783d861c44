//! Placed frames: all with their poses, some also with their patches, which are solved for jointly.

use nalgebra::Vector3;

use super::motion::Motion;
use super::patches::Patch;

/// Most frames with patches; beyond, every second one is dropped. Chosen: the solution takes time
/// with the cube of their number (7 unknowns each); of fewer, more are registered afterwards.
const MOST: usize = 64;

/// A patch in compact form, with a resolution of 1/8 µm.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Held {
    at: [f32; 3],
    normal: [f32; 3],
    count: f32,
}

impl Held {
    fn of(patch: &Patch) -> Self {
        let [at, normal] = [patch.at, patch.normal].map(|v| v.map(|one| one as f32).into());
        Self { at, normal, count: patch.count as f32 }
    }

    /// Its place if `offset_m` is added to the ranges.
    #[inline]
    pub(crate) fn at(&self, offset_m: f64) -> Vector3<f64> {
        let at = Vector3::from(self.at.map(f64::from));
        if offset_m == 0.0 { at } else { at * (1.0 + offset_m / at.norm()) }
    }

    #[inline]
    pub(crate) fn normal(&self) -> Vector3<f64> {
        Vector3::from(self.normal.map(f64::from))
    }

    pub(crate) fn count(&self) -> f64 {
        f64::from(self.count)
    }

    /// Cosine of the incidence.
    pub(crate) fn cosine(&self) -> f64 {
        let at = self.at(0.0);
        -at.dot(&self.normal()) / at.norm()
    }
}

/// A frame that was placed.
#[derive(Debug, Clone)]
pub(crate) struct Keyframe {
    pub(crate) pose: Motion,
    /// Its pose as registered with the frames before it.
    pub(crate) laid: Motion,
    /// Its patches; empty for frames that are not solved for.
    pub(crate) patches: Vec<Held>,
}

/// The frames in sequence; `None` if one was left out.
#[derive(Debug)]
pub(crate) struct Keyframes {
    pub(crate) frames: Vec<Option<Keyframe>>,
    placed: usize,
    every: usize,
}

impl Keyframes {
    pub(crate) fn new() -> Self {
        Self { frames: Vec::new(), placed: 0, every: 1 }
    }

    pub(crate) fn leave_out(&mut self) {
        self.frames.push(None);
    }

    /// Keeps a frame; if too many have patches, every second drops them.
    pub(crate) fn push(&mut self, pose: Motion, patches: &[Patch]) {
        let is_held = self.placed.is_multiple_of(self.every);
        let patches = if is_held { patches.iter().map(Held::of).collect() } else { Vec::new() };
        self.frames.push(Some(Keyframe { pose, laid: pose, patches }));
        self.placed += 1;
        if self.placed.div_ceil(self.every) > MOST {
            self.every *= 2;
            let every = self.every;
            let others = self.frames.iter_mut().flatten().enumerate();
            others
                .filter(|(k, _)| !k.is_multiple_of(every))
                .for_each(|(_, frame)| frame.patches = Vec::new());
        }
    }

    /// Memory of the patches, in bytes.
    pub(crate) fn bytes(&self) -> usize {
        let patches: usize = self.frames.iter().flatten().map(|one| one.patches.capacity()).sum();
        patches * size_of::<Held>() + self.frames.capacity() * size_of::<Option<Keyframe>>()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn of_many_frames_every_so_many_is_held() {
        let patch = Patch {
            at: Vector3::new(0.3, 0.1, 1.2),
            normal: -Vector3::z(),
            count: 64.0,
            slope_var: 0.0,
            pixel: 0,
        };
        let mut keyframes = Keyframes::new();
        for _ in 0..200 {
            keyframes.push(Motion::default(), &[patch]);
        }
        let held = |one: &Option<Keyframe>| one.as_ref().is_some_and(|one| !one.patches.is_empty());
        let numbers: Vec<usize> = (0..200).filter(|&k| held(&keyframes.frames[k])).collect();
        assert_eq!(numbers, (0..50).map(|k| 4 * k).collect::<Vec<_>>());
        let one = &keyframes.frames[0].as_ref().unwrap().patches[0];
        assert!((one.at(0.01).norm() - patch.at.norm() - 0.01).abs() < 1e-7);
        assert!((one.cosine() - patch.cosine()).abs() < 1e-6);
    }
}
