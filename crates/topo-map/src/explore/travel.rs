use std::collections::VecDeque;

use local_grid::Heading;
use nalgebra::{Matrix2, Point2};

use super::{Change, Command, ExploreError, Explorer, Firing, Here, HopEnd, Identity, Phase};
use crate::{Link, LinkId, LinkOrigin, LinkState, PlaceId, TopoMap};

/// A journey over known links, and at its end over a predicted one.
#[derive(Debug)]
pub(super) struct Travel {
    /// What is still to go, the present hop first.
    pub(super) hops: VecDeque<Hop>,
    /// Where the present hop leads, in the track frame; set when it begins.
    target: Option<Point2<f64>>,
    /// Metres driven on the present hop.
    pub(super) driven: f64,
    bumps: u32,
    /// Whether the last look found no way.
    doubtful: bool,
    /// What was decided and not yet said.
    queue: VecDeque<Command>,
    /// The direction of the last piece driven, for when it ends at an obstacle.
    toward: Heading,
}

/// One link to go.
#[derive(Debug, Clone, Copy)]
pub(super) struct Hop {
    pub(super) link: LinkId,
    pub(super) to: PlaceId,
}

/// A robot that was stopped so often on one hop gives it up.
const MOST_BUMPS: u32 = 3;
/// A predicted place may be moved by so much, in metres, to where there is more room.
const SHIFT: f64 = 0.2;
/// A piece must bring the robot nearer to its target by so much, in metres, unless it arrives.
const LEAST_PROGRESS: f64 = 0.05;
/// By how much less a place is measured where nothing was seen and only coordinates said which it is.
const UNSEEN: f64 = 4.0;

impl Travel {
    pub(super) fn new(hops: impl IntoIterator<Item = Hop>) -> Self {
        Self {
            hops: hops.into_iter().collect(),
            target: None,
            driven: 0.0,
            bumps: 0,
            doubtful: false,
            queue: VecDeque::new(),
            toward: Heading::default(),
        }
    }

    /// The sensors fire before the robot moves.
    pub(super) fn look_first(&mut self) {
        self.queue.push_back(Command::Fire { purpose: Firing::Watch });
    }

    /// Where the present hop leads.
    pub(super) fn next_place(&self) -> PlaceId {
        self.hops[0].to
    }

    /// Whether the present hop is the last one, over the link that is to be verified.
    pub(super) fn is_last(&self) -> bool {
        self.hops.len() == 1
    }

    /// Whether the journey leads to a place.
    pub(super) fn passes(&self, place: PlaceId) -> bool {
        self.hops.iter().any(|hop| hop.to == place)
    }

    fn begin_next_hop(&mut self) {
        self.hops.pop_front();
        (self.target, self.driven, self.bumps, self.doubtful) = (None, 0.0, 0, false);
        self.queue.clear();
    }
}

impl Explorer {
    /// Something stopped the robot: it stands before it, in the direction in which it drove.
    pub(super) fn bumped(&mut self) {
        if let Phase::Traveling(travel) = &mut self.phase {
            travel.bumps += 1;
            travel.queue.clear();
            let touch =
                self.robot.translation.vector + travel.toward.unit_vector() * (self.options.obstacles.radius + 0.08);
            self.obstacles.mark(Point2::from(touch));
        }
    }

    /// The next command of a journey, or `None` when the phase has changed.
    pub(super) fn travel<S>(
        &mut self,
        map: &mut TopoMap<S>,
        mut travel: Travel,
    ) -> Result<Option<Command>, ExploreError> {
        if let Some(command) = travel.queue.pop_front() {
            self.phase = Phase::Traveling(travel);
            return Ok(Some(command));
        }
        let Some(here) = self.here else {
            self.phase = Phase::Done;
            return Ok(None);
        };
        let Some(link) = travel.hops.front().and_then(|hop| map.link(hop.link)).copied() else {
            self.phase = Phase::Choosing;
            return Ok(None);
        };
        let target = travel.target.unwrap_or_else(|| {
            let spot = here.center + link.displacement_from(here.place).vector;
            let free = map.place(travel.next_place()).is_some_and(crate::Place::is_predicted);
            // A place that nobody has seen yet may as well lie where there is room.
            if free { self.obstacles.roomiest(self.at(), spot, SHIFT) } else { spot }
        });
        travel.target = Some(target);
        match self.drive(&mut travel, target, link.distance()) {
            Ok(command) => {
                self.phase = Phase::Traveling(travel);
                Ok(Some(command))
            }
            Err(HopEnd::Arrived) => {
                self.arrived(travel);
                Ok(None)
            }
            Err(HopEnd::Blocked(_)) => {
                // Seen from elsewhere, or later, a door may be open after all: what is predicted gets a second try.
                let tried = self.tried.entry(link.id).or_insert(0);
                *tried += 1;
                let tried = *tried;
                if link.origin != LinkOrigin::Predicted || tried > self.options.retries {
                    self.block(map, link.id)?;
                }
                // Who has come so far from the last place is not there any more, and should find out where.
                let again = link.origin != LinkOrigin::Predicted && tried > 1;
                let off = (self.at() - here.center).norm();
                let astray = again && off > self.options.spacing.min((target - self.at()).norm());
                self.phase = if astray { Phase::Surveying { fired: 0, turned: false } } else { Phase::Choosing };
                Ok(None)
            }
        }
    }

    /// The next piece towards `target`, or how the hop ended.
    fn drive(&mut self, travel: &mut Travel, target: Point2<f64>, length: f64) -> Result<Command, HopEnd> {
        let (at, options) = (self.at(), &self.options);
        let left = (target - at).norm();
        if left <= options.arrival {
            return Err(HopEnd::Arrived);
        }
        let link = travel.hops[0].link;
        let blocked = HopEnd::Blocked(link);
        let (tries, patience) = if travel.is_last() { (0, 1) } else { (self.tries(link), self.patience(link)) };
        let (near_enough, longer) = (options.near_enough * f64::from(1 + tries), f64::from(patience));
        let too_far = travel.driven > longer * (options.detour * length + 1.0) + 0.5 * f64::from(travel.bumps);
        if travel.bumps > MOST_BUMPS * patience || too_far {
            return Err(if left <= near_enough { HopEnd::Arrived } else { blocked });
        }
        // Where obstacles leave no way, the robot goes as near as it can and looks again: from afar a door seems shut.
        let way = self.obstacles.way(at, target, 0.0);
        let straight = way.filter(|way| way_length(way) <= longer * (options.detour * left + 1.0)).and_then(|way| {
            let spot = *way.last()?;
            if (spot - target).norm() > left - LEAST_PROGRESS {
                return None;
            }
            // The last piece leads to the target itself, not to the middle of its cell.
            let exact = (spot - target).norm() <= 0.1 && left <= options.stride;
            let aim = self.obstacles.straight(at, &way, options.stride)?;
            (aim != at).then_some(if exact && aim == spot { target } else { aim })
        });
        let Some(aim) = straight else {
            if left <= near_enough {
                return Err(HopEnd::Arrived);
            }
            // One more look before giving up: it may have been a false echo.
            if std::mem::replace(&mut travel.doubtful, true) {
                return Err(blocked);
            }
            return Ok(Command::Fire { purpose: Firing::Watch });
        };
        let distance = (aim - at).norm();
        if distance < 0.03 {
            return Err(if left <= near_enough { HopEnd::Arrived } else { blocked });
        }
        travel.doubtful = false;
        travel.toward = Heading::of(aim - at);
        travel.queue = VecDeque::from([Command::Drive { distance }, Command::Fire { purpose: Firing::Watch }]);
        Ok(Command::Turn { to: travel.toward })
    }

    /// How many times as much the robot puts up with on a way that it has come before: more with each try, and more again when
    /// no other way is left.
    fn patience(&self, link: LinkId) -> u32 {
        1 + self.tries(link) + self.options.retries * self.shut_in
    }

    /// How many times it has been stopped there since. With each it passes the place at the end from farther off: it must not be
    /// stopped for ever by what stands there now.
    pub(super) fn tries(&self, link: LinkId) -> u32 {
        self.tried.get(&link).copied().unwrap_or(0)
    }

    /// The robot stands where the hop should lead: at the end of its journey it looks all around.
    fn arrived(&mut self, travel: Travel) {
        if travel.is_last() {
            self.pending = Some(travel);
            self.phase = Phase::Surveying { fired: 0, turned: false };
        } else {
            self.phase = Phase::Identifying(Some(travel));
        }
    }

    /// A link cannot be gone; what it alone led to is refuted.
    pub(super) fn block<S>(&mut self, map: &mut TopoMap<S>, link: LinkId) -> Result<(), ExploreError> {
        map.set_link_state(link, LinkState::Blocked)?;
        self.changes.push(Change::LinkBlocked(link));
        let Some(ends) = map.link(link).map(|link| [link.from, link.to]) else { return Ok(()) };
        for place in ends {
            let predicted = map.place(place).is_some_and(crate::Place::is_predicted);
            if predicted && map.links_of(place).all(|link| link.state != LinkState::Open) {
                map.refute(place)?;
                self.changes.push(Change::PlaceRefuted(place));
            }
        }
        Ok(())
    }

    /// The host said where the robot is, at the end of `travel` or (without one) at the very start.
    pub(super) fn identified<S>(
        &mut self,
        map: &mut TopoMap<S>,
        identity: Identity<S>,
        position: &dyn Fn(PlaceId) -> Option<Point2<f64>>,
    ) -> Result<(), ExploreError> {
        let phase = std::mem::replace(&mut self.phase, Phase::Choosing);
        let Phase::Identifying(travel) = phase else {
            self.phase = phase; // nobody asked
            return Ok(());
        };
        // Coordinates of a place that is added now are not known yet: they follow from those of the last place.
        let map_from_track = self.here.and_then(|here| Some(position(here.place)? - here.center));
        let recognized = matches!(identity, Identity::Known { .. });
        match (self.here, travel) {
            (Some(here), Some(travel)) if !travel.is_last() => return self.passed(map, here, travel, &identity),
            (Some(here), Some(travel)) => self.reached(map, here, &travel, identity)?,
            (Some(here), None) => self.strayed(map, here, identity)?,
            (None, _) => self.begin(map, identity)?,
        }
        let Some(here) = self.here else { return Ok(()) };
        let at = match (position(here.place).filter(|_| recognized), map_from_track) {
            (Some(known), _) => known,
            (None, Some(shift)) => here.center + shift,
            (None, None) => Point2::origin(), // the first place: whatever its coordinates, there is no other
        };
        self.predict(map, &here, at, position)
    }

    /// The first place of the exploration.
    fn begin<S>(&mut self, map: &mut TopoMap<S>, identity: Identity<S>) -> Result<(), ExploreError> {
        match identity {
            Identity::New { signature } => {
                let place = map.add_place(signature)?;
                self.changes.push(Change::PlaceVisited(place));
                self.stand_at(place, self.at(), Matrix2::identity() * 1e-4);
            }
            Identity::Known { place, offset, covariance, .. } => {
                self.recognized(map, place)?;
                self.stand_at(place, self.at() - offset, covariance);
            }
            Identity::Unsure => self.phase = Phase::Surveying { fired: 0, turned: false },
        }
        Ok(())
    }

    /// A place on the way: measured if it was recognised, believed otherwise.
    fn passed<S>(
        &mut self,
        map: &mut TopoMap<S>,
        here: Here,
        mut travel: Travel,
        identity: &Identity<S>,
    ) -> Result<(), ExploreError> {
        let Hop { link, to } = travel.hops[0];
        match identity {
            Identity::Known { place, offset, covariance, seen: Some(seen) } if *place == to => {
                let center = self.at() - offset;
                let measured = self.displacement_to(&here, center, *seen);
                let link = map.travel(here.place, to, measured)?;
                map.revisit(to)?;
                self.changes.push(Change::LinkTraveled(link));
                self.changes.push(Change::PlaceRecognized(to));
                self.stand_at(to, center, *covariance);
            }
            _ => {
                let Some(known) = map.link(link) else { return Ok(()) };
                let believed = known.displacement_from(here.place);
                map.revisit(to)?;
                let driven = self.options.dead_reckoning.covariance(believed.vector, here.driven);
                self.stand_at(to, here.center + believed.vector, here.covariance + driven);
            }
        }
        travel.begin_next_hop();
        self.phase = Phase::Traveling(travel);
        Ok(())
    }

    /// The end of a journey over a predicted link.
    fn reached<S>(
        &mut self,
        map: &mut TopoMap<S>,
        here: Here,
        travel: &Travel,
        identity: Identity<S>,
    ) -> Result<(), ExploreError> {
        let Hop { link, to } = travel.hops[0];
        let predicted = map.place(to).is_some_and(crate::Place::is_predicted);
        self.shut_in = 0;
        match identity {
            Identity::New { signature } => {
                let place = if predicted {
                    map.verify(to, signature)?;
                    to
                } else {
                    // It was to be a known place and is none: the link leads somewhere else.
                    self.block(map, link)?;
                    map.add_place(signature)?
                };
                self.changes.push(Change::PlaceVisited(place));
                self.went(map, here, place, self.at(), Matrix2::identity() * 1e-4)
            }
            Identity::Known { place, offset, covariance, seen } => {
                self.recognized(map, place)?;
                let center = self.at() - offset;
                if predicted {
                    let target = travel.target.unwrap_or(self.at());
                    map.merge(to, place, target - center, Matrix2::zeros())?;
                    self.changes.push(Change::PlaceMerged { absorbed: to, kept: place });
                } else if place != to {
                    self.block(map, link)?;
                }
                let measured = seen.unwrap_or(covariance * UNSEEN);
                self.went(map, here, place, center, measured)?;
                self.stand_at(place, center, covariance);
                Ok(())
            }
            Identity::Unsure => self.block(map, link),
        }
    }

    /// The robot gave up a way and looked where it has come to instead.
    fn strayed<S>(&mut self, map: &mut TopoMap<S>, here: Here, identity: Identity<S>) -> Result<(), ExploreError> {
        let Identity::Known { place, offset, covariance, seen } = identity else { return Ok(()) };
        self.recognized(map, place)?;
        let center = self.at() - offset;
        self.went(map, here, place, center, seen.unwrap_or(covariance * UNSEEN))?;
        self.stand_at(place, center, covariance);
        Ok(())
    }

    fn recognized<S>(&mut self, map: &mut TopoMap<S>, place: PlaceId) -> Result<(), ExploreError> {
        if !map.place(place).is_some_and(crate::Place::is_visited) {
            return Err(ExploreError::Unknown(place));
        }
        map.revisit(place)?;
        self.changes.push(Change::PlaceRecognized(place));
        Ok(())
    }

    /// Adds what was measured on the way to `place`, unless the robot is where it was.
    fn went<S>(
        &mut self,
        map: &mut TopoMap<S>,
        here: Here,
        place: PlaceId,
        center: Point2<f64>,
        covariance: Matrix2<f64>,
    ) -> Result<(), ExploreError> {
        if place != here.place {
            let link = map.travel(here.place, place, self.displacement_to(&here, center, covariance))?;
            self.changes.push(Change::LinkTraveled(link));
        }
        self.stand_at(place, center, covariance);
        drop_idle_predictions(map, place)
    }

    fn stand_at(&mut self, place: PlaceId, center: Point2<f64>, covariance: Matrix2<f64>) {
        self.here = Some(Here { place, center, covariance, driven: 0.0 });
    }
}

/// Rejects predicted links of a place whose other end another open link leads to as well: there is nothing to find out.
pub(super) fn drop_idle_predictions<S>(map: &mut TopoMap<S>, place: PlaceId) -> Result<(), ExploreError> {
    let open = |link: &&Link| link.state == LinkState::Open;
    let idle = |link: &&Link| {
        let others = map.links_between(place, link.other_end(place)).filter(open);
        others.into_iter().any(|other| other.is_passable() || other.id < link.id)
    };
    let predicted = map.links_of(place).filter(open).filter(|link| link.origin == LinkOrigin::Predicted);
    let idle: Vec<LinkId> = predicted.filter(idle).map(|link| link.id).collect();
    for link in idle {
        map.set_link_state(link, LinkState::Rejected)?;
    }
    Ok(())
}

fn way_length(way: &[Point2<f64>]) -> f64 {
    way.windows(2).map(|pair| (pair[1] - pair[0]).norm()).sum()
}
