//! A table's first column as bars.

use crate::table::Table;
use std::fmt::Write as _;

const ROW: f64 = 22.0;
const NAMES: f64 = 300.0;
const BARS: f64 = 420.0;
const HEAD: f64 = 34.0;

/// Bars of equal scale from 0, one per row; floors are grey.
pub(crate) fn bars(table: &Table) -> String {
    let rows: Vec<(&str, f64)> = table.firsts().filter(|(_, value)| value.is_finite()).collect();
    let most = rows.iter().map(|(_, value)| *value).fold(f64::MIN_POSITIVE, f64::max);
    let (width, height) = (NAMES + BARS + 80.0, HEAD + ROW * rows.len() as f64 + 8.0);
    // Writing to a String cannot fail.
    let mut svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width} {height}\" font-family=\"sans-serif\" font-size=\"13\">\n\
         <rect width=\"100%\" height=\"100%\" fill=\"#ffffff\"/>\n<text x=\"8\" y=\"21\" font-weight=\"bold\">{}: median, us</text>\n",
        escaped(table.heading())
    );
    for (index, (name, value)) in rows.iter().enumerate() {
        let (y, length) = (HEAD + ROW * index as f64, BARS * value / most);
        let colour = if name.starts_with("floor") { "#9a9a9a" } else { "#2f6f9f" };
        let _ = writeln!(
            svg,
            "<text x=\"{:.0}\" y=\"{:.0}\" text-anchor=\"end\">{}</text><rect x=\"{NAMES}\" y=\"{:.0}\" width=\"{length:.1}\" height=\"{:.0}\" \
             fill=\"{colour}\"/><text x=\"{:.1}\" y=\"{:.0}\">{value:.1}</text>",
            NAMES - 8.0,
            y + 15.0,
            escaped(name),
            y + 3.0,
            ROW - 6.0,
            NAMES + length + 6.0,
            y + 15.0
        );
    }
    svg + "</svg>\n"
}

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_measured_row_is_a_bar_as_long_as_its_time() {
        let mut table = Table::new("Network <a>, tight loop, us", &["p50", "p99"]);
        table.row("  floor: read once", &[10.0, 11.0]);
        table.row("    ours & theirs", &[20.0, 30.0]);
        table.row("not measured", &[f64::NAN, f64::NAN]);
        let svg = bars(&table);
        assert_eq!(svg.matches("<rect").count(), 1 + 2, "{svg}");
        assert!(svg.contains("Network &lt;a&gt;, tight loop: median") && svg.contains("ours &amp; theirs"), "{svg}");
        assert!(svg.contains("width=\"210.0\"") && svg.contains("width=\"420.0\""), "{svg}");
    }
}
