use local_grid::Heading;
use nalgebra::{Point2, Vector2};

use super::travel::{Hop, Travel};
use super::{Change, ExploreError, Explorer, Phase};
use crate::{Displacement, Link, LinkOrigin, LinkState, PlaceId, PlaceState, TopoMap};

impl Explorer {
    /// Adds the openings around the robot to the map: predicted places, or predicted links to places that are known.
    pub(super) fn predict<S>(
        &mut self,
        map: &mut TopoMap<S>,
        position: &dyn Fn(PlaceId) -> Option<Point2<f64>>,
    ) -> Result<(), ExploreError> {
        let Some(here) = self.here else { return Ok(()) };
        let (features, peaks) = (&self.options.features, &self.options.peaks);
        let openings = self.network.openings(&self.rose, self.window.grid(), features, peaks);
        let known = charted(map, position);
        for opening in openings {
            let spot = self.rose.center() + opening.toward.unit_vector() * self.options.spacing;
            let toward: Vector2<f64> = spot - here.center;
            if self.leads_there(map, here.place, Heading::of(toward)) {
                continue;
            }
            let variance = self.options.predicted_sigma.powi(2);
            match position(here.place).and_then(|at| self.nearest(&known, here.place, at, toward)) {
                Some((place, toward)) => {
                    if map.links_between(here.place, place).next().is_none() {
                        let displacement = Displacement::isotropic(toward, variance);
                        let link = map.add_link(here.place, place, displacement, LinkOrigin::Predicted)?;
                        self.changes.push(Change::LinkPredicted(link));
                    }
                }
                None => {
                    let displacement = Displacement::isotropic(toward, variance);
                    let (place, _) = map.predict_place(here.place, displacement, opening.confidence)?;
                    self.changes.push(Change::PlacePredicted(place));
                }
            }
        }
        Ok(())
    }

    /// Whether a link of a place leads into a direction already, in whatever state: what was tried is not tried again.
    fn leads_there<S>(&self, map: &TopoMap<S>, place: PlaceId, toward: Heading) -> bool {
        map.links_of(place).filter(|link| link.state != LinkState::Rejected).any(|link| {
            let heading = Heading::of(link.displacement_from(place).vector);
            (heading - toward).abs() < self.options.link_separation
        })
    }

    /// The charted place nearest to where an opening leads, if one is near enough, and where it lies seen from here.
    fn nearest(
        &self,
        known: &[(PlaceId, Point2<f64>)],
        from: PlaceId,
        at: Point2<f64>,
        toward: Vector2<f64>,
    ) -> Option<(PlaceId, Vector2<f64>)> {
        let off = |(_, position): &(PlaceId, Point2<f64>)| (position - (at + toward)).norm();
        let others = known.iter().filter(|(place, _)| *place != from);
        let nearest = others.min_by(|a, b| off(a).total_cmp(&off(b)))?;
        (off(nearest) < self.options.suppression).then(|| (nearest.0, nearest.1 - at))
    }

    /// Sets out for the nearest predicted link, or finds that none is left that can be reached.
    pub(super) fn choose<S>(&mut self, map: &TopoMap<S>, preference: &dyn Fn(&Link) -> f64) {
        self.phase = Phase::Done;
        let Some(here) = self.here else { return };
        if map.n_visited() >= self.options.max_places {
            return;
        }
        let distances = map.distances_from(here.place, Link::distance);
        let predicted =
            map.links().iter().filter(|link| link.origin == LinkOrigin::Predicted && link.state == LinkState::Open);
        let candidates = predicted.flat_map(|link| [(link, link.from), (link, link.to)]);
        let priced = candidates.filter_map(|(link, start)| {
            let way = *distances.get(start.index())?;
            let price = way + link.distance() + self.penalty(map, link) + preference(link);
            price.is_finite().then_some((price, link, start))
        });
        // Equal prices go to the older link.
        let best = priced.min_by(|a, b| a.0.total_cmp(&b.0).then(a.1.id.cmp(&b.1.id)).then(a.2.cmp(&b.2)));
        let Some((_, link, start)) = best else { return };
        let Some(route) = map.route(here.place, start) else { return };
        let known = route.links.iter().zip(&route.places[1..]).map(|(&link, &to)| Hop { link, to });
        let last = Hop { link: link.id, to: link.other_end(start) };
        self.phase = Phase::Traveling(Travel::new(known.chain([last])));
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
