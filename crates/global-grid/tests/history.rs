//! Whatever happened before, the map is that of what it holds.

use global_grid::local_grid::nalgebra::{Isometry2, Vector2};
use global_grid::local_grid::{Scan, SonarCone};
use global_grid::{Calculus, GridError, GridMap, GridOptions, SonarModel, assemble};
use rand::RngExt;

use crate::{dice, laser, pose, scan, sonars};

fn same(a: &GridMap, b: &GridMap) {
    assert_eq!(a.frame().unwrap(), b.frame().unwrap());
    assert_eq!(a.read(|tally| tally).unwrap().cells(), b.read(|tally| tally).unwrap().cells());
}

#[test]
fn any_history_of_sonar_and_laser_ends_in_the_same_bits() {
    let (sonar, laser) = (sonars(), laser(181, false));
    for seed in 0..4 {
        let mut random = dice(100 + seed);
        let calculus = [Calculus::Fuzzy, Calculus::Bayes, Calculus::DempsterShafer][usize::try_from(seed % 3).unwrap()];
        let sonar_model = if seed == 3 { SonarModel::Cone(SonarCone::default()) } else { SonarModel::default() };
        let options = GridOptions { calculus, sonar: sonar_model, ..GridOptions::default() };
        let mut map = GridMap::new(options.clone()).unwrap();
        let mut held: std::collections::BTreeMap<u64, Vec<(Isometry2<f64>, Scan)>> = Default::default();
        for _ in 0..120 {
            let key = random.random_range(0..9);
            match random.random_range(0..10) {
                0 => assert_eq!(map.remove(key), held.remove(&key).map_or(0, |scans| scans.len())),
                1..=3 if held.contains_key(&key) => {
                    let scans = held.get_mut(&key).unwrap();
                    let shift = Isometry2::new(Vector2::new(random.random_range(-1.0..1.0), 0.3), 0.1);
                    scans.iter_mut().for_each(|scan| scan.0 = shift * scan.0);
                    let poses: Vec<_> = scans.iter().map(|scan| scan.0).collect();
                    assert_eq!(map.relocate(key, &poses), Ok(poses.len()));
                    assert_eq!(map.relocate(key, &poses), Ok(0)); // nothing moved: nothing fused
                }
                _ => {
                    let sensor = if random.random::<bool>() { &sonar } else { &laser };
                    let (pose, scan) = (pose(&mut random), scan(sensor, &mut random));
                    map.insert(key, &pose, &scan).unwrap();
                    held.entry(key).or_default().push((pose, scan));
                }
            }
        }
        let mut posed: Vec<_> = held.values().flatten().map(|(pose, scan)| (pose, scan)).collect();
        same(&map, &assemble(posed.clone(), &options).unwrap());
        posed.reverse();
        same(&map, &assemble(posed, &options).unwrap());
        for key in 0..9 {
            map.remove(key);
        }
        assert_eq!((map.frame(), map.cell_bytes()), (Ok(None), 0));
    }
}

#[test]
fn a_robot_that_stands_for_long_is_counted_exactly_and_leaves_nothing_behind() {
    let mut random = dice(7);
    let scans = [sonars(), laser(181, true)].map(|sensor| scan(&sensor, &mut random));
    let (stands, options) = (pose(&mut random), GridOptions { most_evidence: f64::INFINITY, ..GridOptions::default() });
    let sums = |map: &GridMap| map.read(|tally| tally.empty).unwrap().cells().to_vec();
    for scan in scans {
        let once = sums(&assemble([(&stands, &scan)], &options).unwrap());
        let mut map = assemble(std::iter::repeat_n((&stands, &scan), 1000), &options).unwrap(); // far beyond a byte
        assert_eq!(sums(&map), once.iter().map(|units| units * 1000).collect::<Vec<_>>());
        map.insert(1, &stands, &scan).unwrap();
        map.remove(0);
        assert_eq!(sums(&map), once);
        map.remove(1);
        assert_eq!((map.frame(), map.cell_bytes()), (Ok(None), 0));
    }
}

#[test]
fn far_apart_places_do_not_cost_the_land_between() {
    let (sensor, mut random) = (laser(181, false), dice(1));
    let scan = scan(&sensor, &mut random);
    let mut map = GridMap::new(GridOptions { resolution: 0.05, ..GridOptions::default() }).unwrap();
    for (key, (x, y)) in [(0.0, 0.0), (3000.0, -3000.0), (-900.0, 2000.0)].into_iter().enumerate() {
        map.insert(u64::try_from(key).unwrap(), &Isometry2::translation(x, y), &scan).unwrap();
    }
    assert!(map.cell_bytes() < 3_000_000, "{} bytes", map.cell_bytes()); // the box would take 60 GB
    // As a dense grid it would be too large, which is said, not tried.
    map.insert(9, &Isometry2::translation(1e7, 1e7), &scan).unwrap();
    assert!(matches!(map.to_grid(), Err(GridError::Frame(_))));
}

#[test]
fn refused_scans_leave_all_as_it_was() {
    let (sensor, mut random) = (sonars(), dice(2));
    let (good, scan) = (pose(&mut random), scan(&sensor, &mut random));
    let mut map = GridMap::new(GridOptions::default()).unwrap();
    map.insert(0, &good, &scan).unwrap();
    let before = map.read(|tally| tally).unwrap();
    let bad = Isometry2::new(Vector2::new(f64::NAN, 0.0), 0.0);
    assert!(map.insert_all([(1, &good, &scan), (2, &bad, &scan)]).is_err());
    assert!(map.relocate(0, &[bad]).is_err());
    assert_eq!(map.read(|tally| tally).unwrap(), before);
    assert_eq!(map.contributions().collect::<Vec<_>>(), [(0, 1)]);
}

#[test]
fn sums_that_would_overflow_are_refused() {
    let (sensor, mut random) = (laser(181, false), dice(4));
    let (pose, scan) = (pose(&mut random), scan(&sensor, &mut random));
    let strong = global_grid::local_grid::LaserRay { empty: 0.98, occupied: 0.98, ..Default::default() };
    let options = GridOptions { laser: strong, resolution: 1.0, ..GridOptions::default() };
    let mut map = GridMap::new(options).unwrap();
    let full = (0..200_000).find_map(|_| map.insert(0, &pose, &scan).err());
    assert_eq!(full, Some(GridError::Full(0)));
    let largest = map.read(|tally| tally.empty.max(tally.occupied)).unwrap().cells().iter().copied().max();
    assert!(largest.unwrap() > u32::MAX / 5, "only a nearly full map is refused");
}
