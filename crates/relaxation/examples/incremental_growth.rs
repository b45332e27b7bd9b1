//! Grows maps place by place and prints how long each kind of change takes: `incremental_growth [PLACES…]`.
//!
//! The map is a lattice of corridors, walked depth first as an explorer does; every corridor found from its other end closes a
//! loop. Columns: changes of that kind, then median, 99th percentile and maximum in microseconds. "closure" leaves the
//! optimum ready to be read, one place at a time; "closure, all read" also computes every coordinate; "one sweep" is the
//! paper's policy, the map swept once per added place (its excess energy at the end is printed below).
#![expect(clippy::print_stdout, reason = "the table is the output")]

use std::error::Error;
use std::time::Instant;

use nalgebra::Vector2;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;
use relaxation::{Incremental, OnlineSweeps, Spring, optimum};

fn main() -> Result<(), Box<dyn Error>> {
    let sizes: Vec<usize> = std::env::args().skip(1).map(|size| size.parse()).collect::<Result<_, _>>()?;
    println!("{:>8} {:<22} {:>7} {:>9} {:>9} {:>9}", "places", "change", "count", "median", "p99", "max");
    for places in if sizes.is_empty() { vec![137, 10_000, 100_000] } else { sizes } {
        let springs = walk(places);
        grow(places, &springs, false)?;
        grow(places, &springs, true)?;
        sweep_only(places, &springs)?;
    }
    Ok(())
}

fn grow(places: usize, springs: &[Spring], read_all: bool) -> Result<(), Box<dyn Error>> {
    let mut map = Incremental::new();
    map.add_node();
    let (mut trees, mut closures) = (Vec::new(), Vec::new());
    for &spring in springs {
        let clock = Instant::now();
        let tree = spring.to == map.len();
        if tree {
            map.add_node();
        }
        map.add_spring(spring)?;
        if read_all && !tree {
            map.positions();
        }
        let kind = if tree { &mut trees } else { &mut closures };
        kind.push(clock.elapsed().as_secs_f64() * 1e6);
    }
    if !read_all {
        print_row(places, "tree-like", &mut trees);
    }
    print_row(places, if read_all { "closure, all read" } else { "closure" }, &mut closures);
    let network = map.to_network();
    let (energy, least) = (network.energy(map.positions()), network.energy(&optimum(&network)?));
    println!("{places:>8} excess energy {:.1e}, factored {} times", energy / least - 1.0, map.factorizations());
    Ok(())
}

/// The paper's policy.
fn sweep_only(places: usize, springs: &[Spring]) -> Result<(), Box<dyn Error>> {
    if places > 10_000 {
        return Ok(()); // A sweep per place is quadratic in the map.
    }
    let mut map = OnlineSweeps::new();
    map.add_node();
    let mut sweeps = Vec::new();
    for &spring in springs {
        let clock = Instant::now();
        if spring.to == map.len() {
            map.add_node();
        }
        map.add_spring(spring)?;
        map.sweep();
        sweeps.push(clock.elapsed().as_secs_f64() * 1e6);
    }
    print_row(places, "one sweep", &mut sweeps);
    let network = map.to_network();
    let (energy, least) = (network.energy(map.positions()), network.energy(&optimum(&network)?));
    println!("{places:>8} excess energy of one sweep per place {:.1e}", energy / least - 1.0);
    Ok(())
}

#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    clippy::cast_precision_loss,
    reason = "a percentile"
)]
fn print_row(places: usize, change: &str, micros: &mut [f64]) {
    micros.sort_by(f64::total_cmp);
    let at = |part: f64| micros[((micros.len() - 1) as f64 * part) as usize];
    println!("{places:>8} {change:<22} {:>7} {:>9.2} {:>9.2} {:>9.2}", micros.len(), at(0.5), at(0.99), at(1.0));
}

/// The springs in the order in which a depth-first explorer of a corridor lattice finds them; new places are numbered on.
fn walk(places: usize) -> Vec<Spring> {
    let mut rng = Pcg64Mcg::seed_from_u64(137);
    let side = (places / 5).isqrt() + 2;
    // Every junction has a corridor of three places to the east and one to the north, one in five missing.
    let lattice = |x: usize, y: usize| (y * side + x) * 7;
    let mut neighbours: Vec<Vec<usize>> = vec![Vec::new(); side * side * 7];
    for (x, y) in (0..side * side).map(|i| (i % side, i / side)) {
        for (east, (there_x, there_y)) in [(true, (x + 1, y)), (false, (x, y + 1))] {
            if there_x < side && there_y < side && rng.random_range(0..5) > 0 {
                let first = lattice(x, y) + if east { 1 } else { 4 };
                let chain = [lattice(x, y), first, first + 1, first + 2, lattice(there_x, there_y)];
                for pair in chain.windows(2) {
                    neighbours[pair[0]].push(pair[1]);
                    neighbours[pair[1]].push(pair[0]);
                }
            }
        }
    }
    let mut number = vec![usize::MAX; neighbours.len()];
    let mut springs = Vec::new();
    let start = lattice(side / 2, side / 2);
    number[start] = 0;
    let (mut found, mut path) = (1, vec![(start, 0)]);
    while let Some((here, next)) = path.last_mut() {
        let (here, Some(&there)) = (*here, neighbours[*here].get(*next)) else {
            path.pop();
            continue;
        };
        *next += 1;
        let known = number[there] != usize::MAX;
        // A spring to an earlier place closes a loop, unless it is the one just come by.
        let came_by = path.len() > 1 && path[path.len() - 2].0 == there;
        if known && (came_by || number[there] > number[here]) {
            continue;
        }
        if !known {
            if found == places {
                continue;
            }
            number[there] = found;
            found += 1;
            path.push((there, 0));
        }
        let error = Vector2::new(rng.random_range(-0.1..0.1), rng.random_range(-0.1..0.1));
        springs.push(Spring::isotropic(
            number[here],
            number[there],
            error + Vector2::new(1.0, 0.0),
            rng.random_range(0.001..0.01),
        ));
    }
    springs
}
