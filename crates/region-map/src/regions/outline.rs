//! The outlines of regions as polygons.

use std::collections::BTreeMap;

use local_grid::{
    GridFrame,
    nalgebra::{Isometry2, Point2},
};

use crate::RegionMap;

/// The outline of a region: one polygon for each part of it, usually one.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Outline {
    /// The polygons.
    pub parts: Vec<Polygon>,
}

/// A polygon with holes; rings are closed without repeating their first corner.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Polygon {
    /// Counter-clockwise, in metres.
    pub outer: Vec<Point2<f64>>,
    /// Clockwise: what lies in the region and does not belong to it.
    pub holes: Vec<Vec<Point2<f64>>>,
}

impl Polygon {
    /// The polygon in another frame.
    #[must_use]
    pub fn moved(&self, other_from_this: &Isometry2<f64>) -> Self {
        let ring = |ring: &Vec<Point2<f64>>| ring.iter().map(|corner| other_from_this * corner).collect();
        Self { outer: ring(&self.outer), holes: self.holes.iter().map(ring).collect() }
    }
}

/// Outlines may lie this many cells off the edges of cells, the diagonal of one: the stairs of slanting walls become straight.
const TOLERANCE: f64 = 1.42;

/// A corner of cells: row, column.
type Corner = (i32, i32);

impl RegionMap {
    /// The outlines of all regions, in the order of [`RegionMap::regions`].
    ///
    /// Traced along the edges of cells and simplified (Douglas & Peucker 1973) to within the diagonal of a cell.
    #[must_use]
    pub fn outlines(&self) -> Vec<Outline> {
        edges(self).into_iter().map(|edges| outline(edges, self.labels.frame())).collect()
    }
}

/// For every region the edges of cells between it and the rest, the region on their left, by where they begin.
#[expect(clippy::cast_possible_truncation, clippy::cast_possible_wrap, reason = "grids have fewer than 2^31 rows")]
fn edges(map: &RegionMap) -> Vec<BTreeMap<Corner, Vec<Corner>>> {
    let frame = map.labels.frame();
    let (rows, columns) = (frame.rows(), frame.columns());
    let cells = map.labels.cells();
    let mut edges = vec![BTreeMap::<Corner, Vec<Corner>>::new(); map.regions.len()];
    for row in 0..rows {
        for column in 0..columns {
            let index = row * columns + column;
            let label = cells[index];
            let Some(mine) = usize::from(label).checked_sub(1).and_then(|k| edges.get_mut(k)) else { continue };
            let (r, c) = (row as i32, column as i32);
            let mut edge = |open: bool, from: Corner, to: Corner| {
                if open {
                    mine.entry(from).or_default().push(to);
                }
            };
            edge(row == 0 || cells[index - columns] != label, (r, c), (r, c + 1));
            edge(column + 1 == columns || cells[index + 1] != label, (r, c + 1), (r + 1, c + 1));
            edge(row + 1 == rows || cells[index + columns] != label, (r + 1, c + 1), (r + 1, c));
            edge(column == 0 || cells[index - 1] != label, (r + 1, c), (r, c));
        }
    }
    edges
}

/// Links edges into rings, and rings into polygons.
fn outline(mut edges: BTreeMap<Corner, Vec<Corner>>, frame: &GridFrame) -> Outline {
    let mut outers: Vec<(Vec<Corner>, Vec<Vec<Corner>>)> = Vec::new();
    let mut holes = Vec::new();
    while let Some((&start, _)) = edges.first_key_value() {
        let ring = ring(&mut edges, start);
        if twice_area(&ring) > 0 {
            outers.push((ring, Vec::new()));
        } else {
            holes.push(ring);
        }
    }
    for hole in holes {
        let home = outers.iter().position(|(outer, _)| encloses(outer, hole[0])).unwrap_or(0);
        if let Some((_, mine)) = outers.get_mut(home) {
            mine.push(hole);
        }
    }
    let metres = |ring: &Vec<Corner>| -> Vec<Point2<f64>> {
        let place = |&(row, column): &Corner| {
            let origin = frame.origin();
            let step = frame.resolution();
            Point2::new(origin.x + f64::from(column) * step, origin.y + f64::from(row) * step)
        };
        simplify(ring).iter().map(place).collect()
    };
    let parts = outers
        .iter()
        .map(|(outer, holes)| Polygon { outer: metres(outer), holes: holes.iter().map(metres).collect() })
        .collect();
    Outline { parts }
}

/// Takes one ring out of the edges. Where two cells touch at a corner only, the ring stays with the cell it came along.
fn ring(edges: &mut BTreeMap<Corner, Vec<Corner>>, start: Corner) -> Vec<Corner> {
    let mut ring = Vec::new();
    let (mut at, mut came) = (start, (0, 0));
    while let Some(ends) = edges.get_mut(&at) {
        let turn = |to: &Corner| came.0 * (to.1 - at.1) - came.1 * (to.0 - at.0);
        // In (row, column) a left turn has a negative cross product.
        let next = (0..ends.len()).min_by_key(|&k| turn(&ends[k])).unwrap_or(0);
        let to = ends.swap_remove(next);
        if ends.is_empty() {
            edges.remove(&at);
        }
        ring.push(at);
        came = (to.0 - at.0, to.1 - at.1);
        at = to;
        if at == start {
            break;
        }
    }
    ring
}

/// Twice the area inside, positive counter-clockwise (columns are x, rows are y).
fn twice_area(ring: &[Corner]) -> i64 {
    let next = ring.iter().cycle().skip(1);
    ring.iter().zip(next).map(|(a, b)| i64::from(a.1) * i64::from(b.0) - i64::from(b.1) * i64::from(a.0)).sum()
}

/// Whether the cell above and right of a corner lies within a ring (even-odd rule along its row).
fn encloses(ring: &[Corner], point: Corner) -> bool {
    let next = ring.iter().cycle().skip(1);
    let crossings = ring
        .iter()
        .zip(next)
        .filter(|(a, b)| a.1 == b.1 && a.1 <= point.1 && a.0.min(b.0) <= point.0 && point.0 < a.0.max(b.0));
    crossings.count() % 2 == 1
}

/// Leaves out corners that lie within the tolerance of the line between those that stay.
fn simplify(ring: &[Corner]) -> Vec<Corner> {
    let Some(&first) = ring.first() else { return Vec::new() };
    let squared = |a: Corner, b: Corner| i64::from(a.0 - b.0).pow(2) + i64::from(a.1 - b.1).pow(2);
    // From a corner that surely stays: the one farthest from anywhere.
    let far = |from: Corner| (0..ring.len()).max_by_key(|&k| squared(from, ring[k])).unwrap_or(0);
    let start = far(first);
    let turned: Vec<Corner> = ring[start..].iter().chain(&ring[..=start]).copied().collect();
    let middle = (0..turned.len()).max_by_key(|&k| squared(turned[0], turned[k])).unwrap_or(0);
    let mut keep = vec![false; turned.len()];
    keep[0] = true;
    keep[middle] = true;
    let mut spans = vec![(0, middle), (middle, turned.len() - 1)];
    while let Some((from, to)) = spans.pop() {
        let off = |k: usize| distance(turned[k], turned[from], turned[to]);
        let Some(farthest) = (from + 1..to).max_by(|&a, &b| off(a).total_cmp(&off(b))) else { continue };
        if off(farthest) > TOLERANCE {
            keep[farthest] = true;
            spans.extend([(from, farthest), (farthest, to)]);
        }
    }
    let corners = turned.iter().zip(&keep).take(turned.len() - 1);
    let simple: Vec<Corner> = corners.filter(|(_, keep)| **keep).map(|(corner, _)| *corner).collect();
    // What is hardly larger than a cell would become a line.
    if simple.len() < 3 { ring.to_vec() } else { simple }
}

/// Distance of a point from the line through two others, or from the first where they are one.
fn distance(p: Corner, a: Corner, b: Corner) -> f64 {
    let to = |q: Corner| (f64::from(q.0 - a.0), f64::from(q.1 - a.1));
    let ((pr, pc), (br, bc)) = (to(p), to(b));
    let length = br.hypot(bc);
    if length > 0.0 { (pr * bc - pc * br).abs() / length } else { pr.hypot(pc) }
}
