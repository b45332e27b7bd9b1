use std::path::{Path, PathBuf};

use hierarchy::Mapper;

use crate::exit::Exit;
use crate::failure::Failure;
use crate::files;
use crate::input::edits;

/// Loads the map of a run, given its folder or its `session.hmap`, as every command that looks at a run sees it.
///
/// It is the recorded one with the edits of the run.
pub(crate) fn load(run: &Path) -> Result<Mapper, Failure> {
    let mut mapper = recorded(run)?;
    if run.is_dir() {
        edits::apply(run, &mut mapper)?;
    }
    Ok(mapper)
}

/// The map of a run as it was recorded.
pub(crate) fn recorded(run: &Path) -> Result<Mapper, Failure> {
    let path = file(run);
    if run.is_dir() && !path.exists() {
        let message = format!("could not use {}: it holds no session.hmap", run.display());
        return Err(Failure::new(Exit::Rejected, "session.missing", message).help("name the folder of a run"));
    }
    Mapper::load(&mut files::open(&path)?).map_err(|error| {
        Failure::new(Exit::Rejected, "session", format!("could not read {}: {error}", path.display()))
            .because_of(&error)
    })
}

/// The session of a run.
pub(crate) fn file(run: &Path) -> PathBuf {
    if run.is_dir() { run.join("session.hmap") } else { run.to_owned() }
}

/// What a run is called: its folder's name.
pub(crate) fn name(run: &Path) -> String {
    let folder = if run.is_dir() { run } else { run.parent().unwrap_or(run) };
    let whole = folder.canonicalize().unwrap_or_else(|_| folder.to_owned());
    whole.file_name().map_or_else(|| "run".to_owned(), |name| name.to_string_lossy().into_owned())
}
