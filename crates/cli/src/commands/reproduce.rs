use std::path::{Path, PathBuf};

use clap::Args;
use serde::Serialize;
use simulator::{RobotDescription, World};

use crate::context::{self, Context};
use crate::exit::Exit;
use crate::failure::Failure;
use crate::files;

mod draw;
mod retrace;
mod table;
mod trial;

use super::simulate::{robot, world};
use trial::{Outcome, Trial};

/// The paper's experiment, repeated: its figures beside ours
///
/// A simulated Nomad 200 explores an office of 46 × 12 m by predicted places, maps it on line, and is judged against the
/// truth. The folder receives the tables (`reproduce.md`) and the paper's figures 3, 4 and 5, drawn from the first seed.
///
/// Example: topogrid reproduce --seeds 20 --robot nomad200 --robot nomad200-perfect-compass -o reproduced
#[derive(Debug, Args)]
#[command(after_help = "The paper: Duckett & Saffiotti, Building globally consistent gridmaps from topologies, 2000")]
pub(crate) struct ReproduceArgs {
    /// A world to explore, named as for `topogrid simulate`; may be repeated
    #[arg(long = "world", value_name = "WORLD", default_value = "office-46x12")]
    worlds: Vec<String>,
    /// Metres per pixel of worlds that are images
    #[arg(long, value_name = "M", value_parser = crate::input::positive)]
    resolution: Option<f64>,
    /// A robot, named as for `topogrid simulate`; may be repeated
    #[arg(long = "robot", value_name = "ROBOT", default_value = "nomad200")]
    robots: Vec<String>,
    /// How many seeds
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u64).range(1..=1000))]
    seeds: u64,
    /// The first of them
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    /// Where the tables and figures go [default: none are written]
    #[arg(short, long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Replace files where they exist
    #[arg(long)]
    force: bool,
}

/// All trials of one world and robot.
#[derive(Debug, Serialize)]
struct Series {
    world: String,
    robot: String,
    trials: Vec<Trial>,
}

/// What was found, for programs.
#[derive(Debug, Serialize)]
struct Report<'a> {
    schema: &'static str,
    series: &'a [Series],
}

/// Explores every world with every robot and every seed, and tells how it went.
pub(crate) fn run(args: &ReproduceArgs, context: &Context) -> Result<(), Failure> {
    args.refuse_to_overwrite()?;
    context::catch_interrupts();
    let mut all = Vec::new();
    for name in &args.worlds {
        let world = world::load(name, args.resolution)?;
        for name in &args.robots {
            all.push(args.series(&world, &robot(name)?, all.is_empty(), context)?);
        }
    }
    let tables = table::markdown(&all);
    if let Some(folder) = &args.out {
        let heading = format!("# The experiment, reproduced\n\n{}\n\n{tables}", args.command());
        args.write(folder, "reproduce.md", heading.as_bytes())?;
    }
    if context.json {
        context.print_json(&Report { schema: "topogrid/reproduce/1", series: &all })?;
    } else {
        context.print(&tables)?;
    }
    if context::interrupted() {
        return Err(Failure::new(Exit::Interrupted, "interrupted", "stopped; what was explored so far is told"));
    }
    Ok(())
}

/// What is written into the folder.
const FILES: [&str; 4] = ["reproduce.md", "fig3-environment.svg", "fig4-topology.svg", "fig5-gridmap.png"];

impl ReproduceArgs {
    /// Said before the robot sets out, not after hours of exploring.
    fn refuse_to_overwrite(&self) -> Result<(), Failure> {
        let Some(folder) = self.out.as_ref().filter(|_| !self.force) else { return Ok(()) };
        match FILES.iter().map(|name| folder.join(name)).find(|path| path.exists()) {
            None => Ok(()),
            Some(path) => {
                let message = format!("{} exists", path.display());
                let help = "name another folder with --out, or replace what is there with --force";
                Err(Failure::new(Exit::Usage, "reproduce.out", message).help(help))
            }
        }
    }

    fn series(
        &self,
        world: &World,
        robot: &RobotDescription,
        is_first: bool,
        context: &Context,
    ) -> Result<Series, Failure> {
        let stage = context.progress().stage("exploring", self.seeds);
        let mut trials: Vec<Trial> = Vec::new();
        for seed in self.seed..self.seed + self.seeds {
            let done = trials.len() as u64;
            let outcome = trial::run(world, robot, seed, |halt| {
                stage.at(done, || {
                    let map = halt.exploration.mapper().topology();
                    format!("seed {seed}: {} places, {} predicted", map.n_visited(), map.n_predicted())
                });
            })?;
            if is_first && trials.is_empty() {
                self.draw(world, &outcome)?;
            }
            trials.push(outcome.trial);
            if context::interrupted() {
                break;
            }
        }
        stage.finish(&format!("{}: {} explorations by `{}`", world.name(), trials.len(), robot.name));
        Ok(Series { world: world.name().to_owned(), robot: robot.name.clone(), trials })
    }

    /// Draws the paper's figures again.
    fn draw(&self, world: &World, outcome: &Outcome) -> Result<(), Failure> {
        let Some(folder) = &self.out else { return Ok(()) };
        self.write(folder, FILES[1], draw::environment(world).as_bytes())?;
        self.write(folder, FILES[2], draw::topology(world, outcome).as_bytes())?;
        let mut picture = Vec::new();
        global_grid::write_picture(&outcome.gridmap, &mut picture).map_err(|error| {
            Failure::new(Exit::Failed, "reproduce.picture", format!("could not draw the gridmap: {error}"))
        })?;
        self.write(folder, FILES[3], &picture)
    }

    fn write(&self, folder: &Path, name: &str, content: &[u8]) -> Result<(), Failure> {
        std::fs::create_dir_all(folder).map_err(|error| Failure::writing(folder, &error))?;
        let path = folder.join(name);
        files::write(&path, self.force, |out| out.write_all(content)).map_err(|error| Failure::writing(&path, &error))
    }

    /// The command that makes this again.
    fn command(&self) -> String {
        let repeated =
            |name: &str, values: &[String]| values.iter().map(|value| format!(" --{name} {value}")).collect::<String>();
        let (worlds, robots) = (repeated("world", &self.worlds), repeated("robot", &self.robots));
        format!("`topogrid reproduce{worlds}{robots} --seed {} --seeds {}`", self.seed, self.seeds)
    }
}
