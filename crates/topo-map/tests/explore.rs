//! The explorer as a state machine by itself; whole explorations are tests of the crate above, which drives them.

use local_grid::nalgebra::{Isometry2, Matrix2, Point2, UnitComplex, Vector2};
use topo_map::{Command, ExploreError, Explorer, ExplorerOptions, Identity, Observation, PlaceId, TopoMap, local_grid};

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

/// A robot that sees nothing, drives as it is told, and is told which places to expect.
struct Blind {
    explorer: Explorer,
    map: TopoMap<()>,
    pose: Isometry2<f64>,
    identity: Option<Identity<()>>,
    /// So many times more it is stopped where it would leave the half plane `x ≥ 2.5`.
    stops: u32,
}

impl Blind {
    fn new(options: ExplorerOptions) -> Self {
        let explorer = Explorer::new(options).unwrap();
        Self { explorer, map: TopoMap::new(), pose: Isometry2::identity(), identity: None, stops: 0 }
    }

    /// Obeys until nothing is left, or nothing nearby.
    fn drive(&mut self) -> Command {
        let (nowhere, mut bumped) = (|_| None, false);
        for _ in 0..1000 {
            let identity = self.identity.take();
            let observation = Observation { identity, bumped, ..Observation::at(self.pose, &nowhere) };
            bumped = false;
            match self.explorer.observe(&mut self.map, observation).unwrap() {
                Command::Turn { to } => self.pose.rotation = UnitComplex::new(to.radians()),
                Command::Drive { distance } => {
                    let there = self.pose * Isometry2::translation(distance, 0.0);
                    bumped = self.stops > 0 && there.translation.x < 2.5;
                    if bumped {
                        self.stops -= 1;
                    } else {
                        self.pose = there;
                    }
                }
                Command::Identify { expected, .. } => self.identity = Some(self.identify(expected)),
                end @ (Command::Leave | Command::Done) => return end,
                Command::Look { .. } | Command::Fire { .. } => {}
            }
        }
        panic!("it drives for ever");
    }

    fn identify(&self, expected: Option<PlaceId>) -> Identity<()> {
        match expected.filter(|place| self.map.place(*place).is_some_and(|place| place.is_visited())) {
            Some(place) => {
                Identity::Known { place, offset: Vector2::zeros(), covariance: Matrix2::identity() * 1e-4, seen: None }
            }
            None => Identity::New { signature: () },
        }
    }

    fn here(&self) -> PlaceId {
        self.explorer.place().unwrap()
    }

    fn expect(&mut self, from: PlaceId, toward: (f64, f64)) {
        self.explorer.expect(&mut self.map, from, Vector2::new(toward.0, toward.1)).unwrap();
    }
}

#[test]
fn a_neighbourhood_is_finished_before_the_robot_leaves_it() {
    for (neighbourhood, finishes) in [(2.0, true), (0.0, false)] {
        let mut robot = Blind::new(ExplorerOptions { neighbourhood, ..ExplorerOptions::default() });
        assert_eq!(robot.drive(), Command::Done);
        let first = robot.here();
        for _ in 0..3 {
            robot.expect(robot.here(), (1.0, 0.0));
            assert_eq!(robot.drive(), Command::Done);
        }
        assert!((robot.pose.translation.vector - Vector2::new(3.0, 0.0)).norm() < 0.2, "{}", robot.pose);
        robot.expect(first, (0.0, 1.0));
        if finishes {
            // It is asked before it goes back three metres; what is expected here comes first.
            assert_eq!(robot.drive(), Command::Leave);
            robot.expect(robot.here(), (0.0, 1.0));
            assert_eq!(robot.drive(), Command::Leave);
            assert!((robot.pose.translation.vector - Vector2::new(3.0, 1.0)).norm() < 0.2, "{}", robot.pose);
        }
        assert_eq!(robot.drive(), Command::Done);
        assert!((robot.pose.translation.vector - Vector2::new(0.0, 1.0)).norm() < 0.2, "{}", robot.pose);
    }
}

#[test]
fn a_robot_does_not_believe_that_the_way_by_which_it_came_is_shut() {
    for (stops, is_out) in [(0, true), (30, true), (u32::MAX, false)] {
        let mut robot = Blind::new(ExplorerOptions { neighbourhood: 0.0, ..ExplorerOptions::default() });
        assert_eq!(robot.drive(), Command::Done);
        let first = robot.here();
        for _ in 0..3 {
            robot.expect(robot.here(), (1.0, 0.0));
            assert_eq!(robot.drive(), Command::Done);
        }
        robot.expect(first, (0.0, 1.0));
        robot.stops = stops;
        assert_eq!(robot.drive(), Command::Done, "it ends in any case");
        let there = (robot.pose.translation.vector - Vector2::new(0.0, 1.0)).norm() < 0.3;
        assert_eq!(there, is_out, "{stops} stops, {} left, at {}", robot.stops, robot.pose);
    }
}
