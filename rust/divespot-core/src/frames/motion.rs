//! Rigid motions.

use nalgebra::{Matrix3, Vector3};

/// A rotation, then a translation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Motion {
    /// The rotation.
    pub rotation: Matrix3<f64>,
    /// The translation, in m.
    pub shift: Vector3<f64>,
}

impl Default for Motion {
    fn default() -> Self {
        Self { rotation: Matrix3::identity(), shift: Vector3::zeros() }
    }
}

impl Motion {
    /// The moved place.
    #[inline]
    #[must_use]
    pub fn apply(&self, p: &Vector3<f64>) -> Vector3<f64> {
        self.rotation * p + self.shift
    }

    /// First `other`, then this motion.
    #[must_use]
    pub fn after(&self, other: &Self) -> Self {
        Self {
            rotation: orthonormal(&(self.rotation * other.rotation)),
            shift: self.apply(&other.shift),
        }
    }

    /// The inverse motion.
    #[must_use]
    pub fn inverse(&self) -> Self {
        let rotation = self.rotation.transpose();
        Self { rotation, shift: -(rotation * self.shift) }
    }

    /// A small rotation `by` (axis times angle) about a place, then a translation.
    pub(crate) fn small(by: &Vector3<f64>, about: &Vector3<f64>, shift: &Vector3<f64>) -> Self {
        let rotation = turn(by);
        Self { rotation, shift: about - rotation * about + shift }
    }
}

/// The rotation about an axis by its length in radians (Rodrigues' formula).
pub(crate) fn turn(by: &Vector3<f64>) -> Matrix3<f64> {
    let angle = by.dot(by).sqrt();
    if angle < 1e-300 {
        return Matrix3::identity();
    }
    let k = (by / angle).cross_matrix();
    Matrix3::identity() + k * libm::sin(angle) + k * k * (1.0 - libm::cos(angle))
}

/// A rotation with its rounding errors removed (Gram-Schmidt).
fn orthonormal(m: &Matrix3<f64>) -> Matrix3<f64> {
    let x: Vector3<f64> = m.column(0).into();
    let x = x / x.dot(&x).sqrt();
    let y: Vector3<f64> = m.column(1).into();
    let y = y - x * x.dot(&y);
    let y = y / y.dot(&y).sqrt();
    Matrix3::from_columns(&[x, y, x.cross(&y)])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_motion_and_its_inverse_cancel() {
        let one = Motion {
            rotation: turn(&Vector3::new(0.3, -0.2, 0.9)),
            shift: Vector3::new(1.0, 2.0, 3.0),
        };
        let there = one.apply(&Vector3::new(0.1, 0.7, -4.0));
        assert!((one.inverse().apply(&there) - Vector3::new(0.1, 0.7, -4.0)).norm() < 1e-12);
        assert!((one.after(&one.inverse()).rotation - Matrix3::identity()).norm() < 1e-12);
    }

    #[test]
    fn a_quarter_turn_about_z_takes_x_to_y() {
        let quarter = turn(&Vector3::new(0.0, 0.0, std::f64::consts::FRAC_PI_2));
        assert!((quarter * Vector3::x() - Vector3::y()).norm() < 1e-12);
    }

    #[test]
    fn a_small_motion_leaves_its_pivot_but_for_the_shift() {
        let about = Vector3::new(1.0, -2.0, 0.5);
        let moved = Motion::small(&Vector3::new(0.1, 0.2, 0.3), &about, &Vector3::x());
        assert!((moved.apply(&about) - about - Vector3::x()).norm() < 1e-12);
    }
}
