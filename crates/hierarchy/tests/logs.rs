use std::fs::File;
use std::io::BufReader;
use std::path::{Path, PathBuf};

use hierarchy::{Config, Mapper, Truth};
use robot_log::{CarmenOptions, Clock, Entry, EntryKind, Input, ReadOptions, RobotDescription, open_log};

/// The log that the repository ships.
pub(crate) fn office_loop() -> Vec<Entry> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fixtures/logs/office_loop.log");
    entries(&[path], None)
}

/// A folder of real logs beside the project, or `None`, said plainly, where it is absent.
pub(crate) fn shared(folder: &str) -> Option<PathBuf> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data").join(folder);
    if path.exists() {
        return Some(path);
    }
    println!("skipped: {} is not present", path.display());
    None
}

pub(crate) fn entries(files: &[PathBuf], robot: Option<&str>) -> Vec<Entry> {
    let input = |path: &PathBuf| Input::new(path.display().to_string(), BufReader::new(File::open(path).unwrap()));
    let robot = robot.map(|name| RobotDescription::builtin(name).unwrap());
    let log = open_log(files.iter().map(input).collect(), &ReadOptions { robot, ..ReadOptions::default() }).unwrap();
    log.map(Result::unwrap).collect()
}

/// The entries of a CARMEN log whose stamps cannot be used.
pub(crate) fn stampless(file: &Path) -> Vec<Entry> {
    let input = Input::new(file.display().to_string(), BufReader::new(File::open(file).unwrap()));
    let carmen = CarmenOptions { clock: Clock::Counted { period: 1.0 }, lenient: true, ..CarmenOptions::default() };
    open_log(vec![input], &ReadOptions { carmen, ..ReadOptions::default() }).unwrap().map(Result::unwrap).collect()
}

pub(crate) fn map(entries: &[Entry], config: Config) -> Mapper {
    let mut mapper = Mapper::new(config).unwrap();
    for entry in entries {
        mapper.push(entry).unwrap();
    }
    mapper.finish().unwrap();
    mapper
}

pub(crate) fn truth(entries: &[Entry]) -> Truth {
    let mut truth = Truth::default();
    for entry in entries {
        if let EntryKind::Truth { map_from_robot } = entry.kind {
            truth.push(entry.stamp, map_from_robot);
        }
    }
    truth
}
