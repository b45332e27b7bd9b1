use std::io::{self, Write};

use hierarchy::Whereabouts;
use hierarchy::topo_map::{Hypothesis, Recognition};
use serde_json::{Value, json};

/// One word for what is known, and the likeliest place.
fn state(seen: &Whereabouts) -> (&'static str, Option<Hypothesis>) {
    match seen.recognition {
        Recognition::Known(best) if seen.map_from_robot.is_some() => ("known", Some(best)),
        Recognition::Known(best) => ("unsure", Some(best)),
        Recognition::New { .. } => ("uncharted", None),
        Recognition::Unsure { best, .. } => ("unsure", best),
    }
}

/// A view for programs.
pub(super) fn document(seen: &Whereabouts) -> Value {
    let (state, best) = state(seen);
    let pose = seen.map_from_robot.map(
        |pose| json!({ "x_m": pose.translation.x, "y_m": pose.translation.y, "heading_rad": pose.rotation.angle() }),
    );
    json!({
        "stamp_s": seen.stamp, "driven_m": seen.driven, "state": state, "pose": pose,
        "place": best.map(|best| best.place.0), "probability": best.map(|best| best.probability),
    })
}

/// A table of the views, one row each (RFC 4180); what is not known is empty.
pub(super) fn write(out: &mut dyn Write, seen: &[Whereabouts]) -> io::Result<()> {
    writeln!(out, "stamp_s,driven_m,state,x_m,y_m,heading_rad,place,probability")?;
    for view in seen {
        let (state, best) = state(view);
        write!(out, "{:.6},{:.3},{state},", view.stamp, view.driven)?;
        match view.map_from_robot {
            Some(pose) => {
                write!(out, "{:.4},{:.4},{:.5},", pose.translation.x, pose.translation.y, pose.rotation.angle())?;
            }
            None => write!(out, ",,,")?,
        }
        match best {
            Some(best) => writeln!(out, "{},{:.4}", best.place.0, best.probability)?,
            None => writeln!(out, ",")?,
        }
    }
    Ok(())
}
