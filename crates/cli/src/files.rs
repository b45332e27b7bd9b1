use std::fs::File;
use std::io::{self, BufReader, BufWriter, Write};
use std::path::Path;

use crate::exit::Exit;
use crate::failure::Failure;

/// Opens an input file; a folder is refused here, where its name is known.
pub(crate) fn open(path: &Path) -> Result<BufReader<File>, Failure> {
    let file = File::open(path).map_err(|error| Failure::reading(path, &error))?;
    if file.metadata().is_ok_and(|metadata| metadata.is_dir()) {
        let message = format!("could not read {}: it is a directory", path.display());
        return Err(Failure::new(Exit::Rejected, "input.directory", message).help("name the file itself"));
    }
    Ok(BufReader::with_capacity(1 << 18, file))
}

/// Writes a file whole or not at all: under a temporary name first. An existing file is kept unless `force` is set.
///
/// Gives back the error of the system, or of `content`; [`Failure::writing`] says it to the user.
pub(crate) fn write(
    path: &Path,
    force: bool,
    content: impl FnOnce(&mut dyn Write) -> io::Result<()>,
) -> io::Result<()> {
    if !force && path.exists() {
        return Err(io::Error::new(io::ErrorKind::AlreadyExists, "the file exists; use --force to replace it"));
    }
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let mut file = tempfile::NamedTempFile::new_in(folder)?;
    let mut out = BufWriter::new(file.as_file_mut());
    content(&mut out)?;
    out.flush()?;
    drop(out);
    readable_by_all(file.as_file())?;
    file.persist(path).map(|_| ()).map_err(|error| error.error)
}

/// Temporary files are private; results are not.
fn readable_by_all(file: &File) -> io::Result<()> {
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        file.set_permissions(std::fs::Permissions::from_mode(0o644))?;
    }
    Ok(())
}
