//! Pairwise consistency maximisation (Mangelson, Dominic, Eustice & Vasudevan 2018): the largest set of closures of which every two agree.
//!
//! Two closures `a → b` and `c → d` and the odometry between their ends make a cycle, which must close within the uncertainty of its four
//! parts. Odometry's covariance between any two nodes is the difference of two sums kept in the map frame, so a cycle costs a few hundred operations.
//!
//! First-order covariances say little of a cycle whose odometry is uncertain by more than about a radian; there the test passes more than it should,
//! which is why the set is a beginning for graduated non-convexity and not the last word.

use nalgebra::{Matrix3, Vector3};

use crate::headings::{Forest, Joint};
use crate::pose::{Pose, wrap};
use crate::pose_graph::{PoseGraph, PoseSpring};

/// So many seeds for growing a set are tried.
const SEEDS: usize = 64;

/// The largest set found among `closures` (spring numbers) of which every two agree within `bound` (99 % of true pairs: 11.345), sorted.
///
/// The others of the `trusted` springs carry dead reckoning. Closures that join parts without trusted springs between them
/// cannot be checked and are left out. The search is greedy from many seeds: it finds a large set, not provably the largest.
///
/// # Panics
/// When there is not one flag of trust for each spring, or a closure that is not a spring.
#[must_use]
pub fn consistent_closures(graph: &PoseGraph, trusted: &[bool], closures: &[usize], bound: f64) -> Vec<usize> {
    let springs = graph.springs();
    assert_eq!(trusted.len(), springs.len(), "one flag of trust for each spring");
    let joints: Vec<Joint> = springs.iter().map(|s| Joint::new(s.from, s.to)).collect();
    let forest = Forest::only(graph.len(), &joints, |edge| trusted[edge]);
    let odometry = Odometry::new(graph, &forest);
    let checked = checkable(springs, closures, &forest);
    let ready: Vec<Closure> = checked.iter().map(|&k| Closure::new(&springs[k], &odometry)).collect();
    let agree = |i: usize, j: usize| {
        let (a, b) = (&ready[i], &ready[j]);
        forest.root_of(a.from) != forest.root_of(b.from) || odometry.cycle(a, b) <= bound
    };
    let alone: Vec<bool> = ready.iter().map(|closure| odometry.own_cycle(closure) <= bound).collect();
    let graph = Agreement::new(ready.len(), |i, j| alone[i] && alone[j] && agree(i, j));
    let mut chosen: Vec<usize> = graph.largest_set().into_iter().filter(|k| alone[*k]).map(|k| checked[k]).collect();
    chosen.sort_unstable();
    chosen
}

/// The closures whose ends trusted springs join: only those close a cycle that can be checked.
fn checkable(springs: &[PoseSpring], closures: &[usize], forest: &Forest) -> Vec<usize> {
    let joined = |&k: &usize| forest.root_of(springs[k].from) == forest.root_of(springs[k].to);
    closures.iter().copied().filter(joined).collect()
}

/// The closures that are supported: each agrees with another one nearby, more closely than two unrelated closures would by chance.
///
/// Every pair whose cycle is certain enough to tell is weighed by the ratio of two likelihoods: that the cycle's error is noise, against
/// that it is anything within the reach of the closures (`reach`: area of their translations times a full turn). Pairs far apart,
/// where dead reckoning knows nothing, say nothing.
pub(super) fn supported_closures(graph: &PoseGraph, trusted: &[bool], closures: &[usize], bound: f64) -> Vec<usize> {
    let springs = graph.springs();
    let joints: Vec<Joint> = springs.iter().map(|s| Joint::new(s.from, s.to)).collect();
    let forest = Forest::only(graph.len(), &joints, |edge| trusted[edge]);
    let odometry = Odometry::new(graph, &forest);
    let checked = checkable(springs, closures, &forest);
    let ready: Vec<Closure> = checked.iter().map(|&k| Closure::new(&springs[k], &odometry)).collect();
    let square = ready.iter().map(|c| c.z.translation().norm_squared()).sum::<f64>() / ready.len().max(1) as f64;
    let reach = std::f64::consts::TAU * std::f64::consts::TAU * square;
    let mut support = vec![0.0f64; ready.len()];
    for i in 0..ready.len() {
        for j in 0..i {
            let (a, b) = (&ready[i], &ready[j]);
            let apart = odometry.steps_between(a.from, b.from).max(odometry.steps_between(a.to, b.to));
            if apart > NEAR || forest.root_of(a.from) != forest.root_of(b.from) {
                continue;
            }
            let (e2, covariance) = odometry.cycle_with_covariance(a, b);
            let noise = (std::f64::consts::TAU.powi(3) * covariance.determinant()).sqrt() * (0.5 * e2).exp();
            if e2 <= bound && noise > 0.0 {
                let ratio = reach / noise;
                support[i] = support[i].max(ratio);
                support[j] = support[j].max(ratio);
            }
        }
    }
    (0..ready.len()).filter(|&k| support[k] > ENOUGH).map(|k| checked[k]).collect()
}

/// Steps of dead reckoning between the ends of two closures that can support each other.
const NEAR: u32 = 25;
/// A likelihood ratio that counts as support: "strong evidence" in Jeffreys' words.
const ENOUGH: f64 = 20.0;

/// A closure with its covariance turned into the map frame at both of its ends.
struct Closure {
    from: usize,
    to: usize,
    z: Pose,
    covariance: Matrix3<f64>,
}

impl Closure {
    fn new(spring: &PoseSpring, odometry: &Odometry) -> Self {
        // Always forward in time: two closures are then on the same side.
        let (from, to) = (spring.from, spring.to);
        let covariance = spring.information.try_inverse().unwrap_or(Matrix3::identity() * f64::MAX.sqrt());
        if odometry.depth[from] <= odometry.depth[to] {
            return Self { from, to, z: spring.from_to, covariance };
        }
        let turned = adjoint(spring.from_to);
        Self { from: to, to: from, z: spring.from_to.inverse(), covariance: turned * covariance * turned.transpose() }
    }
}

/// Dead reckoning with covariance.
struct Odometry {
    poses: Vec<Pose>,
    /// Sum of the covariances of the steps from the root, each moved to the origin of the map frame.
    sums: Vec<Matrix3<f64>>,
    depth: Vec<u32>,
    /// Ancestors 1, 2, 4, … steps up.
    up: Vec<Vec<u32>>,
}

impl Odometry {
    fn new(graph: &PoseGraph, forest: &Forest) -> Self {
        let nodes = graph.len();
        let mut this = Self {
            poses: vec![Pose::default(); nodes],
            sums: vec![Matrix3::zeros(); nodes],
            depth: vec![0; nodes],
            up: vec![],
        };
        let mut parent: Vec<u32> = (0..Joint::new(nodes, 0).from).collect();
        let mut deepest = 0;
        for step in forest.steps() {
            let spring = &graph.springs()[step.edge];
            let covariance = spring.information.try_inverse().unwrap_or(Matrix3::zeros());
            let before = this.poses[step.parent];
            // The error is made in the frame of the spring's second node.
            let (after, seen_from) = if step.forward {
                let after = before.compose(spring.from_to);
                (after, after)
            } else {
                (before.compose(spring.from_to.inverse()), before)
            };
            let moved = adjoint(seen_from);
            this.poses[step.child] = after;
            this.sums[step.child] = this.sums[step.parent] + moved * covariance * moved.transpose();
            this.depth[step.child] = this.depth[step.parent] + 1;
            parent[step.child] = Joint::new(step.parent, 0).from;
            deepest = deepest.max(this.depth[step.child]);
        }
        this.up.push(parent);
        while deepest >> this.up.len() > 0 {
            let last = this.up.last().expect("there is a first level");
            let next = last.iter().map(|node| last[*node as usize]).collect();
            this.up.push(next);
        }
        this
    }

    /// Covariance of the way between two nodes of one tree, at the origin of the map frame.
    fn between(&self, a: usize, b: usize) -> Matrix3<f64> {
        let meeting = self.meeting(a, b);
        self.sums[a] + self.sums[b] - self.sums[meeting] * 2.0
    }

    fn meeting(&self, a: usize, b: usize) -> usize {
        let (mut deep, mut high) = if self.depth[a] >= self.depth[b] { (a, b) } else { (b, a) };
        let mut lift = self.depth[deep] - self.depth[high];
        while lift > 0 {
            let level = lift.trailing_zeros() as usize;
            deep = self.up[level][deep] as usize;
            lift &= lift - 1;
        }
        if deep == high {
            return deep;
        }
        for level in self.up.iter().rev() {
            let (x, y) = (level[deep] as usize, level[high] as usize);
            if x != y {
                (deep, high) = (x, y);
            }
        }
        self.up[0][deep] as usize
    }

    /// Squared Mahalanobis distance of closure and odometry.
    fn own_cycle(&self, a: &Closure) -> f64 {
        let end = self.poses[a.from].compose(a.z);
        let moved = adjoint(end);
        let covariance = moved * a.covariance * moved.transpose() + self.between(a.from, a.to);
        distance(end.compose(self.poses[a.to].inverse()), &covariance)
    }

    /// Squared Mahalanobis distance of the cycle `a.from → a.to → b.to → b.from → a.from`.
    fn cycle(&self, a: &Closure, b: &Closure) -> f64 {
        self.cycle_with_covariance(a, b).0
    }

    /// Steps between two nodes of a tree, at least: the difference of their depths.
    fn steps_between(&self, a: usize, b: usize) -> u32 {
        self.depth[a].abs_diff(self.depth[b])
    }

    fn cycle_with_covariance(&self, a: &Closure, b: &Closure) -> (f64, Matrix3<f64>) {
        let after_closure = self.poses[a.from].compose(a.z);
        // The second stretch of odometry is walked where the first closure puts it.
        let shift = after_closure.compose(self.poses[a.to].inverse());
        let after_odometry = shift.compose(self.poses[b.to]);
        let back = after_odometry.compose(b.z.inverse());
        let (first, second, walked) = (adjoint(after_closure), adjoint(after_odometry), adjoint(shift));
        let covariance = first * a.covariance * first.transpose()
            + second * b.covariance * second.transpose()
            + walked * self.between(a.to, b.to) * walked.transpose()
            + self.between(a.from, b.from);
        (distance(back.compose(self.poses[b.from].inverse()), &covariance), covariance)
    }
}

/// How a small motion in the frame of `pose` looks at the origin: `(R, t × ·; 0, 1)`.
fn adjoint(pose: Pose) -> Matrix3<f64> {
    let (sin, cos) = pose.heading.sin_cos();
    Matrix3::new(cos, -sin, pose.y, sin, cos, -pose.x, 0.0, 0.0, 1.0)
}

fn distance(error: Pose, covariance: &Matrix3<f64>) -> f64 {
    let e = Vector3::new(error.x, error.y, wrap(error.heading));
    // Not being able to tell is no contradiction.
    covariance.try_inverse().map_or(0.0, |inverse| e.dot(&(inverse * e)))
}

/// Who agrees with whom, one bit for each pair.
struct Agreement {
    count: usize,
    words: usize,
    bits: Vec<u64>,
}

impl Agreement {
    fn new(count: usize, agree: impl Fn(usize, usize) -> bool) -> Self {
        let words = count.div_ceil(64);
        let mut bits = vec![0u64; count * words];
        for i in 0..count {
            for j in 0..i {
                if agree(i, j) {
                    bits[i * words + j / 64] |= 1 << (j % 64);
                    bits[j * words + i / 64] |= 1 << (i % 64);
                }
            }
        }
        Self { count, words, bits }
    }

    fn row(&self, i: usize) -> &[u64] {
        &self.bits[i * self.words..(i + 1) * self.words]
    }

    fn degree(&self, i: usize) -> u32 {
        self.row(i).iter().map(|word| word.count_ones()).sum()
    }

    /// A large set whose members all agree: grown from the closures that agree with most others, always by the one that leaves most candidates.
    fn largest_set(&self) -> Vec<usize> {
        let degrees: Vec<u32> = (0..self.count).map(|i| self.degree(i)).collect();
        let mut order: Vec<usize> = (0..self.count).collect();
        order.sort_by_key(|&i| std::cmp::Reverse(degrees[i]));
        let mut best = Vec::new();
        for &seed in order.iter().take(SEEDS) {
            if (degrees[seed] as usize) < best.len() {
                break;
            }
            let mut candidates = self.row(seed).to_vec();
            let mut set = vec![seed];
            // Candidates in order of degree: one pass keeps each that still agrees with all before it.
            for &next in &order {
                if candidates[next / 64] >> (next % 64) & 1 == 1 {
                    set.push(next);
                    candidates.iter_mut().zip(self.row(next)).for_each(|(mine, theirs)| *mine &= theirs);
                }
            }
            if set.len() > best.len() {
                best = set;
            }
        }
        best
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::RngExt;
    use rand_pcg::Pcg64Mcg;

    #[test]
    fn true_closures_are_the_consistent_ones() {
        let mut random = Pcg64Mcg::new(3);
        let step = Pose::new(1.0, 0.0, 0.13);
        let mut truth = vec![Pose::default()];
        for k in 0..150 {
            truth.push(truth[k].compose(step));
        }
        let information = Matrix3::from_diagonal(&Vector3::new(400.0, 400.0, 2500.0));
        let mut noisy = |z: Pose| {
            let mut off = |s: f64| s * random.random_range(-1.7..1.7);
            Pose::new(z.x + off(0.05), z.y + off(0.05), z.heading + off(0.02))
        };
        let spring = |from, to, from_to| PoseSpring { from, to, from_to, information };
        let mut springs: Vec<_> = (0..150).map(|k| spring(k, k + 1, noisy(step))).collect();
        for k in 0..12 {
            springs.push(spring(5 * k, 5 * k + 48, noisy(truth[5 * k].between(truth[5 * k + 48]))));
        }
        for k in 0..30 {
            springs.push(spring((37 * k) % 150, (53 * k + 20) % 150, noisy(Pose::default())));
        }
        let graph = PoseGraph::new(151, &springs).unwrap();
        let trusted: Vec<bool> = (0..springs.len()).map(|k| k < 150).collect();
        let closures: Vec<usize> = (150..springs.len()).collect();
        let chosen = consistent_closures(&graph, &trusted, &closures, 11.345);
        let kept = (150..162).filter(|k| chosen.contains(k)).count();
        assert!(kept >= 10, "{chosen:?}");
        assert!(chosen.iter().filter(|k| **k >= 162).count() <= 1, "{chosen:?}");
    }
}
