use nalgebra::{Isometry2, Vector2};
use robot_log::local_grid::Scan;
use topo_map::PlaceId;

/// Everything that was sensed, on the path on which it was sensed.
///
/// The path is continuous and locally right but drifts (the `track` frame). At its **anchors** it is tied to
/// places. When relaxation moves the places, each sample moves with the two anchors between which it lies: the
/// corrections of the two are interpolated by the path driven between them.
#[derive(Debug, Clone, Default)]
pub struct Trajectory {
    samples: Vec<Sample>,
    anchors: Vec<Anchor>,
}

/// One moment at which something was sensed.
#[derive(Debug, Clone)]
pub struct Sample {
    /// Seconds on the log's clock.
    pub stamp: f64,
    /// The robot in the locally consistent frame that drifts.
    pub track_from_robot: Isometry2<f64>,
    /// Where the raw odometry believed it to be.
    pub odom_from_robot: Isometry2<f64>,
    /// Path driven since the start, in metres.
    pub travelled: f64,
    /// What was sensed.
    pub scan: Scan,
}

/// A moment at which the robot's position is tied to a place.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Anchor {
    /// The place.
    pub place: PlaceId,
    /// Index of the first sample taken after this moment.
    pub sample: usize,
    /// Seconds on the log's clock.
    pub stamp: f64,
    /// The robot in the frame that drifts.
    pub track_from_robot: Isometry2<f64>,
    /// The robot relative to the centre of the place.
    pub place_from_robot: Isometry2<f64>,
    /// Path driven since the start, in metres.
    pub travelled: f64,
}

impl Trajectory {
    /// All samples in the order in which they were taken.
    #[must_use]
    pub fn samples(&self) -> &[Sample] {
        &self.samples
    }

    /// All anchors in the order in which the places were visited.
    #[must_use]
    pub fn anchors(&self) -> &[Anchor] {
        &self.anchors
    }

    pub(crate) fn restored(samples: Vec<Sample>, anchors: Vec<Anchor>) -> Self {
        Self { samples, anchors }
    }

    pub(crate) fn push_sample(&mut self, sample: Sample) {
        self.samples.push(sample);
    }

    /// The same for a moment that is past.
    pub(crate) fn insert_anchor(&mut self, index: usize, anchor: Anchor) {
        self.anchors.insert(index, anchor);
    }

    pub(crate) fn last_anchor_mut(&mut self) -> Option<&mut Anchor> {
        self.anchors.last_mut()
    }

    /// The samples from a number on, to be put right.
    pub(crate) fn samples_from(&mut self, first: usize) -> &mut [Sample] {
        &mut self.samples[first..]
    }

    pub(crate) fn push_anchor(&mut self, anchor: Anchor) {
        self.anchors.push(anchor);
    }

    /// A place turned out to be another one, `offset` metres from its centre: what was tied to it is tied to that one.
    pub(crate) fn merge(&mut self, absorbed: PlaceId, kept: PlaceId, offset: Vector2<f64>) {
        for anchor in self.anchors.iter_mut().filter(|anchor| anchor.place == absorbed) {
            anchor.place = kept;
            anchor.place_from_robot = Isometry2::translation(offset.x, offset.y) * anchor.place_from_robot;
        }
    }

    /// Turns the robot about each place at which it was: its headings were wrong by so many radians.
    pub(crate) fn turn_at_places(&mut self, turn: f64) {
        for anchor in &mut self.anchors {
            anchor.place_from_robot = Isometry2::rotation(turn) * anchor.place_from_robot;
        }
    }

    /// Turns the whole path about its origin; only before the first place ties it down.
    pub(crate) fn rotate(&mut self, turn: Isometry2<f64>) {
        debug_assert!(self.anchors.is_empty(), "places would be left behind");
        for sample in &mut self.samples {
            sample.track_from_robot = turn * sample.track_from_robot;
        }
    }

    /// The samples taken while the robot drove from `from` to `to` metres.
    pub(crate) fn driven(&self, from: f64, to: f64) -> &[Sample] {
        let first = self.samples.partition_point(|sample| sample.travelled < from);
        let last = self.samples.partition_point(|sample| sample.travelled <= to);
        &self.samples[first..last.max(first)]
    }

    /// The robot in the map at every sample, given where the map has the places.
    ///
    /// Empty while there is no anchor.
    pub fn corrected(&self, map_from_place: impl Fn(PlaceId) -> Isometry2<f64>) -> Vec<Isometry2<f64>> {
        let corrections: Vec<_> = self
            .anchors
            .iter()
            .map(|anchor| map_from_place(anchor.place) * anchor.place_from_robot * anchor.track_from_robot.inverse())
            .collect();
        if corrections.is_empty() {
            return Vec::new();
        }
        let mut after = 0; // the first anchor behind the sample
        let corrected = |(index, sample): (usize, &Sample)| {
            while after < self.anchors.len() && self.anchors[after].sample <= index {
                after += 1;
            }
            let share = self.share(after, sample);
            blend(&corrections, after, share, sample)
        };
        self.samples.iter().enumerate().map(corrected).collect()
    }

    /// How far a sample lies between the anchors `after − 1` and `after`, in `[0, 1]`, by the path driven.
    fn share(&self, after: usize, sample: &Sample) -> f64 {
        let (Some(next), Some(previous)) = (self.anchors.get(after), after.checked_sub(1)) else { return 0.0 };
        let previous = &self.anchors[previous];
        let length = next.travelled - previous.travelled;
        if length <= 0.0 { 0.0 } else { ((sample.travelled - previous.travelled) / length).clamp(0.0, 1.0) }
    }
}

/// The corrected pose of a sample: a correction is a rigid motion, and the two are blended *at the robot*,
/// so that the blend does not depend on how far the track frame's origin is away.
fn blend(corrections: &[Isometry2<f64>], after: usize, share: f64, sample: &Sample) -> Isometry2<f64> {
    let from = corrections[after.saturating_sub(1)] * sample.track_from_robot;
    let Some(to) = corrections.get(after).map(|correction| correction * sample.track_from_robot) else {
        return from;
    };
    let shift: Vector2<f64> = (to.translation.vector - from.translation.vector) * share;
    let turn = from.rotation.rotation_to(&to.rotation).angle() * share;
    Isometry2::new(from.translation.vector + shift, from.rotation.angle() + turn)
}
