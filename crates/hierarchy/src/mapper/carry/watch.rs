use std::collections::VecDeque;

use nalgebra::{Isometry2, Point2, Vector2};
use robot_log::local_grid::SensorKind;

use crate::trajectory::Sample;

/// Notices that the robot was carried: from one scan to the next everything around it is another, for good.
///
/// A scan shows again what the scans just before it showed, the less of it the farther apart they were taken: of the echoes
/// that can be compared a share `q(d) = 0.9 e^(−d/D)` agrees. Let `m` be the share of `n` comparable echoes that agrees across
/// a moment, between the five views before it and the five after, `q` the share that their distances let expect, and `k ≤ 1`
/// by how much fewer than expected agree among the views of either side. While the robot drives, `m` is `k q` but for the
/// chance of so few echoes, of which each is counted more than once, and for corners; where it was carried only chance makes
/// views agree. Both were measured, and the odds that it was carried are
///
/// ```text
/// log P(carried)/P(driven) + log N(m; 0.15, 0.14²) − log N(m; k q, 1.5 k q (1 − k q)/n + 0.07²) + what a compass says
/// ```
///
/// A compass that turns at that moment while the wheels do not speaks for it. One odd scan, a person before the lens or a turn
/// too fast to compare, does not: both sides must agree among themselves.
///
/// Being carried along a corridor is not noticed here, since it looks as before; see [`Hindsight`](crate::recognize::hindsight).
#[derive(Debug, Default)]
pub(in crate::mapper) struct CarryWatch {
    /// The last ten views, the oldest first.
    views: VecDeque<View>,
}

/// A scan, ready to be compared with others.
#[derive(Debug)]
struct View {
    /// The sample's number.
    sample: usize,
    track_from_robot: Isometry2<f64>,
    echoes: Vec<Polar>,
    /// How far apart in bearing two echoes may be that come from one surface, in radians.
    beam: f64,
    /// Whether its sensor tells surfaces a few degrees apart from each other.
    is_precise: bool,
    /// By how much a compass contradicts the heading, in radians; 0 without one.
    contradicted: f64,
    /// How it agrees with the view before, with the one before that, and so on.
    agrees: [Agreement; CarryWatch::SIDE],
}

/// An echo as seen by the robot: radians and metres, and the same as a point.
#[derive(Debug, Clone, Copy)]
struct Polar {
    bearing: f64,
    distance: f64,
    point: Vector2<f64>,
}

/// Of the echoes of one scan how many can be compared with another's, how many of these show the same, and how many would
/// while the robot drives.
#[derive(Debug, Clone, Copy, Default)]
struct Agreement {
    same: f64,
    comparable: f64,
    expected: f64,
}

/// A normal distribution.
#[derive(Debug, Clone, Copy)]
struct Normal {
    mean: f64,
    deviation: f64,
}

/// Echoes of a scan that are compared, about.
const ECHOES: usize = 36;
/// The fewest comparable echoes, across a moment and on its sides, that say anything.
const LEAST: f64 = 12.0;
/// Two surfaces are the same where their distances differ by no more: metres, and a share of the distance.
const SAME: (f64, f64) = (0.1, 0.05);
/// Rays narrower than this, in radians, are compared as if they were so wide: there are gaps between them.
const NARROWEST: f64 = 0.05;
/// The share of comparable echoes that agree between two views from one spot.
const AGREES: f64 = 0.9;
/// Within how many metres that falls by e: sonars hear a wall only where it faces them, rays see it from everywhere.
const FADES: f64 = 5.0;
const FADES_FOR_RAYS: f64 = 15.0;
/// How often an echo is counted, since it is compared with several views: the variance of a share is so many times that of
/// independent echoes.
const COUNTED: f64 = 1.5;
/// By how much the share varies besides, where a robot comes round a corner.
const CORNERS: f64 = 0.07;
/// The share that agrees where the robot was set down somewhere else in the same building: 2,000 pairs of spots.
const CARRIED: Normal = Normal { mean: 0.15, deviation: 0.14 };
/// The share of robots that are set down where it looks as before, as along a corridor.
const ALIKE: f64 = 0.1;
/// Logarithm of the odds that a robot was carried between two scans, before looking: once in a million.
pub(crate) const RARE: f64 = -13.8;
/// Logarithm of the odds from which it is in question, so that a place that comes now can wait for the next scans.
const IN_QUESTION: f64 = RARE + 7.0;
/// Views after a moment from which it can be in question.
const FIRST_LOOK: usize = 3;
/// Views farther apart than this, in metres and radians, are not judged: those of rays, which look ahead only, and those of
/// sonars, which hear all around. (In Örebro, with scans 1 to 2.5 m apart, a door looked like being carried.)
const LEAP_OF_RAYS: (f64, f64) = (0.6, 0.8);
const LEAP: (f64, f64) = (1.2, std::f64::consts::PI);
/// A compass contradicts the wheels where it differs from them by more than this in radians, in each view after the moment, and
/// by less than half in each before.
const TURNED: f64 = 0.35;
/// What that adds to the logarithm of the odds: disturbances come by and by.
const BY_COMPASS: f64 = 7.0;

impl CarryWatch {
    /// Views on either side of the moment in question.
    pub(crate) const SIDE: usize = 5;

    /// Looks at the next sample, whose heading a compass contradicts by so many radians; answers the number of the first sample
    /// after the robot was carried, if it was.
    pub(crate) fn see(&mut self, number: usize, sample: &Sample, contradicted: f64) -> Option<usize> {
        let (first, log_odds) = self.weigh(number, sample, contradicted)?;
        if log_odds < 0.0 {
            return None;
        }
        self.views.clear(); // the track goes on in other axes
        Some(first)
    }

    /// What numbered samples say of the moments between them: the first sample after each moment, with the logarithm of how
    /// many times likelier they are if the robot was carried there, now and then to where it looks alike. Moments that say
    /// nothing are left out.
    pub(crate) fn ratios<'a>(samples: impl Iterator<Item = (usize, &'a Sample)>) -> Vec<(usize, f64)> {
        let mut watch = Self::default();
        let weighed = samples.filter_map(|(number, sample)| watch.weigh(number, sample, 0.0));
        weighed.map(|(first, log_odds)| (first, ((log_odds - RARE).exp() + ALIKE).ln())).collect()
    }

    /// Takes in the next sample; answers the first one after the moment that now has enough views on either side, and the
    /// logarithm of the odds that the robot was carried there.
    fn weigh(&mut self, number: usize, sample: &Sample, contradicted: f64) -> Option<(usize, f64)> {
        let mut view = View::of(number, sample, contradicted);
        for (lag, earlier) in self.views.iter().rev().take(Self::SIDE).enumerate() {
            view.agrees[lag] = agreement(earlier, &view);
        }
        self.views.push_back(view);
        if self.views.len() > 2 * Self::SIDE {
            self.views.pop_front();
        }
        let first = self.views.get(Self::SIDE).filter(|_| self.views.len() == 2 * Self::SIDE)?.sample;
        Some((first, self.log_odds(Self::SIDE)?))
    }

    /// Whether it may turn out that the robot was carried when the next scans have come.
    pub(crate) fn is_in_question(&self) -> bool {
        let moments = (FIRST_LOOK..Self::SIDE).filter_map(|after| self.views.len().checked_sub(after));
        moments.filter(|moment| *moment >= Self::SIDE).filter_map(|at| self.log_odds(at)).any(|odds| odds > IN_QUESTION)
    }

    /// Whether what was seen last looks rather as if the robot had been carried at one of these moments than as if it had not,
    /// however rare that is.
    pub(crate) fn is_in_doubt(&self) -> bool {
        let moments = Self::SIDE.min(self.views.len())..self.views.len();
        moments.filter_map(|at| self.log_odds(at)).any(|odds| odds > RARE)
    }

    /// Logarithm of the odds that the robot was carried just before view number `moment`; `None` where too little is
    /// comparable.
    fn log_odds(&self, moment: usize) -> Option<f64> {
        let leap = self.views[moment - 1].track_from_robot.inv_mul(&self.views[moment].track_from_robot);
        let most = if self.views[moment].is_precise { LEAP_OF_RAYS } else { LEAP };
        if leap.translation.vector.norm() > most.0 || leap.rotation.angle().abs() > most.1 {
            return None;
        }
        let [beside, across] = self.agreements(moment);
        if across.comparable < LEAST || beside.comparable < 2.0 * LEAST {
            return None;
        }
        let agreeing = (beside.same / beside.expected).min(1.0);
        let expected = agreeing * across.expected / across.comparable;
        let variance = COUNTED * expected * (1.0 - expected) / across.comparable + CORNERS.powi(2);
        let driven = Normal { mean: expected, deviation: variance.sqrt() };
        let share = across.same / across.comparable;
        let by_compass = if self.is_turned(moment) { BY_COMPASS } else { 0.0 };
        Some(RARE + CARRIED.log_density(share) - driven.log_density(share) + by_compass)
    }

    /// How views agree with others on their own side of a moment, and across it.
    fn agreements(&self, moment: usize) -> [Agreement; 2] {
        let [mut beside, mut across] = [Agreement::default(); 2];
        let begin = moment.saturating_sub(Self::SIDE);
        for (number, view) in self.views.iter().enumerate().skip(begin) {
            for (agrees, earlier) in view.agrees.iter().zip((begin..number).rev()) {
                let crosses = earlier < moment && moment <= number;
                *(if crosses { &mut across } else { &mut beside }) += *agrees;
            }
        }
        [beside, across]
    }

    /// Whether a compass says that the robot was turned without its wheels.
    fn is_turned(&self, moment: usize) -> bool {
        let off = |views: std::ops::Range<usize>| self.views.range(views).map(|view| view.contradicted.abs());
        off(moment..self.views.len()).all(|off| off > TURNED) && off(0..moment).all(|off| off < 0.5 * TURNED)
    }
}

impl View {
    fn of(number: usize, sample: &Sample, contradicted: f64) -> Self {
        let count = sample.scan.echo_points().count();
        let every = count.div_ceil(ECHOES).max(1);
        Self {
            sample: number,
            track_from_robot: sample.track_from_robot,
            echoes: sample.scan.echo_points().step_by(every).map(Polar::of).collect(),
            beam: sample.scan.sensor().beam_width().max(NARROWEST),
            is_precise: sample.scan.sensor().kind() == SensorKind::Laser,
            contradicted,
            agrees: [Agreement::default(); CarryWatch::SIDE],
        }
    }
}

impl Polar {
    fn of(point: Vector2<f64>) -> Self {
        Self { bearing: point.y.atan2(point.x), distance: point.norm(), point }
    }
}

impl std::ops::AddAssign for Agreement {
    fn add_assign(&mut self, other: Self) {
        self.same += other.same;
        self.comparable += other.comparable;
        self.expected += other.expected;
    }
}

impl Normal {
    /// The logarithm of its density, but for a constant that is the same for all.
    fn log_density(self, value: f64) -> f64 {
        -0.5 * ((value - self.mean) / self.deviation).powi(2) - self.deviation.ln()
    }
}

/// How a view agrees with an earlier one, bearing by bearing.
fn agreement(earlier: &View, view: &View) -> Agreement {
    let robot_from_earlier = view.track_from_robot.inv_mul(&earlier.track_from_robot);
    let moved = |echo: &Polar| Polar::of((robot_from_earlier * Point2::from(echo.point)).coords);
    let mut expected: Vec<Polar> = earlier.echoes.iter().map(moved).collect();
    expected.sort_by(|a, b| a.bearing.total_cmp(&b.bearing)); // nearly so already, as beams are
    let fades = if view.is_precise { FADES_FOR_RAYS } else { FADES };
    let agrees = AGREES * (-robot_from_earlier.translation.vector.norm() / fades).exp();
    let mut agreement = Agreement::default();
    for echo in &view.echoes {
        let off = beside(&expected, echo, view.beam).map(|other| (other.distance - echo.distance).abs());
        let Some(off) = off.min_by(f64::total_cmp) else { continue };
        let is_same = off < SAME.0 + SAME.1 * echo.distance;
        agreement += Agreement { same: f64::from(u8::from(is_same)), comparable: 1.0, expected: agrees };
    }
    agreement
}

/// Of echoes in the order of their bearings those that lie less than `beam` radians beside another.
fn beside<'a>(echoes: &'a [Polar], echo: &'a Polar, beam: f64) -> impl Iterator<Item = &'a Polar> {
    // Round the circle: what lies beside it may have the other sign.
    [-std::f64::consts::TAU, 0.0, std::f64::consts::TAU].into_iter().flat_map(move |turn| {
        let bearing = echo.bearing + turn;
        let first = echoes.partition_point(|other| other.bearing <= bearing - beam);
        echoes[first..].iter().take_while(move |other| other.bearing < bearing + beam)
    })
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use robot_log::local_grid::{RangeSensor, Scan};

    use super::*;

    /// What a ring of sonars hears at `x` in a corridor along x from −2 m to `end`, of half a width.
    fn sample(x: f64, end: f64, half: f64) -> Sample {
        let sensor = RangeSensor::ring("sonar", SensorKind::Sonar, 16, 0.0, 0.4, 0.1..=20.0).unwrap();
        let range = |mount: &Isometry2<f64>| {
            let ray = mount.rotation * Vector2::x();
            let along = if ray.x > 0.0 { (end - x) / ray.x } else { (-2.0 - x) / ray.x };
            along.min(half / ray.y.abs().max(1e-9))
        };
        let ranges: Vec<f64> = sensor.mounts().iter().map(range).collect();
        let pose = Isometry2::translation(x, 0.0);
        Sample {
            stamp: x,
            track_from_robot: pose,
            odom_from_robot: pose,
            travelled: x,
            scan: Scan::from_ranges(Arc::new(sensor), ranges).unwrap(),
        }
    }

    /// The first samples since the robot was carried, as the watch tells them.
    fn told(samples: impl IntoIterator<Item = Sample>) -> Vec<usize> {
        let mut watch = CarryWatch::default();
        let see = |(number, sample): (usize, Sample)| watch.see(number, &sample, 0.0);
        samples.into_iter().enumerate().filter_map(see).collect()
    }

    /// Ten steps of 0.3 m along a corridor, or along another one.
    fn drive(is_other: impl Fn(u8) -> bool) -> impl Iterator<Item = Sample> {
        let place = move |step| if is_other(step) { (30.0, 4.5) } else { (9.0, 1.5) };
        (0..10_u8).map(move |step| {
            let (end, half) = place(step);
            sample(0.3 * f64::from(step), end, half)
        })
    }

    #[test]
    fn driving_is_not_being_carried() {
        assert!(told(drive(|_| false)).is_empty());
    }

    #[test]
    fn other_surroundings_for_good_are() {
        assert_eq!(told(drive(|step| step >= 5)), [5]);
    }

    #[test]
    fn looking_as_before_speaks_against_it_by_no_more_than_robots_are_set_down_so() {
        let ratios = |is_other: fn(u8) -> bool| {
            let samples: Vec<Sample> = drive(is_other).collect();
            CarryWatch::ratios(samples.iter().enumerate())
        };
        let [(moment, ratio)] = ratios(|_| false)[..] else { panic!("five views on either side") };
        assert_eq!(moment, 5);
        assert!((ALIKE.ln()..0.0).contains(&ratio), "{ratio}");
        assert!(ratios(|step| step >= 5)[0].1 > -RARE);
    }

    #[test]
    fn one_view_of_other_surroundings_is_enough_for_doubt() {
        let doubts = |is_other: fn(u8) -> bool| {
            let mut watch = CarryWatch::default();
            let see = |(number, sample): (usize, Sample)| {
                watch.see(number, &sample, 0.0).map_or(watch.is_in_doubt(), |_| true)
            };
            drive(is_other).take(7).enumerate().map(see).collect::<Vec<bool>>()
        };
        assert_eq!(doubts(|_| false), [false; 7]);
        assert_eq!(doubts(|step| step >= 5), [false, false, false, false, false, true, true]);
    }

    #[test]
    fn one_odd_scan_is_not() {
        assert!(told(drive(|step| step == 5)).is_empty());
    }
}
