use std::path::Path;

use crate::topogrid;

/// The commands that the front page tells people to type work, in its order, on the bundled log.
#[test]
fn the_commands_of_the_front_page_work() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let page = std::fs::read_to_string(root.join("README.md")).unwrap();
    let folder = tempfile::tempdir().unwrap();
    std::fs::copy(root.join("fixtures/logs/office_loop.log"), folder.path().join("office.log")).unwrap();
    let blocks = page.split("```sh\n").skip(1).filter_map(|rest| rest.split("```").next());
    let commands: Vec<&str> = blocks.flat_map(str::lines).filter(|line| line.starts_with("topogrid ")).collect();
    assert!(commands.len() >= 10, "{commands:?}");
    for command in commands {
        let words: Vec<&str> = command.split_whitespace().skip(1).collect();
        let told = topogrid().current_dir(folder.path()).args(words).output().unwrap();
        assert!(told.status.success(), "{command}: {}", String::from_utf8_lossy(&told.stderr));
        let lines = String::from_utf8_lossy(&told.stdout).lines().count();
        assert!(lines <= 24, "`{command}` prints {lines} lines");
    }
    for name in ["graph.geojson", "office.tmap2.yaml", "office.dot", "office.csv", "runs/again/map.yaml"] {
        assert!(folder.path().join(name).exists(), "{name}");
    }
}
