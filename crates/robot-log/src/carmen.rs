use std::collections::VecDeque;
use std::io::BufRead;

use local_grid::Sweep;
use local_grid::nalgebra::{Isometry2, Vector2};

use crate::clock::{Clock, Watch};
use crate::entry::{Entry, EntryKind};
use crate::error::{Fault, LogError, LogErrorKind};
use crate::lines::{Lines, Words};
use crate::report::LogReport;
use crate::source::{Decoded, Source};
use crate::told::{Grammar, Told};

mod head;
mod imu;
mod laser;
mod params;
mod sensors;
mod sonar;

pub(crate) use params::{Param, name_of};

use head::Head;
use params::Params;
use sensors::Sensors;

/// What a CARMEN log leaves open. `Default` suits logs of indoor robots.
#[derive(Debug, Clone, PartialEq)]
pub struct CarmenOptions {
    /// Leave faulty lines out and count them, instead of stopping at the first.
    pub lenient: bool,
    /// Which of a line's two stamps is the entry's.
    pub clock: Clock,
    /// A stamp at most so many seconds behind the latest is held at it; more is a fault.
    pub hold: f64,
    /// Ranges of lasers from this one on are no echo, in metres, where the line does not say its own limit (`FLASER`, `RLASER`).
    /// Logs mark "no return" by 32.77, 50, 51.1, 81.83, 81.91, …; 30 m is below all of them and above what rooms need.
    pub laser_max_range: f64,
    /// Ranges of lasers below this one are no measurement, in metres.
    pub laser_min_range: f64,
    /// Ranges of sonars from this one on are no echo, in metres, where no `PARAM` says otherwise.
    pub sonar_max_range: f64,
    /// Ranges of sonars below this one are no measurement, in metres, where no `PARAM` says otherwise.
    pub sonar_min_range: f64,
    /// Standard deviation of the heading in an `IMU` line, in radians, where no `PARAM` says otherwise.
    pub heading_deviation: f64,
}

impl Default for CarmenOptions {
    fn default() -> Self {
        Self {
            lenient: false,
            clock: Clock::Message,
            hold: 1.0,
            laser_max_range: 30.0,
            laser_min_range: 0.05,
            sonar_max_range: 5.0,
            sonar_min_range: 0.1,
            heading_deviation: 5f64.to_radians(),
        }
    }
}

/// A CARMEN log, plain or compressed with gzip, as a stream of entries.
///
/// One line is one message: a name, its fields, then the time at which it was sent (`ipc_time`), the host, and the time at which it was logged.
///
/// | message | entry |
/// |---|---|
/// | `ODOM` | [`EntryKind::Odometry`] |
/// | `FLASER`, `RLASER`, `ROBOTLASER1`, `ROBOTLASER2` | [`EntryKind::Scan`] with the robot's odometry; the laser's mount is the difference of the line's two poses |
/// | `RAWLASER1` … `RAWLASER4` | [`EntryKind::Scan`] without odometry; left out where the log also carries the same laser with its pose |
/// | `SONAR` | [`EntryKind::Scan`] without odometry |
/// | `IMU` | [`EntryKind::Heading`], the yaw of its quaternion; [`EntryKind::Gyro`] after `PARAM imu_kind gyro` |
/// | `TRUEPOS` | [`EntryKind::Truth`] |
/// | `LOOP` (our own, see [`CarmenWriter`](crate::CarmenWriter)) | [`EntryKind::Recognition`] |
/// | `SWEEP` (our own) | none; how the robot moved during the next scan |
/// | `PARAM` | none; mounts and range limits are taken from it |
/// | anything else in capitals, `#` comments | none |
///
/// The iterator ends after the first error, unless [`CarmenOptions::lenient`] leaves faulty lines out.
///
/// ```
/// use robot_log::{CarmenOptions, CarmenReader, EntryKind};
///
/// let text = "FLASER 3 1.0 2.0 81.83  0.1 0 0  0 0 0  7.5 robot 7.5\n";
/// let log = CarmenReader::new("office.log", text.as_bytes(), CarmenOptions::default())?;
/// let entries = log.collect::<Result<Vec<_>, _>>()?;
/// assert_eq!(entries[0].stamp, 7.5);
/// let EntryKind::Scan { scan, .. } = &entries[0].kind else { panic!() };
/// assert_eq!(scan.echo_points().count(), 2); // 81.83 is a scanner's word for nothing
/// assert_eq!(scan.sensor().mounts()[1].translation.x, 0.1);
/// # Ok::<(), robot_log::LogError>(())
/// ```
#[derive(Debug)]
pub struct CarmenReader<R>(Told<Decoded<R>, Parser>);

impl<R: BufRead> CarmenReader<R> {
    /// Starts to read the log `name` (which errors will name) from `reader`; the first bytes tell whether it is compressed.
    ///
    /// # Errors
    ///
    /// The first bytes cannot be read, are not text, or are a table of numbers.
    pub fn new(name: impl Into<String>, reader: R, options: CarmenOptions) -> Result<Self, LogError> {
        let name = name.into();
        let Source { reader, head } = Source::new(&name, reader)?;
        Self::from_source(name, reader, &head, options)
    }

    pub(crate) fn from_source(
        name: String,
        reader: Decoded<R>,
        head: &[u8],
        options: CarmenOptions,
    ) -> Result<Self, LogError> {
        let head = Head::look(head).map_err(|kind| LogError::whole(name.as_str(), kind))?;
        Ok(Self(Told::new(Lines::new(name, reader), Parser::new(options, &head))))
    }

    /// What was read, passed over and skipped so far.
    #[must_use]
    pub fn report(&self) -> &LogReport {
        self.0.report()
    }
}

impl<R: BufRead> Iterator for CarmenReader<R> {
    type Item = Result<Entry, LogError>;

    fn next(&mut self) -> Option<Self::Item> {
        self.0.next()
    }
}

/// Understands single lines, given what earlier lines said of sensors, parameters and time.
#[derive(Debug)]
struct Parser {
    options: CarmenOptions,
    watch: Watch,
    /// The robot's pose in the entry before, where that was an old-style scan.
    of_scan: Option<Isometry2<f64>>,
    params: Params,
    sensors: Sensors,
    /// Lasers that come with the robot's pose, so that their raw messages are repetitions.
    posed: [bool; 2],
    /// How the robot moves during the next scan.
    sweep: Option<Sweep>,
}

impl Grammar for Parser {
    fn read(&mut self, line: &[u8], told: &mut VecDeque<Entry>, report: &mut LogReport) -> Result<(), Fault> {
        told.extend(self.parse(line, report)?);
        Ok(())
    }

    fn is_lenient(&self) -> bool {
        self.options.lenient
    }

    fn nothing(&self, report: &LogReport) -> LogErrorKind {
        let names: Vec<&str> = report.passed_over.keys().take(5).map(String::as_str).collect();
        if names.is_empty() { LogErrorKind::Empty } else { LogErrorKind::Foreign { messages: names.join("`, `") } }
    }
}

impl Parser {
    fn new(options: CarmenOptions, head: &Head) -> Self {
        let watch = Watch::new(options.hold);
        Self {
            of_scan: None,
            watch,
            params: Params::default(),
            sensors: Sensors::default(),
            posed: head.posed,
            sweep: None,
            options,
        }
    }

    /// The entry of one line; `None` where the line holds none.
    fn parse(&mut self, line: &[u8], report: &mut LogReport) -> Result<Option<Entry>, Fault> {
        let mut words = Words::new(line);
        let name = words.word();
        let mut kind = match name.text {
            [] | [b'#', ..] => return Ok(None),
            b"ODOM" => {
                let odom_from_robot = odometry(&mut words)?;
                // GMapping repeats the pose of each scan in an ODOM line whose stamp is whatever was in memory.
                if self.of_scan == Some(odom_from_robot) {
                    return pass_over(name.text, report);
                }
                EntryKind::Odometry { odom_from_robot }
            }
            b"TRUEPOS" => truth(&mut words)?,
            b"LOOP" => recognition(&mut words)?,
            b"IMU" => match imu::heading(&mut words, &self.params, &self.options)? {
                Some(kind) => kind,
                None => return pass_over(name.text, report),
            },
            b"SONAR" => sonar::scan(&mut words, self)?,
            b"FLASER" | b"RLASER" => laser::old_style(name.text, &mut words, self, report)?,
            b"ROBOTLASER1" | b"ROBOTLASER2" => laser::robot_laser(name.text, &mut words, self, report)?,
            b"RAWLASER1" | b"RAWLASER2" | b"RAWLASER3" | b"RAWLASER4" => {
                if self.is_repeated(name.text) {
                    return pass_over(name.text, report);
                }
                laser::raw_laser(name.text, &mut words, self)?
            }
            b"SWEEP" => {
                self.sweep = Some(sweep(&mut words)?);
                return Ok(None);
            }
            b"PARAM" => {
                if self.params.read(&mut words) {
                    return Ok(None);
                }
                return pass_over(name.text, report);
            }
            other if is_message_name(other) => return pass_over(other, report),
            _ => return Err(words.not(name, "the name of a CARMEN message, such as ODOM or FLASER")),
        };
        if let EntryKind::Scan { scan, .. } = &mut kind
            && let Some(sweep) = self.sweep.take()
        {
            *scan = scan.clone().swept(sweep);
        }
        self.of_scan = match &kind {
            EntryKind::Scan { odom_from_robot, .. } if !name.text.starts_with(b"RO") => *odom_from_robot,
            _ => None,
        };
        let stamp = self.stamp(&mut words, matches!(kind, EntryKind::Scan { .. }), report)?;
        Ok(Some(Entry { stamp, kind }))
    }

    /// The end of every message: the time it was sent, the host, the time it was logged (older logs lack the last two).
    fn stamp(&mut self, words: &mut Words<'_>, is_scan: bool, report: &mut LogReport) -> Result<f64, Fault> {
        let at = words.clone().word();
        let sent = words.number("the time of the message (ipc_time) in seconds")?;
        let _host = words.word();
        let (logged_at, mut logged) = (words.clone().word(), sent);
        if !words.at_end() {
            logged = words.number("the time of logging (logger_time) in seconds")?;
        }
        if !words.at_end() {
            let extra = words.word();
            return Err(words.not(extra, "the end of the line"));
        }
        let (stamp, word) = match self.options.clock {
            Clock::Message => (sent, at),
            Clock::Logger => (logged, logged_at),
            Clock::Counted { period } => return Ok(self.watch.count(period, is_scan, report)),
        };
        self.watch.accept(stamp, report).map_err(|kind| Fault { kind, span: Some(word.span()) })
    }

    /// Whether the raw message `name` repeats a laser that the log also carries with the robot's pose.
    fn is_repeated(&self, name: &[u8]) -> bool {
        match name {
            b"RAWLASER1" => self.posed[0],
            b"RAWLASER2" => self.posed[1],
            _ => false,
        }
    }
}

fn pass_over(name: &[u8], report: &mut LogReport) -> Result<Option<Entry>, Fault> {
    report.pass_over(name);
    Ok(None)
}

/// Names of messages are capitals, digits and underscores: `NEFF`, `SYNC`, `NMEAGGA`, `VERTEX2`, …
fn is_message_name(word: &[u8]) -> bool {
    word[0].is_ascii_uppercase()
        && word.iter().all(|byte| byte.is_ascii_uppercase() || byte.is_ascii_digit() || *byte == b'_')
}

/// `x y theta` in metres and radians; `whose` says which pose, for errors.
fn pose(words: &mut Words<'_>, whose: &str) -> Result<Isometry2<f64>, Fault> {
    let x = words.number(&format!("x of {whose} in metres"))?;
    let y = words.number(&format!("y of {whose} in metres"))?;
    let heading = words.number(&format!("heading of {whose} in radians"))?;
    Ok(Isometry2::new(Vector2::new(x, y), heading))
}

/// `ODOM x y theta tv rv accel`.
fn odometry(words: &mut Words<'_>) -> Result<Isometry2<f64>, Fault> {
    let odom_from_robot = pose(words, "the robot")?;
    words.skip(3, "the velocities and the acceleration of the robot")?;
    Ok(odom_from_robot)
}

/// `LOOP earlier similarity`, a message of our own: that the robot is where it was at the stamp `earlier`.
fn recognition(words: &mut Words<'_>) -> Result<EntryKind, Fault> {
    let earlier = words.number("the earlier stamp in seconds")?;
    Ok(EntryKind::Recognition { earlier, similarity: words.number("the similarity")? })
}

/// `SWEEP ahead left turn`, a message of our own: how the robot moves from the first beam of the next scan to the last, in metres
/// and radians.
fn sweep(words: &mut Words<'_>) -> Result<Sweep, Fault> {
    let ahead = words.number("metres ahead during the scan")?;
    let left = words.number("metres to the left during the scan")?;
    Ok(Sweep { step: Vector2::new(ahead, left), turn: words.number("radians turned during the scan")? })
}

/// `TRUEPOS true_x true_y true_theta odom_x odom_y odom_theta`.
fn truth(words: &mut Words<'_>) -> Result<EntryKind, Fault> {
    let map_from_robot = pose(words, "the robot's true pose")?;
    pose(words, "the robot's odometry")?;
    Ok(EntryKind::Truth { map_from_robot })
}
