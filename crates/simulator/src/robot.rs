use std::sync::Arc;

use local_grid::{Heading, RangeSensor, Scan, SensorKind};
use nalgebra::{Isometry2, Point2, Vector2};
use robot_log::{Entry, EntryKind};

use crate::compass::Compass;
use crate::laser::first_opaque;
use crate::noise::Noise;
use crate::odometry::{Motion, Odometry};
use crate::sonar::Surroundings;
use crate::{DescriptionError, RobotDescription, Turret, World};

/// What a robot can be told to do. Headings are those that the robot itself believes: by its compass, else by its odometry.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Command {
    /// Steer on the spot until the direction of travel is `to`.
    Turn {
        /// The new direction of travel.
        to: Heading,
    },
    /// Drive straight ahead; stops before it touches anything.
    Drive {
        /// Metres to go.
        distance: f64,
    },
    /// Turn the turret and hold it there. A turret that looks ahead does not obey.
    Look {
        /// The heading to hold.
        to: Heading,
    },
    /// Fire all range sensors once.
    Fire,
    /// Stand still.
    Wait {
        /// For so long.
        seconds: f64,
    },
}

/// What became of a [`Command`].
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Outcome {
    /// Metres that the robot really moved.
    pub driven: f64,
    /// Whether something was in the way.
    pub blocked: bool,
}

/// A simulated robot in a [`World`]: takes commands, yields what a log of it would hold.
///
/// The robot's frame is that of its turret, on which all sensors and the compass sit: with a held turret it keeps its
/// heading and moves into any direction. Entries of one moment come in the order odometry, heading, truth, scans.
/// Everything follows from the world, the description and the seed.
///
/// ```
/// use simulator::{Command, Robot, RobotDescription, World};
///
/// let world = World::from_plan("name = 'r'\n[[wall]]\npoints = [[-2, -2], [2, -2], [2, 2], [-2, 2]]\nclosed = true\n")?;
/// let mut robot = Robot::new(&world, RobotDescription::nomad200(), 1)?;
/// let mut entries = Vec::new();
/// let outcome = robot.execute(&Command::Drive { distance: 5.0 }, &mut entries);
/// assert!(outcome.blocked && outcome.driven < 1.8); // the wall is 2 m off, the robot 0.225 m wide
/// robot.execute(&Command::Fire, &mut entries);
/// assert!(entries.len() > 4);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone)]
pub struct Robot<'w> {
    world: &'w World,
    description: RobotDescription,
    sensors: Vec<Arc<RangeSensor>>,
    range_noise: Vec<Noise>,
    odometry: Odometry,
    compass: Option<Compass>,
    time: f64,
    at: Point2<f64>,
    /// The true heading of the turret.
    turret: Heading,
    /// The true direction of travel.
    direction: Heading,
    /// The heading that the turret holds, as the robot believes.
    hold: Heading,
    logged: f64,
    path: f64,
    bumps: usize,
}

/// One step of the simulation, in seconds: 2.5 cm at full speed.
const STEP: f64 = 0.05;
/// Gain of the loop that holds the turret, per second: well damped behind a needle that lags one second.
const HOLD_GAIN: f64 = 0.5;
/// The turret has arrived within so many radians.
const ARRIVED: f64 = 0.005;
/// The turret gives up after so many seconds: where the field bends sharply it may hunt.
const PATIENCE: f64 = 20.0;

impl<'w> Robot<'w> {
    /// A robot at the start of `world`.
    ///
    /// # Errors
    ///
    /// A description of a robot that cannot exist.
    pub fn new(world: &'w World, description: RobotDescription, seed: u64) -> Result<Self, DescriptionError> {
        Self::starting_at(world, description, seed, world.map_from_start())
    }

    /// A robot that starts anywhere.
    ///
    /// # Errors
    ///
    /// A description of a robot that cannot exist.
    pub fn starting_at(
        world: &'w World,
        description: RobotDescription,
        seed: u64,
        map_from_start: Isometry2<f64>,
    ) -> Result<Self, DescriptionError> {
        description.check()?;
        let sensors = description.sensors()?;
        let range_noise = (10..).zip(&sensors).map(|(stream, _)| Noise::new(seed, stream)).collect();
        let compass = description.compass.map(|model| Compass::new(model, Noise::new(seed, 2)));
        let heading = Heading::from_radians(map_from_start.rotation.angle());
        let turret = if description.turret == Turret::Held { Heading::default() } else { heading };
        let mut robot = Self {
            odometry: Odometry::new(description.odometry, Noise::new(seed, 1)),
            at: Point2::from(map_from_start.translation.vector),
            direction: heading,
            hold: Heading::default(),
            logged: f64::NEG_INFINITY,
            time: 0.0,
            path: 0.0,
            bumps: 0,
            world,
            description,
            sensors,
            range_noise,
            compass,
            turret,
        };
        if let Some(compass) = &mut robot.compass {
            compass.follow(turret, robot.at, 0.0);
        }
        Ok(robot)
    }

    /// Where the robot really is.
    #[must_use]
    pub fn map_from_robot(&self) -> Isometry2<f64> {
        Isometry2::new(self.at.coords, self.turret.radians())
    }

    /// Where dead reckoning believes the robot to be, in the frame where it began.
    #[must_use]
    pub fn odom_from_robot(&self) -> Isometry2<f64> {
        self.odometry.odom_from_robot()
    }

    /// The direction of travel as the robot believes it.
    #[must_use]
    pub fn direction(&self) -> Heading {
        self.believed(self.direction)
    }

    /// How the robot calls a true direction in the map frame, here and now.
    #[must_use]
    pub fn believed(&self, truth: Heading) -> Heading {
        self.believed_turret() + (truth - self.turret)
    }

    /// Seconds since the start.
    #[must_use]
    pub fn time(&self) -> f64 {
        self.time
    }

    /// Metres driven since the start.
    #[must_use]
    pub fn path_length(&self) -> f64 {
        self.path
    }

    /// How often something was in the way.
    #[must_use]
    pub fn bumps(&self) -> usize {
        self.bumps
    }

    /// What the robot is.
    #[must_use]
    pub fn description(&self) -> &RobotDescription {
        &self.description
    }

    /// The world it moves in.
    #[must_use]
    pub fn world(&self) -> &'w World {
        self.world
    }

    /// The robot's range sensors, in the order in which they fire.
    #[must_use]
    pub fn sensors(&self) -> &[Arc<RangeSensor>] {
        &self.sensors
    }

    /// By how many radians the compass is wrong at a place; 0 without a compass.
    #[must_use]
    pub fn compass_disturbance(&self, at: Point2<f64>) -> f64 {
        self.compass.as_ref().map_or(0.0, |compass| compass.disturbance(at))
    }

    /// Does what it is told and appends what it records meanwhile.
    ///
    /// Distances and times that are not positive (or NaN) take no time.
    pub fn execute(&mut self, command: &Command, log: &mut Vec<Entry>) -> Outcome {
        match *command {
            Command::Turn { to } => self.turn(to, log),
            Command::Drive { distance } => return self.drive(distance, log),
            Command::Look { to } => self.look(to, log),
            Command::Fire => self.fire(log),
            Command::Wait { seconds } => self.wait(seconds, log),
        }
        Outcome::default()
    }

    fn turn(&mut self, to: Heading, log: &mut Vec<Entry>) {
        let mut left = to - self.direction();
        let step = self.description.turn_rate * STEP;
        while left != 0.0 {
            let turn = left.clamp(-step, step);
            left -= turn;
            self.step(0.0, turn, log);
        }
        if self.description.turret == Turret::Ahead
            && let Some(compass) = &self.compass
        {
            // The needle turned with the robot: let it settle, or the next turn goes astray.
            self.wait(4.0 * compass.model().lag, log);
        }
    }

    fn drive(&mut self, distance: f64, log: &mut Vec<Entry>) -> Outcome {
        let (limit, acceleration) = (self.description.speed, self.description.acceleration);
        let (mut speed, mut driven) = (0.0f64, 0.0);
        while driven < distance {
            let left = distance - driven;
            let braking = (2.0 * acceleration * left).sqrt().max(acceleration * STEP);
            speed = (speed + acceleration * STEP).min(limit).min(braking);
            let step = (speed * STEP).min(left);
            if !self.is_clear(step) {
                self.bumps += 1;
                self.record(log);
                return Outcome { driven, blocked: true };
            }
            self.step(step, 0.0, log);
            driven += step;
        }
        self.record(log);
        Outcome { driven, blocked: false }
    }

    /// Whether the robot may move ahead by `step`: either it stays clear, or it moves away from what it is near to.
    fn is_clear(&self, step: f64) -> bool {
        let skin = self.description.radius + self.description.margin;
        let scene = self.world.at(self.time + STEP);
        let ahead = scene.clearance(self.at + self.direction.unit_vector() * step, skin);
        ahead >= skin || ahead > scene.clearance(self.at, skin)
    }

    fn look(&mut self, to: Heading, log: &mut Vec<Entry>) {
        if self.description.turret == Turret::Ahead {
            return;
        }
        self.hold = to;
        let until = self.time + PATIENCE;
        while (self.hold - self.believed_turret()).abs() > ARRIVED && self.time < until {
            self.step(0.0, 0.0, log);
        }
    }

    fn wait(&mut self, seconds: f64, log: &mut Vec<Entry>) {
        let until = self.time + seconds;
        while self.time < until {
            self.step(0.0, 0.0, log);
        }
    }

    /// One step of time: `distance` metres ahead, `steering` radians to the left.
    fn step(&mut self, distance: f64, steering: f64, log: &mut Vec<Entry>) {
        let turret_step = self.description.turn_rate * STEP;
        let turn = match self.description.turret {
            Turret::Ahead => steering,
            Turret::Held => {
                let wrong = self.hold - self.believed_turret();
                // Without a compass the turret follows its encoder, which has no lag.
                let gain = if self.compass.is_some() { HOLD_GAIN } else { 1.0 / STEP };
                (wrong * gain * STEP).clamp(-turret_step, turret_step)
            }
        };
        let motion = Motion { turret: self.turret, direction: self.direction - self.turret, distance, turn };
        self.odometry.advance(&motion);
        self.at += self.direction.unit_vector() * distance;
        self.direction = self.direction + steering;
        self.turret = self.turret + turn;
        self.path += distance;
        self.time += STEP;
        if let Some(compass) = &mut self.compass {
            compass.follow(self.turret, self.at, STEP);
        }
        if self.time - self.logged >= self.description.log_period - 0.5 * STEP {
            self.record(log);
        }
    }

    fn believed_turret(&self) -> Heading {
        match &self.compass {
            Some(compass) => compass.needle(),
            None => Heading::from_radians(self.odometry.odom_from_robot().rotation.angle()),
        }
    }

    /// Records odometry, heading and truth of this moment, unless that is done.
    fn record(&mut self, log: &mut Vec<Entry>) {
        if self.logged == self.time {
            return;
        }
        self.logged = self.time;
        let stamp = self.stamp();
        let odom_from_robot = rounded(&self.odom_from_robot());
        log.push(Entry { stamp, kind: EntryKind::Odometry { odom_from_robot } });
        if let Some(compass) = &mut self.compass {
            let deviation = compass.model().deviation().max(1e-3);
            log.push(Entry { stamp, kind: EntryKind::Heading { heading: compass.read(), deviation } });
        }
        let map_from_robot = rounded(&self.map_from_robot());
        log.push(Entry { stamp, kind: EntryKind::Truth { map_from_robot } });
    }

    fn fire(&mut self, log: &mut Vec<Entry>) {
        self.record(log);
        for index in 0..self.sensors.len() {
            let scan = self.scan(index);
            // A laser's message carries its pose; a sonar's does not.
            let with_pose = scan.sensor().kind() == SensorKind::Laser;
            let odom_from_robot = with_pose.then(|| rounded(&self.odom_from_robot()));
            log.push(Entry { stamp: self.stamp(), kind: EntryKind::Scan { odom_from_robot, scan } });
        }
    }

    /// What one of the sensors reads here and now.
    fn scan(&mut self, index: usize) -> Scan {
        let sensor = Arc::clone(&self.sensors[index]);
        let scene = self.world.at(self.time);
        let map_from_robot = self.map_from_robot();
        let (min, max) = (sensor.min_range(), sensor.max_range());
        let noise = &mut self.range_noise[index];
        let poses = sensor.mounts().iter().map(|mount| map_from_robot * mount);
        let readings = match (sensor.kind(), &self.description) {
            (SensorKind::Sonar, RobotDescription { sonar: Some(ring), .. }) => {
                let surroundings = Surroundings::new(&scene, self.at, max);
                poses
                    .map(|pose| ring.model.report(surroundings.earliest(&ring.model, &pose), min, max, noise))
                    .collect()
            }
            (SensorKind::Infrared, RobotDescription { infrared: Some(ring), .. }) => {
                poses.map(|pose| ring.model.report(first_opaque(&scene, &pose, max), min, max, noise)).collect()
            }
            (_, RobotDescription { laser: Some(fan), .. }) => {
                poses.map(|pose| fan.model.report(first_opaque(&scene, &pose, max), min, max, noise)).collect()
            }
            _ => vec![local_grid::Reading::Invalid; sensor.mounts().len()],
        };
        Scan::new(sensor, readings).expect("one reading per beam, each within the sensor's limits")
    }

    /// The time as a log states it: whole milliseconds.
    fn stamp(&self) -> f64 {
        (self.time * 1e3).round() / 1e3
    }
}

/// A pose as a log states it: tenths of a millimetre and of a milliradian.
fn rounded(pose: &Isometry2<f64>) -> Isometry2<f64> {
    let round = |value: f64| (value * 1e4).round() / 1e4;
    let at = pose.translation.vector.map(round);
    Isometry2::new(Vector2::new(at.x, at.y), round(pose.rotation.angle()))
}
