use std::collections::VecDeque;

use local_grid::nalgebra::Isometry2;

/// Where the odometry was in the last seconds.
#[derive(Debug, Default)]
pub(super) struct Path {
    recent: VecDeque<(f64, Isometry2<f64>)>,
}

/// So many seconds are remembered: longer than any scan is on its way.
const REMEMBERED: f64 = 2.0;

impl Path {
    /// Notes where the odometry is at `stamp`; a row that lies behind the one before it counts as that one's moment.
    pub(super) fn follow(&mut self, stamp: f64, odom_from_robot: Isometry2<f64>) {
        let stamp = self.recent.back().map_or(stamp, |(last, _)| stamp.max(*last));
        self.recent.push_back((stamp, odom_from_robot));
        while self.recent.len() > 2 && self.recent[1].0 < stamp - REMEMBERED {
            self.recent.pop_front();
        }
    }

    /// Where it was at `stamp`: between two moments on the straight way, before all and after all where it began and is.
    pub(super) fn at(&self, stamp: f64) -> Option<Isometry2<f64>> {
        let next = self.next(stamp);
        let (Some((before, from)), Some((after, to))) = (self.recent.get(next.wrapping_sub(1)), self.recent.get(next))
        else {
            return self.recent.get(next).or(self.recent.back()).map(|(_, pose)| *pose);
        };
        Some(from.lerp_slerp(to, (stamp - before) / (after - before)))
    }

    /// The motion at `stamp`, from one moment to the next, and the seconds that it took.
    pub(super) fn motion(&self, stamp: f64) -> Option<(Isometry2<f64>, f64)> {
        let next = self.next(stamp).min(self.recent.len().checked_sub(1)?).max(1);
        let ((before, from), (after, to)) = (self.recent.get(next - 1)?, self.recent.get(next)?);
        Some((from.inv_mul(to), after - before))
    }

    /// The first moment that is not before `stamp`.
    fn next(&self, stamp: f64) -> usize {
        self.recent.partition_point(|(other, _)| *other < stamp)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_odometry_is_known_between_its_moments_and_beyond() {
        let mut path = Path::default();
        assert_eq!((path.at(1.0), path.motion(1.0)), (None, None));
        for (stamp, x) in [(1.0, 0.0), (1.0, 0.5), (2.0, 1.5), (9.0, 2.0), (8.9, 2.0), (9.5, 3.0)] {
            path.follow(stamp, Isometry2::translation(x, 0.0));
        }
        let x = |stamp| path.at(stamp).unwrap().translation.x;
        approx::assert_relative_eq!(x(9.25), 2.5, epsilon = 1e-12);
        assert_eq!((x(9.0), x(9.5), x(10.0)), (2.0, 3.0, 3.0));
        assert_eq!(x(0.0), 1.5, "what was before is forgotten");
        assert_eq!(path.motion(9.1).unwrap(), (Isometry2::translation(1.0, 0.0), 0.5));
        assert_eq!(path.motion(20.0), path.motion(9.5));
    }
}
