//! Residuals and their analytic Jacobians, gathered into normal equations of 3×3 blocks.
//!
//! With `d = t_j − t_i` and the error rotated into the map frame, `e' = (d − R_i t_z, wrap(θ_j − θ_i − θ_z))`, the Jacobians are
//!
//! ```text
//! ∂e'/∂x_i = [ −1  0   d_y ]      ∂e'/∂x_j = 1
//!            [  0 −1  −d_x ]
//!            [  0  0  −1   ]
//! ```
//!
//! (the last column is what turning node `i` does to the *error as measured*, rotated: not the derivative of `e'` itself), and the
//! information of the translation is rotated along: `G = R_i N R_iᵀ`, `h = R_i n` with `N`, `n` constant for each spring.

use super::PoseSpring;
use crate::block_cholesky::BlockCholesky;
use crate::pose::{Pose, wrap};
use crate::unknowns::Unknowns;

/// A spring with its information turned into the frame of its first node, once for all iterations.
#[derive(Debug, Clone, Copy)]
pub(super) struct Prepared {
    pub(super) from: usize,
    pub(super) to: usize,
    /// Measured pose.
    pub(super) z: Pose,
    /// Information of the translation in the frame of `from`: xx, xy, yy.
    n: [f64; 3],
    /// Information between translation and heading.
    m: [f64; 2],
    /// Information of the heading.
    s: f64,
}

/// Error and information of a spring in the map frame.
pub(super) struct InMap {
    /// Translation from the first to the second node.
    pub(super) d: [f64; 2],
    /// Error: x, y, heading.
    pub(super) e: [f64; 3],
    /// Information of the translation: xx, xy, yy.
    pub(super) g: [f64; 3],
    /// Information between translation and heading.
    pub(super) h: [f64; 2],
    /// Information of the heading.
    pub(super) s: f64,
}

impl Prepared {
    pub(super) fn new(spring: &PoseSpring, weight: f64) -> Self {
        let i = spring.information * weight;
        let (sin, cos) = spring.from_to.heading.sin_cos();
        Self {
            from: spring.from,
            to: spring.to,
            z: spring.from_to,
            n: rotated([i.m11, i.m12, i.m22], sin, cos),
            m: [cos * i.m13 - sin * i.m23, sin * i.m13 + cos * i.m23],
            s: i.m33,
        }
    }

    /// Information of the heading when the translation is free to follow: the weight of the turn alone.
    pub(super) fn turn_information(&self) -> f64 {
        let [xx, xy, yy] = self.n;
        let [x, y] = self.m;
        if self.s == 0.0 {
            return 0.0; // The spring has been weighted away.
        }
        self.s - (yy * x * x - 2.0 * xy * x * y + xx * y * y) / (xx * yy - xy * xy)
    }

    /// Multiplies the information of the heading; that of the translation stays.
    pub(super) fn trust_heading(&mut self, factor: f64) {
        self.m.iter_mut().for_each(|m| *m *= factor.sqrt());
        self.s *= factor;
    }

    /// Multiplies all information.
    pub(super) fn trust(&mut self, factor: f64) {
        self.n.iter_mut().for_each(|n| *n *= factor);
        self.m.iter_mut().for_each(|m| *m *= factor);
        self.s *= factor;
    }

    /// A round information of the translation that is nowhere more sure than the true one on average: the harmonic mean of its axes.
    pub(super) fn translation_information(&self) -> f64 {
        let [xx, xy, yy] = self.n;
        if xx + yy == 0.0 {
            return 0.0;
        }
        2.0 * (xx * yy - xy * xy) / (xx + yy)
    }

    #[inline(always)]
    pub(super) fn in_map(&self, from: Pose, (sin, cos): (f64, f64), to: Pose) -> InMap {
        let d = [to.x - from.x, to.y - from.y];
        InMap {
            d,
            e: [
                d[0] - (cos * self.z.x - sin * self.z.y),
                d[1] - (sin * self.z.x + cos * self.z.y),
                wrap(to.heading - from.heading - self.z.heading),
            ],
            g: rotated(self.n, sin, cos),
            h: [cos * self.m[0] - sin * self.m[1], sin * self.m[0] + cos * self.m[1]],
            s: self.s,
        }
    }
}

impl InMap {
    /// Information times error: the force of the spring (x, y) and its torque.
    #[inline(always)]
    pub(super) fn force(&self) -> [f64; 3] {
        let ([xx, xy, yy], [hx, hy], [x, y, turn]) = (self.g, self.h, self.e);
        [xx * x + xy * y + hx * turn, xy * x + yy * y + hy * turn, hx * x + hy * y + self.s * turn]
    }

    /// `eᵀ I e`.
    #[inline(always)]
    pub(super) fn chi2(&self) -> f64 {
        let f = self.force();
        f[0] * self.e[0] + f[1] * self.e[1] + f[2] * self.e[2]
    }
}

/// `R N Rᵀ` for a symmetric `N`.
#[inline(always)]
fn rotated([xx, xy, yy]: [f64; 3], sin: f64, cos: f64) -> [f64; 3] {
    let (cc, ss, cs) = (cos * cos, sin * sin, cos * sin);
    [cc * xx - 2.0 * cs * xy + ss * yy, cs * (xx - yy) + (cc - ss) * xy, ss * xx + 2.0 * cs * xy + cc * yy]
}

/// The springs of a graph, ready to be linearised anywhere.
#[derive(Debug, Clone)]
pub(super) struct System {
    pub(super) springs: Vec<Prepared>,
    pub(super) unknowns: Unknowns,
    turns: Vec<(f64, f64)>,
}

impl System {
    pub(super) fn new(springs: Vec<Prepared>, unknowns: Unknowns) -> Self {
        Self { springs, unknowns, turns: Vec::new() }
    }

    fn turn(&mut self, poses: &[Pose]) {
        self.turns.clear();
        self.turns.extend(poses.iter().map(|pose| pose.heading.sin_cos()));
    }

    /// χ² alone.
    pub(super) fn chi2(&mut self, poses: &[Pose]) -> f64 {
        self.turn(poses);
        self.springs.iter().map(|s| s.in_map(poses[s.from], self.turns[s.from], poses[s.to]).chi2()).sum()
    }

    /// Fills `matrix` with `JᵀIJ` and `right` with `−JᵀIe`, and returns χ².
    pub(super) fn linearize(&mut self, poses: &[Pose], matrix: &mut BlockCholesky, right: &mut [f64]) -> f64 {
        self.turn(poses);
        matrix.clear();
        right.fill(0.0);
        let mut chi2 = 0.0;
        for (edge, spring) in self.springs.iter().enumerate() {
            let at = spring.in_map(poses[spring.from], self.turns[spring.from], poses[spring.to]);
            chi2 += at.chi2();
            if spring.from != spring.to {
                add(&self.unknowns, matrix, right, edge, (spring.from, spring.to), &at);
            }
        }
        chi2
    }
}

#[inline(always)]
fn add(
    unknowns: &Unknowns,
    matrix: &mut BlockCholesky,
    right: &mut [f64],
    edge: usize,
    (from, to): (usize, usize),
    at: &InMap,
) {
    let ([xx, xy, yy], [hx, hy], s) = (at.g, at.h, at.s);
    let [vx, vy] = [at.d[1], -at.d[0]];
    let p = [xx * vx + xy * vy - hx, xy * vx + yy * vy - hy];
    let q = hx * vx + hy * vy - s;
    let f = at.force();
    if let Some(i) = unknowns.of(from) {
        let turn = vx * p[0] + vy * p[1] - q;
        matrix.add(unknowns.diagonal(i), &[[xx, xy, -p[0]], [xy, yy, -p[1]], [-p[0], -p[1], turn]]);
        right[3 * i] += f[0];
        right[3 * i + 1] += f[1];
        right[3 * i + 2] -= vx * f[0] + vy * f[1] - f[2];
    }
    if let Some(j) = unknowns.of(to) {
        matrix.add(unknowns.diagonal(j), &[[xx, xy, hx], [xy, yy, hy], [hx, hy, s]]);
        for k in 0..3 {
            right[3 * j + k] -= f[k];
        }
    }
    if let Some(slot) = unknowns.pair(edge) {
        matrix.add(slot, &[[-xx, -xy, -hx], [-xy, -yy, -hy], [p[0], p[1], q]]);
    }
}
