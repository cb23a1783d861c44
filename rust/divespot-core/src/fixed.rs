//! Fixed-point coordinates: sums of integers do not depend on their order.

/// A scale that turns lengths in m into integers and back.
///
/// The quantum is a power of two, so that numbers that are exact in binary stay exact. It is chosen
/// so that `count` values of up to `largest` add up within an `i64`: 10⁻¹⁰ m for a scan of 100 m
/// and a million points.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Fixed {
    per_metre: f64,
}

impl Fixed {
    pub(crate) fn new(largest: f64, count: usize) -> Self {
        let headroom = count.max(1).ilog2() + 1;
        let bits = f64::from(62 - headroom) - largest.max(f64::MIN_POSITIVE).log2().ceil();
        Self { per_metre: bits.min(1000.0).exp2() }
    }

    /// The nearest multiple of the quantum, ties to even.
    ///
    /// Adding 1.5 × 2⁵² to a value of up to 2⁵¹ rounds it, and leaves the integer in the last bits.
    /// Without SSE 4.1, `round_ties_even` would be a slow call.
    #[allow(clippy::cast_possible_truncation)] // the scale keeps every value within an i64
    #[inline]
    pub(crate) fn encode(self, value: f64) -> i64 {
        // 1.5 × 2⁵².
        const WHOLE: f64 = 6_755_399_441_055_744.0;
        let scaled = value * self.per_metre;
        if scaled.abs() < 2_251_799_813_685_248.0 {
            return (scaled + WHOLE).to_bits() as i64 - WHOLE.to_bits() as i64;
        }
        scaled.round_ties_even() as i64
    }

    /// The mean of `count` values with this `sum`, rounded to 53 bits.
    pub(crate) fn mean(self, sum: f64, count: u32) -> f64 {
        sum / f64::from(count) / self.per_metre
    }

    /// A product of two encoded lengths, in m².
    pub(crate) fn square(self, product: f64) -> f64 {
        product / self.per_metre / self.per_metre
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sums_fit_and_keep_eleven_digits() {
        let (largest, count) = (173.3, 1 << 22);
        let fixed = Fixed::new(largest, count);
        let sum = fixed.encode(largest).checked_mul(count as i64).unwrap();
        assert!((fixed.mean(sum as f64, count as u32) - largest).abs() < 1e-9);
    }

    #[test]
    fn dyadic_values_are_exact_and_zero_is_no_trap() {
        let fixed = Fixed::new(8.0, 1000);
        assert_eq!(fixed.mean((fixed.encode(0.375) + fixed.encode(-7.5)) as f64, 2), -3.5625);
        assert_eq!(Fixed::new(0.0, 0).encode(0.0), 0);
    }

    #[test]
    fn rounding_is_to_the_nearest_even() {
        let near = (0..60).flat_map(|bits| {
            [-0.75, -0.5, 0.0, 0.5, 1.5, 2.25].map(|v| v + f64::from(bits).exp2())
        });
        let quantum = Fixed { per_metre: 1.0 };
        for value in near.chain([0.49999999999999994, -2.5]) {
            assert_eq!(quantum.encode(value), value.round_ties_even() as i64);
            assert_eq!(quantum.encode(-value), (-value).round_ties_even() as i64);
        }
    }
}
