//! What was found in a height map, to be measured.

use std::borrow::Cow;

use crate::Point;
use crate::connectivity::{AXES, NOBODY};
use crate::heightmap::Grid;

/// Points of which those count that are marked, where marks are given.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Marked<'a> {
    points: Cow<'a, [Point]>,
    marks: Option<&'a [bool]>,
}

impl<'a> Marked<'a> {
    /// Those of `points` with a mark.
    #[must_use]
    pub fn among(points: &'a [Point], marks: &'a [bool]) -> Self {
        Self { points: Cow::Borrowed(points), marks: Some(marks) }
    }

    pub(crate) fn iter(&self) -> impl Iterator<Item = &Point> {
        let marked = move |row: usize| self.marks.is_none_or(|marks| marks[row]);
        self.points.iter().enumerate().filter(move |(row, _)| marked(*row)).map(|(_, p)| p)
    }
}

impl From<Vec<Point>> for Marked<'_> {
    fn from(points: Vec<Point>) -> Self {
        Self { points: Cow::Owned(points), marks: None }
    }
}

/// Objects, the ground that they stand on, and what is no part of the surface.
#[derive(Debug, Clone, PartialEq)]
pub struct Found<'a> {
    /// The object that each cell belongs to, or -1.
    pub labels: Vec<i32>,
    /// Whether a cell is ground.
    pub ground: Vec<bool>,
    /// The points of the surface.
    pub surface: Marked<'a>,
    /// The points that lie off it.
    pub loose: Vec<Point>,
    /// Whether each of those belongs to a cluster apart from the ground's.
    pub apart: Vec<bool>,
}

impl Found<'_> {
    /// Objects that stand on whatever is none of theirs.
    #[must_use]
    pub fn on_all_else(labels: Vec<i32>) -> Self {
        let ground = labels.iter().map(|&label| label == NOBODY).collect();
        Self { labels, ground, surface: Marked::default(), loose: Vec::new(), apart: Vec::new() }
    }

    /// Whether a cell is part of a bank that leads to higher ground.
    pub(crate) fn is_bank(&self, cell: usize) -> bool {
        !self.ground[cell] && self.labels[cell] == NOBODY
    }

    /// The cells that an object's toe or the ground around it may lie in: banks and faces part an
    /// object from the ground behind them, with the gaps of a cell in them.
    pub(crate) fn open(&self, grid: &Grid, heights_m: &[f64]) -> Vec<bool> {
        let seen = |cell: usize| !heights_m[cell].is_nan();
        let bank = |cell: usize| self.is_bank(cell) && seen(cell);
        let gap = |cell: usize| {
            let beside = |dx, dy| grid.neighbor(cell, dx, dy).is_some_and(bank);
            AXES.iter().any(|&(dx, dy)| beside(dx, dy) && beside(-dx, -dy))
        };
        (0..heights_m.len()).map(|cell| !bank(cell) && (seen(cell) || !gap(cell))).collect()
    }
}
