use std::path::{Path, PathBuf};

use hierarchy::Mapper;
use hierarchy::edit::Edits;

use crate::exit::Exit;
use crate::failure::Failure;
use crate::files;

/// The list of edits in a run folder.
pub(crate) fn file(run: &Path) -> PathBuf {
    run.join("edits.toml")
}

/// The edits of a run; none where it has no list.
pub(crate) fn read(run: &Path) -> Result<Edits, Failure> {
    let path = file(run);
    if !path.exists() {
        return Ok(Edits::default());
    }
    let text = std::io::read_to_string(files::open(&path)?).map_err(|error| Failure::reading(&path, &error))?;
    Edits::from_toml(&text).map_err(|error| {
        Failure::new(Exit::Rejected, "edits.syntax", format!("could not use {}: {error}", path.display()))
    })
}

/// Writes the list; an empty one is no file.
pub(crate) fn write(run: &Path, edits: &Edits) -> Result<(), Failure> {
    let path = file(run);
    if edits.list.is_empty() {
        let gone = if path.exists() { std::fs::remove_file(&path) } else { Ok(()) };
        return gone.map_err(|error| Failure::writing(&path, &error));
    }
    files::write(&path, true, |out| out.write_all(edits.to_toml().as_bytes()))
        .map_err(|error| Failure::writing(&path, &error))
}

/// Applies the edits of a run to its recorded map.
pub(crate) fn apply(run: &Path, mapper: &mut Mapper) -> Result<(), Failure> {
    let path = file(run);
    read(run)?.apply(mapper).map_err(|error| {
        Failure::new(Exit::Rejected, "edits.unfit", format!("could not apply {}: {error}", path.display()))
            .help("topogrid edit RUN list shows them, topogrid edit RUN undo takes the last one back")
    })
}

/// Takes the edits of one run over to another that goes on from it: places keep their numbers.
pub(crate) fn copy(from: &Path, to: &Path) -> Result<(), Failure> {
    let edits = read(from)?;
    if edits.list.is_empty() {
        return Ok(());
    }
    std::fs::create_dir_all(to).map_err(|error| Failure::writing(to, &error))?;
    write(to, &edits)
}
