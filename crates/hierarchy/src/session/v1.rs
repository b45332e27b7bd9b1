use serde::{Deserialize, Serialize};

use super::records::{
    StoredAnchor, StoredDisplacement, StoredLink, StoredPlace, StoredSample, StoredSensor, StoredTally, StoredTracker,
};

/// Version 1 of a session. Never changed, and only read: a later version has structs of its own.
#[derive(Serialize, Deserialize)]
pub(super) struct Session {
    pub(super) config: String,
    pub(super) sensors: Vec<StoredSensor>,
    pub(super) samples: Vec<StoredSample>,
    pub(super) anchors: Vec<StoredAnchor>,
    pub(super) places: Vec<StoredPlace>,
    pub(super) links: Vec<StoredLink>,
    pub(super) closures: Vec<StoredClosure>,
    pub(super) tally: StoredTally,
    pub(super) tracker: StoredTracker,
    pub(super) held_by_scans: bool,
    pub(super) sweeps: u64,
    pub(super) names: Vec<(u32, String)>,
}

#[derive(Serialize, Deserialize)]
pub(super) struct StoredClosure {
    pub(super) place: u32,
    pub(super) known: u32,
    pub(super) displacement: StoredDisplacement,
    pub(super) score: f64,
    pub(super) shift: f64,
    pub(super) agreed: u32,
    pub(super) log_odds: Option<f64>,
}
