//! Cuts free space at its gates and takes back the cuts that separate nothing worth a name.

use crate::{
    components::{DisjointSets, components},
    gates::{Gate, median_chord},
    plane::Plane,
};

/// Cuts, labels and merges. Returns labels (0 = none) and the gates that stay.
pub(crate) fn carve(free: &Plane<bool>, gates: &[Gate], meter: f64, least: f64) -> (Plane<u32>, Vec<Gate>) {
    let mut barrier = free.clone();
    let lines: Vec<Vec<usize>> = gates.iter().map(|g| line(free, g)).collect();
    for line in &lines {
        for &cell in line {
            barrier.cells[cell] = false;
        }
    }
    let parts = components(&barrier, 0);
    let mut labels = parts.labels(free.rows, free.columns);
    let mut sizes = vec![0_usize];
    sizes.extend(parts.sizes());
    let mut sets = DisjointSets::new(parts.count + 1);
    let mut active: Vec<bool> = vec![true; gates.len()];
    let sides: Vec<[u32; 2]> =
        gates.iter().map(|g| [label_beside(&labels, g, -1.0), label_beside(&labels, g, 1.0)]).collect();
    loop {
        let mut worst: Option<(f64, usize)> = None;
        for (k, gate) in gates.iter().enumerate() {
            if !active[k] {
                continue;
            }
            let [a, b] = sides[k].map(|l| sets.find(l));
            if a == b || a == 0 || b == 0 {
                active[k] = false;
                for &cell in &lines[k] {
                    if labels.cells[cell] == 0 {
                        labels.cells[cell] = a.max(b);
                    }
                }
                continue;
            }
            let mut ratio = 0.0_f64;
            let mut tiny = false;
            for (s, l) in [(-1.0, a), (1.0, b)] {
                if l == 0 {
                    continue;
                }
                let roots = &sets;
                let inside = |r, c| labels.at(r, c).is_some_and(|x| x != 0 && roots.peek(x) == l);
                let chord = median_chord(inside, gate, s, (1.5 * meter).max(gate.width), 2.0 * gate.width + meter);
                ratio = ratio.max(gate.width / chord.max(1e-9));
                if (sizes[l as usize] as f64) < least * meter * meter {
                    tiny = true;
                }
            }
            let excess = if tiny {
                10.0 + gate.cost
            } else {
                ratio + 0.2 * (0.55 - gate.embedding).max(0.0) - threshold(gate.width / meter)
            };
            if excess > 0.0 && worst.is_none_or(|(w, _)| excess > w) {
                worst = Some((excess, k));
            }
        }
        let Some((_, k)) = worst else { break };
        let [a, b] = sides[k].map(|l| sets.find(l));
        let root = sets.join(a, b);
        sizes[root as usize] = sizes[a as usize] + sizes[b as usize];
    }
    for (k, line) in lines.iter().enumerate() {
        if active[k] {
            let [a, b] = sides[k];
            for &cell in line {
                if labels.cells[cell] == 0 {
                    labels.cells[cell] = if a != 0 { a } else { b };
                }
            }
        }
    }
    for l in &mut labels.cells {
        *l = sets.find(*l);
    }
    let kept = gates.iter().zip(&active).filter(|(_, a)| **a).map(|(g, _)| *g).collect();
    (labels, kept)
}

/// The largest share of the width beside it that a gate of `width` metres may have.
fn threshold(width: f64) -> f64 {
    let ratio = if width < 2.2 {
        0.87
    } else if width < 3.0 {
        0.87 - 0.32 * (width - 2.2) / 0.8
    } else {
        0.55 - 0.15 * (width - 3.0)
    };
    let gain = 0.15 + 0.35 * ((width - 1.0) / 0.6).clamp(0.0, 1.0);
    ratio.min(width / (width + gain))
}

/// The label on one side of a gate.
pub(crate) fn label_beside<T: Copy + Default + PartialEq>(labels: &Plane<T>, gate: &Gate, side: f64) -> T {
    let (center, along) = (gate.center(), gate.along());
    let normal = (-along.1 * side, along.0 * side);
    for step in 1..6 {
        let (r, c) = (center.0 + f64::from(step) * normal.0, center.1 + f64::from(step) * normal.1);
        match labels.at(r.round() as i32, c.round() as i32) {
            Some(label) if label != T::default() => return label,
            _ => (),
        }
    }
    T::default()
}

/// The free cells on the straight line between the ends of a gate.
fn line(free: &Plane<bool>, gate: &Gate) -> Vec<usize> {
    let [(r0, c0), (r1, c1)] = gate.ends;
    let steps = (r1 - r0).abs().max((c1 - c0).abs()).max(1);
    (0..=steps)
        .map(|k| {
            let at = |from: i32, to: i32| {
                (f64::from(from) + f64::from(to - from) * f64::from(k) / f64::from(steps)).round() as usize
            };
            at(r0, r1) * free.columns + at(c0, c1)
        })
        .filter(|&index| free.cells[index])
        .collect()
}
