use hierarchy::{Config, Mapper};

use crate::logs::{entries, map, shared};

fn finishes(mapper: &Mapper, places: usize) {
    let metrics = mapper.metrics().unwrap();
    assert!(metrics.places >= places, "{metrics:?}");
    assert!(metrics.relaxation.relative_gap.abs() < 1e-6, "{metrics:?}");
    let gridmap = mapper.gridmap().unwrap();
    assert!(gridmap.cells().iter().any(|cell| cell.occupied > cell.empty), "a map without a wall");
}

#[test]
fn eight_sonars_draw_the_corridor() {
    let Some(folder) = shared("sonar/ring8") else { return };
    let log = entries(&[folder.join("run1_od.txt"), folder.join("run1_sonar.txt")], Some("ring8"));
    let mapper = map(&log, Config::default());
    assert_eq!(mapper.heading_source(), "odometry");
    finishes(&mapper, 15);
}

#[test]
fn the_same_robots_laser_draws_it_too() {
    let Some(folder) = shared("sonar/ring8") else { return };
    let log = entries(&[folder.join("run1_od.txt"), folder.join("run1_laser.txt")], Some("ring8"));
    let mapper = map(&log, Config::default());
    assert_eq!(mapper.heading_source(), "structure");
    finishes(&mapper, 15);
}

#[test]
fn a_garden_is_mapped_by_gyro_and_two_sonars() {
    let Some(folder) = shared("sonar/bigwheel") else { return };
    let mapper = map(&entries(&[folder.join("garden_15_03_20.csv")], Some("bigwheel")), Config::default());
    assert_eq!(mapper.heading_source(), "compass");
    finishes(&mapper, 20);
}

#[test]
fn wean_hall_is_mapped_by_laser() {
    let Some(folder) = shared("laser/wean") else { return };
    finishes(&map(&entries(&[folder.join("robotdata1.log")], Some("wean")), Config::default()), 20);
}

#[test]
fn the_intel_lab_closes_its_loops() {
    let Some(folder) = shared("laser/intel") else { return };
    let mapper = map(&entries(&[folder.join("intel_raw.clf.gz")], None), Config::default());
    finishes(&mapper, 300);
    assert!(mapper.metrics().unwrap().links.recognized > 20);
    let frame = *mapper.gridmap().unwrap().frame();
    let (width, height) = (frame.columns() as f64 * frame.resolution(), frame.rows() as f64 * frame.resolution());
    assert!(width < 70.0 && height < 70.0, "the building is 26 m wide; the map {width} × {height} m");
}
