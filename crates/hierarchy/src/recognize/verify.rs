use nalgebra::{Isometry2, Matrix3, Vector2};
use robot_log::local_grid::{
    Ambiguity, Echo, LocalMap, LocalMapOptions, Match, MatchOptions, Prior, SensorKind, echoes, refine, thinned,
};
use topo_map::{Displacement, PlaceId, Turn};

use crate::recognize::Closure;
use crate::trajectory::{Anchor, Sample, Trajectory};

/// What the laser says of a closure.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Verification {
    /// The scans of the place fit the walls of the known one, and measure how the two lie.
    Borne(Displacement),
    /// There is no laser, or it saw too little.
    Silent,
    /// The scans do not fit those walls; the score tells how badly.
    Refuted(f64),
}

/// The walls of a place are those seen within so many metres of driving.
const WALLS_WITHIN: f64 = 1.5;
/// Scans that draw them, at most: half a metre apart. More of them blur the walls by the errors between them.
const SCANS_OF_WALLS: usize = 6;
/// The view of the other place is that within so many metres of driving.
const VIEW_WITHIN: f64 = 0.4;
/// Scans of the view, at most.
const SCANS_OF_VIEW: usize = 3;
/// Echoes of the view: fewer say too little, more cost time.
const ECHOES: std::ops::RangeInclusive<usize> = 60..=400;
/// A fit below this score, of 1, is none: half of the echoes have no wall.
const LEAST_SCORE: f64 = 0.5;
/// The same where nothing else says that the two see the same walls.
const SURE_SCORE: f64 = 0.75;
/// 99.9 % of χ² with three degrees of freedom, as a deviation: how far the scans may lead from what the signatures say.
const FARTHEST: f64 = 4.03;
/// The least deviations of such a measurement, in metres and radians: walls are not straight, paths between scans not exact.
const FLOOR: (f64, f64) = (0.03, 0.006);

/// The coordinates have a place elsewhere than the signatures if they differ by so many metres; they are of no help where the
/// turns differ by so many radians.
const ELSEWHERE: (f64, f64) = (0.3, 0.2);
/// Nor where they are farther apart than this, in metres: the walls seen from one place end.
const FIELD: f64 = 3.0;
/// Scores that differ by less are equal.
const AS_WELL: f64 = 0.02;

/// Slides the laser scans taken at a closure's place into the walls seen from the known place.
///
/// Signatures have cells of a decimetre, scans know a centimetre; and where the scans do not fit, the two are not the same.
/// Along a street of like houses signatures may lie one house aside, while the scans, which see farther, fit as well or
/// better where the coordinates have the place already (`expected`: the known place as seen from the other). Then that is
/// what they measure.
pub(crate) fn by_walls(trajectory: &Trajectory, closure: &Closure, expected: &Isometry2<f64>) -> Verification {
    let Some((walls, view)) = seen(trajectory, closure.place, closure.known) else { return Verification::Silent };
    let prior = prior(&closure.displacement);
    let fit = |prior: &Prior| refine(&walls, &view, prior, &MatchOptions::default());
    let unmoved = Prior { map_from_robot: expected.inverse(), ..prior };
    let apart = prior.map_from_robot.inv_mul(&unmoved.map_from_robot);
    let elsewhere =
        (ELSEWHERE.0..FIELD).contains(&apart.translation.vector.norm()) && apart.rotation.angle().abs() < ELSEWHERE.1;
    let (mut found, mut prior) = (fit(&prior), prior);
    if let Some(there) = elsewhere.then(|| fit(&unmoved)).filter(|there| there.score >= found.score - AS_WELL) {
        (found, prior) = (there, unmoved);
    }
    if found.score < LEAST_SCORE || prior.deviation(&found.map_from_robot) > FARTHEST {
        return Verification::Refuted(found.score);
    }
    let information = told(&found).try_inverse().map(|information| information + said(&prior, &found));
    let covariance = information.and_then(|information| information.try_inverse());
    covariance.map_or(Verification::Silent, |covariance| {
        Verification::Borne(displacement(&found.map_from_robot, &covariance, closure.displacement.turn.is_some()))
    })
}

/// How two places lie to each other that the coordinates have beside each other: where the scans of `place` fit the walls seen
/// from `known`, and how well; `None` where they do not, or saw too little.
///
/// `expected` is the known place as seen from the other, surely enough that the walls of one place are in the reach of the
/// other's: to `variance` (m², rad²), which decides whether a fit is where it can be but has no part in what is measured. The
/// coordinates' word is in the map already.
pub(crate) fn beside(
    trajectory: &Trajectory,
    (place, known): (PlaceId, PlaceId),
    expected: &Isometry2<f64>,
    variance: (f64, f64),
    turns: bool,
) -> Option<(Displacement, f64)> {
    let (walls, view) = seen(trajectory, place, known)?;
    let (position, turn) = (variance.0 + FLOOR.0.powi(2), variance.1 + FLOOR.1.powi(2));
    let information = Matrix3::from_diagonal(&[1.0 / position, 1.0 / position, 1.0 / turn].into());
    let prior = Prior { map_from_robot: expected.inverse(), information };
    let found = refine(&walls, &view, &prior, &MatchOptions::default());
    let fits = found.score >= SURE_SCORE && prior.deviation(&found.map_from_robot) <= FARTHEST;
    fits.then(|| (displacement(&found.map_from_robot, &told(&found), turns), found.score))
}

/// The walls seen from the known place, and the echoes of the other's view.
fn seen(trajectory: &Trajectory, place: PlaceId, known: PlaceId) -> Option<(LocalMap, Vec<Echo>)> {
    let view = view(trajectory, anchor(trajectory, place)?);
    if view.len() < *ECHOES.start() {
        return None;
    }
    Some((walls(trajectory, anchor(trajectory, known)?)?, thinned(&view, *ECHOES.end())))
}

/// The anchor of a place where the robot came there: each is visited once, whatever it is recognised as.
fn anchor(trajectory: &Trajectory, place: PlaceId) -> Option<&Anchor> {
    let first = trajectory.anchors().partition_point(|anchor| anchor.place < place);
    trajectory.anchors().get(first).filter(|anchor| anchor.place == place)
}

/// The laser scans of `samples`, at most `count` of them, evenly taken, with the robot's pose in the anchor's place.
fn lasers<'a>(
    samples: &'a [Sample],
    anchor: &Anchor,
    count: usize,
) -> impl Iterator<Item = (Isometry2<f64>, &'a Sample)> + use<'a> {
    let place_from_track = anchor.place_from_robot * anchor.track_from_robot.inverse();
    let every = samples.len().div_ceil(count.max(1)).max(1);
    let lasers = samples.iter().filter(|sample| sample.scan.sensor().kind() == SensorKind::Laser).step_by(every);
    lasers.map(move |sample| (place_from_track * sample.track_from_robot, sample))
}

fn walls(trajectory: &Trajectory, anchor: &Anchor) -> Option<LocalMap> {
    let near = trajectory.driven(anchor.travelled - WALLS_WITHIN, anchor.travelled + WALLS_WITHIN);
    let mut map: Option<LocalMap> = None;
    for (pose, sample) in lasers(near, anchor, SCANS_OF_WALLS) {
        let map = match &mut map {
            Some(map) => map,
            None => map.insert(LocalMap::new(LocalMapOptions::default()).ok()?),
        };
        map.insert_echoes(&pose, &sample.scan).ok()?;
    }
    map
}

/// The echoes of the scans taken at a place, in its axes.
fn view(trajectory: &Trajectory, anchor: &Anchor) -> Vec<Echo> {
    let near = trajectory.driven(anchor.travelled - VIEW_WITHIN, anchor.travelled + VIEW_WITHIN);
    let farthest = LocalMapOptions::default().max_range;
    let moved = |(pose, sample): (Isometry2<f64>, &Sample)| {
        let there = move |echo: Echo| Echo {
            point: pose * echo.point,
            normal: echo.normal.map(|normal| pose.rotation * normal),
        };
        echoes(&sample.scan, farthest).into_iter().map(there)
    };
    lasers(near, anchor, SCANS_OF_VIEW).flat_map(moved).collect()
}

/// Where the signatures put the place, in the axes of the known one.
fn prior(displacement: &Displacement) -> Prior {
    let place_from_known = displacement.from_place_from_to_place();
    let known_from_place = place_from_known.inverse();
    let turn = known_from_place.rotation.to_rotation_matrix();
    let mut covariance = Matrix3::identity() * COMPASS.powi(2);
    let position = turn * displacement.covariance * turn.transpose();
    covariance.fixed_view_mut::<2, 2>(0, 0).copy_from(&position);
    if let Some(turn) = displacement.turn {
        covariance[(2, 2)] = turn.variance.max(FLOOR.1.powi(2));
    }
    let information = covariance.try_inverse().unwrap_or_else(Matrix3::zeros);
    Prior { map_from_robot: known_from_place, information }
}

/// The covariance of what scans measure: along an axis of which the walls say nothing, that of a guess.
fn told(found: &Match) -> Matrix3<f64> {
    let mut covariance = found.covariance;
    let mut position = covariance.fixed_view_mut::<2, 2>(0, 0);
    position += found.ambiguity.unknown() * A_GUESS.powi(2);
    covariance
}

/// What the signatures' word adds to that of the scans: nothing along an axis that the scans, which see farther, call a guess.
fn said(prior: &Prior, found: &Match) -> Matrix3<f64> {
    if found.ambiguity == Ambiguity::None {
        return prior.information;
    }
    let Some(mut covariance) = prior.information.try_inverse() else { return Matrix3::zeros() };
    let mut position = covariance.fixed_view_mut::<2, 2>(0, 0);
    position += found.ambiguity.unknown() * A_GUESS.powi(2);
    covariance.try_inverse().unwrap_or_else(Matrix3::zeros)
}

/// The standard deviation of a guess, in metres.
const A_GUESS: f64 = 1.0;

/// How far the axes of two places of a compass may be turned to each other, as a standard deviation in radians.
const COMPASS: f64 = 0.06;

/// The known place as seen from the other, with the covariance that follows from that of `known_from_place`:
/// `v = −Rᵀt`, so `δv = −Rᵀ δt + J Rᵀ t δθ`, with `J` the quarter turn.
fn displacement(known_from_place: &Isometry2<f64>, covariance: &Matrix3<f64>, turns: bool) -> Displacement {
    let place_from_known = known_from_place.inverse();
    let back = place_from_known.rotation.to_rotation_matrix();
    let at = place_from_known.translation.vector;
    let swing = Vector2::new(at.y, -at.x);
    let mut jacobian = nalgebra::Matrix2x3::zeros();
    jacobian.fixed_view_mut::<2, 2>(0, 0).copy_from(&-back.into_inner());
    jacobian.set_column(2, &swing);
    let position = jacobian * covariance * jacobian.transpose();
    let turn = Turn { change: place_from_known.rotation.angle(), variance: covariance[(2, 2)] + FLOOR.1.powi(2) };
    Displacement {
        vector: at,
        covariance: position + nalgebra::Matrix2::identity() * FLOOR.0.powi(2),
        turn: turns.then_some(turn),
    }
}
