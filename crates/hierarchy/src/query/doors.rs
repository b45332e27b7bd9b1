//! Which doors are shut at present, by what was last seen of them.

use nalgebra::{Isometry2, Point2, Vector2};
use region_map::{Gateway, RegionMap};
use robot_log::local_grid::{Beam, RangeSensor, Reading, SensorKind};

use crate::mapper::Mapper;
use crate::query::floor_plan::Passage;

/// An echo so near to a door's line, in metres, came from the door: the robot's pose may be off by as much.
const AT_THE_DOOR: f64 = 0.25;
/// A reading that goes on for so many metres behind the line went through.
const BEHIND: f64 = 0.4;
/// A beam that meets the line nearer than this to a jamb, in metres, may see the jamb.
const JAMB: f64 = 0.05;
/// In a sonar map a door is narrower than it is, by the width of its jambs' echoes; it is at least so wide, in metres.
const DOOR: f64 = 0.9;
/// Doors are judged from at most so far, in metres.
const REACH: f64 = 4.0;
/// How much an echo says for "shut", and a reading that goes through against it, each in [0, 1].
const ECHO: f64 = 0.4;
const THROUGH: f64 = 0.6;
/// A door is shut if that much is believed: four echoes in a row, say.
const SHUT: f64 = 0.85;
/// From a smooth surface a laser hears something up to this angle from the normal, in radians.
const SLANT: f64 = 1.0;

/// What is believed of one gateway.
#[derive(Debug, Clone, Copy, Default)]
struct Belief {
    /// To which degree it is shut.
    shut: f64,
    /// Whether anything spoke of it at all.
    seen: bool,
}

impl Belief {
    /// The algebraic sum with an echo; what goes through takes as much away.
    fn hear(&mut self, through: bool) {
        self.seen = true;
        self.shut = if through { self.shut * (1.0 - THROUGH) } else { self.shut + ECHO - self.shut * ECHO };
    }

    fn pass(&mut self) {
        *self = Self { shut: 0.0, seen: true };
    }

    fn passage(self) -> Option<Passage> {
        self.seen.then_some(if self.shut > SHUT { Passage::SeenClosed } else { Passage::Open })
    }
}

impl Mapper {
    /// What was last seen of each gateway of a map; `None` where no reading speaks of it.
    ///
    /// The map says that there is a way; later readings may contradict it. Each reading that meets the line between the
    /// jambs squarely is heard, in the order in which they came: an echo from the line says "shut", one from behind it
    /// takes that back, and whoever drove through knows that it was open. So a door that is opened again is open again as
    /// soon as it is seen so.
    #[must_use]
    pub fn doors_last_seen(&self, map: &RegionMap) -> Vec<Option<Passage>> {
        let mut beliefs = vec![Belief::default(); map.gateways.len()];
        let mut before: Option<Isometry2<f64>> = None;
        for (sample, map_from_robot) in self.trajectory().samples().iter().zip(self.poses()) {
            let robot = Point2::from(map_from_robot.translation.vector);
            for (gateway, belief) in map.gateways.iter().zip(&mut beliefs) {
                if (gateway.center - robot).norm() > REACH {
                    continue;
                }
                let came = before.map(|before| Point2::from(before.translation.vector));
                if came.is_some_and(|from| crosses(gateway, from, robot)) {
                    belief.pass();
                }
                let sensor = sample.scan.sensor();
                let heard = sample.scan.beams().filter_map(|beam| hear(gateway, &map_from_robot, sensor, &beam));
                heard.for_each(|through| belief.hear(through));
            }
            before = Some(map_from_robot);
        }
        beliefs.into_iter().map(Belief::passage).collect()
    }
}

/// Whether a step leads through a gateway.
fn crosses(gateway: &Gateway, from: Point2<f64>, to: Point2<f64>) -> bool {
    let side = |point: Point2<f64>| (point - gateway.center).dot(&gateway.normal);
    let (a, b) = (side(from), side(to));
    a * b < 0.0 && {
        let at = from + (to - from) * (a / (a - b));
        (at - gateway.center).norm() < 0.5 * gateway.width
    }
}

/// Whether a reading went through a gateway (`true`), came back from its line (`false`), or says nothing of it.
fn hear(gateway: &Gateway, map_from_robot: &Isometry2<f64>, sensor: &RangeSensor, beam: &Beam) -> Option<bool> {
    let map_from_sensor = map_from_robot * beam.robot_from_sensor;
    let face = Point2::from(map_from_sensor.translation.vector);
    let toward = map_from_sensor * Vector2::x();
    let square = toward.dot(&gateway.normal);
    let half = 0.5 * sensor.beam_width();
    // A wide cone hears a smooth door only if it holds the door's normal; then the echo comes from the nearest point.
    let slant = square.abs().clamp(0.0, 1.0).acos();
    let is_cone = sensor.kind() == SensorKind::Sonar;
    if slant > if is_cone { half } else { SLANT } {
        return None;
    }
    let distance = (gateway.center - face).dot(&gateway.normal) / square;
    if distance <= 0.0 {
        return None;
    }
    let off = (face + toward * distance - gateway.center).norm();
    let jambs = if is_cone { gateway.width.max(DOOR) } else { gateway.width };
    if off + distance * half.tan() > 0.5 * jambs - JAMB {
        return None;
    }
    let expected = if is_cone { distance * square.abs() } else { distance };
    match beam.reading {
        Reading::Echo(range) if (f64::from(range) - expected).abs() <= AT_THE_DOOR => Some(false),
        Reading::Echo(range) if f64::from(range) >= expected + BEHIND => Some(true),
        Reading::NoEcho if is_cone && sensor.max_range() >= expected + BEHIND => Some(true),
        _ => None,
    }
}
