use clap::Subcommand;

use crate::context::Context;
use crate::failure::Failure;

pub(crate) mod compare;
pub(crate) mod completions;
pub(crate) mod config;
pub(crate) mod convert;
pub(crate) mod demo;
pub(crate) mod edit;
pub(crate) mod evaluate;
pub(crate) mod explain;
pub(crate) mod export;
pub(crate) mod grid;
pub(crate) mod inspect;
pub(crate) mod locate;
pub(crate) mod plan;
pub(crate) mod regions;
pub(crate) mod relax;
pub(crate) mod report;
pub(crate) mod reproduce;
pub(crate) mod resume;
pub(crate) mod run;
pub(crate) mod simulate;
pub(crate) mod view;

/// One command each: its arguments, declared in its own file.
#[derive(Debug, Subcommand)]
pub(crate) enum Command {
    Demo(demo::DemoArgs),
    Run(run::RunArgs),
    Resume(resume::ResumeArgs),
    Inspect(inspect::InspectArgs),
    Convert(convert::ConvertArgs),
    Grid(grid::GridArgs),
    Relax(relax::RelaxArgs),
    Plan(plan::PlanArgs),
    Locate(locate::LocateArgs),
    Compare(compare::CompareArgs),
    Evaluate(evaluate::EvaluateArgs),
    Explain(explain::ExplainArgs),
    Edit(edit::EditArgs),
    Export(export::ExportArgs),
    Simulate(simulate::SimulateArgs),
    Reproduce(reproduce::ReproduceArgs),
    Regions(regions::RegionsArgs),
    Report(report::ReportArgs),
    View(view::ViewArgs),
    Config(config::ConfigArgs),
    Completions(completions::CompletionsArgs),
    Man(completions::ManArgs),
}

impl Command {
    /// Does what the command says.
    pub(crate) fn run(&self, context: &Context) -> Result<(), Failure> {
        match self {
            Self::Demo(args) => demo::run(args, context),
            Self::Run(args) => run::run(args, context),
            Self::Resume(args) => resume::run(args, context),
            Self::Inspect(args) => inspect::run(args, context),
            Self::Convert(args) => convert::run(args, context),
            Self::Grid(args) => grid::run(args, context),
            Self::Relax(args) => relax::run(args, context),
            Self::Plan(args) => plan::run(args, context),
            Self::Locate(args) => locate::run(args, context),
            Self::Compare(args) => compare::run(args, context),
            Self::Evaluate(args) => evaluate::run(args, context),
            Self::Explain(args) => explain::run(args, context),
            Self::Edit(args) => edit::run(args, context),
            Self::Export(args) => export::run(args, context),
            Self::Simulate(args) => simulate::run(args, context),
            Self::Reproduce(args) => reproduce::run(args, context),
            Self::Regions(args) => regions::run(args, context),
            Self::Report(args) => report::run(args, context),
            Self::View(args) => view::run(args, context),
            Self::Config(args) => config::run(args, context),
            Self::Completions(args) => completions::run(args, context),
            Self::Man(args) => completions::man(args, context),
        }
    }
}
