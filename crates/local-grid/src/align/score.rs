use std::rc::Rc;

use nalgebra::{Isometry2, Point2, Vector2};

use super::peaks::Peak;
use super::table::WallTable;
use super::{AlignOptions, Signature};

/// The score of a pose, both ways: walls of `b` in `a` and walls of `a` in `b`.
#[derive(Debug, Clone)]
pub(super) struct SymmetricScore<'a> {
    options: &'a AlignOptions,
    table_a: Rc<WallTable>,
    table_b: Rc<WallTable>,
    walls_a: Vec<Point2<f64>>,
    walls_b: Vec<Point2<f64>>,
}

/// A score and what it is made of; see the fields of the same name in [`super::Alignment`].
#[derive(Debug, Clone, Copy)]
pub(super) struct Detail {
    pub(super) score: f64,
    pub(super) contradiction: f64,
    pub(super) overlap: f64,
}

impl<'a> SymmetricScore<'a> {
    pub(super) fn new(a: &Signature, b: &Signature, options: &'a AlignOptions) -> Self {
        Self {
            options,
            table_a: Rc::new(WallTable::new(a, options.wall_sigma)),
            table_b: Rc::new(WallTable::new(b, options.wall_sigma)),
            walls_a: a.walls().collect(),
            walls_b: b.walls().collect(),
        }
    }

    /// The same with at most `count` walls of either side.
    pub(super) fn thinned(&self, count: usize) -> Self {
        let some = |walls: &[Point2<f64>]| walls.iter().step_by(walls.len().div_ceil(count).max(1)).copied().collect();
        Self { walls_a: some(&self.walls_a), walls_b: some(&self.walls_b), ..self.clone() }
    }

    pub(super) fn table_a(&self) -> &WallTable {
        &self.table_a
    }

    pub(super) fn at(&self, offset: Vector2<f64>, turn: f64) -> Detail {
        let a_from_b = Isometry2::new(offset, turn);
        let forth = self.table_a.tally(&self.walls_b, &a_from_b);
        let back = self.table_b.tally(&self.walls_a, &a_from_b.inverse());
        let (near, known) = (forth.near + back.near, forth.known + back.known);
        let all = forth.all + back.all;
        let overlap = known / all.max(1.0);
        if overlap < self.options.min_overlap {
            return Detail { score: 0.0, contradiction: 0.0, overlap };
        }
        let score = near / (known + self.options.unknown_penalty * (all - known)).max(1.0);
        Detail { score, contradiction: (forth.contradictory + back.contradictory) / known.max(1.0), overlap }
    }

    /// Moves a peak to the best of its neighbours, up to a few steps.
    pub(super) fn climb(&self, peak: &mut Peak, step: f64, turn_step: f64) {
        for _ in 0..4 {
            let Some(better) = self.best_neighbour(peak, step, turn_step) else { return };
            *peak = better;
        }
    }

    fn best_neighbour(&self, peak: &Peak, step: f64, turn_step: f64) -> Option<Peak> {
        let turns: &[f64] = if turn_step > 0.0 { &[0.0, -1.0, 1.0] } else { &[0.0] };
        let mut best = *peak;
        for turn in turns {
            for (x, y) in [(1.0, 0.0), (-1.0, 0.0), (0.0, 1.0), (0.0, -1.0), (0.0, 0.0)] {
                if x == 0.0 && y == 0.0 && *turn == 0.0 {
                    continue; // that is the peak itself
                }
                let (offset, turn) = (peak.offset + Vector2::new(x, y) * step, peak.turn + turn * turn_step);
                let score = self.at(offset, turn).score;
                if score > best.score + 1e-9 {
                    best = Peak { offset, turn, score };
                }
            }
        }
        (best.score > peak.score).then_some(best)
    }

    /// The vertex of parabolas through the scores around a peak, with halved steps: below a cell, below a turn step.
    pub(super) fn refine(&self, peak: Peak, cell: f64, turn_step: f64) -> Peak {
        let mut best = Peak { score: self.at(peak.offset, peak.turn).score, ..peak };
        for scale in [1.0, 0.5, 0.25] {
            let along = |x: f64, y: f64, turn: f64| {
                let score = |k: f64| self.at(best.offset + Vector2::new(x, y) * k, best.turn + turn * k).score;
                vertex(score(-1.0), best.score, score(1.0))
            };
            let (step, turned) = (cell * scale, turn_step * scale);
            let offset = best.offset + Vector2::new(along(step, 0.0, 0.0), along(0.0, step, 0.0)) * step;
            let turn = if turned > 0.0 { best.turn + along(0.0, 0.0, turned) * turned } else { best.turn };
            let score = self.at(offset, turn).score;
            if score > best.score {
                best = Peak { offset, turn, score };
            }
        }
        best
    }
}

/// Where between −1 and 1 the parabola through three values has its top; 0 where it has none.
fn vertex(before: f64, here: f64, after: f64) -> f64 {
    let bend = before - 2.0 * here + after;
    if bend >= -1e-12 { 0.0 } else { (0.5 * (before - after) / bend).clamp(-1.0, 1.0) }
}
