//! Outlines: lines that cross themselves, and what lies inside.

use arbitrary::Arbitrary;
use divespot_core::piles::Region;
use divespot_core::simple_polygon::{contains, first_crossing};

use crate::{MOST_POINTS, Number};

#[derive(Debug, Arbitrary)]
pub struct Input {
    lines: Vec<Vec<[Number; 2]>>,
    at: [Number; 2],
}

impl Input {
    pub fn run(&self) {
        let line = |line: &Vec<[Number; 2]>| -> Vec<[f64; 2]> {
            line.iter().take(MOST_POINTS).map(|p| p.map(Number::near)).collect()
        };
        let lines: Vec<Vec<[f64; 2]>> = self.lines.iter().take(8).map(line).collect();
        for line in &lines {
            let mut turned = line.clone();
            turned.reverse();
            let crossing = [first_crossing(line), first_crossing(&turned)];
            assert_eq!(
                crossing[0].clone().map(|c| c.is_some()),
                crossing[1].clone().map(|c| c.is_some())
            );
        }
        let _ = contains(&lines, self.at.map(Number::near));
        assert!(!Region { rings: lines }.area_m2().is_nan());
    }
}
