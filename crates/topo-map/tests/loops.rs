//! The loop test: what agrees is let through, what odometry or the others contradict is not.

use local_grid::nalgebra::Vector2;
use topo_map::{Closure, Displacement, LoopCandidate, LoopOptions, LoopPool, PathTree, PlaceId, Reason, Turn, Verdict};

/// A way once and a half around a square of 10 m with a place each metre; odometry with a sigma of 5 cm per metre.
fn around_the_block(turning: bool) -> PathTree {
    let mut path = PathTree::new();
    path.begin(PlaceId(0)).unwrap();
    for place in 0..60_u32 {
        let side = f64::from(place / 10) * std::f64::consts::FRAC_PI_2;
        let mut step = Displacement::isotropic(Vector2::new(side.cos(), side.sin()), 0.0025);
        if turning {
            step.turn = Some(Turn { change: 0.0, variance: 1e-4 });
        }
        path.step(PlaceId(place), PlaceId(place + 1), &step).unwrap();
    }
    path
}

/// Place `from` seems to lie at `offset` from place `to`.
fn likeness(from: u32, to: u32, offset: Vector2<f64>) -> LoopCandidate {
    let displacement = Displacement::isotropic(-offset, 0.01);
    LoopCandidate { from: PlaceId(from), to: PlaceId(to), displacement, score: 1.0 }
}

fn verdicts(closures: &[Closure]) -> Vec<(u32, bool)> {
    closures.iter().map(|closure| (closure.candidate.from.0, closure.is_accepted())).collect()
}

#[test]
fn one_recognition_waits_and_a_second_confirms_both() {
    for turning in [false, true] {
        let path = around_the_block(turning);
        let mut pool = LoopPool::new(LoopOptions::default());
        assert_eq!(pool.push(likeness(41, 1, Vector2::new(0.1, 0.1)), &path), []);
        let decided = pool.push(likeness(42, 2, Vector2::new(0.15, 0.05)), &path);
        assert_eq!(verdicts(&decided), [(41, true), (42, true)]);
        assert_eq!(decided[0].verdict, Verdict::Accepted { agreed: 2 });
        assert_eq!(pool.accepted().len(), 2);
        assert_eq!(pool.pending().count(), 0);
    }
}

#[test]
fn two_looks_from_one_spot_are_no_agreement() {
    let path = around_the_block(false);
    let mut pool = LoopPool::new(LoopOptions::default());
    assert_eq!(pool.push(likeness(41, 1, Vector2::zeros()), &path), []);
    assert_eq!(pool.push(likeness(41, 2, Vector2::new(-1.0, 0.0)), &path), []);
}

#[test]
fn what_odometry_contradicts_is_refused_at_once() {
    let path = around_the_block(false);
    let mut pool = LoopPool::new(LoopOptions::default());
    let decided = pool.push(likeness(45, 15, Vector2::zeros()), &path);
    assert!(matches!(decided[0].verdict, Verdict::Rejected(Reason::Odometry { .. })), "{decided:?}");
    let text = decided[0].to_string();
    assert!(text.starts_with("place 45 looks like place 15: rejected, odometry contradicts it"), "{text}");
}

#[test]
fn false_recognitions_that_contradict_each_other_never_pass() {
    let path = around_the_block(false);
    let mut pool = LoopPool::new(LoopOptions::default());
    // Each alone is within what odometry allows after 40 m (σ = 0.32 m), but they pull apart.
    assert_eq!(pool.push(likeness(41, 1, Vector2::new(0.9, 0.0)), &path), []);
    assert_eq!(pool.push(likeness(42, 2, Vector2::new(-0.9, 0.0)), &path), []);
    assert_eq!(pool.push(likeness(43, 3, Vector2::new(0.0, 1.0)), &path), []);
    assert_eq!(verdicts(&pool.finish()), [(41, false), (42, false), (43, false)]);
}

#[test]
fn the_true_ones_are_found_among_false_ones() {
    let path = around_the_block(false);
    let mut pool = LoopPool::new(LoopOptions { agreement: 3, ..LoopOptions::default() });
    let mut decided = Vec::new();
    for (from, offset) in [(41, 0.1), (42, -0.8), (43, 0.15), (44, 0.9), (45, 0.1)] {
        decided.extend(pool.push(likeness(from, from - 40, Vector2::new(offset, 0.0)), &path));
    }
    assert_eq!(verdicts(&decided), [(41, true), (43, true), (45, true)]);
}

#[test]
fn who_waits_too_long_is_rejected() {
    let path = around_the_block(false);
    let mut pool = LoopPool::new(LoopOptions { patience: 3, ..LoopOptions::default() });
    pool.push(likeness(41, 1, Vector2::zeros()), &path);
    let steps: Vec<usize> = (0..5).map(|_| pool.advance().len()).collect();
    assert_eq!(steps, [0, 0, 0, 1, 0]);
}

#[test]
fn a_group_that_contradicts_earlier_loops_is_refused() {
    let path = around_the_block(false);
    let mut pool = LoopPool::new(LoopOptions::default());
    for from in [41, 42, 43] {
        pool.push(likeness(from, from - 40, Vector2::new(0.1, 0.0)), &path);
    }
    pool.finish();
    let accepted = pool.accepted().len();
    assert_eq!(pool.push(likeness(45, 5, Vector2::new(-0.9, 0.5)), &path), []);
    let decided = pool.push(likeness(46, 6, Vector2::new(-0.9, 0.5)), &path);
    assert!(matches!(decided[0].verdict, Verdict::Rejected(Reason::Contradicted { .. })), "{decided:?}");
    assert_eq!(pool.accepted().len(), accepted);
}

#[test]
fn what_cannot_be_checked_is_refused() {
    let mut path = around_the_block(false);
    path.begin(PlaceId(100)).unwrap();
    let mut pool = LoopPool::new(LoopOptions::default());
    let reason = |closures: Vec<Closure>| closures[0].verdict;
    assert_eq!(reason(pool.push(likeness(100, 3, Vector2::zeros()), &path)), Verdict::Rejected(Reason::NoWay));
    assert_eq!(reason(pool.push(likeness(3, 3, Vector2::zeros()), &path)), Verdict::Rejected(Reason::NoMeasurement));
    let nan = likeness(41, 1, Vector2::new(f64::NAN, 0.0));
    assert_eq!(reason(pool.push(nan, &path)), Verdict::Rejected(Reason::NoMeasurement));
}
