//! For people.

use std::fmt::{self, Display, Formatter};

use super::{Channel, Description, Stream, Timing};

/// Columns of a terminal that are used.
const WIDTH: usize = 96;

/// Longest name and unit that are shown whole.
const NAME_MAX: usize = 28;
const UNIT_MAX: usize = 13;

impl Display for Description {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        writeln!(f, "{}: {}, {}", plain(&self.file), self.format, Size(self.bytes))?;
        for (key, value) in &self.metadata {
            paragraph(f, &format!("  {} = ", plain(key)), &plain(value), " ")?;
        }
        for topic in &self.topics {
            let note = if topic.is_read { "" } else { ", passed over" };
            writeln!(f, "  topic {} ({}): {} messages{note}", plain(&topic.name), plain(&topic.type_name), topic.messages)?;
        }
        self.streams.iter().try_for_each(|stream| show_stream(f, stream))?;
        self.show_robot(f)?;
        self.show_channels(f)?;
        for finding in &self.findings {
            paragraph(f, "note: ", &plain(finding), " ")?;
        }
        match &self.damage {
            Some(damage) => {
                let lead = format!("DAMAGED at {}: ", damage.place);
                paragraph(f, &lead, &format!("{}; what is told above stands before", plain(&damage.what)), " ")
            }
            None => Ok(()),
        }
    }
}

impl Description {
    /// What the robot did: runlevels, standstill, saturation, truth.
    fn show_robot(&self, f: &mut Formatter<'_>) -> fmt::Result {
        let rows = self.streams.first().map_or(0, |stream| stream.count);
        if self.repeated_rows > 0 {
            let percent = Percent(super::share(self.repeated_rows, rows));
            writeln!(f, "repeated: {} rows ({percent}) differ from the row before in their time only", self.repeated_rows)?;
        }
        if !self.runlevels.is_empty() {
            let shares: Vec<String> = self
                .runlevels
                .iter()
                .map(|level| {
                    let name = level.runlevel.map_or("others".to_owned(), |runlevel| runlevel.to_string());
                    format!("{name} {}", Percent(level.share))
                })
                .collect();
            paragraph(f, "runlevel: ", &shares.join(", "), ", ")?;
        }
        for still in &self.standstill {
            let arm = if still.arm.is_empty() { String::new() } else { format!(" {}", still.arm) };
            let share = Percent(still.share);
            writeln!(f, "standstill{arm}: {share} of the rows, {} at a stretch ({})", still.longest_rows, still.rule)?;
        }
        let saturated: Vec<String> = self
            .saturation
            .iter()
            .filter(|channel| channel.share > 0.0 || channel.at_extreme_share > 0.01)
            .map(|channel| {
                let (at_limit, extreme) = (Percent(channel.share), Percent(channel.at_extreme_share));
                format!("{} {at_limit} at +-{}, {extreme} at its extremes", plain(&channel.channel), channel.limit_counts)
            })
            .collect();
        if !self.saturation.is_empty() {
            let text = if saturated.is_empty() { "none".to_owned() } else { saturated.join("; ") };
            paragraph(f, "saturation: ", &text, "; ")?;
        }
        for truth in &self.truth {
            let arm = if truth.arm.is_empty() { String::new() } else { format!(" {}", truth.arm) };
            let shares = [truth.position_share, truth.rotation_share, truth.joints_share].map(Percent);
            writeln!(f, "truth{arm}: position {}, rotation {}, joints {} of the rows", shares[0], shares[1], shares[2])?;
        }
        Ok(())
    }

    fn show_channels(&self, f: &mut Formatter<'_>) -> fmt::Result {
        let (constant, varying): (Vec<&Channel>, Vec<&Channel>) =
            self.channels.iter().partition(|channel| channel.constant && channel.words.is_empty());
        let name_width = varying.iter().map(|channel| channel.name.chars().count().min(NAME_MAX)).max().unwrap_or(0).max(7);
        let unit_width = varying.iter().map(|channel| channel.unit.len().min(UNIT_MAX)).max().unwrap_or(0).max(4);
        if !varying.is_empty() {
            let heads = ["min", "max", "first", "last"].map(|head| format!("{head:>11}")).concat();
            writeln!(f, "{:name_width$} {:unit_width$}{heads}  missing", "channel", "unit")?;
        }
        for channel in varying {
            let (name, unit) = (clipped(&channel.name, NAME_MAX), clipped(&channel.unit, UNIT_MAX));
            write!(f, "{name:name_width$} {unit:unit_width$}")?;
            show_cells(f, channel)?;
        }
        if !constant.is_empty() {
            let names: Vec<String> = constant.iter().map(|channel| show_constant(channel)).collect();
            paragraph(f, &format!("constant ({}): ", constant.len()), &names.join(", "), ", ")?;
        }
        Ok(())
    }
}

fn show_cells(f: &mut Formatter<'_>, channel: &Channel) -> fmt::Result {
    if channel.words.is_empty() {
        for number in [channel.min, channel.max, channel.first, channel.last] {
            write!(f, "{:>11}", number.map_or("-".to_owned(), short))?;
        }
    } else {
        let words: Vec<String> =
            channel.words.iter().take(3).map(|word| format!("{} {}x", clipped(&word.text, 12), word.count)).collect();
        let more = if channel.words.len() > 3 { ", ..." } else { "" };
        write!(f, "  {:<42}", format!("{}{more}", words.join(", ")))?;
    }
    if channel.missing > 0 {
        write!(f, "  {} ({})", channel.missing, Percent(super::share(channel.missing, channel.missing + channel.count)))?;
    }
    if channel.infinite > 0 {
        write!(f, "  {} infinite", channel.infinite)?;
    }
    writeln!(f)
}

fn show_constant(channel: &Channel) -> String {
    format!("{} {}", plain(&channel.name), channel.first.map_or("-".to_owned(), short))
}

fn show_stream(f: &mut Formatter<'_>, stream: &Stream) -> fmt::Result {
    let Some(timing) = &stream.timing else {
        return writeln!(f, "{}: {}, no time", stream.name, stream.count);
    };
    let span = format!("{} to {}", time(timing.first_s), time(timing.last_s));
    let off = Percent(timing.off_share);
    write!(f, "{}: {} in {} s ({span}), ", stream.name, stream.count, short(timing.duration_s))?;
    let median = short(timing.median_spacing_s * 1e3);
    if timing.is_irregular() {
        let mean = short(timing.mean_rate_hz);
        writeln!(
            f,
            "irregular: {mean} Hz on average\n  {off} of the spacings are off their median of {median} ms by more than half"
        )?;
    } else {
        writeln!(f, "{} Hz\n  {off} of the spacings are off their median of {median} ms by more than half", short(timing.rate_hz))?;
    }
    show_timing(f, timing)
}

fn show_timing(f: &mut Formatter<'_>, timing: &Timing) -> fmt::Result {
    if timing.resolution_s > 0.0 {
        writeln!(f, "  clock steps of {} us", short(timing.resolution_s * 1e6))?;
    }
    if timing.gaps > 0 {
        let longest: Vec<String> =
            timing.longest.iter().map(|gap| format!("{} s after {} s", short(gap.length_s), time(gap.after_s))).collect();
        let missing = format!(", about {} samples missing", timing.missing_samples);
        let lead = format!("  {} gaps{}; longest: ", timing.gaps, if timing.is_irregular() { "" } else { &missing });
        paragraph(f, &lead, &longest.join(", "), ", ")?;
    }
    if timing.repeated_times > 0 {
        writeln!(f, "  {} times equal the one before", timing.repeated_times)?;
    }
    if let Some(jump) = timing.first_jump_back {
        let length = short(jump.length_s);
        writeln!(f, "  time jumps back {} times, first in row {} by {length} s", timing.jumps_back, jump.row)?;
    }
    Ok(())
}

/// A text in lines of the terminal's width, broken at its separators; what follows the first line is indented.
fn paragraph(f: &mut Formatter<'_>, lead: &str, text: &str, separator: &str) -> fmt::Result {
    write!(f, "{lead}")?;
    let mut column = lead.chars().count();
    for (i, part) in text.split(separator).enumerate() {
        let width = part.chars().count() + separator.len();
        if i > 0 {
            write!(f, "{}", separator.trim_end())?;
            if column + width > WIDTH {
                write!(f, "\n    ")?;
                column = 4;
            } else {
                write!(f, " ")?;
            }
        }
        write!(f, "{part}")?;
        column += width;
    }
    writeln!(f)
}

/// Foreign text on one line.
fn plain(text: &str) -> String {
    text.chars().flat_map(|c| if c.is_control() { c.escape_default().collect::<Vec<_>>() } else { vec![c] }).collect()
}

fn clipped(text: &str, most: usize) -> String {
    let text = plain(text);
    if text.chars().count() <= most {
        return text;
    }
    text.chars().take(most.saturating_sub(2)).chain("..".chars()).collect()
}

/// A number in at most ten characters.
fn short(value: f64) -> String {
    let size = value.abs();
    if value == 0.0 {
        return "0".to_owned();
    }
    if (1e-3..1e7).contains(&size) {
        let decimals = (5 - size.log10().floor() as i32).clamp(0, 6) as usize;
        let text = format!("{value:.decimals$}");
        return if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').to_owned() } else { text };
    }
    format!("{value:.3e}")
}

/// A time in s, to the millisecond where it is a date.
fn time(seconds: f64) -> String {
    if seconds.abs() < 1e7 { short(seconds) } else { format!("{seconds:.3}") }
}

/// A share as people say it.
struct Percent(f64);

impl Display for Percent {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        let percent = self.0 * 100.0;
        if percent > 0.0 && percent < 0.1 { write!(f, "<0.1 %") } else { write!(f, "{percent:.1} %") }
    }
}

/// A number of bytes.
struct Size(u64);

impl Display for Size {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        match self.0 {
            bytes if bytes < 10_000 => write!(f, "{bytes} bytes"),
            bytes if bytes < 10_000_000 => write!(f, "{:.1} kB", bytes as f64 / 1e3),
            bytes if bytes < 10_000_000_000 => write!(f, "{:.1} MB", bytes as f64 / 1e6),
            bytes => write!(f, "{:.1} GB", bytes as f64 / 1e9),
        }
    }
}
