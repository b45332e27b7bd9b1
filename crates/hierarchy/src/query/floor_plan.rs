//! What is remembered of regions and gateways, so that names and closed doors outlive the map that they were seen in.
//!
//! A region is remembered by points of its floor, each seen from the nearest place. Whatever moves the places (a loop that
//! closes, more log) moves the points with them, and whatever draws the map anew (another resolution, another cut) finds
//! them where they belong.

use std::collections::BTreeMap;

use nalgebra::{Isometry2, Point2, Vector2};
use region_map::{Gateway, Region, RegionMap};
use topo_map::PlaceId;

/// The regions and gateways of the latest map, and those of earlier ones about which a person or the robot knows more.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct FloorPlan {
    /// Regions in the order of their labels; then those with a name that are no longer found.
    pub regions: Vec<KnownRegion>,
    /// Gateways in the order of the map; then closed ones that are no longer found.
    pub gateways: Vec<KnownGateway>,
}

/// A region, remembered.
#[derive(Debug, Clone, PartialEq)]
pub struct KnownRegion {
    /// Its label in the latest map; `None` where that has no such region.
    pub label: Option<u16>,
    /// What people call it.
    pub name: Option<String>,
    /// Area in square metres.
    pub area: f64,
    /// Membership in "corridor", in `[0, 1]`; the rest is "room".
    pub corridor: f64,
    /// Points of its floor, on a lattice of half a metre or more.
    pub floor: Vec<Landmark>,
}

/// A gateway, remembered.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct KnownGateway {
    /// Where the walls end on both sides.
    pub ends: [Landmark; 2],
    /// Whether it can be passed.
    pub passage: Passage,
}

/// Whether a gateway can be passed, and who says so.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Passage {
    /// It can.
    #[default]
    Open,
    /// The robot saw it closed when it last saw it.
    SeenClosed,
    /// A person closed it; only a person opens it.
    Closed,
}

/// A point as seen from a place.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Landmark {
    /// The place.
    pub place: PlaceId,
    /// The point in the axes of the place, in metres.
    pub offset: Vector2<f32>,
}

impl Landmark {
    /// Where the point is, given where places are.
    #[must_use]
    pub fn point(&self, map_from_place: impl Fn(PlaceId) -> Isometry2<f64>) -> Point2<f64> {
        map_from_place(self.place) * Point2::from(self.offset.cast::<f64>())
    }
}

/// A remembered region is found again where at least this share of its floor lies in a region...
const FOUND: f64 = 0.5;
/// ...and that is at least this share of all remembered floor there, so that the name of a kitchen does not go to the hall
/// that swallows it, while a hall of which only a corner was known may grow.
const PART: f64 = 1.0 / 3.0;
/// A remembered gateway is found again where its middle is no farther off than this, in metres, or than half its width.
const NEAR: f64 = 0.5;
/// Distance between points of a remembered floor, in metres; more where that would be more than [`MOST`] points.
const LATTICE: f64 = 0.5;
/// About the most points that the floors of one map are remembered by.
const MOST: f64 = 20_000.0;

impl FloorPlan {
    /// Remembers a map; `places` says where places are.
    pub(crate) fn of(map: &RegionMap, places: &[(PlaceId, Isometry2<f64>)]) -> Self {
        let mut floors = floors(map);
        let region = |region: &Region| KnownRegion {
            label: Some(region.label),
            name: region.name.clone(),
            area: region.area,
            corridor: region.corridor,
            floor: floors.remove(&region.label).into_iter().flatten().filter_map(|at| sight(places, at)).collect(),
        };
        let gateway = |gateway: &Gateway| {
            let passage = if gateway.blocked { Passage::SeenClosed } else { Passage::Open };
            let [a, b] = gateway.ends;
            Some(KnownGateway { ends: [sight(places, a)?, sight(places, b)?], passage })
        };
        Self {
            regions: map.regions.iter().map(region).collect(),
            gateways: map.gateways.iter().filter_map(gateway).collect(),
        }
    }

    /// Gives a new map the names and the closed gateways that are remembered, and remembers that map; what found no place
    /// in it is kept for a later one.
    pub(crate) fn renew(&mut self, map: &mut RegionMap, places: &[(PlaceId, Isometry2<f64>)]) {
        let poses: BTreeMap<PlaceId, Isometry2<f64>> = places.iter().copied().collect();
        let map_from_place = |place: PlaceId| poses.get(&place).copied().unwrap_or_else(Isometry2::identity);
        let regions = self.recognize_regions(map, map_from_place);
        let gateways = self.recognize_gateways(map, map_from_place);
        let old = std::mem::take(self);
        for (region, label) in old.regions.iter().zip(&regions) {
            if let (Some(name), Some(label)) = (&region.name, label) {
                // The label was read from the map just now, so the region exists.
                let _ = map.name(*label, name.clone());
            }
        }
        *self = Self::of(map, places);
        let lost =
            old.regions.into_iter().zip(regions).filter(|(region, label)| region.name.is_some() && label.is_none());
        self.regions.extend(lost.map(|(region, _)| KnownRegion { label: None, ..region }));
        for (gateway, found) in old.gateways.into_iter().zip(gateways).filter(|(old, _)| old.passage != Passage::Open) {
            match found {
                Some(index) => self.set_passage(map, index, gateway.passage),
                None => self.gateways.push(gateway),
            }
        }
    }

    /// Opens or closes a gateway of the map that was last remembered.
    pub(crate) fn set_passage(&mut self, map: &mut RegionMap, index: usize, passage: Passage) {
        if let (Some(known), Some(gateway)) = (self.gateways.get_mut(index), map.gateways.get_mut(index)) {
            known.passage = passage;
            gateway.blocked = passage != Passage::Open;
        }
    }

    /// Closes gateways that were last seen shut, and opens those last seen open; what a person closed stays so.
    pub(crate) fn see_doors(&mut self, map: &mut RegionMap, seen: &[Option<Passage>]) {
        for (index, seen) in seen.iter().enumerate() {
            let said = self.gateways.get(index).is_some_and(|known| known.passage == Passage::Closed);
            if let Some(passage) = seen.filter(|_| !said) {
                self.set_passage(map, index, passage);
            }
        }
    }

    /// Names of regions that the latest map has no more.
    pub fn lost_names(&self) -> impl Iterator<Item = &str> {
        self.regions.iter().filter(|region| region.label.is_none()).filter_map(|region| region.name.as_deref())
    }

    /// The label that each named region has in a new map: one to one, the largest shares of floor first.
    fn recognize_regions(
        &self,
        map: &RegionMap,
        map_from_place: impl Fn(PlaceId) -> Isometry2<f64> + Copy,
    ) -> Vec<Option<u16>> {
        let shares: Vec<_> = self.regions.iter().map(|region| region.shares(map, map_from_place)).collect();
        let mut known: BTreeMap<u16, f64> = BTreeMap::new();
        for (label, area) in shares.iter().flatten() {
            *known.entry(*label).or_default() += area;
        }
        let mut pairs = Vec::new();
        for (index, shares) in shares.iter().enumerate().filter(|(index, _)| self.regions[*index].name.is_some()) {
            let pair = |(&label, &shared): (&u16, &f64)| (shared, index, label);
            pairs.extend(shares.iter().map(pair));
        }
        pairs.sort_by(|a, b| b.0.total_cmp(&a.0).then((a.1, a.2).cmp(&(b.1, b.2))));
        let mut labels = vec![None; self.regions.len()];
        for (shared, index, label) in pairs {
            let area = map.region(label).map_or(f64::INFINITY, |region| region.area);
            let found = shared >= FOUND * self.regions[index].area.min(area) && shared >= PART * known[&label];
            if found && labels[index].is_none() && !labels.contains(&Some(label)) {
                labels[index] = Some(label);
            }
        }
        labels
    }

    /// The index of each remembered gateway in a new map: one to one, the nearest first.
    fn recognize_gateways(
        &self,
        map: &RegionMap,
        map_from_place: impl Fn(PlaceId) -> Isometry2<f64> + Copy,
    ) -> Vec<Option<usize>> {
        let mut pairs = Vec::new();
        for (index, known) in self.gateways.iter().enumerate() {
            let [a, b] = known.ends.map(|end| end.point(map_from_place));
            let center = nalgebra::center(&a, &b);
            for (found, gateway) in map.gateways.iter().enumerate() {
                let apart = (gateway.center - center).norm();
                if apart <= NEAR.max(0.5 * (b - a).norm().min(gateway.width)) {
                    pairs.push((apart, index, found));
                }
            }
        }
        pairs.sort_by(|a, b| a.0.total_cmp(&b.0).then((a.1, a.2).cmp(&(b.1, b.2))));
        let mut indices = vec![None; self.gateways.len()];
        for (_, index, found) in pairs {
            if indices[index].is_none() && !indices.contains(&Some(found)) {
                indices[index] = Some(found);
            }
        }
        indices
    }
}

impl KnownRegion {
    /// How much of it lies in each region of a new map, in square metres.
    fn shares(&self, map: &RegionMap, map_from_place: impl Fn(PlaceId) -> Isometry2<f64> + Copy) -> BTreeMap<u16, f64> {
        let mut shares = BTreeMap::new();
        for landmark in &self.floor {
            if let Some(&label) = map.labels.at(landmark.point(map_from_place)).filter(|label| **label > 0) {
                *shares.entry(label).or_default() += self.area / count(self.floor.len());
            }
        }
        shares
    }
}

/// A point as seen from the nearest place, if there are places.
fn sight(places: &[(PlaceId, Isometry2<f64>)], point: Point2<f64>) -> Option<Landmark> {
    let apart = |pose: &Isometry2<f64>| (pose.translation.vector - point.coords).norm_squared();
    let (place, pose) = places.iter().min_by(|a, b| apart(&a.1).total_cmp(&apart(&b.1)))?;
    Some(Landmark { place: *place, offset: pose.inverse_transform_point(&point).coords.cast() })
}

/// Points of the floor of each region: the cells at the nodes of a lattice, and the one farthest from its walls.
fn floors(map: &RegionMap) -> BTreeMap<u16, Vec<Point2<f64>>> {
    let frame = map.labels.frame();
    let area: f64 = map.regions.iter().map(|region| region.area).sum();
    let stride = (LATTICE.max((area / MOST).sqrt()) / frame.resolution()).round().max(1.0);
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "positive, and saturating")]
    let stride = stride as usize;
    let mut floors: BTreeMap<u16, Vec<Point2<f64>>> =
        map.regions.iter().map(|region| (region.label, vec![region.inside])).collect();
    for row in (0..frame.rows()).step_by(stride) {
        for column in (0..frame.columns()).step_by(stride) {
            let label = map.labels.cells()[row * frame.columns() + column];
            if let Some(floor) = floors.get_mut(&label) {
                floor.push(frame.center(row, column));
            }
        }
    }
    floors
}

#[expect(clippy::cast_precision_loss, reason = "a few thousand points")]
fn count(points: usize) -> f64 {
    points.max(1) as f64
}

#[cfg(test)]
mod tests;
