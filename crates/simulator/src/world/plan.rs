use nalgebra::{Isometry2, Point2, Vector2};
use serde::Deserialize;

use crate::mover::{Mover, Repeats, Station};
use crate::world::{Tour, World, WorldError, WorldParts};
use crate::{Material, Segment};

/// Why a plan is not a world.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum PlanError {
    /// The text is not TOML, or a key is unknown, missing or of the wrong type.
    #[error("not a world plan: {0}")]
    Syntax(String),
    /// A line needs two points.
    #[error("{what} {number}: needs at least {least} points, got {count}")]
    Points {
        /// What was drawn.
        what: &'static str,
        /// Which of its kind, from 1.
        number: usize,
        /// How many points it needs.
        least: usize,
        /// How many it has.
        count: usize,
    },
    /// A length must be one.
    #[error("{what} {number}: {quantity} must be positive, got {value}")]
    Size {
        /// What was drawn.
        what: &'static str,
        /// Which of its kind, from 1.
        number: usize,
        /// The quantity.
        quantity: &'static str,
        /// Its value.
        value: f64,
    },
    /// A door is cut into a wall.
    #[error("door {number} from ({}, {}) to ({}, {}): lies in no wall", from[0], from[1], to[0], to[1])]
    DoorWithoutWall {
        /// Which door, from 1.
        number: usize,
        /// One jamb, in the plan's frame.
        from: [f64; 2],
        /// The other jamb.
        to: [f64; 2],
    },
    /// A schedule runs forward.
    #[error("mover {number}: station {station} is at {time} s, not after the one before")]
    Schedule {
        /// Which mover, from 1.
        number: usize,
        /// Which station, from 1.
        station: usize,
        /// Its time in seconds.
        time: f64,
    },
    /// The plan can be read but describes no building.
    #[error(transparent)]
    World(#[from] WorldError),
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Plan {
    name: String,
    #[serde(default)]
    rotation_deg: f64,
    #[serde(default)]
    start: [f64; 3],
    #[serde(default)]
    wall: Vec<PlanWall>,
    #[serde(default)]
    door: Vec<Door>,
    #[serde(default)]
    furniture: Vec<Furniture>,
    #[serde(default)]
    mover: Vec<PlanMover>,
    #[serde(default)]
    tour: Vec<PlanTour>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct PlanWall {
    points: Vec<[f64; 2]>,
    #[serde(default)]
    closed: bool,
    #[serde(default)]
    material: Material,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Door {
    from: [f64; 2],
    to: [f64; 2],
    #[serde(default = "yes")]
    open: bool,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Furniture {
    #[serde(default)]
    #[expect(dead_code, reason = "names are for the reader of the plan")]
    name: String,
    center: [f64; 2],
    size: [f64; 2],
    #[serde(default)]
    turn_deg: f64,
    #[serde(default = "rough")]
    material: Material,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct PlanMover {
    #[serde(default)]
    name: String,
    size: [f64; 2],
    #[serde(default)]
    turn_deg: f64,
    #[serde(default = "rough")]
    material: Material,
    /// `[time, x, y]`, seconds and metres.
    stations: Vec<[f64; 3]>,
    #[serde(default)]
    repeats: bool,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct PlanTour {
    name: String,
    points: Vec<[f64; 2]>,
}

fn yes() -> bool {
    true
}

fn rough() -> Material {
    Material::Rough
}

impl World {
    /// Reads a plan: TOML with walls, doors, furniture, movers and tours, in metres along the building's own axes.
    ///
    /// ```
    /// let world = simulator::World::from_plan(r#"
    ///     name = "one room"
    ///     rotation_deg = 33.0               # how the plan lies in the map frame, counter-clockwise
    ///     start = [1.0, 1.0, 0.0]           # x, y and heading in degrees
    ///     [[wall]]
    ///     points = [[0, 0], [4, 0], [4, 3], [0, 3]]
    ///     closed = true
    ///     [[door]]                          # a gap cut out of every wall it lies in
    ///     from = [1.5, 0.0]
    ///     to = [2.4, 0.0]
    ///     [[furniture]]
    ///     name = "desk"
    ///     center = [3.2, 2.5]
    ///     size = [1.4, 0.7]
    /// "#)?;
    /// assert_eq!(world.walls().len(), 5 + 2 + 4); // the wall with the door has two pieces, the door two frames
    /// # Ok::<(), simulator::PlanError>(())
    /// ```
    ///
    /// # Errors
    ///
    /// Text that is no plan, unknown keys, lines without points, doors beside every wall, sizes that are not positive,
    /// schedules that run backwards.
    pub fn from_plan(text: &str) -> Result<Self, PlanError> {
        let plan: Plan = toml::from_str(text).map_err(|error| PlanError::Syntax(error.to_string()))?;
        let map_from_plan = Isometry2::rotation(plan.rotation_deg.to_radians());
        let [x, y, heading] = plan.start;
        let plan_from_start = Isometry2::new(Vector2::new(x, y), heading.to_radians());
        let mut walls = wall_segments(&plan.wall)?;
        for (number, door) in (1..).zip(&plan.door) {
            cut(&mut walls, number, door)?;
        }
        for (number, piece) in (1..).zip(&plan.furniture) {
            let outline = rectangle("furniture", number, piece.size, piece.turn_deg)?;
            let center = Point2::from(piece.center);
            let corner = |k: usize| center + outline[k % 4];
            walls.extend((0..4).map(|k| Segment { from: corner(k), to: corner(k + 1), material: piece.material }));
        }
        for wall in &mut walls {
            (wall.from, wall.to) = (map_from_plan * wall.from, map_from_plan * wall.to);
        }
        Ok(World::new(WorldParts {
            map_from_start: map_from_plan * plan_from_start,
            movers: movers(&plan.mover, &map_from_plan)?,
            tours: tours(&plan.tour, &map_from_plan)?,
            name: plan.name,
            map_from_plan,
            walls,
        })?)
    }
}

fn wall_segments(walls: &[PlanWall]) -> Result<Vec<Segment>, PlanError> {
    let mut segments = Vec::new();
    for (number, wall) in (1..).zip(walls) {
        let count = wall.points.len();
        if count < 2 {
            return Err(PlanError::Points { what: "wall", number, least: 2, count });
        }
        let corner = |k: usize| Point2::from(wall.points[k % count]);
        let pieces = if wall.closed { count } else { count - 1 };
        segments.extend((0..pieces).map(|k| Segment { from: corner(k), to: corner(k + 1), material: wall.material }));
    }
    Ok(segments)
}

/// A jamb nearer than this to a wall's line lies in the wall, in metres.
const IN_WALL: f64 = 0.02;

/// How far a door's frame stands out of the wall on both sides, in metres: the small right angles in it are what sonars
/// hear of a door.
const FRAME: f64 = 0.06;

/// Cuts an open door out of every wall it lies in; a closed one becomes a smooth panel there.
fn cut(walls: &mut Vec<Segment>, number: usize, door: &Door) -> Result<(), PlanError> {
    let (from, to) = (Point2::from(door.from), Point2::from(door.to));
    let mut pieces = Vec::with_capacity(walls.len() + 2);
    let mut is_cut = false;
    for wall in walls.drain(..) {
        let length = wall.length();
        if length == 0.0 || wall.distance(from) > IN_WALL || wall.distance(to) > IN_WALL {
            pieces.push(wall);
            continue;
        }
        is_cut = true;
        let along = wall.along() / length;
        let (a, b) = ((from - wall.from).dot(&along), (to - wall.from).dot(&along));
        let at = |distance: f64| wall.from + along * distance.clamp(0.0, length);
        let (first, second) = (at(a.min(b)), at(a.max(b)));
        pieces.push(Segment { to: first, ..wall });
        pieces.push(Segment { from: second, ..wall });
        let across = Vector2::new(-along.y, along.x) * FRAME;
        let frames =
            [first, second].map(|jamb| Segment { from: jamb - across, to: jamb + across, material: Material::Smooth });
        pieces.extend(frames);
        if !door.open {
            pieces.push(Segment { from: first, to: second, material: Material::Smooth });
        }
    }
    *walls = pieces;
    if is_cut { Ok(()) } else { Err(PlanError::DoorWithoutWall { number, from: door.from, to: door.to }) }
}

/// The corners of a rectangle around its centre, counter-clockwise.
fn rectangle(what: &'static str, number: usize, size: [f64; 2], turn_deg: f64) -> Result<[Vector2<f64>; 4], PlanError> {
    for (quantity, value) in [("width", size[0]), ("depth", size[1])] {
        if !(value > 0.0 && value.is_finite()) {
            return Err(PlanError::Size { what, number, quantity, value });
        }
    }
    let turn = nalgebra::Rotation2::new(turn_deg.to_radians());
    let signs = [(-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5)];
    Ok(signs.map(|(x, y)| turn * Vector2::new(x * size[0], y * size[1])))
}

fn movers(movers: &[PlanMover], map_from_plan: &Isometry2<f64>) -> Result<Vec<Mover>, PlanError> {
    let read = |(number, mover): (usize, &PlanMover)| {
        if mover.stations.is_empty() {
            return Err(PlanError::Points { what: "mover", number, least: 1, count: 0 });
        }
        let ahead = |pair: &[[f64; 3]]| pair[1][0] > pair[0][0]; // false for NaN
        if let Some(late) = mover.stations.windows(2).position(|pair| !ahead(pair)) {
            return Err(PlanError::Schedule { number, station: late + 2, time: mover.stations[late + 1][0] });
        }
        let outline = rectangle("mover", number, mover.size, mover.turn_deg)?;
        let station = |&[time, x, y]: &[f64; 3]| Station { time, at: map_from_plan * Point2::new(x, y) };
        Ok(Mover {
            name: mover.name.clone(),
            outline: outline.iter().map(|corner| map_from_plan * corner).collect(),
            material: mover.material,
            stations: mover.stations.iter().map(station).collect(),
            repeats: if mover.repeats { Repeats::Forever } else { Repeats::Never },
        })
    };
    (1..).zip(movers).map(read).collect()
}

fn tours(tours: &[PlanTour], map_from_plan: &Isometry2<f64>) -> Result<Vec<Tour>, PlanError> {
    let read = |(number, tour): (usize, &PlanTour)| {
        if tour.points.is_empty() {
            return Err(PlanError::Points { what: "tour", number, least: 1, count: 0 });
        }
        let points = tour.points.iter().map(|&point| map_from_plan * Point2::from(point)).collect();
        Ok(Tour { name: tour.name.clone(), points })
    };
    (1..).zip(tours).map(read).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    const ROOM: &str = "name = 'r'\n[[wall]]\npoints = [[0, 0], [4, 0], [4, 3], [0, 3]]\nclosed = true\n";

    fn error(extra: &str) -> String {
        World::from_plan(&format!("{ROOM}{extra}")).unwrap_err().to_string()
    }

    #[test]
    fn a_door_opens_a_wall_and_a_closed_one_does_not() {
        let door = |open| format!("{ROOM}[[door]]\nfrom = [1, 0]\nto = [2, 0]\nopen = {open}\n");
        let south = |plan: String| {
            let world = World::from_plan(&plan).unwrap();
            world.at(0.0).distance_along(Point2::new(1.5, 1.0), -Vector2::y(), 5.0)
        };
        assert_eq!(south(door(true)), None);
        assert_eq!(south(door(false)), Some(1.0));
    }

    #[test]
    fn a_plan_turns_as_a_whole() {
        let plan = format!("rotation_deg = 90\nstart = [1, 2, 0]\n{ROOM}");
        let world = World::from_plan(&plan).unwrap();
        let start = world.map_from_start();
        approx::assert_relative_eq!(start.translation.vector, Vector2::new(-2.0, 1.0), epsilon = 1e-12);
        approx::assert_relative_eq!(start.rotation.angle(), std::f64::consts::FRAC_PI_2, epsilon = 1e-12);
        approx::assert_relative_eq!(world.bounds().0, Point2::new(-3.0, 0.0), epsilon = 1e-12);
    }

    #[test]
    fn bad_plans_are_refused_with_what_and_where() {
        assert!(error("[[door]]\nfrom = [1, 1]\nto = [2, 1]\n").contains("door 1 from (1, 1)"));
        assert!(error("[[wall]]\npoints = [[0, 0]]\n").contains("wall 2: needs at least 2 points, got 1"));
        assert!(error("[[furniture]]\ncenter = [1, 1]\nsize = [0, 1]\n").contains("width must be positive, got 0"));
        let late = "[[mover]]\nsize = [1, 1]\nstations = [[5, 0, 0], [5, 1, 0]]\n";
        assert!(error(late).contains("mover 1: station 2 is at 5 s"));
        assert!(error("[[wal]]\npoints = []\n").contains("unknown field"));
        assert!(error("[[tour]]\nname = 't'\npoints = [[1e9, 0]]\n").contains("within 10 km"));
        assert!(World::from_plan("\u{0}\u{1}").is_err());
        assert_eq!(World::from_plan("name = 'void'").unwrap_err().to_string(), "the world `void` has no wall");
    }
}
