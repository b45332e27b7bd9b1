use std::path::{Path, PathBuf};
use std::sync::OnceLock;

use serde_json::Value;

use crate::topogrid;

/// A run of the bundled log, made once for all tests that only look at it.
pub(crate) fn run() -> &'static Path {
    static RUN: OnceLock<(tempfile::TempDir, PathBuf)> = OnceLock::new();
    &RUN.get_or_init(|| {
        let folder = tempfile::tempdir().unwrap();
        let out = folder.path().join("office");
        topogrid().arg("demo").arg("-o").arg(&out).assert().success();
        (folder, out)
    })
    .1
}

/// A copy of that run, to be changed.
pub(crate) fn copy() -> (tempfile::TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("office");
    let layers = out.join("layers");
    std::fs::create_dir_all(&layers).unwrap();
    for (from, to) in [(run().to_owned(), &out), (run().join("layers"), &layers)] {
        for entry in std::fs::read_dir(from).unwrap().flatten().filter(|entry| entry.path().is_file()) {
            std::fs::copy(entry.path(), to.join(entry.file_name())).unwrap();
        }
    }
    (folder, out)
}

/// What a command prints as JSON.
pub(crate) fn json(arguments: &[&str]) -> Value {
    let told = topogrid().args(arguments).arg("--json").assert().success();
    serde_json::from_slice(&told.get_output().stdout).unwrap()
}

/// What a command prints.
pub(crate) fn text(arguments: &[&str]) -> String {
    let told = topogrid().args(arguments).assert().success();
    String::from_utf8(told.get_output().stdout.clone()).unwrap()
}

/// The figures of a run.
pub(crate) fn metrics(run: &Path) -> Value {
    serde_json::from_slice(&std::fs::read(run.join("metrics.json")).unwrap()).unwrap()
}
