//! One page without scripts or anything from elsewhere.

use crate::markdown::{opening, tables};
use crate::score::Score;
use crate::vocabulary::spoken;
use std::fmt::Write;

const STYLE: &str = "body{font:15px/1.45 system-ui,sans-serif;margin:2rem auto;max-width:80rem;padding:0 1rem;color:#222}\
table{border-collapse:collapse;margin:.6rem 0 1.6rem;font-size:13px}th,td{border-bottom:1px solid #ddd;padding:.25rem .5rem;text-align:left;vertical-align:top}\
th{border-bottom:2px solid #888}.wide{overflow-x:auto}.met{color:#16653a}.missed{color:#a11a1a;font-weight:600}p.note{color:#555}\
.names td{text-align:center;min-width:1.4rem}.names th.up{writing-mode:vertical-rl;transform:rotate(180deg);font-weight:400;border:0}.names th.left{text-align:right;font-weight:400}";

fn escape(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;")
}

/// The page.
pub fn page(score: &Score) -> String {
    let mut out = format!(
        "<!doctype html><html lang=\"en\"><meta charset=\"utf-8\"><title>Concealed-truth trial</title><style>{STYLE}</style>\n<h1>Concealed-truth trial</h1>\n<p>{}</p>\n",
        escape(&opening(score))
    );
    for table in tables(score) {
        let _ = write!(out, "<h2>{}</h2>\n<p class=\"note\">{}</p>\n", escape(&table.title), escape(&table.note));
        if table.title.starts_with("Stated") {
            out.push_str(&curve(score));
        }
        out.push_str("<div class=\"wide\"><table><tr>");
        for head in &table.head {
            let _ = write!(out, "<th>{}</th>", escape(head));
        }
        out.push_str("</tr>\n");
        for row in &table.rows {
            out.push_str("<tr>");
            for cell in row {
                let class = if cell == "met" || cell == "missed" { format!(" class=\"{cell}\"") } else { String::new() };
                let _ = write!(out, "<td{class}>{}</td>", escape(cell));
            }
            out.push_str("</tr>\n");
        }
        out.push_str("</table></div>\n");
    }
    out.push_str(&names(score));
    out.push_str("</html>\n");
    out
}

/// Stated against observed, with intervals.
fn curve(score: &Score) -> String {
    let (size, edge) = (300.0, 40.0);
    let at = |x: f64, y: f64| (edge + x * size, edge + (1.0 - y) * size);
    let mut out = format!(
        "<svg width=\"{0}\" height=\"{0}\" role=\"img\" aria-label=\"stated and observed probability\" font-size=\"11\" font-family=\"sans-serif\">",
        size + 2.0 * edge
    );
    for tenth in 0..=5 {
        let share = f64::from(tenth) / 5.0;
        let ((x0, y), (x1, _)) = (at(0.0, share), at(1.0, share));
        let (x, bottom) = at(share, 0.0);
        let _ = write!(
            out,
            "<path d=\"M{x0:.1} {y:.1}H{x1:.1}\" stroke=\"#e3e3e3\"/><text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"end\">{share:.1}</text><text x=\"{x:.1}\" y=\"{:.1}\" text-anchor=\"middle\">{share:.1}</text>",
            x0 - 5.0,
            y + 4.0,
            bottom + 15.0
        );
    }
    let ((x0, y0), (x1, y1)) = (at(0.0, 0.0), at(1.0, 1.0));
    let _ = write!(out, "<path d=\"M{x0:.1} {y0:.1}L{x1:.1} {y1:.1}\" stroke=\"#999\" stroke-dasharray=\"4 3\"/>");
    for bin in &score.calibration {
        let ((x, low), (_, high)) = (at(bin.stated, bin.right.ci95[0]), at(bin.stated, bin.right.ci95[1]));
        let (_, y) = at(bin.stated, bin.right.share);
        let _ = write!(
            out,
            "<path d=\"M{x:.1} {low:.1}V{high:.1}\" stroke=\"#2a5db0\"/><circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"4\" fill=\"#2a5db0\"><title>{} of {}</title></circle>",
            bin.right.hits, bin.right.of
        );
    }
    let _ = writeln!(
        out,
        "<text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"middle\">stated probability</text><text x=\"12\" y=\"{:.1}\" transform=\"rotate(-90 12 {:.1})\" text-anchor=\"middle\">share that was right</text></svg>",
        edge + size / 2.0,
        size + edge + 32.0,
        edge + size / 2.0,
        edge + size / 2.0
    );
    out
}

/// The confusion matrix, shaded by share of the row.
fn names(score: &Score) -> String {
    let mut out = String::from(
        "<h2>Names given</h2>\n<p class=\"note\">Truth in rows, first name of the answer in columns; cases of at most one effect.</p>\n",
    );
    out.push_str("<div class=\"wide\"><table class=\"names\"><tr><th></th>");
    for name in &score.confusion.names {
        let _ = write!(out, "<th class=\"up\">{}</th>", spoken(name));
    }
    out.push_str("</tr>\n");
    for (k, (name, counts)) in score.confusion.names.iter().zip(&score.confusion.counts).enumerate() {
        let total = counts.iter().sum::<usize>().max(1);
        let _ = write!(out, "<tr><th class=\"left\">{}</th>", spoken(name));
        for (j, &count) in counts.iter().enumerate() {
            let share = count as f64 / total as f64;
            let colour = if j == k { "34,120,70" } else { "190,40,40" };
            let text = if count == 0 { String::new() } else { count.to_string() };
            let _ = write!(out, "<td style=\"background:rgba({colour},{share:.2})\">{text}</td>");
        }
        out.push_str("</tr>\n");
    }
    let _ = writeln!(
        out,
        "</table></div>\n<p class=\"note\">{} cases have no column (no report, or a name outside the vocabulary).</p>",
        score.confusion.elsewhere
    );
    out
}
