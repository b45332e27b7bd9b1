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
    for file in ["map.pgm", "map.yaml", "map.png", "layers/free.png", "layers/legend.json"] {
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

/// A run of the bundled log.
fn office(folder: &std::path::Path) -> std::path::PathBuf {
    let (log, run) =
        (concat!(env!("CARGO_MANIFEST_DIR"), "/../../fixtures/logs/office_loop.log"), folder.join("office"));
    topogrid().arg("run").arg(log).arg("-o").arg(&run).assert().code(0);
    run
}

#[test]
fn a_run_is_drawn_again_without_mapping_again() {
    let (folder, _) = folder();
    let run = office(folder.path());
    topogrid().arg("grid").arg(&run).assert().code(0).stdout(contains("454 scans"));
    let same =
        |file: &str| std::fs::read(run.join(file)).unwrap() == std::fs::read(run.join("grid").join(file)).unwrap();
    assert!(same("map.pgm") && same("map.yaml") && same("layers/occupied.png"), "nothing was asked to be different");
    topogrid().arg("grid").arg(&run).assert().code(2).stderr(contains("holds another map"));
    let json = |arguments: &[&str]| {
        let out = folder.path().join("again");
        let output =
            topogrid().arg("grid").arg(&run).args(arguments).arg("-o").arg(&out).args(["--force", "--json"]).output();
        let output = output.unwrap();
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        let report: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
        (out, report)
    };
    let (_, fine) = json(&["--resolution", "0.05", "--sonar", "shared"]);
    assert!(fine["resolution_m"] == 0.05 && fine["rows"].as_u64() > Some(400), "{fine}");
    let (out, cut) = json(&["--crop", "-2,-1,3,1", "--mode", "scale", "--range-max", "2.5"]);
    assert!(cut["rows"] == 20 && cut["columns"] == 50, "{cut}");
    assert!(std::fs::read_to_string(out.join("map_scale.yaml")).unwrap().contains("mode: scale"));
    let (out, _) = json(&["--mode", "raw", "--calculus", "bayes"]);
    assert!(out.join("map_raw.pgm").exists());
    topogrid().arg("compare").arg(&run).args(["--reference"]).arg(&run).assert().code(0).stdout(contains("wall F1"));
    topogrid()
        .arg("compare")
        .arg(&run)
        .args(["--poses", "truth"])
        .assert()
        .code(2)
        .stderr(contains("keeps no true poses"));
}

#[test]
fn what_cannot_be_drawn_leaves_nothing_behind() {
    let (folder, _) = folder();
    let (log, out) = (folder.path().join("room.log"), folder.path().join("map"));
    std::fs::write(&log, room()).unwrap();
    for (arguments, expected) in [
        (["--resolution", "0"], "resolution must be between"),
        (["--resolution", "1e-9"], "resolution must be between"),
        (["--resolution", "1e9"], "resolution must be between"),
        (["--resolution", "0.0001"], "use larger cells, or limit the sensor's range"),
        (["--range-max", "0"], "above 0"),
        (["--crop", "1,2,0,3"], "west below east"),
        (["--crop", "0,0,1e300,1"], "the box must reach"),
        (["--poses", "nowhere.tum"], "nowhere.tum"),
    ] {
        let failed = topogrid().arg("grid").arg(&log).arg("-o").arg(&out).args(arguments).assert().failure();
        failed.stderr(contains(expected));
        assert!(!out.exists(), "{arguments:?} left something behind");
    }
    topogrid().arg("grid").arg(&log).assert().code(2).stderr(contains("give --out"));
    topogrid().arg("grid").arg(folder.path()).assert().code(3).stderr(contains("holds no session.hmap"));
}

#[test]
fn a_turned_map_is_planned_on_in_its_own_frame() {
    let (folder, _) = folder();
    // Four metres of floor along x, turned by a quarter: it lies along y.
    let mut image = b"P5\n40 10\n255\n".to_vec();
    image.extend([254; 400]);
    std::fs::write(folder.path().join("floor.pgm"), image).unwrap();
    let yaml = folder.path().join("floor.yaml");
    let text = "image: floor.pgm\nresolution: 0.1\norigin: [1.0, 0.0, 1.5707963267948966]\nnegate: 0\n\
                occupied_thresh: 0.65\nfree_thresh: 0.196\n";
    std::fs::write(&yaml, text).unwrap();
    let plan = |to: &str| {
        let mut command = topogrid();
        command.arg("plan").arg(&yaml).args([
            "--from",
            "0.55,0.55",
            "--to",
            to,
            "--radius",
            "0.1",
            "--margin",
            "0",
            "--json",
        ]);
        command
    };
    let output = plan("0.55,3.45").output().unwrap();
    let report: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    let last = report["points_m"].as_array().unwrap().last().unwrap();
    assert!(
        (last[0].as_f64().unwrap() - 0.55).abs() < 0.06 && (last[1].as_f64().unwrap() - 3.45).abs() < 0.06,
        "{last}"
    );
    plan("3.45,0.55").assert().code(3).stderr(contains("outside the map"));
    for (from, to, expected) in [
        ("free_thresh: 0.196", "free_thresh: 0.9", "must be below `occupied_thresh`"),
        ("image: floor.pgm", "image: /etc/floor.pgm", "the name of a file in the folder"),
        ("resolution: 0.1", "resolution: 0", "between 0.0001 and 1000"),
    ] {
        std::fs::write(&yaml, text.replace(from, to)).unwrap();
        plan("0.55,3.45").assert().code(3).stderr(contains(expected));
    }
    std::fs::write(&yaml, text).unwrap();
    std::fs::write(folder.path().join("floor.pgm"), b"P5\n40 10\n255\nshort").unwrap();
    plan("0.55,3.45").assert().code(3).stderr(contains("ends after 5"));
}
