//! The length of a hypotenuse, with the same bits on every machine.
//!
//! `f64::hypot` is the C library's: glibc's differs between x86-64 and aarch64 in the last bit, and
//! from version to version. Sums of squares are no danger here: no length in metres overflows them.

/// Two numbers as the legs of a right triangle.
pub(crate) trait Hypotenuse {
    /// The root of the sum of both squares.
    fn hypotenuse(self, other: f64) -> f64;
}

impl Hypotenuse for f64 {
    fn hypotenuse(self, other: f64) -> f64 {
        (self * self + other * other).sqrt()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_is_that_of_pythagoras() {
        assert_eq!(3.0.hypotenuse(-4.0), 5.0);
        assert_eq!(0.0.hypotenuse(0.0), 0.0);
        assert!((1e-9.hypotenuse(2e-9) - f64::hypot(1e-9, 2e-9)).abs() < 1e-24);
    }
}
