use predicates::prelude::*;
use predicates::str::contains;

use crate::topogrid;

/// A run folder with a path that is twice too long, its odometry four times, the truth, and a map.
fn run_folder() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let tum = |scale: f64| {
        (0..30).map(|k| format!("{k}.0 {} {} 0 0 0 0 1\n", scale * f64::from(k), f64::from(k % 5))).collect::<String>()
    };
    let write = |name: &str, text: &[u8]| std::fs::write(folder.path().join(name), text).unwrap();
    write("trajectory.tum", tum(2.0).as_bytes());
    write("odometry.tum", tum(4.0).as_bytes());
    write("true.tum", tum(1.0).as_bytes());
    write("true.relations", b"1.0 2.0 1.0 1.0 0 0 0 0\n1.0 21.0 20.0 0.0 0 0 0 0\n");
    let mut image = b"P5\n20 10\n255\n".to_vec();
    image.extend((0..200).map(|cell| if cell % 20 == 3 { 0u8 } else { 254 }));
    write("map.pgm", &image);
    write(
        "map.yaml",
        b"image: map.pgm\nresolution: 0.1\norigin: [0, 0, 0]\nnegate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.196\n",
    );
    folder
}

fn document(arguments: &[&str], folder: &tempfile::TempDir) -> serde_json::Value {
    let told = topogrid().current_dir(folder.path()).arg("evaluate").args(arguments).arg("--json").assert().code(0);
    serde_json::from_slice(&told.get_output().stdout).unwrap()
}

#[test]
fn a_run_is_judged_with_its_odometry_beside() {
    let folder = run_folder();
    let scores = document(&[".", "--truth", "true.tum", "--relations", "true.relations"], &folder);
    for name in ["max", "mean", "median", "min", "rmse", "sse", "std"] {
        assert!(scores["ate"]["translation_m"][name].is_number(), "{name}");
    }
    assert!(
        scores["odometry"]["ate"]["translation_m"]["rmse"].as_f64() > scores["ate"]["translation_m"]["rmse"].as_f64()
    );
    assert_eq!(scores["relations"]["far"]["translation_mean_m"], 20.0);
    assert_eq!(scores["relations"]["near"]["translation_mean_m"], 1.0);
    assert_eq!(scores["odometry"]["relations"]["far"]["translation_mean_m"], 60.0);
    assert!(scores["sharpness"]["wall_thickness_m"].as_f64().unwrap() < 0.11);
    topogrid()
        .current_dir(folder.path())
        .args(["evaluate", ".", "--truth", "true.tum"])
        .assert()
        .code(0)
        .stdout(contains("ATE rmse").and(contains("odometry")).and(contains("wall thickness")));
}

#[test]
fn a_run_is_judged_by_another_run() {
    let (folder, other) = (run_folder(), run_folder());
    let other = other.path().to_str().unwrap();
    let scores = document(&[".", "--reference", other], &folder);
    assert_eq!((&scores["ate"]["pairs"], &scores["ate"]["translation_m"]["max"]), (&30.into(), &0.0.into()));
    assert!(scores["odometry"]["ate"]["translation_m"]["max"].as_f64().unwrap() > 1.0);
}

#[test]
fn paths_whose_clocks_do_not_tick_together_are_compared_at_all_true_stamps() {
    let folder = run_folder();
    let line = |k: i32| format!("{} {} 0 0 0 0 0 1\n", 1.0 + 0.75 * f64::from(k), 2.0 * (1.0 + 0.75 * f64::from(k)));
    std::fs::write(folder.path().join("slow.tum"), (0..20).map(line).collect::<String>()).unwrap();
    let scores = document(&[".", "--truth", "slow.tum"], &folder);
    assert_eq!((&scores["ate"]["pairs"], &scores["ate"]["pairing"]), (&20.into(), &"interpolated".into()));
    let scores = document(&[".", "--truth", "slow.tum", "--pair", "nearest"], &folder);
    assert_eq!((&scores["ate"]["pairs"], &scores["ate"]["pairing"]), (&5.into(), &"nearest".into()));
}

#[test]
fn maps_are_compared() {
    let folder = run_folder();
    let scores = document(&[".", "--truth", "map.yaml"], &folder);
    assert_eq!(scores["map"]["free_iou"], 1.0);
    assert_eq!(scores["map"]["walls"][0]["precision"], 1.0);
    topogrid().current_dir(folder.path()).args(["evaluate", "true.tum", "--truth", "map.yaml"]).assert().code(2);
}

#[test]
fn gates_fail_with_4() {
    let folder = run_folder();
    let gate = |expression: &str| {
        let mut command = topogrid();
        command.current_dir(folder.path()).args(["evaluate", ".", "--truth", "true.tum", "--fail-on", expression]);
        command.assert()
    };
    gate("rmse>0.5").code(4).stderr(contains("gate"));
    gate("rmse>5000").code(0);
    gate("odometry.ate.translation_m.rmse<5000").code(4);
    gate("rsme>1").code(2);
    gate("rmse").code(2);
}

#[test]
fn what_cannot_be_compared_is_rejected() {
    let folder = run_folder();
    std::fs::write(folder.path().join("late.tum"), "900 0 0 0 0 0 0 1\n").unwrap();
    std::fs::write(folder.path().join("broken.tum"), "1 2 3\n").unwrap();
    let still = "FLASER 1 2.0 0 0 0 0 0 0 7 h 7\nFLASER 1 2.0 1 0 0 1 0 0 7 h 7\n";
    std::fs::write(folder.path().join("still.log"), still).unwrap();
    std::fs::create_dir(folder.path().join("empty")).unwrap();
    for (arguments, why) in [
        (["evaluate", ".", "--truth", "late.tum"], "--apart"),
        (["evaluate", ".", "--truth", "broken.tum"], "line 1"),
        (["evaluate", ".", "--truth", "still.log"], "--clock none"),
        (["evaluate", "empty", "--truth", "true.tum"], "no run folder"),
        (["evaluate", "none.tum", "--truth", "true.tum"], "could not read"),
    ] {
        topogrid().current_dir(folder.path()).args(arguments).assert().code(3).stderr(contains(why));
    }
}

#[test]
fn the_truth_of_a_log_judges_its_odometry() {
    let folder = run_folder();
    let line = |k: i32| format!("TRUEPOS {k} 0 0 0 0 0 {k} h {k}\nODOM {k} {k} 0 0 0 0 {k} h {k}\n");
    std::fs::write(folder.path().join("sim.log"), (0..9).map(line).collect::<String>()).unwrap();
    let scores = document(&["sim.log", "--truth", "sim.log", "--align", "none"], &folder);
    assert_eq!(scores["ate"]["translation_m"]["max"], 8.0);
}

#[test]
fn a_run_with_its_session_is_asked_what_it_recognised() {
    let folder = tempfile::tempdir().unwrap();
    // Forty metres to and fro, four times; the recogniser is right every four metres, and wrong as often.
    let mut text = String::new();
    for k in 0..400 {
        let (stamp, leg) = (0.5 * f64::from(k), f64::from(k / 100));
        let gone = 0.4 * f64::from(k % 100);
        let x = if k / 100 % 2 == 0 { gone } else { 40.0 - gone };
        let heading = leg * std::f64::consts::PI;
        text += &format!("TRUEPOS {x} 0 {heading} {x} 0 {heading} {stamp} h {stamp}\n");
        let (x, y) = (1.01 * x, 0.003 * f64::from(k));
        text += &format!("ODOM {x} {y} {heading} 0 0 0 {stamp} h {stamp}\n");
        if k >= 200 && k % 10 == 0 {
            let (right, wrong) = (stamp - 100.0, stamp - 80.0);
            text += &format!("LOOP {right} 0.9 {stamp} h {stamp}\nLOOP {wrong} 0.1 {stamp} h {stamp}\n");
        }
    }
    std::fs::write(folder.path().join("blind.log"), text).unwrap();
    topogrid().current_dir(folder.path()).args(["run", "blind.log", "-o", "run"]).assert().code(0);
    let scores = document(&["run", "--truth", "blind.log"], &folder);
    let recognition = &scores["recognition"];
    assert_eq!(recognition["precision"], 1.0, "{recognition}");
    assert!(recognition["recall"].as_f64().unwrap() > 0.1, "{recognition}");
    assert!(scores["localization"]["uncertainty_coefficient"].as_f64().unwrap() > 0.3, "{scores}");
    assert!(scores["sharpness"]["free_m2"].as_f64().unwrap() > 8.0, "the floor that its body swept is free: {scores}");
    assert!(scores["odometry"]["localization"]["accuracy"].is_number());
    let scores = document(&["run", "--truth", "run/map.yaml"], &folder);
    assert_eq!(scores["map"]["free_iou"], 1.0);
    assert!(scores["odometry"]["map"]["free_iou"].as_f64().unwrap() < 1.0, "the odometry's own map is compared, too");
}
