use std::io::{self, Write};

use hierarchy::Atlas;

/// A table of the places, one row each (RFC 4180).
pub(super) fn write(out: &mut dyn Write, atlas: &Atlas) -> io::Result<()> {
    writeln!(
        out,
        "place,name,visited,visits,x_m,y_m,heading_rad,sigma_long_m,sigma_short_m,sigma_angle_rad,\
         dead_reckoned_x_m,dead_reckoned_y_m"
    )?;
    for place in &atlas.places {
        let name = place.name.as_ref().map_or_else(String::new, |name| format!("\"{}\"", name.replace('"', "\"\"")));
        let ([long, short], angle) = place.ellipse.unwrap_or_default();
        let (at, before) = (place.position, place.dead_reckoned);
        writeln!(
            out,
            "{},{name},{},{},{:.4},{:.4},{:.5},{long:.4},{short:.4},{angle:.4},{:.4},{:.4}",
            place.id.0, place.visited, place.visits, at.x, at.y, place.robot_heading, before.x, before.y
        )?;
    }
    Ok(())
}
