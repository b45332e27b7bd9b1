//! Trains the network for open space and scores it on worlds that it has never seen:
//!
//! ```text
//! cargo run --release -p topo-map --example train_open_space -- fixtures/networks/open_space.json
//! ```
//!
//! Without a file name nothing is written. Everything follows from the seed below.
#![expect(clippy::print_stdout, reason = "an example that reports")]

mod worlds;

use local_grid::nalgebra::{Isometry2, Point2};
use local_grid::{Fuzzy, Heading, Scan, SonarCone, WorkingGrid, WorkingGridOptions};
use rand::{Rng, RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;
use simulator::robot_log::EntryKind;
use simulator::{Command, Robot, RobotDescription, World};
use topo_map::{FeatureOptions, RangeRose, RocScore, Sample, TrainOptions, local_grid, roc_score, train};

const SEED: u64 = 20_000;
const TRAINING_WORLDS: usize = 60;
const HELD_OUT_WORLDS: usize = 20;
const TEST_WORLDS: usize = 20;
const PLACES_PER_WORLD: usize = 25;
/// The way is open if a disc of the Nomad's radius and 5 cm more can be swept along it …
const SWEPT_RADIUS: f64 = 0.225 + 0.05;
/// … so far.
const SWEPT_LENGTH: f64 = 1.0;

/// Scans, each with the pose where it was taken.
type Posed = Vec<(Isometry2<f64>, Scan)>;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut rng = Pcg64Mcg::seed_from_u64(SEED);
    let training = samples(TRAINING_WORLDS, &mut rng)?;
    let held_out = samples(HELD_OUT_WORLDS, &mut rng)?;
    let test = samples(TEST_WORLDS, &mut rng)?;
    let (network, report) = train(&training, &held_out, &TrainOptions::default(), &mut rng);
    println!("{} samples for training, {} to stop at, {} to judge", training.len(), held_out.len(), test.len());
    println!("{} epochs, loss {:.3}, held out {:.3}", report.epochs, report.loss, report.held_out_loss);
    println!("| judge | ROC AUC | false places at 95 % recall |\n| --- | --- | --- |");
    let score = |judge: &dyn Fn(&Sample) -> f32| {
        roc_score(&test.iter().map(|sample| (judge(sample), sample.open)).collect::<Vec<_>>())
    };
    let print = |name: &str, score: Option<RocScore>| {
        if let Some(score) = score {
            println!("| {name} | {:.3} | {:.1} % |", score.auc, 100.0 * score.false_rate_at_95);
        }
    };
    print("central reading", score(&|sample| sample.features[3]));
    print("median of three readings", score(&|sample| median_of_three(&sample.features[2..5])));
    print("box of the local grid", score(&|sample| sample.features[10] - sample.features[9]));
    let trained = score(&|sample| network.openness(&sample.features));
    print("network", trained);
    if let Some(score) = trained {
        println!("threshold of the network at 95 % recall: {:.2}", score.threshold_at_95);
    }
    if let Some(path) = std::env::args().nth(1) {
        std::fs::write(&path, network.to_json() + "\n")?;
        println!("wrote {path}");
    }
    Ok(())
}

fn median_of_three(three: &[f32]) -> f32 {
    let (a, b, c) = (three[0], three[1], three[2]);
    a.max(b).min(a.min(b).max(c))
}

/// All directions around places in random worlds, each approached over a metre as an explorer would.
fn samples(n_worlds: usize, rng: &mut impl Rng) -> Result<Vec<Sample>, Box<dyn std::error::Error>> {
    let mut samples = Vec::new();
    for _ in 0..n_worlds {
        let world = worlds::random_floor(rng)?;
        let (low, high) = world.bounds();
        let mut found = 0;
        for _ in 0..PLACES_PER_WORLD * 20 {
            // Every other place lies near a door: doors are few, and all that matters.
            let doors = &world.tours()[0].points;
            let place = if doors.is_empty() || rng.random_bool(0.5) {
                Point2::new(rng.random_range(low.x..high.x), rng.random_range(low.y..high.y))
            } else {
                let off = Heading::from_radians(rng.random_range(-3.1..3.1)).unit_vector();
                doors[rng.random_range(0..doors.len())] + off * rng.random_range(0.2..1.6)
            };
            let approach = Heading::from_radians(rng.random_range(-3.1..3.1));
            let from = place - approach.unit_vector();
            if found < PLACES_PER_WORLD && world.at(0.0).is_swept_free(from, place, SWEPT_RADIUS) {
                found += 1;
                samples.extend(look_around(&world, from, approach, rng)?);
            }
        }
    }
    Ok(samples)
}

/// Drives a metre from `from`, firing twice on the way, surveys, and says of each direction whether it was open.
fn look_around(
    world: &World,
    from: Point2<f64>,
    approach: Heading,
    rng: &mut impl Rng,
) -> Result<Vec<Sample>, Box<dyn std::error::Error>> {
    let start = Isometry2::new(from.coords, 0.0);
    let description = RobotDescription::nomad200().with_perfect_compass();
    let mut robot = Robot::starting_at(world, description, rng.random(), start)?;
    let mut window = WorkingGrid::<Fuzzy>::new(&WorkingGridOptions::default(), from)?;
    robot.execute(&Command::Turn { to: approach }, &mut Vec::new());
    for _ in 0..2 {
        fire(&mut robot, &mut window)?;
        robot.execute(&Command::Drive { distance: 0.5 }, &mut Vec::new());
    }
    let place = Point2::from(robot.map_from_robot().translation.vector);
    let mut rose = RangeRose::new(place);
    for firing in 0..3 {
        let to = Heading::from_radians(f64::from(firing) * 7.5_f64.to_radians());
        robot.execute(&Command::Look { to }, &mut Vec::new());
        for (pose, scan) in fire(&mut robot, &mut window)? {
            rose.add(&pose, &scan);
        }
    }
    let (features, scene) = (FeatureOptions::default(), world.at(0.0));
    let sample = |bin| Sample {
        features: features.of(&rose, window.grid(), bin),
        open: scene.is_swept_free(place, place + RangeRose::heading(bin).unit_vector() * SWEPT_LENGTH, SWEPT_RADIUS),
    };
    // Every third direction, beginning anywhere: neighbours say nearly the same.
    let first = rng.random_range(0..3);
    Ok((first..RangeRose::DIRECTIONS).step_by(3).map(sample).collect())
}

/// Fires all sensors and draws what they read; the pose is the true one, for what matters here is the sonar.
fn fire(robot: &mut Robot<'_>, window: &mut WorkingGrid<Fuzzy>) -> Result<Posed, Box<dyn std::error::Error>> {
    let mut log = Vec::new();
    robot.execute(&Command::Fire, &mut log);
    let pose = robot.map_from_robot();
    let mut scans = Vec::new();
    for entry in log {
        if let EntryKind::Scan { scan, .. } = entry.kind {
            window.integrate(&SonarCone::default(), &pose, &scan)?;
            scans.push((pose, scan));
        }
    }
    Ok(scans)
}
