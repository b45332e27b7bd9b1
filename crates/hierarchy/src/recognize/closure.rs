use topo_map::{Displacement, PlaceId};

/// What was weighed: a place that looks like an older one, and what became of it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Closure {
    /// The place reached now.
    pub place: PlaceId,
    /// The older place that it looks like.
    pub known: PlaceId,
    /// Where `known` lies as seen from `place`, by the alignment of the two views.
    pub displacement: Displacement,
    /// Similarity of the views, in `[0, 1]`.
    pub score: f64,
    /// Distance between where the alignment and where the coordinates of that moment put the place, in metres.
    pub shift: f64,
    /// Whether it is believed.
    pub verdict: Verdict,
}

/// Whether a resemblance is believed, and why.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum Verdict {
    /// So many successive views agree, with these odds (natural logarithm) against all else: any other place, and none.
    Accepted {
        /// Views that agree.
        agreed: usize,
        /// Logarithm of the odds.
        log_odds: f64,
    },
    /// The finished map has the two beside each other, and the laser scans of the one fit the walls seen from the other.
    Beside {
        /// How well they fit, in `[0, 1]`.
        score: f64,
    },
    /// A proposal of the robot's own recogniser that the map which explains most of them contradicts.
    Contradicted {
        /// The squared distance at which that map has the two moments, in σ of "the same spot".
        chi2: f64,
    },
    /// Too few successive views agreed while they were remembered.
    NoAgreement {
        /// The most that did.
        agreed: usize,
    },
    /// Enough views agreed, but the robot could as well have been elsewhere: at another place that looks alike, or at one
    /// that was never visited.
    Ambiguous {
        /// The most views that agreed.
        agreed: usize,
    },
    /// The views agreed, but the laser scans of the one place do not fit the walls of the other.
    WallsDiffer {
        /// How well they fit, in `[0, 1]`.
        score: f64,
    },
}

impl Closure {
    /// Whether it is believed.
    #[must_use]
    pub fn is_accepted(&self) -> bool {
        matches!(self.verdict, Verdict::Accepted { .. } | Verdict::Beside { .. })
    }
}

impl std::fmt::Display for Verdict {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Accepted { agreed, log_odds } => write!(f, "{agreed} views agree, log odds {log_odds:.1}"),
            Self::Beside { score } => write!(f, "beside each other in the map, and scans fit with {score:.2}"),
            Self::Contradicted { chi2 } => write!(f, "the map has the two {:.1} σ apart", chi2.sqrt()),
            Self::NoAgreement { agreed: 1 } => write!(f, "no view before or after agreed"),
            Self::NoAgreement { agreed } => write!(f, "only {agreed} successive views agreed"),
            Self::Ambiguous { agreed } => {
                write!(f, "{agreed} views agree, but with other places as well, or by chance")
            }
            Self::WallsDiffer { score } => write!(f, "the walls differ: scans fit with {score:.2}"),
        }
    }
}
