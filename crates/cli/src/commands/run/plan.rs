use std::fmt::Write as _;

use super::Job;
use crate::run_folder::RunFolder;
use crate::settings::{Origin, Settings};

/// What `--dry-run` says: what would be read, how, and where the results would go; writing to a string cannot fail.
pub(super) fn text(job: &Job, folder: &RunFolder, settings: Settings) -> String {
    let mut text = String::from("would map\n");
    for path in job.inputs {
        let bytes = path.metadata().map_or_else(|_| String::new(), |file| format!("  {} bytes", file.len()));
        let _ = writeln!(text, "  {}{bytes}", path.display());
    }
    if job.inputs.is_empty() {
        let _ = writeln!(text, "  {} (bundled)", job.name);
    }
    let _ = writeln!(text, "into\n  {}", folder.path().display());
    let changed: Vec<_> = settings.all().filter(|(_, (_, origin))| *origin != Origin::BuiltIn).collect();
    let _ =
        writeln!(text, "with {}", if changed.is_empty() { "the built-in settings" } else { "these settings changed" });
    for (key, (value, origin)) in changed {
        let _ = writeln!(text, "  {key} = {value}   ({origin})");
    }
    text
}
