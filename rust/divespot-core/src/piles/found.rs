//! What was found in a height map, as input for measuring: objects, ground, and points off the
//! surface.

use std::borrow::Cow;

use crate::connectivity::{AXES, UNLABELLED};
use crate::heightmap::Grid;
use crate::{Point, Result};

/// A set of points: all, or those with a mark.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Marked<'a> {
    points: Cow<'a, [Point]>,
    marks: Option<&'a [bool]>,
}

impl<'a> Marked<'a> {
    /// The `points` that are marked.
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

/// Objects, the ground they stand on, and the points off the surface.
#[derive(Debug, Clone, PartialEq)]
pub struct Found<'a> {
    /// Label of the object in each cell; -1 for none.
    pub labels: Vec<i32>,
    /// Whether a cell is ground.
    pub ground: Vec<bool>,
    /// The points on the surface.
    pub surface: Marked<'a>,
    /// The points off the surface.
    pub loose: Vec<Point>,
    /// Whether each point off the surface belongs to a cluster apart from that of the ground.
    pub apart: Vec<bool>,
}

impl Found<'_> {
    /// Objects, with all other cells as ground.
    #[must_use]
    pub fn on_all_else(labels: Vec<i32>) -> Self {
        let ground = labels.iter().map(|&label| label == UNLABELLED).collect();
        Self::of_cells(labels, ground)
    }

    fn of_cells(labels: Vec<i32>, ground: Vec<bool>) -> Self {
        Self { labels, ground, surface: Marked::default(), loose: Vec::new(), apart: Vec::new() }
    }

    /// Checks that there are a label and a mark of ground for each cell.
    pub(crate) fn require_fit(&self, grid: &Grid) -> Result<()> {
        grid.require_each("labels", self.labels.len())?;
        grid.require_each("marks of ground", self.ground.len())
    }

    /// The same, when the points are no longer needed.
    #[must_use]
    pub fn without_points(self) -> Found<'static> {
        Found::of_cells(self.labels, self.ground)
    }

    /// Whether a cell is part of a bank that leads to higher ground.
    pub(crate) fn is_bank(&self, cell: usize) -> bool {
        !self.ground[cell] && self.labels[cell] == UNLABELLED
    }

    /// The cells that a toe or an annulus of ground may lie in. Banks and faces, and one-cell gaps
    /// in them, part an object from the ground behind them.
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
