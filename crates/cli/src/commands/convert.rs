use std::cell::Cell;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use clap::Args;
use robot_log::{CarmenWriter, Entry, EntryKind};
use simulator::{Drift, OdometryModel};

use crate::context::Context;
use crate::exit::Exit;
use crate::failure::Failure;
use crate::files;
use crate::input::{self, ReadingArgs, warn_of_skipped};

/// File to file, without a run: a log to CARMEN (.log, .clf) or to a trajectory (.tum)
///
/// Examples:
///   topogrid convert office.log.gz odometry.tum
///   topogrid convert corrected.log.gz drifted.log --drift 0.02,1 --seed 7
#[derive(Debug, Args)]
#[command(verbatim_doc_comment)]
pub(crate) struct ConvertArgs {
    /// The log to read; several files are merged by stamp; `-` reads standard input
    #[arg(value_name = "IN", required = true)]
    inputs: Vec<PathBuf>,
    /// The file to write: .log or .clf (CARMEN), .tum (trajectory); `-` writes CARMEN to standard output
    #[arg(value_name = "OUT")]
    output: PathBuf,
    /// Which path a trajectory holds
    #[arg(long, value_name = "PATH", default_value = "odometry")]
    path: PathChoice,
    /// Spoil the odometry by a share of the distance and degrees per metre, each as a constant and as a random walk;
    /// the path that the log held becomes its truth
    #[arg(long, value_name = "SHARE,DEG", value_parser = drift)]
    drift: Option<OdometryModel>,
    /// Seed of the drift: the same one spoils the same way again
    #[arg(long, value_name = "N", default_value_t = 1, requires = "drift")]
    seed: u64,
    /// Replace the file where it exists
    #[arg(long)]
    force: bool,
    #[command(flatten)]
    reading: ReadingArgs,
}

/// A path in a log.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
enum PathChoice {
    /// Where the odometry believes the robot to be.
    Odometry,
    /// Where it was.
    Truth,
}

/// What the name of the output asks for.
enum Format {
    Carmen,
    Tum,
}

/// Converts the file.
pub(crate) fn run(args: &ConvertArgs, context: &Context) -> Result<(), Failure> {
    let format = format_of(&args.output)?;
    let mut log = input::open(&args.inputs, &args.reading)?;
    // A log that breaks off ends the writing, too, so that no half of a file is left behind.
    let mut drift = args.drift.map(|model| Drift::new(model, args.seed));
    let spoilt = |entry| match &mut drift {
        Some(drift) => drift.spoil(entry),
        None => (entry, None),
    };
    let broken = Cell::new(None);
    let whole = |failure| {
        broken.set(Some(failure));
        io::Error::other("the log breaks off")
    };
    let entries = log.by_ref().map(|entry| entry.map_err(whole)).flat_map(with_truth(spoilt));
    let content = |out: &mut dyn Write| match format {
        Format::Carmen => write_carmen(out, entries),
        Format::Tum => write_tum(out, entries, args.path),
    };
    if args.output.as_os_str() == "-" {
        content(&mut io::stdout().lock()).map_err(|error| broken.take().unwrap_or_else(|| Failure::stdout(error)))?;
    } else {
        files::write(&args.output, args.force, content)
            .map_err(|error| broken.take().unwrap_or_else(|| Failure::writing(&args.output, &error)))?;
    }
    warn_of_skipped(log.reports(), context);
    Ok(())
}

/// Puts the truth that an entry turns out to have held behind it.
fn with_truth(
    mut spoilt: impl FnMut(Entry) -> (Entry, Option<Entry>),
) -> impl FnMut(io::Result<Entry>) -> Vec<io::Result<Entry>> {
    move |entry| match entry.map(&mut spoilt) {
        Ok((entry, truth)) => std::iter::once(entry).chain(truth).map(Ok).collect(),
        Err(error) => vec![Err(error)],
    }
}

/// `SHARE,DEG`: how far wheels err.
fn drift(text: &str) -> Result<OdometryModel, String> {
    let expected = || "expected a share of the distance and degrees per metre, such as 0.02,1".to_owned();
    let (share, degrees) = text.split_once(',').ok_or_else(expected)?;
    let number = |text: &str| text.trim().parse::<f64>().ok().filter(|number| (0.0..=90.0).contains(number));
    let (Some(share), Some(degrees)) = (number(share), number(degrees)) else { return Err(expected()) };
    Ok(OdometryModel::of_shares(share, degrees.to_radians()))
}

fn format_of(path: &Path) -> Result<Format, Failure> {
    match path.extension().and_then(|extension| extension.to_str()) {
        Some("log" | "clf" | "carmen") => Ok(Format::Carmen),
        Some("tum") => Ok(Format::Tum),
        _ if path.as_os_str() == "-" => Ok(Format::Carmen),
        _ => {
            let message = format!("the name {} does not say what to write", path.display());
            Err(Failure::new(Exit::Usage, "convert.format", message)
                .help("end it in .log or .clf (CARMEN) or .tum (trajectory)"))
        }
    }
}

fn write_carmen(out: &mut dyn Write, entries: impl Iterator<Item = io::Result<Entry>>) -> io::Result<()> {
    let mut log = CarmenWriter::new(out);
    for entry in entries {
        log.write(&entry?)?;
    }
    Ok(())
}

/// `stamp x y z qx qy qz qw` per pose.
fn write_tum(
    out: &mut dyn Write,
    entries: impl Iterator<Item = io::Result<Entry>>,
    path: PathChoice,
) -> io::Result<()> {
    for entry in entries {
        let entry = entry?;
        let pose = match (&entry.kind, path) {
            (EntryKind::Odometry { odom_from_robot }, PathChoice::Odometry) => *odom_from_robot,
            (EntryKind::Scan { odom_from_robot: Some(pose), .. }, PathChoice::Odometry) => *pose,
            (EntryKind::Truth { map_from_robot }, PathChoice::Truth) => *map_from_robot,
            _ => continue,
        };
        let (sin, cos) = (pose.rotation.angle() / 2.0).sin_cos();
        let at = pose.translation;
        writeln!(out, "{:.6} {:.6} {:.6} 0 0 0 {sin:.9} {cos:.9}", entry.stamp, at.x, at.y)?;
    }
    Ok(())
}
