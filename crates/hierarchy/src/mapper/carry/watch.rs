use std::collections::VecDeque;

use nalgebra::{Isometry2, Point2, Vector2};
use robot_log::local_grid::SensorKind;

use crate::trajectory::Sample;

/// Notices that the robot was carried: from one scan to the next everything around it is another, for good.
///
/// A scan shows again what the scans just before it showed. Where three scans in a row agree with each other, and the next
/// three do, but not the ones with the others, wheels cannot have told of what came between. One odd scan, a person before
/// the lens or a turn too fast to compare, is not that: both sides must agree among themselves. A compass that turns at that
/// moment while the wheels do not says the same, so that less disagreement will do.
///
/// Being carried along a corridor is not noticed: it looks as before.
#[derive(Debug, Default)]
pub(in crate::mapper) struct CarryWatch {
    /// The last six views, the oldest first.
    views: VecDeque<View>,
}

/// A scan, ready to be compared with others.
#[derive(Debug)]
struct View {
    /// The sample's number.
    sample: usize,
    track_from_robot: Isometry2<f64>,
    echoes: Vec<Vector2<f64>>,
    /// How far apart in bearing two echoes may be that come from one surface, in radians.
    beam: f64,
    /// Whether its sensor tells surfaces a few degrees apart from each other.
    is_precise: bool,
    /// By how much a compass contradicts the heading, in radians; 0 without one.
    contradicted: f64,
    /// How it agrees with the view before, with the one before that, and so on.
    agrees: [Agreement; LAGS],
}

/// Of the echoes of one scan those that can be compared with another's, and those that show the same.
#[derive(Debug, Clone, Copy, Default)]
struct Agreement {
    same: u32,
    comparable: u32,
}

/// How many views back each is compared.
const LAGS: usize = 3;
/// Echoes of a scan that are compared, about.
const ECHOES: usize = 36;
/// The fewest comparable echoes, of several pairs of views together, that say anything.
const LEAST: u32 = 12;
/// Two surfaces are the same where their distances differ by no more: metres, and a share of the distance.
const SAME: (f64, f64) = (0.1, 0.05);
/// Rays narrower than this, in radians, are compared as if they were so wide: there are gaps between them.
const NARROWEST: f64 = 0.05;
/// By how much fewer echoes must agree across the moment than among the views of either side. In 46,000 scans of ten logs in
/// which nobody carried the robot the share fell by 0.24 at most with lasers, by 0.63 with sonars, or to no less than 0.25;
/// where it was carried it fell by 0.3 to 0.9.
const DROP: f64 = 0.66;
const DROP_OF_RAYS: f64 = 0.45;
/// Views farther apart than this, in metres and radians, are not judged: those of rays, which look ahead only, and those of
/// sonars, which hear all around. (A laser with a scan a metre saw another street at a crossing.)
const LEAP_OF_RAYS: (f64, f64) = (0.6, 0.8);
const LEAP: (f64, f64) = (1.2, std::f64::consts::PI);
/// The same where hardly any agree: at most so many.
const DROP_TO_NOTHING: f64 = 0.4;
const NOTHING: f64 = 0.22;
/// The same where a compass says so, too.
const DROP_BY_COMPASS: f64 = 0.2;
/// A compass says so where it contradicts the wheels by more than this in radians, in each view after the moment, and by less
/// than half in each before.
const TURNED: f64 = 0.35;

impl CarryWatch {
    /// Views on either side of the moment in question.
    pub(crate) const SIDE: usize = 3;

    /// Looks at the next sample, whose heading a compass contradicts by so many radians; answers the number of the first sample
    /// after the robot was carried, if it was.
    pub(crate) fn see(&mut self, number: usize, sample: &Sample, contradicted: f64) -> Option<usize> {
        let mut view = View::of(number, sample, contradicted);
        for (agrees, earlier) in view.agrees.iter_mut().zip(self.views.iter().rev()) {
            *agrees = view_agreement(earlier, &view.echoes, &view.track_from_robot, view.beam);
        }
        self.views.push_back(view);
        if self.views.len() > 2 * Self::SIDE {
            self.views.pop_front();
        }
        let first = self.views.get(Self::SIDE)?.sample;
        if self.views.len() < 2 * Self::SIDE || !self.tells_of_carrying()? {
            return None;
        }
        self.views.drain(..Self::SIDE);
        Some(first)
    }

    /// Whether the older and the newer half of the views show different surroundings; `None` where too little is comparable.
    fn tells_of_carrying(&self) -> Option<bool> {
        let share = |pairs: &[(usize, usize)]| {
            let pairs = pairs.iter().map(|(view, lag)| self.views[*view].agrees[lag - 1]);
            let sum = pairs.fold(Agreement::default(), Agreement::plus);
            (sum.comparable >= LEAST).then(|| f64::from(sum.same) / f64::from(sum.comparable))
        };
        let before = share(&[(1, 1), (2, 1), (2, 2)])?;
        let after = share(&[(4, 1), (5, 1), (5, 2)])?;
        let across = share(&[(3, 1), (3, 2), (3, 3), (4, 2), (4, 3), (5, 3)])?;
        let off = |views: std::ops::Range<usize>| self.views.range(views).map(|view| view.contradicted.abs());
        let turned =
            off(Self::SIDE..2 * Self::SIDE).all(|off| off > TURNED) && off(0..Self::SIDE).all(|off| off < 0.5 * TURNED);
        let is_precise = self.views.iter().all(|view| view.is_precise);
        let leap = self.views[Self::SIDE - 1].track_from_robot.inv_mul(&self.views[Self::SIDE].track_from_robot);
        let most = if is_precise { LEAP_OF_RAYS } else { LEAP };
        if leap.translation.vector.norm() > most.0 || leap.rotation.angle().abs() > most.1 {
            return None;
        }
        let drop = match is_precise {
            _ if turned => DROP_BY_COMPASS,
            _ if across <= NOTHING => DROP_TO_NOTHING,
            true => DROP_OF_RAYS,
            false => DROP,
        };
        Some(before.min(after) - across >= drop)
    }
}

impl View {
    fn of(number: usize, sample: &Sample, contradicted: f64) -> Self {
        let echoes: Vec<Vector2<f64>> = sample.scan.echo_points().collect();
        let every = echoes.len().div_ceil(ECHOES).max(1);
        Self {
            sample: number,
            track_from_robot: sample.track_from_robot,
            echoes: echoes.into_iter().step_by(every).collect(),
            beam: sample.scan.sensor().beam_width().max(NARROWEST),
            is_precise: sample.scan.sensor().kind() == SensorKind::Laser,
            contradicted,
            agrees: [Agreement::default(); LAGS],
        }
    }
}

impl Agreement {
    fn plus(self, other: Self) -> Self {
        Self { same: self.same + other.same, comparable: self.comparable + other.comparable }
    }
}

/// How echoes seen from a pose agree with those of an earlier view, bearing by bearing.
fn view_agreement(earlier: &View, echoes: &[Vector2<f64>], track_from_robot: &Isometry2<f64>, beam: f64) -> Agreement {
    let robot_from_earlier = track_from_robot.inv_mul(&earlier.track_from_robot);
    let polar = |point: Vector2<f64>| (point.y.atan2(point.x), point.norm());
    let moved = |echo: &Vector2<f64>| polar((robot_from_earlier * Point2::from(*echo)).coords);
    let expected: Vec<(f64, f64)> = earlier.echoes.iter().map(moved).collect();
    let mut agreement = Agreement::default();
    for (bearing, distance) in echoes.iter().map(|echo| polar(*echo)) {
        let apart = |other: f64| (other - bearing).abs().min(std::f64::consts::TAU - (other - bearing).abs());
        let beside = expected.iter().filter(|(other, _)| apart(*other) < beam);
        let Some(off) = beside.map(|(_, there)| (there - distance).abs()).min_by(f64::total_cmp) else { continue };
        agreement.comparable += 1;
        agreement.same += u32::from(off < SAME.0 + SAME.1 * distance);
    }
    agreement
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
    fn one_odd_scan_is_not() {
        assert!(told(drive(|step| step == 5)).is_empty());
    }
}
