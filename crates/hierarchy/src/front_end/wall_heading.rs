mod belief;

use nalgebra::Isometry2;
use robot_log::local_grid::{FollowedWall, Heading, Scan, WallRun, WallRunOptions, WallRuns};

use crate::config::Config;
pub(crate) use belief::{Belief, Needle, Scatter};

/// Holds a heading by the walls along which the robot drives: a Kalman filter over
///
/// ```text
/// b  what the heading has to be turned against the odometry: a random walk with every metre and every turn
/// θ  the direction of the building's walls, modulo 90°: constant
/// d  by how much b grows with every metre: constant, and 0 without a compass
/// z = θ − b      the direction of one wall in the odometry's frame, modulo 90°
/// c = b          what a compass says, where there is one
/// ```
///
/// A compass indoors is disturbed by what stands near it, walls are not; but only the compass knows where north is. Together
/// they hold a heading that is right on the whole and true along every wall.
///
/// Not every wall runs with the building. A wall at an angle `ν` from where it is expected counts by the probability that
/// it does, against one that stands at any angle (*probabilistic data association*, Bar-Shalom & Tse 1975); and how true
/// walls run here is learnt ([`Scatter`]). The first walls only teach, and where walls keep contradicting each other the
/// building has no direction and holds nothing.
#[derive(Debug)]
pub(crate) struct WallHeading {
    noise: Noise,
    runs: WallRuns,
    last: Option<Isometry2<f64>>,
    belief: Belief,
    /// How much of `b` the robot was told of.
    told: f64,
}

/// All that a [`WallHeading`] needs to go on later.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct WallMemory {
    pub(crate) followed: Vec<FollowedWall>,
    /// Where the odometry last was.
    pub(crate) last: Option<Isometry2<f64>>,
    pub(crate) belief: Belief,
    pub(crate) told: f64,
}

/// Variance by which a heading grows wrong, rad² per metre driven and per radian turned.
#[derive(Debug, Clone, Copy)]
struct Noise {
    per_metre: f64,
    per_radian: f64,
}

/// What the walls say of the heading.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Sight {
    /// What the heading has to be turned against the odometry, `b`; absolute where a compass spoke.
    pub(crate) turned: f64,
    /// The turn in radians that the heading should take now.
    pub(crate) turn: f64,
    /// Variance of the heading against the building's direction, after that turn.
    pub(crate) variance: f64,
}

/// The direction of a building's walls, modulo 90°.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Direction {
    pub(crate) radians: f64,
    /// How many walls have taught it since it was begun with, perhaps anew.
    pub(crate) walls: u32,
    /// Whether it holds the heading.
    pub(crate) holds: bool,
}

/// The length of wall, in metres, that says something beside a compass: its disturbance changes within a metre or two.
const BESIDE_COMPASS: f64 = 1.2;

impl WallHeading {
    pub(crate) fn new(config: &Config) -> Self {
        Self::recalling(config, WallMemory { followed: Vec::new(), last: None, belief: Belief::new(), told: 0.0 })
    }

    /// Goes on with what it knew.
    pub(crate) fn recalling(config: &Config, memory: WallMemory) -> Self {
        let odometry = &config.odometry;
        let noise = Noise {
            per_metre: odometry.heading_per_m_deg.to_radians().powi(2),
            per_radian: odometry.heading_per_turn_deg.to_radians().powi(2) / std::f64::consts::TAU,
        };
        let WallMemory { followed, last, belief, told } = memory;
        let runs = WallRuns::recalling(options(belief.needle.is_some()), followed);
        Self { noise, runs, last, belief, told }
    }

    /// Forgets all walls: the robot is somewhere else.
    pub(crate) fn forget(&mut self) {
        (self.runs, self.belief, self.told) = (WallRuns::new(options(false)), Belief::new(), 0.0);
    }

    /// What it needs to go on later.
    pub(crate) fn memory(&self) -> WallMemory {
        let Self { runs, last, belief, told, .. } = self;
        WallMemory { followed: runs.followed().to_vec(), last: *last, belief: belief.clone(), told: *told }
    }

    /// What is known of the direction of the building's walls; `None` before the first of them.
    pub(crate) fn building(&self) -> Option<Direction> {
        let Belief { building, walls, .. } = self.belief;
        building.map(|radians| Direction { radians, walls, holds: self.belief.holds() })
    }

    /// Follows the robot's raw odometry to where it hears a scan; what the walls say, if they say anything.
    pub(crate) fn observe(&mut self, odom_from_robot: &Isometry2<f64>, scan: &Scan) -> Option<Sight> {
        if let Some(last) = self.last.replace(*odom_from_robot) {
            let step = last.inv_mul(odom_from_robot);
            let (driven, turned) = (step.translation.vector.norm(), step.rotation.angle().abs());
            self.belief.drive(driven, self.noise.per_metre * driven + self.noise.per_radian * turned);
        }
        let walls = self.runs.push(odom_from_robot, scan, self.belief.turned);
        for wall in &walls {
            self.belief.see(wall, self.variance_of(wall));
        }
        let Belief { turned, needle, covariance, .. } = &self.belief;
        let heard = !walls.is_empty() || needle.is_some();
        (heard && self.belief.holds()).then(|| {
            let turn = turned - std::mem::replace(&mut self.told, *turned);
            Sight { turned: *turned, turn, variance: covariance[(0, 0)] }
        })
    }

    /// Takes in what a compass says of the heading; its disturbance, of variance `disturbance`, is the same over
    /// `correlation` metres. It ties the building's direction to the world, and the walls take the disturbance out of it.
    pub(crate) fn hear_compass(
        &mut self,
        odom_from_robot: &Isometry2<f64>,
        reading: Heading,
        disturbance: f64,
        correlation: f64,
    ) {
        let off = reading - Heading::from_radians(odom_from_robot.rotation.angle() + self.belief.turned);
        if self.belief.needle.is_some() {
            return self.belief.hear(off, disturbance);
        }
        self.runs = WallRuns::new(options(true));
        // A correlation of exp(−d² / 2ℓ²) weighs as much as one reading in √(2π) ℓ.
        self.belief.begin_needle(off, disturbance, correlation * std::f64::consts::TAU.sqrt());
        self.told = self.belief.turned;
    }

    /// The variance of a wall's direction as it was measured; it was seen half of its length ago, in the mean.
    fn variance_of(&self, wall: &WallRun) -> f64 {
        wall.sigma.powi(2) + 0.5 * wall.length * self.noise.per_metre
    }
}

fn options(beside_compass: bool) -> WallRunOptions {
    let usual = WallRunOptions::default();
    if beside_compass { WallRunOptions { length: BESIDE_COMPASS, ..usual } } else { usual }
}
