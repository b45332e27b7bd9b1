//! The table of problems that every solver is held against.

use nalgebra::{Matrix2, Rotation2, Vector2};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;
use relaxation::{Network, Spring};

/// A named problem.
pub(crate) struct Problem {
    pub(crate) name: String,
    pub(crate) network: Network,
}

/// Shapes that maps have, and shapes that solvers fear.
pub(crate) fn all() -> Vec<Problem> {
    let mut problems = Vec::new();
    let mut add = |name: &str, nodes: usize, springs: Vec<Spring>| {
        problems.push(Problem { name: name.into(), network: Network::from_vec(nodes, springs).unwrap() });
    };
    let mut rng = Pcg64Mcg::seed_from_u64(2000);
    let rng = &mut rng;
    add("nothing", 0, vec![]);
    add("one place", 1, vec![]);
    add("path", 40, (1..40).map(|i| measured(rng, i - 1, i)).collect());
    add("star", 30, (1..30).map(|i| measured(rng, 0, i)).collect());
    add("ring", 60, (0..60).map(|i| measured(rng, i, (i + 1) % 60)).collect());
    add("ring with a tail and parallel springs", 24, {
        let mut springs: Vec<_> = (0..20).map(|i| measured(rng, i, (i + 1) % 20)).collect();
        springs.extend((20..24).map(|i| measured(rng, i - 1, i)));
        springs.extend([measured(rng, 4, 3), measured(rng, 3, 4), measured(rng, 7, 7)]);
        springs
    });
    add("two loops and a lone place", 31, {
        let loops = (0..15).map(|i| (i, (i + 1) % 15)).chain((0..15).map(|i| (15 + i, 15 + (i + 1) % 15)));
        loops.map(|(i, j)| measured(rng, i, j)).collect()
    });
    add("grid", 20 * 15, grid(20, 15).into_iter().map(|(i, j)| measured(rng, i, j)).collect());
    add("corridors", 400, corridors(rng));
    add("complete", 14, (0..14).flat_map(|i| (0..i).map(move |j| (i, j))).map(|(i, j)| measured(rng, i, j)).collect());
    for seed in 0..4 {
        add(&format!("random {seed}"), 120, random(&mut Pcg64Mcg::seed_from_u64(seed), 120, 200));
    }
    add("directional random", 90, random(rng, 90, 160).into_iter().map(|s| directional(rng, s)).collect());
    add("directional grid", 100, {
        let springs: Vec<_> = grid(10, 10).into_iter().map(|(i, j)| measured(rng, i, j)).collect();
        springs.into_iter().map(|s| directional(rng, s)).collect()
    });
    add("directional corridors", 400, corridors(rng).into_iter().map(|s| directional(rng, s)).collect());
    problems
}

/// A spring between places on a spiral, a tenth off in any direction, its variance within a factor of ten.
pub(crate) fn measured(rng: &mut Pcg64Mcg, from: usize, to: usize) -> Spring {
    let truth = |i: usize| {
        let t = i as f64;
        Vector2::new(t.sqrt() * t.cos(), t.sqrt() * t.sin())
    };
    let error = Vector2::new(rng.random_range(-0.1..0.1), rng.random_range(-0.1..0.1));
    Spring::isotropic(from, to, truth(to) - truth(from) + error, 10_f64.powf(rng.random_range(-3.0..-2.0)))
}

/// The spring with a covariance ten times as long as wide, in any direction.
fn directional(rng: &mut Pcg64Mcg, spring: Spring) -> Spring {
    let turn = Rotation2::new(rng.random_range(0.0..3.0)).into_inner();
    let u = spring.covariance.m11;
    Spring { covariance: turn * Matrix2::new(u, 0.0, 0.0, 10.0 * u) * turn.transpose(), ..spring }
}

pub(crate) fn grid(columns: usize, rows: usize) -> Vec<(usize, usize)> {
    let at = |x: usize, y: usize| y * columns + x;
    let mut pairs = Vec::new();
    for y in 0..rows {
        for x in 0..columns {
            if x + 1 < columns {
                pairs.push((at(x, y), at(x + 1, y)));
            }
            if y + 1 < rows {
                pairs.push((at(x, y + 1), at(x, y)));
            }
        }
    }
    pairs
}

/// Junctions of a 7 × 7 lattice, joined by corridors of three places as far as 400 places reach.
fn corridors(rng: &mut Pcg64Mcg) -> Vec<Spring> {
    let mut next = 49;
    let mut springs = Vec::new();
    for (a, b) in grid(7, 7) {
        let mut here = a;
        for _ in 0..3 {
            if next < 400 {
                springs.push(measured(rng, here, next));
                here = next;
                next += 1;
            }
        }
        springs.push(measured(rng, here, b));
    }
    while next < 400 {
        springs.push(measured(rng, next - 7, next));
        next += 1;
    }
    springs
}

/// A random tree and random springs beside it.
pub(crate) fn random(rng: &mut Pcg64Mcg, nodes: usize, springs: usize) -> Vec<Spring> {
    let mut all: Vec<_> = (1..nodes).map(|i| (rng.random_range(0..i), i)).collect();
    all.extend((nodes - 1..springs).map(|_| (rng.random_range(0..nodes), rng.random_range(0..nodes))));
    all.into_iter().map(|(i, j)| measured(rng, i, j)).collect()
}
