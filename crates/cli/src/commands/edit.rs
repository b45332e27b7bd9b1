use std::path::{Path, PathBuf};

use clap::{Args, Subcommand};
use hierarchy::Mapper;
use hierarchy::edit::{Edit, Edits, Measured, measure};
use hierarchy::topo_map::PlaceId;

use crate::context::Context;
use crate::exit::Exit;
use crate::failure::Failure;
use crate::finished::Finished;
use crate::run_folder::RunFolder;
use crate::{finished::output, input::edits, input::place_name, input::session, report};

/// Change a map by hand: a list of edits that is replayed on the recorded map; grid and exports follow at once
///
/// Examples:
///   topogrid edit runs/office drop-link 66-29
///   topogrid edit runs/office name P12 kitchen
///   topogrid edit runs/office undo
#[derive(Debug, Args)]
#[command(verbatim_doc_comment)]
pub(crate) struct EditArgs {
    /// The folder of the run
    #[arg(value_name = "RUN")]
    run: PathBuf,
    #[command(subcommand)]
    what: What,
    /// Only change the list; the files of the run are left as they are
    #[arg(long, global = true)]
    no_redraw: bool,
}

#[derive(Debug, Subcommand)]
enum What {
    /// Hold all links between two places to be false
    DropLink {
        #[arg(value_name = "A-B")]
        link: String,
    },
    /// Link two places; where B lies as seen from A is measured from their views unless --by says it
    AddLink {
        #[arg(value_name = "A-B")]
        link: String,
        /// Metres east and north
        #[arg(long, value_name = "DX,DY", value_parser = vector, allow_hyphen_values = true)]
        by: Option<[f64; 2]>,
        /// How sure that is, in metres
        #[arg(long, value_name = "M", default_value_t = 0.1)]
        sigma: f64,
    },
    /// Hold a place at coordinates of the map
    Pin {
        #[arg(value_name = "P")]
        place: String,
        /// Metres east and north of the map's origin
        #[arg(long, value_name = "X,Y", value_parser = vector, allow_hyphen_values = true)]
        at: [f64; 2],
        /// How sure that is, in metres
        #[arg(long, value_name = "M", default_value_t = 0.02)]
        sigma: f64,
    },
    /// One place is another: the two are held together, and navigation sees one
    Merge {
        #[arg(value_name = "P")]
        place: String,
        #[arg(value_name = "INTO")]
        into: String,
    },
    /// Give a place a name; an empty one takes it away
    Name {
        #[arg(value_name = "P")]
        place: String,
        #[arg(value_name = "NAME")]
        name: String,
    },
    /// Take the last edit back, or the one with a number
    Undo {
        #[arg(value_name = "N")]
        number: Option<usize>,
    },
    /// Show the edits, numbered
    List,
}

/// Changes the list, and redraws what follows from it.
pub(crate) fn run(args: &EditArgs, context: &Context) -> Result<(), Failure> {
    if !args.run.is_dir() {
        let message = format!("edits are kept in the folder of a run, and {} is none", args.run.display());
        return Err(Failure::new(Exit::Usage, "edit.run", message));
    }
    let mut list = edits::read(&args.run)?;
    match &args.what {
        What::List => return show(&list, context),
        What::Undo { number } => undo(&mut list, *number)?,
        what => list.list.push(what.edit(&session::load(&args.run)?)?),
    }
    let mut mapper = session::recorded(&args.run)?;
    let before = energy(&mapper)?;
    list.apply(&mut mapper).map_err(|error| Failure::new(Exit::Usage, "edit.unfit", error.to_string()))?;
    let after = energy(&mapper)?;
    edits::write(&args.run, &list)?;
    if !args.no_redraw {
        redraw(&args.run, mapper, context)?;
    }
    if !context.json {
        let done = if args.no_redraw { "the list is changed" } else { "map, exports and figures are redrawn" };
        context.say(&format!("energy as recorded {before:.2}, edited {after:.2}; {done}"));
    }
    show(&list, context)
}

fn show(list: &Edits, context: &Context) -> Result<(), Failure> {
    if context.json {
        return context.print_json(&serde_json::json!({ "schema": "topogrid/edits/1", "edit": list.list }));
    }
    if list.list.is_empty() {
        return context.print("no edits\n");
    }
    let line = |(index, edit): (usize, &Edit)| format!("{:>3}  {edit}\n", index + 1);
    context.print(&list.list.iter().enumerate().map(line).collect::<String>())
}

fn undo(list: &mut Edits, number: Option<usize>) -> Result<(), Failure> {
    let number = number.unwrap_or(list.list.len());
    if number == 0 || number > list.list.len() {
        let message = format!("there is no edit {number} to take back, the list holds {}", list.list.len());
        return Err(Failure::new(Exit::Usage, "edit.undo", message).help("topogrid edit RUN list"));
    }
    list.list.remove(number - 1);
    Ok(())
}

/// Writes everything that follows from the edited map. Times, and what only the log knows, stay as they were recorded;
/// an error against the truth is not, since the truth is not kept.
fn redraw(run: &Path, mapper: Mapper, context: &Context) -> Result<(), Failure> {
    let mut finished = Finished::draw(mapper, context)?;
    let recorded: Option<hierarchy::Metrics> =
        std::fs::read(run.join("metrics.json")).ok().and_then(|bytes| serde_json::from_slice(&bytes).ok());
    if let Some(recorded) = recorded {
        let grid = finished.metrics.timings_s.grid;
        finished.metrics.timings_s = hierarchy::Timings { grid, ..recorded.timings_s };
        finished.metrics.log.skipped = recorded.log.skipped;
        finished.metrics.peak_memory_mib = recorded.peak_memory_mib;
    }
    let folder = RunFolder::existing(run);
    output::write(&folder, &session::name(run), &finished)?;
    output::write_metrics(&folder, &finished.metrics)?;
    output::write_report(&folder, report::draw(&session::name(run), &finished)?, &finished.metrics)
}

fn energy(mapper: &Mapper) -> Result<f64, Failure> {
    let metrics = mapper.metrics().map_err(|error| Failure::new(Exit::Failed, "edit.map", error.to_string()))?;
    Ok(metrics.relaxation.energy_after)
}

impl What {
    /// The edit that is meant, with places by number and measurements by value.
    fn edit(&self, mapper: &Mapper) -> Result<Edit, Failure> {
        let place = |text: &str| place_name::place(mapper, text);
        Ok(match self {
            Self::DropLink { link } => {
                let (from, to) = place_name::pair(mapper, link)?;
                place_name::links(mapper, link)?; // which says what the places are joined to
                Edit::DropLink { from: from.0, to: to.0 }
            }
            Self::AddLink { link, by, sigma } => {
                let (from, to) = place_name::pair(mapper, link)?;
                let by = match by {
                    Some(vector_m) => Measured { vector_m: *vector_m, sigma_m: *sigma, turn_deg: None },
                    None => measured(mapper, from, to)?,
                };
                Edit::AddLink { from: from.0, to: to.0, by }
            }
            Self::Pin { place: text, at, sigma } => Edit::Pin { place: place(text)?.0, at_m: *at, sigma_m: *sigma },
            Self::Merge { place: text, into } => {
                let (place, into) = (place(text)?, place(into)?);
                // Whatever the views leave open: one place is less than half a metre from itself.
                let by = measured(mapper, place, into)?;
                let by = Measured { sigma_m: by.sigma_m.min(SAME_PLACE), ..by };
                Edit::Merge { place: place.0, into: into.0, by }
            }
            Self::Name { place: text, name } => Edit::Name { place: place(text)?.0, name: name.clone() },
            Self::Undo { .. } | Self::List => unreachable!("they add no edit"),
        })
    }
}

/// How far apart two visits to one place may be, as a standard deviation in metres.
const SAME_PLACE: f64 = 0.25;

fn measured(mapper: &Mapper, from: PlaceId, to: PlaceId) -> Result<Measured, Failure> {
    measure(mapper, from, to).ok_or_else(|| {
        let message = format!("the views from P{} and P{} do not fit onto each other", from.0, to.0);
        Failure::new(Exit::Usage, "edit.views", message).help(format!(
            "say where P{1} lies as seen from P{0}: topogrid edit RUN add-link {0}-{1} --by DX,DY",
            from.0, to.0
        ))
    })
}

/// Two numbers with a comma between them.
fn vector(text: &str) -> Result<[f64; 2], String> {
    let wrong = || format!("expected two numbers such as 1.2,-0.3, found `{text}`");
    let (x, y) = text.split_once(',').ok_or_else(wrong)?;
    let number = |text: &str| text.trim().parse::<f64>().ok().filter(|value| value.is_finite()).ok_or_else(wrong);
    Ok([number(x)?, number(y)?])
}
