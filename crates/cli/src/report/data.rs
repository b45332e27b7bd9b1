mod growth;
mod scans;
mod signatures;

use std::collections::BTreeMap;

use global_grid::Exposure;
use hierarchy::explain::{Explanation, LoopStory};
use hierarchy::topo_map::{LinkOrigin, LinkState, PlaceState};
use hierarchy::{Atlas, AtlasLink, AtlasPlace, Growth, Mapper};
use nalgebra::Point2;
use region_map::RegionMap;
use serde::Serialize;

use crate::failure::Failure;
use crate::finished::Finished;
use growth::GrowthData;
use scans::ScanData;
use signatures::SignatureData;

/// What the page's script draws from: columns rather than rows, whole millimetres rather than metres, so that it is small.
#[derive(Debug, Serialize)]
pub(super) struct Data {
    schema: &'static str,
    name: String,
    grid: GridData,
    places: Places,
    links: Links,
    closures: Closures,
    regions: Vec<RegionData>,
    gateways: Vec<GatewayData>,
    path: Path,
    scans: ScanData,
    signatures: SignatureData,
    growth: GrowthData,
}

/// Where the images of the gridmap lie; the fuzzy one is in the page already.
#[derive(Debug, Serialize)]
struct GridData {
    left: i64,
    bottom: i64,
    cell: f64,
    rows: usize,
    columns: usize,
    bayes: String,
    dempster_shafer: String,
    /// By what all evidence is multiplied to be seen: fuzzy, Bayes, Dempster-Shafer.
    exposure: [f32; 3],
}

#[derive(Debug, Serialize)]
struct Places {
    /// One letter each: visited, predicted, refuted, merged.
    state: String,
    x: Vec<i64>,
    y: Vec<i64>,
    /// By dead reckoning.
    x0: Vec<i64>,
    y0: Vec<i64>,
    /// Half axes of the one-σ ellipse and the direction of the longer, in millimetres and degrees.
    a: Vec<i64>,
    b: Vec<i64>,
    angle: Vec<i64>,
    /// The turn of each place's axes in the map, in thousandths of a radian.
    heading: Vec<i64>,
    visits: Vec<u32>,
    /// The label of the region, 0 for none.
    region: Vec<u16>,
    names: BTreeMap<u32, String>,
}

#[derive(Debug, Serialize)]
struct Links {
    from: Vec<usize>,
    to: Vec<usize>,
    /// One letter each: traveled, recognized, predicted.
    origin: String,
    /// One letter each: open, blocked, rejected.
    state: String,
    length: Vec<i64>,
    residual: Vec<i64>,
    /// The residual in hundredths of the link's own standard deviation.
    sigma: Vec<i64>,
    /// How far the link is from what the rest of the map says, in hundredths of a standard deviation.
    against: Vec<i64>,
    times: Vec<u32>,
    bridges: Vec<u32>,
}

#[derive(Debug, Default, Serialize)]
struct Closures {
    place: Vec<u32>,
    known: Vec<u32>,
    /// Distance from what the rest of the map says, in hundredths of a standard deviation.
    sigma: Vec<i64>,
    shift: Vec<i64>,
    /// In thousandths.
    score: Vec<i64>,
    accepted: Vec<u8>,
    reason: Vec<String>,
}

#[derive(Debug, Serialize)]
struct RegionData {
    label: u16,
    name: String,
    corridor: bool,
    area: f64,
    x: i64,
    y: i64,
    /// Outer rings and holes alike: the even-odd rule tells them apart.
    rings: Vec<Vec<[i64; 2]>>,
}

#[derive(Debug, Serialize)]
struct GatewayData {
    ends: [[i64; 2]; 2],
    width: i64,
    regions: [u16; 2],
}

/// Where the robot drove, and where its odometry believed so.
#[derive(Debug, Default, Serialize)]
struct Path {
    x: Vec<i64>,
    y: Vec<i64>,
    x0: Vec<i64>,
    y0: Vec<i64>,
}

/// Positions of places that the replay holds at most, over all relaxations: 0.8 MB of text.
pub(super) const MOST_POSITIONS: usize = 150_000;
/// Points of a path that a page needs at most.
const PATH_POINTS: usize = 20_000;

impl Data {
    pub(super) fn new(name: &str, finished: &Finished, atlas: &Atlas, growth: &Growth) -> Result<Self, Failure> {
        let Finished { mapper, regions, explanation, .. } = finished;
        Ok(Self {
            schema: "topogrid/report/1",
            name: name.to_owned(),
            grid: GridData::new(finished)?,
            places: Places::new(mapper, atlas, regions),
            links: Links::new(atlas, explanation),
            closures: Closures::new(&explanation.loops),
            regions: region_data(regions),
            gateways: regions.gateways.iter().map(GatewayData::new).collect(),
            path: Path::new(mapper),
            scans: ScanData::new(mapper),
            signatures: SignatureData::new(mapper)?,
            growth: GrowthData::new(growth, atlas),
        })
    }
}

impl GridData {
    fn new(finished: &Finished) -> Result<Self, Failure> {
        let frame = finished.gridmap.frame();
        let by = |calculus| {
            let grid = finished.mapper.gridmap_by(calculus).map_err(|error| super::failed(&error))?;
            // The calculi know of the same cells, but a map is cut to what it knows.
            let grid = global_grid::resampled(&grid, frame);
            Ok::<_, Failure>((super::indexed(&grid)?, Exposure::of(&grid).factor()))
        };
        let (bayes, of_bayes) = by(global_grid::Calculus::Bayes)?;
        let (dempster_shafer, of_dempster_shafer) = by(global_grid::Calculus::DempsterShafer)?;
        Ok(Self {
            left: mm(frame.origin().x),
            bottom: mm(frame.origin().y),
            cell: frame.resolution(),
            rows: frame.rows(),
            columns: frame.columns(),
            bayes,
            dempster_shafer,
            exposure: [Exposure::of(&finished.gridmap).factor(), of_bayes, of_dempster_shafer],
        })
    }
}

impl Places {
    fn new(mapper: &Mapper, atlas: &Atlas, regions: &RegionMap) -> Self {
        let letter = |place: &hierarchy::topo_map::Place<_>| match place.state {
            PlaceState::Visited { .. } => 'v',
            PlaceState::Predicted { .. } => 'p',
            PlaceState::Refuted => 'r',
            PlaceState::Merged { .. } => 'm',
        };
        let places = || atlas.places.iter();
        let ellipse = |place: &AtlasPlace| place.ellipse.unwrap_or(([0.0, 0.0], 0.0));
        let name = |place: &AtlasPlace| Some((place.id.0, place.name.clone()?));
        Self {
            state: mapper.topology().places().iter().map(letter).collect(),
            x: places().map(|place| mm(place.position.x)).collect(),
            y: places().map(|place| mm(place.position.y)).collect(),
            x0: places().map(|place| mm(place.dead_reckoned.x)).collect(),
            y0: places().map(|place| mm(place.dead_reckoned.y)).collect(),
            a: places().map(|place| mm(ellipse(place).0[0])).collect(),
            b: places().map(|place| mm(ellipse(place).0[1])).collect(),
            angle: places().map(|place| whole(ellipse(place).1.to_degrees())).collect(),
            heading: places().map(|place| mm(place.heading)).collect(),
            visits: places().map(|place| place.visits).collect(),
            region: places().map(|place| regions.region_at(place.position).map_or(0, |region| region.label)).collect(),
            names: places().filter_map(name).collect(),
        }
    }
}

impl Links {
    fn new(atlas: &Atlas, explanation: &Explanation) -> Self {
        let (links, stories) = (|| atlas.links.iter(), || explanation.links.iter());
        let origin = |link: &AtlasLink| match link.origin {
            LinkOrigin::Traveled => 't',
            LinkOrigin::Recognized => 'r',
            LinkOrigin::Predicted => 'p',
        };
        let state = |link: &AtlasLink| match link.state {
            LinkState::Open => 'o',
            LinkState::Blocked => 'b',
            LinkState::Rejected => 'r',
        };
        Self {
            from: links().map(|link| link.from).collect(),
            to: links().map(|link| link.to).collect(),
            origin: links().map(origin).collect(),
            state: links().map(state).collect(),
            length: links().map(|link| mm(link.length)).collect(),
            residual: stories().map(|link| mm(link.residual_m[0].hypot(link.residual_m[1]))).collect(),
            sigma: stories().map(|link| whole(100.0 * link.energy.max(0.0).sqrt())).collect(),
            against: stories().map(|link| whole(100.0 * link.residual_sigma)).collect(),
            times: links().map(|link| link.traversals).collect(),
            bridges: stories().filter(|link| link.bridge).map(|link| link.link.0).collect(),
        }
    }
}

impl Closures {
    fn new(loops: &[LoopStory]) -> Self {
        let mut columns = Self::default();
        for story in loops {
            columns.place.push(story.place.0);
            columns.known.push(story.known.0);
            columns.sigma.push(whole(100.0 * story.residual_sigma));
            columns.shift.push(mm(story.shift_m.unwrap_or(0.0)));
            columns.score.push(whole(1000.0 * story.score.unwrap_or(0.0)));
            columns.accepted.push(u8::from(story.accepted));
            columns.reason.push(story.reason.clone());
        }
        columns
    }
}

fn region_data(map: &RegionMap) -> Vec<RegionData> {
    let ring = |ring: &Vec<Point2<f64>>| ring.iter().map(at).collect();
    let outlines = map.outlines();
    let region = |(region, outline): (&region_map::Region, &region_map::Outline)| RegionData {
        label: region.label,
        name: super::tables::region_name(region),
        corridor: region.corridor > region.room,
        area: (region.area * 10.0).round() / 10.0,
        x: mm(region.inside.x),
        y: mm(region.inside.y),
        rings: outline
            .parts
            .iter()
            .flat_map(|part| std::iter::once(&part.outer).chain(&part.holes))
            .map(ring)
            .collect(),
    };
    map.regions.iter().zip(&outlines).map(region).collect()
}

impl GatewayData {
    fn new(gateway: &region_map::Gateway) -> Self {
        let ends = [at(&gateway.ends[0]), at(&gateway.ends[1])];
        Self { ends, width: mm(gateway.width), regions: gateway.regions }
    }
}

impl Path {
    fn new(mapper: &Mapper) -> Self {
        let (poses, samples) = (mapper.poses(), mapper.trajectory().samples());
        let every = samples.len().div_ceil(PATH_POINTS).max(1);
        let mut path = Self::default();
        for (pose, sample) in poses.iter().zip(samples).step_by(every) {
            let (corrected, raw) = (pose.translation.vector, sample.odom_from_robot.translation.vector);
            path.x.push(mm(corrected.x));
            path.y.push(mm(corrected.y));
            path.x0.push(mm(raw.x));
            path.y0.push(mm(raw.y));
        }
        path
    }
}

fn at(point: &Point2<f64>) -> [i64; 2] {
    [mm(point.x), mm(point.y)]
}

/// Metres as whole millimetres.
pub(super) fn mm(metres: f64) -> i64 {
    whole(1000.0 * metres)
}

/// The nearest whole number; nonsense becomes 0.
pub(super) fn whole(value: f64) -> i64 {
    #[expect(clippy::cast_possible_truncation, reason = "saturates; what a page draws is far smaller")]
    let whole = value.round() as i64;
    whole
}
