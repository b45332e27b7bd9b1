use std::fmt::Write as _;
use std::path::Path;

use clap::Args;
use robot_log::{LogReport, Survey};
use serde_json::{Value, json};

use crate::context::Context;
use crate::exit::Exit;
use crate::failure::Failure;
use crate::input::{Log, LogArgs, warn_of_skipped};

mod graph;
mod map;

/// What a log, a graph or a map holds, and whether it is healthy
///
/// Example: topogrid inspect office.log.gz
#[derive(Debug, Args)]
pub(crate) struct InspectArgs {
    #[command(flatten)]
    log: LogArgs,
    /// End with exit code 3 where the file is not healthy
    #[arg(long)]
    strict: bool,
}

/// Looks through the file and prints what it holds.
pub(crate) fn run(args: &InspectArgs, context: &Context) -> Result<(), Failure> {
    let healthy = match args.log.logs.as_slice() {
        [path] if graph::is_graph(path) => graph::inspect(path, context)?,
        [path] if map::is_map(path) => map::inspect(path, context)?,
        paths => inspect_log(paths.first().map_or(Path::new("-"), |path| path), &mut args.log.open()?, context)?,
    };
    if args.strict && !healthy {
        return Err(Failure::new(Exit::Rejected, "inspect.unhealthy", "the file is not healthy; see its findings"));
    }
    Ok(())
}

fn inspect_log(path: &Path, log: &mut Log, context: &Context) -> Result<bool, Failure> {
    let mut survey = Survey::default();
    let stage = context.progress().reading("reading", log.size());
    while let Some(entry) = log.next() {
        survey.push(&entry?);
        if survey.entries % 1000 == 0 {
            stage.at(log.taken(), || format!("{} entries", survey.entries));
        }
    }
    stage.finish(&format!("{} entries", survey.entries));
    let reports: Vec<&LogReport> = log.reports().collect();
    warn_of_skipped(reports.iter().copied(), context);
    let findings = survey.findings(reports.iter().copied());
    let healthy = !findings.iter().any(robot_log::Finding::is_grave);
    if context.json {
        let texts: Vec<String> = findings.iter().map(ToString::to_string).collect();
        let skipped: u64 = reports.iter().map(|report| report.skipped_lines()).sum();
        let lines: u64 = reports.iter().map(|report| report.lines).sum();
        context.print_json(&json!({
            "schema": "topogrid/inspect/1", "file": path.display().to_string(), "holds": "log", "log": survey,
            "lines": lines, "skipped": skipped, "passed_over": passed_over(&reports), "healthy": healthy, "findings": texts,
        }))?;
    } else {
        let mut text = describe(path, &survey, &reports);
        for finding in &findings {
            let _ = writeln!(text, "  {} {finding}", if finding.is_grave() { "!" } else { "·" });
        }
        let _ = writeln!(text, "{}", if healthy { "healthy" } else { "not healthy" });
        context.print(&text)?;
    }
    Ok(healthy)
}

/// Lines that carry nothing for a map, by name, over all files.
fn passed_over(reports: &[&LogReport]) -> Value {
    let mut counts = serde_json::Map::new();
    for (name, count) in reports.iter().flat_map(|report| &report.passed_over) {
        let sum = counts.get(name).and_then(Value::as_u64).unwrap_or(0) + count;
        counts.insert(name.clone(), sum.into());
    }
    Value::Object(counts)
}

/// The survey in words; writing to a string cannot fail.
fn describe(path: &Path, survey: &Survey, reports: &[&LogReport]) -> String {
    let (width, height) = survey.extent();
    let lines: u64 = reports.iter().map(|report| report.lines).sum();
    let mut text = format!(
        "{}: a log of {} entries in {lines} lines, {:.1} s\n",
        path.display(),
        survey.entries,
        survey.duration()
    );
    let _ = writeln!(
        text,
        "  odometry   {} poses, path {:.1} m, box {width:.1} × {height:.1} m, turns {:.0}°",
        survey.poses,
        survey.path_length,
        survey.turning.to_degrees()
    );
    for sensor in &survey.sensors {
        let (beams, width) = (sensor.sensor.mounts().len(), sensor.sensor.beam_width().to_degrees());
        let kind = format!("{:?}", sensor.sensor.kind()).to_lowercase();
        let _ = write!(
            text,
            "  {kind:<10} `{}`: {} scans of {beams} beams of {width:.1}°",
            sensor.sensor.name(),
            sensor.scans
        );
        if let Some(interval) = sensor.interval().filter(|interval| *interval > 0.0) {
            let _ = write!(text, ", {:.1} Hz", 1.0 / interval);
        }
        let (nearest, farthest) = sensor.nearest_farthest;
        let (from, to) = (sensor.sensor.min_range(), sensor.sensor.max_range());
        let _ = write!(text, "\n             {:.1} % echoes", 100.0 * sensor.echo_share());
        if sensor.echoes > 0 {
            let _ = write!(text, " at {nearest:.2} … {farthest:.2} m");
        }
        let _ =
            writeln!(text, ", limits {from:.2} … {to:.2} m, {:.1} % no measurement", 100.0 * sensor.invalid_share());
    }
    let _ = writeln!(
        text,
        "  heading    {}",
        if survey.headings > 0 {
            format!("{} absolute headings", survey.headings)
        } else {
            "none but the odometry's".to_owned()
        }
    );
    if survey.recognitions > 0 {
        let _ = writeln!(text, "  recognised {} resemblances by the robot's own recogniser", survey.recognitions);
    }
    if survey.truths > 0 {
        let _ = writeln!(text, "  truth      {} true poses", survey.truths);
    }
    let passed = reports.iter().flat_map(|report| &report.passed_over).map(|(name, count)| format!("{count} {name}"));
    let passed: Vec<String> = passed.take(8).collect();
    if !passed.is_empty() {
        let _ = writeln!(text, "  not used   {}", passed.join(", "));
    }
    text
}
