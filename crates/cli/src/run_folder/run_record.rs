use std::io;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use crate::exit::Exit;
use crate::failure::Failure;
use crate::files;
use crate::run_folder::calendar::Moment;
use crate::run_folder::hash::HashedFile;

/// The name of the record in a run folder.
pub(crate) const FILE: &str = "run.json";
const SCHEMA: &str = "topogrid/run/1";

/// How a run came about: what `run.json` holds. Only this file differs between two runs of the same log, by its times.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct RunRecord {
    pub(crate) schema: String,
    pub(crate) version: String,
    /// What was typed, without the program's own name.
    pub(crate) command: Vec<String>,
    /// Where it was typed, so that relative names can be found again.
    pub(crate) folder: PathBuf,
    pub(crate) seed: u64,
    pub(crate) started: String,
    pub(crate) seconds: f64,
    /// Whether the log was read to its end.
    pub(crate) complete: bool,
    /// Entries taken in so far.
    pub(crate) entries: usize,
    pub(crate) warnings: Vec<String>,
    pub(crate) inputs: Vec<HashedFile>,
    pub(crate) outputs: Vec<HashedFile>,
}

impl RunRecord {
    /// The record of a run that begins now with what was typed.
    pub(crate) fn begin(seed: u64, inputs: &[PathBuf]) -> Self {
        // What cannot be hashed (standard input, a pipe) is not listed.
        let hashed = |path: &PathBuf| HashedFile::read(path, path.display().to_string()).ok();
        let regular = inputs.iter().filter(|path| path.is_file());
        Self {
            schema: SCHEMA.into(),
            version: env!("CARGO_PKG_VERSION").into(),
            command: std::env::args().skip(1).collect(),
            folder: std::env::current_dir().unwrap_or_default(),
            seed,
            started: Moment::now().iso(),
            seconds: 0.0,
            complete: false,
            entries: 0,
            warnings: Vec::new(),
            inputs: regular.filter_map(hashed).collect(),
            outputs: Vec::new(),
        }
    }

    /// The record in a run folder.
    pub(crate) fn read(run: &Path) -> Result<Self, Failure> {
        let path = run.join(FILE);
        let text = io::read_to_string(files::open(&path)?).map_err(|error| Failure::reading(&path, &error))?;
        serde_json::from_str(&text).map_err(|error| {
            let message = format!("could not use {}: {error}", path.display());
            Failure::new(Exit::Rejected, "run.record", message)
        })
    }

    /// Writes it, with the hashes of all that lies in the folder.
    pub(crate) fn write(&mut self, run: &Path) -> Result<(), Failure> {
        self.outputs = outputs(run)?;
        let path = run.join(FILE);
        files::write(&path, true, |out| Ok(serde_json::to_writer_pretty(out, self)?))
            .map_err(|error| Failure::writing(&path, &error))
    }
}

/// Every file of a run folder but the record itself, by name.
pub(crate) fn outputs(run: &Path) -> Result<Vec<HashedFile>, Failure> {
    let mut names = Vec::new();
    list(run, Path::new(""), &mut names).map_err(|error| Failure::reading(run, &error))?;
    names.sort();
    let hashed = |name: &PathBuf| {
        let path = run.join(name);
        HashedFile::read(&path, name.display().to_string()).map_err(|error| Failure::reading(&path, &error))
    };
    names.iter().filter(|name| *name != Path::new(FILE)).map(hashed).collect()
}

fn list(run: &Path, inside: &Path, names: &mut Vec<PathBuf>) -> io::Result<()> {
    for entry in std::fs::read_dir(run.join(inside))? {
        let entry = entry?;
        let name = inside.join(entry.file_name());
        if entry.file_name().to_string_lossy().starts_with('.') {
            continue; // something else's, or half a file of ours
        }
        if entry.file_type()?.is_dir() {
            list(run, &name, names)?;
        } else {
            names.push(name);
        }
    }
    Ok(())
}
