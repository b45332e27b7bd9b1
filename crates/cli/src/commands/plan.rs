use std::io;
use std::path::PathBuf;

use clap::Args;
use global_grid::Exposure;
use global_grid::plan::{Path, PlanError, PlanOptions, plan};
use hierarchy::local_grid::FuzzyGrid;
use hierarchy::topo_map::PlaceId;
use hierarchy::{Mapper, Planner, RouteError};
use nalgebra::{Isometry2, Point2};
use region_map::RegionMap;
use serde_json::{Value, json};

use crate::context::Context;
use crate::exit::Exit;
use crate::failure::Failure;
use crate::finished::map_folder::Known;
use crate::{files, finished::map_folder, input::session};

/// A safe path from a start to a goal: of a run through its regions, then places, then cells
///
/// Example: topogrid plan runs/office --from 0,0 --to kitchen -o path.png
#[derive(Debug, Args)]
pub(crate) struct PlanArgs {
    /// A run folder, or a map server's map.yaml
    #[arg(value_name = "RUN|MAP")]
    map: PathBuf,
    /// Where the robot is: x,y in metres; of a run also the name of a region or place, region-3, or place-12
    #[arg(long, value_name = "X,Y|NAME", value_parser = spot, allow_hyphen_values = true)]
    from: Spot,
    /// Where it shall go: likewise
    #[arg(long, value_name = "X,Y|NAME", value_parser = spot, allow_hyphen_values = true)]
    to: Spot,
    /// The robot's radius in metres
    #[arg(long, value_name = "M", default_value_t = PlanOptions::default().radius)]
    radius: f64,
    /// The distance to keep beyond it, in metres
    #[arg(long, value_name = "M", default_value_t = PlanOptions::default().margin)]
    margin: f64,
    /// How many times its length a detour may be worth to avoid wholly unsafe ground
    #[arg(long, value_name = "W", default_value_t = PlanOptions::default().risk_weight)]
    risk_weight: f64,
    /// Ground more unsafe than this, of 0 to 1, is never entered
    #[arg(long, value_name = "M", default_value_t = PlanOptions::default().forbidden)]
    forbidden: f64,
    /// The radius in metres of the robot that drove the run: one no larger fits where it has been. 0 trusts the map alone
    #[arg(long, value_name = "M", default_value_t = PlanOptions::default().radius)]
    driven_radius: f64,
    /// Go through unexplored ground, too
    #[arg(long)]
    through_unexplored: bool,
    /// Draw the path over the map
    #[arg(short, long, value_name = "FILE.png")]
    out: Option<PathBuf>,
    /// Replace the picture where it exists
    #[arg(long)]
    force: bool,
}

/// An end of a path, as it is asked for.
#[derive(Debug, Clone)]
enum Spot {
    At(Point2<f64>),
    Named(String),
}

fn spot(text: &str) -> Result<Spot, String> {
    if !text.contains(',') && text.chars().any(char::is_alphabetic) {
        return Ok(Spot::Named(text.to_owned()));
    }
    let numbers: Result<Vec<f64>, _> = text.split(',').map(|number| number.trim().parse()).collect();
    match numbers.as_deref() {
        Ok(&[x, y]) if x.is_finite() && y.is_finite() => Ok(Spot::At(Point2::new(x, y))),
        _ => Err("expected two finite numbers with a comma between, or a name".to_owned()),
    }
}

/// What was found on each level; a plain map has only cells.
struct Found {
    path: Path,
    regions: Vec<Value>,
    gateways: Vec<usize>,
    places: Vec<u32>,
    /// The regions in words.
    through: String,
}

/// Finds, draws and prints the path.
pub(crate) fn run(args: &PlanArgs, context: &Context) -> Result<(), Failure> {
    let Known { has_degrees, grid, map_from_grid } = map_folder::read(&args.map)?;
    let options = PlanOptions {
        radius: args.radius,
        margin: args.margin,
        risk_weight: args.risk_weight,
        forbidden: args.forbidden,
        through_unexplored: args.through_unexplored,
        exposure: Exposure::of(&grid),
        ..PlanOptions::default()
    };
    let session = args.map.join("session.hmap");
    let found =
        if session.exists() { of_run(args, &grid, &options)? } else { of_map(args, &grid, &map_from_grid, &options)? };
    let path = &found.path;
    if let Some(out) = &args.out {
        let draw =
            |file: &mut dyn io::Write| global_grid::write_path(&grid, &path.points, file).map_err(io::Error::other);
        files::write(out, args.force, draw).map_err(|error| Failure::writing(out, &error))?;
    }
    if context.json {
        let points: Vec<_> = path.points.iter().map(|point| map_from_grid * point).collect();
        return context.print_json(&json!({
            "schema": "topogrid/plan/1", "length_m": path.length, "cost_m": path.cost, "risk": path.risk,
            "degrees": has_degrees, "points_m": points.iter().map(|point| [point.x, point.y]).collect::<Vec<_>>(),
            "regions": found.regions, "gateways": found.gateways, "places": found.places,
        }));
    }
    let drawn = args.out.as_ref().map_or(String::new(), |out| format!("\n{}", out.display()));
    let basis = if has_degrees { "degrees of the layers" } else { "free and occupied cells only" };
    context.print(&format!(
        "{}{:.2} m in {} steps, cost {:.2} m, risk at most {:.2} (from {basis}){drawn}\n",
        found.through,
        path.length,
        path.points.len() - 1,
        path.cost,
        path.risk
    ))
}

/// The path over a map without regions.
fn of_map(
    args: &PlanArgs,
    grid: &FuzzyGrid,
    map_from_grid: &Isometry2<f64>,
    options: &PlanOptions,
) -> Result<Found, Failure> {
    let point = |spot: &Spot| match spot {
        // A description may turn the image: the path is sought in the grid's own frame.
        Spot::At(point) => Ok(map_from_grid.inverse() * point),
        Spot::Named(name) => {
            let message = format!("{} has no names, so `{name}` says nothing", args.map.display());
            Err(Failure::new(Exit::Usage, "plan.name", message).help("give x,y, or the folder of a run"))
        }
    };
    let path = plan(grid, point(&args.from)?, point(&args.to)?, options).map_err(|error| failure(&error))?;
    Ok(Found { path, regions: Vec::new(), gateways: Vec::new(), places: Vec::new(), through: String::new() })
}

/// The path through the regions of a run.
fn of_run(args: &PlanArgs, grid: &FuzzyGrid, options: &PlanOptions) -> Result<Found, Failure> {
    let mut mapper = session::load(&args.map)?;
    let driven = if args.radius <= args.driven_radius { mapper.driven() } else { Vec::new() };
    let options = &PlanOptions { driven, ..options.clone() };
    let map = mapper.survey(grid).map_err(|error| Failure::rejected(&args.map, "regions.map", &error))?;
    let (from, to) = (resolve(&args.from, &mapper, &map)?, resolve(&args.to, &mapper, &map)?);
    let planner = Planner::new(grid, &map, options).map_err(|error| failure(&error))?;
    let found = planner.plan(from, to).map_err(|error| match error {
        RouteError::Cells(error) => failure(&error),
        closed => Failure::new(Exit::Failed, "plan.closed", format!("could not plan a path: {closed}"))
            .help("topogrid regions RUN --open GATEWAY opens one"),
    })?;
    let name = |label: &u16| map.region(*label).and_then(|region| region.name.clone());
    let words: Vec<String> =
        found.regions.iter().map(|label| name(label).unwrap_or_else(|| format!("region {label}"))).collect();
    Ok(Found {
        regions: found.regions.iter().map(|label| json!({ "label": label, "name": name(label) })).collect(),
        gateways: found.gateways,
        places: mapper.places_along(&found.path.points).into_iter().map(|place| place.0).collect(),
        through: if words.is_empty() { String::new() } else { format!("{}\n", words.join(" → ")) },
        path: found.path,
    })
}

/// Where an end of the path is: a region by its name or `region-N`, a place by its name or `place-N`.
fn resolve(spot: &Spot, mapper: &Mapper, map: &RegionMap) -> Result<Point2<f64>, Failure> {
    let name = match spot {
        Spot::At(point) => return Ok(*point),
        Spot::Named(name) => name,
    };
    let number = |prefix: &str| name.strip_prefix(prefix).and_then(|rest| rest.parse::<u32>().ok());
    let labelled = || map.region(u16::try_from(number("region-")?).ok()?);
    if let Some(region) = map.find(name).or_else(labelled) {
        return Ok(region.inside);
    }
    let named = mapper.names().find(|(_, other)| other.eq_ignore_ascii_case(name)).map(|(place, _)| place);
    let place = named.or_else(|| number("place-").map(PlaceId)).and_then(|place| mapper.topology().place(place));
    place.map(|place| mapper.coordinates().map_from_place(place.id).translation.vector.into()).ok_or_else(|| {
        Failure::new(Exit::Usage, "plan.name", format!("no region or place is called `{name}`"))
            .help("topogrid regions RUN lists the regions")
    })
}

/// Why there is no path, for the user.
fn failure(error: &PlanError) -> Failure {
    let (exit, code) = match error {
        PlanError::Option { .. } => (Exit::Usage, "plan.option"),
        PlanError::Outside { .. } => (Exit::Rejected, "plan.outside"),
        PlanError::Unsafe { .. } => (Exit::Rejected, "plan.unsafe"),
        PlanError::Unreachable { .. } => (Exit::Failed, "plan.unreachable"),
        _ => (Exit::Failed, "plan"),
    };
    let failure = Failure::new(exit, code, format!("could not plan a path: {error}"));
    match error {
        PlanError::Unsafe { .. } | PlanError::Unreachable { .. } => {
            failure.help("a smaller --radius or --margin, a higher --forbidden, or --through-unexplored allow more")
        }
        _ => failure,
    }
}
