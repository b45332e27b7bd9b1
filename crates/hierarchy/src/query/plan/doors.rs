//! Where a way passes from one part of the map to the next.

use global_grid::plan::PlanOptions;
use nalgebra::Point2;
use region_map::{Gateway, RegionMap};
use robot_log::local_grid::{Grid, GridFrame};

use super::pieces::Pieces;

/// A cell in which two pieces meet.
#[derive(Debug, Clone, Copy)]
pub(super) struct Door {
    /// The centre of the cell.
    pub(super) point: Point2<f64>,
    /// The labels of the regions on both sides: the same one twice where a region was cut.
    pub(super) regions: [u16; 2],
    /// The gateway, if it is one.
    pub(super) gateway: Option<usize>,
}

/// A closed gateway is shut this far to both sides of its line, in metres; a door belongs to the pieces on both sides as far.
const SILL: f64 = 0.3;
/// A gateway is passed in one place in so many metres, so that ways can keep to either post.
const PASSAGE: f64 = 0.4;

/// The gateways that can be passed.
pub(super) fn gateways(unsafety: &Grid<f32>, map: &RegionMap, options: &PlanOptions) -> Vec<Door> {
    let open = map.gateways.iter().enumerate().filter(|(_, gateway)| !gateway.blocked);
    open.flat_map(|(index, gateway)| {
        let door = move |point| Door { point, regions: gateway.regions, gateway: Some(index) };
        passages(unsafety, gateway, options).into_iter().map(door)
    })
    .collect()
}

impl Door {
    /// Visits the cells that belong to both of its sides: those around it, at least its neighbours.
    pub(super) fn sill(&self, frame: GridFrame, visit: impl FnMut(usize, usize, Point2<f64>)) {
        around(frame, self.point, sill(&frame), visit);
    }

    /// The pieces that it joins.
    pub(super) fn pieces(&self, map: &RegionMap, pieces: &Pieces) -> Vec<usize> {
        let mut joined = Vec::new();
        self.sill(*map.labels.frame(), |row, column, _| {
            let label = map.labels.get(row, column).copied().unwrap_or_default();
            if self.regions.contains(&label) {
                joined.push(pieces.at(label, row, column));
            }
        });
        joined.sort_unstable();
        joined.dedup();
        joined
    }
}

fn sill(frame: &GridFrame) -> f64 {
    SILL.max(1.5 * frame.resolution())
}

/// How many cells beyond a piece its doors may reach.
pub(super) fn reach(frame: &GridFrame) -> usize {
    2 * cells(sill(frame), frame.resolution())
}

/// Where a gateway is passed: the safest cell of each stretch of it, nearest to the middle; none where nobody can pass.
fn passages(unsafety: &Grid<f32>, gateway: &Gateway, options: &PlanOptions) -> Vec<Point2<f64>> {
    let frame = unsafety.frame();
    let risk = |point: &Point2<f64>| unsafety.at(*point).copied().map_or(f64::INFINITY, f64::from);
    let points: Vec<Point2<f64>> = along(gateway, frame.resolution()).collect();
    let longest = 4 * cells(PASSAGE, frame.resolution()); // a quarter of a cell apart
    let open = points.split(|point| risk(point) > options.forbidden);
    let best = safest_of_stretches(open, longest, risk).into_iter().filter_map(|point| frame.cell_at(point));
    let mut best: Vec<(usize, usize)> = best.collect();
    best.dedup();
    best.into_iter().map(|(row, column)| frame.center(row, column)).collect()
}

/// The safest one, and nearest to the middle, of each stretch; runs are cut into equal stretches of at most so many.
pub(super) fn safest_of_stretches<'a, T: Copy + 'a>(
    runs: impl Iterator<Item = &'a [T]>,
    longest: usize,
    risk: impl Fn(&T) -> f64,
) -> Vec<T> {
    let cut = |run: &'a [T]| run.chunks(run.len().div_ceil(run.len().div_ceil(longest)));
    let best = |stretch: &'a [T]| {
        let aside = |k: usize| (2 * k + 1).abs_diff(stretch.len());
        let safest =
            |(k, a): &(usize, &T), (l, b): &(usize, &T)| risk(a).total_cmp(&risk(b)).then(aside(*k).cmp(&aside(*l)));
        stretch.iter().enumerate().min_by(safest).map(|(_, at)| *at)
    };
    runs.filter(|run| !run.is_empty()).flat_map(cut).filter_map(best).collect()
}

/// Makes a gateway impassable.
pub(super) fn shut(unsafety: &mut Grid<f32>, gateway: &Gateway) {
    let frame = *unsafety.frame();
    for point in along(gateway, frame.resolution()) {
        around(frame, point, (0.5 * SILL).max(frame.resolution()), |row, column, _| {
            if let Some(cell) = unsafety.get_mut(row, column) {
                *cell = 1.0;
            }
        });
    }
}

/// Points along a gateway, a quarter of a cell apart.
fn along(gateway: &Gateway, resolution: f64) -> impl Iterator<Item = Point2<f64>> {
    let [a, b] = gateway.ends;
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "positive, and saturating")]
    let steps = ((b - a).norm() / resolution * 4.0).ceil().max(1.0) as u32;
    (0..=steps).map(move |step| a + (b - a) * (f64::from(step) / f64::from(steps)))
}

/// Visits the cells whose centres are within `reach` of a point.
fn around(frame: GridFrame, point: Point2<f64>, reach: f64, mut visit: impl FnMut(usize, usize, Point2<f64>)) {
    let Some((row, column)) = frame.cell_at(point) else { return };
    let cells = cells(reach, frame.resolution());
    for row in row.saturating_sub(cells)..(row + cells + 1).min(frame.rows()) {
        for column in column.saturating_sub(cells)..(column + cells + 1).min(frame.columns()) {
            let center = frame.center(row, column);
            if (center - point).norm() <= reach {
                visit(row, column, center);
            }
        }
    }
}

/// So many cells are at least this long.
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "positive, and saturating")]
pub(super) fn cells(length: f64, resolution: f64) -> usize {
    (length / resolution).ceil() as usize
}
