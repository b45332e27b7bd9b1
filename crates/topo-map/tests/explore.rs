//! The explorer as a state machine by itself; whole explorations are tests of the crate above, which drives them.

use local_grid::nalgebra::{Isometry2, Point2};
use topo_map::{Command, ExploreError, Explorer, ExplorerOptions, Observation, TopoMap, local_grid};

#[test]
fn wrong_input_is_refused_and_a_survey_begins_the_exploration() {
    let wrong = ExplorerOptions { stride: 0.0, ..ExplorerOptions::default() };
    assert!(matches!(Explorer::new(wrong), Err(ExploreError::Option { name: "stride", .. })));
    let mut explorer = Explorer::new(ExplorerOptions::default()).unwrap();
    let mut map = TopoMap::<()>::new();
    let nowhere = |_| None::<Point2<f64>>;
    let lost = Observation::at(Isometry2::translation(f64::NAN, 0.0), &nowhere);
    assert_eq!(explorer.observe(&mut map, lost), Err(ExploreError::Pose));
    let first = explorer.observe(&mut map, Observation::at(Isometry2::identity(), &nowhere)).unwrap();
    assert!(matches!(first, Command::Look { .. }));
}
