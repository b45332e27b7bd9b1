use std::path::PathBuf;

use clap::Args;
use hierarchy::Mapper;
use hierarchy::explain::{Explanation, WhatIf, explain, without};
use hierarchy::topo_map::{LinkId, PlaceId};
use serde::Serialize;

use crate::context::Context;
use crate::exit::Exit;
use crate::failure::Failure;
use crate::{input::place_name, input::session};

mod text;

/// Why the map looks like this: loops with their reasons, weak spots, and what if a link were gone
///
/// Examples:
///   topogrid explain runs/office
///   topogrid explain runs/office --loops
///   topogrid explain runs/office --without 66-29
#[derive(Debug, Args)]
#[command(verbatim_doc_comment)]
pub(crate) struct ExplainArgs {
    /// The run: its folder, or its session.hmap
    #[arg(value_name = "RUN")]
    run: PathBuf,
    /// Every loop that was weighed, those refused first: how far it is from the rest of the map, and why
    #[arg(long)]
    loops: bool,
    /// The places that are least sure
    #[arg(long, value_name = "N")]
    worst: Option<usize>,
    /// The links between two places
    #[arg(long, value_name = "A-B")]
    link: Option<String>,
    /// One place with everything that holds it
    #[arg(long, value_name = "P")]
    place: Option<String>,
    /// Solve the map again without the links between two places, and say what would change; may be repeated
    #[arg(long, value_name = "A-B")]
    without: Vec<String>,
    /// Print all rows, not only as many as fit a screen
    #[arg(long)]
    all: bool,
}

/// What was asked for; as JSON this is the document.
#[derive(Debug, Serialize)]
struct Told {
    schema: &'static str,
    #[serde(flatten)]
    explanation: Explanation,
    #[serde(skip_serializing_if = "Option::is_none")]
    without: Option<WhatIf>,
}

/// Explains the run.
pub(crate) fn run(args: &ExplainArgs, context: &Context) -> Result<(), Failure> {
    let mapper = session::load(&args.run)?;
    let failed = |error: hierarchy::MapperError| Failure::new(Exit::Failed, "explain", error.to_string());
    let links = args.link.as_deref().map(|text| ids(&mapper, text)).transpose()?;
    let place = args.place.as_deref().map(|text| place_name::place(&mapper, text)).transpose()?;
    let mut removed = Vec::new();
    for text in &args.without {
        removed.extend(ids(&mapper, text)?);
    }
    let what_if = (!removed.is_empty()).then(|| without(&mapper, &removed)).transpose().map_err(failed)?;
    let told = Told {
        schema: "topogrid/explain/1",
        explanation: narrowed(explain(&mapper).map_err(failed)?, args, links.as_deref(), place),
        without: what_if,
    };
    if context.json {
        return context.print_json(&told);
    }
    let rows = if args.all { usize::MAX } else { text::ROWS };
    let explanation = &told.explanation;
    context.print(&match (&told.without, links, place) {
        (Some(what_if), ..) => text::what_if(what_if, explanation, rows),
        (None, Some(_), _) => text::links(explanation, rows),
        (None, None, Some(place)) => text::place(explanation, place, rows),
        _ if args.loops => text::loops(explanation, rows),
        _ if args.worst.is_some() => text::worst(explanation),
        _ => text::overview(&args.run, explanation),
    })
}

/// What is left when only some links, one place or the worst places were asked for.
fn narrowed(
    mut told: Explanation,
    args: &ExplainArgs,
    links: Option<&[LinkId]>,
    place: Option<PlaceId>,
) -> Explanation {
    if let Some(links) = links {
        told.links.retain(|story| links.contains(&story.link));
        told.loops.retain(|story| story.link.is_some_and(|link| links.contains(&link)));
        let ends: Vec<PlaceId> = told.links.iter().flat_map(|story| [story.from, story.to]).collect();
        told.places.retain(|story| ends.contains(&story.place));
    }
    if let Some(place) = place {
        told.links.retain(|story| story.from == place || story.to == place);
        told.loops.retain(|story| story.place == place || story.known == place);
        told.places.retain(|story| story.place == place);
    }
    if let Some(count) = args.worst {
        told.places.truncate(count);
    }
    told
}

fn ids(mapper: &Mapper, text: &str) -> Result<Vec<LinkId>, Failure> {
    Ok(place_name::links(mapper, text)?.into_iter().map(|link| link.id).collect())
}
