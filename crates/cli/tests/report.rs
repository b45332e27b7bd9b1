use std::path::{Path, PathBuf};

use super::browser::judge;
use super::topogrid;

/// Maps the bundled log; the folder goes when it is dropped.
fn demo() -> (tempfile::TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("demo");
    topogrid().arg("demo").arg("-o").arg(&out).assert().success();
    (folder, out)
}

fn read(path: &Path) -> String {
    std::fs::read_to_string(path).unwrap()
}

/// The page's text without its data and its script.
fn body(page: &str) -> &str {
    page.split("<script").next().unwrap()
}

#[test]
fn the_page_is_whole_in_itself_small_and_readable_without_its_script() {
    let (_folder, out) = demo();
    let page = read(&out.join("report.html"));
    assert!(page.len() < 3_000_000, "{} bytes", page.len());
    for outside in ["src=\"http", "href=\"http", "url(http", "@import", "fetch(", "XMLHttpRequest"] {
        assert!(!page.contains(outside), "the page asks for {outside}");
    }
    let body = body(&page);
    assert!(!body.contains("{{"), "something was left to be filled in");
    assert!(body.contains("<image id=\"fuzzy\" href=\"data:image/png;base64,"));
    assert!(body.matches("<table>").count() >= 6 && body.matches("<svg").count() >= 4);
}

#[test]
fn the_page_states_the_figures_of_the_run() {
    let (_folder, out) = demo();
    let page = read(&out.join("report.html"));
    let metrics: serde_json::Value = serde_json::from_str(&read(&out.join("metrics.json"))).unwrap();
    let number = |path: &str| metrics.pointer(path).and_then(serde_json::Value::as_f64).unwrap();
    let stated = [
        format!("<dt>Places</dt><dd><b>{}</b>", number("/places")),
        format!("<small>{} of them recognised</small>", number("/links/recognized")),
        format!("<dt>Energy</dt><dd><b>{:.4}</b>", number("/relaxation/energy_after")),
        format!("<b>{} × {}</b>", number("/grid/rows"), number("/grid/columns")),
        format!("<dt>Error of places</dt><dd><b>{:.2} m</b>", number("/truth/after_m")),
        format!("<td class=\"n\">{:.3}</td>", number("/timings_s/grid")),
        format!("{} loops closed, {} refused", number("/links/recognized"), number("/links/rejected")),
    ];
    for one in stated {
        assert!(page.contains(&one), "the page does not state {one}");
    }
    let loops = read(&out.join("loops.csv"));
    assert_eq!(body(&page).matches("● accepted").count(), loops.matches(",true,").count());
    assert_eq!(body(&page).matches("○ refused").count(), loops.matches(",false,").count());
}

#[test]
fn the_page_can_be_drawn_again_from_the_run() {
    let (_folder, out) = demo();
    let page = read(&out.join("report.html"));
    std::fs::remove_file(out.join("report.html")).unwrap();
    let printed = topogrid().arg("report").arg(&out).output().unwrap();
    assert_eq!(String::from_utf8(printed.stdout).unwrap().trim(), out.join("report.html").to_str().unwrap());
    assert!(read(&out.join("report.html")) == page, "the same run has the same page");
    topogrid().arg("report").arg(out.join("config.toml")).assert().code(3);
}

#[test]
fn the_page_works_in_a_browser() {
    let (_folder, out) = demo();
    judge("report.mjs", &[out.join("report.html").to_str().unwrap()]);
}

#[test]
fn runs_are_compared_on_a_page_to_blink_between() {
    let (folder, one) = demo();
    let two = folder.path().join("coarse");
    topogrid().args(["demo", "--resolution", "0.2", "-o"]).arg(&two).assert().success();
    let page = folder.path().join("compare.html");
    let compared = topogrid().arg("compare").arg(&one).arg(&two).arg("-o").arg(&page).arg("--json").output().unwrap();
    let said: serde_json::Value = serde_json::from_slice(&compared.stdout).unwrap();
    assert_eq!((&said["first"], &said["others"][0]["run"]), (&"demo".into(), &"coarse".into()));
    let cells = |kind: &str| said["others"][0]["cells"][kind].as_u64().unwrap();
    assert!(cells("free") > 10 * (cells("appeared") + cells("vanished")), "the same rooms, drawn coarser: {said}");
    // A map held against itself has not changed.
    let itself =
        topogrid().arg("compare").arg(&one).arg(&one).arg("-o").arg(&page).args(["--force", "--json"]).output();
    let said: serde_json::Value = serde_json::from_slice(&itself.unwrap().stdout).unwrap();
    for kind in ["appeared", "vanished", "found", "lost"] {
        assert_eq!(said["others"][0]["cells"][kind], 0, "{said}");
    }
    topogrid().arg("compare").arg(&one).arg(&two).arg("-o").arg(&page).arg("--force").assert().success();
    judge("compare.mjs", &[page.to_str().unwrap()]);
}
