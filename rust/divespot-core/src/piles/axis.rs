//! The main axis of points in plan (first principal component).

use crate::count::to_f64;

/// The mean of points in plan, in m, and the unit vector of their largest variance.
pub(super) fn main_axis<'a>(
    places: impl Iterator<Item = [f64; 2]> + Clone + 'a,
) -> ([f64; 2], [f64; 2]) {
    let count = to_f64(places.clone().count());
    let middle = [0, 1].map(|k| places.clone().map(|p| p[k]).sum::<f64>() / count);
    let moment = |a: usize, b: usize| {
        places.clone().map(|p| (p[a] - middle[a]) * (p[b] - middle[b])).sum::<f64>()
    };
    let angle = 0.5 * libm::atan2(2.0 * moment(0, 1), moment(0, 0) - moment(1, 1));
    (middle, [libm::cos(angle), libm::sin(angle)])
}

pub(super) fn dot(a: [f64; 2], b: [f64; 2]) -> f64 {
    a[0] * b[0] + a[1] * b[1]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn places_along_a_line_lie_along_it() {
        let line = (-4..=6).map(|i| [1.0 + 0.6 * f64::from(i), 2.0 + 0.8 * f64::from(i)]);
        let (middle, along) = main_axis(line);
        assert!((middle[0] - 1.6).abs() < 1e-12 && (middle[1] - 2.8).abs() < 1e-12);
        assert!((dot(along, [0.6, 0.8]).abs() - 1.0).abs() < 1e-12);
    }
}
