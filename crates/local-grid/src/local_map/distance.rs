use super::patch::{Cells, Patches};

/// The cells around a wall to which it may be the nearest, with their distances.
#[derive(Debug, Clone)]
pub(super) struct Disc {
    radius: i32,
    far: f32,
    /// Of the rows from −radius to radius: how far the disc extends to either side.
    extents: Vec<i32>,
    /// The distances of the square around the disc, row by row.
    distances: Vec<f32>,
}

impl Disc {
    #[expect(clippy::cast_possible_truncation, reason = "at most 100 cells")]
    pub(super) fn new(resolution: f64, max_distance: f64) -> Self {
        let radius = (max_distance / resolution).floor().min(100.0) as i32;
        let distance = |x: i32, y: i32| resolution * f64::from(x).hypot(f64::from(y));
        let rows = -radius..=radius;
        // −1 where not even the row's middle is near enough.
        let extent = |y| (0..=radius).rev().find(|x| distance(*x, y) < max_distance).unwrap_or(-1);
        Self {
            radius,
            far: max_distance as f32,
            extents: rows.clone().map(extent).collect(),
            distances: rows.clone().flat_map(|y| rows.clone().map(move |x| distance(x, y) as f32)).collect(),
        }
    }

    /// The distance that stands for "no wall near".
    pub(super) fn far(&self) -> f32 {
        self.far
    }

    /// Takes a new wall into account: all cells to which it is nearer than what they knew.
    pub(super) fn lower(&self, patches: &mut Patches, wall: (i32, i32)) {
        self.visit(patches, wall, |cells, at, (dx, dy), distance| {
            if distance < cells.distance[at] {
                cells.distance[at] = distance;
                cells.toward[at] = (-dx, -dy);
            }
        });
    }

    /// Forgets a wall: the cells to which it was the nearest look for another one.
    pub(super) fn raise(&self, patches: &mut Patches, (x, y): (i32, i32)) {
        let mut orphans = Vec::new();
        self.visit(patches, (x, y), |cells, at, (dx, dy), distance| {
            if cells.distance[at] == distance && cells.toward[at] == (-dx, -dy) {
                cells.distance[at] = self.far;
                cells.toward[at] = (0, 0);
                orphans.push((x + i32::from(dx), y + i32::from(dy)));
            }
        });
        if orphans.is_empty() {
            return;
        }
        // All walls that can be nearest to a cell for which this one was.
        let walls = patches.walls_around((x, y), 2 * self.radius);
        for cell in orphans {
            self.adopt(patches, cell, &walls);
        }
    }

    /// Visits the cells of the disc around a wall, row by row, each with its step from the wall and its distance.
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "at most 100 cells either way")]
    fn visit(&self, patches: &mut Patches, (x, y): (i32, i32), mut of: impl FnMut(&mut Cells, usize, (i8, i8), f32)) {
        let side = (2 * self.radius + 1) as usize;
        for ((dy, extent), distances) in (-self.radius..).zip(&self.extents).zip(self.distances.chunks_exact(side)) {
            patches.row_mut(y + dy, x - extent, x + extent, |cells, run, first| {
                let from = first - x;
                let distances = &distances[(from + self.radius) as usize..];
                for ((at, dx), distance) in run.zip(from..).zip(distances) {
                    of(cells, at, (dx as i8, dy as i8), *distance);
                }
            });
        }
    }

    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "checked against the radius")]
    fn adopt(&self, patches: &mut Patches, (x, y): (i32, i32), walls: &[(i32, i32)]) {
        let square = |&&(wx, wy): &&(i32, i32)| (wx - x).pow(2) + (wy - y).pow(2);
        let Some(&(wx, wy)) = walls.iter().min_by_key(square) else { return };
        let (dx, dy) = (wx - x, wy - y);
        if dx.abs() > self.radius || dy.abs() > self.radius || dx.abs() > self.extents[(dy + self.radius) as usize] {
            return;
        }
        let Some((cells, at)) = patches.at_mut((x, y)) else { return };
        cells.distance[at] = self.distances[((dy + self.radius) * (2 * self.radius + 1) + dx + self.radius) as usize];
        cells.toward[at] = (dx as i8, dy as i8);
    }
}
