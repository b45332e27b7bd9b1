use local_grid::Heading;
use nalgebra::{Matrix2, Point2, Vector2};

use super::travel::{Hop, Travel, drop_idle_predictions};
use super::{Change, Command, ExploreError, Explorer, Here, Phase};
use crate::{Central, Displacement, Link, LinkId, LinkOrigin, LinkState, PlaceId, PlaceState, TopoMap};

/// From this share of the spacing on, a spot is surely none of the charted places.
const SEPARATE: f64 = 0.75;
/// Within this share of the spacing a predicted spot is the charted place there.
const SAME: f64 = 0.6;
/// The confidence of a place that the host expects.
const EXPECTED: f64 = 0.5;
/// By how many metres a link is put off on which the robot was stopped.
const SECOND_TRY: f64 = 20.0;
/// So many times it is tried again before the robot leaves its neighbourhood; further tries wait until all else is done, when
/// what was in the way may have gone.
const AGAIN_AT_ONCE: u32 = 1;
/// So many times in a row, without finding out about anything, the robot does not believe that it is shut in.
const SHUT_IN: u32 = 3;

impl Explorer {
    /// Adds the openings around the robot to the map: predicted places, or predicted links to places that are known.
    ///
    /// `at` are the coordinates of the place where it stands.
    pub(super) fn predict<S>(
        &mut self,
        map: &mut TopoMap<S>,
        here: &Here,
        at: Point2<f64>,
        position: &dyn Fn(PlaceId) -> Option<Point2<f64>>,
    ) -> Result<(), ExploreError> {
        let (features, peaks) = (&self.options.features, &self.options.peaks);
        let openings = self.network.openings(&self.rose, self.window.grid(), features, peaks);
        let mut known = charted(map, position);
        for opening in openings {
            let spot = self.rose.center() + opening.toward.unit_vector() * self.options.spacing;
            let toward: Vector2<f64> = spot - here.center;
            let variance = self.options.predicted_sigma.powi(2);
            let nearest = nearest(&known, here.place, at, toward);
            let distance = nearest.map_or(f64::INFINITY, |(_, _, distance)| distance);
            let heading = Heading::of(toward);
            // A link may pass close by a door that leads to where nobody has been.
            let charted = distance < SEPARATE * self.options.spacing && self.leads_there(map, here.place, heading);
            if charted || self.asked(here.place, heading) {
                continue;
            }
            match (opening.central, nearest) {
                (Central::Middle, Some((place, toward, distance))) if distance < self.options.suppression => {
                    if !self.is_redundant(map, here.place, place, toward.norm()) {
                        let displacement = Displacement::isotropic(toward, variance);
                        let link = map.add_link(here.place, place, displacement, LinkOrigin::Predicted)?;
                        self.changes.push(Change::LinkPredicted(link));
                        self.asked.entry(here.place).or_default().push(heading);
                    }
                }
                (Central::Beside, _) if distance < 0.9 * self.options.spacing => {} // near enough to be seen from there
                (Central::Middle | Central::Beside, _) => {
                    let displacement = Displacement::isotropic(toward, variance);
                    let (place, _) = map.predict_place(here.place, displacement, opening.confidence)?;
                    known.push((place, at + toward));
                    self.asked.entry(here.place).or_default().push(heading);
                    self.changes.push(Change::PlacePredicted(place));
                }
            }
        }
        Ok(())
    }

    /// Adds a place that the host expects `toward` away from a visited one, in metres: it knows of floor there that no look
    /// from a place has found. An exploration that was over goes on.
    ///
    /// # Errors
    ///
    /// `seen_from` is no visited place, or `toward` leads nowhere.
    pub fn expect<S>(
        &mut self,
        map: &mut TopoMap<S>,
        seen_from: PlaceId,
        toward: Vector2<f64>,
    ) -> Result<PlaceId, ExploreError> {
        let displacement = Displacement::isotropic(toward, self.options.predicted_sigma.powi(2));
        let (place, _) = map.predict_place(seen_from, displacement, EXPECTED)?;
        self.changes.push(Change::PlacePredicted(place));
        if matches!(self.phase, Phase::Done) {
            self.phase = Phase::Choosing;
        }
        Ok(place)
    }

    /// Whether something was predicted from a place in about this direction before: what was tried is not tried again.
    fn asked(&self, place: PlaceId, toward: Heading) -> bool {
        let near = |asked: &Heading| (*asked - toward).abs() < self.options.link_separation;
        self.asked.get(&place).is_some_and(|asked| asked.iter().any(near))
    }

    /// Whether a link of a place leads into a direction already, in whatever state.
    fn leads_there<S>(&self, map: &TopoMap<S>, place: PlaceId, toward: Heading) -> bool {
        map.links_of(place).filter(|link| link.state != LinkState::Rejected).any(|link| {
            let heading = Heading::of(link.displacement_from(place).vector);
            (heading - toward).abs() < self.options.link_separation
        })
    }

    /// Whether a link of `length` metres would add nothing: a way that is hardly longer joins the two already, or is
    /// about to be tried.
    fn is_redundant<S>(&self, map: &TopoMap<S>, from: PlaceId, to: PlaceId, length: f64) -> bool {
        if map.links_between(from, to).next().is_some() {
            return true;
        }
        let step = |at: PlaceId| {
            let open = map.links_of(at).filter(|link| link.state == LinkState::Open);
            open.map(move |link| (link.other_end(at), link.distance()))
        };
        let longest = length * self.options.redundancy;
        step(from).any(|(middle, first)| {
            step(middle).any(|(end, second)| {
                end == to && first + second <= longest
                    || step(end).any(|(end, third)| end == to && first + second + third <= longest)
            })
        })
    }

    /// Sets out for the nearest predicted link, or finds that none is left. Before it goes far it says so, unless the host
    /// has just been `told`.
    pub(super) fn choose<S>(
        &mut self,
        map: &mut TopoMap<S>,
        position: &dyn Fn(PlaceId) -> Option<Point2<f64>>,
        told: bool,
    ) -> Result<Option<Command>, ExploreError> {
        self.phase = Phase::Done;
        self.drop_charted(map, position)?;
        let Some(here) = self.here else { return Ok(None) };
        if map.n_visited() >= self.options.max_places {
            return Ok(None);
        }
        let neighbourhood = self.options.neighbourhood;
        let tried = |link: &Link| self.tries(link.id);
        let is_near = |link: &Link, way: f64| way < neighbourhood && tried(link) <= AGAIN_AT_ONCE;
        if let Some(travel) = self.cheapest(map, here.place, is_near) {
            self.phase = Phase::Traveling(travel);
            return Ok(None);
        }
        if !told && neighbourhood > 0.0 && open_predictions(map).next().is_some() {
            self.phase = Phase::Leaving;
            return Ok(Some(Command::Leave));
        }
        self.depart(map, here.place)?;
        Ok(None)
    }

    /// Sets out for the nearest predicted link of all, if one can be reached.
    fn depart<S>(&mut self, map: &mut TopoMap<S>, from: PlaceId) -> Result<(), ExploreError> {
        let mut forgot = false;
        loop {
            if let Some(mut travel) = self.cheapest(map, from, |_, _| true) {
                if forgot {
                    travel.look_first();
                }
                self.phase = Phase::Traveling(travel);
                return Ok(());
            }
            let left: Vec<LinkId> = open_predictions(map).map(|link| link.id).collect();
            if left.is_empty() {
                return Ok(());
            }
            if self.reopen(map)? {
                // What was in the way may have been a false echo, or somebody who has gone: see anew.
                self.obstacles.forget();
                forgot = true;
            } else {
                // What cannot be reached at all is no prediction any more.
                for link in left {
                    self.block(map, link)?;
                }
            }
        }
    }

    /// Coordinates have moved since places were predicted: one that now lies on a visited place is that place.
    fn drop_charted<S>(
        &mut self,
        map: &mut TopoMap<S>,
        position: &dyn Fn(PlaceId) -> Option<Point2<f64>>,
    ) -> Result<(), ExploreError> {
        let known = charted(map, position);
        let is_visited = |place: PlaceId| map.place(place).is_some_and(crate::Place::is_visited);
        let (visited, predicted): (Vec<_>, Vec<_>) = known.into_iter().partition(|(place, _)| is_visited(*place));
        for (place, at) in predicted {
            let off = |known: &Point2<f64>| (at - known).norm();
            let nearest = visited.iter().min_by(|a, b| off(&a.1).total_cmp(&off(&b.1)));
            let Some((known, center)) = nearest.filter(|(_, center)| off(center) < SAME * self.options.spacing) else {
                continue;
            };
            map.merge(place, *known, at - center, Matrix2::zeros())?;
            self.changes.push(Change::PlaceMerged { absorbed: place, kept: *known });
            drop_idle_predictions(map, *known)?;
        }
        Ok(())
    }

    /// Opens the traveled links that were blocked, each only so many times: people go away, and echoes may be false.
    ///
    /// Where none is left to be opened the robot is shut in by ways that it has come. That cannot be, so their tries begin
    /// anew, a few times, each with more patience.
    fn reopen<S>(&mut self, map: &mut TopoMap<S>) -> Result<bool, ExploreError> {
        let is_blocked = |link: &&Link| link.state == LinkState::Blocked && link.origin == LinkOrigin::Traveled;
        let mut blocked: Vec<LinkId> = map.links().iter().filter(is_blocked).map(|link| link.id).collect();
        let often = |link: &LinkId| self.tried.get(link).is_some_and(|tried| *tried >= self.options.retries);
        if !blocked.is_empty() && blocked.iter().all(often) && self.shut_in < SHUT_IN {
            self.shut_in += 1;
            self.tried.retain(|link, _| !blocked.contains(link));
        } else {
            blocked.retain(|link| !often(link));
        }
        for &link in &blocked {
            *self.tried.entry(link).or_insert(0) += 1;
            map.set_link_state(link, LinkState::Open)?;
        }
        Ok(!blocked.is_empty())
    }

    /// The journey to the predicted link that costs least, of those that `may` be gone to, by the way in metres to where they
    /// begin.
    fn cheapest<S>(&self, map: &TopoMap<S>, from: PlaceId, may: impl Fn(&Link, f64) -> bool) -> Option<Travel> {
        let distances = map.distances_from(from, Link::distance);
        let candidates = open_predictions(map).flat_map(|link| [(link, link.from), (link, link.to)]);
        let priced = candidates.filter_map(|(link, start)| {
            let way = distances.get(start.index()).copied().filter(|way| way.is_finite() && may(link, *way))?;
            let again = SECOND_TRY * f64::from(self.tries(link.id));
            let price = way + link.distance() + self.penalty(map, link) + again;
            Some((price, link, start))
        });
        // Equal prices go to the older link.
        let (_, link, start) =
            priced.min_by(|a, b| a.0.total_cmp(&b.0).then(a.1.id.cmp(&b.1.id)).then(a.2.cmp(&b.2)))?;
        let route = map.route(from, start)?;
        let known = route.links.iter().zip(&route.places[1..]).map(|(&link, &to)| Hop { link, to });
        Some(Travel::new(known.chain([Hop { link: link.id, to: link.other_end(start) }])))
    }

    /// What makes a link less urgent, in metres: between known places it only adds a way; and the network may doubt.
    fn penalty<S>(&self, map: &TopoMap<S>, link: &Link) -> f64 {
        let doubt = |place: PlaceId| match map.place(place).map(|place| &place.state) {
            Some(PlaceState::Predicted { confidence, .. }) => Some(1.0 - confidence),
            _ => None,
        };
        doubt(link.to).or(doubt(link.from)).unwrap_or(self.options.link_penalty)
    }
}

/// The links that are still to be found out about.
fn open_predictions<S>(map: &TopoMap<S>) -> impl Iterator<Item = &Link> {
    map.links().iter().filter(|link| link.origin == LinkOrigin::Predicted && link.state == LinkState::Open)
}

/// The charted place nearest to where an opening leads: which, where it lies seen from here, and how far from the spot.
fn nearest(
    known: &[(PlaceId, Point2<f64>)],
    from: PlaceId,
    at: Point2<f64>,
    toward: Vector2<f64>,
) -> Option<(PlaceId, Vector2<f64>, f64)> {
    let off = |(_, position): &(PlaceId, Point2<f64>)| (position - (at + toward)).norm();
    let others = known.iter().filter(|(place, _)| *place != from);
    let nearest = others.min_by(|a, b| off(a).total_cmp(&off(b)))?;
    Some((nearest.0, nearest.1 - at, off(nearest)))
}

/// Where visited and predicted places lie; the latter as seen from where they were predicted.
fn charted<S>(map: &TopoMap<S>, position: &dyn Fn(PlaceId) -> Option<Point2<f64>>) -> Vec<(PlaceId, Point2<f64>)> {
    let locate = |place: &crate::Place<S>| match place.state {
        PlaceState::Visited { .. } => position(place.id),
        PlaceState::Predicted { seen_from, .. } => {
            let seen_from = map.resolve(seen_from);
            let link = map.links_between(seen_from, place.id).next()?;
            Some(position(seen_from)? + link.displacement_from(seen_from).vector)
        }
        PlaceState::Refuted | PlaceState::Merged { .. } => None,
    };
    map.places().iter().filter_map(|place| Some((place.id, locate(place)?))).collect()
}
