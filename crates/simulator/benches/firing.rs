//! How fast the simulator is: one firing of the ring, and a whole tour through the office loop.

use criterion::{Criterion, criterion_group, criterion_main};
use simulator::{Command, Robot, RobotDescription, TourOptions, World};

fn world(name: &str) -> World {
    let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fixtures/worlds").join(name);
    let text = std::fs::read_to_string(path).expect("a shipped world");
    World::from_plan(&text).expect("a shipped world can be read")
}

fn firing(criterion: &mut Criterion) {
    for name in ["office-46x12.toml", "laboratory.toml"] {
        let world = world(name);
        let mut robot = Robot::new(&world, RobotDescription::nomad200(), 1).expect("the Nomad exists");
        criterion.bench_function(&format!("fire 16 sonars/{name}"), |bencher| {
            let mut log = Vec::new();
            bencher.iter(|| {
                log.clear();
                robot.execute(&Command::Fire, &mut log);
            });
        });
    }
}

fn tour(criterion: &mut Criterion) {
    let world = world("office-loop.toml");
    let mut group = criterion.benchmark_group("tour");
    group.sample_size(10);
    group.bench_function("180 m, 3 × 16 sonars every metre", |bencher| {
        bencher.iter(|| {
            let mut robot = Robot::new(&world, RobotDescription::nomad200(), 1).expect("the Nomad exists");
            let mut entries = 0;
            let tour = &world.tours()[0].points;
            robot
                .drive_tour(tour, &TourOptions::default(), |_, log| entries += log.len())
                .expect("nothing is in the way for ever");
            entries
        });
    });
    group.finish();
}

criterion_group!(benches, firing, tour);
criterion_main!(benches);
