use std::io::{self, Write};

use hierarchy::explain::LoopStory;

/// Every loop that was weighed: its places, how far it is from what the rest of the map says, and why it holds or not.
pub(crate) fn write(out: &mut dyn Write, loops: &[LoopStory]) -> io::Result<()> {
    writeln!(out, "place,known,accepted,residual_x_m,residual_y_m,sigma_m,residual_sigma,chi2,score,shift_m,reason")?;
    for story in loops {
        let [x, y] = story.residual_m;
        let optional = |value: Option<f64>| value.map_or_else(String::new, |value| format!("{value:.3}"));
        writeln!(
            out,
            "{},{},{},{x:.3},{y:.3},{:.3},{:.2},{:.2},{},{},{}",
            story.place.0,
            story.known.0,
            story.accepted,
            story.sigma_m,
            story.residual_sigma,
            story.chi2,
            optional(story.score),
            optional(story.shift_m),
            quoted(&story.reason)
        )?;
    }
    Ok(())
}

/// A text as one field (RFC 4180).
fn quoted(text: &str) -> String {
    format!("\"{}\"", text.replace('"', "\"\""))
}
