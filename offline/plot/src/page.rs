//! A page around figures: one HTML file without scripts and without anything from outside, well-formed as XML too. Readable on
//! a telephone and on paper, light and dark.

use std::fmt::Write;

use crate::figure::{self, Figure, escape};

/// What a page is made of.
#[derive(Debug, Clone)]
pub enum Block {
    /// A section heading.
    Heading(String),
    /// A paragraph.
    Text(String),
    /// Something that a reader must not overlook.
    Notice(String),
    /// Large figures with a name each.
    Tiles(Vec<(String, String)>),
    /// A table: so many columns of words first, the others of numbers; header, then rows.
    Table(usize, Vec<String>, Vec<Vec<String>>),
    /// Figures side by side where there is room.
    Figures(Vec<Figure>),
    /// One figure in two widths, the first for screens from 900 px, the second for smaller ones.
    Responsive(Box<[Figure; 2]>),
    /// Lines in a list.
    List(Vec<String>),
}

/// A page: title, a line below it, blocks.
#[derive(Debug, Clone, Default)]
pub struct Page {
    /// Title.
    pub title: String,
    /// Line below the title.
    pub subtitle: String,
    /// Blocks from top to bottom.
    pub blocks: Vec<Block>,
}

impl Page {
    /// The file.
    pub fn html(&self) -> String {
        let (title, subtitle) = (escape(&self.title), escape(&self.subtitle));
        let mut body = format!("<header><h1>{title}</h1><p class=\"sub\">{subtitle}</p></header>\n");
        for block in &self.blocks {
            body.push_str(&block.html());
            body.push('\n');
        }
        document(&self.title, "", &body)
    }

    /// All figures, titled with the section that they stand in; of those in two widths the first.
    pub fn figures(&self) -> Vec<Figure> {
        let (mut all, mut section) = (Vec::new(), "");
        for block in &self.blocks {
            match block {
                Block::Heading(heading) => section = heading,
                Block::Figures(figures) => all.extend(figures.iter().map(|figure| {
                    // "Joints: Joint 1" says nothing more than "Joint 1".
                    let said = figure.title.starts_with(section.trim_end_matches('s'));
                    let title = if said { figure.title.clone() } else { format!("{section}: {}", figure.title) };
                    Figure { title, ..figure.clone() }
                })),
                Block::Responsive(widths) => all.push(widths[0].clone()),
                _ => {}
            }
        }
        all
    }
}

/// A whole file around a body, which must be well-formed: with the style sheets of pages and figures, then a further one.
pub fn document(title: &str, further_style: &str, body: &str) -> String {
    format!(
        "<!DOCTYPE html>\n<html xmlns=\"http://www.w3.org/1999/xhtml\" lang=\"en\"><head><meta charset=\"utf-8\"/>\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\"/><meta name=\"color-scheme\" content=\"light dark\"/>\
         <title>{}</title><style>{}{}{further_style}</style></head>\n<body><main>{body}</main></body></html>\n",
        escape(title),
        style(),
        *figure::STYLE,
    )
}

/// Colours of a page, light and dark: paper, ink, muted text, lines, and one that warns, as CSS has them.
pub fn colours() -> [[&'static str; 5]; 2] {
    figure::page_colours()
}

impl Block {
    /// Its part of the page.
    pub fn html(&self) -> String {
        let mut out = String::new();
        write_block(&mut out, self);
        out
    }
}

// Writing to a String cannot fail, so results of `write!` are dropped in this file.
fn write_block(out: &mut String, block: &Block) {
    match block {
        Block::Heading(text) => {
            let _ = write!(out, "<h2>{}</h2>", escape(text));
        }
        Block::Text(text) => {
            let _ = write!(out, "<p>{}</p>", escape(text));
        }
        Block::Notice(text) => {
            let _ = write!(out, "<p class=\"notice\">{}</p>", escape(text));
        }
        Block::Tiles(tiles) => {
            let tile = |(name, value): &(String, String)| format!("<div><dt>{}</dt><dd>{}</dd></div>", escape(name), escape(value));
            let _ = write!(out, "<dl class=\"tiles\">{}</dl>", tiles.iter().map(tile).collect::<String>());
        }
        Block::Table(words, header, rows) => write_table(out, *words, header, rows),
        Block::Figures(figures) => {
            let _ = write!(out, "<div class=\"grid\">{}</div>", figures.iter().map(figure_block).collect::<String>());
        }
        Block::Responsive(widths) => {
            for (class, figure) in ["wide", "narrow"].into_iter().zip(widths.iter()) {
                let _ = write!(out, "<div class=\"{class}\">{}</div>", figure_block(figure));
            }
        }
        Block::List(lines) => {
            let item = |line: &String| format!("<li>{}</li>", escape(line));
            let _ = write!(out, "<ul>{}</ul>", lines.iter().map(item).collect::<String>());
        }
    }
}

fn figure_block(figure: &Figure) -> String {
    let caption =
        if figure.caption.is_empty() { String::new() } else { format!("<figcaption>{}</figcaption>", escape(&figure.caption)) };
    format!("<figure>{}{caption}</figure>", figure::svg(figure))
}

fn write_table(out: &mut String, words: usize, header: &[String], rows: &[Vec<String>]) {
    let cells = |tag: &str, cells: &[String]| {
        let cell = |(i, cell): (usize, &String)| {
            let class = if i < words { " class=\"word\"" } else { "" };
            format!("<{tag}{class}>{}</{tag}>", escape(cell))
        };
        cells.iter().enumerate().map(cell).collect::<String>()
    };
    let _ = write!(out, "<div class=\"table\"><table><thead><tr>{}</tr></thead><tbody>", cells("th", header));
    for row in rows {
        let _ = write!(out, "<tr>{}</tr>", cells("td", row));
    }
    out.push_str("</tbody></table></div>");
}

fn style() -> String {
    let theme = |[paper, ink, muted, grid, accent]: [&str; 5]| {
        format!(
            "body{{background:{paper};color:{ink}}}.sub,figcaption,dt,th{{color:{muted}}}h2{{border-color:{grid}}}.tiles div,td,th{{border-color:{grid}}}\
             .notice{{border-color:{accent}}}"
        )
    };
    let [light, dark] = figure::page_colours();
    format!(
        "*{{box-sizing:border-box}}body{{margin:0;font:15px/1.5 system-ui,-apple-system,'Segoe UI',Roboto,'Helvetica Neue',Arial,sans-serif}}\
         main{{max-width:1280px;margin:0 auto;padding:28px 24px 64px}}h1{{font-size:24px;line-height:1.25;margin:0;overflow-wrap:anywhere}}\
         h2{{font-size:18px;margin:44px 0 10px;padding-top:14px;border-top:1px solid}}p{{margin:8px 0;max-width:75ch}}.sub{{margin:4px 0 0}}\
         .notice{{border-left:3px solid;padding:2px 0 2px 12px}}.tiles{{display:grid;grid-template-columns:repeat(auto-fill,minmax(165px,1fr));\
         gap:10px;margin:20px 0}}.tiles div{{border:1px solid;border-radius:6px;padding:8px 12px}}dt{{font-size:12.5px}}dd{{margin:0;font-size:17px;\
         font-weight:600;font-variant-numeric:tabular-nums;overflow-wrap:anywhere}}.grid{{display:grid;\
         grid-template-columns:repeat(auto-fill,minmax(min(100%,360px),1fr));gap:30px 34px;margin:16px 0}}figure{{margin:0;min-width:0}}\
         figure>svg{{width:100%;height:auto;display:block;overflow:visible}}figcaption{{font-size:13px;line-height:1.45;margin-top:4px}}\
         .wide{{display:none;margin:16px 0}}.narrow{{margin:16px 0}}@media (min-width:900px){{.wide{{display:block}}.narrow{{display:none}}}}\
         .table{{overflow-x:auto;margin:14px 0}}table{{border-collapse:collapse;font-variant-numeric:tabular-nums;font-size:14px}}\
         th,td{{text-align:right;padding:4px 14px 4px 0;border-bottom:1px solid;white-space:nowrap}}th{{font-weight:500}}\
         .word{{text-align:left}}ul{{padding-left:20px;max-width:80ch}}li{{margin:3px 0;overflow-wrap:anywhere}}\
         @media print{{.wide{{display:none}}.narrow{{display:block}}figure{{break-inside:avoid}}}}{}@media (prefers-color-scheme:dark){{{}}}",
        theme(light),
        theme(dark)
    )
}
