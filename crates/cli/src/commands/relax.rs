use std::io::{self, BufRead, BufReader, Write};
use std::path::{Path, PathBuf};
use std::time::Instant;

use clap::{Args, ValueEnum};
use relaxation::g2o::{self, Graph, ParseError};

use crate::context::Context;
use crate::exit::Exit;
use crate::failure::{Failure, Place};
use crate::files;

mod picture;
mod points;
mod poses;
mod report;

use report::Report;

/// Coordinates for a g2o or TORO graph: positions, and headings where no compass gives them
///
/// Example: topogrid relax M3500.g2o --out relaxed.g2o --svg before-and-after.svg
#[derive(Debug, Args)]
pub(crate) struct RelaxArgs {
    /// The graph, plain or gzip: g2o (VERTEX_SE2, EDGE_SE2, VERTEX_XY, EDGE_XY, EDGE_POINTXY, FIX) or TORO; `-` reads standard input
    #[arg(value_name = "GRAPH")]
    graph: PathBuf,
    /// The relaxed graph: .g2o, .graph (TORO), either with .gz; `-` writes g2o to standard output
    #[arg(short, long, value_name = "FILE")]
    out: Option<PathBuf>,
    /// How positions are computed where headings are known; with estimated headings it is always Gauss-Newton
    #[arg(long, value_name = "METHOD", default_value = "auto")]
    method: Method,
    /// What to do about edges that may be false; edges between successive vertices and bridges are always believed
    #[arg(long, value_name = "KIND", default_value = "none")]
    robust: Robust,
    /// Where headings come from: the file's vertices, or the edges alone
    #[arg(long, value_name = "SOURCE", default_value = "estimated")]
    headings: HeadingSource,
    /// Tell how sure every vertex is (relative to the one that is held)
    #[arg(long)]
    covariance: bool,
    /// Draw the graph before and after
    #[arg(long, value_name = "FILE")]
    svg: Option<PathBuf>,
    /// Replace files that are there
    #[arg(long)]
    force: bool,
}

/// A way to positions.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Method {
    /// The quickest exact one
    Auto,
    /// Chains are eliminated, the rest is factored
    Elimination,
    /// Sparse Cholesky factorisation of everything
    Direct,
    /// The paper's sweeps
    GaussSeidel,
    /// Over-relaxed sweeps
    Sor,
    /// Conjugate gradients
    ConjugateGradient,
    /// Sweeps on coarser and coarser maps
    Multilevel,
}

/// A way to tell false edges.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Robust {
    /// All edges are believed
    None,
    /// Truncated least squares by graduated non-convexity: every edge ends in or out
    Gnc,
    /// Geman-McClure by graduated non-convexity
    GncGemanMcclure,
    /// Huber's kernel
    Huber,
    /// Cauchy's kernel
    Cauchy,
    /// Geman and McClure's kernel
    GemanMcclure,
    /// Dynamic covariance scaling
    Dcs,
}

/// Where headings come from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum HeadingSource {
    Given,
    Estimated,
}

/// Relaxes the graph and says how it went.
pub(crate) fn run(args: &RelaxArgs, context: &Context) -> Result<(), Failure> {
    let mut graph = read(&args.graph)?;
    if !graph.pose_edges.is_empty() && !graph.point_edges.is_empty() {
        let message = format!(
            "{} holds {} edges between poses and {} between points; they are two graphs",
            args.graph.display(),
            graph.pose_edges.len(),
            graph.point_edges.len()
        );
        return Err(
            Failure::new(Exit::Rejected, "graph.mixed", message).help("split the file, one kind of edge in each")
        );
    }
    for skipped in &graph.skipped {
        context.warn(&format!(
            "{} lines `{}` of an unknown kind were passed over, the first is line {}",
            skipped.count, skipped.tag, skipped.first_line
        ));
    }
    if !graph.duplicates.is_empty() {
        context.warn(&format!("{} vertices have an id that was used before; the first counts", graph.duplicates.len()));
    }
    let stage = context.progress().stage("relaxing", 0);
    let started = Instant::now();
    let of_points = graph.pose_edges.is_empty() && graph.poses.is_empty();
    let mut report =
        if of_points { points::relax(args, &mut graph)? } else { poses::relax(args, &mut graph, context)? };
    report.seconds = started.elapsed().as_secs_f64();
    stage.finish(&format!("χ² {:.6} → {:.6}", report.chi2_before, report.chi2_after));
    write(args, &graph, &report)?;
    let to_stdout = args.out.as_deref() == Some(Path::new("-"));
    if context.json && !to_stdout {
        context.print_json(&report.to_json(&args.graph, &graph))
    } else if to_stdout {
        context.say(report.to_text(&args.graph).trim_end());
        Ok(())
    } else {
        context.print(&report.to_text(&args.graph))
    }
}

fn read(path: &Path) -> Result<Graph, Failure> {
    let source: Box<dyn BufRead> =
        if path.as_os_str() == "-" { Box::new(BufReader::new(io::stdin())) } else { Box::new(files::open(path)?) };
    g2o::read(source).map_err(|error| match &error {
        ParseError::Unexpected { line, column, expected, found } => {
            let place = Place {
                file: path.display().to_string(),
                line: *line as u64,
                column: *column,
                excerpt: None,
                label: format!("expected {expected}"),
            };
            Failure::new(Exit::Rejected, "graph.parse", format!("expected {expected}, found `{found}`"))
                .at(place)
                .detail("expected", *expected)
                .detail("found", found.as_str())
        }
        error => Failure::rejected(path, "graph.parse", error),
    })
}

/// Writes the relaxed graph and the picture.
fn write(args: &RelaxArgs, graph: &Graph, report: &Report) -> Result<(), Failure> {
    match args.out.as_deref() {
        None => {}
        Some(path) if path.as_os_str() == "-" => {
            let mut out = io::BufWriter::new(io::stdout().lock());
            g2o::write(graph, &mut out)
                .map_err(io::Error::other)
                .and_then(|()| out.flush())
                .map_err(Failure::stdout)?;
        }
        Some(path) => {
            let write = |out: &mut dyn Write| write_graph(path, graph, out);
            files::write(path, args.force, write).map_err(|error| Failure::writing(path, &error))?;
        }
    }
    if let Some(path) = &args.svg {
        let picture = picture::before_and_after(report);
        files::write(path, args.force, |out| out.write_all(picture.as_bytes()))
            .map_err(|error| Failure::writing(path, &error))?;
    }
    Ok(())
}

/// The name says which dialect, and whether it is compressed.
fn write_graph(path: &Path, graph: &Graph, mut out: &mut dyn Write) -> io::Result<()> {
    let name = path.to_string_lossy().to_lowercase();
    let (name, gzip) = match name.strip_suffix(".gz") {
        Some(name) => (name, true),
        None => (name.as_str(), false),
    };
    let toro = name.ends_with(".graph") || name.ends_with(".toro");
    let written = match (toro, gzip) {
        (false, false) => g2o::write(graph, &mut out),
        (false, true) => g2o::write_gzip(graph, &mut out),
        (true, false) => g2o::write_toro(graph, &mut out),
        (true, true) => g2o::write_toro_gzip(graph, &mut out),
    };
    written.map_err(io::Error::other)
}
