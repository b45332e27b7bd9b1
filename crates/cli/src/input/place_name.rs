//! Places and links as people write them: `P12`, `12`, or a name; `66-29` or `P66–P29`.

use hierarchy::Mapper;
use hierarchy::topo_map::{Link, PlaceId};

use crate::exit::Exit;
use crate::failure::Failure;
use crate::nearest::nearest;

/// The place that `text` means.
pub(crate) fn place(mapper: &Mapper, text: &str) -> Result<PlaceId, Failure> {
    if let Some(place) = find(mapper, text) {
        return Ok(place);
    }
    let count = mapper.topology().places().len();
    let message = format!("there is no place `{text}` among the {count} of this map");
    let names: Vec<&str> = mapper.names().map(|(_, name)| name).collect();
    let help = match nearest(text, names.iter().copied()) {
        Some(name) => format!("did you mean `{name}`?"),
        None => format!("places are P0 … P{}, or names given by `topogrid edit RUN name`", count.saturating_sub(1)),
    };
    Err(Failure::new(Exit::Usage, "place.unknown", message).help(help))
}

/// The two places that `text` means, such as `66-29`.
pub(crate) fn pair(mapper: &Mapper, text: &str) -> Result<(PlaceId, PlaceId), Failure> {
    let dashes = || text.char_indices().filter(|(_, c)| matches!(c, '-' | '–' | '→'));
    let halves = |(at, dash): (usize, char)| (text[..at].trim(), text[at + dash.len_utf8()..].trim());
    // A name may hold dashes itself: the first one that leaves two places is meant.
    if let Some(pair) = dashes().map(halves).find_map(|(a, b)| Some((find(mapper, a)?, find(mapper, b)?))) {
        return Ok(pair);
    }
    let Some((a, b)) = dashes().map(halves).next() else {
        let message = format!("expected two places such as 66-29, found `{text}`");
        return Err(Failure::new(Exit::Usage, "place.pair", message));
    };
    Ok((place(mapper, a)?, place(mapper, b)?))
}

/// The links between two places, or a failure that names those that each of them has.
pub(crate) fn links<'a>(mapper: &'a Mapper, text: &str) -> Result<Vec<&'a Link>, Failure> {
    let (a, b) = pair(mapper, text)?;
    let map = mapper.topology();
    let links: Vec<&Link> = map.links_between(a, b).collect();
    if links.is_empty() {
        let ends: Vec<String> = map.links_of(a).map(|link| format!("P{}", link.other_end(a).0)).collect();
        let message = format!("no link joins P{} and P{}", a.0, b.0);
        let help =
            format!("P{} is joined to {}", a.0, if ends.is_empty() { "nothing".into() } else { ends.join(", ") });
        return Err(Failure::new(Exit::Usage, "link.unknown", message).help(help));
    }
    Ok(links)
}

fn find(mapper: &Mapper, text: &str) -> Option<PlaceId> {
    if let Some((place, _)) = mapper.names().find(|(_, name)| *name == text) {
        return Some(place);
    }
    let number = text.strip_prefix(['P', 'p']).unwrap_or(text);
    let place = PlaceId(number.parse().ok()?);
    mapper.topology().place(place).map(|place| place.id)
}
