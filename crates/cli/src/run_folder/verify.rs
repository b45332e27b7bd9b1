use std::path::Path;

use crate::exit::Exit;
use crate::failure::Failure;
use crate::run_folder::run_record;

/// Compares the files of two run folders, but for their records; says how many are identical, or which are not.
pub(crate) fn compare(first: &Path, second: &Path) -> Result<String, Failure> {
    let (ours, theirs) = (run_record::outputs(first)?, run_record::outputs(second)?);
    let differing: Vec<&str> =
        ours.iter().filter(|file| !theirs.contains(file)).map(|file| file.file.as_str()).collect();
    let missing = theirs.iter().filter(|file| !ours.iter().any(|other| other.file == file.file)).count();
    if differing.is_empty() && missing == 0 {
        return Ok(format!("identical: {0} of {0} files", ours.len()));
    }
    let message = format!(
        "{} of {} files differ from run to run: {}",
        differing.len() + missing,
        ours.len(),
        differing.join(", ")
    );
    Err(Failure::new(Exit::Gate, "verify", message)
        .help("this is a bug: please report it with the log and config.toml"))
}
