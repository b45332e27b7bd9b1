//! Why the map looks as it does: what every loop and link says against all the others, how sure the places are, what holds
//! the map together, and what it would be without a link.
//!
//! Every number here is read from a [`Mapper`]; terminal, JSON and report print these and no others.
//!
//! A link or a loop is judged by what the **rest of the map** says of it. With `r` its residual after relaxation, `C` its
//! covariance and `C_map` that of the same displacement in the relaxed map,
//!
//! ```text
//! χ² = rᵀ (C − C_map)⁻¹ r      for a link that is part of the map
//! χ² = rᵀ (C + C_map)⁻¹ r      for a loop that is not
//! ```
//!
//! The first equals the second of a map without that link, so one scale serves for what was believed and for what was
//! refused: 9.2 is exceeded by one true loop in a hundred (two degrees of freedom). Headings are taken as known.

mod bridges;
mod links;
mod loops;
mod places;
mod springs;
mod what_if;

use serde::{Deserialize, Serialize};

pub use links::LinkStory;
pub use loops::LoopStory;
pub use places::PlaceStory;
pub use what_if::{Moved, WhatIf, without};

use crate::mapper::{Mapper, MapperError};
use crate::metrics::{RefusedLoop, TrustMetrics, WeakLink};
use springs::Springs;

/// A bridge that holds fewer places is the end of a path, and no weak spot.
const MANY: usize = 3;

/// Everything there is to say about why a map looks as it does, in a stable order.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Explanation {
    /// Energy of the map, headings included where they are unknown; the links' shares are of positions alone.
    pub energy: f64,
    /// Every loop that was weighed, in the order of the decisions; then those that a person added.
    pub loops: Vec<LoopStory>,
    /// Every link, by number.
    pub links: Vec<LinkStory>,
    /// Every visited place, the least sure one first.
    pub places: Vec<PlaceStory>,
}

impl Explanation {
    /// The link whose loss would part the map most evenly, if any parts at least `places` places from the rest.
    #[must_use]
    pub fn weakest_bridge(&self, places: usize) -> Option<&LinkStory> {
        let parting = self.links.iter().filter(|link| link.beyond >= places.max(1));
        parting.max_by(|a, b| a.beyond.cmp(&b.beyond).then(b.link.cmp(&a.link)))
    }

    /// The loops that were refused, the worst contradiction first.
    #[must_use]
    pub fn refused(&self) -> Vec<&LoopStory> {
        let mut refused: Vec<&LoopStory> = self.loops.iter().filter(|story| !story.accepted).collect();
        refused.sort_by(|a, b| b.residual_sigma.total_cmp(&a.residual_sigma));
        refused
    }

    /// The loops that the map is built on, the most strained one first.
    #[must_use]
    pub fn accepted(&self) -> Vec<&LoopStory> {
        let mut accepted: Vec<&LoopStory> = self.loops.iter().filter(|story| story.accepted).collect();
        accepted.sort_by(|a, b| b.residual_sigma.total_cmp(&a.residual_sigma));
        accepted
    }

    /// What is worth to be told of all this in a few figures.
    #[must_use]
    pub fn trust(&self) -> TrustMetrics {
        let worst = self.places.first();
        let refused = |story: &&LoopStory| RefusedLoop {
            place: story.place.0,
            known: story.known.0,
            residual_sigma: story.residual_sigma,
        };
        TrustMetrics {
            loop_residual_before_m: self.loop_residual_rms_before_m(),
            loop_residual_after_m: self.loop_residual_rms_m(),
            loop_residual_worst_sigma: self.accepted().first().map_or(0.0, |story| story.residual_sigma),
            place_sigma_median_m: self.place_sigma_median_m(),
            place_sigma_worst_m: worst.map_or(0.0, |place| place.sigma_m),
            worst_place: worst.map(|place| place.place.0),
            worst_place_links: worst.map_or(0, |place| place.links),
            refused: self.refused().iter().take(3).map(refused).collect(),
            weakest_link: self.weakest_bridge(MANY).map(|link| WeakLink {
                from: link.from.0,
                to: link.to.0,
                holds: link.beyond,
            }),
        }
    }

    /// Root mean square of the residuals of the believed loops, in metres; 0 without any.
    #[must_use]
    pub fn loop_residual_rms_m(&self) -> f64 {
        rms(self.loops.iter().filter(|story| story.accepted).map(|story| story.residual_m))
    }

    /// The same had the coordinates been left to dead reckoning.
    #[must_use]
    pub fn loop_residual_rms_before_m(&self) -> f64 {
        rms(self.loops.iter().filter(|story| story.accepted).map(|story| story.residual_before_m))
    }

    /// The median standard deviation of the places, in metres; 0 without any.
    #[must_use]
    pub fn place_sigma_median_m(&self) -> f64 {
        self.places.get(self.places.len() / 2).map_or(0.0, |place| place.sigma_m) // they are sorted
    }
}

/// Explains a map.
///
/// # Errors
///
/// Links that cannot be relaxed.
pub fn explain(mapper: &Mapper) -> Result<Explanation, MapperError> {
    let springs = Springs::new(mapper)?;
    let (map, coordinates) = (mapper.topology(), mapper.coordinates());
    Ok(Explanation {
        energy: coordinates.problem(map)?.energy(&coordinates.padded(map)),
        loops: loops::stories(mapper, &springs),
        links: links::stories(mapper, &springs),
        places: places::stories(mapper, &springs),
    })
}

fn rms(vectors: impl Iterator<Item = [f64; 2]>) -> f64 {
    let (sum, count) = vectors.fold((0.0, 0.0), |(sum, count), [x, y]| (sum + x * x + y * y, count + 1.0));
    if count > 0.0 { (sum / count).sqrt() } else { 0.0 }
}
