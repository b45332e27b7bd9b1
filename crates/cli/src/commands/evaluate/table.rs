use std::fmt::Write as _;

use hierarchy::evaluate::AbsoluteError;

use super::{RecognitionScores, Report, Scores};

/// A line of the table: what it is, how it is read from the scores of a path, decimals, unit.
type Row = (&'static str, fn(&Scores) -> Option<f64>, usize, &'static str);

const ROWS: [Row; 35] = [
    ("ATE rmse", |scores| Some(scores.ate.as_ref()?.translation_m.rmse), 3, "m"),
    ("ATE mean", |scores| Some(scores.ate.as_ref()?.translation_m.mean), 3, "m"),
    ("ATE max", |scores| Some(scores.ate.as_ref()?.translation_m.max), 3, "m"),
    ("heading, mean", |scores| Some(scores.ate.as_ref()?.rotation_deg.mean), 2, "°"),
    ("fitted scale", |scores| Some(scores.ate.as_ref()?.fitted_scale), 4, ""),
    ("fitted rotation", |scores| Some(scores.ate.as_ref()?.fitted_rotation_deg), 2, "°"),
    ("RPE mean", |scores| Some(scores.rpe.as_ref()?.translation_m.mean), 3, "m"),
    ("RPE turn, mean", |scores| Some(scores.rpe.as_ref()?.rotation_deg.mean), 2, "°"),
    ("U(L|R)", |scores| scores.localization.as_ref()?.uncertainty_coefficient, 3, ""),
    ("in the right cell", |scores| Some(100.0 * scores.localization.as_ref()?.accuracy?), 1, "%"),
    ("relations, mean", |scores| Some(scores.relations?.all?.translation_mean_m), 4, "m"),
    ("  turn, mean", |scores| Some(scores.relations?.all?.rotation_mean_deg), 3, "°"),
    ("  up to 15 s", |scores| Some(scores.relations?.near?.translation_mean_m), 4, "m"),
    ("  over 15 s", |scores| Some(scores.relations?.far?.translation_mean_m), 4, "m"),
    ("  turn up to 15 s", |scores| Some(scores.relations?.near?.rotation_mean_deg), 3, "°"),
    ("  turn over 15 s", |scores| Some(scores.relations?.far?.rotation_mean_deg), 3, "°"),
    ("  squared, mean", |scores| Some(scores.relations?.all?.translation_squared_m2), 5, "m²"),
    ("  turn squared", |scores| Some(scores.relations?.all?.rotation_squared_deg2), 3, "°²"),
    ("walls right 0.1 m", |scores| Some(100.0 * scores.map.as_ref()?.walls.first()?.precision), 1, "%"),
    ("      found 0.1 m", |scores| Some(100.0 * scores.map.as_ref()?.walls.first()?.recall), 1, "%"),
    ("walls right 0.2 m", |scores| Some(100.0 * scores.map.as_ref()?.walls.get(1)?.precision), 1, "%"),
    ("      found 0.2 m", |scores| Some(100.0 * scores.map.as_ref()?.walls.get(1)?.recall), 1, "%"),
    ("walls right 0.3 m", |scores| Some(100.0 * scores.map.as_ref()?.walls.get(2)?.precision), 1, "%"),
    ("      found 0.3 m", |scores| Some(100.0 * scores.map.as_ref()?.walls.get(2)?.recall), 1, "%"),
    ("free space IoU", |scores| scores.map.as_ref()?.free_iou, 3, ""),
    ("map score per cell", |scores| Some(scores.map.as_ref()?.score_per_cell), 3, ""),
    ("not mapped", |scores| Some(100.0 * scores.map.as_ref()?.unknown_share), 1, "%"),
    ("wall thickness", |scores| scores.sharpness?.wall_thickness_m, 3, "m"),
    ("entropy of a cell", |scores| scores.entropy_bits, 4, "bit"),
    ("free area", |scores| Some(scores.sharpness?.free_m2), 1, "m²"),
    ("occupied area", |scores| Some(scores.sharpness?.occupied_m2), 1, "m²"),
    ("walls met again", |scores| scores.seen_again_m, 3, "m"),
    ("start to end", |scores| scores.start_to_end_m, 2, "m"),
    ("driven over", |scores| Some(scores.driven_over_m[0]), 1, "m"),
    ("           by", |scores| Some(scores.driven_over_m[1]), 1, "m"),
];

/// The report in words; writing to a string cannot fail.
pub(super) fn render(report: &Report) -> String {
    let mut text = format!("{}: {} poses, {:.1} m\n", report.file, report.poses, report.path_length_m);
    let Scores { ate, relations, map, .. } = &report.estimate;
    let compared = ate.is_some() || relations.is_some() || map.is_some();
    let _ = writeln!(text, "\n  {:<18} {:>14} {:>14}", "", "odometry", "this");
    if let Some(ate) = &report.estimate.ate {
        let of = |ate: &AbsoluteError| format!("{} {}", ate.pairs, ate.pairing);
        let odometry =
            report.odometry.as_ref().and_then(|scores| scores.ate.as_ref()).map_or_else(|| "–".to_owned(), of);
        let _ = writeln!(text, "  {:<18} {odometry:>14} {:>14}", "poses compared", of(ate));
    }
    for (name, read, decimals, unit) in ROWS {
        let Some(value) = read(&report.estimate) else { continue };
        let shown = |value: f64| format!("{value:.decimals$} {unit}");
        let odometry = report.odometry.as_ref().and_then(read).map_or_else(|| "–".to_owned(), shown);
        let _ = writeln!(text, "  {name:<18} {odometry:>14} {:>14}", shown(value));
    }
    if let Some(RecognitionScores { precision, recall, counts }) = &report.recognition {
        let _ = writeln!(
            text,
            "\n  recognition: precision {precision:.3} of {} closures, recall {recall:.3} of {} revisited places",
            counts.claimed, counts.revisits
        );
    }
    if !compared {
        text += "\n  nothing to compare with: name --truth or --relations\n";
    }
    text
}
