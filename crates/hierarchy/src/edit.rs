//! What people change about a map by hand: a list that is replayed on the map as it was recorded.
//!
//! The recorded map never changes. Each edit is a line of a TOML file, so undoing one is deleting it:
//!
//! ```
//! use hierarchy::edit::Edits;
//!
//! let edits = Edits::from_toml("[[edit]]\ndo = \"drop-link\"\nfrom = 66\nto = 29\n")?;
//! assert_eq!(edits.list[0].to_string(), "drop the links between P66 and P29");
//! assert_eq!(Edits::from_toml(&edits.to_toml())?, edits);
//! # Ok::<(), hierarchy::edit::EditError>(())
//! ```
//!
//! Everything that is said by hand is one more measurement among the others: pinned and merged places are held by stiff
//! springs, so that what contradicts them shows up in the energy and in `explain`.

mod measure;

use std::fmt;

use nalgebra::{Matrix2, Vector2};
use serde::{Deserialize, Serialize};
use topo_map::{Displacement, LinkId, LinkOrigin, LinkState, PlaceId, Turn};

use crate::mapper::{Mapper, MapperError};

pub use measure::{Measured, measure};

/// A list of edits, in the order in which they are applied.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Edits {
    /// The edits.
    #[serde(default, rename = "edit")]
    pub list: Vec<Edit>,
}

/// One change by hand. Places are named by their numbers.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "do", rename_all = "kebab-case", deny_unknown_fields)]
pub enum Edit {
    /// All links between two places are held to be false.
    DropLink {
        /// One place.
        from: u32,
        /// The other.
        to: u32,
    },
    /// Two places lie beside each other.
    AddLink {
        /// Where the link begins.
        from: u32,
        /// Where it ends.
        to: u32,
        /// Where the end lies as seen from the beginning.
        by: Measured,
    },
    /// A place lies at known coordinates, relative to the first place.
    Pin {
        /// The place.
        place: u32,
        /// Where it lies in the map, in metres.
        at_m: [f64; 2],
        /// How sure that is, as a standard deviation in metres.
        sigma_m: f64,
    },
    /// A place is another one: they are held together, and navigation sees one.
    Merge {
        /// The place that is no place of its own.
        place: u32,
        /// The place that it is.
        into: u32,
        /// Where the centre of `into` lies as seen from `place`.
        by: Measured,
    },
    /// A place gets a name; an empty one takes it away.
    Name {
        /// The place.
        place: u32,
        /// Its name.
        name: String,
    },
}

/// Why edits cannot be applied.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum EditError {
    /// The text is no list of edits; the message names line and key.
    #[error("{0}")]
    Syntax(String),
    /// One of the edits does not fit the map.
    #[error("edit {number} ({edit}): {reason}")]
    Unfit {
        /// From 1.
        number: usize,
        /// The edit in words.
        edit: String,
        /// What is wrong.
        reason: String,
    },
    /// The edited map cannot be relaxed.
    #[error("the edited map: {0}")]
    Map(#[from] MapperError),
}

impl Edits {
    /// Reads a list.
    ///
    /// # Errors
    ///
    /// Text that is not TOML, unknown edits and keys.
    pub fn from_toml(text: &str) -> Result<Self, EditError> {
        toml::from_str(text).map_err(|error| EditError::Syntax(error.to_string()))
    }

    /// The list as a file; reading it back gives the same list.
    ///
    /// # Panics
    ///
    /// Never: numbers, words and tables are TOML.
    #[must_use]
    pub fn to_toml(&self) -> String {
        toml::to_string(self).expect("numbers, words and tables are TOML")
    }

    /// Applies every edit and relaxes the map to its optimum; without any edit the map stays exactly as it is.
    ///
    /// # Errors
    ///
    /// The first edit that does not fit the map, which may then hold some of them.
    pub fn apply(&self, mapper: &mut Mapper) -> Result<(), EditError> {
        for (index, edit) in self.list.iter().enumerate() {
            edit.apply(mapper).map_err(|reason| EditError::Unfit {
                number: index + 1,
                edit: edit.to_string(),
                reason,
            })?;
        }
        if self.list.iter().any(|edit| !matches!(edit, Edit::Name { .. })) {
            mapper.relax()?;
        }
        Ok(())
    }
}

impl Edit {
    fn apply(&self, mapper: &mut Mapper) -> Result<(), String> {
        match self {
            Self::DropLink { from, to } => drop_links(mapper, PlaceId(*from), PlaceId(*to)),
            Self::AddLink { from, to, by } => add_link(mapper, PlaceId(*from), PlaceId(*to), by).map(|_| ()),
            Self::Pin { place, at_m, sigma_m } => pin(mapper, PlaceId(*place), (*at_m).into(), *sigma_m),
            Self::Merge { place, into, by } => {
                add_link(mapper, PlaceId(*place), PlaceId(*into), by)?;
                mapper.declare_same(PlaceId(*place), PlaceId(*into));
                Ok(())
            }
            Self::Name { place, name } => {
                if mapper.name(PlaceId(*place), name) {
                    Ok(())
                } else {
                    Err(format!("there is no place P{place}"))
                }
            }
        }
    }
}

impl fmt::Display for Edit {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::DropLink { from, to } => write!(f, "drop the links between P{from} and P{to}"),
            Self::AddLink { from, to, by } => write!(f, "link P{from} and P{to}, {by}"),
            Self::Pin { place, at_m: [x, y], sigma_m } => write!(f, "pin P{place} at ({x:.2}, {y:.2}) ± {sigma_m} m"),
            Self::Merge { place, into, by } => write!(f, "merge P{place} into P{into}, {by}"),
            Self::Name { place, name } if name.is_empty() => write!(f, "take the name of P{place} away"),
            Self::Name { place, name } => write!(f, "name P{place} `{name}`"),
        }
    }
}

fn drop_links(mapper: &mut Mapper, from: PlaceId, to: PlaceId) -> Result<(), String> {
    let between = mapper.topology().links_between(from, to);
    let links: Vec<LinkId> = between.filter(|link| link.state != LinkState::Rejected).map(|link| link.id).collect();
    if links.is_empty() {
        return Err(format!("no link joins P{} and P{}", from.0, to.0));
    }
    for link in links {
        mapper.topology_mut().set_link_state(link, LinkState::Rejected).map_err(|error| in_full(&error))?;
    }
    Ok(())
}

fn add_link(mapper: &mut Mapper, from: PlaceId, to: PlaceId, by: &Measured) -> Result<LinkId, String> {
    let displacement = by.displacement(mapper, from, to);
    mapper.topology_mut().recognize(from, to, displacement).map_err(|error| in_full(&error))
}

/// A stiff spring from the first place, which is the map's origin; it says nothing of headings, and no route leads over it.
fn pin(mapper: &mut Mapper, place: PlaceId, at: Vector2<f64>, sigma: f64) -> Result<(), String> {
    let first = mapper.topology().places().first().map_or(PlaceId(0), |place| place.id);
    if place == first {
        return Err(format!("P{} is the origin that all others are measured from; pin another place", place.0));
    }
    let (map_from_first, map_from_place) =
        (mapper.coordinates().map_from_place(first), mapper.coordinates().map_from_place(place));
    let step = at - map_from_first.translation.vector;
    let turned = turns(mapper).then(|| map_from_first.rotation.inverse() * step);
    let change = (map_from_first.rotation.inverse() * map_from_place.rotation).angle();
    let displacement = Displacement {
        vector: turned.unwrap_or(step),
        covariance: Matrix2::identity() * sigma * sigma,
        turn: turned.map(|_| Turn { change, variance: ANY_TURN }),
    };
    let map = mapper.topology_mut();
    let link = map.add_link(first, place, displacement, LinkOrigin::Recognized).map_err(|error| in_full(&error))?;
    map.set_link_state(link, LinkState::Blocked).map_err(|error| in_full(&error))
}

/// An error with its causes.
fn in_full(error: &dyn std::error::Error) -> String {
    let cause = error.source().map(|cause| format!(": {}", in_full(cause))).unwrap_or_default();
    format!("{error}{cause}")
}

/// The variance in rad² of a turn that nobody measured.
const ANY_TURN: f64 = 1e4;

/// Whether the headings of this map are unknown, so that links carry turns.
fn turns(mapper: &Mapper) -> bool {
    mapper.topology().links().iter().any(|link| link.displacement.turn.is_some())
}
