use super::*;
use local_grid::{Fuzzy, GridFrame};

const EMPTY: Fuzzy = Fuzzy { empty: 0.98, occupied: 0.02 };
const WALL: Fuzzy = Fuzzy { empty: 0.05, occupied: 0.95 };

/// A map drawn with letters, highest row first: `.` empty, `#` wall, ` ` unexplored, `~` rather unsafe.
fn map(rows: &[&str]) -> FuzzyGrid {
    let frame = GridFrame::new(Point2::origin(), 1.0, rows.len(), rows[0].len()).unwrap();
    let cell = |letter| match letter {
        '.' => EMPTY,
        '#' => WALL,
        '~' => Fuzzy { empty: 0.7, occupied: 0.3 },
        _ => Fuzzy::default(),
    };
    Grid::from_cells(frame, rows.iter().rev().flat_map(|row| row.chars()).map(cell).collect()).unwrap()
}

/// A point robot, so that letters are what they look like.
fn point() -> PlanOptions {
    PlanOptions { radius: 0.0, margin: 0.0, ..PlanOptions::default() }
}

fn turned(grid: &FuzzyGrid) -> FuzzyGrid {
    let (rows, columns) = (grid.frame().rows(), grid.frame().columns());
    let frame = GridFrame::new(Point2::origin(), 1.0, columns, rows).unwrap();
    let mut out = Grid::new(frame);
    for row in 0..rows {
        for column in 0..columns {
            *out.get_mut(column, rows - 1 - row).unwrap() = *grid.get(row, column).unwrap(); // (x, y) → (rows − y, x)
        }
    }
    out
}

/// Noise that looks different every time the seed does.
fn noisy(seed: u64, rows: usize, columns: usize) -> FuzzyGrid {
    use rand::{RngExt, SeedableRng};
    let mut random = rand_pcg::Pcg64Mcg::seed_from_u64(seed);
    let frame = GridFrame::new(Point2::origin(), 1.0, rows, columns).unwrap();
    let mut grid = Grid::new(frame);
    for cell in grid.cells_mut() {
        *cell = if random.random::<f32>() < 0.25 {
            WALL
        } else {
            Fuzzy { empty: random.random_range(0.6..1.0), occupied: 0.0 }
        };
    }
    *grid.get_mut(0, 0).unwrap() = EMPTY;
    *grid.get_mut(rows - 1, columns - 1).unwrap() = EMPTY;
    grid
}

/// The costs of all cells by sweeping until nothing changes: slow, and plainly right.
fn cheapest(grid: &FuzzyGrid, options: &PlanOptions) -> f64 {
    let unsafety = unsafety(grid, options).unwrap();
    let (rows, columns) = (grid.frame().rows(), grid.frame().columns());
    let mut costs = vec![f64::INFINITY; rows * columns];
    costs[0] = 0.0;
    let open =
        |row: usize, column: usize| unsafety.get(row, column).is_some_and(|&m| f64::from(m) <= options.forbidden);
    loop {
        let before = costs.clone();
        for (row, column) in (0..rows).flat_map(|row| (0..columns).map(move |column| (row, column))) {
            for (dy, dx) in [(-1, -1), (-1, 0), (-1, 1), (0, -1), (0, 1), (1, -1), (1, 0), (1, 1)] {
                let (Some(from_row), Some(from_column)) = (row.checked_add_signed(dy), column.checked_add_signed(dx))
                else {
                    continue;
                };
                let free = open(row, column)
                    && open(from_row, column)
                    && open(row, from_column)
                    && open(from_row, from_column);
                if from_row < rows && from_column < columns && free {
                    let length = if dy != 0 && dx != 0 { 2f64.sqrt() } else { 1.0 };
                    let risk = f64::from(unsafety.cells()[row * columns + column]);
                    let cost = costs[from_row * columns + from_column] + length * (1.0 + options.risk_weight * risk);
                    costs[row * columns + column] = costs[row * columns + column].min(cost);
                }
            }
        }
        if costs == before {
            return costs[rows * columns - 1];
        }
    }
}

#[test]
fn no_way_is_cheaper() {
    let mut found = 0;
    for seed in 0..40 {
        let grid = noisy(seed, 13, 17);
        let cheapest = cheapest(&grid, &point());
        match plan(&grid, Point2::new(0.5, 0.5), Point2::new(16.5, 12.5), &point()) {
            Ok(path) => {
                approx::assert_relative_eq!(path.cost, cheapest, max_relative = 1e-9);
                assert!(path.risk <= 0.9);
                found += 1;
            }
            Err(error) => assert!(cheapest.is_infinite() && matches!(error, PlanError::Unreachable { .. })),
        }
    }
    assert!((10..40).contains(&found), "both cases must occur, {found} of 40 had a way");
}

#[test]
fn ways_to_many_goals_are_those_to_each() {
    let grid = noisy(3, 13, 17);
    let unsafety = unsafety(&grid, &point()).unwrap();
    let goals: Vec<_> = (0..13).map(|y| Point2::new(8.5, f64::from(y) + 0.5)).chain([Point2::new(99.0, 0.0)]).collect();
    let start = Point2::new(0.5, 0.5);
    let ways = ways_from(&unsafety, start, &goals, &point());
    assert!(ways.iter().flatten().count() > 3 && ways[13].is_none());
    for (way, goal) in ways.iter().zip(&goals) {
        let alone = plan_over(&unsafety, start, *goal, &point());
        assert_eq!(way.is_some(), alone.is_some());
        if let (Some(way), Some(alone)) = (way, alone) {
            approx::assert_relative_eq!(way.cost, alone.cost, max_relative = 1e-9);
            assert_eq!((way.points[0], way.points.last()), (start, Some(goal)));
        }
    }
}

#[test]
fn without_risk_the_shortest_way_is_taken() {
    let grid = map(&["......", ".####.", "......"]);
    let options = PlanOptions { risk_weight: 0.0, ..point() };
    let path = plan(&grid, Point2::new(0.5, 0.5), Point2::new(5.5, 2.5), &options).unwrap();
    approx::assert_relative_eq!(path.length, 7.0, epsilon = 1e-9); // around the corner, which is not cut
    approx::assert_relative_eq!(path.cost, 7.0, epsilon = 1e-9);
    assert_eq!((path.points[0], path.points[7]), (Point2::new(0.5, 0.5), Point2::new(5.5, 2.5)));
}

#[test]
fn risk_is_worth_a_detour() {
    let grid = map(&[".....", "#~~~#", "....."]);
    let bold = PlanOptions { risk_weight: 0.0, ..point() };
    let wide = map(&[".......", ".#~~~#.", "......."]);
    let ends = (Point2::new(3.5, 0.5), Point2::new(3.5, 2.5));
    approx::assert_relative_eq!(plan(&wide, ends.0, ends.1, &bold).unwrap().length, 2.0, epsilon = 1e-9);
    let careful = PlanOptions { risk_weight: 1000.0, ..point() };
    assert!(plan(&wide, ends.0, ends.1, &careful).unwrap().length > 6.0);
    assert!(plan(&grid, Point2::new(2.5, 0.5), Point2::new(2.5, 2.5), &careful).is_ok()); // no way around: through it
}

#[test]
fn the_cost_does_not_turn_with_the_map() {
    let mut found = 0;
    for seed in 0..20 {
        let grid = noisy(seed, 11, 19);
        let there = plan(&grid, Point2::new(0.5, 0.5), Point2::new(18.5, 10.5), &point());
        let turned = plan(&turned(&grid), Point2::new(10.5, 0.5), Point2::new(0.5, 18.5), &point());
        match (there, turned) {
            (Ok(a), Ok(b)) => {
                approx::assert_relative_eq!(a.cost, b.cost, max_relative = 1e-9);
                found += 1;
            }
            (a, b) => assert!(a.is_err() && b.is_err()),
        }
    }
    assert!(found > 3);
}

#[test]
fn a_wide_robot_keeps_its_distance() {
    let grid = map(&["........", "........", "..####..", "........", "........", "........"]);
    let options = PlanOptions { radius: 0.9, margin: 0.2, ..PlanOptions::default() };
    let path = plan(&grid, Point2::new(2.5, 1.5), Point2::new(5.5, 1.5), &options).unwrap();
    assert!(path.points.iter().all(|point| point.y < 3.0), "{:?}", path.points); // a row away from the wall
    let unsafety = unsafety(&grid, &options).unwrap();
    assert!(*unsafety.get(1, 0).unwrap() > 0.9, "beyond the border lies the unknown");
    assert!(*unsafety.get(2, 3).unwrap() > 0.9 && *unsafety.get(1, 3).unwrap() < 0.3);
}

#[test]
fn refusals_say_why() {
    let grid = map(&["...  ", "..#..", "..#..", "..#.."]);
    let at = Point2::new;
    let refuse = |start, goal, options: &PlanOptions| plan(&grid, start, goal, options).unwrap_err().to_string();
    let options = point();
    assert!(refuse(at(0.5, 0.5), at(9.5, 0.5), &options).contains("the goal (9.5, 0.5) lies outside the map"));
    assert!(refuse(at(2.5, 0.5), at(0.5, 0.5), &options).contains("the start (2.5, 0.5) is unsafe"));
    assert!(refuse(at(2.5, 0.5), at(0.5, 0.5), &options).contains("occupied"));
    assert!(refuse(at(0.5, 0.5), at(4.5, 3.5), &options).contains("unexplored"));
    let shut = refuse(at(0.5, 0.5), at(4.5, 0.5), &options);
    assert!(shut.contains("no safe way leads from the start to the goal: 9 cells can be reached"), "{shut}");
    assert!(refuse(at(f64::NAN, 0.5), at(0.5, 0.5), &options).contains("outside"));
    let through = PlanOptions { through_unexplored: true, ..point() };
    assert!(plan(&grid, at(0.5, 0.5), at(4.5, 0.5), &through).is_ok());
    let nonsense = PlanOptions { radius: f64::NAN, ..point() };
    assert!(refuse(at(0.5, 0.5), at(0.5, 0.5), &nonsense).contains("`radius` must be between 0 and 1000"));
}

#[test]
fn standing_still_is_a_path() {
    let path = plan(&map(&["..", ".."]), Point2::new(0.2, 0.2), Point2::new(0.7, 0.3), &point()).unwrap();
    assert_eq!((path.points.len(), path.length, path.cost), (1, 0.0, 0.0));
}
