use nalgebra::{Matrix2, Vector2};

use crate::{CellClass, Signature};

/// Into which directions the surfaces of a view face: the mean of `n nᵀ` over their normals, with trace 1.
///
/// The normal of each occupied cell is the thin axis of the occupied cells within 0.35 m of it; a cell counts as far as
/// these lie along a line. In a corridor the smaller eigenvalue is near 0, and its eigenvector runs along the corridor;
/// in a room it is ¼ to ½. `None` where there is too little surface.
///
/// What no surface faces into cannot be measured by aligning two views, and a *sonar* hides that: a smooth wall echoes
/// only at the foot of the perpendicular, so that the echoes of a corridor travel along with the robot and two views of
/// it seem to be taken from one spot. An alignment's own covariance does not see this, because the echoes do agree.
#[must_use]
pub fn facing(view: &Signature) -> Option<Matrix2<f64>> {
    let (rows, columns) = (view.frame().rows(), view.frame().columns());
    let occupied = |row: usize, column: usize| {
        view.classes().get(row * columns + column).is_some_and(|c| *c == CellClass::Occupied)
    };
    let reach = NEIGHBOURHOOD / view.frame().resolution();
    let mut sum = Matrix2::zeros();
    for row in 0..rows {
        for column in (0..columns).filter(|&column| occupied(row, column)) {
            let around = around(row, column, reach, (rows, columns)).filter(|&(r, c, _)| occupied(r, c));
            sum += normal(around.map(|(_, _, off)| off));
        }
    }
    (sum.trace() >= LEAST_SURFACE).then(|| sum / sum.trace())
}

/// The covariance, in m², of what aligning `view` by its sonar echoes cannot know where it was heard from one spot, to be
/// added to the alignment's own.
#[must_use]
pub fn unseen_by_sonar(view: &Signature) -> Matrix2<f64> {
    let Some(facing) = facing(view) else { return Matrix2::identity() * UNKNOWN.powi(2) };
    let eigen = facing.symmetric_eigen();
    (0..2).fold(Matrix2::zeros(), |sum, axis| {
        let blindness = ((SEEN - eigen.eigenvalues[axis]) / (SEEN - UNSEEN)).clamp(0.0, 1.0);
        let along = eigen.eigenvectors.column(axis);
        sum + along * along.transpose() * (blindness * UNKNOWN.powi(2))
    })
}

/// Cells so near, in metres, say how the surface lies.
const NEIGHBOURHOOD: f64 = 0.35;
/// So many cells that lie along lines are needed to speak of surfaces at all.
const LEAST_SURFACE: f64 = 5.0;
/// From this share of the surface on, a direction is well seen; at the other and below, not at all. Measured on simulated
/// Polaroids: below 0.2 an alignment errs along the corridor by as much as the robot has moved, above 0.3 by 0.2 m.
const SEEN: f64 = 0.3;
const UNSEEN: f64 = 0.2;
/// The standard deviation along an axis that nothing faces into, in metres: so large that it moves nothing, however
/// often it is asked, because its error is no noise but always points back to where the robot came from.
const UNKNOWN: f64 = 10.0;

/// The cells within `reach` cells of one, each with where it lies from there, in cells.
#[expect(clippy::cast_precision_loss, clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a few cells")]
fn around(
    row: usize,
    column: usize,
    reach: f64,
    (rows, columns): (usize, usize),
) -> impl Iterator<Item = (usize, usize, Vector2<f64>)> {
    let steps = reach.floor() as usize;
    let rows = row.saturating_sub(steps)..(row + steps + 1).min(rows);
    rows.flat_map(move |r| {
        let columns = column.saturating_sub(steps)..(column + steps + 1).min(columns);
        columns.map(move |c| (r, c, Vector2::new(c as f64 - column as f64, r as f64 - row as f64)))
    })
    .filter(move |(_, _, off)| off.norm() <= reach)
}

/// `n nᵀ` of the surface through some points, weighted by how much they lie along a line; zero of too few.
fn normal(points: impl Iterator<Item = Vector2<f64>>) -> Matrix2<f64> {
    let (mut count, mut sum, mut square) = (0.0, Vector2::zeros(), Matrix2::zeros());
    for point in points {
        count += 1.0;
        sum += point;
        square += point * point.transpose();
    }
    if count < 4.0 {
        return Matrix2::zeros();
    }
    let mean = sum / count;
    let eigen = (square / count - mean * mean.transpose()).symmetric_eigen();
    let thin = eigen.eigenvalues.imin();
    let (thick, long) = (eigen.eigenvalues[thin].max(0.0), eigen.eigenvalues[1 - thin].max(1e-9));
    let normal = eigen.eigenvectors.column(thin);
    normal * normal.transpose() * (1.0 - thick / long)
}

#[cfg(test)]
mod tests {
    use nalgebra::Point2;

    use super::*;
    use crate::GridFrame;

    /// A view in which `is_wall` says where walls are.
    fn view(is_wall: impl Fn(Point2<f64>) -> bool) -> Signature {
        let frame = GridFrame::new(Point2::new(-3.2, -3.2), 0.1, 64, 64).unwrap();
        let cells = (0..64 * 64).map(|k| frame.center(k / 64, k % 64));
        let class = |at| if is_wall(at) { CellClass::Occupied } else { CellClass::Empty };
        Signature::from_classes(frame, cells.map(class).collect()).unwrap()
    }

    #[test]
    fn nothing_faces_along_a_corridor() {
        let ahead = Vector2::new(33f64.to_radians().cos(), 33f64.to_radians().sin());
        let side = Vector2::new(-ahead.y, ahead.x);
        let corridor = view(|at| (at.coords.dot(&side).abs() - 0.9).abs() < 0.1);
        let facing = facing(&corridor).unwrap();
        assert!((ahead.transpose() * facing * ahead)[0] < 0.05, "{facing}");
        let unseen = unseen_by_sonar(&corridor);
        approx::assert_relative_eq!((ahead.transpose() * unseen * ahead)[0], 100.0, epsilon = 2.0);
        assert!((side.transpose() * unseen * side)[0] < 1.0);
    }

    #[test]
    fn a_room_is_seen_both_ways_and_an_empty_view_in_none() {
        let room = view(|at| (at.x.abs().max(at.y.abs()) - 2.0).abs() < 0.1);
        assert!(facing(&room).unwrap().symmetric_eigenvalues().min() > 0.4);
        assert_eq!(unseen_by_sonar(&room), Matrix2::zeros());
        assert_eq!(facing(&view(|_| false)), None);
    }
}
