use std::f64::consts::TAU;

use nalgebra::{Point2, Vector2};

use super::{CellClass, Signature, as_f64};
use crate::raster::RayCells;

/// A signature in few numbers, to find candidates among very many places by Euclidean distance.
///
/// Both variants look at the free distance around the place in [`Descriptor::DIRECTIONS`] directions and at what
/// rings around it hold. All numbers lie in `[0, 1]`, so that distances compare.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Descriptor(pub [f32; Descriptor::LENGTH]);

impl Descriptor {
    /// How many numbers there are.
    pub const LENGTH: usize = 32;
    /// In how many directions the free distance is measured.
    pub const DIRECTIONS: usize = 64;
    const RINGS: usize = 8;

    /// The Euclidean distance of two descriptors of the same variant.
    #[must_use]
    pub fn distance(&self, other: &Self) -> f32 {
        self.0.iter().zip(&other.0).map(|(a, b)| (a - b) * (a - b)).sum::<f32>().sqrt()
    }
}

impl Signature {
    /// The descriptor for places whose headings are known: free distances in 16 sectors, and for each of 8 rings how much
    /// of it is occupied and how much is empty.
    #[must_use]
    pub fn descriptor(&self) -> Descriptor {
        let sectors = self.free_distances();
        let per_sector = Descriptor::DIRECTIONS / 16;
        let mut numbers = [0.0; Descriptor::LENGTH];
        for (number, sector) in numbers.iter_mut().zip(sectors.chunks(per_sector)) {
            *number = narrow(sector.iter().sum::<f64>() / as_f64(per_sector));
        }
        self.write_rings(&mut numbers[16..]);
        Descriptor(numbers)
    }

    /// The descriptor for places whose headings are not known: the same rings, and the magnitudes of the first 16
    /// harmonics of the free distance over direction, which no turn of the robot changes.
    #[must_use]
    pub fn turn_invariant_descriptor(&self) -> Descriptor {
        let distances = self.free_distances();
        let circle: Vec<Vector2<f64>> = (0..distances.len()).map(direction).collect();
        let mut numbers = [0.0; Descriptor::LENGTH];
        for (harmonic, number) in numbers.iter_mut().take(16).enumerate() {
            *number = narrow(magnitude(&distances, &circle, harmonic));
        }
        self.write_rings(&mut numbers[16..]);
        Descriptor(numbers)
    }

    /// How far one sees from the place in each direction, as share of half the signature's edge, at most 1.
    fn free_distances(&self) -> Vec<f64> {
        let reach = self.half_edge();
        let sight = |k: usize| {
            let mut ray = RayCells::new(&self.frame, Point2::origin(), direction(k), reach);
            let wall = ray.find(|cell| self.classes[cell.index] == CellClass::Occupied);
            wall.map_or(1.0, |cell| (cell.enter / reach).min(1.0))
        };
        (0..Descriptor::DIRECTIONS).map(sight).collect()
    }

    fn half_edge(&self) -> f64 {
        0.5 * self.frame.resolution() * as_f64(self.frame.rows().min(self.frame.columns()))
    }

    /// For each ring of equal width the share of occupied and of empty cells; square roots, so that few walls count.
    fn write_rings(&self, numbers: &mut [f32]) {
        let mut counts = [(0usize, 0usize, 0usize); Descriptor::RINGS];
        let width = self.half_edge() / as_f64(Descriptor::RINGS);
        let columns: Vec<f64> = (0..self.frame.columns()).map(|column| self.frame.center(0, column).x).collect();
        for (row, classes) in self.classes.chunks_exact(columns.len().max(1)).enumerate() {
            let y = self.frame.center(row, 0).y;
            for (x, class) in columns.iter().zip(classes) {
                #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a distance over a width")]
                let ring = ((x * x + y * y).sqrt() / width) as usize;
                let Some((occupied, empty, all)) = counts.get_mut(ring) else { continue };
                *all += 1;
                *occupied += usize::from(*class == CellClass::Occupied);
                *empty += usize::from(*class == CellClass::Empty);
            }
        }
        for (pair, (occupied, empty, all)) in numbers.chunks_mut(2).zip(counts) {
            pair[0] = narrow((as_f64(occupied) / as_f64(all.max(1))).sqrt());
            pair[1] = narrow((as_f64(empty) / as_f64(all.max(1))).sqrt());
        }
    }
}

/// The unit vector of one of the directions.
fn direction(k: usize) -> Vector2<f64> {
    let angle = TAU * as_f64(k) / as_f64(Descriptor::DIRECTIONS);
    Vector2::new(angle.cos(), angle.sin())
}

/// The magnitude of one harmonic of a periodic sequence in `[0, 1]`, at most 1; `circle` holds the directions of its numbers.
fn magnitude(sequence: &[f64], circle: &[Vector2<f64>], harmonic: usize) -> f64 {
    let n = sequence.len();
    let sum: Vector2<f64> = sequence.iter().enumerate().map(|(k, value)| circle[harmonic * k % n] * *value).sum();
    // All harmonics but the mean come in pairs.
    let pair = if harmonic == 0 { 1.0 } else { 2.0 };
    pair * sum.norm() / as_f64(n)
}

#[expect(clippy::cast_possible_truncation, reason = "a descriptor needs no more than single precision")]
fn narrow(value: f64) -> f32 {
    value as f32
}
