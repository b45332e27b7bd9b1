use nalgebra::{Isometry2, Point2, Vector2};

use crate::world::{World, WorldError, WorldParts};
use crate::{Material, Segment};

/// Why a line map is not a world.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum LineMapError {
    /// The text does not begin as a line map does.
    #[error("line 1: expected `2D-Map`, got `{0}`")]
    Format(String),
    /// Coordinates cannot be read.
    #[error("line {line}: expected {expected}, got `{text}`")]
    Line {
        /// The line, from 1.
        line: usize,
        /// What was expected.
        expected: &'static str,
        /// What it holds.
        text: String,
    },
    /// The map has no section of lines.
    #[error("the map has no `LINES` section: it holds no walls")]
    NoLines,
    /// No place in the map can be stood at.
    #[error("no `Dock`, `Goal` or `RobotHome` of the map has {0} m of room for a robot to start at")]
    NoStart(f64),
    /// The map can be read but describes no building.
    #[error(transparent)]
    World(#[from] WorldError),
}

/// The room that a robot needs at its start, in metres.
const ELBOW_ROOM: f64 = 0.3;

impl World {
    /// A world from a line map of the MobileSim family (`2D-Map`, millimetres): its `LINES` are smooth walls, its
    /// forbidden lines, which close the building, too. The robot starts at the roomiest goal, dock or home; what the
    /// file holds beside that, such as scan points, is left out.
    ///
    /// ```
    /// let text = "2D-Map\nCairn: Goal 1000 1500 90 \"\" ICON \"here\"\nLINES\n0 0 3000 0\n3000 0 3000 3000\nDATA\n5 5\n";
    /// let world = simulator::World::from_line_map("small", text)?;
    /// assert_eq!((world.walls().len(), world.bounds().1.x), (2, 3.0));
    /// # Ok::<(), simulator::LineMapError>(())
    /// ```
    ///
    /// # Errors
    ///
    /// Another format, coordinates that are no numbers, no walls, no place to start.
    pub fn from_line_map(name: &str, text: &str) -> Result<Self, LineMapError> {
        let first = text.lines().next().unwrap_or_default().trim();
        if first != "2D-Map" {
            return Err(LineMapError::Format(first.chars().take(40).collect()));
        }
        let mut map = LineMap::default();
        let mut is_header = true;
        for (line, content) in (1..).zip(text.lines()) {
            match content.trim() {
                "LINES" => is_header = false,
                "DATA" => break, // scan points follow
                content if is_header => map.header(line, content)?,
                "" => {}
                content => map.wall(line, content)?,
            }
        }
        if is_header {
            return Err(LineMapError::NoLines);
        }
        map.into_world(name)
    }
}

/// What was read so far, in metres.
#[derive(Default)]
struct LineMap {
    walls: Vec<Segment>,
    starts: Vec<Isometry2<f64>>,
}

impl LineMap {
    fn header(&mut self, line: usize, content: &str) -> Result<(), LineMapError> {
        let Some(cairn) = content.strip_prefix("Cairn: ") else { return Ok(()) };
        let (kind, rest) = cairn.split_once(' ').unwrap_or((cairn, ""));
        let bad = |expected| LineMapError::Line { line, expected, text: content.chars().take(60).collect() };
        match kind {
            "Goal" | "GoalWithHeading" | "Dock" | "RobotHome" => {
                let [x, y, degrees] = numbers(rest.split(' ').take(3)).ok_or_else(|| bad("x y heading in mm and °"))?;
                self.starts.push(Isometry2::new(Vector2::new(x, y) * 1e-3, degrees.to_radians()));
            }
            "ForbiddenLine" => {
                let corners = rest.rsplit(' ').take(4).collect::<Vec<_>>().into_iter().rev();
                self.add(numbers(corners).ok_or_else(|| bad("a forbidden line that ends in x1 y1 x2 y2 in mm"))?);
            }
            _ => {}
        }
        Ok(())
    }

    fn wall(&mut self, line: usize, content: &str) -> Result<(), LineMapError> {
        let bad =
            || LineMapError::Line { line, expected: "x1 y1 x2 y2 in mm", text: content.chars().take(60).collect() };
        self.add(numbers(content.split_whitespace()).ok_or_else(bad)?);
        Ok(())
    }

    fn add(&mut self, [x, y, u, v]: [f64; 4]) {
        let (from, to) = (Point2::new(x, y) * 1e-3, Point2::new(u, v) * 1e-3);
        self.walls.push(Segment { from, to, material: Material::Smooth });
    }

    fn into_world(self, name: &str) -> Result<World, LineMapError> {
        let parts = WorldParts { name: name.to_owned(), walls: self.walls, ..WorldParts::default() };
        let world = World::new(parts.clone())?;
        let room = |start: &Isometry2<f64>| world.at(0.0).clearance(Point2::from(start.translation.vector), 10.0);
        let roomiest = self.starts.into_iter().max_by(|a, b| room(a).total_cmp(&room(b)));
        let map_from_start =
            roomiest.filter(|start| room(start) > ELBOW_ROOM).ok_or(LineMapError::NoStart(ELBOW_ROOM))?;
        Ok(World::new(WorldParts { map_from_start, ..parts })?)
    }
}

/// Exactly `N` finite numbers.
fn numbers<'a, const N: usize>(words: impl Iterator<Item = &'a str>) -> Option<[f64; N]> {
    let numbers: Option<Vec<f64>> =
        words.map(|word| word.parse().ok().filter(|number: &f64| number.is_finite())).collect();
    numbers?.try_into().ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    const ROOM: &str = "2D-Map\nCairn: Dock 100 100 0 \"\" ICON \"\"\nCairn: Goal 1000 1500 90 \"\" ICON \"a goal\"\nCairn: ForbiddenLine 7 8 0 \"\" ICON \"\" 0 0 0 3000\nLINES\n0 0 3000 0\n3000 0 3000 3000\n0 3000 3000 3000\n";

    #[test]
    fn lines_are_walls_and_the_roomiest_goal_is_the_start() {
        let world = World::from_line_map("room", ROOM).unwrap();
        assert_eq!(world.walls().len(), 4);
        approx::assert_relative_eq!(world.map_from_start().translation.vector, Vector2::new(1.0, 1.5));
    }

    #[test]
    fn bad_line_maps_are_refused_with_their_line() {
        let error = |text: &str| World::from_line_map("x", text).unwrap_err().to_string();
        assert!(error("3D-Map").contains("expected `2D-Map`"));
        assert_eq!(error("2D-Map\nDATA\n"), LineMapError::NoLines.to_string());
        assert!(error(&ROOM.replace("0 0 3000 0\n", "0 0 3000\n")).contains("line 6: expected x1 y1 x2 y2 in mm"));
        assert!(error(&ROOM.replace("1000 1500 90", "1000 north 90")).contains("line 3"));
        assert!(error(&ROOM.replace("1000 1500 90", "50 50 90")).contains("no `Dock`"));
        assert!(error("2D-Map\nLINES\n").contains("has no wall"));
    }
}
