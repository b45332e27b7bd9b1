//! Tells how well sonar signatures tell places apart, on a simulated CARMEN log with compass and true poses.
//!
//! ```text
//! cargo run --release -p local-grid --example sonar_recognition -- LOG [SIGHT] [LAG]
//! ```
//!
//! SIGHT is the sonar model's visibility in metres; LAG how far the robot drives past a place before its signature is cut.
#![expect(clippy::print_stdout, reason = "an example says what it found")]

use std::error::Error;
use std::sync::Arc;

use local_grid::nalgebra::{Isometry2, Point2, Vector2};
use local_grid::{
    AlignOptions, Alignment, Fuzzy, Heading, RangeSensor, Scan, SensorKind, Signature, SignatureOptions, SonarCone,
    WorkingGrid, WorkingGridOptions, align,
};

/// A place where it truly is, and as the robot saw it.
struct Place {
    truth: Point2<f64>,
    path: f64,
    signature: Signature,
}

/// The robot as its log tells it.
#[derive(Default)]
struct Robot {
    truth: Isometry2<f64>,
    odom_from_robot: Isometry2<f64>,
    compass: Heading,
    scanned_at: Option<Isometry2<f64>>,
    pose: Isometry2<f64>,
    path: f64,
}

impl Robot {
    /// Follows the odometry since the last scan, its heading drawn towards the compass.
    fn advance(&mut self) {
        let heading = match self.scanned_at.replace(self.odom_from_robot) {
            None => self.compass,
            Some(before) => {
                let step = before.inv_mul(&self.odom_from_robot);
                self.path += step.translation.vector.norm();
                self.pose *= step;
                let turned = Heading::from_radians(self.pose.rotation.angle());
                turned + 0.2 * (self.compass - turned)
            }
        };
        self.pose = Isometry2::new(self.pose.translation.vector, heading.radians());
    }
}

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let text = std::fs::read_to_string(arguments.first().ok_or("which log?")?)?;
    let number = |k: usize, default: f64| arguments.get(k).map_or(Ok(default), |word| word.parse::<f64>());
    let model = SonarCone { visibility: number(1, 2.5)?, ..SonarCone::default() };
    let places = places(&text, &model, number(2, 1.0)?)?;
    let options = AlignOptions { reach: 1.0, ..AlignOptions::default() };
    let (mut near, mut far) = (Vec::new(), Vec::new());
    for (k, a) in places.iter().enumerate() {
        for b in &places[..k] {
            let truth = b.truth - a.truth;
            if truth.norm() < 0.6 && (a.path - b.path).abs() > 10.0 {
                near.push((align(&a.signature, &b.signature, &options), truth));
            } else if truth.norm() > 3.0 {
                far.push(align(&a.signature, &b.signature, &options));
            }
        }
    }
    report(&near, far, places.len());
    Ok(())
}

fn report(near: &[(Alignment, Vector2<f64>)], mut far: Vec<Alignment>, n_places: usize) {
    far.sort_by(|a, b| a.score.total_cmp(&b.score));
    let (n, m) = (near.len().max(1) as f64, far.len().max(1) as f64);
    let below = |score: f64| far.partition_point(|other| other.score < score) as f64 / m;
    let area = near.iter().map(|(found, _)| below(found.score)).sum::<f64>() / n;
    let error = near.iter().map(|(found, truth)| (found.offset - truth).norm()).sum::<f64>() / n;
    println!("{n_places} places, {} near pairs, {} far pairs", near.len(), far.len());
    println!(
        "a near pair scores higher than a far one in {:.1} % of cases; mean error of offsets {error:.2} m",
        100.0 * area
    );
    for share in [0.05, 0.01, 0.001, 0.0] {
        let passes = |score: f64| far.iter().rev().take_while(|other| other.score >= score).count() as f64 / m;
        let found = near.iter().filter(|(found, _)| passes(found.score) <= share).count() as f64 / n;
        println!("with {:>4} % of far pairs let through: {:.0} % of near pairs", 100.0 * share, 100.0 * found);
    }
}

/// A place every metre; its signature is cut `lag` metres later.
fn places(text: &str, model: &SonarCone, lag: f64) -> Result<Vec<Place>, Box<dyn Error>> {
    let width = 25f64.to_radians();
    let ring = Arc::new(RangeSensor::ring("sonar", SensorKind::Sonar, 16, 0.225, width, 0.4317..=6.46)?);
    let mut window = WorkingGrid::<Fuzzy>::new(&WorkingGridOptions::default(), Point2::origin())?;
    let mut robot = Robot::default();
    let mut places: Vec<Place> = Vec::new();
    let mut pending: Vec<(Point2<f64>, Point2<f64>, f64)> = Vec::new();
    let mut last = f64::NEG_INFINITY;
    for line in text.lines() {
        let words: Vec<&str> = line.split_ascii_whitespace().collect();
        let number =
            |k: usize| words.get(k).ok_or("a line is too short")?.parse::<f64>().map_err(Box::<dyn Error>::from);
        let pose = || Ok::<_, Box<dyn Error>>(Isometry2::new(Vector2::new(number(1)?, number(2)?), number(3)?));
        match words.first() {
            Some(&"ODOM") => robot.odom_from_robot = pose()?,
            Some(&"TRUEPOS") => robot.truth = pose()?,
            Some(&"IMU") => robot.compass = Heading::from_radians(2.0 * number(7)?.atan2(number(4)?)),
            Some(&"SONAR") => {
                robot.advance();
                let ranges = (3..19).map(number).collect::<Result<Vec<f64>, _>>()?;
                window.integrate(model, &robot.pose, &Scan::from_ranges(ring.clone(), ranges)?)?;
                if robot.path - last >= 1.0 {
                    last = robot.path;
                    let (at, truth) = (robot.pose.translation.vector, robot.truth.translation.vector);
                    pending.push((at.into(), truth.into(), robot.path));
                }
                while pending.first().is_some_and(|place| robot.path - place.2 >= lag) {
                    let (at, truth, path) = pending.remove(0);
                    places.push(Place { truth, path, signature: window.signature(at, &SignatureOptions::default()) });
                }
            }
            _ => {}
        }
    }
    Ok(places)
}
