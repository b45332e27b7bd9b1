use crate::LoopCandidate;

/// What became of a recognition that would close a loop, and why.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Closure {
    /// The recognition.
    pub candidate: LoopCandidate,
    /// Its squared Mahalanobis distance from what odometry says of the same two places; NaN where that says nothing.
    pub residual: f64,
    /// Whether it is believed.
    pub verdict: Verdict,
}

/// Whether a recognition is believed.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(rename_all = "snake_case"))]
#[non_exhaustive]
pub enum Verdict {
    /// It is: so many recognitions agree, itself included.
    Accepted {
        /// How many.
        agreed: usize,
    },
    /// It is not.
    Rejected(Reason),
}

/// Why a recognition is not believed.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(rename_all = "snake_case"))]
#[non_exhaustive]
pub enum Reason {
    /// It is not a displacement between two places.
    #[error("not a displacement between two different places")]
    NoMeasurement,
    /// Odometry does not connect the two places, so nothing checks it.
    #[error("no way was driven from one place to the other")]
    NoWay,
    /// Odometry contradicts it.
    #[error("odometry contradicts it (gate {gate})")]
    Odometry {
        /// The greatest squared Mahalanobis distance allowed.
        gate: f64,
    },
    /// No other recognition agreed in time.
    #[error("no other recognition agreed")]
    NoAgreement,
    /// Too many of the loops believed before contradict it.
    #[error("{against} of {total} earlier loops contradict it")]
    Contradicted {
        /// How many contradict it.
        against: usize,
        /// How many were compared.
        total: usize,
    },
}

impl Closure {
    /// Whether the recognition is believed.
    #[must_use]
    pub fn is_accepted(&self) -> bool {
        matches!(self.verdict, Verdict::Accepted { .. })
    }

    pub(super) fn accepted(candidate: LoopCandidate, residual: f64, agreed: usize) -> Self {
        Self { candidate, residual, verdict: Verdict::Accepted { agreed } }
    }

    pub(super) fn rejected(candidate: LoopCandidate, residual: f64, reason: Reason) -> Self {
        Self { candidate, residual, verdict: Verdict::Rejected(reason) }
    }
}

impl std::fmt::Display for Closure {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let LoopCandidate { from, to, .. } = self.candidate;
        write!(f, "{from} looks like {to}: ")?;
        match self.verdict {
            Verdict::Accepted { agreed } => write!(f, "accepted, {agreed} recognitions agree")?,
            Verdict::Rejected(reason) => write!(f, "rejected, {reason}")?,
        }
        if self.residual.is_finite() {
            write!(f, "; {:.1} σ from odometry", self.residual.sqrt())?;
        }
        Ok(())
    }
}
