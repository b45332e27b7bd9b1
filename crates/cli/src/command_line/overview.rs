use std::fmt::Write as _;

use clap::{Command, CommandFactory};

use crate::command_line::Cli;

/// The commands by what they are for; what is in none of these groups is listed at the end.
const GROUPS: [(&str, &[&str]); 5] = [
    ("make a map", &["run", "resume", "demo", "simulate", "reproduce"]),
    ("look at it", &["explain", "inspect", "evaluate", "compare", "report", "view"]),
    ("change it", &["edit", "grid", "regions", "relax"]),
    ("use it", &["export", "plan", "locate", "convert"]),
    ("set up", &["config", "completions", "man"]),
];

/// The help that fits a screen: what to type first, and which commands there are. Writing to a string cannot fail.
pub(crate) fn text() -> String {
    let command = Cli::command();
    let mut text = format!("{}\n", command.get_about().map(ToString::to_string).unwrap_or_default());
    text.push_str(
        "\n  topogrid demo                         the bundled experiment: no input needed\
         \n  topogrid run office.log.gz            a log becomes a map, in runs/office\
         \n  topogrid explain runs/office          why it looks like that\
         \n  topogrid export runs/office --to nav2-route -o graph.geojson\n\
         \nUsage: topogrid [OPTIONS] <COMMAND>\n\n",
    );
    let names: Vec<&str> = command.get_subcommands().map(Command::get_name).collect();
    for (title, members) in GROUPS {
        let there: Vec<&str> = members.iter().copied().filter(|name| names.contains(name)).collect();
        let _ = writeln!(text, "  {title:<12} {}", there.join("  "));
    }
    let grouped = |name: &&str| GROUPS.iter().any(|(_, members)| members.contains(name)) || *name == "help";
    let others: Vec<&str> = names.iter().copied().filter(|name| !grouped(name)).collect();
    if !others.is_empty() {
        let _ = writeln!(text, "  {:<12} {}", "and", others.join("  "));
    }
    text.push_str(
        "\nEverywhere: --json, -q, -v, --progress HOW, --color WHEN\
         \nMore: topogrid --help, topogrid COMMAND -h (short), topogrid COMMAND --help (all)\n",
    );
    text
}
