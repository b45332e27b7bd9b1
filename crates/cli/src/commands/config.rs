use std::fmt::Write as _;

use clap::{Args, Subcommand};
use hierarchy::Config;
use serde_json::json;

use crate::context::Context;
use crate::failure::Failure;
use crate::settings::{Origin, Settings, SettingsArgs, variable};

/// The settings: a commented file to begin with, what holds here and why, what one of them means
///
/// Examples:
///   topogrid config init > topogrid.toml
///   topogrid config show
///   topogrid config explain places.spacing_m
#[derive(Debug, Args)]
#[command(verbatim_doc_comment)]
pub(crate) struct ConfigArgs {
    #[command(subcommand)]
    what: What,
    #[command(flatten)]
    settings: SettingsArgs,
}

#[derive(Debug, Subcommand)]
enum What {
    /// Print a commented file with every built-in value
    Init,
    /// Print every setting with where its value comes from
    Show,
    /// Say what a setting means
    Explain {
        #[arg(value_name = "KEY")]
        key: String,
    },
}

/// Prints what was asked for.
pub(crate) fn run(args: &ConfigArgs, context: &Context) -> Result<(), Failure> {
    match &args.what {
        What::Init => context.print(&commented()),
        What::Show => show(Settings::layered(&args.settings, context)?, context),
        What::Explain { key } => explain(&Settings::layered(&args.settings, context)?, key, context),
    }
}

fn show(settings: Settings, context: &Context) -> Result<(), Failure> {
    settings.config()?; // what cannot be used is not shown as if it could
    if context.json {
        let one = |(key, (value, origin)): (String, (toml::Value, Origin))| {
            (key, json!({ "value": value, "origin": origin.to_string() }))
        };
        return context.print_json(&settings.all().map(one).collect::<serde_json::Map<_, _>>());
    }
    let mut text = String::new();
    for (key, (value, origin)) in settings.all() {
        let _ = writeln!(text, "{:<44} # {origin}", format!("{key} = {value}")); // writing to a string cannot fail
    }
    context.print(&text)
}

fn explain(settings: &Settings, key: &str, context: &Context) -> Result<(), Failure> {
    let (value, origin) = settings.get(key)?;
    let about = Config::about(key).unwrap_or_default();
    let built_in = &Settings::built_in().get(key)?.0.clone();
    if context.json {
        return context.print_json(&json!({
            "key": key, "about": about, "value": value, "origin": origin.to_string(), "built_in": built_in,
            "variable": variable(key),
        }));
    }
    context.print(&format!(
        "{key}\n  {about}\n  here {value} ({origin}), built in {built_in}\n  --set {key}=…, or ${}\n",
        variable(key)
    ))
}

/// The default configuration as a file, each key with what it means above it.
fn commented() -> String {
    let mut text = String::from("# Settings of topogrid. Name only what you change; unknown keys are errors.\n");
    let mut table = String::new();
    for (key, (value, _)) in Settings::built_in().all() {
        let (head, name) = key.split_once('.').unwrap_or(("", &key));
        if head != table {
            head.clone_into(&mut table);
            let _ = writeln!(text, "\n[{head}]");
        }
        let _ = writeln!(text, "# {}\n{name} = {value}", Config::about(&key).unwrap_or_default());
    }
    text
}
