pub(crate) mod calendar;
pub(crate) mod hash;
pub(crate) mod run_record;
pub(crate) mod verify;

use std::io::{self, Write};
use std::path::{Path, PathBuf};

use crate::exit::Exit;
use crate::failure::Failure;
use crate::files;

/// The folder that a run fills; every file is written whole or not at all.
#[derive(Debug)]
pub(crate) struct RunFolder {
    path: PathBuf,
}

impl RunFolder {
    /// Chooses the folder `path`, or `runs/NAME` with a number behind it where one of that name exists; never one that
    /// something is in already, unless `force` is set.
    pub(crate) fn choose(path: Option<&Path>, name: &str, force: bool) -> Result<Self, Failure> {
        let path = match path {
            Some(path) if force || is_free(path) => path.to_owned(),
            Some(path) => {
                let message = format!("could not write into {}: the folder holds another run", path.display());
                return Err(Failure::new(Exit::Usage, "run.folder", message).help("choose another --out, or --force"));
            }
            None if force => Path::new("runs").join(name),
            None => free_name(&Path::new("runs").join(name)),
        };
        Ok(Self { path })
    }

    /// A folder that is there already and whose files are written anew.
    pub(crate) fn existing(path: &Path) -> Self {
        Self { path: path.to_owned() }
    }

    pub(crate) fn path(&self) -> &Path {
        &self.path
    }

    /// How many files it holds, and how many bytes.
    pub(crate) fn size(&self) -> (usize, u64) {
        let mut folders = vec![self.path.clone()];
        let (mut files, mut bytes) = (0, 0);
        while let Some(folder) = folders.pop() {
            for entry in std::fs::read_dir(folder).into_iter().flatten().flatten() {
                match entry.metadata() {
                    Ok(metadata) if metadata.is_dir() => folders.push(entry.path()),
                    Ok(metadata) => (files, bytes) = (files + 1, bytes + metadata.len()),
                    Err(_) => {}
                }
            }
        }
        (files, bytes)
    }

    /// Writes one file of the run; the first one makes the folder.
    pub(crate) fn write(
        &self,
        name: &str,
        content: impl FnOnce(&mut dyn Write) -> io::Result<()>,
    ) -> Result<(), Failure> {
        std::fs::create_dir_all(&self.path).map_err(|error| Failure::writing(&self.path, &error))?;
        let path = self.path.join(name);
        files::write(&path, true, content).map_err(|error| Failure::writing(&path, &error))
    }
}

fn is_free(path: &Path) -> bool {
    std::fs::read_dir(path).is_ok_and(|mut entries| entries.next().is_none()) || !path.exists()
}

/// `path` itself, or with the first number behind it that is not taken.
fn free_name(path: &Path) -> PathBuf {
    let numbered = (2..).map(|number| PathBuf::from(format!("{}-{number}", path.display())));
    std::iter::once(path.to_owned()).chain(numbered).find(|path| is_free(path)).unwrap_or_else(|| path.to_owned())
}
