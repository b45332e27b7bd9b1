mod scatter;

use nalgebra::{Matrix3, Vector3};
use robot_log::local_grid::WallRun;

pub(crate) use scatter::Scatter;

/// What walls, wheels and compass have taught of a heading: the state of the filter that [`super::WallHeading`] describes.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Belief {
    /// `b` and `θ`, in radians; no `θ` before the first wall.
    pub(crate) turned: f64,
    pub(crate) building: Option<f64>,
    /// By how much `b` grows with every metre, in radians: wheels that are not alike. Learnt only beside a compass.
    pub(crate) drift: f64,
    /// Of `b`, `θ` and the drift.
    pub(crate) covariance: Matrix3<f64>,
    pub(crate) needle: Option<Needle>,
    /// Walls seen since the building's direction was begun with.
    pub(crate) walls: u32,
    /// Running mean of how probably walls run with the building.
    pub(crate) agreement: f64,
    pub(crate) scatter: Scatter,
}

/// What is known of a compass that speaks beside the walls.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Needle {
    /// Metres driven since it was last listened to.
    pub(crate) driven: f64,
    /// Metres after which its disturbance is another one.
    pub(crate) memory: f64,
}

/// The drift of wheels that are not alike, in radians per metre, as a standard deviation.
const DRIFT: f64 = 0.01;
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

impl Belief {
    /// Of a heading that has no error yet, in a building not yet seen.
    pub(crate) fn new() -> Self {
        Self {
            turned: 0.0,
            building: None,
            drift: 0.0,
            covariance: Matrix3::zeros(),
            needle: None,
            walls: 0,
            agreement: 1.0,
            scatter: Scatter::default(),
        }
    }

    /// Whether the walls agree enough to hold a heading.
    pub(super) fn holds(&self) -> bool {
        self.walls >= LESSONS && self.agreement >= AGREEMENT
    }

    /// Follows the wheels over `driven` metres, whose heading grows wrong by `noise`, a variance.
    pub(super) fn drive(&mut self, driven: f64, noise: f64) {
        self.turned += self.drift * driven;
        let drifted = Matrix3::new(1.0, 0.0, driven, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0);
        self.covariance = drifted * self.covariance * drifted.transpose();
        self.covariance[(0, 0)] += noise;
        if let Some(needle) = &mut self.needle {
            needle.driven += driven;
        }
    }

    /// A compass speaks for the first time: it reads `off` more than is believed, of variance `disturbance`, which is
    /// another one after `memory` metres.
    pub(super) fn begin_needle(&mut self, off: f64, disturbance: f64, memory: f64) {
        self.needle = Some(Needle { driven: 0.0, memory });
        self.turned += off;
        self.building = None;
        self.covariance = Matrix3::from_diagonal(&Vector3::new(disturbance, 0.0, DRIFT.powi(2)));
    }

    /// The compass reads `off` more than is believed.
    pub(super) fn hear(&mut self, off: f64, disturbance: f64) {
        let Some(needle) = &mut self.needle else { return };
        let novelty = (std::mem::take(&mut needle.driven) / needle.memory).min(1.0);
        if novelty > 0.0 {
            self.update(Vector3::new(1.0, 0.0, 0.0), off, disturbance / novelty, 1.0);
        }
    }

    /// A wall was followed, whose direction was measured with this variance.
    pub(super) fn see(&mut self, wall: &WallRun, variance: f64) {
        let Some(building) = self.building else { return self.begin(wall, variance) };
        let off = wall.turn_to(building - wall.marked);
        let observed = Vector3::new(1.0, -1.0, 0.0);
        let spread = (observed.transpose() * self.covariance * observed)[0] + variance;
        let spread = spread + self.scatter.learn(off, spread);
        let belongs = belongs(off, spread);
        self.agreement += RECENT * (belongs - self.agreement);
        self.walls += 1;
        if self.agreement < DISAGREEMENT {
            return self.begin(wall, variance);
        }
        self.update(observed, off, variance + self.scatter.variance(), belongs);
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
        let variance = variance + self.scatter.variance();
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
