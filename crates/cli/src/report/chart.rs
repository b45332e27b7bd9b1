use std::fmt::Write;

use hierarchy::{Growth, Regrown};

/// Size of the chart and of what stands around the plot, in its own units; the page's script reads the plot's box from it.
const WIDTH: f64 = 1000.0;
const HEIGHT: f64 = 190.0;
const LEFT: f64 = 56.0;
const RIGHT: f64 = 12.0;
const TOP: f64 = 14.0;
const BOTTOM: f64 = 28.0;

/// Energy over the links in the order in which they came: before and after each relaxation, and what it is expected to be.
///
/// The axis is `log₁₀(1 + E)`: an energy begins at 0, and a loop closed late can lift it by orders of magnitude.
pub(super) fn energy(growth: &Growth, n_links: usize) -> String {
    #[expect(clippy::cast_precision_loss, reason = "loops are few")]
    let highest = |step: &Regrown| step.energy_before.max(step.energy_after).max(step.degrees_of_freedom as f64);
    let top = growth.relaxations.iter().map(highest).fold(10.0, f64::max);
    let plot = Plot { links: n_links.max(1), top: level(top) };
    let mut svg = format!(
        r#"<svg id="energy" class="chart" viewBox="0 0 {WIDTH} {HEIGHT}" data-left="{LEFT}" data-right="{}" role="img" aria-label="Energy over time">"#,
        WIDTH - RIGHT
    );
    plot.axes(&mut svg);
    let (mut before, mut after, mut expected) = (String::new(), String::new(), String::new());
    let origin = format!("M{:.1} {:.1}", plot.x(0), plot.y(0.0));
    after.push_str(&origin);
    expected.push_str(&origin);
    for step in &growth.relaxations {
        let x = plot.x(step.links);
        let (from, to) = (plot.y(step.energy_before), plot.y(step.energy_after));
        let _ = write!(before, "M{x:.1} {from:.1}V{to:.1}");
        let _ = write!(after, "H{x:.1}V{to:.1}");
        #[expect(clippy::cast_precision_loss, reason = "loops are few")]
        let _ = write!(expected, "H{x:.1}V{:.1}", plot.y(step.degrees_of_freedom as f64));
    }
    let _ = write!(after, "H{:.1}", plot.x(n_links));
    let _ = write!(expected, "H{:.1}", plot.x(n_links));
    let _ = write!(
        svg,
        r#"<path class="expected" d="{expected}"/><path class="before" d="{before}"/><path class="after" d="{after}"/></svg>"#
    );
    svg
}

/// From links and energies to the paper.
struct Plot {
    links: usize,
    top: f64,
}

impl Plot {
    #[expect(clippy::cast_precision_loss, reason = "links are far fewer than 2^52")]
    fn x(&self, links: usize) -> f64 {
        LEFT + (WIDTH - LEFT - RIGHT) * links as f64 / self.links as f64
    }

    fn y(&self, energy: f64) -> f64 {
        HEIGHT - BOTTOM - (HEIGHT - TOP - BOTTOM) * (level(energy) / self.top).min(1.0)
    }

    fn axes(&self, svg: &mut String) {
        let (left, right, base) = (LEFT, WIDTH - RIGHT, HEIGHT - BOTTOM);
        let ticks = std::iter::once(0.0).chain((0..12).map(|power| 10f64.powi(power)));
        for energy in ticks.take_while(|energy| level(*energy) <= self.top) {
            let y = self.y(energy);
            let _ = write!(
                svg,
                r#"<path class="rule" d="M{left} {y:.1}H{right}"/><text class="tick" x="{}" y="{:.1}" text-anchor="end">{}</text>"#,
                left - 8.0,
                y + 4.0,
                tick(energy)
            );
        }
        let _ = write!(
            svg,
            r#"<text class="tick" x="{left}" y="{y}">0</text><text class="tick" x="{right}" y="{y}" text-anchor="end">link {}</text>"#,
            self.links,
            y = base + 18.0
        );
    }
}

fn level(energy: f64) -> f64 {
    (1.0 + energy.max(0.0)).log10()
}

/// A power of ten as it fits beside the axis: digits while they are few.
fn tick(energy: f64) -> String {
    if energy < 1e5 {
        return energy.to_string();
    }
    let digit = |digit: char| "⁰¹²³⁴⁵⁶⁷⁸⁹".chars().nth(digit.to_digit(10)? as usize);
    format!("10{}", format!("{:.0}", energy.log10()).chars().filter_map(digit).collect::<String>())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn higher_energies_stand_higher_and_later_links_farther_right() {
        let plot = Plot { links: 10, top: level(1000.0) };
        assert!(plot.y(100.0) < plot.y(10.0) && plot.x(9) < plot.x(10));
        assert!((plot.x(10) - (WIDTH - RIGHT)).abs() < 1e-9);
        assert!(plot.y(1e9) >= TOP, "what is too high stays on the paper");
    }

    #[test]
    fn a_map_that_was_never_relaxed_has_a_chart() {
        let chart = energy(&Growth::default(), 0);
        assert!(chart.contains("class=\"after\"") && !chart.contains("NaN"));
        let step =
            Regrown { links: 3, positions: vec![], energy_before: 50.0, energy_after: 2.0, degrees_of_freedom: 2 };
        let growth = Growth { relaxations: vec![step], ..Growth::default() };
        assert!(energy(&growth, 3).contains("class=\"before\" d=\"M988.0"));
    }
}
