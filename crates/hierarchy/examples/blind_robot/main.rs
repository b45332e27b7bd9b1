//! How many wrong proposals the map of a robot that sees nothing can bear.
//!
//! `cargo run --release -p hierarchy --example blind_robot` drives three made routes with recognisers that are wrong more
//! and more often, three times each, and prints the mean errors.
#![expect(clippy::print_stdout, reason = "a table is what this example is for")]

mod drive;

use drive::{Recogniser, corridor, drive, judged, rounds, triangle};
use hierarchy::{Config, Mapper};

/// From a fair recogniser to one that is hardly ever right.
fn recognisers() -> [Recogniser; 5] {
    let fair = Recogniser::default();
    [
        fair,
        Recogniser { most_alike: 1.0, ..fair },
        Recogniser { aliased: true, wrong: 4, ..fair },
        Recogniser { wrong: 10, most_alike: 1.0, ..fair },
        Recogniser { recall: 0.05, wrong: 20, ..fair },
    ]
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    println!("{:<10} recall wrong most alike aliased  odometry and map, m, for seeds 1 to 3", "route");
    for (name, route) in [("corridor", corridor(5)), ("rounds", rounds()), ("triangle", triangle())] {
        for recogniser in recognisers() {
            let Recogniser { recall, wrong, most_alike, aliased } = recogniser;
            print!("{name:<10} {recall:>6} {wrong:>5} {most_alike:>10} {aliased:>7} ");
            for seed in 1..=3 {
                let log = drive(&route, &recogniser, seed);
                let mut mapper = Mapper::new(Config::default())?;
                for entry in &log {
                    mapper.push(entry)?;
                }
                mapper.finish()?;
                if let Some((map, odometry)) = judged(&mapper, &log) {
                    print!("  {:.2} {:.3}", odometry.translation_m.mean, map.translation_m.mean);
                }
            }
            println!();
        }
    }
    Ok(())
}
