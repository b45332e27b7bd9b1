//! The pages in a real browser, where there is one.

use std::path::{Path, PathBuf};
use std::process::Command;

/// Runs a script of `tests/browser` on a page; its screenshots stay in `target/tmp/browser`.
///
/// Skipped with a plain word where Chromium, node or playwright-core is missing; `.ci/setup` installs them.
pub(crate) fn judge(script: &str, arguments: &[&str]) {
    let target = Path::new(env!("CARGO_TARGET_TMPDIR"));
    let modules = target.with_file_name("browser");
    if let Some(missing) = missing(&modules) {
        println!("skipped: {missing} (.ci/setup installs it)");
        return;
    }
    let scripts = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/browser");
    let mut node = Command::new("node");
    node.arg(scripts.join(script)).arg(&modules).arg(target.join("browser")).args(arguments);
    let judged = node.output().unwrap();
    let said = String::from_utf8_lossy(&judged.stdout);
    assert!(judged.status.success(), "{said}\n{}", String::from_utf8_lossy(&judged.stderr));
    println!("{said}");
}

fn missing(modules: &Path) -> Option<String> {
    let chromium = std::env::var_os("CHROMIUM").map_or_else(|| PathBuf::from("/usr/bin/chromium"), PathBuf::from);
    if !chromium.exists() {
        return Some(format!("{} is not there", chromium.display()));
    }
    if !modules.join("node_modules/playwright-core").exists() {
        return Some("playwright-core is not there".to_owned());
    }
    Command::new("node").arg("--version").output().err().map(|_| "node is not there".to_owned())
}
