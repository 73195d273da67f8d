//! Where everything of a figure goes, in px.

use super::scale::{Ticks, ticks};
use super::{Figure, Mark, Panel};

/// Room left of the drawing areas at most, for the labels of the ticks.
pub(super) const MARGIN_LEFT_MAX: f64 = 56.0;
/// Room right of them at least.
pub(super) const MARGIN_RIGHT_MIN: f64 = 14.0;
/// Height of a line of text.
pub(super) const LINE: f64 = 16.0;
/// Mean width of a character of 12 px text, and of bold 14 px text.
pub(super) const CHARACTER: f64 = 7.0;
pub(super) const CHARACTER_TITLE: f64 = 8.6;
/// Width of a colour bar and its distance from the panel.
pub(super) const BAR: f64 = 10.0;
const BAR_GAP: f64 = 10.0;
/// Characters of a name beside a vertical axis at most.
pub(super) const NAME_CHARACTERS: usize = 14;
/// Characters of a label beside a line at most.
pub(super) const LABEL_CHARACTERS: usize = 16;

/// A panel in its place.
pub(super) struct Place<'a> {
    pub(super) panel: &'a Panel,
    /// Upper edge of the drawing area.
    pub(super) top: f64,
    pub(super) height: f64,
    pub(super) range: (f64, f64),
    pub(super) ticks: Ticks,
}

/// A figure in its places.
pub(super) struct Layout<'a> {
    pub(super) left: f64,
    /// Width of the drawing areas.
    pub(super) width: f64,
    pub(super) x_range: (f64, f64),
    pub(super) x_ticks: Ticks,
    pub(super) places: Vec<Place<'a>>,
    /// Height of the whole figure.
    pub(super) height: f64,
}

/// Width of a text of 12 px.
pub(super) fn text_width(text: &str) -> f64 {
    text.chars().count() as f64 * CHARACTER
}

/// Cuts a text to so many characters.
pub(super) fn shortened(text: &str, characters: usize) -> String {
    if text.chars().count() <= characters {
        return text.to_owned();
    }
    text.chars().take(characters.saturating_sub(1)).chain(['…']).collect()
}

impl<'a> Layout<'a> {
    pub(super) fn new(figure: &'a Figure) -> Self {
        let title_lines = titled(&figure.title, figure.width_px).len() as f64;
        let mut top = title_lines * 18.0 + 6.0;
        let mut places = Vec::new();
        for panel in &figure.panels {
            top += LINE + 7.0;
            let data = union(panel.marks.iter().map(|mark| mark.extent().1));
            let room = if panel.marks.iter().any(|mark| matches!(mark, Mark::Cells { .. })) { 0.0 } else { 0.06 };
            let range = panel.y.span(data, room);
            let most = (panel.height_px / 22.0).clamp(3.0, 7.0) as usize;
            places.push(Place { panel, top, height: panel.height_px, range, ticks: ticks(range.0, range.1, most) });
            top += panel.height_px + 8.0;
        }
        let numbers = places.iter().filter(|place| place.panel.y.names.is_empty()).flat_map(|place| &place.ticks.labels);
        let number_room = (numbers.map(|label| text_width(label)).fold(16.0, f64::max) + 9.0).min(MARGIN_LEFT_MAX);
        let names = figure.panels.iter().flat_map(|panel| &panel.y.names);
        let name_room = names.map(|(_, name)| text_width(&shortened(name, NAME_CHARACTERS)) + 9.0);
        let left = name_room.fold(number_room, f64::max);
        let width = (figure.width_px - left - margin_right(figure)).max(40.0);
        let data = union(figure.panels.iter().flat_map(|panel| panel.marks.iter().map(|mark| mark.extent().0)));
        let x_range = figure.x.span(data, 0.0);
        let x_ticks = fitting_ticks(x_range, width);
        Self { left, width, x_range, x_ticks, places, height: top + 2.0 * LINE + 4.0 }
    }

    /// px from the left edge of the drawing areas.
    pub(super) fn x(&self, value: f64) -> f64 {
        (value - self.x_range.0) / (self.x_range.1 - self.x_range.0) * self.width
    }
}

impl Place<'_> {
    /// px from the upper edge of the drawing area.
    pub(super) fn y(&self, value: f64) -> f64 {
        (self.range.1 - value) / (self.range.1 - self.range.0) * self.height
    }
}

/// So many ticks that their labels do not touch.
fn fitting_ticks(range: (f64, f64), width: f64) -> Ticks {
    for most in (2..=((width / 60.0) as usize).max(2)).rev() {
        let ticks = ticks(range.0, range.1, most);
        let room = width / (ticks.values.len().max(2) as f64 - 1.0);
        if ticks.labels.iter().all(|label| text_width(label) + 14.0 <= room) {
            return ticks;
        }
    }
    ticks(range.0, range.1, 2)
}

fn union(extents: impl Iterator<Item = (f64, f64)>) -> (f64, f64) {
    extents.fold((f64::INFINITY, f64::NEG_INFINITY), |all, one| (all.0.min(one.0), all.1.max(one.1)))
}

fn margin_right(figure: &Figure) -> f64 {
    let marks = || figure.panels.iter().flat_map(|panel| panel.marks.iter());
    let names = marks().filter_map(|mark| mark.label()).map(|(name, _)| text_width(&shortened(name, LABEL_CHARACTERS)) * 1.2 + 8.0);
    let bars = marks().filter_map(Mark::bar).map(|(cells, _)| {
        let (low, high) = cells.range();
        let labels = ticks(low, high, 5).labels;
        BAR_GAP + BAR + 6.0 + labels.iter().map(|label| text_width(label)).fold(14.0, f64::max)
    });
    names.chain(bars).fold(MARGIN_RIGHT_MIN, f64::max)
}

/// Left edge of the colour bar, from the left edge of the figure.
pub(super) fn bar_left(layout: &Layout<'_>) -> f64 {
    layout.left + layout.width + BAR_GAP
}

/// A title in lines that fit.
pub(super) fn titled(title: &str, width: f64) -> Vec<String> {
    wrapped(title, (width / CHARACTER_TITLE) as usize)
}

/// Text in lines of so many characters, broken at spaces; a longer word is cut.
pub(super) fn wrapped(text: &str, characters: usize) -> Vec<String> {
    let characters = characters.max(8);
    let mut lines: Vec<String> = Vec::new();
    for word in text.split_whitespace() {
        let word = shortened(word, characters);
        match lines.last_mut() {
            Some(line) if line.chars().count() + 1 + word.chars().count() <= characters => {
                line.push(' ');
                line.push_str(&word);
            }
            _ => lines.push(word),
        }
    }
    lines
}
