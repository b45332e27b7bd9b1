//! Random office floors, drawn here so that the network never sees a world on which explorations are judged.

use rand::{Rng, RngExt};
use simulator::nalgebra::{Isometry2, Point2, Vector2};
use simulator::{Material, Segment, Tour, World, WorldError, WorldParts};

/// Rows of rooms on both sides of a corridor, with doors, clutter, columns and glass, at any angle to the compass.
///
/// The one tour of the world names the middles of its open doors.
pub(crate) fn random_floor(rng: &mut impl Rng) -> Result<World, WorldError> {
    let corridor = rng.random_range(1.2..3.2);
    let depth = rng.random_range(3.0..6.0);
    let mut draft = Draft::default();
    let mut x = 0.0;
    let rooms = rng.random_range(3..6);
    for _ in 0..rooms {
        let width = rng.random_range(2.6..6.5);
        for (wall, back) in [(0.0, -depth), (corridor, corridor + depth)] {
            let material = if rng.random_bool(0.3) { Material::Rough } else { Material::Smooth };
            draft.wall_with_door((x, wall), (x + width, wall), rng);
            draft.line((x, back), (x + width, back), material);
            draft.line((x + width, wall), (x + width, back), material);
            draft.clutter((x, wall.min(back)), (x + width, wall.max(back)), rng);
        }
        x += width;
    }
    for back in [-depth, corridor + depth] {
        let wall = if back < 0.0 { 0.0 } else { corridor };
        draft.line((0.0, wall), (0.0, back), Material::Smooth);
    }
    let end = if rng.random_bool(0.3) { Material::Glass } else { Material::Smooth };
    draft.line((0.0, 0.0), (0.0, corridor), end);
    draft.line((x, 0.0), (x, corridor), Material::Smooth);
    let turned = Isometry2::rotation(rng.random_range(0.0..std::f64::consts::TAU));
    let walls = draft.walls.iter().map(|wall| Segment { from: turned * wall.from, to: turned * wall.to, ..*wall });
    World::new(WorldParts {
        name: "random floor".into(),
        map_from_plan: turned,
        map_from_start: turned * Isometry2::translation(1.0, 0.5 * corridor),
        walls: walls.collect(),
        tours: vec![Tour { name: "doors".into(), points: draft.doors.iter().map(|door| turned * door).collect() }],
        ..WorldParts::default()
    })
}

#[derive(Default)]
struct Draft {
    walls: Vec<Segment>,
    doors: Vec<Point2<f64>>,
}

impl Draft {
    fn line(&mut self, from: (f64, f64), to: (f64, f64), material: Material) {
        let (from, to) = (Point2::new(from.0, from.1), Point2::new(to.0, to.1));
        self.walls.push(Segment { from, to, material });
    }

    /// A wall along x with an open door 0.8 to 1.2 m wide, or (one in four) a closed one, which is just a wall.
    fn wall_with_door(&mut self, from: (f64, f64), to: (f64, f64), rng: &mut impl Rng) {
        let width = rng.random_range(0.8..1.2);
        let at = rng.random_range(from.0 + 0.2..to.0 - width - 0.2);
        if rng.random_bool(0.25) {
            return self.line(from, to, Material::Smooth);
        }
        self.doors.push(Point2::new(at + 0.5 * width, from.1));
        self.line(from, (at, from.1), Material::Smooth);
        self.line((at + width, to.1), to, Material::Smooth);
    }

    /// Desks, shelves and columns: boxes anywhere in a room, at any angle.
    fn clutter(&mut self, low: (f64, f64), high: (f64, f64), rng: &mut impl Rng) {
        for _ in 0..rng.random_range(0..4) {
            let center = Vector2::new(rng.random_range(low.0..high.0), rng.random_range(low.1..high.1));
            let (a, b) = (rng.random_range(0.1..0.8), rng.random_range(0.1..0.5));
            let turn = if rng.random_bool(0.6) { 0.0 } else { rng.random_range(0.0..1.6) };
            let pose = Isometry2::new(center, turn);
            let corner = |x: f64, y: f64| {
                let p = pose * Point2::new(x, y);
                (p.x, p.y)
            };
            let corners = [corner(-a, -b), corner(a, -b), corner(a, b), corner(-a, b)];
            let material = if rng.random_bool(0.5) { Material::Rough } else { Material::Smooth };
            for k in 0..4 {
                self.line(corners[k], corners[(k + 1) % 4], material);
            }
        }
    }
}
