//! Drawings as SVG text. Classes stand for colours, line widths and type, so that the page's style sheet sets them for light,
//! dark and paper.

use std::fmt::Write;

/// A drawing under construction; lengths are in its own units, about a pixel each.
pub struct Svg {
    width: f64,
    height: f64,
    body: String,
}

/// The point of a text that its position refers to.
#[derive(Clone, Copy)]
pub enum Anchor {
    Start,
    Middle,
    End,
}

impl Anchor {
    const fn name(self) -> &'static str {
        match self {
            Anchor::Start => "start",
            Anchor::Middle => "middle",
            Anchor::End => "end",
        }
    }
}

impl Svg {
    pub fn new(width: f64, height: f64) -> Svg {
        Svg { width, height, body: String::new() }
    }

    pub fn line(&mut self, class: &str, [x1, y1]: [f64; 2], [x2, y2]: [f64; 2]) {
        let _ = write!(
            self.body,
            r#"<line class="{class}" x1="{}" y1="{}" x2="{}" y2="{}"/>"#,
            Short(x1),
            Short(y1),
            Short(x2),
            Short(y2)
        );
    }

    /// Adds a rectangle; `says` is its tooltip.
    pub fn rect(&mut self, class: &str, [x, y]: [f64; 2], [width, height]: [f64; 2], says: Option<&str>) {
        let _ = write!(
            self.body,
            r#"<rect class="{class}" x="{}" y="{}" width="{}" height="{}""#,
            Short(x),
            Short(y),
            Short(width.max(0.0)),
            Short(height.max(0.0))
        );
        self.close("rect", says);
    }

    /// Closes an element; `says` is its tooltip.
    fn close(&mut self, element: &str, says: Option<&str>) {
        let _ = match says {
            Some(says) => write!(self.body, "><title>{}</title></{element}>", escaped(says)),
            None => self.body.write_str("/>"),
        };
    }

    /// Adds a line through points.
    pub fn polyline(&mut self, class: &str, points: impl IntoIterator<Item = [f64; 2]>) {
        let _ = write!(self.body, r#"<polyline class="{class}" points="{}"/>"#, listed(points));
    }

    /// Adds a line through points with a tooltip.
    pub fn polyline_that_says(&mut self, class: &str, points: impl IntoIterator<Item = [f64; 2]>, says: &str) {
        let _ = write!(self.body, r#"<polyline class="{class}" points="{}""#, listed(points));
        self.close("polyline", Some(says));
    }

    /// Adds a filled polygon.
    pub fn polygon(&mut self, class: &str, points: impl IntoIterator<Item = [f64; 2]>) {
        let _ = write!(self.body, r#"<polygon class="{class}" points="{}"/>"#, listed(points));
    }

    pub fn circle(&mut self, class: &str, [x, y]: [f64; 2], radius: f64, says: Option<&str>) {
        let _ =
            write!(self.body, r#"<circle class="{class}" cx="{}" cy="{}" r="{}""#, Short(x), Short(y), Short(radius));
        self.close("circle", says);
    }

    /// Adds an ellipse whose first half axis is rotated by `degrees` from x to y of the drawing.
    pub fn ellipse(&mut self, class: &str, [x, y]: [f64; 2], [a, b]: [f64; 2], degrees: f64) {
        let _ = write!(
            self.body,
            r#"<ellipse class="{class}" rx="{}" ry="{}" transform="translate({} {}) rotate({})"/>"#,
            Short(a),
            Short(b),
            Short(x),
            Short(y),
            Short(degrees)
        );
    }

    pub fn text(&mut self, class: &str, anchor: Anchor, [x, y]: [f64; 2], text: &str) {
        let (anchor, text) = (anchor.name(), escaped(text));
        let _ = write!(
            self.body,
            r#"<text class="{class}" text-anchor="{anchor}" x="{}" y="{}">{text}</text>"#,
            Short(x),
            Short(y)
        );
    }

    /// Adds a text that reads upwards, centred at a position.
    pub fn upright(&mut self, class: &str, [x, y]: [f64; 2], text: &str) {
        let _ = write!(
            self.body,
            r#"<text class="{class}" text-anchor="middle" transform="translate({} {}) rotate(-90)">{}</text>"#,
            Short(x),
            Short(y),
            escaped(text)
        );
    }

    /// Adds an embedded picture from a `data:` address.
    pub fn image(&mut self, [x, y]: [f64; 2], [width, height]: [f64; 2], address: &str) {
        let _ = write!(
            self.body,
            r#"<image x="{}" y="{}" width="{}" height="{}" preserveAspectRatio="none" href="{}"/>"#,
            Short(x),
            Short(y),
            Short(width),
            Short(height),
            escaped(address)
        );
    }

    /// Returns the SVG element; `says` is its text for screen readers.
    pub fn finish(self, says: &str) -> String {
        let Svg { width, height, body } = self;
        format!(
            r#"<svg viewBox="0 0 {} {}" width="{}" height="{}" role="img" aria-label="{}">{body}</svg>"#,
            Short(width),
            Short(height),
            Short(width),
            Short(height),
            escaped(says)
        )
    }
}

fn listed(points: impl IntoIterator<Item = [f64; 2]>) -> String {
    let mut list = String::new();
    for [x, y] in points {
        let _ = write!(list, "{}{},{}", if list.is_empty() { "" } else { " " }, Short(x), Short(y));
    }
    list
}

/// A length with at most two decimals; 0 in place of non-finite values, which a drawing cannot show.
struct Short(f64);

impl std::fmt::Display for Short {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let value = if self.0.is_finite() { self.0 } else { 0.0 };
        // Adding zero turns −0 into 0.
        let rounded = (value * 100.0).round() / 100.0 + 0.0;
        write!(f, "{rounded}")
    }
}

/// Escapes a text for an element or an attribute in double quotes.
pub fn escaped(text: &str) -> String {
    let mut escaped = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => escaped.push_str("&amp;"),
            '<' => escaped.push_str("&lt;"),
            '>' => escaped.push_str("&gt;"),
            '"' => escaped.push_str("&quot;"),
            '\'' => escaped.push_str("&#39;"),
            c => escaped.push(c),
        }
    }
    escaped
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_said_is_escaped() {
        let mut svg = Svg::new(10.0, 10.0);
        svg.text("label", Anchor::Start, [0.0, -0.0], "a < b & \"c\"");
        svg.rect("bar", [f64::NAN, 1.005], [-1.0, 2.0], Some("<script>"));
        let text = svg.finish("x > 'y'");
        assert!(text.contains("a &lt; b &amp; &quot;c&quot;") && text.contains("<title>&lt;script&gt;</title>"));
        assert!(text.contains(r#"aria-label="x &gt; &#39;y&#39;""#));
        assert!(!text.contains("NaN") && !text.contains("-0\"") && text.contains(r#"width="0" height="2""#), "{text}");
    }
}
