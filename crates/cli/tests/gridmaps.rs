use predicates::str::contains;

use crate::{folder, topogrid};

/// A robot that stands in the middle of a square room and turns its laser once.
fn room() -> String {
    let ranges: Vec<String> = (0..360)
        .map(|degree| {
            let bearing = (f64::from(degree) - 90.0).to_radians();
            format!("{:.3}", 2.0 / bearing.cos().abs().max(bearing.sin().abs()))
        })
        .collect();
    let half = |from: usize, heading: f64, stamp: f64| {
        let beams = ranges[from..from + 181.min(360 - from)].join(" ");
        let count = 181.min(360 - from);
        format!("FLASER {count} {beams} 1 1 {heading} 1 1 {heading} {stamp} h {stamp}\n")
    };
    // The same half room seen six times, so that cells are sure.
    (0..6).map(|k| half(0, 0.0, f64::from(k))).collect()
}

#[test]
fn a_log_with_known_poses_becomes_a_map_and_a_path() {
    let (folder, _) = folder();
    let log = folder.path().join("room.log");
    std::fs::write(&log, room()).unwrap();
    let out = folder.path().join("map");
    topogrid().arg("grid").arg(&log).arg("-o").arg(&out).assert().code(0).stdout(contains("6 scans"));
    for file in ["map.pgm", "map.yaml", "map.png", "layers/empty.png", "layers/legend.json"] {
        assert!(out.join(file).exists(), "{file}");
    }
    topogrid().arg("grid").arg(&log).arg("-o").arg(&out).assert().code(2).stderr(contains("holds another map"));
    let plan = |from: &str, to: &str| {
        let mut command = topogrid();
        command.arg("plan").arg(&out).args(["--from", from, "--to", to, "--radius", "0.1", "--margin", "0"]);
        command
    };
    let picture = folder.path().join("path.png");
    plan("1.5,1.2", "2.5,1.8").arg("-o").arg(&picture).assert().code(0).stdout(contains("risk at most"));
    assert!(picture.exists());
    plan("1.5,1.2", "50,1").assert().code(3).stderr(contains("outside the map"));
    plan("1.5,1.2", "3.05,1.2").assert().code(3).stderr(contains("is unsafe"));
    let yaml = out.join("map.yaml");
    topogrid().args(["plan"]).arg(&yaml).args(["--from", "1.5,1.2", "--to", "2.5,1.8"]).assert().code(0);
    let text = std::fs::read_to_string(&yaml).unwrap();
    std::fs::remove_dir_all(out.join("layers")).unwrap();
    std::fs::write(&yaml, text.replace("map.pgm", "../map.pgm")).unwrap();
    plan("1.5,1.2", "2.5,1.8").assert().code(3).stderr(contains("the name of a file in the folder"));
}

#[test]
fn poses_come_from_a_trajectory() {
    let (folder, _) = folder();
    let (log, path) = (folder.path().join("room.log"), folder.path().join("path.tum"));
    std::fs::write(&log, room()).unwrap();
    std::fs::write(&path, "0 10 0 0 0 0 0 1\n3 10 0 0 0 0 0 1\n").unwrap();
    let grid = |poses: &str, out: &str| {
        let mut command = topogrid();
        command.arg("grid").arg(&log).args(["--poses", poses, "-o"]).arg(folder.path().join(out));
        command
    };
    let path = path.to_str().unwrap();
    grid(path, "moved")
        .arg("--json")
        .assert()
        .code(0)
        .stdout(contains("\"scans\": 4"))
        .stdout(contains("\"left_out\": 2"));
    grid("truth", "none").assert().code(3).stderr(contains("none of the log's 6 scans has a pose"));
    grid(path, "fine").args(["--resolution", "1e-9"]).assert().code(3).stderr(contains("resolution must be between"));
}

#[test]
fn calculi_are_compared_in_one_table() {
    let (folder, _) = folder();
    let (log, out) = (folder.path().join("room.log"), folder.path().join("compare.png"));
    std::fs::write(&log, room()).unwrap();
    let assert = topogrid().arg("compare").arg(&log).arg("-o").arg(&out).assert().code(0);
    assert.stdout(contains("dempster-shafer")).stdout(contains("mean conflict"));
    assert!(out.exists());
}
