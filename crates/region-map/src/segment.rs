//! From membership in "free" to regions.

pub(crate) mod carve;
pub(crate) mod chords;
pub(crate) mod clean;
pub(crate) mod crop;
pub(crate) mod gate;
pub(crate) mod gates;
pub(crate) mod kept;
pub(crate) mod mouths;
pub(crate) mod watershed;

use local_grid::Grid;

use crate::{
    distance::DistanceField,
    gateways::Gateway,
    numbering::{Numbered, drop_crumbs, number},
    options::{Options, SegmentError},
    region_map::RegionMap,
    regions::survey::Survey,
    segment::carve::{Carved, carve},
    segment::clean::fill_furniture,
    segment::crop::{Cropped, crop, write_back},
    segment::gate::{Gate, Scale},
    segment::gates::find_gates,
    segment::watershed::flood,
};

/// Cuts free space into rooms and corridors at its gateways.
///
/// `free` holds memberships in "free", from 0 to 1; what is not free is wall.
///
/// # Errors
///
/// An option out of its range, or a map that falls into more than 65535 regions.
pub fn segment(free: &Grid<f32>, options: &Options) -> Result<RegionMap, SegmentError> {
    run(free, None, options)
}

/// As [`segment`], with a mask of unexplored cells, so that borders on the unknown are told from walls.
///
/// # Errors
///
/// As [`segment`], or a mask of another size than the grid.
pub fn segment_explored(free: &Grid<f32>, unknown: &Grid<bool>, options: &Options) -> Result<RegionMap, SegmentError> {
    let (grid, mask) = (free.frame(), unknown.frame());
    if (grid.rows(), grid.columns()) != (mask.rows(), mask.columns()) {
        let (rows, columns) = (mask.rows(), mask.columns());
        return Err(SegmentError::Mask { rows, columns, grid_rows: grid.rows(), grid_columns: grid.columns() });
    }
    run(free, Some(unknown), options)
}

fn run(free: &Grid<f32>, unknown: Option<&Grid<bool>>, options: &Options) -> Result<RegionMap, SegmentError> {
    options.check()?;
    let frame = *free.frame();
    let _span = tracing::debug_span!("regions", rows = frame.rows(), columns = frame.columns()).entered();
    let Some(Cropped { mut plane, origin }) = crop(free, options.threshold) else {
        return Ok(RegionMap { labels: Grid::new(frame), regions: Vec::new(), gateways: Vec::new() });
    };
    let meter = 1.0 / frame.resolution();
    let (furniture, tables) = (options.furniture * meter, options.tables * meter);
    fill_furniture(&mut plane, furniture, tables, dots(options.wall_gap, meter));
    let field = DistanceField::new(&plane);
    let least = options.least_area * meter * meter;
    let scale = Scale {
        narrowest: options.narrowest_gateway * meter,
        widest: options.widest_gateway * meter,
        roughness: options.roughness * meter,
        meter,
    };
    let Carved { mut labels, gates } = carve(&plane, &find_gates(&plane, &field, scale), scale, least);
    drop_crumbs(&mut labels, least);
    flood(&plane, &field, &mut labels);
    let survey = |Numbered { labels, count, .. }: &Numbered| {
        Survey { labels, field: &field, free, unknown, threshold: options.threshold, origin }.regions(*count)
    };
    let mut numbered = number(&labels, least)?;
    let mut regions = survey(&numbered);
    if regions.iter().any(|region| region.width < options.narrowest_region) {
        numbered.drop_from(&mut labels, |name| regions[name - 1].width < options.narrowest_region);
        numbered = number(&labels, least)?;
        regions = survey(&numbered);
    }
    let mut map = RegionMap { labels: Grid::new(frame), regions, gateways: Vec::new() };
    write_back(&numbered.labels, origin, &mut map.labels);
    map.gateways = gateways(&gates, &numbered.names, free, origin);
    tracing::debug!(regions = map.regions.len(), gateways = map.gateways.len());
    Ok(map)
}

/// How many free cells may lie between two dots of one wall.
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a metre at most, and saturating")]
fn dots(gap: f64, meter: f64) -> usize {
    // A gap of just that many metres counts however the division is rounded.
    (gap * meter + 1e-6) as usize
}

/// The gates that still lie between two regions.
fn gateways(gates: &[(Gate, [u32; 2])], names: &[u16], free: &Grid<f32>, origin: (usize, usize)) -> Vec<Gateway> {
    let mut gateways: Vec<Gateway> = gates
        .iter()
        .map(|(gate, sides)| (gate, sides.map(|label| names.get(label as usize).copied().unwrap_or(0))))
        .filter(|(_, sides)| sides[0] != sides[1] && !sides.contains(&0))
        .map(|(gate, sides)| Gateway::new(gate, sides, free, origin))
        .collect();
    gateways.sort_by(|a, b| a.width.total_cmp(&b.width));
    let mut apart: Vec<Gateway> = Vec::new();
    for gateway in gateways {
        if !apart.iter().any(|other| other.is_same_passage(&gateway)) {
            apart.push(gateway);
        }
    }
    let mut gateways = apart;
    gateways.sort_by(|a, b| {
        let (p, q) = (a.center, b.center);
        a.regions.cmp(&b.regions).then(p.x.total_cmp(&q.x)).then(p.y.total_cmp(&q.y))
    });
    gateways
}
