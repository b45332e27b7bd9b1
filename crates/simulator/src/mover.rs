use nalgebra::{Point2, Vector2};

use crate::{Material, Segment};

/// Something that does not stay where it is: a person, a trolley, a chair that somebody moves while the robot is away.
///
/// Its outline keeps its orientation and follows the schedule: straight lines at constant speed from station to
/// station. A piece of furniture that jumps has two stations at nearly the same time.
#[derive(Debug, Clone, PartialEq)]
pub struct Mover {
    /// What it is called.
    pub name: String,
    /// Its outline around its own centre: the corners of a closed polygon, in metres, axes along the map's.
    pub outline: Vec<Vector2<f64>>,
    /// What it is made of.
    pub material: Material,
    /// Where it is when, in ascending order of time: before the first station it waits there, after the last it stays.
    pub stations: Vec<Station>,
    /// Whether it begins again after the last station.
    pub repeats: Repeats,
}

/// Where a [`Mover`] is at one time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Station {
    /// Seconds since the start of the experiment.
    pub time: f64,
    /// The centre of the outline in the map frame, in metres.
    pub at: Point2<f64>,
}

/// What a [`Mover`] does after its last station.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Repeats {
    /// It stays there.
    #[default]
    Never,
    /// It jumps to its first station and begins again.
    Forever,
}

impl Mover {
    /// The centre of the outline at `time` seconds.
    #[must_use]
    pub fn position(&self, time: f64) -> Point2<f64> {
        let (Some(first), Some(last)) = (self.stations.first(), self.stations.last()) else {
            return Point2::origin(); // no station: `outline` is then drawn around the origin of the map
        };
        let span = last.time - first.time;
        let time = match self.repeats {
            Repeats::Forever if span > 0.0 && time > first.time => first.time + (time - first.time) % span,
            _ => time,
        };
        let after = self.stations.partition_point(|station| station.time <= time);
        match (after.checked_sub(1).map(|k| &self.stations[k]), self.stations.get(after)) {
            (None, _) => first.at,
            (Some(last), None) => last.at,
            (Some(a), Some(b)) => a.at + (b.at - a.at) * ((time - a.time) / (b.time - a.time)),
        }
    }

    /// The outline at `time` seconds.
    pub(crate) fn segments(&self, time: f64) -> impl Iterator<Item = Segment> + '_ {
        let center = self.position(time);
        let corner = move |k: usize| center + self.outline[k % self.outline.len()];
        (0..self.outline.len()).map(move |k| Segment { from: corner(k), to: corner(k + 1), material: self.material })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn walker(repeats: Repeats) -> Mover {
        let station = |time, x| Station { time, at: Point2::new(x, 0.0) };
        let stations = vec![station(10.0, 0.0), station(20.0, 5.0), station(30.0, 5.0)];
        Mover { name: "w".into(), outline: vec![], material: Material::Rough, stations, repeats }
    }

    #[test]
    fn stations_are_joined_by_straight_lines() {
        let at = |time| walker(Repeats::Never).position(time).x;
        assert_eq!([at(0.0), at(15.0), at(20.0), at(25.0), at(99.0)], [0.0, 2.5, 5.0, 5.0, 5.0]);
    }

    #[test]
    fn a_repeating_schedule_begins_again() {
        assert_eq!(walker(Repeats::Forever).position(10.0 + 20.0 + 5.0).x, 2.5);
    }
}
