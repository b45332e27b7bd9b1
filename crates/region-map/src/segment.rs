//! From membership in "free" to regions.

use local_grid::{Grid, nalgebra::Point2};

use crate::{
    carve::carve,
    clean::fill_furniture,
    distance::DistanceField,
    gates::{Gate, Scale, find_gates},
    gateways::Gateway,
    options::{Options, SegmentError},
    plane::Plane,
    region_map::RegionMap,
    regions::{Moments, Region, corridor},
    watershed::flood,
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

/// Free cells inside the smallest box that holds them, with a rim of walls.
pub(crate) struct Cropped {
    pub(crate) plane: Plane<bool>,
    /// Row and column of the grid at which the box begins.
    pub(crate) origin: (usize, usize),
}

pub(crate) fn crop(free: &Grid<f32>, threshold: f32) -> Option<Cropped> {
    let (rows, columns) = (free.frame().rows(), free.frame().columns());
    let (mut top, mut bottom, mut left, mut right) = (rows, 0, columns, 0);
    for row in 0..rows {
        let cells = &free.cells()[row * columns..(row + 1) * columns];
        if let Some(first) = cells.iter().position(|&cell| cell > threshold) {
            let last = cells.iter().rposition(|&cell| cell > threshold).unwrap_or(first);
            (top, bottom) = (top.min(row), row + 1);
            (left, right) = (left.min(first), right.max(last + 1));
        }
    }
    if bottom == 0 {
        return None;
    }
    let mut plane = Plane::filled(bottom - top + 2, right - left + 2, false);
    for row in top..bottom {
        let from = &free.cells()[row * columns + left..row * columns + right];
        let start = (row - top + 1) * plane.columns + 1;
        let to = &mut plane.cells[start..start + from.len()];
        to.iter_mut().zip(from).for_each(|(to, &from)| *to = from > threshold);
    }
    Some(Cropped { plane, origin: (top, left) })
}

fn run(free: &Grid<f32>, unknown: Option<&Grid<bool>>, options: &Options) -> Result<RegionMap, SegmentError> {
    options.check()?;
    let frame = *free.frame();
    let _span = tracing::debug_span!("regions", rows = frame.rows(), columns = frame.columns()).entered();
    let Some(Cropped { mut plane, origin }) = crop(free, options.threshold) else {
        return Ok(RegionMap { labels: Grid::new(frame), regions: Vec::new(), gateways: Vec::new() });
    };
    let meter = 1.0 / frame.resolution();
    // Dots of a scanned wall lie up to 0.1 m apart.
    fill_furniture(&mut plane, options.furniture * meter, if meter > 14.0 { 2 } else { usize::from(meter > 9.0) });
    let field = DistanceField::new(&plane);
    let least = options.least_area * meter * meter;
    let scale = Scale { narrowest: options.narrowest_gateway * meter, widest: options.widest_gateway * meter, meter };
    let gates = find_gates(&plane, &field, scale);
    let (mut labels, kept) = carve(&plane, &gates, scale, least);
    drop_crumbs(&mut labels, least);
    flood(&plane, &field, &mut labels);
    let Numbered { labels, names, count } = number(&labels, least)?;
    let gateways = gateways(&kept, &names, free, origin);
    let mut map = RegionMap { labels: Grid::new(frame), regions: Vec::new(), gateways };
    write_back(&labels, origin, &mut map.labels);
    map.regions = describe(&map.labels, free, unknown, count);
    tracing::debug!(regions = count, gateways = map.gateways.len());
    Ok(map)
}

/// Takes the label from pieces of fewer than `least` cells, so that what lies beside them can take them over.
fn drop_crumbs(labels: &mut Plane<u32>, least: f64) {
    let sizes = sizes(labels);
    labels.cells.iter_mut().filter(|label| (sizes[**label as usize] as f64) < least).for_each(|label| *label = 0);
}

fn sizes(labels: &Plane<u32>) -> Vec<usize> {
    let mut sizes = vec![0_usize; labels.cells.iter().max().copied().unwrap_or(0) as usize + 1];
    labels.cells.iter().for_each(|&label| sizes[label as usize] += 1);
    sizes
}

/// Labels from 1 without gaps, and the new label of every old one.
pub(crate) struct Numbered {
    pub(crate) labels: Plane<u16>,
    names: Vec<u16>,
    count: usize,
}

/// Numbers the labels from 1 in reading order; regions of fewer than `least` cells become 0.
pub(crate) fn number(labels: &Plane<u32>, least: f64) -> Result<Numbered, SegmentError> {
    let sizes = sizes(labels);
    let mut names = vec![0_u16; sizes.len()];
    let mut count = 0_usize;
    let wanted: Vec<usize> =
        (1..sizes.len()).filter(|&label| sizes[label] > 0 && sizes[label] as f64 >= least).collect();
    for &label in &wanted {
        count += 1;
        names[label] = u16::try_from(count).map_err(|_| SegmentError::TooManyRegions(wanted.len()))?;
    }
    let cells = labels.cells.iter().map(|&label| names[label as usize]).collect();
    Ok(Numbered { labels: Plane { rows: labels.rows, columns: labels.columns, cells }, names, count })
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

pub(crate) fn write_back(labels: &Plane<u16>, origin: (usize, usize), out: &mut Grid<u16>) {
    let columns = out.frame().columns();
    for row in 1..labels.rows - 1 {
        let from = &labels.row(row)[1..labels.columns - 1];
        let start = (origin.0 + row - 1) * columns + origin.1;
        out.cells_mut()[start..start + from.len()].copy_from_slice(from);
    }
}

fn describe(labels: &Grid<u16>, free: &Grid<f32>, unknown: Option<&Grid<bool>>, count: usize) -> Vec<Region> {
    let frame = labels.frame();
    let mut moments = vec![Moments::default(); count];
    let mut borders = vec![[0_usize; 2]; count];
    let (rows, columns) = (frame.rows(), frame.columns());
    let cells = labels.cells();
    for row in 0..rows {
        for column in 0..columns {
            let index = row * columns + column;
            let Some(region) = usize::from(cells[index]).checked_sub(1) else { continue };
            let membership = free.cells()[index];
            let weight = if membership > 0.0 { f64::from(membership.min(1.0)) } else { 1.0 };
            moments[region].add(column as f64, row as f64, weight);
            for (inside, other) in [
                (column > 0, index.wrapping_sub(1)),
                (column + 1 < columns, index + 1),
                (row > 0, index.wrapping_sub(columns)),
                (row + 1 < rows, index + columns),
            ] {
                if !inside || cells[other] == 0 {
                    let open = !inside || unknown.is_some_and(|mask| mask.cells()[other]);
                    borders[region][usize::from(open)] += 1;
                }
            }
        }
    }
    let resolution = frame.resolution();
    (0..count)
        .map(|k| {
            let (center, length, width, orientation) = moments[k].rectangle();
            let (length, width) = (length * resolution, (width * resolution).max(resolution));
            let corridor = corridor(length / width, width);
            Region {
                label: u16::try_from(k + 1).unwrap_or(u16::MAX),
                name: None,
                area: moments[k].weight * resolution * resolution,
                centroid: Point2::from(frame.origin().coords + center.add_scalar(0.5) * resolution),
                length,
                width,
                orientation,
                elongation: length / width,
                corridor,
                room: 1.0 - corridor,
                frontier: borders[k][1] as f64 * resolution,
                wall: borders[k][0] as f64 * resolution,
            }
        })
        .collect()
}
