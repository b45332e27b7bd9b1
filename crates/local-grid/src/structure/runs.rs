use std::f64::consts::{FRAC_PI_2, PI};

use nalgebra::{Isometry2, Point2, Vector2};

use super::difference;
use crate::{Reading, Scan};

/// How sonar echoes are gathered into walls.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(default, deny_unknown_fields))]
pub struct WallRunOptions {
    /// The stretch of wall after which a run is told of, in metres: longer ones are surer, shorter ones come earlier.
    pub length: f64,
    /// Walls farther than this, in metres, are not followed: what far echoes come from is often a corner.
    pub max_range: f64,
    /// How far an echo may lie off the wall that it continues, in metres.
    pub tolerance: f64,
    /// The largest root mean square distance of the echoes from their wall, in metres; above, it was no straight wall.
    pub straightness: f64,
    /// A wall without an echo for so many metres of driving has ended.
    pub gap: f64,
    /// The fewest echoes of a run.
    pub echoes: usize,
}

impl Default for WallRunOptions {
    fn default() -> Self {
        Self { length: 2.0, max_range: 3.5, tolerance: 0.06, straightness: 0.03, gap: 0.8, echoes: 5 }
    }
}

/// Finds straight walls along which a robot drives, from the sonar echoes at its sides.
///
/// A smooth wall echoes at the foot of the perpendicular, wherever in the cone that lies (a *region of constant depth*,
/// Leonard & Durrant-Whyte 1992). So with `n` the wall's normal towards it and `s` the sensor, all echoes `d` of one wall
/// obey
///
/// ```text
/// n·s_i + d_i = c
/// ```
///
/// whatever the beam's axis, and the normal is the direction in which the left sides do not change: a line fit.
/// Corners and furniture show such a run only over a short way.
#[derive(Debug, Clone, PartialEq)]
pub struct WallRuns {
    options: WallRunOptions,
    runs: Vec<FollowedWall>,
}

/// A straight wall that was followed long enough.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WallRun {
    /// The wall's direction modulo 90° in the frame of the poses, in radians in `[0, π/2)`.
    pub direction: f64,
    /// Standard deviation of the direction in radians, as far as the echoes' own spread tells.
    pub sigma: f64,
    /// Length of wall that echoed, in metres.
    pub length: f64,
    /// The mean of what was `marked` while it was followed.
    pub marked: f64,
}

impl WallRun {
    /// The turn in radians, in `(−π/4, π/4]`, that would bring this wall in line with walls of direction `reference`.
    #[must_use]
    pub fn turn_to(&self, reference: f64) -> f64 {
        difference(reference, self.direction)
    }
}

/// A wall that is still being followed: spots at which it was heard from, and the line that fits them.
#[derive(Debug, Clone, PartialEq)]
pub struct FollowedWall {
    /// Its echoes so far, in order; at least one.
    pub echoes: Vec<WallEcho>,
    /// The direction towards the wall, in radians.
    pub normal: f64,
    /// The wall's distance from the origin along its normal, `c`, in metres.
    pub depth: f64,
    /// How far the normal may still be wrong, in radians.
    pub sigma: f64,
    /// Root mean square distance of the echoes from the line, in metres.
    pub residual: f64,
    /// Length of wall that echoed, in metres.
    pub length: f64,
}

/// An echo of a wall that is followed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WallEcho {
    /// Where the sensor was, in metres.
    pub from: Point2<f64>,
    /// How far off it heard the wall, in metres.
    pub range: f64,
    /// What the caller wanted to know of that moment.
    pub marked: f64,
}

/// The robot must move by so much between two echoes of one wall, in metres.
const STEP: f64 = 0.02;
/// What a sonar rounds its ranges to, in metres.
const ROUNDING: f64 = 0.006;
/// Errors of echoes closer together than this along a wall, in metres, are one error: frames, plaster, the robot's sway.
const CORRELATED: f64 = 0.5;
/// How far beyond its cone a beam may still hear a wall, in radians: the heading sways meanwhile.
const SWAY: f64 = 0.1;

impl WallRuns {
    /// No wall yet.
    #[must_use]
    pub fn new(options: WallRunOptions) -> Self {
        Self::recalling(options, Vec::new())
    }

    /// Goes on following walls. One without echoes is none.
    #[must_use]
    pub fn recalling(options: WallRunOptions, mut runs: Vec<FollowedWall>) -> Self {
        runs.retain(|run| !run.echoes.is_empty());
        Self { options, runs }
    }

    /// The walls that are being followed: all that is needed to go on with them later.
    #[must_use]
    pub fn followed(&self) -> &[FollowedWall] {
        &self.runs
    }

    /// Takes a scan of sonars at a pose; answers the walls that have now been followed long enough.
    ///
    /// `marked` is anything that the caller wants to know of the time at which a wall was seen, in the mean.
    pub fn push(&mut self, odom_from_robot: &Isometry2<f64>, scan: &Scan, marked: f64) -> Vec<WallRun> {
        let cone = 0.5 * scan.sensor().beam_width();
        for beam in scan.beams() {
            let Reading::Echo(range) = beam.reading else { continue };
            let range = f64::from(range);
            if range >= scan.sensor().min_range() && range <= self.options.max_range {
                let odom_from_sensor = odom_from_robot * beam.robot_from_sensor;
                let heard = WallEcho { from: odom_from_sensor.translation.vector.into(), range, marked };
                self.hear(heard, odom_from_sensor.rotation.angle(), cone);
            }
        }
        self.tell(&odom_from_robot.translation.vector.into(), cone)
    }

    /// Gives an echo to the wall that it fits best, or begins one with it.
    fn hear(&mut self, heard: WallEcho, axis: f64, cone: f64) {
        let options = &self.options;
        let fitting = self.runs.iter_mut().filter_map(|run| Some((run.misfit(&heard, axis, cone, options)?, run)));
        match fitting.min_by(|a, b| a.0.total_cmp(&b.0)) {
            Some((_, run)) if run.moved(&heard.from) >= STEP => run.take(heard),
            Some(_) => {} // the same echo again
            None => self.runs.push(FollowedWall::beginning(heard, axis, cone)),
        }
    }

    /// Takes out walls that are long enough, going on from their last echo, and drops those that have ended.
    fn tell(&mut self, robot: &Point2<f64>, cone: f64) -> Vec<WallRun> {
        let (mut told, options) = (Vec::new(), &self.options);
        self.runs.retain_mut(|run| {
            if run.length >= options.length && run.echoes.len() >= options.echoes {
                told.extend((run.residual <= options.straightness).then(|| run.told()));
                let last = run.echoes[run.echoes.len() - 1];
                *run = FollowedWall::beginning(last, run.normal, cone);
            }
            run.moved(robot) < options.gap + run.echoes[0].range.min(0.5)
        });
        told
    }
}

impl FollowedWall {
    fn beginning(heard: WallEcho, normal: f64, cone: f64) -> Self {
        let depth = unit(normal).dot(&heard.from.coords) + heard.range;
        Self { echoes: vec![heard], normal, depth, sigma: cone, residual: 0.0, length: 0.0 }
    }

    /// How far the place of an echo is from the last one's, in metres.
    fn moved(&self, to: &Point2<f64>) -> f64 {
        self.echoes.last().map_or(f64::INFINITY, |last| (to - last.from).norm())
    }

    /// How far an echo lies off this wall, in metres; `None` where it cannot be of it.
    fn misfit(&self, heard: &WallEcho, axis: f64, cone: f64, options: &WallRunOptions) -> Option<f64> {
        let aside = (axis - self.normal + PI).rem_euclid(2.0 * PI) - PI;
        if aside.abs() > cone + SWAY || self.moved(&heard.from) > options.gap {
            return None;
        }
        let way = (heard.from - self.echoes[self.echoes.len() / 2].from).norm();
        let off = (unit(self.normal).dot(&heard.from.coords) + heard.range - self.depth).abs();
        (off <= options.tolerance + 2.0 * self.sigma.min(cone) * way).then_some(off)
    }

    /// Takes an echo in and fits the wall anew.
    fn take(&mut self, heard: WallEcho) {
        self.echoes.push(heard);
        for _ in 0..3 {
            let normal = unit(self.normal);
            let along = Vector2::new(-normal.y, normal.x);
            let count = counted(self.echoes.len());
            let (mut u, mut v) = (0.0, 0.0);
            for echo in &self.echoes {
                u += along.dot(&echo.from.coords) / count;
                v += (normal.dot(&echo.from.coords) + echo.range) / count;
            }
            let (mut uu, mut uv, mut vv) = (0.0, 0.0, 0.0);
            let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
            for echo in &self.echoes {
                let du = along.dot(&echo.from.coords) - u;
                let dv = normal.dot(&echo.from.coords) + echo.range - v;
                (uu, uv, vv) = (uu + du * du, uv + du * dv, vv + dv * dv);
                (low, high) = (low.min(du), high.max(du));
            }
            self.depth = v;
            self.length = high - low;
            self.residual = ((vv - uv * uv / uu.max(1e-12)).max(0.0) / count).sqrt();
            self.sigma = self.residual.max(ROUNDING)
                / (uu / count).sqrt().max(1e-6)
                / count.min(self.length / CORRELATED).max(1.0).sqrt();
            if uu / count < STEP * STEP {
                return; // not moved along the wall: its direction is not seen
            }
            let off = (uv / uu).atan();
            self.normal -= off;
        }
    }

    fn told(&self) -> WallRun {
        let marked = self.echoes.iter().map(|echo| echo.marked).sum::<f64>() / counted(self.echoes.len());
        WallRun { direction: self.normal.rem_euclid(FRAC_PI_2), sigma: self.sigma, length: self.length, marked }
    }
}

fn unit(angle: f64) -> Vector2<f64> {
    Vector2::new(angle.cos(), angle.sin())
}

#[expect(clippy::cast_precision_loss, reason = "a run has hundreds of echoes at most")]
fn counted(count: usize) -> f64 {
    count as f64
}
