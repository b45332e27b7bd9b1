use std::fmt::Display;

use hierarchy::Metrics;
use hierarchy::explain::{LinkStory, LoopStory, PlaceStory};
use hierarchy::topo_map::LinkState;
use region_map::{Region, RegionMap};
use relaxation::Certificate;

use crate::render::svg::escape;

/// Rows that a table of the page has at most; files beside the page hold the rest.
const MOST_ROWS: usize = 300;
/// Rows from which on a table scrolls within the page.
const LONG: usize = 20;
/// Rows of a table of the worst.
const WORST: usize = 12;

/// A table under its heads; columns of numbers stand to the right.
pub(super) fn table(heads: &[&str], rows: impl IntoIterator<Item = Vec<String>>) -> String {
    let rows: Vec<Vec<String>> = rows.into_iter().collect();
    let class = |column: usize| {
        let numbers = rows.iter().all(|row| row.get(column).is_some_and(|text| is_number(text)));
        if numbers && !rows.is_empty() { " class=\"n\"" } else { "" }
    };
    let long = if rows.len() > LONG { "scroll long" } else { "scroll" };
    let mut html = format!("<div class=\"{long}\"><table><thead><tr>");
    html.extend(heads.iter().enumerate().map(|(at, head)| format!("<th scope=\"col\"{}>{head}</th>", class(at))));
    html.push_str("</tr></thead><tbody>\n");
    for row in &rows {
        let cells = row.iter().enumerate().map(|(at, text)| format!("<td{}>{text}</td>", class(at)));
        html.push_str(&format!("<tr>{}</tr>\n", cells.collect::<String>()));
    }
    html + "</tbody></table></div>"
}

/// Whether a cell holds numbers and nothing else.
fn is_number(text: &str) -> bool {
    !text.is_empty() && text.chars().all(|letter| letter.is_ascii_digit() || "−.× ".contains(letter))
}

/// A link of the page that opens a place.
fn place(id: impl Display) -> String {
    format!("<a href=\"#P{id}\" data-place=\"{id}\">P{id}</a>")
}

/// The run in a sentence.
pub(super) fn about(metrics: &Metrics) -> String {
    let Metrics { log, links, grid, .. } = metrics;
    let loops = match (links.recognized, links.rejected) {
        (0, 0) if links.traveled >= metrics.places => "loops closed by coming back to known places alone".to_owned(),
        (closed, refused) => format!("{closed} loops closed, {refused} refused"),
    };
    format!(
        "{} places joined by {} links over {:.1} m of travel, headings from {}; {loops}. \
         Drawn in {} × {} cells of {} m.",
        metrics.places,
        links.traveled + links.recognized,
        log.path_length_m,
        escape(&log.heading_source),
        grid.rows,
        grid.columns,
        grid.resolution_m
    )
}

/// The figures of the run, as the terminal has them.
pub(super) fn figures(metrics: &Metrics) -> String {
    let Metrics { log, links, relaxation, grid, .. } = metrics;
    let mut figures = vec![
        (
            "Places",
            metrics.places.to_string(),
            match metrics.predicted_places {
                0 => "visited".to_owned(),
                predicted => format!("visited, {predicted} more predicted"),
            },
        ),
        ("Links", (links.traveled + links.recognized).to_string(), format!("{} of them recognised", links.recognized)),
        ("Driven", format!("{:.1} m", log.path_length_m), format!("in {:.0} s, {} scans", log.duration_s, log.scans)),
        (
            "Energy",
            format!("{:.4}", relaxation.energy_after),
            format!("from {:.4}; optimum {:.4}", relaxation.energy_before, relaxation.energy_optimum),
        ),
        ("Largest shift", format!("{:.2} m", relaxation.max_shift_m), "of a place by relaxation".into()),
    ];
    if let Some(truth) = &metrics.truth {
        let beside = format!("{:.2} m by dead reckoning, {:.2} m by odometry", truth.before_m, truth.odometry_m);
        figures.push(("Error of places", format!("{:.2} m", truth.after_m), beside));
    }
    figures.push((
        "Gridmap",
        format!("{} × {}", grid.rows, grid.columns),
        format!(
            "cells of {} m; {} contradictory, {} unexplored",
            grid.resolution_m, grid.contradictory, grid.unexplored
        ),
    ));
    if let Some(regions) = &metrics.regions {
        let beside = format!("{} corridors, {} gateways", regions.corridors, regions.gateways);
        figures.push(("Rooms", regions.rooms.to_string(), beside));
    }
    let one = |(name, value, beside): &(&str, String, String)| {
        format!("<div><dt>{name}</dt><dd><b>{value}</b><small>{beside}</small></dd></div>")
    };
    figures.iter().map(one).collect()
}

/// What is proven of the coordinates.
pub(super) fn certificate(metrics: &Metrics, certificate: &Certificate, bridges: &[&LinkStory]) -> String {
    let relaxation = &metrics.relaxation;
    let rows = [
        ("Energy of the map", format!("{:.6}", relaxation.energy_after)),
        ("Least energy, by a direct solution of its own", format!("{:.6}", relaxation.energy_optimum)),
        ("Proven distance of the energy from its optimum, at most", bound(certificate.gap)),
        ("Proven distance of any place from its optimum, at most", format!("{} m", bound(certificate.max_shift))),
        ("Residual of the normal equations", bound(certificate.residual_norm)),
        ("Energy that right covariances would leave", certificate.degrees_of_freedom.to_string()),
        ("Separate parts", certificate.components.to_string()),
        ("Solver", escape(&relaxation.solver)),
    ];
    let rows = rows.into_iter().map(|(name, value)| vec![name.to_owned(), value]);
    let named: Vec<String> =
        bridges.iter().take(WORST).map(|link| format!("{}–{}", place(link.from.0), place(link.to.0))).collect();
    let more = if bridges.len() > WORST { format!(" and {} more", bridges.len() - WORST) } else { String::new() };
    let held = match bridges.len() {
        0 => "Every link is part of a loop: each is checked by others.".to_owned(),
        count => format!("{count} links are part of no loop, so nothing checks them: {}{more}.", named.join(", ")),
    };
    table(&["What", "Value"], rows) + &format!("<p>{held}</p>")
}

/// Every resemblance that was weighed.
pub(super) fn loops(all: &[LoopStory]) -> String {
    let optional = |value: Option<f64>| value.map_or_else(|| "–".to_owned(), |value| format!("{value:.2}"));
    let row = |story: &LoopStory| {
        let [x, y] = story.residual_m;
        vec![
            (if story.accepted { "● accepted" } else { "○ refused" }).to_owned(),
            place(story.place.0),
            place(story.known.0),
            signed(x),
            signed(y),
            format!("{:.1}", story.residual_sigma),
            format!("{:.1}", story.chi2),
            optional(story.shift_m),
            optional(story.score),
            escape(&story.reason),
        ]
    };
    let heads =
        ["Verdict", "Place", "Known", "Off in x [m]", "y [m]", "[σ]", "χ²", "Shift then [m]", "Likeness", "Reason"];
    if all.is_empty() {
        return "<p>No place looked like an older one.</p>".into();
    }
    table(&heads, all.iter().take(MOST_ROWS).map(row)) + &rest(all.len(), "loops.csv")
}

fn rest(count: usize, file: &str) -> String {
    if count <= MOST_ROWS { String::new() } else { format!("<p>{} more in {file}.</p>", count - MOST_ROWS) }
}

/// The places of which least is sure: the first of a list that begins with them.
pub(super) fn least_sure(places: &[PlaceStory]) -> String {
    let row = |story: &PlaceStory| {
        let [x, y] = story.position_m;
        let name = story.name.as_ref().map_or_else(String::new, |name| format!(" {}", escape(name)));
        vec![
            place(story.place.0) + &name,
            signed(x),
            signed(y),
            format!("{:.3}", story.sigma_m),
            format!("{:.2}", story.shift_m),
            story.links.to_string(),
            story.loops.to_string(),
        ]
    };
    let heads = ["Place", "x [m]", "y [m]", "σ [m]", "Moved [m]", "Links", "Loops"];
    table(&heads, places.iter().take(WORST).map(row))
}

/// The links that are farthest from what the rest of the map says.
pub(super) fn strained(links: &[LinkStory]) -> String {
    let mut links: Vec<&LinkStory> = links.iter().filter(|link| link.state != LinkState::Rejected).collect();
    links.sort_by(|a, b| b.residual_sigma.total_cmp(&a.residual_sigma));
    let row = |link: &&LinkStory| {
        vec![
            format!("{}–{}", place(link.from.0), place(link.to.0)),
            format!("{:?}", link.origin).to_lowercase(),
            format!("{:.2}", link.length_m),
            format!("{:.3}", link.residual_m[0].hypot(link.residual_m[1])),
            format!("{:.2}", link.energy.max(0.0).sqrt()),
            format!("{:.2}", link.residual_sigma),
        ]
    };
    table(
        &["Link", "Origin", "Length [m]", "Residual [m]", "[own σ]", "Against the rest [σ]"],
        links.iter().take(WORST).map(row),
    )
}

/// What a region is called.
pub(super) fn region_name(region: &Region) -> String {
    let kind = if region.corridor > region.room { "corridor" } else { "room" };
    region.name.clone().unwrap_or_else(|| format!("{kind} {}", region.label))
}

/// Rooms, corridors, and the doors between them.
pub(super) fn regions(map: &RegionMap) -> String {
    if map.regions.is_empty() {
        return "<p>The map holds no region.</p>".into();
    }
    let name = |label: u16| map.region(label).map_or_else(|| label.to_string(), |region| escape(&region_name(region)));
    let rows = map.regions.iter().take(MOST_ROWS).map(|region| {
        let doors = map.gateways.iter().filter(|gateway| gateway.regions.contains(&region.label));
        let beyond = |gateway: &region_map::Gateway| {
            let other = gateway.regions[usize::from(gateway.regions[0] == region.label)];
            format!("{} ({:.2} m)", name(other), gateway.width)
        };
        let doors: Vec<String> = doors.map(beyond).collect();
        vec![
            escape(&region_name(region)),
            format!("{:.1}", region.area),
            format!("{:.1} × {:.1}", region.length, region.width),
            format!("{:.2}", region.room),
            format!("{:.2}", region.corridor),
            if doors.is_empty() { "none".into() } else { doors.join(", ") },
        ]
    });
    table(&["Region", "Area [m²]", "Size [m]", "Like a room", "Like a corridor", "Gateways to (width)"], rows)
}

/// Where the time went, as bars.
pub(super) fn timings(metrics: &Metrics) -> String {
    let seconds = &metrics.timings_s;
    let stages = [
        ("read", seconds.read),
        ("local grids", seconds.local),
        ("recognition", seconds.recognize),
        ("relaxation", seconds.relax),
        ("gridmap", seconds.grid),
        ("regions", seconds.regions),
        ("writing", seconds.write),
    ];
    let longest = stages.iter().map(|(_, seconds)| *seconds).fold(1e-9, f64::max);
    let row = |(name, seconds): &(&str, f64)| {
        let bar = format!("<span class=\"bar\" style=\"width:{:.1}%\"></span>", 100.0 * seconds / longest);
        vec![(*name).to_owned(), format!("{seconds:.3}"), bar]
    };
    let measured = stages.iter().filter(|(_, seconds)| *seconds > 0.0);
    let total = format!("<p>{:.2} s in all, {:.0} MiB at most.</p>", seconds.total, metrics.peak_memory_mib);
    table(&["Stage", "Seconds", ""], measured.map(row)) + &total
}

fn signed(value: f64) -> String {
    let text = format!("{value:.2}");
    text.strip_prefix('-').map_or(text.clone(), |digits| format!("−{digits}"))
}

/// A number that should be 0: two digits and a power of ten, as people write it, or that it is nothing but rounding.
fn bound(value: f64) -> String {
    if value.abs() < 1e-9 {
        return "below 10⁻⁹".into();
    }
    let text = format!("{value:.1e}");
    let (digits, power) = text.split_once('e').unwrap_or((&text, "0"));
    let raised = |letter: char| letter.to_digit(10).map_or('⁻', |digit| DIGITS[digit as usize]);
    format!("{digits} × 10{}", power.chars().map(raised).collect::<String>())
}

const DIGITS: [char; 10] = ['⁰', '¹', '²', '³', '⁴', '⁵', '⁶', '⁷', '⁸', '⁹'];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_people_wrote_is_text_and_numbers_stand_to_the_right() {
        let html = table(&["a", "b"], [vec![escape("<script>"), "1.5".into()], vec!["x".into(), "−2.00".into()]]);
        assert!(html.contains("<th scope=\"col\">a</th><th scope=\"col\" class=\"n\">b</th>"));
        assert!(html.contains("<td>&lt;script&gt;</td><td class=\"n\">1.5</td>") && html.contains("class=\"n\">−2.00"));
    }

    #[test]
    fn small_numbers_are_readable() {
        assert_eq!([1.2e-19, 1.2e-7, 340.0].map(bound), ["below 10⁻⁹", "1.2 × 10⁻⁷", "3.4 × 10²"]);
        assert_eq!(signed(-0.4), "−0.40");
    }
}
