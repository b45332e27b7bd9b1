use predicates::prelude::PredicateBooleanExt;
use predicates::str::contains;

use crate::{demo, topogrid};

#[test]
fn settings_come_in_layers_and_say_from_which() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("topogrid.toml"), "[grid]\nresolution_m = 0.2\n[places]\nspacing_m = 0.9\n")
        .unwrap();
    std::fs::write(folder.path().join("mine.toml"), "[places]\nspacing_m = 0.8\n").unwrap();
    let told = topogrid()
        .current_dir(folder.path())
        .env("TOPOGRID_RECOGNITION_AGREEMENT", "4")
        .env("TOPOGRID_RECOGNITION_AGREMENT", "5")
        .args(["config", "show", "--config", "mine.toml", "--set", "heading.source=odometry"])
        .assert()
        .success()
        .stderr(contains("did you mean TOPOGRID_RECOGNITION_AGREEMENT?"));
    let text = String::from_utf8(told.get_output().stdout.clone()).unwrap();
    let line = |key: &str| text.lines().find(|line| line.starts_with(key)).unwrap_or_default().to_owned();
    assert!(line("grid.resolution_m = 0.2").ends_with("# topogrid.toml"), "{text}");
    assert!(line("places.spacing_m = 0.8").ends_with("# mine.toml"), "{text}");
    assert!(line("recognition.agreement = 4").ends_with("# $TOPOGRID_RECOGNITION_AGREEMENT"), "{text}");
    assert!(line("heading.source = \"odometry\"").ends_with("# --set"), "{text}");
    assert!(line("recognition.floor").ends_with("# built in"), "{text}");
    assert!(text.lines().count() <= 24);
}

#[test]
fn slips_are_corrected_and_keys_explained() {
    topogrid().args(["demo", "--set", "places.spacng_m=2"]).assert().code(2).stderr(contains("`places.spacing_m`"));
    topogrid().args(["demo", "--set", "heading.source=compas"]).assert().code(2).stderr(contains("compass"));
    let about = demo::text(&["config", "explain", "places.spacing_m"]);
    assert!(about.contains("Distance between places") && about.contains("TOPOGRID_PLACES_SPACING_M"), "{about}");
    topogrid()
        .args(["config", "explain", "spacing"])
        .assert()
        .code(2)
        .stderr(contains("did you mean").or(contains("config show")));
}

#[test]
fn the_file_that_is_printed_to_begin_with_changes_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("topogrid.toml");
    std::fs::write(&file, demo::text(&["config", "init"])).unwrap();
    let shown = topogrid().current_dir(folder.path()).args(["config", "show"]).assert().success();
    let text = String::from_utf8(shown.get_output().stdout.clone()).unwrap();
    let values =
        |text: &str| text.lines().map(|line| line.split('#').next().unwrap().trim().to_owned()).collect::<Vec<_>>();
    assert_eq!(values(&text), values(&demo::text(&["config", "show"])));
    assert!(text.lines().all(|line| line.ends_with("# topogrid.toml")), "{text}");
}

#[test]
fn shells_and_manuals_are_served() {
    let folder = tempfile::tempdir().unwrap();
    for shell in ["bash", "zsh", "fish"] {
        assert!(demo::text(&["completions", shell]).contains("nav2-route"), "{shell}");
    }
    topogrid().arg("man").arg(folder.path()).assert().success().stderr(contains("pages"));
    let page = std::fs::read_to_string(folder.path().join("topogrid-explain.1")).unwrap();
    assert!(page.contains("without"));
}
