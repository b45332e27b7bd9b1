use local_grid::Heading;
use local_grid::nalgebra::{Isometry2, UnitComplex, Vector2};

use crate::description::{Turn, Wheels};

/// Adds up what wheels and motors did to a pose in the `odom` frame.
#[derive(Debug, Default)]
pub(super) struct DeadReckoning {
    odom_from_robot: Option<Isometry2<f64>>,
    /// What accumulating counters read before.
    counters: Option<(f64, f64)>,
    /// The command that the motors obey: left, right.
    command: (f64, f64),
}

impl DeadReckoning {
    pub(super) fn pose(&self) -> Isometry2<f64> {
        self.odom_from_robot.unwrap_or_else(Isometry2::identity)
    }

    /// Takes the `left` and `right` counters of a line; `heading` is the line's own.
    pub(super) fn wheels(
        &mut self,
        wheels: &Wheels,
        left: f64,
        right: f64,
        heading: Option<Heading>,
    ) -> Isometry2<f64> {
        let (left, right) = if wheels.accumulated {
            let (old_left, old_right) = self.counters.replace((left, right)).unwrap_or((left, right));
            (left - old_left, right - old_right)
        } else {
            (left, right)
        };
        let distance = wheels.metres * (left + right) / 2.0;
        match heading.filter(|_| wheels.turn == Turn::Heading) {
            Some(heading) => {
                // The frame of the odometry turns with the first heading, so that both agree.
                let started = self.odom_from_robot.get_or_insert(Isometry2::rotation(heading.radians()));
                let turn = heading - Heading::from_radians(started.rotation.angle());
                self.advance(distance, turn)
            }
            None => self.advance(distance, wheels.metres * (right - left) / wheels.track),
        }
    }

    /// Takes a new command, after the one before lasted so many seconds; `speed` in metres per second per unit, `turn` in radians.
    pub(super) fn motors(&mut self, command: (f64, f64), seconds: f64, speed: f64, turn: f64) -> Isometry2<f64> {
        let (left, right) = std::mem::replace(&mut self.command, command);
        if left * right < 0.0 {
            return self.advance(0.0, turn * (right - left).signum());
        }
        self.advance(speed * seconds * (left + right) / 2.0, 0.0)
    }

    /// Drives `distance` metres along an arc that turns by `turn` radians.
    fn advance(&mut self, distance: f64, turn: f64) -> Isometry2<f64> {
        let pose = self.pose();
        let middle = pose.rotation * UnitComplex::new(turn / 2.0);
        let at = pose.translation.vector + middle * Vector2::new(distance, 0.0);
        let pose = Isometry2::new(at, pose.rotation.angle() + turn);
        self.odom_from_robot = Some(pose);
        pose
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn wheels(turn: Turn) -> Wheels {
        Wheels { left: vec![], right: vec![], accumulated: true, metres: 0.01, track: 0.5, turn }
    }

    #[test]
    fn a_quarter_turn_on_the_spot_leaves_the_robot_where_it_is() {
        let mut robot = DeadReckoning::default();
        robot.wheels(&wheels(Turn::Wheels), 100.0, 100.0, None); // where the counters stand at first is no travel
        let ticks = std::f64::consts::FRAC_PI_2 * 0.25 / 0.01;
        let pose = robot.wheels(&wheels(Turn::Wheels), 100.0 - ticks, 100.0 + ticks, None);
        approx::assert_relative_eq!(pose.rotation.angle(), std::f64::consts::FRAC_PI_2, epsilon = 1e-12);
        assert!(pose.translation.vector.norm() < 1e-12);
    }

    #[test]
    fn a_heading_overrules_the_wheels() {
        let mut robot = DeadReckoning::default();
        let north = Heading::from_radians(std::f64::consts::FRAC_PI_2);
        robot.wheels(&wheels(Turn::Heading), 0.0, 0.0, Some(north));
        let pose = robot.wheels(&wheels(Turn::Heading), 90.0, 110.0, Some(north));
        approx::assert_relative_eq!(pose.translation.vector, Vector2::new(0.0, 1.0), epsilon = 1e-12);
    }

    #[test]
    fn a_motor_command_counts_when_the_next_one_ends_it() {
        let mut robot = DeadReckoning::default();
        robot.motors((300.0, 300.0), 1.0, 0.001, 0.3);
        let pose = robot.motors((-300.0, 300.0), 2.0, 0.001, 0.3);
        approx::assert_relative_eq!(pose.translation.x, 0.6);
        approx::assert_relative_eq!(robot.motors((0.0, 0.0), 9.0, 0.001, 0.3).rotation.angle(), 0.3, epsilon = 1e-12);
    }
}
