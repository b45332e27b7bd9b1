use nalgebra::{Isometry2, Matrix3, Vector3};
use robot_log::local_grid::{Heading, Scan, WallRun, WallRunOptions, WallRuns};

use crate::config::Config;

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
    /// By how much `b` grows with every metre, in radians: wheels that are not alike. Learnt only beside a compass.
    drift: f64,
    covariance: Matrix3<f64>,
    /// How much of `b` the robot was told of.
    told: f64,
    needle: Option<Needle>,
    walls: u32,
    agreement: f64,
}

/// Variance by which a heading grows wrong, rad² per metre driven and per radian turned.
#[derive(Debug, Clone, Copy)]
struct Noise {
    per_metre: f64,
    per_radian: f64,
}

/// What is known of a compass that speaks beside the walls.
#[derive(Debug, Clone, Copy)]
struct Needle {
    /// Metres driven since it was last listened to.
    driven: f64,
    /// Metres after which its disturbance is another one.
    memory: f64,
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

/// The length of wall, in metres, that says something beside a compass: its disturbance changes within a metre or two.
const BESIDE_COMPASS: f64 = 1.2;
/// The drift of wheels that are not alike, in radians per metre, as a standard deviation.
const DRIFT: f64 = 0.01;
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
            drift: 0.0,
            covariance: Matrix3::zeros(),
            told: 0.0,
            needle: None,
            walls: 0,
            agreement: 1.0,
        }
    }

    /// Follows the robot's raw odometry to where it hears a scan; what the walls say, if they say anything.
    pub(crate) fn observe(&mut self, odom_from_robot: &Isometry2<f64>, scan: &Scan) -> Option<Sight> {
        if let Some(last) = self.last.replace(*odom_from_robot) {
            let step = last.inv_mul(odom_from_robot);
            let driven = step.translation.vector.norm();
            self.turned += self.drift * driven;
            let drifted = Matrix3::new(1.0, 0.0, driven, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0);
            self.covariance = drifted * self.covariance * drifted.transpose();
            self.covariance[(0, 0)] +=
                self.noise.per_metre * driven + self.noise.per_radian * step.rotation.angle().abs();
            if let Some(needle) = &mut self.needle {
                needle.driven += driven;
            }
        }
        let walls = self.runs.push(odom_from_robot, scan, self.turned);
        for wall in &walls {
            self.see(wall);
        }
        let heard = !walls.is_empty() || self.needle.is_some();
        let holds = heard && self.walls >= LESSONS && self.agreement >= AGREEMENT;
        holds.then(|| {
            let turn = self.turned - std::mem::replace(&mut self.told, self.turned);
            Sight { turned: self.turned, turn, variance: self.covariance[(0, 0)] }
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
        let off = reading - Heading::from_radians(odom_from_robot.rotation.angle() + self.turned);
        let Some(needle) = &mut self.needle else {
            // A correlation of exp(−d² / 2ℓ²) weighs as much as one reading in √(2π) ℓ.
            self.runs = WallRuns::new(WallRunOptions { length: BESIDE_COMPASS, ..WallRunOptions::default() });
            self.needle = Some(Needle { driven: 0.0, memory: correlation * std::f64::consts::TAU.sqrt() });
            (self.turned, self.told) = (self.turned + off, self.turned + off);
            (self.building, self.covariance) =
                (None, Matrix3::from_diagonal(&Vector3::new(disturbance, 0.0, DRIFT.powi(2))));
            return;
        };
        let novelty = (std::mem::take(&mut needle.driven) / needle.memory).min(1.0);
        if novelty > 0.0 {
            self.update(Vector3::new(1.0, 0.0, 0.0), off, disturbance / novelty, 1.0);
        }
    }

    fn see(&mut self, wall: &WallRun) {
        // The wall was seen half of its length ago, in the mean.
        let variance = wall.sigma.powi(2) + TRUE_TO.powi(2) + 0.5 * wall.length * self.noise.per_metre;
        let Some(building) = self.building else { return self.begin(wall, variance) };
        let off = wall.turn_to(building - wall.marked);
        let observed = Vector3::new(1.0, -1.0, 0.0);
        let belongs = belongs(off, (observed.transpose() * self.covariance * observed)[0] + variance);
        self.agreement += RECENT * (belongs - self.agreement);
        self.walls += 1;
        if self.agreement < DISAGREEMENT {
            return self.begin(wall, variance);
        }
        self.update(observed, off, variance, belongs);
    }

    /// A step of the filter: `off` is by how much `observed`·(b, θ) is seen to be larger; it counts by a `share`.
    fn update(&mut self, observed: Vector3<f64>, off: f64, variance: f64, share: f64) {
        let spread = (observed.transpose() * self.covariance * observed)[0] + variance;
        let gain = self.covariance * observed * (share / spread);
        self.turned += gain.x * off;
        self.building = self.building.map(|building| building + gain.y * off);
        self.drift += gain.z * off;
        self.covariance -= gain * observed.transpose() * self.covariance;
    }

    /// Takes a wall for the building's direction. Without a compass the heading has, by definition, no error against it but
    /// the wall's own; with one, the two are as uncertain as the heading.
    fn begin(&mut self, wall: &WallRun, variance: f64) {
        self.building = Some(wall.direction + wall.marked);
        if self.needle.is_none() {
            self.covariance = Matrix3::zeros();
        }
        // θ = b + the wall's angle against the odometry.
        let own = self.covariance.row(0).into_owned();
        self.covariance.set_row(1, &own);
        self.covariance.set_column(1, &Vector3::new(own[0], own[0] + variance, own[2]));
        (self.walls, self.agreement) = (1, 1.0);
    }
}

/// The probability that a wall `off` radians from the building's direction, of variance `spread`, runs with it.
fn belongs(off: f64, spread: f64) -> f64 {
    let with = WITH_BUILDING * (-0.5 * off * off / spread).exp() / (std::f64::consts::TAU * spread).sqrt();
    with / (with + (1.0 - WITH_BUILDING) * std::f64::consts::FRAC_2_PI)
}
