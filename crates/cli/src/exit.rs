use std::process::ExitCode;

/// How the program ended, as the shell sees it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Exit {
    /// The work is done, or nobody reads its results any more.
    Done = 0,
    /// The work failed: a file cannot be written, or a bug of ours.
    Failed = 1,
    /// The command line makes no sense (the parser of the arguments uses the same code).
    Usage = 2,
    /// The input cannot be used.
    Rejected = 3,
    /// The work is done, and a gate that the user set did not hold.
    Gate = 4,
    /// The user interrupted the work.
    Interrupted = 130,
}

impl From<Exit> for ExitCode {
    fn from(exit: Exit) -> Self {
        Self::from(exit as u8)
    }
}
