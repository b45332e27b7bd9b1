use std::collections::HashMap;

use crate::PlaceId;

/// Finds, among very many places, those whose descriptors are nearest to a given one: an exact search by Euclidean
/// distance over a coarse copy.
///
/// Every descriptor is kept twice: as it is, and with one byte per number. A query runs over the bytes only (3.2 MB for
/// 10⁵ places of 32 numbers) and looks at the exact numbers of those few that the bytes cannot rule out. With `r` the
/// greatest length of what rounding took from a descriptor (known exactly) and `r_q` that of the query, the triangle
/// inequality says
///
/// ```text
/// |d̃_i − d_i| ≤ r + r_q
/// ```
///
/// for the coarse distance `d̃_i` and the true one `d_i`, so the answer is that of a search over all exact numbers, and
/// does not depend on the order in which places came. Numbers far outside the expected range cost time, not exactness.
#[derive(Debug, Clone)]
pub struct SignatureIndex {
    dimensions: usize,
    low: f32,
    step: f32,
    places: Vec<PlaceId>,
    /// The last descriptor of each place, and the one before it of the same place.
    last: HashMap<PlaceId, usize>,
    before: Vec<Option<usize>>,
    exact: Vec<f32>,
    coarse: Vec<u8>,
    /// The greatest length of what rounding took from a descriptor.
    most_rounding: f32,
}

/// A place that a query found.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Found {
    /// The place.
    pub place: PlaceId,
    /// The Euclidean distance of its descriptor to that asked for.
    pub distance: f32,
}

/// Why the index refuses a descriptor.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum IndexError {
    /// All descriptors have the length that the index was made for.
    #[error("descriptors of this index have {expected} numbers, got {found}")]
    Length {
        /// Numbers expected.
        expected: usize,
        /// Numbers given.
        found: usize,
    },
    /// A descriptor is made of numbers.
    #[error("number {position} of a descriptor must be finite, got {value}")]
    NotFinite {
        /// Which number, from 0.
        position: usize,
        /// What it was.
        value: f32,
    },
    /// An index needs numbers in a range.
    #[error(
        "an index needs 1 to 4096 dimensions and a range of finite numbers low < high, got {dimensions} and {low}..{high}"
    )]
    Shape {
        /// Numbers per descriptor.
        dimensions: usize,
        /// Least number expected.
        low: f32,
        /// Greatest number expected.
        high: f32,
    },
}

impl SignatureIndex {
    /// An empty index for descriptors of `dimensions` numbers that mostly lie in `range`.
    ///
    /// # Errors
    ///
    /// No dimension, more than 4096, or an empty range.
    pub fn new(dimensions: usize, range: std::ops::RangeInclusive<f32>) -> Result<Self, IndexError> {
        let (low, high) = range.into_inner();
        let sound = (1..=4096).contains(&dimensions) && low < high && low.is_finite() && (high - low).is_finite();
        if !sound {
            return Err(IndexError::Shape { dimensions, low, high });
        }
        let step = (high - low) / 255.0;
        let (places, last, before) = (Vec::new(), HashMap::new(), Vec::new());
        let (exact, coarse) = (Vec::new(), Vec::new());
        Ok(Self { dimensions, low, step, places, last, before, exact, coarse, most_rounding: 0.0 })
    }

    /// How many descriptors there are.
    #[must_use]
    pub fn len(&self) -> usize {
        self.places.len()
    }

    /// Whether there is none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.places.is_empty()
    }

    /// Adds a descriptor of a place; a place may have several.
    ///
    /// # Errors
    ///
    /// A descriptor of another length, or a number that is not finite.
    pub fn insert(&mut self, place: PlaceId, descriptor: &[f32]) -> Result<(), IndexError> {
        self.check(descriptor)?;
        let (coarse, rounding) = self.rounded(descriptor);
        self.before.push(self.last.insert(place, self.places.len()));
        self.places.push(place);
        self.exact.extend_from_slice(descriptor);
        self.coarse.extend_from_slice(&coarse);
        self.most_rounding = self.most_rounding.max(rounding);
        Ok(())
    }

    /// The `count` places with the nearest descriptors among those that `admits` lets through, nearest first; ties go
    /// to the lower number. A place with several descriptors is found once, by its nearest.
    ///
    /// # Errors
    ///
    /// A descriptor of another length, or a number that is not finite.
    pub fn nearest(
        &self,
        descriptor: &[f32],
        count: usize,
        admits: impl Fn(PlaceId) -> bool,
    ) -> Result<Vec<Found>, IndexError> {
        self.check(descriptor)?;
        let mut best: Vec<Found> = Vec::with_capacity(count.min(self.len()) + 1);
        if count == 0 {
            return Ok(best);
        }
        let (coarse, rounding) = self.rounded(descriptor);
        let squares: Vec<i32> =
            self.coarse.chunks_exact(self.dimensions).map(|bytes| squared_distance(&coarse, bytes)).collect();
        // The bytes' own favourites first, so that the bound is tight from the start.
        let favourites = smallest(&squares);
        let mut ruled_out_above = i32::MAX;
        let mut consider = |index: usize, bound: &mut i32| {
            if !admits(self.places[index]) {
                return;
            }
            keep(&mut best, Found { place: self.places[index], distance: self.distance(index, descriptor) }, count);
            if best.len() == count {
                *bound = self.square_bound(best[count - 1].distance + self.most_rounding + rounding);
            }
        };
        for &index in &favourites {
            consider(index, &mut ruled_out_above);
        }
        for (index, &square) in squares.iter().enumerate() {
            if square <= ruled_out_above && !favourites.contains(&index) {
                consider(index, &mut ruled_out_above);
            }
        }
        Ok(best)
    }

    /// The same among a few places that are known, which costs what they are, however many others there be.
    ///
    /// # Errors
    ///
    /// As [`SignatureIndex::nearest`].
    pub fn nearest_among(
        &self,
        descriptor: &[f32],
        count: usize,
        places: impl IntoIterator<Item = PlaceId>,
    ) -> Result<Vec<Found>, IndexError> {
        self.check(descriptor)?;
        let mut best: Vec<Found> = Vec::new();
        for place in places.into_iter().filter(|_| count > 0) {
            let rows = std::iter::successors(self.last.get(&place).copied(), |row| self.before[*row]);
            for row in rows {
                keep(&mut best, Found { place, distance: self.distance(row, descriptor) }, count);
            }
        }
        Ok(best)
    }

    /// The greatest squared distance in bytes that a descriptor nearer than `distance` can have.
    fn square_bound(&self, distance: f32) -> i32 {
        // A hair of slack, because the bound is computed in floats.
        let steps = f64::from(distance) * 1.000_01 / f64::from(self.step) + 1e-3;
        #[expect(clippy::cast_possible_truncation, reason = "saturates, which rules nothing out")]
        let bound = (steps * steps).ceil() as i32;
        bound
    }

    fn distance(&self, index: usize, descriptor: &[f32]) -> f32 {
        let known = &self.exact[index * self.dimensions..(index + 1) * self.dimensions];
        known.iter().zip(descriptor).map(|(a, b)| (a - b) * (a - b)).sum::<f32>().sqrt()
    }

    /// A descriptor in bytes, and the length of what that takes from it.
    fn rounded(&self, descriptor: &[f32]) -> (Vec<u8>, f32) {
        let byte = |x: f32| {
            #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "clamped to a byte")]
            let byte = ((x - self.low) / self.step).round().clamp(0.0, 255.0) as u8;
            byte
        };
        let bytes: Vec<u8> = descriptor.iter().map(|&x| byte(x)).collect();
        let lost = bytes.iter().zip(descriptor).map(|(&byte, &x)| {
            let back = f64::from(self.low) + f64::from(byte) * f64::from(self.step);
            (f64::from(x) - back).powi(2)
        });
        #[expect(clippy::cast_possible_truncation, reason = "a bound that is widened where it is used")]
        let rounding = lost.sum::<f64>().sqrt() as f32;
        (bytes, rounding)
    }

    fn check(&self, descriptor: &[f32]) -> Result<(), IndexError> {
        if descriptor.len() != self.dimensions {
            return Err(IndexError::Length { expected: self.dimensions, found: descriptor.len() });
        }
        match descriptor.iter().position(|x| !x.is_finite()) {
            Some(position) => Err(IndexError::NotFinite { position, value: descriptor[position] }),
            None => Ok(()),
        }
    }
}

/// The indices of the 32 smallest numbers, smallest first.
fn smallest(numbers: &[i32]) -> Vec<usize> {
    const KEPT: usize = 32;
    let mut kept: Vec<(i32, usize)> = Vec::with_capacity(KEPT + 1);
    let mut worst = i32::MAX;
    for (index, &number) in numbers.iter().enumerate() {
        if number < worst {
            let at = kept.partition_point(|&(other, _)| other <= number);
            kept.insert(at, (number, index));
            kept.truncate(KEPT);
            worst = if kept.len() == KEPT { kept[KEPT - 1].0 } else { i32::MAX };
        }
    }
    kept.into_iter().map(|(_, index)| index).collect()
}

/// The squared distance of two byte vectors, in blocks of 16 so that it compiles to vector instructions.
fn squared_distance(a: &[u8], b: &[u8]) -> i32 {
    let square = |a: u8, b: u8| {
        let difference = i16::from(a) - i16::from(b);
        i32::from(difference) * i32::from(difference)
    };
    let (a_blocks, a_rest) = a.as_chunks::<16>();
    let (b_blocks, b_rest) = b.as_chunks::<16>();
    let mut sum = 0;
    for (a, b) in a_blocks.iter().zip(b_blocks) {
        sum += (0..16).map(|k| square(a[k], b[k])).sum::<i32>();
    }
    sum + a_rest.iter().zip(b_rest).map(|(&a, &b)| square(a, b)).sum::<i32>()
}

/// Puts `found` into the sorted list of the best, unless its place is there with a nearer descriptor already.
fn keep(best: &mut Vec<Found>, found: Found, count: usize) {
    let order = |a: &Found, b: &Found| a.distance.total_cmp(&b.distance).then(a.place.cmp(&b.place));
    if let Some(known) = best.iter().position(|other| other.place == found.place) {
        if best[known].distance <= found.distance {
            return;
        }
        best.remove(known);
    }
    let at = best.partition_point(|other| order(other, &found).is_lt());
    best.insert(at, found);
    best.truncate(count);
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    /// The search that needs no idea.
    fn brute(descriptors: &[Vec<f32>], query: &[f32], count: usize) -> Vec<Found> {
        let distance = |d: &Vec<f32>| d.iter().zip(query).map(|(a, b)| (a - b) * (a - b)).sum::<f32>().sqrt();
        let mut all: Vec<Found> =
            (0..).zip(descriptors).map(|(i, d)| Found { place: PlaceId(i), distance: distance(d) }).collect();
        all.sort_by(|a, b| a.distance.total_cmp(&b.distance).then(a.place.cmp(&b.place)));
        all.truncate(count);
        all
    }

    proptest! {
        /// Also with numbers outside the range that the bytes cover.
        #[test]
        fn the_answer_is_that_of_a_full_search(
            descriptors in prop::collection::vec(prop::collection::vec(-0.5_f32..1.5, 8), 1..200),
            query in prop::collection::vec(-0.5_f32..1.5, 8),
            count in 0_usize..12,
        ) {
            let mut index = SignatureIndex::new(8, 0.0..=1.0).unwrap();
            for (i, descriptor) in (0..).zip(&descriptors) {
                index.insert(PlaceId(i), descriptor).unwrap();
            }
            prop_assert_eq!(index.nearest(&query, count, |_| true).unwrap(), brute(&descriptors, &query, count));
            let third = |place: &PlaceId| place.0.is_multiple_of(3);
            let among = (0..300).map(PlaceId).filter(third);
            let admitted = index.nearest(&query, count, |place| third(&place)).unwrap();
            prop_assert_eq!(index.nearest_among(&query, count, among).unwrap(), admitted);
        }
    }

    #[test]
    fn a_place_with_several_views_is_found_once() {
        let mut index = SignatureIndex::new(2, 0.0..=1.0).unwrap();
        for (place, x) in [(0, 0.9), (1, 0.5), (0, 0.1), (2, 0.2)] {
            index.insert(PlaceId(place), &[x, 0.0]).unwrap();
        }
        let found = index.nearest(&[0.0, 0.0], 3, |_| true).unwrap();
        assert_eq!(found.iter().map(|f| f.place.0).collect::<Vec<_>>(), [0, 2, 1]);
        let found = index.nearest(&[0.0, 0.0], 3, |place| place != PlaceId(2)).unwrap();
        assert_eq!(found.iter().map(|f| f.place.0).collect::<Vec<_>>(), [0, 1]);
        assert_eq!(index.nearest_among(&[0.0, 0.0], 3, [PlaceId(1), PlaceId(0), PlaceId(7)]), Ok(found));
    }

    #[test]
    fn what_is_no_descriptor_is_refused() {
        let mut index = SignatureIndex::new(2, 0.0..=1.0).unwrap();
        assert_eq!(index.insert(PlaceId(0), &[1.0]), Err(IndexError::Length { expected: 2, found: 1 }));
        assert!(matches!(index.insert(PlaceId(0), &[0.0, f32::NAN]), Err(IndexError::NotFinite { position: 1, .. })));
        assert!(index.nearest(&[0.0, f32::INFINITY], 1, |_| true).is_err());
        assert_eq!(index.nearest(&[0.0, 0.0], 1, |_| true), Ok(vec![]));
        assert!(SignatureIndex::new(0, 0.0..=1.0).is_err() && SignatureIndex::new(3, 1.0..=1.0).is_err());
    }
}
