use predicates::str::contains;
use serde_json::Value;

use crate::{demo, topogrid};

fn explain(arguments: &[&str]) -> String {
    demo::text(&[&["explain", demo::run().to_str().unwrap()], arguments].concat())
}

fn explained(arguments: &[&str]) -> Value {
    demo::json(&[&["explain", demo::run().to_str().unwrap()], arguments].concat())
}

#[test]
fn every_answer_fits_a_screen() {
    let told = explained(&[]);
    let story = told["loops"].as_array().unwrap().iter().find(|story| story["accepted"] == true).unwrap();
    let pair = format!("{}-{}", story["place"], story["known"]);
    let place = story["place"].to_string();
    let questions: [&[&str]; 6] =
        [&[], &["--loops"], &["--worst", "10"], &["--link", &pair], &["--place", &place], &["--without", &pair]];
    for question in questions {
        let text = explain(question);
        let widest = text.lines().map(|line| line.chars().count()).max().unwrap();
        assert!(text.lines().count() <= 24 && widest <= 110, "{question:?}: {widest} wide\n{text}");
    }
    assert!(explain(&["--loops", "--all"]).lines().count() > told["loops"].as_array().unwrap().len());
}

#[test]
fn loops_are_told_with_reasons_and_the_same_numbers_everywhere() {
    let told = explained(&["--loops"]);
    let loops = told["loops"].as_array().unwrap();
    let table = std::fs::read_to_string(demo::run().join("loops.csv")).unwrap();
    assert_eq!(table.lines().count(), loops.len() + 1);
    for (row, story) in table.lines().skip(1).zip(loops) {
        let sigmas = format!("{:.2}", story["residual_sigma"].as_f64().unwrap());
        assert!(row.starts_with(&format!("{},{},{}", story["place"], story["known"], story["accepted"])), "{row}");
        assert_eq!(row.split(',').nth(6), Some(sigmas.as_str()), "{row}");
        assert!(row.ends_with(&format!("\"{}\"", story["reason"].as_str().unwrap())), "{row}");
    }
    let text = explain(&["--loops"]);
    assert!(text.contains("refused") && text.contains("views agree"), "{text}");
}

#[test]
fn what_if_tells_energy_and_moves() {
    let told = explained(&["--loops"]);
    let story = told["loops"].as_array().unwrap().iter().find(|story| story["accepted"] == true).unwrap();
    let what_if = explained(&["--without", &format!("P{}–P{}", story["place"], story["known"])]);
    let what_if = &what_if["without"];
    assert!(what_if["energy_without"].as_f64() < what_if["energy_with"].as_f64());
    assert!(what_if["moved"].is_array() && what_if["parted"] == 0);
}

#[test]
fn slips_are_answered_with_what_exists() {
    let run = demo::run();
    let ask = |arguments: &[&str]| topogrid().arg("explain").arg(run).args(arguments).assert().code(2);
    ask(&["--place", "P9999"]).stderr(contains("P0 … P141"));
    ask(&["--link", "0-141"]).stderr(contains("P0 is joined to P"));
    ask(&["--link", "nonsense"]).stderr(contains("expected two places"));
    topogrid().arg("explain").arg("/nowhere").assert().code(3).stderr(contains("could not read"));
}
