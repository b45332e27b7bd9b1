mod plan;

use nalgebra::{Isometry2, Point2, Vector2};

use crate::corner::{Corner, corners};
use crate::index::{Hit, SegmentIndex};
use crate::{Mover, Segment};

pub use plan::PlanError;

/// A building: walls as straight pieces of surface, things that move, and where the robot starts.
///
/// Everything is in the map frame, metres, `x` east and `y` north. A plan may be drawn in a frame of its own along its
/// walls ([`World::map_from_plan`]), so that a building can lie at any angle to the compass.
#[derive(Debug, Clone)]
pub struct World {
    name: String,
    map_from_plan: Isometry2<f64>,
    map_from_start: Isometry2<f64>,
    walls: Vec<Segment>,
    movers: Vec<Mover>,
    tours: Vec<Tour>,
    index: SegmentIndex,
    corners: Vec<Corner>,
    low: Point2<f64>,
    high: Point2<f64>,
}

/// A named list of points to drive along, in the map frame.
#[derive(Debug, Clone, PartialEq)]
pub struct Tour {
    /// What it is called.
    pub name: String,
    /// The points in metres, in order.
    pub points: Vec<Point2<f64>>,
}

/// What a [`World`] is made from.
#[derive(Debug, Clone, Default)]
pub struct WorldParts {
    /// What the world is called.
    pub name: String,
    /// The plan's own frame in the map frame.
    pub map_from_plan: Isometry2<f64>,
    /// Where the robot starts, in the map frame.
    pub map_from_start: Isometry2<f64>,
    /// The walls, in the map frame.
    pub walls: Vec<Segment>,
    /// What moves, in the map frame.
    pub movers: Vec<Mover>,
    /// Routes worth driving, in the map frame.
    pub tours: Vec<Tour>,
}

/// Why a world cannot exist.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum WorldError {
    /// Something must be there to be seen.
    #[error("the world `{0}` has no wall")]
    NoWall(String),
    /// Coordinates must be places on a floor.
    #[error("the world `{world}` has a {what} at ({x}, {y}): coordinates must be finite and within 10 km")]
    Coordinates {
        /// The world.
        world: String,
        /// What lies there.
        what: &'static str,
        /// East, in metres.
        x: f64,
        /// North, in metres.
        y: f64,
    },
}

/// No building is larger: a bound against coordinates in a wrong unit.
const FARTHEST: f64 = 1e4;

impl World {
    /// A world of given parts; walls of no length are dropped.
    ///
    /// # Errors
    ///
    /// No wall, or coordinates that are not finite or farther than 10 km from the origin.
    pub fn new(parts: WorldParts) -> Result<Self, WorldError> {
        let WorldParts { name, map_from_plan, map_from_start, mut walls, movers, tours } = parts;
        check(&name, "wall", walls.iter().flat_map(|wall| [wall.from, wall.to]))?;
        check(&name, "mover", movers.iter().flat_map(|mover| &mover.stations).map(|station| station.at))?;
        check(&name, "tour", tours.iter().flat_map(|tour| tour.points.iter().copied()))?;
        check(&name, "start", [Point2::from(map_from_start.translation.vector)])?;
        walls.retain(|wall| wall.length() > 1e-9);
        if walls.is_empty() {
            return Err(WorldError::NoWall(name));
        }
        let index = SegmentIndex::new(&walls);
        let corners = corners(&walls, &index);
        let low = walls.iter().fold(walls[0].from, |low, wall| low.inf(&wall.from).inf(&wall.to));
        let high = walls.iter().fold(walls[0].from, |high, wall| high.sup(&wall.from).sup(&wall.to));
        Ok(Self { name, map_from_plan, map_from_start, walls, movers, tours, index, corners, low, high })
    }

    /// What the world is called.
    #[must_use]
    pub fn name(&self) -> &str {
        &self.name
    }

    /// The frame in which the plan was drawn, in the map frame.
    #[must_use]
    pub fn map_from_plan(&self) -> Isometry2<f64> {
        self.map_from_plan
    }

    /// Where a robot starts, in the map frame.
    #[must_use]
    pub fn map_from_start(&self) -> Isometry2<f64> {
        self.map_from_start
    }

    /// All walls, in the map frame.
    #[must_use]
    pub fn walls(&self) -> &[Segment] {
        &self.walls
    }

    /// All that moves.
    #[must_use]
    pub fn movers(&self) -> &[Mover] {
        &self.movers
    }

    /// The routes that come with the world.
    #[must_use]
    pub fn tours(&self) -> &[Tour] {
        &self.tours
    }

    /// The lower left and upper right corner of the box around all walls, in the map frame, in metres.
    #[must_use]
    pub fn bounds(&self) -> (Point2<f64>, Point2<f64>) {
        (self.low, self.high)
    }

    /// The same world with other movers.
    #[must_use]
    pub fn with_movers(mut self, movers: Vec<Mover>) -> Self {
        self.movers = movers;
        self
    }

    /// Everything as it stands at `time` seconds.
    #[must_use]
    pub fn at(&self, time: f64) -> Scene<'_> {
        Scene { world: self, moved: self.movers.iter().flat_map(|mover| mover.segments(time)).collect() }
    }
}

/// Refuses points that no building has.
fn check(world: &str, what: &'static str, points: impl IntoIterator<Item = Point2<f64>>) -> Result<(), WorldError> {
    let is_bad = |point: &Point2<f64>| !point.coords.iter().all(|c| c.abs() <= FARTHEST); // true for NaN
    match points.into_iter().find(is_bad) {
        Some(bad) => Err(WorldError::Coordinates { world: world.to_owned(), what, x: bad.x, y: bad.y }),
        None => Ok(()),
    }
}

/// A [`World`] at one moment.
#[derive(Debug, Clone)]
pub struct Scene<'w> {
    world: &'w World,
    moved: Vec<Segment>,
}

impl Scene<'_> {
    /// The surface that a ray meets first: metres along the ray and the surface.
    pub(crate) fn cast(&self, origin: Point2<f64>, toward: Vector2<f64>, reach: f64) -> Option<(f64, &Segment)> {
        let wall = self.world.index.cast(&self.world.walls, origin, toward, reach);
        let mut best = wall.map(|Hit { distance, segment }| (distance, &self.world.walls[segment]));
        for segment in &self.moved {
            if let Some(distance) = segment.hit(origin, toward)
                && distance <= best.map_or(reach, |(nearest, _)| nearest)
            {
                best = Some((distance, segment));
            }
        }
        best
    }

    /// Metres along the ray from `origin` in direction `toward` to the first surface, if there is one within `reach` metres.
    #[must_use]
    pub fn distance_along(&self, origin: Point2<f64>, toward: Vector2<f64>, reach: f64) -> Option<f64> {
        self.cast(origin, toward.try_normalize(0.0)?, reach).map(|(distance, _)| distance)
    }

    /// Whether nothing stands between two points; surfaces that one of them touches do not count.
    pub(crate) fn sees(&self, from: Point2<f64>, to: Point2<f64>) -> bool {
        let way = to - from;
        let length = way.norm();
        length < 1e-9 || self.cast(from, way / length, length - 1e-6 - 1e-9 * length).is_none()
    }

    /// Metres from `point` to the nearest surface, or `reach` if nothing is nearer.
    #[must_use]
    pub fn clearance(&self, point: Point2<f64>, reach: f64) -> f64 {
        let walls = self.world.index.near(point, reach).into_iter().map(|n| self.world.walls[n].distance(point));
        walls.chain(self.moved.iter().map(|segment| segment.distance(point))).fold(reach, f64::min)
    }

    /// Whether a disc that moves straight from one point to another touches nothing on its way.
    #[must_use]
    pub fn is_swept_free(&self, from: Point2<f64>, to: Point2<f64>, radius: f64) -> bool {
        let way = Segment { from, to, material: crate::Material::Smooth };
        let middle = nalgebra::center(&from, &to);
        let near = self.world.index.near(middle, radius + way.length() * 0.5);
        let walls = near.into_iter().map(|n| &self.world.walls[n]);
        walls.chain(&self.moved).all(|wall| gap(wall, &way) > radius)
    }

    /// All surfaces as they stand: first the walls, then the outlines of what moves.
    pub fn surfaces(&self) -> impl Iterator<Item = &Segment> {
        self.world.walls.iter().chain(&self.moved)
    }

    /// All surfaces that may come nearer than `radius` metres to `point`.
    pub(crate) fn near(&self, point: Point2<f64>, radius: f64) -> Vec<Segment> {
        let mut near: Vec<Segment> =
            self.world.index.near(point, radius).into_iter().map(|n| self.world.walls[n]).collect();
        near.extend(self.moved.iter().filter(|segment| segment.distance(point) <= radius));
        near
    }

    /// The corners and edges nearer than `radius` metres to `point`.
    pub(crate) fn corners_near(&self, point: Point2<f64>, radius: f64) -> impl Iterator<Item = &Corner> {
        // Sorted by x when they were found.
        let corners = &self.world.corners;
        let first = corners.partition_point(|corner| corner.point.x < point.x - radius);
        corners[first..]
            .iter()
            .take_while(move |corner| corner.point.x <= point.x + radius)
            .filter(move |corner| (corner.point - point).norm() <= radius)
    }

    /// The corners of what moves, each an edge.
    pub(crate) fn moved_edges(&self) -> impl Iterator<Item = Point2<f64>> + '_ {
        self.moved.iter().map(|segment| segment.from)
    }
}

/// The least distance between two straight pieces; 0 where they cross.
fn gap(a: &Segment, b: &Segment) -> f64 {
    let crosses = {
        let side = |s: &Segment, p: Point2<f64>| s.along().perp(&(p - s.from));
        side(a, b.from) * side(a, b.to) < 0.0 && side(b, a.from) * side(b, a.to) < 0.0
    };
    if crosses {
        return 0.0;
    }
    a.distance(b.from).min(a.distance(b.to)).min(b.distance(a.from)).min(b.distance(a.to))
}
