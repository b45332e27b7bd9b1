use std::io;
use std::path::PathBuf;

use clap::Args;
use global_grid::Exposure;
use global_grid::plan::{PlanError, PlanOptions, plan};
use nalgebra::Point2;
use serde_json::json;

use crate::context::Context;
use crate::exit::Exit;
use crate::failure::Failure;
use crate::map_folder::Known;
use crate::{files, map_folder};

/// A safe path over a gridmap, from a start to a goal
///
/// Example: topogrid plan runs/office --from 0,0 --to 12.5,3 -o path.png
#[derive(Debug, Args)]
pub(crate) struct PlanArgs {
    /// A run folder, or a map server's map.yaml
    #[arg(value_name = "RUN|MAP")]
    map: PathBuf,
    /// Where the robot is: x,y in metres
    #[arg(long, value_name = "X,Y", value_parser = point, allow_hyphen_values = true)]
    from: Point2<f64>,
    /// Where it shall go: x,y in metres
    #[arg(long, value_name = "X,Y", value_parser = point, allow_hyphen_values = true)]
    to: Point2<f64>,
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

fn point(text: &str) -> Result<Point2<f64>, String> {
    let numbers: Result<Vec<f64>, _> = text.split(',').map(|number| number.trim().parse()).collect();
    match numbers.as_deref() {
        Ok(&[x, y]) if x.is_finite() && y.is_finite() => Ok(Point2::new(x, y)),
        _ => Err("expected two finite numbers with a comma between".to_owned()),
    }
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
    // A description may turn the image: the path is sought in the grid's own frame.
    let [from, to] = [args.from, args.to].map(|end| map_from_grid.inverse() * end);
    let path = plan(&grid, from, to, &options).map_err(|error| failure(&error))?;
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
        }));
    }
    let drawn = args.out.as_ref().map_or(String::new(), |out| format!("\n{}", out.display()));
    let basis = if has_degrees { "degrees of the layers" } else { "free and occupied cells only" };
    context.print(&format!(
        "{:.2} m in {} steps, cost {:.2} m, risk at most {:.2} (from {basis}){drawn}\n",
        path.length,
        path.points.len() - 1,
        path.cost,
        path.risk
    ))
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
