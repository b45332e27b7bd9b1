use nalgebra::{Isometry2, Matrix2, Matrix3, Point2, Vector2, Vector3};

use super::{Echo, Match, MatchOptions, Prior, judge};
use crate::align::axis;
use crate::{Ambiguity, Heading, LocalMap};

/// The normal equations of one step.
#[derive(Debug, Clone, Copy)]
struct Normal {
    hessian: Matrix3<f64>,
    gradient: Vector3<f64>,
    cost: f64,
    weight: f64,
}

/// A product beyond this might overflow with the next factor.
const LARGE: f64 = 1e250;

/// Slides a scan into the map by Gauss-Newton on the distances from its echoes to the nearest walls.
///
/// Minimises, with a Cauchy kernel of scale `c` and the prior's information `P`,
///
/// ```text
/// Σ_i c²/(2 σ² m) ln(1 + d(T e_i)²/c²) + ½ (T ⊖ T_prior)ᵀ P (T ⊖ T_prior)
/// ```
///
/// where `m` echoes count as one measurement of standard deviation `σ`. The start must lie within the field's reach of
/// the truth, in position and at the echoes in heading.
#[must_use]
pub fn refine(map: &LocalMap, echoes: &[Echo], prior: &Prior, options: &MatchOptions) -> Match {
    let mut pose = pose_vector(&prior.map_from_robot);
    let mut walls = walls_only(map, echoes, &pose, options);
    let prior = &where_needed(&walls, prior, options);
    let mut normal = walls.held_by(prior, &pose);
    for _ in 0..options.max_steps {
        let damped =
            normal.hessian + Matrix3::from_diagonal(&(normal.hessian.diagonal() * 1e-6)) + Matrix3::identity() * 1e-6;
        let Some(step) = damped.cholesky().map(|factor| -factor.solve(&normal.gradient)) else { break };
        let step = shortened(step, map.options().max_distance);
        let Some((next, found)) = descend(map, echoes, &pose, &step, &normal, prior, options) else { break };
        let better = found.held_by(prior, &next);
        let (moved, gain) = (next - pose, normal.cost - better.cost);
        (pose, walls, normal) = (next, found, better);
        if (moved.xy().norm() < 2e-4 && moved.z.abs() < 1e-4) || gain < 1e-4 * normal.cost {
            break;
        }
    }
    finish(map, echoes, &pose, &walls, options)
}

/// The prior with its full weight only along axes of which the walls say nothing.
///
/// Elsewhere it would not add knowledge but its bias: odometry errs the same way again and again, and every scan would
/// give in to it a little. What is left of it there keeps the equations regular.
fn where_needed(walls: &Normal, prior: &Prior, options: &MatchOptions) -> Prior {
    let block: Matrix2<f64> = walls.hessian.fixed_view::<2, 2>(0, 0).into();
    let eigen = block.symmetric_eigen();
    let weights = eigen.eigenvalues.map(|value| {
        let vague = value < options.ambiguous_below * walls.weight || walls.weight == 0.0;
        if vague { 1.0 } else { options.prior_share.sqrt() }
    });
    let scale = eigen.eigenvectors * Matrix2::from_diagonal(&weights) * eigen.eigenvectors.transpose();
    let mut keep = Matrix3::from_diagonal_element(options.prior_share.sqrt());
    keep.fixed_view_mut::<2, 2>(0, 0).copy_from(&scale);
    Prior { map_from_robot: prior.map_from_robot, information: keep * prior.information * keep }
}

/// A step no longer than the field reaches, and no turn beyond what its linearisation bears.
fn shortened(step: Vector3<f64>, reach: f64) -> Vector3<f64> {
    let excess = (step.xy().norm() / reach).max(step.z.abs() / 0.3).max(1.0);
    step / excess
}

/// The pose after a step, shortened until the cost falls, and what the walls say there.
fn descend(
    map: &LocalMap,
    echoes: &[Echo],
    pose: &Vector3<f64>,
    step: &Vector3<f64>,
    normal: &Normal,
    prior: &Prior,
    options: &MatchOptions,
) -> Option<(Vector3<f64>, Normal)> {
    let mut share = 1.0;
    for _ in 0..4 {
        let next = pose + step * share;
        let walls = walls_only(map, echoes, &next, options);
        if walls.held_by(prior, &next).cost <= normal.cost {
            return Some((next, walls));
        }
        share *= 0.4;
    }
    None
}

fn pose_vector(pose: &Isometry2<f64>) -> Vector3<f64> {
    pose.translation.vector.push(pose.rotation.angle())
}

fn isometry(pose: &Vector3<f64>) -> Isometry2<f64> {
    Isometry2::new(pose.xy(), pose.z)
}

impl Normal {
    /// The same equations with those of a prior.
    fn held_by(&self, prior: &Prior, pose: &Vector3<f64>) -> Self {
        let guess = pose_vector(&prior.map_from_robot);
        let turned = Heading::from_radians(pose.z) - Heading::from_radians(guess.z);
        let off = (pose.xy() - guess.xy()).push(turned);
        let pull = prior.information * off;
        Self {
            hessian: self.hessian + prior.information,
            gradient: self.gradient + pull,
            cost: self.cost + 0.5 * off.dot(&pull),
            weight: self.weight,
        }
    }
}

/// The equations of the walls alone.
fn walls_only(map: &LocalMap, echoes: &[Echo], pose: &Vector3<f64>, options: &MatchOptions) -> Normal {
    let per_echo = 1.0 / (options.echo_sigma.powi(2) * options.echoes_per_measurement);
    let (sin, cos) = pose.z.sin_cos();
    let (far, square_kernel) = (map.options().max_distance, options.kernel.powi(2));
    let mut normal = Normal { hessian: Matrix3::zeros(), gradient: Vector3::zeros(), cost: 0.0, weight: 0.0 };
    // Σ ln(1 + s) = ln Π (1 + s): one logarithm for as many echoes as a number can hold.
    let (mut product, mut logarithms) = (1.0f64, 0.0);
    let h = &mut normal.hessian;
    for echo in echoes {
        let turned = |v: Vector2<f64>| Vector2::new(cos * v.x - sin * v.y, sin * v.x + cos * v.y);
        let arm = turned(echo.point.coords);
        let (distance, slope) = map.distance(Point2::from(pose.xy() + arm));
        let (distance, slope) = match echo.normal {
            Some(normal) if distance < far => across(distance, slope, turned(normal)),
            _ => (distance, slope),
        };
        let share = distance * distance / square_kernel;
        product *= 1.0 + share;
        if product > LARGE {
            logarithms += std::mem::replace(&mut product, 1.0).ln();
        }
        if distance >= far {
            continue; // flat: no wall in reach
        }
        let weight = per_echo / (1.0 + share); // Cauchy
        let row = Vector3::new(slope.x, slope.y, arm.perp(&slope));
        let scaled = row * weight;
        h[(0, 0)] += scaled.x * row.x;
        h[(0, 1)] += scaled.x * row.y;
        h[(0, 2)] += scaled.x * row.z;
        h[(1, 1)] += scaled.y * row.y;
        h[(1, 2)] += scaled.y * row.z;
        h[(2, 2)] += scaled.z * row.z;
        normal.gradient += scaled * distance;
        normal.weight += weight;
    }
    normal.cost = 0.5 * per_echo * square_kernel * (logarithms + product.ln());
    h[(1, 0)] = h[(0, 1)];
    h[(2, 0)] = h[(0, 2)];
    h[(2, 1)] = h[(1, 2)];
    normal
}

/// The part of a distance and its slope that lies along the surface's normal.
fn across(distance: f64, slope: Vector2<f64>, normal: Vector2<f64>) -> (f64, Vector2<f64>) {
    let steepness = slope.norm();
    if steepness < 1e-9 {
        return (distance, slope);
    }
    let along_normal = slope.dot(&normal);
    (distance * (along_normal / steepness).abs(), normal * along_normal)
}

fn finish(map: &LocalMap, echoes: &[Echo], pose: &Vector3<f64>, walls: &Normal, options: &MatchOptions) -> Match {
    let map_from_robot = isometry(pose);
    let fit = judge(map, echoes, &map_from_robot, options);
    let (covariance, ambiguity) = spread(walls, map.options().max_distance, options);
    Match {
        map_from_robot,
        covariance,
        score: fit.score,
        inliers: fit.inliers,
        contradiction: fit.contradiction,
        overlap: fit.overlap,
        ambiguity,
    }
}

/// The covariance of a solution; along axes of which the walls say nothing, that of ignorance.
fn spread(normal: &Normal, reach: f64, options: &MatchOptions) -> (Matrix3<f64>, Ambiguity) {
    let ignorance = reach * reach / 3.0;
    let block: Matrix2<f64> = normal.hessian.fixed_view::<2, 2>(0, 0).into();
    let eigen = block.symmetric_eigen();
    let floor = (options.ambiguous_below * normal.weight).max(1.0 / ignorance);
    let vague = eigen.eigenvalues.map(|value| value < floor);
    // Heading keeps what it has; the block is rebuilt with the vague axes cut off from all else.
    let mut information = normal.hessian;
    information[(2, 2)] = information[(2, 2)].max(1.0); // never worse than a radian
    let mut ambiguity = Ambiguity::None;
    for k in 0..2 {
        if !vague[k] {
            continue;
        }
        let direction: Vector2<f64> = eigen.eigenvectors.column(k).into();
        let along = direction.push(0.0);
        let keep = Matrix3::identity() - along * along.transpose();
        information = keep * information * keep + along * along.transpose() / ignorance;
        ambiguity =
            if ambiguity == Ambiguity::None { Ambiguity::Along(axis(direction)) } else { Ambiguity::Everywhere };
    }
    let covariance = information.try_inverse().filter(|inverse| inverse.iter().all(|x| x.is_finite()));
    (covariance.unwrap_or_else(|| Matrix3::from_diagonal(&[ignorance, ignorance, 1.0].into())), ambiguity)
}
