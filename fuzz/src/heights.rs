//! Height histograms, and sums of heights.

use arbitrary::Arbitrary;
use divespot_core::heightmap::integrate;
use divespot_core::{GroundRule, ground_height, height_histogram};

use crate::{MOST_POINTS, Number};

#[derive(Debug, Arbitrary)]
pub struct Input {
    heights: Vec<Number>,
    bin_m: Number,
    window: usize,
    rule: u8,
    lower_fraction: Number,
}

impl Input {
    pub fn run(&self) {
        // The binding leaves out what is not finite.
        let all = self.heights.iter().take(MOST_POINTS).map(|n| n.value());
        let heights: Vec<f64> = all.filter(|v| v.is_finite()).collect();
        let bin_m = self.bin_m.value();
        let rule = [GroundRule::First, GroundRule::Lower, GroundRule::Midpoint];
        let rule = rule[usize::from(self.rule % 3)];
        if let Ok(found) = height_histogram(&heights, bin_m, self.window) {
            assert_eq!(found.counts.iter().sum::<u32>() as usize, heights.len());
        }
        let fraction = self.lower_fraction.value();
        let _ = ground_height(&heights, bin_m, self.window, rule, fraction);
        let _ = integrate(heights, bin_m);
    }
}
