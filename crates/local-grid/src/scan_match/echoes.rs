use nalgebra::{Point2, Vector2};

use crate::{Reading, Scan};

/// Where an echo came from, in the robot's frame, and how the surface lies there.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Echo {
    /// Metres in the robot's frame.
    pub point: Point2<f64>,
    /// The unit normal of the surface, if the neighbouring beams saw one.
    pub normal: Option<Vector2<f64>>,
}

/// Neighbours on either side that a surface is fitted to.
const NEIGHBOURS: usize = 2;

/// The echoes of a scan up to `max_range` metres, with the normals of the surfaces that neighbouring beams see.
///
/// Beams must be in order of bearing, as a fan's are. Where five neighbours lie on a line the echo knows its normal, and
/// a wall hit at a slant, of which the map holds but dots, cannot pull along itself.
#[must_use]
pub fn echoes(scan: &Scan, max_range: f64) -> Vec<Echo> {
    let seen: Vec<Option<(Point2<f64>, Vector2<f64>)>> = scan
        .beams()
        .map(|beam| match beam.reading {
            Reading::Echo(range) if f64::from(range) <= max_range => {
                let direction = beam.robot_from_sensor.rotation * Vector2::x();
                let point = beam.robot_from_sensor * Point2::new(f64::from(range), 0.0);
                Some((point, direction))
            }
            _ => None,
        })
        .collect();
    let echo = |k: usize| seen[k].map(|(point, direction)| Echo { point, normal: normal(&seen, k, direction) });
    (0..seen.len()).filter_map(echo).collect()
}

/// At most `count` echoes, evenly taken.
#[must_use]
pub fn thinned(echoes: &[Echo], count: usize) -> Vec<Echo> {
    echoes.iter().step_by(echoes.len().div_ceil(count.max(1)).max(1)).copied().collect()
}

/// The normal of the line through an echo and its neighbours, if they lie on one.
fn normal(seen: &[Option<(Point2<f64>, Vector2<f64>)>], k: usize, beam: Vector2<f64>) -> Option<Vector2<f64>> {
    let around = seen.get(k.checked_sub(NEIGHBOURS)?..=k + NEIGHBOURS)?;
    let mut points = [Point2::origin(); 2 * NEIGHBOURS + 1];
    for (point, echo) in points.iter_mut().zip(around) {
        *point = (*echo)?.0;
    }
    let along = (points[2 * NEIGHBOURS] - points[0]).try_normalize(1e-6)?;
    // A line along the beam is the jump from a near thing to a far one.
    if along.perp(&beam).abs() < 0.03 {
        return None;
    }
    let normal = Vector2::new(-along.y, along.x);
    let tolerance = 0.04 + 0.003 * points[NEIGHBOURS].coords.norm();
    let straight = points.iter().all(|point| (point - points[0]).dot(&normal).abs() <= tolerance);
    // Steps along a wall change slowly; the jump over a doorway does not.
    let mut longest = 0.0f64;
    let mut shortest = f64::INFINITY;
    for pair in points.windows(2) {
        let step = (pair[1] - pair[0]).norm();
        longest = longest.max(step);
        shortest = shortest.min(step);
    }
    (straight && longest <= 4.0 * shortest + 0.05).then_some(normal)
}
