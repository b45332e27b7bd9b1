use nalgebra::{Matrix3, Point2, Rotation2, Vector2, Vector3};

use super::peaks::Peak;
use super::table::WallTable;
use super::{AlignOptions, PEAK_TURN, turn_variance};

/// The scores of every offset and turn of a window: walls of `b` in `a`, one way.
///
/// A score packs two sums over walls into one word, so that one addition per wall and pose does: nearness to walls in
/// 64 steps in the low 18 bits, and above them how many walls met known space.
#[derive(Debug)]
pub(crate) struct Volume {
    resolution: f64,
    side: usize,
    n_walls: usize,
    unknown_penalty: f64,
    min_overlap: f64,
    slices: Vec<Slice>,
    /// The score by which each pose is ranked, slice by slice; 0 where too little overlaps.
    ranks: Vec<f64>,
    turn_step: f64,
}

/// All offsets of one turn.
#[derive(Debug)]
struct Slice {
    turn: f64,
    /// The offset of the first row and column, in metres.
    corner: Vector2<f64>,
    sums: Vec<u32>,
}

/// The table of `a`, padded so that no wall in reach can fall off it.
struct Padded {
    columns: usize,
    rows: usize,
    pad: usize,
    words: Vec<u32>,
}

const NEAR_BITS: u32 = 18;
const NEAR_STEPS: f32 = 63.0;
/// So many walls fit into the sums without overflow.
const MOST_WALLS: usize = 4096;

impl Volume {
    /// Scores `walls` (points of the second frame) against `table` (in the first) at every offset and turn.
    pub(crate) fn over(table: &WallTable, walls: &[Point2<f64>], options: &AlignOptions) -> Self {
        let resolution = table.frame().resolution();
        let reach = cells(options.reach / resolution);
        let padded = Padded::new(table, 2 * reach + 1);
        let walls: Vec<Point2<f64>> = walls.iter().step_by(walls.len().div_ceil(MOST_WALLS).max(1)).copied().collect();
        let (turns, turn_step) = turns(options, resolution, &walls);
        let origin = table.frame().origin();
        let slice = |&turn: &f64| Slice::new(&padded, &walls, origin, resolution, reach, turn);
        let mut volume = Self {
            resolution,
            side: 2 * reach + 1,
            n_walls: walls.len(),
            unknown_penalty: options.unknown_penalty,
            min_overlap: options.min_overlap,
            slices: turns.iter().map(slice).collect(),
            ranks: Vec::new(),
            turn_step,
        };
        let sums = volume.slices.iter().flat_map(|slice| &slice.sums);
        volume.ranks = sums.map(|&sums| volume.score(sums, volume.unknown_penalty)).collect();
        volume
    }

    /// Radians between two turns, 0 where only one was tried.
    pub(crate) fn turn_step(&self) -> f64 {
        self.turn_step
    }

    /// All poses with enough overlap, each with the score by which it is ranked: unknown space counts a little against.
    pub(crate) fn scored(&self) -> impl Iterator<Item = (f64, u32)> + '_ {
        self.ranks.iter().copied().zip(0..).filter(|(rank, _)| *rank > 0.0)
    }

    fn score(&self, sums: u32, unknown_penalty: f64) -> f64 {
        let (near, known) = (f64::from(sums & ((1 << NEAR_BITS) - 1)), f64::from(sums >> NEAR_BITS));
        let all = as_f64(self.n_walls);
        if known < self.min_overlap * all || known == 0.0 {
            return 0.0;
        }
        near / f64::from(NEAR_STEPS) / (known + unknown_penalty * (all - known))
    }

    fn locate(&self, index: u32) -> (&Slice, usize) {
        let (index, area) = (index as usize, self.side * self.side);
        (&self.slices[index / area], index % area)
    }

    pub(crate) fn peak(&self, index: u32) -> Peak {
        let (slice, at) = self.locate(index);
        Peak { offset: slice.corner + self.step(at), turn: slice.turn, score: self.ranks[index as usize] }
    }

    /// How far a pose of a slice lies from the slice's first.
    fn step(&self, at: usize) -> Vector2<f64> {
        Vector2::new(as_f64(at % self.side), as_f64(at / self.side)) * self.resolution
    }

    /// The spread of poses around `peak`, each weighted by `exp((score − best) / temperature)`.
    ///
    /// Only poses to which a way leads over good ones are the spread of this match. What lies beyond a valley is another
    /// match: across a corridor, where one wall lies on the other, or turned further than a peak is wide.
    pub(crate) fn covariance(&self, peak: &Peak, options: &AlignOptions) -> Matrix3<f64> {
        let hill = self.hill(peak, options);
        // Only the overlap is judged here: walls that leave the window say nothing of the axis they left along.
        let best = hill.iter().map(|pose| pose.1).fold(0.0, f64::max);
        let (mut total, mut mean, mut square) = (0.0, Vector3::zeros(), Matrix3::zeros());
        for (step, score) in hill {
            let weight = ((score - best) / options.temperature).exp();
            total += weight;
            mean += step * weight;
            square += step * step.transpose() * weight;
        }
        if best == 0.0 {
            let (position, turn) = (options.reach.powi(2) / 3.0, turn_variance(options));
            return Matrix3::from_diagonal(&[position, position, turn].into());
        }
        let mean = mean / total;
        let floor =
            [(0.25 * self.resolution).powi(2), (0.25 * self.resolution).powi(2), (0.25 * self.turn_step).powi(2)];
        let mut covariance = square / total - mean * mean.transpose() + Matrix3::from_diagonal(&floor.into());
        if self.turn_step == 0.0 {
            covariance[(2, 2)] = turn_variance(options);
        }
        covariance
    }

    /// The poses around `peak` to which a way leads over good ones, each as a step from it, with its score.
    fn hill(&self, peak: &Peak, options: &AlignOptions) -> Vec<(Vector3<f64>, f64)> {
        let turned = |slice: &Slice| crate::Heading::from_radians(slice.turn) - crate::Heading::from_radians(peak.turn);
        let (n_slices, side) = (self.slices.len(), self.side);
        let nearest = |a: &usize, b: &usize| turned(&self.slices[*a]).abs().total_cmp(&turned(&self.slices[*b]).abs());
        let Some(first) = (0..n_slices).min_by(nearest) else { return Vec::new() };
        let top = (peak.offset - self.slices[first].corner) / self.resolution;
        let top = top.map(|steps| cells(steps.max(0.0)).min(side - 1));
        let score =
            |(slice, row, column): (usize, usize, usize)| self.score(self.slices[slice].sums[row * side + column], 0.0);
        let least = (score((first, top.y, top.x)) - VALLEY * options.temperature).max(f64::MIN_POSITIVE);
        let (mut hill, mut seen) = (Vec::new(), vec![false; self.ranks.len()]);
        let mut open = vec![(first, top.y, top.x)];
        while let Some(pose @ (index, row, column)) = open.pop() {
            let slice = &self.slices[index];
            let known = std::mem::replace(&mut seen[(index * side + row) * side + column], true);
            if known || score(pose) < least || turned(slice).abs() >= PEAK_TURN {
                continue;
            }
            let step = slice.corner + self.step(row * side + column) - peak.offset;
            hill.push((step.push(turned(slice)), score(pose)));
            let turns = [(index + n_slices - 1) % n_slices, (index + 1) % n_slices];
            open.extend(turns.map(|index| (index, row, column)));
            let around = |at: usize| at.saturating_sub(STRIDE)..(at + STRIDE + 1).min(side);
            open.extend(around(row).flat_map(|row| around(column).map(move |column| (index, row, column))));
        }
        hill
    }
}

/// Between two matches the score falls by so many temperatures: there a pose weighs a fiftieth.
const VALLEY: f64 = 4.0;
/// A valley is wider than so many cells: on the crest of a wall that runs askew to the cells every other one lies lower.
const STRIDE: usize = 2;

/// The turns to try: one cell apart at the far walls.
fn turns(options: &AlignOptions, resolution: f64, walls: &[Point2<f64>]) -> (Vec<f64>, f64) {
    let far = walls.iter().map(|wall| wall.coords.norm()).fold(resolution, f64::max);
    let window = options.turn_window.clamp(0.0, std::f64::consts::PI);
    let half = cells((window / (resolution / far)).ceil()).min(2000);
    if window <= 0.0 || half == 0 {
        return (vec![0.0], 0.0);
    }
    let step = window / as_f64(half);
    let whole_circle = window > std::f64::consts::PI - 0.5 * step;
    let n = if whole_circle { 2 * half } else { 2 * half + 1 };
    ((0..n).map(|k| as_f64(k) * step - window).collect(), step)
}

impl Padded {
    fn new(table: &WallTable, pad: usize) -> Self {
        let frame = table.frame();
        let (columns, rows) = (frame.columns() + 2 * pad, frame.rows() + 2 * pad);
        let mut words = vec![0; columns * rows];
        for (row, words) in words.chunks_exact_mut(columns).skip(pad).take(frame.rows()).enumerate() {
            for (word, (near, known)) in words[pad..].iter_mut().zip(table.row(row)) {
                #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "rounded, in [0, 63]")]
                let near = (near * NEAR_STEPS + 0.5) as u32;
                *word = if known { near | 1 << NEAR_BITS } else { 0 };
            }
        }
        words.extend([0; LANES]); // whole lanes may be read at the last row's end
        Self { columns, rows, pad, words }
    }

    /// The index of the first of `side × side` words that a wall at `(column, row)` of `a` meets, if any can be known.
    fn corner(&self, wall: Vector2<f64>, reach: usize, side: usize) -> Option<usize> {
        let first = |at: f64| cells_signed(at + 0.5 + as_f64(self.pad) - as_f64(reach));
        let (column, row) = (first(wall.x)?, first(wall.y)?);
        (column + side <= self.columns && row + side <= self.rows).then_some(row * self.columns + column)
    }
}

/// The sums of a slice as a task that is compiled for each set of instructions.
struct Sums<'a> {
    padded: &'a Padded,
    /// Where the words of each wall begin.
    corners: &'a [usize],
    side: usize,
}

/// The most words that any processor adds at once: rows are summed in whole lanes, what is too much is left out at the end.
const LANES: usize = 16;

impl pulp::WithSimd for Sums<'_> {
    type Output = Vec<u32>;

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, simd: S) -> Vec<u32> {
        let Self { padded, corners, side } = self;
        let width = side.next_multiple_of(LANES);
        let mut sums = vec![0u32; side * width];
        for &corner in corners {
            for (row, sums) in sums.chunks_exact_mut(width).enumerate() {
                let start = corner + row * padded.columns;
                let (words, _) = S::as_simd_u32s(&padded.words[start..start + width]);
                let (sums, _) = S::as_mut_simd_u32s(sums);
                for (sums, words) in sums.iter_mut().zip(words) {
                    *sums = simd.add_u32s(*sums, *words);
                }
            }
        }
        sums.chunks_exact(width).flat_map(|row| &row[..side]).copied().collect()
    }
}

impl Slice {
    fn new(
        padded: &Padded,
        walls: &[Point2<f64>],
        origin: Point2<f64>,
        resolution: f64,
        reach: usize,
        turn: f64,
    ) -> Self {
        let rotation = Rotation2::new(turn);
        let turned: Vec<Vector2<f64>> =
            walls.iter().map(|wall| (rotation * wall - origin) / resolution - Vector2::repeat(0.5)).collect();
        // Unturned lattices lie askew by one and the same fraction of a cell; turned ones have none in common.
        let askew = if turn == 0.0 { common_fraction(&turned) } else { Vector2::zeros() };
        let side = 2 * reach + 1;
        let corner = |wall: &Vector2<f64>| padded.corner(wall - askew, reach, side);
        let corners: Vec<usize> = turned.iter().filter_map(corner).collect();
        let sums = pulp::Arch::new().dispatch(Sums { padded, corners: &corners, side });
        let corner = (Vector2::repeat(-as_f64(reach)) - askew) * resolution;
        Self { turn, corner, sums }
    }
}

/// By how much of a cell all points lie off the lattice, on the average round the circle of fractions.
fn common_fraction(points: &[Vector2<f64>]) -> Vector2<f64> {
    let fraction = |axis: usize| {
        let (mut sin, mut cos) = (0.0, 0.0);
        for point in points {
            let angle = std::f64::consts::TAU * point[axis];
            sin += angle.sin();
            cos += angle.cos();
        }
        let common = sin.hypot(cos) > 0.5 * as_f64(points.len());
        if common { sin.atan2(cos) / std::f64::consts::TAU } else { 0.0 }
    };
    Vector2::new(fraction(0), fraction(1))
}

#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "saturates; windows are small")]
fn cells(value: f64) -> usize {
    (value.round() as usize).min(1000)
}

/// A cell number, if it is one.
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "checked")]
fn cells_signed(value: f64) -> Option<usize> {
    (0.0..1e9).contains(&value).then_some(value as usize)
}

#[expect(clippy::cast_precision_loss, reason = "cells of a local grid are few")]
fn as_f64(count: usize) -> f64 {
    count as f64
}
