use global_grid::plan::{Path, PlanOptions, costs_from, plan, unsafety};
use global_grid::{CrispOptions, Exposure, Occupancy};
use hierarchy::local_grid::{Fuzzy, FuzzyGrid, Grid, GridFrame};
use hierarchy::{Config, Planner, RouteError, regions};
use nalgebra::Point2;
use region_map::RegionMap;

use crate::logs::{map, office_loop};

/// A corridor of 20 × 2 m with four rooms of 4.8 × 4 m on either side, doors of 1 m; the first two rooms on the left are
/// joined by a door of their own.
fn office() -> FuzzyGrid {
    let frame = GridFrame::new(Point2::new(-1.0, -6.0), 0.1, 130, 220).unwrap();
    let mut grid = FuzzyGrid::new(frame);
    for (index, cell) in grid.cells_mut().iter_mut().enumerate() {
        let p = frame.center(index / frame.columns(), index % frame.columns());
        let (room, x, away) = ((p.x / 5.0).floor(), p.x.rem_euclid(5.0), p.y.abs());
        let inside = (0.0..20.0).contains(&p.x) && p.y < 6.0;
        let corridor = away < 1.0;
        let in_room = (1.2..5.2).contains(&away) && x > 0.2;
        let in_door = (1.0..1.2).contains(&away) && (2.0..3.0).contains(&x);
        let between = room == 1.0 && x <= 0.2 && (3.0..4.0).contains(&p.y);
        let free = inside && (corridor || in_room || in_door || between);
        *cell = if free { Fuzzy { empty: 0.95, occupied: 0.0 } } else { Fuzzy { empty: 0.0, occupied: 0.95 } };
    }
    grid
}

fn close(map: &mut RegionMap, near: Point2<f64>) -> usize {
    let nearest = |(_, gateway): &(usize, &region_map::Gateway)| (gateway.center - near).norm();
    let found = map.gateways.iter().enumerate().min_by(|a, b| nearest(a).total_cmp(&nearest(b)));
    let index = found.map(|(index, _)| index).unwrap();
    map.gateways[index].blocked = true;
    index
}

#[test]
fn a_plan_through_regions_is_as_short_as_one_over_all_cells() {
    let grid = office();
    let map = regions(&grid, &[]).unwrap();
    assert_eq!(map.regions.len(), 9);
    let options = PlanOptions::default();
    let planner = Planner::new(&grid, &map, &options).unwrap();
    let spots = [(1.0, 4.0), (9.0, 4.5), (17.0, 3.0), (3.0, -4.0), (18.0, -2.0), (10.0, 0.0), (0.6, 0.0)];
    let spots: Vec<Point2<f64>> = spots.iter().map(|(x, y)| Point2::new(*x, *y)).collect();
    for (k, start) in spots.iter().enumerate() {
        for goal in &spots[k + 1..] {
            let plan = planner.plan(*start, *goal).unwrap();
            let cells = global_grid::plan::plan(&grid, *start, *goal, &options).unwrap();
            let (found, least) = (plan.path.length, cells.length);
            assert!(found <= 1.05 * least, "{start} to {goal}: {found} m for {least} m");
            assert_drivable(&plan.path, &grid, &options);
            let (cost, cheapest) = (plan.path.cost, cells.cost);
            assert!(cost <= 1.05 * cheapest, "{start} to {goal}: costs {cost} instead of {cheapest}");
            assert!(cost >= cheapest - 1e-6, "{start} to {goal}: {cost} is less than the least, {cheapest}");
            assert_eq!((plan.path.points[0], plan.path.points.last()), (cells.points[0], cells.points.last()));
            assert_eq!(plan.regions.len(), plan.gateways.len() + 1);
            for (pair, gateway) in plan.regions.windows(2).zip(&plan.gateways) {
                let joined = map.gateways[*gateway].regions;
                assert!(joined == [pair[0], pair[1]] || joined == [pair[1], pair[0]], "{pair:?} by {joined:?}");
            }
            assert_eq!(plan.regions.first(), map.region_at(*start).map(|region| &region.label));
            assert_eq!(plan.regions.last(), map.region_at(*goal).map(|region| &region.label));
        }
    }
}

/// A way goes from cell to neighbour, over cells that are safe enough, and cuts no corner.
fn assert_drivable(path: &Path, grid: &FuzzyGrid, options: &PlanOptions) {
    let unsafety = unsafety(grid, options).unwrap();
    let risk = |x: f64, y: f64| f64::from(*unsafety.at(Point2::new(x, y)).unwrap());
    for pair in path.points.windows(2) {
        let [a, b] = [pair[0], pair[1]];
        let step = (b - a).amax();
        assert!(step > 0.0 && step < 1.01 * grid.frame().resolution(), "{a} to {b}");
        let worst = risk(b.x, b.y).max(risk(a.x, b.y)).max(risk(b.x, a.y));
        assert!(worst <= options.forbidden + 1e-6, "{worst} from {a} to {b}");
    }
    assert!(path.points.iter().all(|p| risk(p.x, p.y) <= path.risk));
}

/// A hall of 40 × 30 m with pillars of 1 m every 5 m, and three rooms of 4 × 4 m on its left and on its right side each.
#[test]
fn plans_across_a_hall_are_nearly_as_short_as_over_all_cells() {
    let frame = GridFrame::new(Point2::new(-6.0, -1.0), 0.1, 320, 520).unwrap();
    let mut grid = FuzzyGrid::new(frame);
    for (index, cell) in grid.cells_mut().iter_mut().enumerate() {
        let p = frame.center(index / frame.columns(), index % frame.columns());
        let pillar = p.x.rem_euclid(5.0) < 1.0 && p.y.rem_euclid(5.0) < 1.0 && p.x > 3.0 && p.x < 38.0;
        let hall = (0.0..40.0).contains(&p.x) && (0.0..30.0).contains(&p.y) && !pillar;
        let [away, up] = [(p.x - 20.0).abs() - 20.0, p.y.rem_euclid(10.0)];
        let room = (0.2..4.2).contains(&away) && (3.0..7.0).contains(&up) && (0.0..30.0).contains(&p.y);
        let door = (0.0..0.2).contains(&away) && (4.5..5.5).contains(&up);
        let free = hall || room || door && (0.0..30.0).contains(&p.y);
        *cell = if free { Fuzzy { empty: 0.95, occupied: 0.0 } } else { Fuzzy { empty: 0.0, occupied: 0.95 } };
    }
    let (map, options) = (regions(&grid, &[]).unwrap(), PlanOptions::default());
    let planner = Planner::new(&grid, &map, &options).unwrap();
    let spots: Vec<Point2<f64>> = map.regions.iter().map(|region| region.inside).collect();
    let (mut through, mut worst) = (0, 0.0f64);
    for (k, start) in spots.iter().enumerate() {
        for goal in &spots[k + 1..] {
            let found = planner.plan(*start, *goal).unwrap();
            assert_drivable(&found.path, &grid, &options);
            through += usize::from(found.regions.len() > 2);
            worst = worst.max(found.path.cost / plan(&grid, *start, *goal, &options).unwrap().cost - 1.0);
        }
    }
    assert!(through >= 15, "{through} of the pairs of rooms lead through the hall");
    assert!(worst <= 0.05, "{worst}");
}

#[test]
fn no_plan_leads_through_a_closed_door() {
    let grid = office();
    let mut map = regions(&grid, &[]).unwrap();
    let options = PlanOptions::default();
    let (room, corridor) = (Point2::new(1.5, 4.0), Point2::new(2.5, 0.0));
    let direct = Planner::new(&grid, &map, &options).unwrap().plan(room, corridor).unwrap();
    close(&mut map, Point2::new(2.5, 1.1));
    let round = Planner::new(&grid, &map, &options).unwrap().plan(room, corridor).unwrap();
    assert_eq!(round.gateways.len(), 2, "through the room next door");
    assert!(round.path.length > direct.path.length + 5.0);
    let door = close(&mut map, Point2::new(5.1, 3.5));
    let error = Planner::new(&grid, &map, &options).unwrap().plan(room, corridor).unwrap_err();
    assert!(matches!(&error, RouteError::Closed(closed) if closed.contains(&door)), "{error}");
    // What has no way even with all doors open says so.
    let error = Planner::new(&grid, &map, &options).unwrap().plan(room, Point2::new(-0.5, 0.0)).unwrap_err();
    assert!(matches!(error, RouteError::Cells(_)), "{error}");
}

#[test]
fn a_start_beside_all_regions_is_planned_over_all_cells() {
    let grid = office();
    let map = RegionMap { labels: Grid::new(*grid.frame()), regions: Vec::new(), gateways: Vec::new() };
    let options = PlanOptions::default();
    let (start, goal) = (Point2::new(1.0, 4.0), Point2::new(18.0, -2.0));
    let found = Planner::new(&grid, &map, &options).unwrap().plan(start, goal).unwrap();
    assert_eq!(found.path, plan(&grid, start, goal, &options).unwrap());
    assert!(found.regions.is_empty());
}

#[test]
fn wherever_the_robot_has_been_it_can_go_again() {
    let mapper = map(&office_loop(), Config::default());
    let gridmap = mapper.gridmap().unwrap();
    let alone = PlanOptions { exposure: Exposure::of(&gridmap), ..PlanOptions::default() };
    let places: Vec<Point2<f64>> = mapper
        .topology()
        .places()
        .iter()
        .filter(|place| place.is_visited())
        .map(|place| mapper.coordinates().map_from_place(place.id).translation.vector.into())
        .collect();
    // A cell that is clearly occupied now stays shut, also where the robot has been; then the cells beside it are open.
    let crisp = CrispOptions { exposure: alone.exposure, ..CrispOptions::default() };
    let shut = |at: &Point2<f64>| gridmap.at(*at).is_some_and(|cell| crisp.occupancy(*cell) == Occupancy::Occupied);
    assert!(places.iter().filter(|place| shut(place)).count() <= 1, "one false echo at most");
    let cell = gridmap.frame().resolution();
    let around = [-1.0, 0.0, 1.0].map(|x| [-1.0, 0.0, 1.0].map(|y| nalgebra::Vector2::new(x, y) * cell));
    let reached = |options: &PlanOptions| {
        let costs = costs_from(&unsafety(&gridmap, options).unwrap(), places[0], options).unwrap();
        let safe = |at: Point2<f64>| costs.at(at).is_some_and(|cost| cost.is_finite());
        let beside = |place: &Point2<f64>| around.iter().flatten().any(|aside| safe(place + aside));
        places.iter().filter(|&place| safe(*place) || (shut(place) && beside(place))).count()
    };
    let (before, after) = (reached(&alone), reached(&PlanOptions { driven: mapper.driven(), ..alone.clone() }));
    assert!(before < places.len(), "the sonar's blur closes doors");
    assert_eq!(after, places.len(), "{before} without its own tracks");
}
