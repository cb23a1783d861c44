//! The counted part of a cell: its share of the cell's area, its centroid and its uncertainty.

/// A closed polygon in plan, in m; the first corner is not repeated at the end.
pub type Ring = Vec<[f64; 2]>;

/// Rounding error of a covered share.
pub(super) const ROUNDING: f64 = 1e-6;

/// The counted part of a cell.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct Coverage {
    /// Share of the cell's area, 0 to 1.
    pub(crate) share: f64,
    /// Offset from the cell's middle to the centroid of the part, in m.
    pub(crate) off_m: [f64; 2],
    /// Standard uncertainty of the share.
    pub(crate) u_share: f64,
}

impl Coverage {
    /// The whole cell.
    pub(crate) const WHOLE: Self = Self { share: 1.0, off_m: [0.0; 2], u_share: 0.0 };
}

/// The part of a cell of this `area`, from its covered area and first moments about the cell's
/// middle.
pub(crate) fn part([covered, x, y]: [f64; 3], area: f64) -> Coverage {
    let share = covered / area;
    if share < ROUNDING {
        return Coverage::default();
    }
    if share > 1.0 - ROUNDING {
        return Coverage::WHOLE;
    }
    Coverage { share, off_m: [x / covered, y / covered], u_share: 0.0 }
}

/// Signed area of a polygon in m², and its first moments about `center` in m³.
pub(crate) fn moments(ring: &[[f64; 2]], center: [f64; 2]) -> [f64; 3] {
    let mut sums = [0.0; 3];
    for (p, q) in ring.iter().zip(ring.iter().cycle().skip(1)) {
        let [a, b] = [p, q].map(|p| [p[0] - center[0], p[1] - center[1]]);
        let cross = a[0] * b[1] - b[0] * a[1];
        sums[0] += cross / 2.0;
        (0..2).for_each(|k| sums[k + 1] += cross * (a[k] + b[k]) / 6.0);
    }
    sums
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_part_in_a_million_is_rounding() {
        let share = |share: f64| part([share, 0.0, 0.0], 1.0).share;
        assert!(share(1.6e-6) > 0.0 && share(0.7e-6) == 0.0);
        assert!(share(1.0 - 1.6e-6) < 1.0 && share(1.0 - 0.7e-6) == 1.0);
    }
}
