//! The report's colours for eyes that lack a kind of cone: what is told apart by colour stays apart.

use std::collections::BTreeMap;

const STYLE: &str = include_str!("../src/report/template/style.css");

type Rgb = [f64; 3];

/// What dichromats see of linear RGB: Machado, Oliveira and Fernandes (2009), severity 1; nothing is lacking first.
const EYES: [(&str, [Rgb; 3]); 4] = [
    ("all cones", [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]),
    ("protanopia", [[0.152286, 1.052583, -0.204868], [0.114503, 0.786281, 0.099216], [-0.003882, -0.048116, 1.051998]]),
    (
        "deuteranopia",
        [[0.367322, 0.860646, -0.227968], [0.280085, 0.672501, 0.047413], [-0.011820, 0.042940, 0.968881]],
    ),
    ("tritanopia", [[1.255528, -0.076749, -0.178779], [-0.078411, 0.930809, 0.147602], [0.004733, 0.691367, 0.303900]]),
];

/// Colours that a reader must tell apart, and the least distance in CIELAB: large where form says nothing else, small
/// where it differs as well (a dot, a ring, a cross; a width; dashes).
const APART: [(&[&str], f64); 10] = [
    (&["before", "predicted"], 15.0),
    (&["place", "before", "predicted", "refuted"], 10.0),
    (&["accepted", "path", "strain0"], 12.0),
    (&["refused", "odometry"], 15.0),
    (&["accepted", "refused", "path", "odometry", "shift"], 10.0),
    (&["strain0", "strain1", "strain2"], 10.0),
    (&["strain2", "strain3", "strain4"], 10.0),
    (&["region", "gateway"], 20.0),
    (&["contradictory", "unexplored", "empty", "occupied"], 20.0),
    (&["place", "contradictory"], 30.0),
];

#[test]
fn the_layers_stay_apart_for_every_kind_of_eye() {
    let light = STYLE.split("@media (prefers-color-scheme").next().unwrap();
    let dark = STYLE.split(":root[data-theme=\"dark\"]").nth(1).unwrap().split('}').next().unwrap();
    for (theme, style) in [("light", light), ("dark", dark)] {
        let colors = colors(style);
        for (eye, seen) in &EYES {
            for (names, least) in APART {
                for (index, one) in names.iter().enumerate() {
                    for other in &names[index + 1..] {
                        let apart = distance(lab(through(seen, colors[one])), lab(through(seen, colors[other])));
                        assert!(apart >= least, "{theme}, {eye}: {one} and {other} are only {apart:.1} apart");
                    }
                }
            }
        }
    }
}

#[test]
fn the_dark_theme_is_one_however_it_is_chosen() {
    let automatic = STYLE.split(":root:not([data-theme=\"light\"]) {").nth(1).unwrap().split('}').next().unwrap();
    let chosen = STYLE.split(":root[data-theme=\"dark\"]").nth(1).unwrap().split('}').next().unwrap();
    assert_eq!(colors(automatic), colors(chosen));
}

/// The colours `--name: #rrggbb` of a rule, as linear RGB.
fn colors(rule: &str) -> BTreeMap<&str, Rgb> {
    let color = |text: &str| {
        let value = |at: usize| f64::from(u8::from_str_radix(&text[at..at + 2], 16).unwrap()) / 255.0;
        [1, 3, 5].map(value).map(|c| if c <= 0.04045 { c / 12.92 } else { ((c + 0.055) / 1.055).powf(2.4) })
    };
    let entries = rule.split("--").skip(1).filter_map(|entry| entry.split_once(':'));
    let hex = entries.filter_map(|(name, value)| Some((name, value.split(';').next()?.trim())));
    hex.filter(|(_, value)| value.starts_with('#')).map(|(name, value)| (name, color(value))).collect()
}

fn through(eye: &[Rgb; 3], color: Rgb) -> Rgb {
    times(eye, color).map(|part| part.clamp(0.0, 1.0))
}

fn times(matrix: &[Rgb; 3], vector: Rgb) -> Rgb {
    matrix.map(|row| row.iter().zip(vector).map(|(share, part)| share * part).sum())
}

/// CIELAB of linear sRGB, D65.
fn lab(color: Rgb) -> Rgb {
    const XYZ: [Rgb; 3] =
        [[0.4124564, 0.3575761, 0.1804375], [0.2126729, 0.7151522, 0.0721750], [0.0193339, 0.1191920, 0.9503041]];
    let [x, y, z] = times(&XYZ, color);
    let f = |t: f64| if t > 216.0 / 24389.0 { t.cbrt() } else { (24389.0 / 27.0 * t + 16.0) / 116.0 };
    let [x, y, z] = [f(x / 0.95047), f(y), f(z / 1.08883)];
    [116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)]
}

fn distance(a: Rgb, b: Rgb) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt()
}
