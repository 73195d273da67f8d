//! Small pieces of HTML; everything that comes from the report is escaped here.

use plot::figure::{Figure, escape, svg};

/// An element around text.
pub(super) fn text(tag: &str, class: &str, content: &str) -> String {
    around(tag, class, &escape(content))
}

/// An element around HTML.
pub(super) fn around(tag: &str, class: &str, content: &str) -> String {
    let class = if class.is_empty() { String::new() } else { format!(" class=\"{class}\"") };
    format!("<{tag}{class}>{content}</{tag}>")
}

/// A list of texts.
pub(super) fn list<T: AsRef<str>>(tag: &str, items: impl IntoIterator<Item = T>) -> String {
    let items: String = items.into_iter().map(|item| text("li", "", item.as_ref())).collect();
    if items.is_empty() { items } else { around(tag, "", &items) }
}

/// Widths of a figure on paper and telephones, and on large screens, px.
pub(super) const NARROW_PX: f64 = 340.0;
/// Half of the page.
pub(super) const HALF_PX: f64 = 480.0;
/// The whole of it.
pub(super) const WIDE_PX: f64 = 1000.0;

/// A figure in two widths.
pub(super) fn figure(draw: impl Fn(f64) -> Figure, wide_px: f64) -> String {
    let one = |class: &str, figure: &Figure| {
        let caption = if figure.caption.is_empty() { String::new() } else { text("figcaption", "", &figure.caption) };
        format!("<figure class=\"{class}\">{}{caption}</figure>", svg(figure))
    };
    // Paper is wide enough for the widest.
    let [wide, narrow] = if wide_px < WIDE_PX { ["wide", "narrow"] } else { ["wide full", "narrow full"] };
    one(wide, &draw(wide_px)) + &one(narrow, &draw(NARROW_PX))
}

/// Something folded.
pub(super) fn folded(summary: &str, content: &str) -> String {
    if content.is_empty() {
        return String::new();
    }
    format!("<details><summary>{}</summary>{content}</details>", escape(summary))
}

/// A section with a heading; nothing if it has no content.
pub(super) fn section(heading: &str, content: &str) -> String {
    if content.is_empty() { String::new() } else { format!("<section>{}{content}</section>", text("h2", "", heading)) }
}

/// A table: so many columns of words first, the others of numbers; nothing without rows.
pub(super) fn table(words: usize, header: &[&str], rows: Vec<Vec<String>>) -> String {
    if rows.is_empty() {
        return String::new();
    }
    plot::page::Block::Table(words, header.iter().map(|name| (*name).to_owned()).collect(), rows).html()
}
