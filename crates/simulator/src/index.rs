use nalgebra::{Point2, Vector2};

use crate::Segment;

/// A uniform grid of buckets over segments, for rays and nearest-surface queries.
///
/// A ray visits the buckets in the order in which it crosses them (Amanatides & Woo 1987) and stops at the first one
/// that holds a hit, so that its cost depends on what is near, not on the size of the world.
#[derive(Debug, Clone)]
pub(crate) struct SegmentIndex {
    origin: Point2<f64>,
    bucket: f64,
    columns: usize,
    rows: usize,
    /// The segments of bucket `b` are `members[starts[b]..starts[b + 1]]`.
    starts: Vec<u32>,
    members: Vec<u32>,
}

/// Where a ray ends.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Hit {
    /// Metres from the ray's origin.
    pub(crate) distance: f64,
    /// The segment that was hit.
    pub(crate) segment: usize,
}

/// The edge of a bucket in metres: about the length of the pieces that walls fall into.
const BUCKET: f64 = 0.5;
/// The most buckets along an edge; worlds larger than 1 km get larger buckets.
const MOST_BUCKETS: f64 = 2000.0;

impl SegmentIndex {
    pub(crate) fn new(segments: &[Segment]) -> Self {
        let corners = || segments.iter().flat_map(|segment| [segment.from, segment.to]);
        let low = corners().fold(Point2::new(f64::MAX, f64::MAX), |low, p| low.inf(&p));
        let high = corners().fold(Point2::new(f64::MIN, f64::MIN), |high, p| high.sup(&p));
        if segments.is_empty() {
            return Self {
                origin: Point2::origin(),
                bucket: BUCKET,
                columns: 0,
                rows: 0,
                starts: vec![0],
                members: vec![],
            };
        }
        let size = high - low;
        let bucket = BUCKET.max(size.max() / MOST_BUCKETS);
        let (columns, rows) = (floor(size.x / bucket) + 1, floor(size.y / bucket) + 1);
        let mut index = Self { origin: low, bucket, columns, rows, starts: vec![], members: vec![] };
        index.fill(segments);
        index
    }

    fn fill(&mut self, segments: &[Segment]) {
        let mut buckets = vec![Vec::new(); self.columns * self.rows];
        for (number, segment) in (0u32..).zip(segments) {
            let (low, high) = (segment.from.inf(&segment.to), segment.from.sup(&segment.to));
            for (column, row) in self.buckets_of_box(low, high) {
                if self.touches(segment, column, row) {
                    buckets[row * self.columns + column].push(number);
                }
            }
        }
        self.starts.push(0);
        for bucket in buckets {
            self.members.extend(bucket);
            #[expect(clippy::cast_possible_truncation, reason = "entries are counted in u32 as the segments are")]
            self.starts.push(self.members.len() as u32);
        }
    }

    /// Whether the segment may pass through the bucket: no axis of the segment separates them.
    fn touches(&self, segment: &Segment, column: usize, row: usize) -> bool {
        #[expect(clippy::cast_precision_loss, reason = "at most a few thousand buckets")]
        let center = self.origin + Vector2::new(column as f64 + 0.5, row as f64 + 0.5) * self.bucket;
        let normal = Vector2::new(-segment.along().y, segment.along().x);
        let reach = (normal.x.abs() + normal.y.abs()) * self.bucket * 0.5 * (1.0 + 1e-9) + 1e-12;
        normal.dot(&(segment.from - center)).abs() <= reach
    }

    /// The buckets that a box overlaps, with a hair's margin.
    fn buckets_of_box(&self, low: Point2<f64>, high: Point2<f64>) -> impl Iterator<Item = (usize, usize)> + use<> {
        let first = ((low - self.origin) / self.bucket).add_scalar(-1e-9);
        let last = ((high - self.origin) / self.bucket).add_scalar(1e-9);
        let columns = floor(first.x)..if last.x < 0.0 { 0 } else { (floor(last.x) + 1).min(self.columns) };
        let rows = floor(first.y)..if last.y < 0.0 { 0 } else { (floor(last.y) + 1).min(self.rows) };
        rows.flat_map(move |row| columns.clone().map(move |column| (column, row)))
    }

    fn members_of(&self, column: usize, row: usize) -> &[u32] {
        let bucket = row * self.columns + column;
        &self.members[self.starts[bucket] as usize..self.starts[bucket + 1] as usize]
    }

    /// The numbers of all segments that may come nearer than `radius` to `point`, ascending, each once.
    pub(crate) fn near(&self, point: Point2<f64>, radius: f64) -> Vec<usize> {
        let reach = Vector2::repeat(radius);
        let boxes = self.buckets_of_box(point - reach, point + reach);
        let mut near: Vec<usize> =
            boxes.flat_map(|(column, row)| self.members_of(column, row).iter().map(|&n| n as usize)).collect();
        near.sort_unstable();
        near.dedup();
        near
    }

    /// The first segment that a ray from `origin` in the unit direction `toward` meets within `reach` metres.
    pub(crate) fn cast(
        &self,
        segments: &[Segment],
        origin: Point2<f64>,
        toward: Vector2<f64>,
        reach: f64,
    ) -> Option<Hit> {
        let mut walk = Walk::enter(self, origin, toward, reach)?;
        let mut best: Option<Hit> = None;
        loop {
            for &number in self.members_of(walk.column, walk.row) {
                if let Some(distance) = segments[number as usize].hit(origin, toward)
                    && distance <= best.map_or(reach, |hit| hit.distance)
                {
                    best = Some(Hit { distance, segment: number as usize });
                }
            }
            let leave = walk.leave();
            if best.is_some_and(|hit| hit.distance <= leave) || leave > reach || !walk.step(self) {
                return best;
            }
        }
    }
}

/// A ray on its way through the buckets.
struct Walk {
    column: usize,
    row: usize,
    /// Distance along the ray to the next border in x and in y.
    next: Vector2<f64>,
    /// Distance along the ray between two borders in x and in y.
    stride: Vector2<f64>,
    toward: Vector2<f64>,
}

impl Walk {
    /// The first bucket of the ray, or `None` if it misses them all.
    fn enter(index: &SegmentIndex, origin: Point2<f64>, toward: Vector2<f64>, reach: f64) -> Option<Self> {
        if index.columns == 0 {
            return None;
        }
        #[expect(clippy::cast_precision_loss, reason = "at most a few thousand buckets")]
        let size = Vector2::new(index.columns as f64, index.rows as f64) * index.bucket;
        let local = origin - index.origin;
        let (mut start, mut end) = (0.0f64, reach);
        for axis in 0..2 {
            if toward[axis] == 0.0 {
                if !(0.0..=size[axis]).contains(&local[axis]) {
                    return None;
                }
                continue;
            }
            let (a, b) = (-local[axis] / toward[axis], (size[axis] - local[axis]) / toward[axis]);
            (start, end) = (start.max(a.min(b)), end.min(a.max(b)));
        }
        if start > end {
            return None;
        }
        let at = (local + toward * start) / index.bucket;
        let (column, row) = (floor(at.x).min(index.columns - 1), floor(at.y).min(index.rows - 1));
        let border = |axis: usize, cell: usize| {
            #[expect(clippy::cast_precision_loss, reason = "at most a few thousand buckets")]
            let edge = (cell as f64 + if toward[axis] > 0.0 { 1.0 } else { 0.0 }) * index.bucket;
            if toward[axis] == 0.0 { f64::INFINITY } else { (edge - local[axis]) / toward[axis] }
        };
        let next = Vector2::new(border(0, column), border(1, row));
        Some(Self { column, row, next, stride: toward.map(|t| index.bucket / t.abs()), toward })
    }

    /// Distance along the ray at which it leaves this bucket.
    fn leave(&self) -> f64 {
        self.next.min()
    }

    /// Goes on to the next bucket; false when there is none.
    fn step(&mut self, index: &SegmentIndex) -> bool {
        let axis = usize::from(self.next.y < self.next.x);
        self.next[axis] += self.stride[axis];
        let (cell, count) = if axis == 0 { (&mut self.column, index.columns) } else { (&mut self.row, index.rows) };
        match if self.toward[axis] > 0.0 { cell.checked_add(1) } else { cell.checked_sub(1) } {
            Some(moved) if moved < count => {
                *cell = moved;
                true
            }
            _ => false,
        }
    }
}

/// The whole part of a number that is not negative; negative numbers give 0.
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "saturating by the language's rule")]
pub(crate) fn floor(value: f64) -> usize {
    value as usize
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Material;
    use crate::noise::Noise;

    fn heap(count: usize) -> Vec<Segment> {
        let mut noise = Noise::new(5, 0);
        let mut point = |around: Point2<f64>, spread: f64| {
            around + Vector2::new(noise.uniform(-spread, spread), noise.uniform(-spread, spread))
        };
        (0..count)
            .map(|_| {
                let from = point(Point2::new(3.0, -2.0), 10.0);
                Segment { from, to: point(from, 4.0), material: Material::Smooth }
            })
            .collect()
    }

    #[test]
    fn the_index_finds_what_a_search_through_all_segments_finds() {
        let segments = heap(60);
        let index = SegmentIndex::new(&segments);
        let mut noise = Noise::new(6, 0);
        for _ in 0..2000 {
            let origin = Point2::new(noise.uniform(-15.0, 20.0), noise.uniform(-20.0, 15.0));
            let toward = Vector2::new(noise.normal(), noise.normal()).normalize();
            let all = segments.iter().filter_map(|s| s.hit(origin, toward)).filter(|&d| d <= 12.0);
            let expected = all.min_by(f64::total_cmp);
            let found = index.cast(&segments, origin, toward, 12.0).map(|hit| hit.distance);
            assert_eq!(found, expected, "from {origin} toward {toward}");
        }
    }

    #[test]
    fn axis_parallel_rays_and_rays_from_outside_are_no_exception() {
        let segments = heap(60);
        let index = SegmentIndex::new(&segments);
        for k in 0..40 {
            let origin = Point2::new(-20.0, -12.0 + 0.5 * f64::from(k));
            let expected = segments.iter().filter_map(|s| s.hit(origin, Vector2::x())).min_by(f64::total_cmp);
            assert_eq!(index.cast(&segments, origin, Vector2::x(), 60.0).map(|hit| hit.distance), expected);
        }
    }

    #[test]
    fn near_misses_no_segment_within_the_radius() {
        let segments = heap(60);
        let index = SegmentIndex::new(&segments);
        let point = Point2::new(2.0, -1.0);
        let near = index.near(point, 3.0);
        let within = (0..segments.len()).filter(|&n| segments[n].distance(point) <= 3.0);
        assert!(within.into_iter().all(|n| near.contains(&n)));
        assert!(near.len() < segments.len());
    }

    #[test]
    fn an_empty_world_answers_nothing() {
        let index = SegmentIndex::new(&[]);
        assert_eq!(index.cast(&[], Point2::origin(), Vector2::x(), 5.0), None);
        assert!(index.near(Point2::origin(), 5.0).is_empty());
    }
}
