//! A mapper that finds out later that its robot was carried.

use std::ops::Range;

use nalgebra::Isometry2;
use topo_map::{Link, LinkId, LinkOrigin, PlaceId};

use super::watch::RARE;
use super::{CarryWatch, Mapper, MapperError};
use crate::event::{CarriedBy, Event};
use crate::mapper::first_since;
use crate::recognize::hindsight::Found;
use crate::trajectory::{Anchor, Trajectory};

/// Of the closures that tell where the robot was set down, this share must be borne out by scans.
const BORNE: f64 = 0.5;

impl Mapper {
    /// Looks whether the places just passed tell of a moment before at which the robot was carried. If so the link that it
    /// seemed to drive then says nothing from now on, and everything since is moved to where it was recognised.
    pub(in crate::mapper) fn notice_afterwards(&mut self) -> Result<Vec<Event>, MapperError> {
        let (trajectory, eyes, front_end) = (&self.trajectory, &self.eyes, &self.front_end);
        if eyes.are_shut() {
            return Ok(Vec::new());
        }
        let held_by_scans = front_end.is_held_by_scans();
        let scans = |place| weigh_up(&moments(trajectory, place, held_by_scans));
        let found = self.recognizer.look_back(&self.map, &self.coordinates, front_end.held(), scans);
        found.map_or(Ok(Vec::new()), |found| self.set_down_at(found))
    }

    fn set_down_at(&mut self, found: Found) -> Result<Vec<Event>, MapperError> {
        let Found { first, motion, agreed, log_odds, closures } = found;
        let Some(link) = self.led_to(first) else { return Ok(Vec::new()) };
        self.move_since(first, &motion);
        let closures = self.verified(closures);
        let borne = closures.iter().filter(|closure| closure.is_accepted()).count();
        let contradicted = self.crossing(first)?;
        if (borne as f64) < BORNE * closures.len() as f64 || contradicted.len() > borne {
            self.move_since(first, &motion.inverse());
            return Ok(Vec::new());
        }
        self.part_before(first)?;
        self.map.carry(link)?;
        let mut events = vec![Event::Carried { link, told_by: CarriedBy::Places { agreed, log_odds } }];
        events.extend(self.reject(&contradicted)?);
        self.recognizer.tell_links(&self.map);
        events.extend(self.link(closures)?);
        self.recognizer.tell_links(&self.map);
        events.extend(self.settle_all()?);
        Ok(events)
    }

    /// The link over which the robot seemed to come to a place.
    fn led_to(&self, place: PlaceId) -> Option<LinkId> {
        let before = PlaceId(place.0.checked_sub(1)?);
        let traveled = |link: &&Link| link.origin == LinkOrigin::Traveled && !link.is_carried();
        self.map.links_between(before, place).find(traveled).map(|link| link.id)
    }

    /// Moves all places from one on.
    fn move_since(&mut self, first: PlaceId, motion: &Isometry2<f64>) {
        let count = u32::try_from(self.map.places().len()).unwrap_or(u32::MAX);
        for place in (first.0..count).map(PlaceId) {
            self.coordinates.move_to(place, motion * self.coordinates.map_from_place(place));
        }
    }

    /// Closures between places before and after the robot was carried that say something else, each with its misfit.
    fn crossing(&self, first: PlaceId) -> Result<Vec<(LinkId, f64)>, MapperError> {
        let residuals = self.coordinates.problem(&self.map)?.residuals(&self.coordinates.padded(&self.map));
        let measured = self.map.links().iter().filter(|link| link.is_measured()).zip(residuals);
        let crosses = |link: &Link| link.origin == LinkOrigin::Recognized && (link.from < first) != (link.to < first);
        let false_ones = measured.filter(|(link, chi2)| crosses(link) && *chi2 > self.suspicious());
        Ok(false_ones.map(|(link, chi2)| (link.id, chi2)).collect())
    }

    /// Ties the path to the places on either side of the moment, so that no correction is spread over it.
    fn part_before(&mut self, first: PlaceId) -> Result<(), MapperError> {
        let anchors = self.trajectory.anchors();
        let Some(index) = anchors.iter().position(|anchor| anchor.place == first).filter(|index| *index > 0) else {
            return Ok(());
        };
        let (left, reached) = (anchors[index - 1], anchors[index]);
        let next = anchors.get(index + 1).map_or(self.trajectory.samples().len(), |next| next.sample);
        let ratios = moments(&self.trajectory, first, self.front_end.is_held_by_scans());
        let likeliest = ratios.iter().max_by(|a, b| a.1.total_cmp(&b.1)).map(|(sample, _)| *sample);
        let sample = likeliest.unwrap_or((left.sample + reached.sample) / 2).max(1);
        let tied = |anchor: &Anchor, sample: usize| {
            let place_from_track = anchor.place_from_robot * anchor.track_from_robot.inverse();
            self.anchor_at(sample, anchor.place, place_from_track * self.trajectory.samples()[sample].track_from_robot)
        };
        let (ends, begins) = (tied(&left, sample - 1), tied(&reached, sample));
        self.trajectory.insert_anchor(index, Anchor { sample, ..begins });
        self.trajectory.insert_anchor(index, Anchor { sample, ..ends });
        let here = self.set_down.filter(|before| *before <= left.sample).unwrap_or(0);
        let nearby = first_since(self.trajectory.samples(), left.travelled - self.config.places.spacing_m);
        let begin = nearby.max(here).min(sample);
        self.set_down = self.set_down.max(Some(sample));
        self.look_again(&left, begin..sample)?;
        self.look_again(&reached, sample..next.max(sample))
    }

    /// Draws a place anew from the samples of a range in which it was seen.
    fn look_again(&mut self, anchor: &Anchor, seen: Range<usize>) -> Result<(), MapperError> {
        let track_from_place = anchor.track_from_robot * anchor.place_from_robot.inverse();
        let grid = self.sight.grid(&track_from_place, &self.trajectory.samples()[seen])?;
        Ok(self.map.describe(anchor.place, self.sight.cut(&grid))?)
    }
}

/// What the scans on the way to a place say of each moment: the first sample after it, and the logarithm of how many times
/// likelier they are if the robot was carried there.
fn moments(trajectory: &Trajectory, place: PlaceId, held_by_scans: bool) -> Vec<(usize, f64)> {
    let anchors = trajectory.anchors();
    let Some(index) = anchors.iter().position(|anchor| anchor.place == place).filter(|index| *index > 0) else {
        return Vec::new();
    };
    let (left, reached) = (anchors[index - 1].sample, anchors[index].sample);
    let samples = trajectory.samples().iter().enumerate().take(reached + CarryWatch::SIDE);
    let seen = samples.skip(left.saturating_sub(CarryWatch::SIDE)).filter(|(_, sample)| {
        let is_precise = sample.scan.sensor().kind() == robot_log::local_grid::SensorKind::Laser;
        is_precise || !held_by_scans
    });
    let ratios = CarryWatch::ratios(seen);
    ratios.into_iter().filter(|(sample, _)| (left..reached).contains(sample)).collect()
}

/// Logarithm of the odds that the robot was carried at one of some moments; where scans say nothing, at any one.
fn weigh_up(moments: &[(usize, f64)]) -> f64 {
    let most = moments.iter().map(|(_, ratio)| *ratio).fold(0.0, f64::max);
    let sum: f64 = moments.iter().map(|(_, ratio)| (ratio - most).exp()).sum();
    RARE + if moments.is_empty() { 0.0 } else { most + sum.ln() }
}
