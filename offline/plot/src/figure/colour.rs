//! Colours as classes of a style sheet, one set for light and one for dark. The hues are those of Okabe and Ito ("Color
//! universal design", 2008), made darker or lighter until they reach a contrast of 3 to 1 on their background; they stay apart
//! for the common kinds of colour blindness.

use std::fmt::Write;

/// A colour of lines and text; the style sheet says what it looks like.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Colour(u8);

impl Colour {
    /// For what stands behind: commands, references.
    pub const GREY: Self = Self(0);
    /// First choice.
    pub const BLUE: Self = Self(1);
    /// Second choice, farthest from blue.
    pub const VERMILLION: Self = Self(2);
    /// Third choice.
    pub const GREEN: Self = Self(3);
    /// Fourth choice.
    pub const PURPLE: Self = Self(4);
    /// Fifth choice.
    pub const ORANGE: Self = Self(5);
    /// Sixth choice.
    pub const SKY: Self = Self(6);
    /// Colour of the text.
    pub const INK: Self = Self(7);

    /// The choices in their order, again from the first after the last.
    pub fn choice(index: usize) -> Self {
        const CHOICES: [Colour; 6] = [Colour::BLUE, Colour::VERMILLION, Colour::GREEN, Colour::PURPLE, Colour::ORANGE, Colour::SKY];
        CHOICES[index % CHOICES.len()]
    }

    pub(super) fn number(self) -> u8 {
        self.0
    }
}

/// Levels of a heat map.
pub const HEAT_LEVELS: usize = 16;

/// Levels of a density in the background.
pub(super) const DENSITY_LEVELS: usize = 6;

struct Theme {
    paper: &'static str,
    ink: &'static str,
    muted: &'static str,
    grid: &'static str,
    axis: &'static str,
    colours: [&'static str; 8],
    /// Heat from nothing to most, as red, green, blue.
    heat: [[f64; 3]; 6],
}

static LIGHT: Theme = Theme {
    paper: "#ffffff",
    ink: "#1b2027",
    muted: "#5a6672",
    grid: "#e7eaee",
    axis: "#9aa4af",
    colours: ["#8b959f", "#0b69ad", "#cf4d18", "#00805a", "#a04c88", "#a86f00", "#2f8fc4", "#1b2027"],
    heat: [
        [238.0, 243.0, 247.0],
        [196.0, 219.0, 236.0],
        [125.0, 178.0, 214.0],
        [55.0, 131.0, 187.0],
        [18.0, 82.0, 141.0],
        [7.0, 36.0, 74.0],
    ],
};

static DARK: Theme = Theme {
    paper: "#14181d",
    ink: "#e8ebef",
    muted: "#9ca7b3",
    grid: "#272e37",
    axis: "#5b6672",
    colours: ["#8a95a1", "#58aef0", "#ff8a57", "#3cc799", "#e08fc8", "#eeb544", "#93d2f6", "#e8ebef"],
    heat: [
        [29.0, 37.0, 46.0],
        [31.0, 68.0, 104.0],
        [43.0, 117.0, 168.0],
        [88.0, 172.0, 211.0],
        [166.0, 218.0, 234.0],
        [243.0, 251.0, 253.0],
    ],
};

fn heat(theme: &Theme, level: usize) -> String {
    let place = level as f64 / (HEAT_LEVELS - 1) as f64 * (theme.heat.len() - 1) as f64;
    let low = (place.floor() as usize).min(theme.heat.len() - 2);
    let mix = |i: usize| (theme.heat[low][i] + (place - low as f64) * (theme.heat[low + 1][i] - theme.heat[low][i])).round() as u8;
    format!("#{:02x}{:02x}{:02x}", mix(0), mix(1), mix(2))
}

fn rules(theme: &Theme) -> String {
    let mut out = String::new();
    // Writing to a String cannot fail.
    let _ = write!(
        out,
        ".rp .paper{{fill:{}}}.rp text{{fill:{}}}.rp .muted{{fill:{}}}.rp .grid{{stroke:{}}}.rp .axis{{stroke:{}}}",
        theme.paper, theme.ink, theme.muted, theme.grid, theme.axis
    );
    for (i, colour) in theme.colours.iter().enumerate() {
        let _ = write!(out, ".rp .s{i}{{stroke:{colour}}}.rp .f{i}{{fill:{colour}}}");
    }
    for level in 0..HEAT_LEVELS {
        let _ = write!(out, ".rp .h{level}{{fill:{}}}", heat(theme, level));
    }
    for level in 0..DENSITY_LEVELS {
        let opacity = 0.05 + 0.30 * level as f64 / (DENSITY_LEVELS - 1) as f64;
        let _ = write!(out, ".rp .d{level}{{fill:{};fill-opacity:{opacity:.2}}}", theme.ink);
    }
    out
}

/// Style sheet of all figures; goes once into a page. Colours stand as they are, without variables, so that programs with
/// little CSS show them as well.
pub static STYLE: std::sync::LazyLock<String> = std::sync::LazyLock::new(|| {
    let fixed = ".rp text{font:12px system-ui,-apple-system,'Segoe UI',Roboto,'Helvetica Neue',Arial,sans-serif;\
        font-variant-numeric:tabular-nums}.rp .title{font-size:14px;font-weight:600}.rp .label{font-weight:600}\
        .rp .line{fill:none;stroke-width:1.4;stroke-linejoin:round;stroke-linecap:round}.rp .thin{stroke-width:1}\
        .rp .broad{stroke-width:3.2;stroke-opacity:.55}.rp .dashed{stroke-dasharray:5 4}.rp .band{fill-opacity:.16;stroke:none}\
        .rp .dots{fill-opacity:.35;stroke:none}.rp .few{fill-opacity:.6}.rp .steps{fill-opacity:.13;stroke-width:1.4}.rp .grid,.rp .axis{stroke-width:1;fill:none}";
    format!("{fixed}{}@media (prefers-color-scheme:dark){{{}}}", rules(&LIGHT), rules(&DARK))
});

/// Colours that a page around the figures needs: paper, ink, muted text, and lines; light and dark.
pub(crate) fn page_colours() -> [[&'static str; 5]; 2] {
    [&LIGHT, &DARK].map(|theme| [theme.paper, theme.ink, theme.muted, theme.grid, theme.colours[2]])
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Relative luminance of `#rrggbb` (WCAG 2.2).
    fn luminance(colour: &str) -> f64 {
        let part = |i: usize| {
            let value = f64::from(u8::from_str_radix(&colour[1 + 2 * i..3 + 2 * i], 16).expect("hexadecimal")) / 255.0;
            if value <= 0.040_45 { value / 12.92 } else { ((value + 0.055) / 1.055).powf(2.4) }
        };
        0.2126 * part(0) + 0.7152 * part(1) + 0.0722 * part(2)
    }

    fn contrast(a: &str, b: &str) -> f64 {
        let (a, b) = (luminance(a), luminance(b));
        (a.max(b) + 0.05) / (a.min(b) + 0.05)
    }

    #[test]
    fn lines_and_text_stand_out_on_their_paper() {
        for theme in [&LIGHT, &DARK] {
            assert!(contrast(theme.ink, theme.paper) > 12.0);
            assert!(contrast(theme.muted, theme.paper) > 4.5);
            for colour in theme.colours {
                assert!(contrast(colour, theme.paper) >= 3.0, "{colour} on {}: {}", theme.paper, contrast(colour, theme.paper));
            }
        }
    }

    #[test]
    fn heat_rises_in_one_direction() {
        for (theme, sign) in [(&LIGHT, -1.0), (&DARK, 1.0)] {
            let levels: Vec<f64> = (0..HEAT_LEVELS).map(|level| sign * luminance(&heat(theme, level))).collect();
            assert!(levels.windows(2).all(|pair| pair[1] > pair[0]), "{levels:?}");
        }
    }
}
