use std::fmt::Write;

use nalgebra::Point2;

/// A drawing in metres, `y` up, that grows to fit what is put into it.
///
/// Everything is kept in map coordinates; one transform at the end turns `y` over and scales.
#[derive(Debug, Clone)]
pub(crate) struct Drawing {
    body: String,
    low: Point2<f64>,
    high: Point2<f64>,
}

impl Drawing {
    pub(crate) fn new() -> Self {
        let (low, high) = (f64::INFINITY, f64::NEG_INFINITY);
        Self { body: String::new(), low: Point2::new(low, low), high: Point2::new(high, high) }
    }

    fn include(&mut self, point: Point2<f64>) {
        self.low = Point2::new(self.low.x.min(point.x), self.low.y.min(point.y));
        self.high = Point2::new(self.high.x.max(point.x), self.high.y.max(point.y));
    }

    /// A straight line of a class, with a tooltip.
    pub(crate) fn line(&mut self, class: &str, from: Point2<f64>, to: Point2<f64>, title: &str) {
        self.include(from);
        self.include(to);
        let title = tooltip(title);
        let _ = writeln!(
            self.body,
            r#"<line class="{class}" x1="{:.3}" y1="{:.3}" x2="{:.3}" y2="{:.3}">{title}</line>"#,
            from.x, -from.y, to.x, -to.y
        );
    }

    /// A disc of a class, radius in metres, with a tooltip.
    pub(crate) fn disc(&mut self, class: &str, center: Point2<f64>, radius: f64, title: &str) {
        self.include(center);
        let title = tooltip(title);
        let (x, y) = (center.x, -center.y);
        let _ = writeln!(self.body, r#"<circle class="{class}" cx="{x:.3}" cy="{y:.3}" r="{radius}">{title}</circle>"#);
    }

    /// An ellipse of a class, half axes in metres, the long one at `angle` radians counter-clockwise.
    pub(crate) fn ellipse(&mut self, class: &str, center: Point2<f64>, half: [f64; 2], angle: f64) {
        self.include(center);
        let (x, y, degrees) = (center.x, -center.y, -angle.to_degrees());
        let _ = writeln!(
            self.body,
            r#"<ellipse class="{class}" transform="translate({x:.3} {y:.3}) rotate({degrees:.1})" rx="{:.3}" ry="{:.3}"/>"#,
            half[0], half[1]
        );
    }

    /// The box of everything drawn, or `None` where nothing was.
    pub(crate) fn bounds(&self) -> Option<(Point2<f64>, Point2<f64>)> {
        (self.low.x <= self.high.x).then_some((self.low, self.high))
    }
}

/// Some drawings side by side at one scale, each with a caption, and a scale bar.
pub(crate) fn panels(drawings: &[(String, Drawing)], style: &str) -> String {
    const WIDTH: f64 = 720.0;
    const MARGIN: f64 = 24.0;
    const CAPTION: f64 = 34.0;
    let size = |drawing: &Drawing| {
        let (low, high) = drawing.bounds().unwrap_or((Point2::origin(), Point2::new(1.0, 1.0)));
        let size = high - low;
        (low, high, size.x.max(1.0), size.y.max(1.0))
    };
    let widest = drawings.iter().map(|(_, drawing)| size(drawing).2).fold(1.0, f64::max);
    let highest = drawings.iter().map(|(_, drawing)| size(drawing).3).fold(1.0, f64::max);
    let scale = ((WIDTH - 2.0 * MARGIN) / widest).min(1.4 * WIDTH / highest);
    let panel = widest * scale + 2.0 * MARGIN;
    #[expect(clippy::cast_precision_loss, reason = "a page has few panels")]
    let (width, height) = (panel * drawings.len() as f64, highest * scale + 2.0 * MARGIN + CAPTION);

    let mut svg = format!(
        r#"<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width:.0} {height:.0}" font-family="sans-serif">
<style>.sheet{{fill:#fff}}.caption{{font-size:15px;fill:#222}}.bar{{stroke:#222;stroke-width:2}}{style}</style>
<rect class="sheet" width="{width:.0}" height="{height:.0}"/>
"#
    );
    let mut left = 0.0;
    for (caption, drawing) in drawings {
        let (low, high, ..) = size(drawing);
        let (x, y) = (left + MARGIN - low.x * scale, CAPTION + MARGIN + high.y * scale);
        let _ = writeln!(svg, r#"<text class="caption" x="{:.0}" y="24">{}</text>"#, left + MARGIN, escape(caption));
        let _ = writeln!(svg, r#"<g transform="translate({x:.2} {y:.2}) scale({scale:.4})">"#);
        svg.push_str(&drawing.body);
        svg.push_str("</g>\n");
        left += panel;
    }
    let bar = scale_bar(widest);
    let (end, base) = (MARGIN + bar * scale, height - 10.0);
    let _ = writeln!(svg, r#"<line class="bar" x1="{MARGIN}" y1="{base:.0}" x2="{end:.1}" y2="{base:.0}"/>"#);
    let _ = writeln!(svg, r#"<text class="caption" x="{:.1}" y="{:.0}">{bar} m</text>"#, end + 6.0, base + 4.0);
    svg.push_str("</svg>\n");
    svg
}

/// A round length in metres that spans about a fifth of `width`.
fn scale_bar(width: f64) -> f64 {
    let power = 10f64.powf((width / 5.0).log10().floor());
    let digit = width / 5.0 / power;
    power
        * if digit < 2.0 {
            1.0
        } else if digit < 5.0 {
            2.0
        } else {
            5.0
        }
}

fn tooltip(title: &str) -> String {
    if title.is_empty() { String::new() } else { format!("<title>{}</title>", escape(title)) }
}

/// Text that XML takes as text.
pub(crate) fn escape(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scale_bars_are_round() {
        assert_eq!(scale_bar(46.0), 5.0);
        assert_eq!(scale_bar(12.0), 2.0);
        assert_eq!(scale_bar(500.0), 100.0);
    }

    #[test]
    fn an_empty_drawing_is_still_a_page() {
        let svg = panels(&[("nothing <yet>".into(), Drawing::new())], "");
        assert!(svg.starts_with("<svg") && svg.contains("nothing &lt;yet&gt;"));
    }

    #[test]
    fn north_is_up() {
        let mut drawing = Drawing::new();
        drawing.disc("place", Point2::new(1.0, 2.0), 0.2, "");
        assert!(drawing.body.contains(r#"cy="-2.000""#));
    }
}
