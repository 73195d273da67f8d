//! Figures of the error against what may cause it: load, direction of motion, posture; of its distribution; and of the load
//! against velocity, where friction shows.

use std::borrow::Cow;

use super::content::{Channel, Content, Signal};
use super::errors::{Error, Errors};
use super::traces::capital;
use super::words::short;
use crate::figure::bins::{Summary, along, density, extent, grid, histogram, quantile, select};
use crate::figure::decimate::every;
use crate::figure::{Axis, Cells, Colour, Figure, Mark, NARROW_PX, Panel, Ramp};

/// Bins along the horizontal axis.
const BINS: usize = 24;
/// Samples that make a bin worth a median: so many, and no less than a twelfth of an even share.
fn least(samples: usize) -> usize {
    (samples / (12 * BINS)).max(8)
}

/// Cells of a density.
const DENSITY: (usize, usize) = (60, 36);
/// Dots of one colour.
const DOTS: usize = 500;

/// Range that leaves out the outermost percent on each side.
fn core_range(values: impl Iterator<Item = f64>) -> (f64, f64) {
    let mut finite: Vec<f64> = values.filter(|value| value.is_finite()).collect();
    let (low, high) = (select(&mut finite, 0.01), select(&mut finite, 0.99));
    if low < high { (low, high) } else { extent(finite) }
}

fn widened((low, high): (f64, f64)) -> (f64, f64) {
    let room = 0.04 * (high - low);
    (low - room, high + room)
}

/// Correlation of two series where both are finite.
fn correlation(samples: &[(f64, f64)]) -> f64 {
    let count = samples.len() as f64;
    let (mx, my) = (samples.iter().map(|s| s.0).sum::<f64>() / count, samples.iter().map(|s| s.1).sum::<f64>() / count);
    let (mut xx, mut yy, mut xy) = (0.0, 0.0, 0.0);
    for (x, y) in samples {
        xx += (x - mx).powi(2);
        yy += (y - my).powi(2);
        xy += (x - mx) * (y - my);
    }
    xy / (xx * yy).sqrt()
}

fn finite_pairs(x: impl Iterator<Item = f64>, y: impl Iterator<Item = f64>) -> Vec<(f64, f64)> {
    x.zip(y).filter(|(x, y)| x.is_finite() && y.is_finite()).collect()
}

/// Density of the samples with the median and the range of 5 to 95 % along x.
fn scattered(figure: Figure, y_title: &str, samples: &[(f64, f64)]) -> Figure {
    let (x, y) = (core_range(samples.iter().map(|s| s.0)), core_range(samples.iter().map(|s| s.1)));
    let bins = along(samples.iter().copied(), x, BINS, least(samples.len()));
    let (wide_x, wide_y) = (widened(x), widened(y));
    let cells = density(samples.iter().copied(), wide_x, wide_y, DENSITY);
    let panel = Panel::new(Axis::new(y_title).range(wide_y.0, wide_y.1))
        .height(190.0)
        .mark(Mark::Cells { cells, ramp: Ramp::Density, title: String::new() })
        .marks(runs(&bins, x).into_iter().map(|run| Mark::Band {
            colour: Colour::VERMILLION,
            points: run.iter().map(|bin| (bin.x, bin.low, bin.high)).collect(),
        }))
        .mark(Mark::strokes("median", Colour::VERMILLION, middles(&bins, x)));
    Figure { x: figure.x.clone().range(wide_x.0, wide_x.1), ..figure }.panel(panel)
}

/// Neighbouring bins together: no line across bins without samples.
fn runs(bins: &[Summary], (low, high): (f64, f64)) -> Vec<&[Summary]> {
    let width = (high - low) / BINS as f64;
    bins.chunk_by(|a, b| b.x - a.x < 1.5 * width).collect()
}

fn middles(bins: &[Summary], range: (f64, f64)) -> Vec<Vec<(f64, f64)>> {
    runs(bins, range).into_iter().map(|run| run.iter().map(|bin| (bin.x, bin.middle)).collect()).collect()
}

fn error_title(error: &Error) -> String {
    let what = if error.label == "Tip 3D" { "3D error".to_owned() } else { capital(error.kind.words()) };
    format!("{what}, {}", error.unit)
}

/// Error against load: of each joint against its own, of the tip's length against each.
pub(super) fn load(content: &Content<'_>, errors: &Errors) -> Vec<Figure> {
    let mut figures = Vec::new();
    for (number, joint) in &content.joints {
        let Some((name, load)) = joint.load.as_ref().or_else(|| content.motors.get(number)?.load.as_ref()) else { continue };
        let of_tip = errors.tip_3d.as_ref().filter(|_| *number <= 3);
        for (error, what) in [(errors.joint(*number), joint.label.as_str()), (of_tip, "Tip 3D")] {
            let Some(error) = error else { continue };
            let samples = finite_pairs(load.shown(), error.values.iter().copied());
            if samples.len() < 20 {
                continue;
            }
            let title =
                if what == joint.label { what.to_owned() } else { format!("{what} over load of {}", joint.label.to_lowercase()) };
            let figure = Figure::new(title, Axis::new(load.scale.titled(name)));
            let caption = format!("Correlation {}. Band: 5 to 95 % of the samples.", short(correlation(&samples)));
            figures.push(scattered(figure, &error_title(error), &samples).caption(caption));
        }
    }
    // One picture of a kind after the other reads better than joint by joint.
    figures.sort_by_key(|figure| figure.title.starts_with("Tip"));
    figures
}

/// Velocity as reported, or from the positions over ±10 ms where it is not.
fn velocity<'a>(content: &Content<'_>, channel: &'a Channel<'_>) -> Option<Cow<'a, [f64]>> {
    if let Some(signal) = &channel.velocity {
        return Some(Cow::Borrowed(&signal.values));
    }
    let position = &channel.position()?.values;
    let count = position.len();
    let (first, last) = content.span();
    let interval = (last - first) / (count.max(2) - 1) as f64;
    let half = if content.timed { ((0.01 / interval.max(1e-9)).round() as usize).clamp(1, 200) } else { 1 };
    let rate = |row: usize| {
        let (from, to) = (row.saturating_sub(half), (row + half).min(count - 1));
        (position[to] - position[from]) / (content.time[to] - content.time[from])
    };
    Some((0..count).map(rate).collect())
}

/// Slower than this share of the RMS speed counts as standing.
const STANDING: f64 = 0.1;

/// Error over position, rising and falling apart: cables that stretch and rub make two branches.
pub(super) fn direction(content: &Content<'_>, errors: &Errors) -> Vec<Figure> {
    let joints = content.joints.iter().filter_map(|(number, joint)| Some((joint, errors.joint(*number)?)));
    let tip = content.tip.iter().flatten().zip(errors.tip.iter().flatten());
    tip.chain(joints).filter_map(|(channel, error)| branches(content, channel, error)).collect()
}

fn branches(content: &Content<'_>, channel: &Channel<'_>, error: &Error) -> Option<Figure> {
    let (position, speed) = (channel.position()?, velocity(content, channel)?);
    let moving: Vec<f64> = speed.iter().copied().filter(|speed| speed.is_finite()).collect();
    let rms = (moving.iter().map(|speed| speed * speed).sum::<f64>() / moving.len().max(1) as f64).sqrt();
    let branch = |sign: f64| {
        let rows = (0..error.values.len()).filter(|&row| sign * speed[row] > STANDING * rms && error.values[row].is_finite());
        rows.map(|row| (position.at(row), error.values[row])).filter(|sample| sample.0.is_finite()).collect::<Vec<_>>()
    };
    let (rising, falling) = (branch(1.0), branch(-1.0));
    if rising.len() < 20 || falling.len() < 20 {
        return None;
    }
    let x = core_range(rising.iter().chain(&falling).map(|s| s.0));
    let y = widened(core_range(rising.iter().chain(&falling).map(|s| s.1)));
    let medians = |samples: &[(f64, f64)]| along(samples.iter().copied(), x, BINS, least(samples.len()));
    let (up, down) = (medians(&rising), medians(&falling));
    let dots = |colour, samples: &[(f64, f64)]| Mark::Dots { colour, points: every(samples.iter().copied(), DOTS) };
    let panel = Panel::new(Axis::new(error_title(error)).range(y.0, y.1))
        .height(190.0)
        .mark(dots(Colour::BLUE, &rising))
        .mark(dots(Colour::VERMILLION, &falling))
        .mark(Mark::strokes("rising", Colour::BLUE, middles(&up, x)))
        .mark(Mark::strokes("falling", Colour::VERMILLION, middles(&down, x)));
    let wide = widened(x);
    let figure = Figure::new(&channel.label, Axis::new(position.scale.titled("Position")).range(wide.0, wide.1)).panel(panel);
    Some(figure.caption(parted(&up, &down, error.unit)))
}

fn parted(up: &[Summary], down: &[Summary], unit: &str) -> String {
    let gaps: Vec<f64> = up.iter().filter_map(|a| Some(a.middle - down.iter().find(|b| b.x == a.x)?.middle)).collect();
    if gaps.is_empty() {
        return "Medians over position; the directions share no position.".to_owned();
    }
    let mean = gaps.iter().sum::<f64>() / gaps.len() as f64;
    format!("Medians over position. Rising minus falling: {} {unit} on average over {} bins.", short(mean), gaps.len())
}

/// Cells of a map of postures.
const MAP: (usize, usize) = (26, 20);

/// Mean size of the error over joints 1 and 2, or over x and y of the tip.
pub(super) fn posture(content: &Content<'_>, errors: &Errors) -> Vec<Figure> {
    let joint = |number| content.joints.get(&number).and_then(Channel::position);
    let axis = |i: usize| content.tip.as_ref().and_then(|tip| tip[i].position());
    let (places, names) = match (joint(1), joint(2)) {
        (Some(a), Some(b)) => ((a, b), ("Joint 1", "Joint 2")),
        _ => match (axis(0), axis(1)) {
            (Some(a), Some(b)) => ((a, b), ("Tip x", "Tip y")),
            _ => return Vec::new(),
        },
    };
    let joints = errors.joints.iter().map(|(_, error)| error).take(3);
    errors.tip_3d.iter().chain(joints).filter_map(|error| map(places, names, error)).collect()
}

fn map((a, b): (&Signal<'_>, &Signal<'_>), names: (&str, &str), error: &Error) -> Option<Figure> {
    let rows = || (0..error.values.len()).filter(|&row| error.values[row].is_finite());
    let (x, y) = (core_range(rows().map(|row| a.at(row))), core_range(rows().map(|row| b.at(row))));
    if !(x.0 < x.1 && y.0 < y.1) {
        return None;
    }
    let mut cells = grid(rows().map(|row| (a.at(row), b.at(row), error.values[row].abs())), x, y, MAP, 2);
    let visited = cells.values.iter().filter(|value| value.is_finite()).count();
    let worst = most(&cells).map_or(String::new(), |(x, y, value)| {
        let (x, y) = (format!("{} {}", short(x), a.scale.unit), format!("{} {}", short(y), b.scale.unit));
        format!("Most: {} {} around {x}, {y}.", short(value), error.unit)
    });
    let title =
        if error.label == "Tip 3D" { "3D error of the tip".to_owned() } else { format!("Error of {}", error.label.to_lowercase()) };
    // One cell with an outlier must not take all the colours.
    let mut sizes: Vec<f64> = cells.values.iter().copied().filter(|value| value.is_finite()).collect();
    sizes.sort_by(f64::total_cmp);
    let (low, high) = (quantile(&sizes, 0.02), quantile(&sizes, 0.98));
    cells.values.iter_mut().filter(|value| value.is_finite()).for_each(|value| *value = value.clamp(low, high));
    let panel = Panel::new(Axis::new(b.scale.titled(names.1)).range(y.0, y.1)).height(230.0).mark(Mark::Cells {
        cells,
        ramp: Ramp::Heat,
        title: format!("Mean size, {}", error.unit),
    });
    let caption = format!(
        "{} {visited} of {} cells visited; blank where fewer than 2 samples are. Colours end at the 2nd and 98th percentile.",
        worst,
        MAP.0 * MAP.1
    );
    Some(Figure::new(title, Axis::new(a.scale.titled(names.0)).range(x.0, x.1)).panel(panel).caption(caption))
}

/// Middle and value of the greatest cell.
fn most(cells: &Cells) -> Option<(f64, f64, f64)> {
    let finite = cells.values.iter().enumerate().filter(|(_, value)| value.is_finite());
    let (i, value) = finite.max_by(|a, b| a.1.total_cmp(b.1))?;
    let middle = |(low, high): (f64, f64), place: usize, count: usize| low + (place as f64 + 0.5) * (high - low) / count as f64;
    Some((middle(cells.x, i % MAP.0, MAP.0), middle(cells.y, i / MAP.0, MAP.1), *value))
}

/// Bins of a histogram.
const HISTOGRAM: usize = 48;

/// Distribution of the errors: the tip's axes together, each joint for itself.
pub(super) fn distribution(errors: &Errors) -> Vec<Figure> {
    let tip = errors.tip.as_ref().map(|tip| {
        let names = ["x", "y", "z"];
        spread(
            "Tip",
            &tip.iter().zip(names).enumerate().map(|(i, (error, name))| (name, error, Colour::choice(i))).collect::<Vec<_>>(),
        )
    });
    let joints = errors.joints.iter().map(|(_, error)| spread(&error.label, &[("", error, Colour::BLUE)]));
    tip.into_iter().chain(joints).collect()
}

fn spread(title: &str, parts: &[(&str, &Error, Colour)]) -> Figure {
    let range = widened(core_range(parts.iter().flat_map(|(_, error, _)| error.values.iter().copied())));
    let marks = parts.iter().map(|(name, error, colour)| Mark::Steps {
        name: (!name.is_empty()).then(|| (*name).to_owned()),
        colour: *colour,
        histogram: histogram(error.values.iter().copied(), range, HISTOGRAM),
    });
    let panel = Panel::new(Axis::new("Samples").including(0.0)).height(130.0).marks(marks);
    let error = parts[0].1;
    let each: Vec<String> = parts
        .iter()
        .map(|(name, error, _)| {
            let (statistics, gap) = (error.statistics, if name.is_empty() { "" } else { ": " });
            format!("{name}{gap}mean {}, SD {}", short(statistics.mean), short(statistics.sd))
        })
        .collect();
    let axis =
        if range.0 < range.1 { Axis::new(error_title(error)).range(range.0, range.1) } else { Axis::new(error_title(error)) };
    Figure::new(title, axis).width(NARROW_PX).panel(panel).caption(format!(
        "{} {}.",
        if parts.len() > 1 { each.join("; ") } else { capital(&each[0]) },
        error.unit
    ))
}

/// Load against velocity: Coulomb friction is a step at zero, viscous friction a slope.
pub(super) fn friction(content: &Content<'_>) -> Vec<Figure> {
    let channels = content.motors.values().chain(content.joints.values());
    channels
        .filter_map(|channel| {
            let ((name, load), velocity) = (channel.load.as_ref()?, channel.velocity.as_ref()?);
            let samples = finite_pairs(velocity.shown(), load.shown());
            let figure = Figure::new(&channel.label, Axis::new(velocity.scale.titled("Velocity")));
            (samples.len() >= 20)
                .then(|| scattered(figure, &load.scale.titled(name), &samples).caption("Band: 5 to 95 % of the samples."))
        })
        .collect()
}
