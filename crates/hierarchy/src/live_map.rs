use global_grid::{GridError, GridMap, GridOptions};
use nalgebra::Isometry2;

use crate::mapper::Mapper;

/// Metres ahead of the robot at which a turn of it is felt as a shift.
const ARM: f64 = 2.0;

/// The global gridmap of a mapper, kept up to date while it maps: only scans that moved are fused again.
///
/// Relaxation moves all places a little with every new one, and most of them by less than anybody can see; how far a scan
/// may lie from where it belongs before it is fused again is said each time. Followed without slack, the map equals the one
/// that is built at once from the finished mapper, bit for bit, whatever came before.
///
/// ```no_run
/// # fn entries() -> Vec<robot_log::Entry> { vec![] }
/// # use hierarchy::{Config, LiveMap, Mapper};
/// let mut mapper = Mapper::new(Config::default())?;
/// let mut map = LiveMap::new(mapper.config().grid.options())?;
/// for entry in entries() {
///     mapper.push(&entry)?;
///     map.follow(&mapper, 0.02)?; // whatever lies within two centimetres stays
/// }
/// map.follow(&mapper, 0.0)?;
/// let grid = map.map().to_grid()?;
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone)]
pub struct LiveMap {
    map: GridMap,
    /// Where each scan was drawn.
    drawn: Vec<Isometry2<f64>>,
}

/// What following a mapper took.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Followed {
    /// Scans that are new in the map.
    pub added: usize,
    /// Scans that were fused again because they moved.
    pub moved: usize,
}

impl LiveMap {
    /// A map that holds nothing yet.
    ///
    /// # Errors
    ///
    /// Options that make no sense.
    pub fn new(options: GridOptions) -> Result<Self, GridError> {
        Ok(Self { map: GridMap::new(options)?, drawn: Vec::new() })
    }

    /// Takes in the mapper's new scans, and fuses those again that have moved by more than `slack` metres: with 0, by
    /// anything at all. Until the first place is there, nothing is drawn.
    ///
    /// # Errors
    ///
    /// A scan that cannot be drawn; of the new ones, none is in the map then.
    pub fn follow(&mut self, mapper: &Mapper, slack: f64) -> Result<Followed, GridError> {
        let poses = mapper.poses();
        let mut followed = Followed::default();
        for ((key, drawn), pose) in (0..).zip(&mut self.drawn).zip(&poses) {
            if shift(drawn, pose) > slack || (slack <= 0.0 && drawn != pose) {
                self.map.relocate(key, std::slice::from_ref(pose))?;
                *drawn = *pose;
                followed.moved += 1;
            }
        }
        let (known, samples) = (self.drawn.len(), mapper.trajectory().samples());
        let new = (0..).zip(samples).zip(&poses).skip(known).map(|((key, sample), pose)| (key, pose, &sample.scan));
        self.map.insert_all(new)?;
        let new = poses.get(known..).unwrap_or_default();
        followed.added = new.len();
        self.drawn.extend_from_slice(new);
        Ok(followed)
    }

    /// The map.
    #[must_use]
    pub fn map(&self) -> &GridMap {
        &self.map
    }

    /// The map, to keep.
    #[must_use]
    pub fn into_map(self) -> GridMap {
        self.map
    }
}

/// How far a scan has moved, in metres.
fn shift(from: &Isometry2<f64>, to: &Isometry2<f64>) -> f64 {
    (to.translation.vector - from.translation.vector).norm() + ARM * from.rotation.angle_to(&to.rotation).abs()
}
