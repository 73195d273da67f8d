//! Text and numbers as XML.

use std::fmt::Write;

/// Text with the five characters escaped that mean something in XML, and without those that XML cannot hold.
pub fn escape(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '"' => out.push_str("&quot;"),
            '\'' => out.push_str("&#39;"),
            '\n' | '\t' | '\r' => out.push(' '),
            c if c.is_control() || matches!(c, '\u{fffe}' | '\u{ffff}') => out.push('\u{fffd}'),
            c => out.push(c),
        }
    }
    out
}

/// A coordinate with one decimal, no trailing zero.
pub(super) fn coordinate(value: f64) -> String {
    let tenths = (value * 10.0).round() as i64;
    let mut out = String::new();
    push_tenths(&mut out, tenths);
    out
}

fn push_tenths(out: &mut String, tenths: i64) {
    let (sign, size) = (if tenths < 0 { "-" } else { "" }, tenths.unsigned_abs());
    // Writing to a String cannot fail.
    let _ = match (size / 10, size % 10) {
        (whole, 0) => write!(out, "{sign}{whole}"),
        (0, tenth) => write!(out, "{sign}.{tenth}"),
        (whole, tenth) => write!(out, "{sign}{whole}.{tenth}"),
    };
}

/// Path data of a stroke in px, relative and in tenths: a third of the size of absolute coordinates.
pub(super) fn stroke(points: impl IntoIterator<Item = (f64, f64)>) -> String {
    let mut out = String::new();
    let mut last: Option<(i64, i64)> = None;
    for (x, y) in points {
        let here = ((x * 10.0).round() as i64, (y * 10.0).round() as i64);
        let (letter, dx, dy) = last.map_or(('M', here.0, here.1), |last| ('l', here.0 - last.0, here.1 - last.1));
        out.push(letter);
        push_tenths(&mut out, dx);
        if dy >= 0 {
            out.push(' ');
        }
        push_tenths(&mut out, dy);
        last = Some(here);
    }
    out
}

/// Appends a text element.
pub(super) fn text(out: &mut String, class: &str, anchor: &str, x: f64, y: f64, content: &str) {
    let class = if class.is_empty() { String::new() } else { format!(" class=\"{class}\"") };
    let anchor = if anchor == "start" { String::new() } else { format!(" text-anchor=\"{anchor}\"") };
    let _ = write!(out, "<text{class}{anchor} x=\"{}\" y=\"{}\">{}</text>", coordinate(x), coordinate(y), escape(content));
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn strokes_add_up_to_their_points() {
        assert_eq!(stroke([(10.0, 20.0), (10.53, 19.96), (0.0, 20.0)]), "M10 20l.5 0l-10.5 0");
        assert_eq!(coordinate(-0.04), "0");
        assert_eq!(coordinate(-0.5), "-.5");
        assert_eq!(escape("a<b & \"c\"\u{1}\n'"), "a&lt;b &amp; &quot;c&quot;\u{fffd} &#39;");
    }
}
