pub(crate) mod peaks;
mod score;
mod search;
mod table;

use nalgebra::{Isometry2, Matrix2, Matrix3, Vector2};

use crate::{Heading, Signature};
use peaks::Peak;
use score::SymmetricScore;
pub(crate) use search::Volume;
pub(crate) use table::WallTable;

/// Within which window two signatures are compared, and how strictly.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(default, deny_unknown_fields))]
pub struct AlignOptions {
    /// `S`: offsets are searched in `[−S, S]` along both axes, in metres.
    pub reach: f64,
    /// Turns are searched in `[−w, w]` radians; 0 trusts both headings, π searches all.
    pub turn_window: f64,
    /// How far the headings are trusted where turns are not searched: standard deviation in radians.
    pub turn_sigma: f64,
    /// How far from a wall an echo still counts, as the standard deviation of a bell curve in metres.
    pub wall_sigma: f64,
    /// What an occupied cell that meets unknown space costs, against one that meets empty space.
    pub unknown_penalty: f64,
    /// The least share of occupied cells that must meet known space.
    pub min_overlap: f64,
    /// Peaks of the score count as different matches when their offsets are so far apart, in metres.
    pub peak_separation: f64,
    /// The drop of the score that makes an offset `e` times less likely; it scales the covariance.
    pub temperature: f64,
}

impl Default for AlignOptions {
    fn default() -> Self {
        Self {
            reach: 0.8,
            turn_window: 0.0,
            turn_sigma: 2f64.to_radians(),
            wall_sigma: 0.1,
            unknown_penalty: 0.25,
            min_overlap: 0.35,
            peak_separation: 0.5,
            temperature: 0.04,
        }
    }
}

/// In which directions an alignment says nothing.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(rename_all = "snake_case"))]
pub enum Ambiguity {
    /// The offset is known both ways.
    None,
    /// The two fit as well anywhere along this axis, as two views of one corridor do.
    Along(Heading),
    /// The two fit as well, or as badly, everywhere.
    Everywhere,
}

impl Ambiguity {
    /// The projection onto the axes along which nothing is known: times a variance in m², what is to be added there to the
    /// covariance of an offset, since the window's own width is no measurement.
    #[must_use]
    pub fn unknown(&self) -> Matrix2<f64> {
        match self {
            Self::None => Matrix2::zeros(),
            Self::Along(axis) => axis.unit_vector() * axis.unit_vector().transpose(),
            Self::Everywhere => Matrix2::identity(),
        }
    }
}

/// How one signature lies in the other, and how far to believe it.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Alignment {
    /// The second place's centre in the frame of the first, in metres.
    pub offset: Vector2<f64>,
    /// The turn that carries the second frame's axes into the first's, in radians.
    pub turn: f64,
    /// How well walls meet walls, both ways, in `[0, 1]`.
    pub score: f64,
    /// The score of the best match elsewhere in the window (along another axis than an ambiguous one), 0 if there is none.
    pub runner_up: f64,
    /// The share of walls of either that lie in free space of the other, in `[0, 1]`.
    pub contradiction: f64,
    /// The share of walls of either that meet known space of the other, in `[0, 1]`.
    pub overlap: f64,
    /// Of `(offset, turn)`, in metres and radians. Never small along an ambiguous axis, where its variance is `S²/3`.
    pub covariance: Matrix3<f64>,
    /// Where the offset is a guess.
    pub ambiguity: Ambiguity,
}

/// So many walls of either side rank peaks; the best is then judged by all.
const ENOUGH_WALLS: usize = 160;

/// A peak that scores less than this share of the best cannot climb past it.
const NEAR_BEST: f64 = 0.7;

/// Turns further apart than this, in radians, are different matches.
const PEAK_TURN: f64 = 0.35;

impl Alignment {
    /// The pose of the second place in the first: `a_from_b`.
    #[must_use]
    pub fn a_from_b(&self) -> Isometry2<f64> {
        Isometry2::new(self.offset, self.turn)
    }

    /// How much better the match is than any other in the window: `1 − runner-up / score`, in `[0, 1]`.
    #[must_use]
    pub fn distinctiveness(&self) -> f64 {
        if self.score > 0.0 { (1.0 - self.runner_up / self.score).clamp(0.0, 1.0) } else { 0.0 }
    }

    /// Whether walls agree both ways, hardly contradict each other, and enough of them were seen by both.
    ///
    /// One convincing alignment is still no recognition: look-alikes exist, so ask for agreement over successive places.
    #[must_use]
    pub fn is_convincing(&self) -> bool {
        self.ambiguity == Ambiguity::None && self.score >= 0.75 && self.contradiction <= 0.1 && self.overlap >= 0.5
    }

    fn nothing(options: &AlignOptions) -> Self {
        let (position, turn) = (options.reach.powi(2) / 3.0, turn_variance(options));
        Self {
            offset: Vector2::zeros(),
            turn: 0.0,
            score: 0.0,
            runner_up: 0.0,
            contradiction: 0.0,
            overlap: 0.0,
            covariance: Matrix3::from_diagonal(&[position, position, turn].into()),
            ambiguity: Ambiguity::Everywhere,
        }
    }
}

/// The variance of a turn of which nothing is found out: the compass', or that of the window searched.
fn turn_variance(options: &AlignOptions) -> f64 {
    (options.turn_window.powi(2) / 3.0).max(options.turn_sigma.powi(2))
}

/// Finds how the place of signature `b` lies in the frame of signature `a`.
///
/// Every offset of the window, and every turn if headings are uncertain, is scored by how many walls of `b` meet walls of
/// `a`; walls that meet free space speak against, walls that meet unknown space hardly count. The best peaks are
/// scored again both ways and refined below a cell. The spread of good scores gives the covariance: a corridor
/// scores alike all along its axis, which comes out as `S²/3` there and as [`Ambiguity::Along`].
///
/// Signatures of different resolution, or without walls, do not compare: score 0, ambiguous everywhere.
///
/// After the histogram and grid matching of Duckett & Nehmzow (1998) and the correlative matching of Olson (2009).
///
/// ```
/// use local_grid::nalgebra::{Point2, Vector2};
/// use local_grid::{align, AlignOptions, CellClass, GridFrame, Signature};
///
/// let frame = GridFrame::new(Point2::new(-3.2, -3.2), 0.1, 64, 64)?;
/// let room = |left: usize, low: usize| {
///     let wall = |row, column| (column == left && row >= low) || (row == low && column >= left);
///     let inside = |row, column| row > low && column > left;
///     let class = |row, column| match (wall(row, column), inside(row, column)) {
///         (true, _) => CellClass::Occupied,
///         (_, true) => CellClass::Empty,
///         _ => CellClass::Unknown,
///     };
///     Signature::from_classes(frame, (0..64 * 64).map(|k| class(k / 64, k % 64)).collect())
/// };
/// // The same corner, seen from a place 0.3 m further east.
/// let found = align(&room(10, 12)?, &room(7, 12)?, &AlignOptions::default());
/// assert!((found.offset - Vector2::new(0.3, 0.0)).norm() < 0.01);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[must_use]
pub fn align(a: &Signature, b: &Signature, options: &AlignOptions) -> Alignment {
    let _span = tracing::debug_span!("align").entered();
    let (fine, other) = (a.frame().resolution(), b.frame().resolution());
    if (fine - other).abs() > 1e-9 * fine || a.walls().next().is_none() || b.walls().next().is_none() {
        return Alignment::nothing(options);
    }
    let walls: Vec<_> = b.walls().collect();
    let score = SymmetricScore::new(a, b, options);
    let volume = Volume::over(score.table_a(), &walls, options);
    let mut found = peaks::of(&volume, options);
    let rough = score.thinned(ENOUGH_WALLS);
    for peak in &mut found {
        peak.score = rough.at(peak.offset, peak.turn).score;
    }
    found.sort_by(|a, b| b.score.total_cmp(&a.score));
    let near_best = NEAR_BEST * found.first().map_or(0.0, |best| best.score);
    for peak in found.iter_mut().take(2).filter(|peak| peak.score >= near_best) {
        rough.climb(peak, fine, volume.turn_step());
    }
    found.sort_by(|a, b| b.score.total_cmp(&a.score));
    let Some(best) = found.first().copied().filter(|best| best.score > 0.0) else {
        return Alignment::nothing(options);
    };
    let best = score.refine(best, fine, volume.turn_step());
    assemble(&volume, &score, best, &found, options)
}

fn assemble(volume: &Volume, score: &SymmetricScore, best: Peak, found: &[Peak], options: &AlignOptions) -> Alignment {
    let spread = volume.covariance(&best, options);
    let (covariance, ambiguity) = judge_ambiguity(spread, options);
    let elsewhere = |peak: &&Peak| {
        let mut step = peak.offset - best.offset;
        if let Ambiguity::Along(axis) = ambiguity {
            step -= axis.unit_vector() * step.dot(&axis.unit_vector());
        }
        let turned = Heading::from_radians(peak.turn) - Heading::from_radians(best.turn);
        step.norm() >= options.peak_separation || turned.abs() > 0.35
    };
    let runner_up = found.iter().filter(elsewhere).map(|peak| peak.score).fold(0.0, f64::max);
    let detail = score.at(best.offset, best.turn);
    Alignment {
        offset: best.offset,
        turn: best.turn,
        score: detail.score,
        runner_up: runner_up.min(detail.score),
        contradiction: detail.contradiction,
        overlap: detail.overlap,
        covariance,
        ambiguity,
    }
}

/// Declares axes along which the scores spread like a flat window to be ambiguous, and gives them its variance.
fn judge_ambiguity(mut covariance: Matrix3<f64>, options: &AlignOptions) -> (Matrix3<f64>, Ambiguity) {
    let flat = options.reach.powi(2) / 3.0;
    let block: Matrix2<f64> = covariance.fixed_view::<2, 2>(0, 0).into();
    let eigen = block.symmetric_eigen();
    let vague = eigen.eigenvalues.map(|value| value > 0.25 * flat);
    let values = eigen.eigenvalues.map(|value| if value > 0.25 * flat { flat } else { value });
    let raised = eigen.eigenvectors * Matrix2::from_diagonal(&values) * eigen.eigenvectors.transpose();
    covariance.fixed_view_mut::<2, 2>(0, 0).copy_from(&raised);
    let ambiguity = match (vague[0], vague[1]) {
        (false, false) => Ambiguity::None,
        (true, true) => Ambiguity::Everywhere,
        (true, false) => Ambiguity::Along(axis(eigen.eigenvectors.column(0).into())),
        (false, true) => Ambiguity::Along(axis(eigen.eigenvectors.column(1).into())),
    };
    (covariance, ambiguity)
}

/// An axis as the one of its two headings that lies in `(−π/2, π/2]`.
pub(crate) fn axis(direction: Vector2<f64>) -> Heading {
    let positive = direction.x > 1e-12 || (direction.x.abs() <= 1e-12 && direction.y > 0.0);
    Heading::of(if positive { direction } else { -direction })
}
