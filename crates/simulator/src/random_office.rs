use std::fmt::Write as _;

use crate::World;
use crate::noise::Noise;

/// What a random office is like. `Default` is the mixture that exploration is trained on.
#[derive(Debug, Clone, PartialEq)]
pub struct OfficeStyle {
    /// Length along the corridor, least and most, in metres.
    pub length: [f64; 2],
    /// Width of the corridor, least and most, in metres.
    pub corridor: [f64; 2],
    /// Depth of the rooms, least and most, in metres.
    pub depth: [f64; 2],
    /// Width of a room along the corridor, least and most, in metres.
    pub room: [f64; 2],
    /// Width of a door, least and most, in metres.
    pub door: [f64; 2],
    /// Share of the doors that are closed.
    pub closed: f64,
    /// Share of the neighbouring rooms that have a door between them: these make loops.
    pub joined: f64,
    /// Pieces of furniture per square metre of a room.
    pub furniture: f64,
}

impl Default for OfficeStyle {
    fn default() -> Self {
        Self {
            length: [16.0, 30.0],
            corridor: [1.6, 2.8],
            depth: [3.0, 6.0],
            room: [2.6, 7.0],
            door: [0.85, 1.2],
            closed: 0.25,
            joined: 0.35,
            furniture: 0.12,
        }
    }
}

/// A random office: a corridor with rooms on both sides, doors open and closed, doors between rooms, furniture along the
/// walls, mixed materials, lying at any angle.
///
/// The same seed gives the same office; `start` is in the corridor.
///
/// ```
/// let world = simulator::random_office(3, &simulator::OfficeStyle::default());
/// assert!(world.walls().len() > 50);
/// assert_eq!(world.walls(), simulator::random_office(3, &simulator::OfficeStyle::default()).walls());
/// ```
///
/// # Panics
///
/// If the style's ranges are no ranges of lengths.
#[must_use]
pub fn random_office(seed: u64, style: &OfficeStyle) -> World {
    World::from_plan(&random_office_plan(seed, style)).expect("the generator writes plans that can be read")
}

/// The same office as the text of a plan, to be looked at or changed by hand; see [`random_office`].
#[must_use]
pub fn random_office_plan(seed: u64, style: &OfficeStyle) -> String {
    let mut draft = Draft { noise: Noise::new(seed, 100), style, text: String::new() };
    draft.building(seed);
    draft.text
}

/// A plan as it is written.
struct Draft<'s> {
    noise: Noise,
    style: &'s OfficeStyle,
    text: String,
}

/// A rectangle of floor.
#[derive(Clone, Copy)]
struct Room {
    left: f64,
    right: f64,
    low: f64,
    high: f64,
}

/// Room for a robot between furniture and whatever is opposite, in metres.
const PASSAGE: f64 = 1.0;

impl Draft<'_> {
    fn between(&mut self, [low, high]: [f64; 2]) -> f64 {
        self.noise.uniform(low, high)
    }

    fn line(&mut self, text: std::fmt::Arguments<'_>) {
        self.text.write_fmt(text).expect("writing into a string");
        self.text.push('\n');
    }

    fn building(&mut self, seed: u64) {
        let style = self.style;
        let length = self.between(style.length);
        let (south, corridor, north) =
            (self.between(style.depth), self.between(style.corridor), self.between(style.depth));
        let (from, to) = (south, south + corridor);
        let turn = self.between([-180.0, 180.0]);
        self.line(format_args!("name = \"random office {seed}\"\nrotation_deg = {turn:.2}"));
        self.line(format_args!("start = [1.0, {:.3}, 0.0]", 0.5 * (from + to)));
        let high = to + north;
        self.wall(&[[0.0, 0.0], [length, 0.0], [length, high], [0.0, high]], true);
        self.wall(&[[0.0, from], [length, from]], false);
        self.wall(&[[0.0, to], [length, to]], false);
        self.row(Room { left: 0.0, right: length, low: 0.0, high: from }, from);
        self.row(Room { left: 0.0, right: length, low: to, high }, to);
        self.corridor_furniture(Room { left: 0.0, right: length, low: from, high: to });
    }

    fn wall(&mut self, points: &[[f64; 2]], closed: bool) {
        let material = if self.noise.happens(0.25) { "rough" } else { "smooth" };
        let list: Vec<String> = points.iter().map(|[x, y]| format!("[{x:.3}, {y:.3}]")).collect();
        let list = list.join(", ");
        self.line(format_args!("[[wall]]\npoints = [{list}]\nclosed = {closed}\nmaterial = \"{material}\""));
    }

    /// Cuts a row along the corridor wall at `y = door_wall` into rooms.
    fn row(&mut self, row: Room, door_wall: f64) {
        let mut left = row.left;
        while row.right - left > 0.5 {
            let width = self.between(self.style.room);
            let right = if row.right - (left + width) < self.style.room[0] { row.right } else { left + width };
            let room = Room { left, right, ..row };
            self.door([left, right], |x| [x, door_wall], self.style.closed);
            if right < row.right {
                self.wall(&[[right, row.low], [right, row.high]], false);
                if self.noise.happens(self.style.joined) {
                    // In the middle of the wall, where no furniture stands.
                    let middle = 0.5 * (row.low + row.high);
                    self.door([middle - 0.7, middle + 0.7], |y| [right, y], 0.0);
                }
            }
            self.furnish(room, door_wall);
            left = right;
        }
    }

    /// A door somewhere on `span`, where `at` puts it; with the probability `closed` it is.
    fn door(&mut self, span: [f64; 2], at: impl Fn(f64) -> [f64; 2], closed: f64) {
        let width = self.between(self.style.door);
        let slack = (span[1] - span[0] - width - 0.2).max(0.0);
        let begin = span[0] + 0.1 + self.noise.uniform(0.0, 1.0) * slack;
        let ([x, y], [u, v]) = (at(begin), at(begin + width));
        let open = !self.noise.happens(closed);
        self.line(format_args!("[[door]]\nfrom = [{x:.3}, {y:.3}]\nto = [{u:.3}, {v:.3}]\nopen = {open}"));
    }

    /// Puts furniture along the wall opposite the door and into the corners beside it, leaving passages.
    fn furnish(&mut self, room: Room, door_wall: f64) {
        let (width, depth) = (room.right - room.left, room.high - room.low);
        let is_south = door_wall == room.high;
        let mut from = room.left + 0.05;
        let mut wanted = width * depth * self.style.furniture;
        while wanted > 0.0 && room.right - from > 0.5 {
            let size = [self.noise.uniform(0.4, 1.8), self.noise.uniform(0.3, 0.9)];
            let size = [size[0].min(room.right - from - 0.05), size[1].min(depth - 1.4 - PASSAGE)];
            if size[1] < 0.2 {
                return;
            }
            let x = from + 0.5 * size[0];
            let off = 0.03 + 0.5 * size[1];
            let y = if is_south { room.low + off } else { room.high - off };
            self.piece([x, y], size);
            from += size[0] + if self.noise.happens(0.5) { 0.1 } else { PASSAGE };
            wanted -= 1.0;
        }
        if wanted > 1.0 && width > 4.0 && depth > 4.5 {
            let table = [self.noise.uniform(0.8, width - 3.0), self.noise.uniform(0.5, 0.9)];
            let middle = if is_south { room.low + 2.3 } else { room.high - 2.3 };
            self.piece([0.5 * (room.left + room.right), middle], table);
        }
    }

    /// Cupboards along the corridor where it stays passable.
    fn corridor_furniture(&mut self, corridor: Room) {
        let spare = corridor.high - corridor.low - PASSAGE - 0.2;
        let mut x = 3.0 + self.noise.uniform(0.0, 4.0);
        while spare > 0.3 && x < corridor.right - 2.0 {
            let size = [self.noise.uniform(0.5, 1.2), self.noise.uniform(0.3, spare.min(0.6))];
            let off = 0.03 + 0.5 * size[1];
            let y = if self.noise.happens(0.5) { corridor.low + off } else { corridor.high - off };
            self.piece([x, y], size);
            x += self.noise.uniform(4.0, 9.0);
        }
    }

    fn piece(&mut self, [x, y]: [f64; 2], [width, depth]: [f64; 2]) {
        let materials = ["rough", "rough", "smooth"];
        let material = materials[self.noise.below(materials.len())];
        self.line(format_args!(
            "[[furniture]]\ncenter = [{x:.3}, {y:.3}]\nsize = [{width:.3}, {depth:.3}]\nmaterial = \"{material}\""
        ));
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::Point2;

    use super::*;

    #[test]
    fn offices_can_be_driven_into_and_differ() {
        let style = OfficeStyle::default();
        let mut areas = Vec::new();
        for seed in 0..12 {
            let world = random_office(seed, &style);
            let (low, high) = world.bounds();
            let frame = local_grid::GridFrame::covering(low, high, 0.2).unwrap();
            let cells = world.reachable(frame, 0.25).cells().iter().filter(|cell| **cell).count();
            areas.push(f64::from(u32::try_from(cells).unwrap()) * 0.04);
            let start = Point2::from(world.map_from_start().translation.vector);
            assert!(world.at(0.0).clearance(start, 1.0) > 0.4, "office {seed}");
        }
        // More than its corridor (16 × 1.1 m of centres at the least), and no two alike.
        assert!(areas.iter().all(|area| *area > 20.0), "{areas:?}");
        assert!(areas.windows(2).all(|pair| pair[0] != pair[1]));
    }
}
