use std::collections::BTreeMap;
use std::io::{self, Write};

use local_grid::nalgebra::Isometry2;
use local_grid::{Heading, RangeSensor, Reading, Scan, SensorKind};

use crate::carmen::{Param, name_of};
use crate::entry::{Entry, EntryKind};

/// Writes entries as a CARMEN log that reads back to the same entries.
///
/// A fan of rays that comes with the robot's odometry becomes `ROBOTLASER1` (a second such sensor `ROBOTLASER2`); every other sensor becomes
/// `SONAR`, whose mounts are free, after an `ODOM` line where the entry has odometry (such an entry reads back as two).
/// Headings go into the attitude of `IMU`, the truth into `TRUEPOS`, recognitions into `LOOP` lines and motions during a scan into `SWEEP` lines of our own; what these lines have no field for (names, range limits, deviations)
/// goes into `PARAM` lines. An echo at exactly the maximum range is written a hair nearer, because at that range CARMEN means no echo.
///
/// ```
/// use robot_log::{CarmenOptions, CarmenReader, CarmenWriter, Entry, EntryKind};
/// use robot_log::local_grid::nalgebra::{Isometry2, Vector2};
///
/// let odom_from_robot = Isometry2::new(Vector2::new(1.0, 2.0), 0.5);
/// let entry = Entry { stamp: 3.25, kind: EntryKind::Odometry { odom_from_robot } };
/// let mut log = CarmenWriter::new(Vec::new());
/// log.write(&entry)?;
/// let text = log.into_inner();
/// let read = CarmenReader::new("own.log", text.as_slice(), CarmenOptions::default())?.next().unwrap()?;
/// assert_eq!(read, entry);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug)]
pub struct CarmenWriter<W> {
    out: W,
    params: BTreeMap<String, String>,
    fans: Vec<String>,
    odom_from_robot: Isometry2<f64>,
}

impl<W: Write> CarmenWriter<W> {
    /// Writes to `out`, which is best buffered: a line is written in many pieces.
    pub fn new(out: W) -> Self {
        Self { out, params: BTreeMap::new(), fans: Vec::new(), odom_from_robot: Isometry2::identity() }
    }

    /// Appends one entry.
    ///
    /// # Errors
    ///
    /// Those of the writer beneath.
    pub fn write(&mut self, entry: &Entry) -> io::Result<()> {
        let stamp = entry.stamp;
        match &entry.kind {
            EntryKind::Odometry { odom_from_robot } => self.odometry(odom_from_robot, stamp),
            EntryKind::Scan { odom_from_robot, scan } => self.scan(odom_from_robot.as_ref(), scan, stamp),
            EntryKind::Heading { heading, deviation } => self.heading("compass", *heading, *deviation, stamp),
            EntryKind::Gyro { heading, deviation } => self.heading("gyro", *heading, *deviation, stamp),
            EntryKind::Recognition { earlier, similarity } => {
                write!(self.out, "LOOP {earlier} {similarity}")?;
                self.end(stamp)
            }
            EntryKind::Truth { map_from_robot } => {
                write!(self.out, "TRUEPOS {}", Pose(map_from_robot))?;
                let odometry = self.odom_from_robot;
                write!(self.out, " {}", Pose(&odometry))?;
                self.end(stamp)
            }
        }
    }

    /// Appends a comment; a text of several lines becomes several comments.
    ///
    /// # Errors
    ///
    /// Those of the writer beneath.
    pub fn comment(&mut self, text: &str) -> io::Result<()> {
        text.lines().try_for_each(|line| writeln!(self.out, "# {line}"))
    }

    /// The writer beneath.
    pub fn into_inner(self) -> W {
        self.out
    }

    fn odometry(&mut self, odom_from_robot: &Isometry2<f64>, stamp: f64) -> io::Result<()> {
        self.odom_from_robot = *odom_from_robot;
        write!(self.out, "ODOM {} 0 0 0", Pose(odom_from_robot))?;
        self.end(stamp)
    }

    fn heading(&mut self, kind: &str, heading: Heading, deviation: f64, stamp: f64) -> io::Result<()> {
        if kind != "compass" || self.params.contains_key(&name_of("IMU", Param::Kind)) {
            self.param("IMU", Param::Kind, kind.to_owned())?;
        }
        self.param("IMU", Param::Deviation, deviation.to_string())?;
        let (sin, cos) = (heading.radians() / 2.0).sin_cos();
        write!(self.out, "IMU 0 0 0 {cos} 0 0 {sin} 0 0 0 0 0 0")?;
        self.end(stamp)
    }

    fn scan(&mut self, odom_from_robot: Option<&Isometry2<f64>>, scan: &Scan, stamp: f64) -> io::Result<()> {
        if let Some(odom_from_robot) = odom_from_robot {
            if let Some((fan, tag)) = Fan::of(scan.sensor()).and_then(|fan| Some((fan, self.fan_tag(scan.sensor())?))) {
                self.odom_from_robot = *odom_from_robot;
                return self.laser(tag, &fan, odom_from_robot, scan, stamp);
            }
            self.odometry(odom_from_robot, stamp)?;
        }
        self.sonar(scan, stamp)
    }

    /// The message that the fan's scans are written as: CARMEN has two lasers with poses.
    fn fan_tag(&mut self, sensor: &RangeSensor) -> Option<&'static str> {
        let index = self.fans.iter().position(|name| name == sensor.name()).unwrap_or_else(|| {
            self.fans.push(sensor.name().to_owned());
            self.fans.len() - 1
        });
        ["ROBOTLASER1", "ROBOTLASER2"].get(index).copied()
    }

    fn laser(
        &mut self,
        tag: &str,
        fan: &Fan,
        odom_from_robot: &Isometry2<f64>,
        scan: &Scan,
        stamp: f64,
    ) -> io::Result<()> {
        let sensor = scan.sensor();
        self.sensor_params(tag, sensor)?;
        self.sweep(scan, stamp)?;
        let count = scan.readings().len();
        #[expect(clippy::cast_precision_loss, reason = "a fan has few rays")]
        let view = fan.step * (count - 1) as f64;
        write!(self.out, "{tag} 0 {} {view} {} {} 0 0 {count}", fan.first, fan.step, sensor.max_range())?;
        self.ranges(scan)?;
        let odom_from_laser = odom_from_robot * fan.robot_from_sensor;
        write!(self.out, " 0 {} {} 0 0 0 0 0", Pose(&odom_from_laser), Pose(odom_from_robot))?;
        self.end(stamp)
    }

    fn sonar(&mut self, scan: &Scan, stamp: f64) -> io::Result<()> {
        let sensor = scan.sensor();
        self.sensor_params("SONAR", sensor)?;
        let kind = match sensor.kind() {
            SensorKind::Sonar => "sonar",
            SensorKind::Laser => "laser",
            SensorKind::Infrared => "infrared",
        };
        self.param("SONAR", Param::Kind, kind.to_owned())?;
        self.param("SONAR", Param::MaxRange, sensor.max_range().to_string())?;
        self.sweep(scan, stamp)?;
        write!(self.out, "SONAR {} {}", sensor.beam_width(), scan.readings().len())?;
        self.ranges(scan)?;
        for mount in sensor.mounts() {
            write!(self.out, " {}", Pose(mount))?;
        }
        self.end(stamp)
    }

    /// Says before a scan how the robot moves during it.
    fn sweep(&mut self, scan: &Scan, stamp: f64) -> io::Result<()> {
        let Some(sweep) = scan.sweep() else { return Ok(()) };
        write!(self.out, "SWEEP {} {} {}", sweep.step.x, sweep.step.y, sweep.turn)?;
        self.end(stamp)
    }

    fn sensor_params(&mut self, tag: &str, sensor: &RangeSensor) -> io::Result<()> {
        let name: String = sensor.name().split_whitespace().collect::<Vec<_>>().join("%20");
        self.param(tag, Param::Name, name)?;
        self.param(tag, Param::MinRange, sensor.min_range().to_string())
    }

    /// Writes the parameter where it is not what the reader believes already.
    fn param(&mut self, tag: &str, param: Param, value: String) -> io::Result<()> {
        let name = name_of(tag, param);
        if self.params.get(&name) != Some(&value) {
            writeln!(self.out, "PARAM {name} {value} nohost 0")?;
            self.params.insert(name, value);
        }
        Ok(())
    }

    fn ranges(&mut self, scan: &Scan) -> io::Result<()> {
        #[expect(clippy::cast_possible_truncation, reason = "readings are f32")]
        let limit = scan.sensor().max_range() as f32;
        let nearer = f32::from_bits(limit.to_bits() - 2);
        for reading in scan.readings() {
            match reading {
                Reading::Echo(range) => write!(self.out, " {}", range.min(nearer))?,
                Reading::NoEcho => write!(self.out, " {}", limit + 1.0)?,
                Reading::Invalid => write!(self.out, " 0")?,
            }
        }
        Ok(())
    }

    fn end(&mut self, stamp: f64) -> io::Result<()> {
        writeln!(self.out, " {stamp} nohost {stamp}")
    }
}

/// `x y theta`, with all the digits that it takes to read the same numbers back.
struct Pose<'a>(&'a Isometry2<f64>);

impl std::fmt::Display for Pose<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let (at, heading) = (self.0.translation, self.0.rotation.angle());
        write!(f, "{} {} {}", at.x, at.y, heading)
    }
}

/// Rays from one point at equal steps.
struct Fan {
    robot_from_sensor: Isometry2<f64>,
    first: f64,
    step: f64,
}

impl Fan {
    /// The sensor as a fan around its middle ray's neighbour at angle 0; `None` where it is none.
    fn of(sensor: &RangeSensor) -> Option<Self> {
        let mounts = sensor.mounts();
        let step = mounts.first()?.rotation.angle_to(&mounts.get(1)?.rotation);
        #[expect(clippy::cast_precision_loss, reason = "a fan has few rays")]
        let first = -step * (mounts.len() - 1) as f64 / 2.0;
        let axis = mounts[0].rotation * local_grid::nalgebra::UnitComplex::new(-first);
        let robot_from_sensor = Isometry2::from_parts(mounts[0].translation, axis);
        #[expect(clippy::cast_precision_loss, reason = "a fan has few rays")]
        let ray = |k: usize| robot_from_sensor * Isometry2::rotation(first + step * k as f64);
        let close = |(k, mount): (usize, &Isometry2<f64>)| {
            let apart = ray(k).inv_mul(mount);
            apart.translation.vector.norm() < 1e-9 && apart.rotation.angle().abs() < 1e-9
        };
        let is_fan = sensor.kind() == SensorKind::Laser
            && step != 0.0
            && (sensor.beam_width() - step.abs()).abs() < 1e-9
            && mounts.iter().enumerate().all(close);
        is_fan.then_some(Self { robot_from_sensor, first, step })
    }
}
