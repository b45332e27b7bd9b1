use predicates::prelude::*;
use predicates::str::contains;

use crate::topogrid;

/// A square driven around, whose last side came out 0.2 m too long, and a false closure between opposite corners.
const SQUARE: &str = "EDGE_SE2 0 1 1 0 1.5707963 100 0 0 100 0 400\nEDGE_SE2 1 2 1 0 1.5707963 100 0 0 100 0 400\n\
    EDGE_SE2 2 3 1 0 1.5707963 100 0 0 100 0 400\nEDGE_SE2 3 0 1.2 0 1.5707963 100 0 0 100 0 400\n";

fn json(arguments: &[&str], input: &str) -> serde_json::Value {
    let told = topogrid().arg("relax").args(arguments).arg("--json").write_stdin(input).assert().code(0);
    serde_json::from_slice(&told.get_output().stdout).unwrap()
}

#[test]
fn a_graph_without_vertices_is_relaxed_and_reads_back_at_its_optimum() {
    let folder = tempfile::tempdir().unwrap();
    let (out, svg) = (folder.path().join("relaxed.g2o.gz"), folder.path().join("relaxed.svg"));
    let files = ["-", "--out", out.to_str().unwrap(), "--svg", svg.to_str().unwrap(), "--covariance"];
    let first = json(&files, SQUARE);
    assert_eq!(first["vertices_made"], 4);
    assert_eq!(first["covariances"].as_array().unwrap().len(), 4);
    assert!(first["chi2"]["after"].as_f64() < first["chi2"]["before"].as_f64());
    assert!(std::fs::read_to_string(svg).unwrap().contains("<svg"));
    let again = json(&[out.to_str().unwrap(), "--headings", "given"], "");
    let (once, twice) = (first["chi2"]["after"].as_f64().unwrap(), again["chi2"]["after"].as_f64().unwrap());
    assert!((once - twice).abs() < 1e-9 * once);
    assert_eq!(again["certificate"]["kind"], "global optimum");
    topogrid().args(["relax", "-", "--out"]).arg(out).write_stdin(SQUARE).assert().code(1).stderr(contains("--force"));
}

#[test]
fn a_false_closure_is_let_go() {
    let with_false = format!("{SQUARE}EDGE_SE2 0 2 0 0 0 100 0 0 100 0 400\n");
    let told = json(&["-", "--robust", "gnc"], &with_false);
    assert_eq!(told["robust"]["rejected"][0]["edge"], 4);
    // Without --robust the certificate says that there is strain.
    let certificate = &json(&["-"], &with_false)["certificate"];
    let sigmas: Vec<f64> =
        certificate["strained"].as_array().unwrap().iter().map(|s| s["sigmas"].as_f64().unwrap()).collect();
    assert!(sigmas.len() == 5 && sigmas.is_sorted_by(|a, b| a >= b) && sigmas[0] > 10.0, "{sigmas:?}");
    assert_eq!(certificate["bridges"], 0);
    assert_eq!(told["robust"]["rejected"].as_array().unwrap().len(), 1);
}

#[test]
fn faults_say_where_and_what() {
    let case = |text: &'static str| topogrid().args(["relax", "-"]).write_stdin(text).assert().code(3);
    case("EDGE_SE2 0 1 a\n").stderr(contains("expected a finite number, found `a`").and(contains("-:1:14")));
    case("").stderr(contains("holds no"));
    case("EDGE_SE2 0 1 1 0 0 -1 0 0 1 0 1\n").stderr(contains("positive definite").and(contains("--robust")));
    case("EDGE_SE2 0 1 1 0 0 1 0 0 1 0 1\nEDGE_XY 0 1 1 0 1 0 1\n").stderr(contains("two graphs"));
}
