//! How two maps of one building lie over each other.

use std::f64::consts::PI;

use local_grid::nalgebra::{Isometry2, Point2, Translation2, Vector2};

use crate::RegionMap;

/// Points of the floor are taken on a lattice of so many metres: half a door.
const LATTICE: f64 = 0.4;
/// First steps of the search, in metres and radians, and how many of them to each side.
const STEP: (f64, f64) = (0.6, PI / 40.0);
const REACH: i32 = 5;
/// Halvings of the steps: down to a few centimetres.
const HALVINGS: i32 = 4;
/// By so much of its floor another turn must fit better than none at all: a corridor fits the other way round, too.
const TURNED: f64 = 0.05;

/// Where a new map lies in an old one of the same building: the motion that takes points of the new map to the old one,
/// found by how much floor then lies on floor. `None` if either has none.
///
/// Two robots, or one on two days, need not begin on one spot, nor with one idea of north. All turns are tried about the
/// middle of the floor, with frames as they are and with the middles laid over each other; then the best is made finer step
/// by step. Maps that share less than about half of their floor are not told apart from others.
#[must_use]
pub fn lay_over(old: &RegionMap, new: &RegionMap) -> Option<Isometry2<f64>> {
    let (points, there) = (floor(new), floor(old));
    let middle = middle(&points)?;
    let onto = self::middle(&there)? - middle;
    let search = Search { old, points: &points, middle };
    #[expect(clippy::cast_possible_truncation, reason = "some eighty turns")]
    let round = (PI / STEP.1).round() as i32;
    let unturned = [Vector2::zeros(), onto].map(|shift| search.best(Shift { along: shift, turn: 0.0 }, 1));
    let steps = (-round..round).map(|k| f64::from(k) * STEP.1);
    let turned = steps.flat_map(|turn| [Vector2::zeros(), onto].map(|along| search.best(Shift { along, turn }, 0)));
    let better = |a: (f64, Shift), b: (f64, Shift)| if b.0 > a.0 { b } else { a };
    let unturned = unturned.into_iter().reduce(better)?;
    let turned = turned.reduce(better)?;
    let first = if turned.0 > unturned.0 + TURNED { turned } else { unturned };
    let finest = (1..=HALVINGS).fold(first.1, |best, halving| search.finer(best, 0.5_f64.powi(halving)));
    Some(search.motion(finest))
}

/// A turn about the middle of the new floor, and a shift.
#[derive(Debug, Clone, Copy)]
struct Shift {
    along: Vector2<f64>,
    turn: f64,
}

struct Search<'a> {
    old: &'a RegionMap,
    points: &'a [Point2<f64>],
    middle: Point2<f64>,
}

impl Search<'_> {
    fn motion(&self, shift: Shift) -> Isometry2<f64> {
        let back = Translation2::from(-self.middle.coords);
        Isometry2::new(self.middle.coords + shift.along, shift.turn) * back
    }

    /// The share of the new floor that lies on old floor.
    fn share(&self, shift: Shift) -> f64 {
        let motion = self.motion(shift);
        let on_floor = |point: &&Point2<f64>| self.old.labels.at(motion * **point).is_some_and(|label| *label > 0);
        count(self.points.iter().filter(on_floor).count()) / count(self.points.len()).max(1.0)
    }

    /// The best of the shifts around one, and of the turns beside it.
    fn best(&self, around: Shift, turns: i32) -> (f64, Shift) {
        self.among(around, STEP, REACH, turns)
    }

    fn finer(&self, around: Shift, scale: f64) -> Shift {
        self.among(around, (STEP.0 * scale, STEP.1 * scale), 1, 1).1
    }

    /// Of equals the first, and the middle comes first.
    fn among(&self, around: Shift, (step, turn): (f64, f64), reach: i32, turns: i32) -> (f64, Shift) {
        let mut best = (self.share(around), around);
        for rotation in -turns..=turns {
            for (row, column) in (-reach..=reach).flat_map(|row| (-reach..=reach).map(move |column| (row, column))) {
                let along = around.along + Vector2::new(f64::from(column), f64::from(row)) * step;
                let shift = Shift { along, turn: around.turn + f64::from(rotation) * turn };
                let share = self.share(shift);
                if share > best.0 {
                    best = (share, shift);
                }
            }
        }
        best
    }
}

/// Points of the floor of all regions.
fn floor(map: &RegionMap) -> Vec<Point2<f64>> {
    let frame = map.labels.frame();
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "positive, and saturating")]
    let stride = (LATTICE / frame.resolution()).round().max(1.0) as usize;
    let rows = (0..frame.rows()).step_by(stride);
    let cells = rows.flat_map(|row| (0..frame.columns()).step_by(stride).map(move |column| (row, column)));
    let is_floor = |(row, column): &(usize, usize)| map.labels.get(*row, *column).is_some_and(|label| *label > 0);
    cells.filter(is_floor).map(|(row, column)| frame.center(row, column)).collect()
}

fn middle(points: &[Point2<f64>]) -> Option<Point2<f64>> {
    let sum: Vector2<f64> = points.iter().map(|point| point.coords).sum();
    (!points.is_empty()).then(|| Point2::from(sum / count(points.len())))
}

#[expect(clippy::cast_precision_loss, reason = "points of a map are far fewer than 2^52")]
fn count(points: usize) -> f64 {
    points as f64
}
