use std::f64::consts::{FRAC_PI_2, FRAC_PI_4};

use nalgebra::Isometry2;
use topo_map::{Link, LinkOrigin, PlaceId, TopoMap};

use crate::config::HeadingConfig;

/// A heading that the building holds: that of a place as seen from the first one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HeldHeading {
    /// The place.
    pub place: PlaceId,
    /// Its heading less that of the first place, in radians.
    pub heading: f64,
    /// Its variance in rad².
    pub variance: f64,
}

/// The headings that the directions of travel tell, where a robot sees no walls.
///
/// Corridors are straight and most buildings have one direction, modulo 90°; whoever drives along them shows it, as
/// walls would. With `θ` the direction of each travelled link in the map and `l` its length, the building's direction
/// is `α = ¼ arg Σ l e^{4iθ}`, and every link that runs within three deviations of `α + k·90°` holds the heading of the
/// place that it leaves.
///
/// Nothing is held unless nearly all of the way runs so: a building with wings at odd angles, and open ground, show in
/// links that disagree. Without a compass a bend of the whole map is what odometry knows least of: along a corridor that
/// is driven up and down it cancels only where the robot veers the same way on both.
pub(crate) fn held_headings<S>(
    map: &TopoMap<S>,
    poses: &[Isometry2<f64>],
    heading: &HeadingConfig,
) -> Vec<HeldHeading> {
    let Some(first) = poses.first() else { return Vec::new() };
    let ways: Vec<Way> = map.links().iter().filter_map(|link| Way::along(link, poses)).collect();
    let (sine, cosine) = ways.iter().fold((0.0, 0.0), |(sine, cosine), way| {
        let (s, c) = (4.0 * way.direction).sin_cos();
        (sine + way.length * s, cosine + way.length * c)
    });
    let axis = 0.25 * f64::atan2(sine, cosine);
    let deviation = heading.compass_disturbance_deg.to_radians();
    let held = |way: &Way| {
        // Steps closer together than the disturbance reaches are not independent.
        let variance = deviation.powi(2) * (heading.compass_correlation_m / way.length).max(1.0);
        let off = (way.direction - axis + FRAC_PI_4).rem_euclid(FRAC_PI_2) - FRAC_PI_4;
        let turned = poses[way.place.index()].rotation.angle() - first.rotation.angle() - off;
        (off.abs() <= GATE * variance.sqrt())
            .then_some((way.length, HeldHeading { place: way.place, heading: turned, variance }))
    };
    let (lengths, held): (Vec<f64>, Vec<HeldHeading>) = ways.iter().filter_map(held).unzip();
    let (along, driven) = (lengths.iter().sum::<f64>(), ways.iter().map(|way| way.length).sum::<f64>());
    if driven >= SHORTEST && along >= LEAST_SHARE * driven { held } else { Vec::new() }
}

/// Deviations within which a link runs along the building.
const GATE: f64 = 3.0;
/// The share of the way that must run so, as for walls.
const LEAST_SHARE: f64 = 0.8;
/// Metres of travel below which nothing can be said of a building.
const SHORTEST: f64 = 20.0;
/// Links shorter than this, in metres, have no direction worth the name.
const STEP: f64 = 0.3;

/// A travelled link in the map.
struct Way {
    place: PlaceId,
    length: f64,
    direction: f64,
}

impl Way {
    fn along(link: &Link, poses: &[Isometry2<f64>]) -> Option<Self> {
        let vector = link.displacement.vector;
        let length = vector.norm();
        let from = poses.get(link.from.index())?;
        let direction = from.rotation.angle() + f64::atan2(vector.y, vector.x);
        let usable = link.origin == LinkOrigin::Traveled && length >= STEP && link.displacement.turn.is_some();
        usable.then_some(Self { place: link.from, length, direction })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{Matrix2, Vector2};
    use topo_map::{Displacement, Turn};

    /// A chain of one-metre steps, each turning by `turn`, laid out as it says.
    fn chain(turns: impl Iterator<Item = f64>) -> (TopoMap<()>, Vec<Isometry2<f64>>) {
        let mut map = TopoMap::new();
        let mut last = map.add_place(()).unwrap();
        let mut poses = vec![Isometry2::identity()];
        for change in turns {
            let place = map.add_place(()).unwrap();
            let turn = Some(Turn { change, variance: 1e-3 });
            let displacement = Displacement { vector: Vector2::x(), covariance: Matrix2::identity() * 1e-3, turn };
            map.travel(last, place, displacement).unwrap();
            poses.push(poses[poses.len() - 1] * Isometry2::new(Vector2::x(), change));
            last = place;
        }
        (map, poses)
    }

    #[test]
    fn a_bent_corridor_is_told_to_be_straight() {
        let (map, poses) = chain((0..60).map(|_| 0.004));
        let held = held_headings(&map, &poses, &HeadingConfig::default());
        assert_eq!(held.len(), 60);
        let spread = held.iter().map(|held| held.heading).fold((f64::MAX, f64::MIN), |(a, b), x| (a.min(x), b.max(x)));
        assert!(spread.1 - spread.0 < 1e-9, "all places of a corridor face the same way: {spread:?}");
    }

    #[test]
    fn corners_are_right_angles() {
        let (map, poses) = chain((0..80).map(|k| if k % 20 == 19 { 1.5 } else { 0.0 }));
        let held = held_headings(&map, &poses, &HeadingConfig::default());
        assert!(held.len() > 70);
        let turn = held[25].heading - held[5].heading;
        approx::assert_relative_eq!(turn.rem_euclid(std::f64::consts::TAU), FRAC_PI_2, epsilon = 1e-6);
    }

    #[test]
    fn a_round_building_holds_nothing() {
        let (map, poses) = chain((0..200).map(|_| 0.03));
        assert!(held_headings(&map, &poses, &HeadingConfig::default()).is_empty());
        let (map, poses) = chain((0..5).map(|_| 0.0));
        assert!(held_headings(&map, &poses, &HeadingConfig::default()).is_empty(), "five metres are no building");
    }
}
