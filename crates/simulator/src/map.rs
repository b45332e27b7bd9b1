mod contour;
mod image;

use std::collections::VecDeque;

use nalgebra::{Isometry2, Point2, Vector2};

use crate::world::{World, WorldError, WorldParts};
use crate::{Material, Segment};

pub use image::{ImageError, MapImage};

/// What a map_server `yaml` says of its image.
#[derive(Debug, Clone, PartialEq)]
pub struct MapDescription {
    /// The image's file, relative to the description's.
    pub image: String,
    /// Metres per pixel.
    pub resolution: f64,
    /// The pose of the lower left corner of the image in the map frame.
    pub map_from_image: Isometry2<f64>,
    /// Whether white means occupied.
    pub negate: bool,
    /// Occupied above this probability.
    pub occupied_thresh: f64,
    /// Free below this probability.
    pub free_thresh: f64,
}

/// Why a map is not a world.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum MapError {
    /// A line of the description cannot be read.
    #[error("line {line}: {key} must be {expected}, got `{value}`")]
    Value {
        /// The line, from 1.
        line: usize,
        /// The key.
        key: String,
        /// What it must be.
        expected: &'static str,
        /// What it is.
        value: String,
    },
    /// A line of the description is no `key: value`.
    #[error("line {line}: expected `key: value`, got `{text}`")]
    Line {
        /// The line, from 1.
        line: usize,
        /// What it holds.
        text: String,
    },
    /// A key is needed.
    #[error("the key `{0}` is missing")]
    Missing(&'static str),
    /// The image cannot be read.
    #[error("the image cannot be read")]
    Image(#[from] ImageError),
    /// The image shows no floor.
    #[error("the map shows no free floor where a robot of {0} m radius could stand")]
    NoFloor(f64),
    /// The map can be read but describes no building.
    #[error(transparent)]
    World(#[from] WorldError),
}

impl MapDescription {
    /// Reads the `yaml` of a map_server map.
    ///
    /// # Errors
    ///
    /// A line that is no `key: value`, a key that is missing, a value out of its range, a mode other than trinary.
    pub fn parse(text: &str) -> Result<Self, MapError> {
        let mut keys = Keys::default();
        for (line, content) in (1..).zip(text.lines()) {
            let content = content.split(" #").next().unwrap_or_default().trim();
            if content.is_empty() || content.starts_with('#') || content == "---" {
                continue;
            }
            let bad = || MapError::Line { line, text: content.chars().take(60).collect() };
            let (key, value) = content.split_once(':').ok_or_else(bad)?;
            keys.take(line, key.trim(), value.trim())?;
        }
        Ok(Self {
            image: keys.image.ok_or(MapError::Missing("image"))?,
            resolution: keys.resolution.ok_or(MapError::Missing("resolution"))?,
            map_from_image: keys.map_from_image.ok_or(MapError::Missing("origin"))?,
            negate: keys.negate.unwrap_or(false),
            occupied_thresh: keys.occupied_thresh.ok_or(MapError::Missing("occupied_thresh"))?,
            free_thresh: keys.free_thresh.ok_or(MapError::Missing("free_thresh"))?,
        })
    }

    /// The description of a drawn floor plan: black lines on white, its lower left corner at the origin, `resolution`
    /// metres per pixel.
    #[must_use]
    pub fn drawing(image: &str, resolution: f64) -> Self {
        Self {
            image: image.to_owned(),
            resolution,
            map_from_image: Isometry2::identity(),
            negate: false,
            occupied_thresh: 0.5,
            free_thresh: 0.5,
        }
    }

    /// Whether a pixel of this grey is floor.
    fn is_free(&self, grey: u8) -> bool {
        let share = f64::from(grey) / 255.0;
        let occupied = if self.negate { share } else { 1.0 - share };
        occupied < self.free_thresh
    }
}

/// The keys of a description as they come.
#[derive(Default)]
struct Keys {
    image: Option<String>,
    resolution: Option<f64>,
    map_from_image: Option<Isometry2<f64>>,
    negate: Option<bool>,
    occupied_thresh: Option<f64>,
    free_thresh: Option<f64>,
}

impl Keys {
    fn take(&mut self, line: usize, key: &str, value: &str) -> Result<(), MapError> {
        let bad =
            |expected| MapError::Value { line, key: key.into(), expected, value: value.chars().take(60).collect() };
        let number = |expected, low: f64, high: f64| {
            value.parse::<f64>().ok().filter(|number| (low..=high).contains(number)).ok_or_else(|| bad(expected))
        };
        match key {
            "image" => self.image = Some(value.trim_matches(['"', '\'']).to_owned()),
            "resolution" => self.resolution = Some(number("between 0.001 and 10 metres per pixel", 1e-3, 10.0)?),
            "origin" => self.map_from_image = Some(origin(value).ok_or_else(|| bad("[x, y, yaw]"))?),
            "negate" => self.negate = Some(number("0 or 1", 0.0, 1.0)? != 0.0),
            "occupied_thresh" => self.occupied_thresh = Some(number("between 0 and 1", 0.0, 1.0)?),
            "free_thresh" => self.free_thresh = Some(number("between 0 and 1", 0.0, 1.0)?),
            "mode" if value != "trinary" => return Err(bad("trinary")),
            _ => {} // newer map servers write further keys
        }
        Ok(())
    }
}

fn origin(value: &str) -> Option<Isometry2<f64>> {
    let inner = value.strip_prefix('[')?.strip_suffix(']')?;
    let numbers: Vec<f64> = inner.split(',').map(|part| part.trim().parse()).collect::<Result<_, _>>().ok()?;
    let [x, y, yaw] = numbers.try_into().ok()?;
    let is_near = |value: f64| value.abs() <= 1e6;
    (is_near(x) && is_near(y) && is_near(yaw)).then(|| Isometry2::new(Vector2::new(x, y), yaw))
}

/// The room that a robot needs at its start, in metres: the Nomad's radius and a hand's breadth.
const ELBOW_ROOM: f64 = 0.3;
/// Floor that is not connected with the image's border counts as the inside of the building if it has so many square metres.
const LEAST_INSIDE: f64 = 10.0;
/// Straight pieces shorter than this count as clutter, which scatters sound; longer ones as smooth walls.
const CLUTTER: f64 = 0.4;

impl World {
    /// A world from a map_server map: all that is not free floor, connected with the start, is solid.
    ///
    /// The outlines of the floor are straightened within a pixel's width, so that walls at a slant are flat and not
    /// stairs: a mirror-like sensor would see each step. The robot starts where it has most room, in the largest
    /// connected piece of floor that does not run out of the image, if there is one of 10 m².
    ///
    /// # Errors
    ///
    /// No floor, or one farther than 10 km from the origin.
    pub fn from_map(name: &str, description: &MapDescription, image: &MapImage) -> Result<Self, MapError> {
        let floor = Floor::of(description, image)?;
        let map_from_pixels = |at: Vector2<f64>| description.map_from_image * Point2::from(at * description.resolution);
        let mut walls = Vec::new();
        for outline in contour::outlines(floor.columns, floor.rows, |column, row| floor.is_free(column, row)) {
            let corner = |k: usize| map_from_pixels(outline[k % outline.len()]);
            walls.extend((0..outline.len()).map(|k| {
                let (from, to) = (corner(k), corner(k + 1));
                let material = if (to - from).norm() < CLUTTER { Material::Rough } else { Material::Smooth };
                Segment { from, to, material }
            }));
        }
        #[expect(clippy::cast_precision_loss, reason = "pixels are few")]
        let start = Vector2::new(floor.start.0 as f64 + 0.5, floor.start.1 as f64 + 0.5);
        Ok(World::new(WorldParts {
            name: name.to_owned(),
            map_from_plan: description.map_from_image,
            map_from_start: Isometry2::from_parts(
                map_from_pixels(start).coords.into(),
                description.map_from_image.rotation,
            ),
            walls,
            ..WorldParts::default()
        })?)
    }
}

/// The floor that a robot can reach, rows counted from below.
struct Floor {
    columns: usize,
    rows: usize,
    free: Vec<bool>,
    /// Column and row of the pixel with most room.
    start: (usize, usize),
}

impl Floor {
    fn of(description: &MapDescription, image: &MapImage) -> Result<Self, MapError> {
        let (columns, rows) = (image.width(), image.height());
        let pixel = |index: usize| image.grey(index % columns, rows - 1 - index / columns);
        let free: Vec<bool> = (0..columns * rows).map(|index| description.is_free(pixel(index))).collect();
        let room = rooms(columns, rows, &free);
        #[expect(clippy::cast_possible_truncation, reason = "pixels per robot are few")]
        let needed = (ELBOW_ROOM / description.resolution) as f32;
        let outside = connected_with_border(columns, rows, &free);
        let roomy = |inside: bool| -> Vec<bool> {
            (0..free.len()).map(|at| room[at] > needed && !(inside && outside[at])).collect()
        };
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "saturating by the language's rule"
        )]
        let least = (LEAST_INSIDE / (description.resolution * description.resolution)) as usize;
        // A drawn plan is white round the building, too; a map by a robot may be cut off at its border.
        let inside = largest_piece(columns, &roomy(true)).filter(|piece| piece.len() >= least);
        let largest = inside.or_else(|| largest_piece(columns, &roomy(false))).ok_or(MapError::NoFloor(ELBOW_ROOM))?;
        let mut start = largest[0];
        for &pixel in &largest {
            if room[pixel] > room[start] {
                start = pixel;
            }
        }
        let mut reached = vec![false; free.len()];
        flood(columns, &free, start, &mut reached);
        Ok(Self { columns, rows, free: reached, start: (start % columns, start / columns) })
    }

    fn is_free(&self, column: usize, row: usize) -> bool {
        self.free[row * self.columns + column]
    }
}

/// The free pixels that are connected with the border of the image.
fn connected_with_border(columns: usize, rows: usize, free: &[bool]) -> Vec<bool> {
    let mut seen = vec![false; free.len()];
    let top = (rows - 1) * columns;
    let ends = (0..columns).flat_map(|column| [column, top + column]);
    let sides = (0..rows).flat_map(|row| [row * columns, row * columns + columns - 1]);
    for start in ends.chain(sides) {
        if free[start] && !seen[start] {
            flood(columns, free, start, &mut seen);
        }
    }
    seen
}

/// Pixels from each free pixel to the nearest solid one or the border, by the 3-4 chamfer (Borgefors 1986).
fn rooms(columns: usize, rows: usize, free: &[bool]) -> Vec<f32> {
    let mut room: Vec<f32> = free.iter().map(|&free| if free { f32::MAX } else { 0.0 }).collect();
    let mut relax = |row: usize, column: usize, back: isize| {
        if row == 0 || column == 0 || row == rows - 1 || column == columns - 1 {
            room[row * columns + column] = 0.0; // beyond the border nothing is known
            return;
        }
        let at = row * columns + column;
        let width = columns.cast_signed();
        for (step, cost) in [(-1, 1.0), (-width - 1, 4.0 / 3.0), (-width, 1.0), (-width + 1, 4.0 / 3.0)] {
            let beside = at.wrapping_add_signed(step * back); // not on the border: it stays inside
            room[at] = room[at].min(room[beside] + cost);
        }
    };
    for row in 0..rows {
        (0..columns).for_each(|column| relax(row, column, 1));
    }
    for row in (0..rows).rev() {
        (0..columns).rev().for_each(|column| relax(row, column, -1));
    }
    room
}

/// The pixels of the largest connected piece of `free`, or `None` if nothing is free.
fn largest_piece(columns: usize, free: &[bool]) -> Option<Vec<usize>> {
    let mut seen = vec![false; free.len()];
    let mut largest = Vec::new();
    for start in 0..free.len() {
        if free[start] && !seen[start] {
            let piece = flood(columns, free, start, &mut seen);
            if piece.len() > largest.len() {
                largest = piece;
            }
        }
    }
    (!largest.is_empty()).then_some(largest)
}

/// All pixels of `free` that are connected with `start` over edges, marked in `seen`.
fn flood(columns: usize, free: &[bool], start: usize, seen: &mut [bool]) -> Vec<usize> {
    let mut queue = VecDeque::from([start]);
    let mut piece = Vec::new();
    seen[start] = true;
    while let Some(at) = queue.pop_front() {
        piece.push(at);
        let column = at % columns;
        let beside = [
            (column > 0).then(|| at - 1),
            (column + 1 < columns).then_some(at + 1),
            at.checked_sub(columns),
            Some(at + columns).filter(|&up| up < free.len()),
        ];
        for next in beside.into_iter().flatten() {
            if free[next] && !seen[next] {
                seen[next] = true;
                queue.push_back(next);
            }
        }
    }
    piece
}

#[cfg(test)]
mod tests {
    use super::*;

    const YAML: &str = "image: 'a.pgm'\nresolution: 0.1 # m\norigin: [1.0, -2.0, 0.0]\nnegate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.196\nmode: trinary\n";

    /// A room of 30 × 20 pixels with a wall of one pixel round it, and a separate spot of floor outside.
    fn room() -> MapImage {
        let mut pgm = b"P5\n# made by a test\n40 24\n255\n".to_vec();
        for row in 0..24 {
            for column in 0..40 {
                let inside = (1..31).contains(&column) && (2..22).contains(&row);
                pgm.push(if inside || column == 36 {
                    254
                } else if column == 0 {
                    0
                } else {
                    205
                });
            }
        }
        MapImage::read(&pgm).unwrap()
    }

    #[test]
    fn a_map_becomes_the_walls_of_its_floor() {
        let world = World::from_map("room", &MapDescription::parse(YAML).unwrap(), &room()).unwrap();
        let (low, high) = world.bounds();
        approx::assert_relative_eq!(low, Point2::new(1.1, -1.8), epsilon = 1e-9);
        approx::assert_relative_eq!(high, Point2::new(4.1, 0.2), epsilon = 1e-9);
        let scene = world.at(0.0);
        let east = scene.distance_along(Point2::new(2.0, -1.0), Vector2::x(), 9.0).unwrap();
        approx::assert_relative_eq!(east, 2.1, epsilon = 1e-9); // the wall's face, not its pixel's centre
        let start = Point2::from(world.map_from_start().translation.vector);
        assert!(scene.clearance(start, 5.0) > 0.8); // half of 2 m, less a pixel
    }

    #[test]
    fn bad_descriptions_say_which_line() {
        let error = |from: &str, to: &str| MapDescription::parse(&YAML.replace(from, to)).unwrap_err().to_string();
        assert!(error("0.1 #", "-0.1 #").contains("line 2: resolution must be between"));
        assert!(error("[1.0, -2.0, 0.0]", "[1.0, nan, 0.0]").contains("line 3: origin must be [x, y, yaw]"));
        assert!(error("trinary", "scale").contains("mode must be trinary"));
        assert!(error("negate: 0", "negate 0").contains("line 4: expected `key: value`"));
        assert!(error("free_thresh: 0.196", "").contains("`free_thresh` is missing"));
    }

    #[test]
    fn a_map_without_floor_is_refused() {
        let black = MapImage::read(b"P2 2 2 255 0 0 0 0").unwrap();
        let error = World::from_map("black", &MapDescription::parse(YAML).unwrap(), &black).unwrap_err();
        assert_eq!(error, MapError::NoFloor(0.3));
    }
}
