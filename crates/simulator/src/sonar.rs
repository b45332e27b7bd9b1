use std::f64::consts::PI;

use local_grid::Reading;
use nalgebra::{Isometry2, Point2, Vector2};

use crate::Segment;
use crate::corner::{Corner, CornerKind};
use crate::noise::Noise;
use crate::world::Scene;

/// How a Polaroid 6500 ranging module hears a building.
///
/// Smooth walls are mirrors at a wavelength of 7 mm, so a sonar hears a wall only where it looks at it squarely; what
/// it hears at a slant is an edge, a corner, a rough surface, or a wall met after several reflections, which reads too
/// long (Bozma & Kuc 1991; Wilkes, Dudek, Jenkin & Milios 1990). Echoes are collected with their amplitude
///
/// ```text
/// squarely met wall       A(β) / ρ           at the foot of the perpendicular, β off the axis
/// right-angled corner     A(β) / ρ           two reflections send the sound straight back
/// edge                    0.08 A(β) / ρ      diffraction, −22 dB
/// corner in a mirror      0.49 A(β) / ρ      after one reflection, at the length of the path
/// rough surface           r A(β) cos²γ / ρ   at incidence γ, also after bounces
/// closed path of bounces  √(A(β) A(β')) / ρ  at half the length of the path, less at every bounce
/// A(β) = exp(−(β / 6.6°)²)
/// ```
///
/// and the earliest one for which `amplitude · exp(−0.3 ρ)` exceeds the threshold is the reading. The piston's pattern
/// would fall to zero at 12.7°; the Gaussian stands for the wider skirt that real transducers show.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct SonarModel {
    /// Standard deviation of a range as a share of the range; never less than 0.01 m.
    pub range_deviation: f64,
    /// The step to which ranges are rounded, in metres (one inch).
    pub quantum: f64,
    /// Probability that an echo is missed.
    pub dropout: f64,
    /// Probability that another sonar's burst is heard first: any shorter range.
    pub cross_talk: f64,
    /// How many mirror-like reflections a ray survives.
    pub bounces: usize,
    /// How many rays sample the beam.
    pub rays: usize,
}

impl Default for SonarModel {
    fn default() -> Self {
        Self { range_deviation: 0.01, quantum: 0.0254, dropout: 0.01, cross_talk: 0.0075, bounces: 3, rays: 31 }
    }
}

/// Half the angle over which rays are cast, in radians: beyond it nothing is loud enough.
const HALF_FAN: f64 = 15.0 * PI / 180.0;
/// Width of the effective two-way beam pattern, in radians.
const BEAM: f64 = 6.6 * PI / 180.0;
/// Loss in air, per metre of range, beyond what the module's rising gain makes up for.
const ABSORPTION: f64 = 0.3;
/// What is heard: a squarely met wall up to about 6.6 m on the axis, and at 1 m up to 12.5° off it.
const THRESHOLD: f64 = 0.02;
/// Amplitude of a diffracted echo against a wall's.
const EDGE: f64 = 0.08;

/// The two-way sensitivity at `off_axis` radians.
fn beam(off_axis: f64) -> f64 {
    (-(off_axis / BEAM).powi(2)).exp()
}

/// A surface or path that answered: its range in metres and amplitude at the sensor.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Echo {
    range: f64,
    amplitude: f64,
}

impl Echo {
    fn is_heard(&self) -> bool {
        self.amplitude * (-ABSORPTION * self.range).exp() > THRESHOLD
    }
}

/// What a whole ring shares: the surfaces around the robot.
pub(crate) struct Surroundings<'s> {
    scene: &'s Scene<'s>,
    surfaces: Vec<Segment>,
    points: Vec<(Point2<f64>, Option<Corner>)>,
    reach: f64,
}

impl<'s> Surroundings<'s> {
    /// What sensors that measure up to `reach` metres can hear from near `center`.
    pub(crate) fn new(scene: &'s Scene<'s>, center: Point2<f64>, reach: f64) -> Self {
        const MOUNTS: f64 = 1.0; // no sensor sits farther from the robot's centre
        let surfaces = scene.near(center, reach + MOUNTS);
        let mut points: Vec<_> =
            scene.corners_near(center, reach + MOUNTS).map(|corner| (corner.point, Some(*corner))).collect();
        points.extend(scene.moved_edges().filter(|p| (p - center).norm() <= reach + MOUNTS).map(|p| (p, None)));
        Self { scene, surfaces, points, reach }
    }

    /// The range of the earliest audible echo, without noise, in metres from the sensor's face.
    pub(crate) fn earliest(&self, model: &SonarModel, map_from_sensor: &Isometry2<f64>) -> Option<f64> {
        let mut ear = Ear { earliest: f64::INFINITY };
        let face = Point2::from(map_from_sensor.translation.vector);
        let axis = map_from_sensor.rotation * Vector2::x();
        self.walls(face, axis, &mut ear);
        self.corners(face, axis, &mut ear);
        self.bounces(model, face, axis, &mut ear);
        (ear.earliest <= self.reach).then_some(ear.earliest)
    }

    /// Walls met squarely: the foot of the perpendicular lies in the beam and in sight.
    fn walls(&self, face: Point2<f64>, axis: Vector2<f64>, ear: &mut Ear) {
        for wall in &self.surfaces {
            let Some(foot) = wall.foot(face) else { continue };
            if let Some(echo) = direct(face, axis, foot, 1.0)
                && echo.range < ear.earliest
                && self.scene.sees(face, foot)
            {
                ear.hear(echo);
            }
        }
    }

    /// Corners and edges that show their open side.
    fn corners(&self, face: Point2<f64>, axis: Vector2<f64>, ear: &mut Ear) {
        for (point, corner) in &self.points {
            let Some(strength) = strength(corner.as_ref(), face) else { continue };
            if let Some(echo) = direct(face, axis, *point, strength)
                && echo.range < ear.earliest
                && self.scene.sees(face, *point)
            {
                ear.hear(echo);
            }
        }
    }

    /// Rays that fill the beam, followed from mirror to mirror.
    fn bounces(&self, model: &SonarModel, face: Point2<f64>, axis: Vector2<f64>, ear: &mut Ear) {
        #[expect(clippy::cast_precision_loss, reason = "a beam has few rays")]
        let spacing = 2.0 * HALF_FAN / model.rays.max(1) as f64;
        for ray in 0..model.rays {
            #[expect(clippy::cast_precision_loss, reason = "a beam has few rays")]
            let off_axis = -HALF_FAN + (ray as f64 + 0.5) * spacing;
            let toward = nalgebra::Rotation2::new(off_axis) * axis;
            self.follow(model, &Ray { face, axis, toward, emitted: beam(off_axis), spacing }, ear);
        }
    }

    fn follow(&self, model: &SonarModel, ray: &Ray, ear: &mut Ear) {
        let mut leg = Leg { at: ray.face, toward: ray.toward, length: 0.0, path: 0.0, kept: 1.0 };
        for bounce in 0..=model.bounces {
            // What comes later than the earliest echo, or from beyond the reach, is not listened for.
            let reach = 2.0 * self.reach.min(ear.earliest) - leg.path;
            let Some((distance, wall)) = self.scene.cast(leg.at, leg.toward, reach) else { return };
            leg.length = distance;
            if bounce >= 1 {
                self.mirrored_corners(ray, &leg, ear);
            }
            if bounce >= 2 {
                closed_path(ray, &leg, ear);
            }
            leg.path += distance;
            let normal = wall.normal();
            let cosine = leg.toward.dot(&normal).abs();
            // The sound comes back over the same mirrors, so their loss counts twice.
            let amplitude = wall.material.roughness() * ray.emitted * cosine * cosine * leg.kept * leg.kept;
            ear.hear(Echo { range: leg.path, amplitude: amplitude / leg.path.max(0.01) });
            leg.kept *= wall.material.reflectivity();
            leg.at += leg.toward * distance;
            leg.toward -= normal * (2.0 * leg.toward.dot(&normal));
            leg.at += leg.toward * 1e-7; // off the surface
        }
    }

    /// Corners and edges that the beam meets after a reflection: seen in a mirror, too far away and in a wrong direction.
    fn mirrored_corners(&self, ray: &Ray, leg: &Leg, ear: &mut Ear) {
        for (point, corner) in &self.points {
            let way = point - leg.at;
            let along = way.dot(&leg.toward);
            let range = leg.path + along;
            if along <= 0.0 || along > leg.length + 1e-6 || range >= ear.earliest || range > self.reach {
                continue;
            }
            let miss = way.perp(&leg.toward).abs();
            if miss <= (0.5 * ray.spacing * range).max(0.005)
                && let Some(strength) = strength(corner.as_ref(), leg.at)
            {
                ear.hear(Echo { range, amplitude: strength * ray.emitted * leg.kept * leg.kept / range });
            }
        }
    }
}

/// A ray that passes its own sensor again, within its own width and the beam.
fn closed_path(ray: &Ray, leg: &Leg, ear: &mut Ear) {
    let along = (ray.face - leg.at).dot(&leg.toward);
    let arrival = (-leg.toward.dot(&ray.axis)).clamp(-1.0, 1.0).acos();
    let length = leg.path + along;
    let width = (0.5 * ray.spacing * length).max(0.01);
    let miss = (leg.at + leg.toward * along - ray.face).norm();
    if along > 0.0 && along <= leg.length && miss <= width && arrival <= HALF_FAN {
        let range = 0.5 * length;
        ear.hear(Echo { range, amplitude: (ray.emitted * beam(arrival)).sqrt() * leg.kept / range.max(0.01) });
    }
}

/// How strong a corner's echo is against a wall's, seen from `viewer`; `None` from behind.
fn strength(corner: Option<&Corner>, viewer: Point2<f64>) -> Option<f64> {
    match corner {
        Some(corner) if !corner.faces(viewer) => None,
        Some(corner) if corner.kind == CornerKind::Retroreflector => Some(1.0),
        _ => Some(EDGE),
    }
}

/// The receiver: remembers the earliest echo above the threshold.
struct Ear {
    earliest: f64,
}

impl Ear {
    fn hear(&mut self, echo: Echo) {
        if echo.range < self.earliest && echo.is_heard() {
            self.earliest = echo.range;
        }
    }
}

/// A ray on its way: the straight piece that it is on.
struct Leg {
    at: Point2<f64>,
    toward: Vector2<f64>,
    /// Metres to the next surface.
    length: f64,
    /// Metres travelled before this piece.
    path: f64,
    /// Share of the amplitude that the mirrors so far have left.
    kept: f64,
}

/// One ray as it leaves the sensor.
struct Ray {
    face: Point2<f64>,
    axis: Vector2<f64>,
    toward: Vector2<f64>,
    emitted: f64,
    /// The angle to the next ray.
    spacing: f64,
}

/// The echo of a reflector at `point`, if it lies in the beam.
fn direct(face: Point2<f64>, axis: Vector2<f64>, point: Point2<f64>, strength: f64) -> Option<Echo> {
    let way = point - face;
    let range = way.norm();
    if range < 1e-9 {
        return None;
    }
    let off_axis = (way.dot(&axis) / range).clamp(-1.0, 1.0).acos();
    let echo = Echo { range, amplitude: strength * beam(off_axis) / range };
    (off_axis <= HALF_FAN && echo.is_heard()).then_some(echo)
}

impl SonarModel {
    /// What the ranging module reports for the earliest audible echo: noise, missed echoes, cross-talk, rounding, and
    /// the blanking that makes everything nearer than the minimum range read as that range.
    pub(crate) fn report(&self, earliest: Option<f64>, min: f64, max: f64, noise: &mut Noise) -> Reading {
        // Every draw is made in every case, so that one firing does not shift the noise of the next.
        let (error, lost, disturbed) = (noise.normal(), noise.happens(self.dropout), noise.happens(self.cross_talk));
        let share = noise.uniform(0.0, 1.0);
        let heard = earliest.filter(|_| !lost).map(|range| range + error * (self.range_deviation * range).max(0.01));
        let range = if disturbed { Some(min + share * (heard.unwrap_or(max) - min).max(0.0)) } else { heard };
        let Some(range) = range else { return Reading::NoEcho };
        let rounded = if self.quantum > 0.0 { (range / self.quantum).round() * self.quantum } else { range };
        if rounded > max { Reading::NoEcho } else { echo(rounded.max(min)) }
    }
}

#[expect(clippy::cast_possible_truncation, reason = "ranges are metres; f32 resolves micrometres")]
pub(crate) fn echo(range: f64) -> Reading {
    Reading::Echo(range as f32)
}
