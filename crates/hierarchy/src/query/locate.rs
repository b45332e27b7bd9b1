//! Where a robot is in a finished map.

use nalgebra::Isometry2;
use robot_log::Entry;
use topo_map::{Displacement, LocalizeError, Localizer, LocalizerOptions, PlaceId, Recognition};

use crate::event::Event;
use crate::mapper::{Mapper, MapperError};

/// Finds a robot in a finished map from what it senses while it drives, wherever it was switched on.
///
/// The robot maps what it drives by itself, without closing loops: each place of that walk is a view with the displacement
/// that led there. A Bayes filter over the places of the map ([`topo_map::Localizer`]) follows them: it expects what the
/// links let expect, believes what looks alike, and keeps some doubt, so that a robot that is carried away is found again.
/// The map is not changed.
///
/// ```
/// # let (map, entries) = (hierarchy::Mapper::new(hierarchy::Config::default())?, Vec::<robot_log::Entry>::new());
/// let mut finder = map.finder()?; // `map` is a finished `Mapper`, or one that was loaded
/// for entry in entries {
///     if let Some(pose) = finder.push(&entry)?.and_then(|seen| seen.map_from_robot) {
///         println!("at {:.1} m, {:.1} m", pose.translation.x, pose.translation.y);
///     }
/// }
/// # Ok::<(), hierarchy::FinderError>(())
/// ```
#[derive(Debug)]
pub struct Finder<'a> {
    map: &'a Mapper,
    walk: Mapper,
    localizer: Localizer,
    /// Whether the places of the map have axes of their own, since no compass held its headings.
    is_turned: bool,
    /// Places of the walk that were looked at.
    seen: usize,
}

/// Where the robot was found when it left a place of its walk.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Whereabouts {
    /// When that was, in the seconds of the log.
    pub stamp: f64,
    /// How far it had driven, in metres.
    pub driven: f64,
    /// What the filter says of the place.
    pub recognition: Recognition,
    /// The robot in the map, where the filter is sure and the last scans do not look as if it had been carried since.
    pub map_from_robot: Option<Isometry2<f64>>,
}

/// Why a robot cannot be looked for.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum FinderError {
    /// An entry that the walk cannot take in.
    #[error(transparent)]
    Walk(#[from] MapperError),
    /// A step or a view that the filter refuses.
    #[error("localisation: {0}")]
    Localize(#[from] LocalizeError),
}

/// A finished map has nearly all places there are: one that it lacks is not expected nearer to a known one than this, in
/// standard deviations.
const UNCHARTED: f64 = 2.5;
/// The likelihood ratio of a view that speaks neither for nor against a place.
const SPEAKS_FOR_IT: f64 = 1.0;

impl Mapper {
    /// A robot that may be anywhere in this map, or outside of it.
    ///
    /// # Errors
    ///
    /// None but a configuration that was not checked.
    pub fn finder(&self) -> Result<Finder<'_>, FinderError> {
        let mut config = self.config().clone();
        config.recognition.enabled = false;
        let options = LocalizerOptions {
            uncharted_sigmas: UNCHARTED,
            likelihood_floor: SPEAKS_FOR_IT,
            ..LocalizerOptions::default()
        };
        let localizer = Localizer::new(options)?;
        let is_turned = self.topology().links().iter().any(|link| link.displacement.turn.is_some());
        Ok(Finder { map: self, walk: Mapper::new(config)?, localizer, is_turned, seen: 0 })
    }
}

impl Finder<'_> {
    /// Takes in one entry; answers where the robot is whenever it leaves a place of its walk.
    ///
    /// # Errors
    ///
    /// An entry that is not finite or not in order.
    pub fn push(&mut self, entry: &Entry) -> Result<Option<Whereabouts>, FinderError> {
        let events = self.walk.push(entry)?;
        if events.iter().any(|event| matches!(event, Event::PlaceAdded { .. })) {
            return self.look_back(1);
        }
        Ok(None)
    }

    /// The log is at its end: looks at the last place as well.
    ///
    /// # Errors
    ///
    /// As [`Finder::push`].
    pub fn finish(&mut self) -> Result<Option<Whereabouts>, FinderError> {
        self.walk.finish()?;
        self.look_back(0)
    }

    /// Looks at the places of the walk that are complete: all but the last so many.
    fn look_back(&mut self, open: usize) -> Result<Option<Whereabouts>, FinderError> {
        let mut found = None;
        while self.seen + open < self.walk.topology().places().len() {
            let place = self.walk.topology().places()[self.seen].id;
            found = Some((place, self.follow(place)?));
            self.seen += 1;
        }
        let Some((place, recognition)) = found else { return Ok(None) };
        let stamp = self.walk.tally().stamps.map_or(0.0, |(_, last)| last);
        let driven = self.walk.trajectory().samples().last().map_or(0.0, |sample| sample.travelled);
        let map_from_robot = self.pose(place, &recognition);
        Ok(Some(Whereabouts { stamp, driven, recognition, map_from_robot }))
    }

    /// Tells the filter how the robot came to a place of its walk, and what it saw there.
    fn follow(&mut self, place: PlaceId) -> Result<Recognition, FinderError> {
        let (map, walk) = (self.map.topology(), self.walk.topology());
        match walk.links_of(place).find(|link| link.to == place) {
            Some(link) if link.is_carried() => self.localizer = Localizer::new(*self.localizer.options())?,
            Some(link) => {
                let Displacement { vector, covariance, .. } = link.displacement;
                self.localizer.predict(map, vector, 0.5 * covariance.trace())?;
            }
            None => {}
        }
        if let Some(view) = walk.place(place).and_then(|place| place.signature()) {
            let turned = self.is_turned || !self.walk.tracker().has_compass();
            let believed = &self.localizer.belief().hypotheses;
            let likelihoods = self.map.recognizer().likelihoods(map, view, turned, believed);
            self.localizer.update(map, &likelihoods)?;
        }
        Ok(self.localizer.decide(map))
    }

    /// Where the robot is now, if it is known of a place of its walk which one of the map that is.
    fn pose(&self, place: PlaceId, recognition: &Recognition) -> Option<Isometry2<f64>> {
        let Recognition::Known(known) = recognition else { return None };
        if self.walk.may_be_carried() {
            return None; // from the place to here only the wheels lead, which know nothing of that
        }
        let anchor = self.walk.trajectory().anchors().iter().rfind(|anchor| anchor.place == place)?;
        let view_from_robot =
            anchor.place_from_robot * anchor.track_from_robot.inverse() * self.walk.track_from_robot();
        let known_from_view = Isometry2::new(known.offset, known.turn);
        Some(self.map.coordinates().map_from_place(known.place) * known_from_view * view_from_robot)
    }
}
