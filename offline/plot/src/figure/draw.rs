//! From figures to SVG.

use std::fmt::Write;

use super::colour::{DENSITY_LEVELS, HEAT_LEVELS, STYLE};
use super::layout::{self, LABEL_CHARACTERS, LINE, Layout, NAME_CHARACTERS, Place, shortened, text_width, titled, wrapped};
use super::legend::colour_bar;
use super::scale::{Axis, Ticks};
use super::xml::{coordinate, escape, stroke, text};
use super::{Cells, Colour, Figure, Mark, Ramp};

/// One figure, to be put into a page that has [`STYLE`]. It grows with the page; its height follows.
pub fn svg(figure: &Figure) -> String {
    let (body, height) = drawn(figure);
    let size = format!("viewBox=\"0 0 {} {}\"", coordinate(figure.width_px), coordinate(height));
    let (title, caption) = (escape(&figure.title), escape(&figure.caption));
    format!("<svg class=\"rp\" {size} role=\"img\" aria-label=\"{title}\"><title>{title}</title><desc>{caption}</desc>{body}</svg>")
}

/// Figures in rows, with their captions, as an SVG file of its own.
pub fn svg_document(figures: &[Figure]) -> String {
    const EDGE: f64 = 28.0;
    let widest = figures.iter().map(|figure| figure.width_px).fold(200.0, f64::max);
    let (mut parts, mut left, mut top, mut row_height) = (String::new(), 0.0, EDGE, 0.0_f64);
    for figure in figures {
        if left + figure.width_px > widest {
            (left, top, row_height) = (0.0, top + row_height + EDGE, 0.0);
        }
        let (body, height) = drawn(figure);
        let _ = write!(parts, "<g transform=\"translate({} {})\">{body}", coordinate(left + EDGE), coordinate(top));
        let lines = wrapped(&figure.caption, (figure.width_px / layout::CHARACTER) as usize);
        for (i, line) in lines.iter().enumerate() {
            text(&mut parts, "muted", "start", 0.0, height + LINE * (i as f64 + 0.75), line);
        }
        parts.push_str("</g>");
        left += figure.width_px + EDGE;
        row_height = row_height.max(height + LINE * lines.len() as f64);
    }
    let (w, h) = (coordinate(widest + 2.0 * EDGE), coordinate(top + row_height + EDGE));
    format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" class=\"rp\" width=\"{w}\" height=\"{h}\" viewBox=\"0 0 {w} {h}\"><style>{}</style>\
         <rect class=\"paper\" width=\"100%\" height=\"100%\"/>{parts}</svg>",
        *STYLE
    )
}

/// The title of an axis, with the power of ten that its labels leave out.
fn axis_title(axis: &Axis, exponent: i32) -> String {
    if exponent == 0 {
        return axis.title.clone();
    }
    let digit = |c: char| match c {
        '-' => '⁻',
        c => "⁰¹²³⁴⁵⁶⁷⁸⁹".chars().nth(c as usize - '0' as usize).unwrap_or(c),
    };
    format!("{} ×10{}", axis.title, exponent.to_string().chars().map(digit).collect::<String>())
}

/// Body and height.
fn drawn(figure: &Figure) -> (String, f64) {
    let layout = Layout::new(figure);
    let mut out = String::new();
    for (i, line) in titled(&figure.title, figure.width_px).iter().enumerate() {
        text(&mut out, "title", "start", 0.0, 14.0 + 18.0 * i as f64, line);
    }
    for place in &layout.places {
        panel(&mut out, figure, &layout, place);
    }
    if let Some(last) = layout.places.last() {
        x_axis(&mut out, figure, &layout, last.top + last.height);
    }
    (out, layout.height)
}

fn x_axis(out: &mut String, figure: &Figure, layout: &Layout<'_>, bottom: f64) {
    let mut free = f64::NEG_INFINITY;
    for (value, label) in labels_of(&figure.x, &layout.x_ticks) {
        // The outermost labels stay inside.
        let half = 0.5 * text_width(label);
        let at = (layout.left + layout.x(value)).clamp(half.min(layout.left), figure.width_px - half);
        if figure.x.names.is_empty() || at - half >= free {
            text(out, "muted", "middle", at, bottom + 15.0, label);
            free = at + half + 8.0;
        }
    }
    let exponent = if figure.x.names.is_empty() { layout.x_ticks.exponent } else { 0 };
    let title = shortened(&axis_title(&figure.x, exponent), (figure.width_px / layout::CHARACTER) as usize);
    let half = 0.5 * text_width(&title);
    let at = (layout.left + 0.5 * layout.width).min(figure.width_px - half).max(half);
    text(out, "muted", "middle", at, bottom + 31.0, &title);
}

/// What stands along an axis: names if it has any, otherwise round numbers.
fn labels_of<'a>(axis: &'a Axis, ticks: &'a Ticks) -> Vec<(f64, &'a String)> {
    let named = axis.names.iter().map(|(value, name)| (*value, name));
    let numbered = ticks.values.iter().copied().zip(&ticks.labels);
    if axis.names.is_empty() { numbered.collect() } else { named.collect() }
}

fn panel(out: &mut String, figure: &Figure, layout: &Layout<'_>, place: &Place<'_>) {
    let (left, right) = (layout.left, layout.left + layout.width);
    let exponent = if place.panel.y.names.is_empty() { place.ticks.exponent } else { 0 };
    let taken = place.panel.note.as_ref().map_or(0.0, |note| text_width(note) + 12.0) + figure.width_px - right;
    let room = if place.panel.marks.iter().any(|mark| mark.bar().is_some()) { f64::INFINITY } else { figure.width_px - taken };
    let title = shortened(&axis_title(&place.panel.y, exponent), (room / layout::CHARACTER) as usize);
    text(out, "muted", "start", 0.0, place.top - 10.0, &title);
    let mut end = right;
    if let Some((_, bar_title)) = place.panel.marks.iter().find_map(Mark::bar) {
        text(out, "muted", "end", figure.width_px, place.top - 10.0, bar_title);
        end = figure.width_px - text_width(bar_title) - 12.0;
    }
    if let Some(note) = &place.panel.note {
        text(out, "muted", "end", end, place.top - 10.0, note);
    }
    grid(out, &figure.x, layout, place);
    let (x, y) = (coordinate(left), coordinate(place.top));
    let (w, h) = (coordinate(layout.width), coordinate(place.height));
    // A nested drawing cuts off what lies outside a fixed range.
    let _ = write!(out, "<svg x=\"{x}\" y=\"{y}\" width=\"{w}\" height=\"{h}\">");
    for mark in &place.panel.marks {
        draw(out, layout, place, mark);
    }
    out.push_str("</svg>");
    if place.panel.marks.iter().all(is_empty) {
        text(out, "muted", "middle", left + 0.5 * layout.width, place.top + 0.5 * place.height + 4.0, "no data");
    }
    labels(out, layout, place);
    if let Some((cells, _)) = place.panel.marks.iter().find_map(Mark::bar) {
        colour_bar(out, layout, place, cells);
    }
}

fn is_empty(mark: &Mark) -> bool {
    match mark {
        Mark::Rule { .. } => true,
        Mark::Cells { cells, .. } => cells.values.iter().all(|value| value.is_nan()),
        Mark::Steps { histogram, .. } => histogram.counts.iter().all(|count| *count == 0),
        mark => mark.extent().0.0 > mark.extent().0.1,
    }
}

fn grid(out: &mut String, x_axis: &Axis, layout: &Layout<'_>, place: &Place<'_>) {
    let (left, width, bottom) = (layout.left, layout.width, place.top + place.height);
    let mut lines = String::new();
    let characters = if place.panel.y.names.is_empty() { 8 } else { NAME_CHARACTERS };
    for (value, label) in labels_of(&place.panel.y, &place.ticks) {
        let y = place.top + place.y(value);
        let _ = write!(lines, "M{} {}h{}", coordinate(left), coordinate(y), coordinate(width));
        text(out, "muted", "end", left - 6.0, y + 4.0, &shortened(label, characters));
    }
    for (value, _) in labels_of(x_axis, &layout.x_ticks) {
        let x = left + layout.x(value);
        let _ = write!(lines, "M{} {}v{}", coordinate(x), coordinate(place.top), coordinate(place.height));
    }
    let _ = write!(out, "<path class=\"grid\" d=\"{lines}\"/>");
    let _ = write!(out, "<path class=\"axis\" d=\"M{} {}h{}\"/>", coordinate(left), coordinate(bottom), coordinate(width));
}

fn draw(out: &mut String, layout: &Layout<'_>, place: &Place<'_>, mark: &Mark) {
    let at = |point: &(f64, f64)| (layout.x(point.0), place.y(point.1));
    match mark {
        Mark::Line { colour, strokes, style, .. } => {
            let path: String = strokes.iter().map(|points| stroke(visible(points).iter().map(at))).collect();
            let style = if style.is_empty() { String::new() } else { format!(" {style}") };
            let _ = write!(out, "<path class=\"line s{}{style}\" d=\"{path}\"/>", colour.number());
        }
        Mark::Band { colour, points } => {
            let upper = points.iter().map(|(x, _, high)| (*x, *high));
            let lower = points.iter().rev().map(|(x, low, _)| (*x, *low));
            let path = stroke(upper.chain(lower).map(|point| at(&point)));
            if !path.is_empty() {
                let _ = write!(out, "<path class=\"band f{}\" d=\"{path}z\"/>", colour.number());
            }
        }
        Mark::Dots { colour, points } => dots(out, *colour, points.iter().map(at)),
        Mark::Steps { colour, histogram, .. } => {
            let edge = |i: usize| layout.x(histogram.low + histogram.width * i as f64);
            let height = |count: &u64| place.y(*count as f64);
            let steps =
                histogram.counts.iter().enumerate().flat_map(|(i, count)| [(edge(i), height(count)), (edge(i + 1), height(count))]);
            let ends = [(edge(0), place.y(0.0)), (edge(histogram.counts.len()), place.y(0.0))];
            let path = stroke([ends[0]].into_iter().chain(steps).chain([ends[1]]));
            let _ = write!(out, "<path class=\"steps s{0} f{0}\" d=\"{path}\"/>", colour.number());
        }
        Mark::Cells { cells, ramp, .. } => paint(out, layout, place, cells, *ramp),
        Mark::Rule { y } => {
            let _ = write!(out, "<path class=\"axis\" d=\"M0 {}h{}\"/>", coordinate(place.y(*y)), coordinate(layout.width));
        }
    }
}

/// Below so many, dots are drawn larger.
const FEW_DOTS: usize = 400;

/// A single point becomes a stroke too short to have a direction but long enough for its round cap to be seen.
fn visible(points: &[(f64, f64)]) -> Vec<(f64, f64)> {
    if points.len() == 1 { vec![points[0], points[0]] } else { points.to_vec() }
}

fn dots(out: &mut String, colour: Colour, points: impl Iterator<Item = (f64, f64)>) {
    // A few are larger and denser, so that each is seen; many show by their number.
    let points: Vec<(f64, f64)> = points.collect();
    let (side, class) = if points.len() < FEW_DOTS { (3.6, "dots few") } else { (2.0, "dots") };
    let mut path = String::new();
    for (x, y) in &points {
        let (x, y) = (coordinate(x - 0.5 * side), coordinate(y - 0.5 * side));
        let _ = write!(path, "M{x} {y}h{side}v{side}h-{side}z");
    }
    if !path.is_empty() {
        let _ = write!(out, "<path class=\"{class} f{}\" d=\"{path}\"/>", colour.number());
    }
}

/// Level of a value between the least and the greatest.
fn level(value: f64, (low, high): (f64, f64), levels: usize) -> usize {
    let share = if high > low { (value - low) / (high - low) } else { 0.5 };
    ((share * levels as f64) as usize).min(levels - 1)
}

fn paint(out: &mut String, layout: &Layout<'_>, place: &Place<'_>, cells: &Cells, ramp: Ramp) {
    let (low, high) = cells.range();
    let (letter, levels) = if ramp == Ramp::Density { ('d', DENSITY_LEVELS) } else { ('h', HEAT_LEVELS) };
    let of = |value: f64| match ramp {
        Ramp::Ratio { most } => level(value.max(1.0).ln(), (0.0, most.max(1.0 + 1e-9).ln()), levels),
        Ramp::Heat => level(value, (low, high), levels),
        Ramp::Density => level(value.ln(), (low.ln(), high.ln()), levels),
    };
    // Whole numbers in the grid's own coordinates, equal neighbours as one: half the size of px.
    let mut paths = vec![String::new(); levels];
    for (row, values) in cells.values.chunks(cells.columns.max(1)).enumerate() {
        let mut column = 0;
        while column < values.len() {
            let shade = values[column].is_finite().then(|| of(values[column]));
            let run = values[column..].iter().take_while(|value| value.is_finite().then(|| of(**value)) == shade).count();
            if let Some(shade) = shade {
                let _ = write!(paths[shade], "M{column} {row}h{run}v1h-{run}z");
            }
            column += run;
        }
    }
    let (left, bottom) = (layout.x(cells.x.0), place.y(cells.y.0));
    let width = (layout.x(cells.x.1) - left) / cells.columns.max(1) as f64;
    let height = (bottom - place.y(cells.y.1)) / cells.rows().max(1) as f64;
    let _ = write!(
        out,
        "<g transform=\"translate({left:.2} {bottom:.2}) scale({width:.4} -{height:.4})\" shape-rendering=\"crispEdges\">"
    );
    for (i, path) in paths.iter().enumerate().filter(|(_, path)| !path.is_empty()) {
        let _ = write!(out, "<path class=\"{letter}{i}\" d=\"{path}\"/>");
    }
    out.push_str("</g>");
}

/// Names beside the ends of their lines, moved apart where they would touch.
fn labels(out: &mut String, layout: &Layout<'_>, place: &Place<'_>) {
    const APART: f64 = 14.0;
    let named = place.panel.marks.iter().filter(|mark| !is_empty(mark));
    let mut wanted: Vec<(usize, (f64, &str, Colour))> = Vec::new();
    for mark in named {
        if let Some((name, colour)) = mark.label() {
            let y = mark.end().map_or(8.0 + APART * wanted.len() as f64, |value| place.y(value).clamp(4.0, place.height));
            wanted.push((wanted.len(), (y, name, colour)));
        }
    }
    wanted.sort_by(|a, b| a.1.0.total_cmp(&b.1.0));
    let heights = apart(&wanted.iter().map(|(_, label)| label.0).collect::<Vec<_>>(), APART, place.height);
    // Labels that crowd together stand in the order of their marks, which is the same in every figure.
    let mut from = 0;
    for until in 1..=wanted.len() {
        if until == wanted.len() || wanted[until].1.0 - wanted[until - 1].1.0 > APART {
            wanted[from..until].sort_by_key(|(order, _)| *order);
            from = until;
        }
    }
    for (y, (_, (_, name, colour))) in heights.into_iter().zip(wanted) {
        let class = format!("label f{}", colour.number());
        text(out, &class, "start", layout.left + layout.width + 6.0, place.top + y + 4.0, &shortened(name, LABEL_CHARACTERS));
    }
}

/// Rising heights moved at least `distance` apart, as little as possible, and above `bottom` if there is room.
fn apart(wanted: &[f64], distance: f64, bottom: f64) -> Vec<f64> {
    let mut heights = wanted.to_vec();
    for i in 1..heights.len() {
        heights[i] = heights[i].max(heights[i - 1] + distance);
    }
    let over = heights.last().map_or(0.0, |last| (last - bottom).max(0.0));
    let mut limit = f64::INFINITY;
    for height in heights.iter_mut().rev() {
        *height = if over > 0.0 { height.min(limit).min(bottom) } else { *height };
        limit = *height - distance;
    }
    heights
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn labels_move_apart_and_stay_inside() {
        assert_eq!(apart(&[10.0, 50.0], 14.0, 100.0), [10.0, 50.0]);
        assert_eq!(apart(&[10.0, 12.0, 13.0], 14.0, 100.0), [10.0, 24.0, 38.0]);
        assert_eq!(apart(&[95.0, 96.0, 97.0], 14.0, 100.0), [72.0, 86.0, 100.0]);
    }
}
