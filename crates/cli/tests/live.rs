use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpStream;
use std::process::{Command, Stdio};

use super::browser::judge;
use super::run::office_loop;
use super::topogrid;

/// What a server says when a path is asked for by a name of the machine.
fn get(address: &str, path: &str, host: &str) -> String {
    let mut server = TcpStream::connect(address).unwrap();
    write!(server, "GET {path} HTTP/1.1\r\nHost: {host}\r\n\r\n").unwrap();
    let mut answer = String::new();
    server.read_to_string(&mut answer).unwrap();
    answer
}

fn places(answer: &str) -> usize {
    let body = answer.split("\r\n\r\n").nth(1).unwrap();
    let state: serde_json::Value = serde_json::from_str(body).unwrap();
    state["places"].as_array().map_or(0, Vec::len)
}

#[test]
fn a_run_can_be_watched_and_comes_out_the_same() {
    let folder = tempfile::tempdir().unwrap();
    let (watched, alone) = (folder.path().join("watched"), folder.path().join("alone"));
    let mut run = Command::new(assert_cmd::cargo::cargo_bin("topogrid"))
        .args(["run", "-", "--live", "-o"])
        .arg(&watched)
        .stdin(Stdio::piped())
        .stdout(Stdio::null())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    // Half the log at once (what a log is shows by its first lines), then line by line until the map shows.
    let log = std::fs::read_to_string(office_loop()).unwrap();
    let mut lines = log.split_inclusive('\n');
    let mut input = run.stdin.take().unwrap();
    let half: String = lines.by_ref().take(log.lines().count() / 2).collect();
    input.write_all(half.as_bytes()).unwrap();
    let mut said = String::new();
    BufReader::new(run.stderr.take().unwrap()).read_line(&mut said).unwrap();
    let url = said.trim().strip_prefix("live: ").unwrap();
    let address = url.strip_prefix("http://").unwrap();
    assert!(address.starts_with("127.0.0.1:"), "{address}");
    assert!(get(address, "/", address).contains("<canvas"));
    assert!(get(address, "/secrets", address).starts_with("HTTP/1.1 404"));
    assert!(get(address, "/state", "evil.example").starts_with("HTTP/1.1 403"));
    let shown = lines.by_ref().any(|line| {
        input.write_all(line.as_bytes()).unwrap();
        places(&get(address, "/state", address)) >= 10
    });
    assert!(shown, "the map never showed");
    judge("live.mjs", &[url]);
    lines.for_each(|line| input.write_all(line.as_bytes()).unwrap());
    drop(input);
    assert!(run.wait().unwrap().success());

    topogrid().arg("run").arg(office_loop()).arg("-o").arg(&alone).assert().success();
    let session = |run: &std::path::Path| std::fs::read(run.join("session.hmap")).unwrap();
    assert!(session(&watched) == session(&alone), "watching changed the map");
}
