use std::io::{self, Write};
use std::path::{Path, PathBuf};

use clap::Args;
use hierarchy::RouteOptions;

use crate::context::Context;
use crate::exit::Exit;
use crate::export::{Format, Source};
use crate::failure::Failure;
use crate::{files, input::session};

/// The map of a run for other programs: Nav2's Route Server, topological_navigation, pose-graph tools, Graphviz, …
///
/// Examples:
///   topogrid export runs/office --to nav2-route -o graph.geojson
///   topogrid export runs/office office.tmap2.yaml office.dot office.g2o
#[derive(Debug, Args)]
#[command(verbatim_doc_comment)]
pub(crate) struct ExportArgs {
    /// The run: its folder, or its session.hmap
    #[arg(value_name = "RUN")]
    run: PathBuf,
    /// The files to write; what each holds follows from its name, unless --to says it; `-` writes to standard output
    #[arg(value_name = "OUT")]
    outs: Vec<PathBuf>,
    /// The format [default: by the file's name]
    #[arg(long, value_name = "FORMAT")]
    to: Option<Format>,
    /// The same as OUT [default with --to: standard output]
    #[arg(short, long, value_name = "FILE")]
    out: Option<PathBuf>,
    /// The frame that files with frames name
    #[arg(long, value_name = "NAME", default_value = "map")]
    frame: String,
    /// Leave out ways gone less often, from route graphs (nav2-route, tmap2)
    #[arg(long, value_name = "N", default_value_t = 0)]
    min_traversals: u32,
    /// In route graphs, recognised places no farther apart than this are one node; 0: every place is a node
    #[arg(long, value_name = "M", default_value_t = RouteOptions::default().same_spot)]
    same_spot: f64,
    /// Replace files that exist
    #[arg(long)]
    force: bool,
}

/// Writes the map in each of the formats.
pub(crate) fn run(args: &ExportArgs, context: &Context) -> Result<(), Failure> {
    let outs = outs(args)?;
    let mapper = session::load(&args.run)?;
    let atlas = mapper.atlas().map_err(|error| Failure::new(Exit::Failed, "export", error.to_string()))?;
    let name = session::name(&args.run);
    let routes = RouteOptions { min_traversals: args.min_traversals, same_spot: args.same_spot };
    let source = Source { mapper: &mapper, atlas: &atlas, name: &name, frame: &args.frame, routes };
    for (path, format) in &outs {
        if path.as_os_str() == "-" {
            let mut out = io::BufWriter::new(io::stdout().lock());
            format.write(&mut out, &source).and_then(|()| out.flush()).map_err(Failure::stdout)?;
        } else {
            let content = |out: &mut dyn Write| format.write(out, &source);
            files::write(path, args.force, content).map_err(|error| Failure::writing(path, &error))?;
            context.say(&format!("wrote {}", path.display()));
        }
    }
    // Where a file goes to standard output, nothing else may.
    let written: Vec<String> = outs.iter().map(|(path, _)| path.display().to_string()).collect();
    if context.json && !written.iter().any(|path| path == "-") {
        return context.print_json(&serde_json::json!({ "schema": "topogrid/export/1", "written": written }));
    }
    Ok(())
}

/// The files to write and their formats.
fn outs(args: &ExportArgs) -> Result<Vec<(PathBuf, Format)>, Failure> {
    let mut outs: Vec<&Path> = args.outs.iter().chain(&args.out).map(PathBuf::as_path).collect();
    if outs.is_empty() && args.to.is_some() {
        outs.push(Path::new("-"));
    }
    if outs.is_empty() {
        let message = "there is nothing to write: name a file, or a format with --to";
        return Err(Failure::new(Exit::Usage, "export.nothing", message).help("topogrid export RUN --to nav2-route"));
    }
    let format = |path: &Path| {
        args.to.or_else(|| Format::of(path)).map(|format| (path.to_owned(), format)).ok_or_else(|| {
            let message = format!("the name {} does not tell the format", path.display());
            Failure::new(Exit::Usage, "export.format", message)
                .help("--to nav2-route, tmap2, g2o, geojson, dot, svg, csv, tum or mcap")
        })
    };
    outs.into_iter().map(format).collect()
}
