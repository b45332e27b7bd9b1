use predicates::prelude::PredicateBooleanExt;
use predicates::str::contains;

use crate::browser::judge;
use crate::topogrid;

const ROOM: &str =
    "name = 'room'\nstart = [1, 1, 0]\n[[wall]]\npoints = [[0, 0], [5, 0], [5, 4], [0, 4]]\nclosed = true\n";

fn room() -> (tempfile::TempDir, std::path::PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let world = folder.path().join("room.toml");
    std::fs::write(&world, ROOM).unwrap();
    (folder, world)
}

#[test]
fn waypoints_become_a_log_that_inspect_reads_and_a_seed_repeats() {
    let (folder, world) = room();
    let waypoints = folder.path().join("ways.txt");
    std::fs::write(&waypoints, "# there and back\n4 1\n4 3\n\n1, 3\n").unwrap();
    let drive = |out: &str, seed: &str| {
        let out = folder.path().join(out);
        let mut command = topogrid();
        command.arg("simulate").arg(&world).arg("--waypoints").arg(&waypoints).args(["--seed", seed, "--json", "-o"]);
        let output = command.arg(&out).assert().code(0).get_output().stdout.clone();
        let report: serde_json::Value = serde_json::from_slice(&output).unwrap();
        assert!((report["path_length_m"].as_f64().unwrap() - 8.0).abs() < 0.1, "{report}");
        std::fs::read(out).unwrap()
    };
    let log = drive("a.log", "3");
    assert_eq!(log, drive("b.log", "3"));
    assert_ne!(log, drive("c.log", "4"));
    topogrid().arg("inspect").arg(folder.path().join("a.log")).assert().code(0).stdout(contains("healthy"));
}

#[test]
fn frames_are_pictures() {
    let (folder, world) = room();
    let waypoints = folder.path().join("ways.txt");
    std::fs::write(&waypoints, "3 1\n").unwrap();
    let frames = folder.path().join("frames");
    let mut command = topogrid();
    command.arg("simulate").arg(&world).arg("--waypoints").arg(&waypoints).arg("--frames").arg(&frames);
    command.args(["-o", "-"]).assert().code(0).stdout(contains("SONAR").and(contains("TRUEPOS")));
    let first = std::fs::read(frames.join("frame-00001.png")).unwrap();
    assert!(first.starts_with(b"\x89PNG"));
}

#[test]
fn what_cannot_be_simulated_is_said_with_a_way_out() {
    let (folder, world) = room();
    let in_wall = folder.path().join("ways.txt");
    std::fs::write(&in_wall, "9 1\n").unwrap();
    let simulate = || {
        let mut command = topogrid();
        command.current_dir(folder.path()).arg("simulate");
        command
    };
    simulate().arg(&world).arg("--tour").assert().code(2).stderr(contains("--waypoints"));
    simulate().arg("nowhere").assert().code(2).stderr(contains("office-loop"));
    simulate().arg("none.toml").assert().code(3).stderr(contains("none.toml"));
    simulate().arg("plan.png").assert().code(2).stderr(contains("--resolution"));
    simulate().arg("random:x").assert().code(2).stderr(contains("whole number"));
    simulate().args(["flat", "--robot", "r2d2"]).assert().code(2).stderr(contains("nomad200"));
    let blocked = "tour cannot be driven: waypoint 1 at (9.00, 1.00)";
    simulate().arg(&world).arg("--waypoints").arg(&in_wall).assert().code(3).stderr(contains(blocked));
    std::fs::write(&in_wall, "1 1\nhere\n").unwrap();
    simulate().arg(&world).arg("--waypoints").arg(&in_wall).assert().code(3).stderr(contains("ways.txt:2"));
    std::fs::write(folder.path().join("bad.toml"), "name = 'bad'").unwrap();
    simulate().arg("bad.toml").assert().code(3).stderr(contains("has no wall"));
    assert!(!folder.path().join("room-1.log").exists());
}

#[test]
fn a_room_is_explored_to_the_end() {
    let (folder, world) = room();
    let out = folder.path().join("explored.log");
    let mut command = topogrid();
    command.arg("simulate").arg(&world).args(["--json", "-o"]).arg(&out);
    let output = command.assert().code(0).get_output().stdout.clone();
    let report: serde_json::Value = serde_json::from_slice(&output).unwrap();
    let explored = &report["exploration"];
    assert_eq!(explored["complete"], true, "{report}");
    assert_eq!(explored["predicted_places"], 0, "{report}");
    assert!((4..30).contains(&explored["places"].as_u64().unwrap()), "{report}"); // 5 × 4 m, a place per metre or so
    assert!(explored["coverage"].as_f64().unwrap() > 0.9, "{report}");
    topogrid().arg("inspect").arg(&out).assert().code(0).stdout(contains("healthy"));
}

#[test]
fn the_experiment_is_reproduced_with_its_tables_and_figures() {
    let (folder, world) = room();
    let out = folder.path().join("reproduced");
    let reproduce = || {
        let mut command = topogrid();
        command.arg("reproduce").arg("--world").arg(&world).arg("-o").arg(&out);
        command
    };
    reproduce()
        .assert()
        .success()
        .stdout(contains("| places | 137 |").and(contains("| runs that end by themselves | | 1 of 1 |")));
    let text = |name: &str| std::fs::read_to_string(out.join(name)).unwrap();
    assert!(text("reproduce.md").contains("topogrid reproduce --world"));
    assert!(text("fig3-environment.svg").starts_with("<svg") && text("fig4-topology.svg").contains("class=\"place\""));
    assert!(std::fs::read(out.join("fig5-gridmap.png")).unwrap().starts_with(b"\x89PNG"));
    reproduce().assert().code(2).stderr(contains("--force")); // nothing is overwritten unasked
}

#[test]
fn the_map_of_an_explorer_is_a_run_with_the_places_that_it_expected() {
    let folder = tempfile::tempdir().unwrap();
    let (out, log) = (folder.path().join("explored"), folder.path().join("flat.log"));
    let explored = || {
        let mut command = topogrid();
        command.args(["simulate", "flat", "--seed", "3", "--until", "700", "-o"]).arg(&log);
        command.arg("--run").arg(&out).assert().code(0).stdout(contains("still predicted"));
        let metrics = crate::demo::metrics(&out);
        let page = std::fs::read_to_string(out.join("report.html")).unwrap();
        let data = page.split("id=\"data\">").nth(1).unwrap().split("</script>").next().unwrap().to_owned();
        let data: serde_json::Value = serde_json::from_str(&data).unwrap();
        (metrics, data["places"]["state"].as_str().unwrap().to_owned())
    };
    let (metrics, states) = explored();
    let count = |letter: char| states.matches(letter).count() as u64;
    assert_eq!(metrics["places"].as_u64(), Some(count('v')));
    assert_eq!(metrics["predicted_places"].as_u64(), Some(count('p')));
    assert!(count('v') > 5 && count('p') > 0, "{states}");
    judge("explored.mjs", &[out.join("report.html").to_str().unwrap()]);
    // What looks at a run looks at this one as well, and a session that is read back has the same places; only what
    // they look like is drawn again, from all that was seen before the robot came to the next one.
    let drawn = |page: &std::path::Path| {
        let text = std::fs::read_to_string(page).unwrap();
        let (before, pictures) = text.split_once("\"sheets\":[").unwrap();
        before.to_owned() + pictures.split_once(']').unwrap().1
    };
    let again = folder.path().join("again.html");
    topogrid().arg("report").arg(&out).arg("-o").arg(&again).assert().code(0);
    assert!(drawn(&again) == drawn(&out.join("report.html")));
    topogrid().arg("explain").arg(&out).assert().code(0);
    topogrid().arg("view").arg(&out).arg("--term").assert().code(0).stdout(contains("# occupied"));
    topogrid().args(["simulate", "flat", "--tour", "--run"]).arg(&out).assert().code(2);
}
