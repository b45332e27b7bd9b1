//! `compare.html`: maps of one place upon each other, to blink between, and what became of every cell.

use std::fmt::Write;

use global_grid::{Change, CrispOptions, common_frame, count_changes, difference, resampled, write_difference};
use hierarchy::Metrics;
use local_grid::{FuzzyGrid, GridFrame};

use super::base64::base64;
use super::page::fill;
use super::{failed, indexed, tables};
use crate::failure::Failure;
use crate::render::svg::escape;

/// The page, and its style.
const TEMPLATE: &str = include_str!("template/compare.html");

/// One of the maps that are compared.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Side<'a> {
    pub(crate) name: &'a str,
    pub(crate) gridmap: &'a FuzzyGrid,
    /// The figures of the run that made it.
    pub(crate) metrics: Option<&'a Metrics>,
}

/// How two maps of one place differ, in cells.
pub(crate) type Counts = [(Change, usize); 7];

/// The page of some maps in the same coordinates; the first one is what the others are held against.
pub(crate) fn comparison(sides: &[Side<'_>]) -> Result<(String, Vec<Counts>), Failure> {
    let Some((first, others)) = sides.split_first() else { return Ok((String::new(), Vec::new())) };
    let grids: Vec<&FuzzyGrid> = others.iter().map(|side| side.gridmap).collect();
    let frame = common_frame(first.gridmap, &grids).map_err(|error| failed(&error))?;
    let mut counts = Vec::new();
    let mut pictures = picture("before", first.name, &indexed(&resampled(first.gridmap, &frame))?);
    for (number, other) in others.iter().enumerate() {
        let onto = resampled(other.gridmap, &frame);
        pictures += &picture(&format!("after n{number}"), other.name, &indexed(&onto)?);
        let before = resampled(first.gridmap, &frame);
        let changes = difference(&before, &onto, &CrispOptions::default()).map_err(|error| failed(&error))?;
        let mut png = Vec::new();
        write_difference(&changes, &mut png).map_err(|error| failed(&error))?;
        let name = format!("what changed from {} to {}", first.name, other.name);
        pictures += &picture(&format!("change n{number}"), &name, &base64(&png));
        counts.push(count_changes(&changes));
    }
    let names: Vec<String> = sides.iter().map(|side| escape(side.name)).collect();
    let page = fill(
        TEMPLATE,
        &[
            ("names", names.join(" · ")),
            ("first", names[0].clone()),
            ("choices", choices(&names[1..])),
            ("selectors", selectors(others.len())),
            ("pictures", pictures),
            ("legend", legend()),
            ("changes", changes_table(&names[1..], &counts, &frame)),
            ("figures", figures(sides)),
            ("width", frame.columns().to_string()),
            ("height", frame.rows().to_string()),
            ("cell", frame.resolution().to_string()),
        ],
    );
    Ok((page, counts))
}

fn picture(class: &str, name: &str, png: &str) -> String {
    let name = escape(name);
    format!(
        "<figure class=\"{class}\"><img alt=\"{name}\" src=\"data:image/png;base64,{png}\"><figcaption>{name}</figcaption></figure>\n"
    )
}

/// Which of the others is looked at.
fn choices(names: &[String]) -> String {
    let choice = |(number, name): (usize, &String)| {
        let checked = if number == 0 { " checked" } else { "" };
        format!("<label><input type=\"radio\" name=\"other\" id=\"n{number}\"{checked}> {name}</label>")
    };
    names.iter().enumerate().map(choice).collect()
}

/// Which pictures are seen when the boxes of one of the others and of a way to look are ticked.
fn selectors(others: usize) -> String {
    let of_one = |n: usize| {
        format!(
            ".pick:has(#second:checked):has(#n{n}:checked) .after.n{n}, \
             .pick:has(#change:checked):has(#n{n}:checked) .change.n{n} {{ visibility: visible; }}\n\
             .pick:has(#blink:checked):has(#n{n}:checked) .after.n{n} {{ animation: blink 1.6s steps(1) infinite; }}\n"
        )
    };
    (0..others).map(of_one).collect()
}

/// What a change is called.
fn word(change: Change) -> &'static str {
    match change {
        Change::Unknown => "unknown in both",
        Change::Free => "free in both",
        Change::Occupied => "occupied in both",
        Change::Appeared => "free, then occupied",
        Change::Vanished => "occupied, then free",
        Change::Found => "unknown, then known",
        Change::Lost => "known, then unknown",
    }
}

fn legend() -> String {
    Change::ALL.iter().fold(String::new(), |mut html, change| {
        let [red, green, blue] = change.color();
        let _ = write!(html, "<li><i style=\"background:rgb({red},{green},{blue})\"></i>{}</li>", word(*change));
        html
    })
}

fn changes_table(names: &[String], counts: &[Counts], frame: &GridFrame) -> String {
    let area = frame.resolution() * frame.resolution();
    let row = |(at, change): (usize, &Change)| {
        let mut row = vec![word(*change).to_owned()];
        #[expect(clippy::cast_precision_loss, reason = "cells of a map are few")]
        let square_metres = |counts: &Counts| format!("{:.2}", counts[at].1 as f64 * area);
        row.extend(counts.iter().flat_map(|counts| [counts[at].1.to_string(), square_metres(counts)]));
        row
    };
    let mut heads = vec!["Cells".to_owned()];
    heads.extend(names.iter().flat_map(|name| [name.clone(), "m²".to_owned()]));
    let heads: Vec<&str> = heads.iter().map(String::as_str).collect();
    tables::table(&heads, Change::ALL.iter().enumerate().map(row))
}

/// The figures of the runs, one column each.
fn figures(sides: &[Side<'_>]) -> String {
    type Figure = (&'static str, fn(&Metrics) -> String);
    const FIGURES: [Figure; 11] = [
        ("places", |metrics| metrics.places.to_string()),
        ("links", |metrics| (metrics.links.traveled + metrics.links.recognized).to_string()),
        ("loops closed", |metrics| metrics.links.recognized.to_string()),
        ("loops refused", |metrics| metrics.links.rejected.to_string()),
        ("energy", |metrics| format!("{:.4}", metrics.relaxation.energy_after)),
        ("largest shift [m]", |metrics| format!("{:.2}", metrics.relaxation.max_shift_m)),
        ("error of places [m]", |metrics| {
            metrics.truth.as_ref().map_or_else(|| "–".to_owned(), |truth| format!("{:.3}", truth.after_m))
        }),
        ("occupied cells", |metrics| metrics.grid.occupied.to_string()),
        ("empty cells", |metrics| metrics.grid.empty.to_string()),
        ("contradictory cells", |metrics| metrics.grid.contradictory.to_string()),
        ("seconds", |metrics| format!("{:.2}", metrics.timings_s.total)),
    ];
    if sides.iter().all(|side| side.metrics.is_none()) {
        return String::new();
    }
    let names: Vec<String> = sides.iter().map(|side| escape(side.name)).collect();
    let heads: Vec<&str> = std::iter::once("Figure").chain(names.iter().map(String::as_str)).collect();
    let row = |(name, value): &Figure| {
        let values = sides.iter().map(|side| side.metrics.map_or_else(|| "–".to_owned(), value));
        std::iter::once((*name).to_owned()).chain(values).collect()
    };
    tables::table(&heads, FIGURES.iter().map(row))
}

#[cfg(test)]
mod tests {
    use super::*;
    use local_grid::{Fuzzy, Grid};
    use nalgebra::Point2;

    fn map(cells: &[f32]) -> FuzzyGrid {
        let frame = GridFrame::new(Point2::origin(), 0.1, 1, cells.len()).unwrap();
        let cell = |empty: &f32| Fuzzy { empty: *empty, occupied: 1.0 - empty };
        Grid::from_cells(frame, cells.iter().map(cell).collect()).unwrap()
    }

    #[test]
    fn each_map_is_held_against_the_first() {
        let (a, b, c) = (map(&[1.0, 0.0]), map(&[1.0, 1.0]), map(&[0.0, 0.0]));
        let side = |name, gridmap| Side { name, gridmap, metrics: None };
        let (page, counts) = comparison(&[side("a", &a), side("<b>", &b), side("c", &c)]).unwrap();
        let changed = |counts: &Counts| (counts[3].1, counts[4].1);
        assert_eq!(counts.iter().map(changed).collect::<Vec<_>>(), [(0, 1), (1, 0)]);
        assert_eq!(page.matches("<figure").count(), 5);
        assert!(page.contains("> &lt;b&gt;</label>") && !page.contains("> <b></label>") && !page.contains("{{"));
    }
}
