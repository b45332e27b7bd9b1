//! How good a path, a map or a recogniser is: pure functions on what was found and what is true.
//!
//! | question | function |
//! |---|---|
//! | how far off is a path? | [`absolute_error`], after [`align`] |
//! | how far off is each step? | [`relative_error`] |
//! | are the true relations met? | [`relations_error`] |
//! | does the robot know its place? | [`localization`], by its [`Contingency`] |
//! | does it know a place again? | [`recognition`] |
//! | do walls that are met again lie where they lay? | [`seen_again`] |
//! | are the walls where they should be? | [`compare_maps`], [`map_score`] |
//! | is the map sharp, where nothing is known to be true? | [`sharpness`], [`known_entropy`] |

mod alignment;
mod distance_field;
mod localization;
mod map_match;
mod odometry_map;
mod pairing;
mod path;
mod path_error;
mod recognition;
mod relations;
mod revisits;
mod seen_again;
mod sharpness;
mod statistics;

pub use alignment::{Alignment, Fit, align};
pub use localization::{Localization, localization};
pub use map_match::{MapMatch, WallMatch, compare_maps, map_score};
pub use odometry_map::{odometry_map, odometry_map_by};
pub use pairing::Pairing;
pub use path::{PathError, TimedPath};
pub use path_error::{AbsoluteError, Delta, RelativeError, absolute_error, relative_error};
pub use recognition::{Contingency, Recognition};
pub use relations::{
    ErrorParts, Relation, RelationsError, RelationsOptions, RelationsParseError, read_relations, relations_error,
};
pub use revisits::recognition;
pub use seen_again::{SeenAgain, seen_again};
pub use sharpness::{Sharpness, known_entropy, mean_entropy, sharpness, wall_thickness};
pub use statistics::Statistics;
