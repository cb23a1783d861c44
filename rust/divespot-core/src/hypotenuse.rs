//! The length of a hypotenuse, with the same bits on every machine.
//!
//! `f64::hypot` calls the C library. That of glibc differs in the last bit between x86-64 and
//! aarch64, and between versions. The plain root of a sum of squares is safe here, since no length
//! in m overflows it.

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
