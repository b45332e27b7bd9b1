use nalgebra::{Isometry2, Matrix2, Vector2};
use robot_log::local_grid::{Scan, WallRun, WallRunOptions, WallRuns};

use crate::config::Config;

/// Holds a heading that nothing but wheels knows by the walls along which the robot drives: a Kalman filter over
///
/// ```text
/// b  what the heading has to be turned against the odometry: a random walk with every metre and every turn
/// θ  the direction of the building's walls, modulo 90°: constant
/// z = θ − b      the direction of one wall in the odometry's frame, modulo 90°
/// ```
///
/// Not every wall runs with the building. A wall at an angle `ν` from where it is expected counts by the probability that
/// it does, against one that stands at any angle (*probabilistic data association*, Bar-Shalom & Tse 1975). The first
/// walls only teach, and where walls keep contradicting each other the building has no direction and holds nothing.
#[derive(Debug)]
pub(crate) struct WallHeading {
    runs: WallRuns,
    noise: Noise,
    last: Option<Isometry2<f64>>,
    /// `b` and `θ`, in radians; no `θ` before the first wall.
    turned: f64,
    building: Option<f64>,
    covariance: Matrix2<f64>,
    /// How much of `b` the robot was told of.
    told: f64,
    walls: u32,
    agreement: f64,
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
    /// The turn in radians that the heading should take now.
    pub(crate) turn: f64,
    /// Variance of the heading against the building's direction, after that turn.
    pub(crate) variance: f64,
}

/// How true the walls of a building run, as a standard deviation in radians: frames, pilasters, what stands along them.
const TRUE_TO: f64 = 0.015;
/// Share of the walls that run with the building, before any is seen.
const WITH_BUILDING: f64 = 0.8;
/// So many walls teach the building's direction before one of them turns the robot.
const LESSONS: u32 = 3;
/// Weight of the latest wall in the running mean of how probably walls run with the building.
const RECENT: f64 = 0.2;
/// That mean must be this high, or the building is not square enough to hold a heading...
const AGREEMENT: f64 = 0.7;
/// ...and below this its direction is learnt anew.
const DISAGREEMENT: f64 = 0.4;

impl WallHeading {
    pub(crate) fn new(config: &Config) -> Self {
        let odometry = &config.odometry;
        let noise = Noise {
            per_metre: odometry.heading_per_m_deg.to_radians().powi(2),
            per_radian: odometry.heading_per_turn_deg.to_radians().powi(2) / std::f64::consts::TAU,
        };
        Self {
            runs: WallRuns::new(WallRunOptions::default()),
            noise,
            last: None,
            turned: 0.0,
            building: None,
            covariance: Matrix2::zeros(),
            told: 0.0,
            walls: 0,
            agreement: 1.0,
        }
    }

    /// Follows the robot's raw odometry to where it hears a scan; what the walls say, if they say anything.
    pub(crate) fn observe(&mut self, odom_from_robot: &Isometry2<f64>, scan: &Scan) -> Option<Sight> {
        if let Some(last) = self.last.replace(*odom_from_robot) {
            let step = last.inv_mul(odom_from_robot);
            self.covariance[(0, 0)] += self.noise.per_metre * step.translation.vector.norm()
                + self.noise.per_radian * step.rotation.angle().abs();
        }
        let walls = self.runs.push(odom_from_robot, scan, self.turned);
        for wall in &walls {
            self.see(wall);
        }
        let holds = !walls.is_empty() && self.walls >= LESSONS && self.agreement >= AGREEMENT;
        holds.then(|| {
            let turn = self.turned - std::mem::replace(&mut self.told, self.turned);
            Sight { turn, variance: self.covariance[(0, 0)] }
        })
    }

    fn see(&mut self, wall: &WallRun) {
        // The wall was seen half of its length ago, in the mean.
        let variance = wall.sigma.powi(2) + TRUE_TO.powi(2) + 0.5 * wall.length * self.noise.per_metre;
        let Some(building) = self.building else { return self.begin(wall, variance) };
        let off = wall.turn_to(building - wall.marked);
        let observed = Vector2::new(1.0, -1.0);
        let spread = (observed.transpose() * self.covariance * observed)[0] + variance;
        let belongs = belongs(off, spread);
        self.agreement += RECENT * (belongs - self.agreement);
        self.walls += 1;
        if self.agreement < DISAGREEMENT {
            return self.begin(wall, variance);
        }
        let gain = self.covariance * observed * (belongs / spread);
        self.turned += gain.x * off;
        self.building = Some(building + gain.y * off);
        self.covariance -= gain * observed.transpose() * self.covariance;
    }

    /// Takes a wall for the building's direction; the heading has, by definition, no error against it but the wall's own.
    fn begin(&mut self, wall: &WallRun, variance: f64) {
        self.building = Some(wall.direction + wall.marked);
        self.covariance = Matrix2::new(0.0, 0.0, 0.0, variance);
        (self.walls, self.agreement) = (1, 1.0);
    }
}

/// The probability that a wall `off` radians from the building's direction, of variance `spread`, runs with it.
fn belongs(off: f64, spread: f64) -> f64 {
    let with = WITH_BUILDING * (-0.5 * off * off / spread).exp() / (std::f64::consts::TAU * spread).sqrt();
    with / (with + (1.0 - WITH_BUILDING) * std::f64::consts::FRAC_2_PI)
}
