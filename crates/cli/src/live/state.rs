use hierarchy::topo_map::{LinkOrigin, LinkState};
use hierarchy::{Mapper, Sample};
use local_grid::Reading;
use nalgebra::{Isometry2, Point2};
use serde::Serialize;

/// The map as it is now, for the page: whole millimetres.
#[derive(Debug, Serialize)]
pub(super) struct State {
    schema: &'static str,
    entries: usize,
    travelled_m: f64,
    loops: usize,
    refused: usize,
    energy: Option<f64>,
    /// `x` and `y` of every place.
    places: Vec<[i64; 2]>,
    /// First and last place of every link, and 1 where it was recognised.
    links: Vec<[usize; 3]>,
    /// Echoes of some scans: what the walls look like so far.
    echoes: Vec<[i64; 2]>,
    /// Echoes of the last scan.
    scan: Vec<[i64; 2]>,
    /// Where the robot is, and its heading in thousandths of a radian.
    robot: [i64; 3],
}

/// Echoes that a picture holds at most.
const ECHOES: usize = 20_000;

impl State {
    pub(super) fn of(mapper: &Mapper) -> Self {
        let (map, closures) = (mapper.topology(), mapper.closures());
        let samples = mapper.trajectory().samples();
        let readings: usize = samples.iter().map(|sample| sample.scan.readings().len()).sum();
        let poses = mapper.poses();
        let posed = || poses.iter().zip(samples);
        let links = map.links().iter().filter(|link| link.state != LinkState::Rejected);
        let accepted = closures.iter().filter(|closure| closure.is_accepted()).count();
        let robot = mapper.map_from_robot();
        let at: Vec<_> = map.places().iter().map(|place| mapper.coordinates().map_from_place(place.id)).collect();
        Self {
            schema: "topogrid/live/1",
            entries: mapper.tally().entries,
            travelled_m: mapper.tally().path_length,
            loops: accepted,
            refused: closures.len() - accepted,
            energy: mapper.coordinates().problem(map).ok().map(|problem| problem.energy(&at)),
            places: at.iter().map(|pose| millimetres(&pose.translation.vector.into())).collect(),
            links: links
                .map(|link| {
                    let recognized = usize::from(link.origin == LinkOrigin::Recognized);
                    [link.from.index(), link.to.index(), recognized]
                })
                .collect(),
            echoes: posed().step_by(readings.div_ceil(ECHOES).max(1)).flat_map(echoes).collect(),
            scan: posed().next_back().into_iter().flat_map(echoes).collect(),
            robot: {
                let [x, y] = millimetres(&robot.translation.vector.into());
                [x, y, whole(1000.0 * robot.rotation.angle())]
            },
        }
    }
}

/// Where a scan was thrown back.
fn echoes((map_from_robot, sample): (&Isometry2<f64>, &Sample)) -> Vec<[i64; 2]> {
    let echo = |beam: local_grid::Beam| match beam.reading {
        Reading::Echo(range) => {
            Some(millimetres(&(map_from_robot * beam.robot_from_sensor * Point2::new(f64::from(range), 0.0))))
        }
        Reading::NoEcho | Reading::Invalid => None,
    };
    sample.scan.beams().filter_map(echo).collect()
}

fn millimetres(point: &Point2<f64>) -> [i64; 2] {
    [whole(1000.0 * point.x), whole(1000.0 * point.y)]
}

#[expect(clippy::cast_possible_truncation, reason = "saturates; what a page draws is far smaller")]
fn whole(value: f64) -> i64 {
    value.round() as i64
}
