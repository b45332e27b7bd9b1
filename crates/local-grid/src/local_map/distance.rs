use super::patch::Patches;

/// The cells around a wall to which it may be the nearest, with their distances.
#[derive(Debug, Clone)]
pub(super) struct Disc {
    radius: i32,
    far: f32,
    steps: Vec<(i8, i8, f32)>,
}

impl Disc {
    #[expect(clippy::cast_possible_truncation, reason = "at most 100 cells")]
    pub(super) fn new(resolution: f64, max_distance: f64) -> Self {
        let radius = (max_distance / resolution).floor().min(100.0) as i8;
        let distance = |x: i8, y: i8| resolution * f64::from(x).hypot(f64::from(y));
        let square = (-radius..=radius).flat_map(|y| (-radius..=radius).map(move |x| (x, y)));
        let steps = square.map(|(x, y)| (x, y, distance(x, y) as f32)).filter(|step| f64::from(step.2) < max_distance);
        Self { radius: i32::from(radius), far: max_distance as f32, steps: steps.collect() }
    }

    /// The distance that stands for "no wall near".
    pub(super) fn far(&self) -> f32 {
        self.far
    }

    /// Takes a new wall into account: all cells to which it is nearer than what they knew.
    pub(super) fn lower(&self, patches: &mut Patches, (x, y): (i32, i32)) {
        for &(dx, dy, distance) in &self.steps {
            let Some((cells, at)) = patches.at_mut((x + i32::from(dx), y + i32::from(dy))) else { continue };
            if distance < cells.distance[at] {
                cells.distance[at] = distance;
                cells.toward[at] = (-dx, -dy);
            }
        }
    }

    /// Forgets a wall: the cells to which it was the nearest look for another one.
    pub(super) fn raise(&self, patches: &mut Patches, (x, y): (i32, i32)) {
        let mut orphans = Vec::new();
        for &(dx, dy, distance) in &self.steps {
            let cell = (x + i32::from(dx), y + i32::from(dy));
            let Some((cells, at)) = patches.at_mut(cell) else { continue };
            if cells.distance[at] == distance && cells.toward[at] == (-dx, -dy) {
                cells.distance[at] = self.far;
                cells.toward[at] = (0, 0);
                orphans.push(cell);
            }
        }
        let walls = self.walls_around(patches, (x, y));
        for cell in orphans {
            self.adopt(patches, cell, &walls);
        }
    }

    /// All walls that can be nearest to a cell for which the wall at `(x, y)` was.
    fn walls_around(&self, patches: &Patches, (x, y): (i32, i32)) -> Vec<(i32, i32)> {
        let span = -2 * self.radius..=2 * self.radius;
        let around = span.clone().flat_map(|dy| span.clone().map(move |dx| (x + dx, y + dy)));
        around.filter(|&cell| patches.at(cell).is_some_and(|(cells, at)| cells.distance[at] == 0.0)).collect()
    }

    fn adopt(&self, patches: &mut Patches, (x, y): (i32, i32), walls: &[(i32, i32)]) {
        let square = |&&(wx, wy): &&(i32, i32)| (wx - x).pow(2) + (wy - y).pow(2);
        let Some(&(wx, wy)) = walls.iter().min_by_key(square) else { return };
        let step = self.steps.iter().find(|step| i32::from(step.0) == wx - x && i32::from(step.1) == wy - y);
        let (Some(&(dx, dy, distance)), Some((cells, at))) = (step, patches.at_mut((x, y))) else { return };
        cells.distance[at] = distance;
        cells.toward[at] = (dx, dy);
    }
}
