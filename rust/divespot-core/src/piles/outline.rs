//! The outline of a set of cells, as a polygon along cell edges in m.

use crate::heightmap::Grid;

/// The longest closed line along cell edges around `inside`, counter-clockwise, corners only.
///
/// Empty if no cell is inside.
pub(crate) fn outline(grid: &Grid, inside: &[bool]) -> Vec<[f64; 2]> {
    let mut edges = Edges::around(grid, inside);
    let mut longest = Vec::new();
    while let Some(loop_) = edges.take_loop() {
        if loop_.len() > longest.len() {
            longest = loop_;
        }
    }
    corners(&longest).into_iter().map(|[x, y]| edges.position(grid, x, y)).collect()
}

/// Directions in which an edge leaves a corner: +x, +y, -x, -y.
const STEPS: [[isize; 2]; 4] = [[1, 0], [0, 1], [-1, 0], [0, -1]];

/// Directed cell edges with the inside on their left, by the corner they leave from.
struct Edges {
    columns: usize,
    leaving: Vec<u8>,
    next: usize,
}

impl Edges {
    fn around(grid: &Grid, inside: &[bool]) -> Self {
        let columns = grid.columns + 1;
        let mut leaving = vec![0u8; columns * (grid.rows + 1)];
        let is_inside = |cell, dx, dy| grid.neighbor(cell, dx, dy).is_some_and(|n| inside[n]);
        for cell in (0..inside.len()).filter(|&cell| inside[cell]) {
            let corner = cell / grid.columns * columns + cell % grid.columns;
            let sides = [
                (0, -1, corner),
                (1, 0, corner + 1),
                (0, 1, corner + columns + 1),
                (-1, 0, corner + columns),
            ];
            for (direction, (dx, dy, from)) in sides.into_iter().enumerate() {
                if !is_inside(cell, dx, dy) {
                    leaving[from] |= 1 << direction;
                }
            }
        }
        Self { columns, leaving, next: 0 }
    }

    /// The next loop, as corner indices; each edge belongs to one loop.
    fn take_loop(&mut self) -> Option<Vec<[usize; 2]>> {
        self.next += self.leaving[self.next..].iter().position(|&e| e != 0)?;
        let (mut corner, mut line) = (self.next, Vec::new());
        let mut heading = 0;
        while self.leaving[corner] != 0 {
            line.push([corner % self.columns, corner / self.columns]);
            // Left turn first, so that two cells that touch only at a corner stay apart.
            heading = [1, 0, 3]
                .into_iter()
                .map(|turn| (heading + turn) % 4)
                .find(|d| self.leaving[corner] & (1 << d) != 0)?;
            self.leaving[corner] &= !(1 << heading);
            let [dx, dy] = STEPS[heading];
            corner = corner.checked_add_signed(dx + dy * self.columns.cast_signed())?;
        }
        Some(line)
    }

    #[allow(clippy::cast_precision_loss)] // far below 2⁵³
    fn position(&self, grid: &Grid, x: usize, y: usize) -> [f64; 2] {
        [grid.origin_m[0] + x as f64 * grid.cell_m, grid.origin_m[1] + y as f64 * grid.cell_m]
    }
}

/// The closed line without points on straight stretches.
fn corners(line: &[[usize; 2]]) -> Vec<[usize; 2]> {
    let n = line.len();
    let straight = |i: usize| {
        let (a, c) = (line[(i + n - 1) % n], line[(i + 1) % n]);
        (0..2).any(|k| a[k] == line[i][k] && line[i][k] == c[k])
    };
    (0..n).filter(|&i| !straight(i)).map(|i| line[i]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn grid() -> Grid {
        Grid { origin_m: [10.0, 20.0], cell_m: 0.5, columns: 6, rows: 5 }
    }

    fn area(line: &[[f64; 2]]) -> f64 {
        let pairs = line.iter().zip(line.iter().cycle().skip(1));
        pairs.map(|(a, b)| a[0] * b[1] - b[0] * a[1]).sum::<f64>() / 2.0
    }

    #[test]
    fn a_rectangle_has_four_corners_and_its_area() {
        let inside: Vec<bool> =
            (0..30).map(|i| (1..4).contains(&(i % 6)) && (1..3).contains(&(i / 6))).collect();
        let line = outline(&grid(), &inside);
        assert_eq!(line.len(), 4);
        assert!((area(&line) - 1.5).abs() < 1e-12);
        assert!(line.contains(&[10.5, 20.5]) && line.contains(&[12.0, 21.5]));
    }

    #[test]
    fn the_outer_line_of_a_ring_and_of_the_whole_grid() {
        let ring: Vec<bool> = (0..30).map(|i| i != 14).collect();
        assert!((area(&outline(&grid(), &ring)) - 7.5).abs() < 1e-12);
        assert!(outline(&grid(), &[false; 30]).is_empty());
    }
}
