//! What the page says in words: what the run is, what it lacks, how large the errors are.

use recordings::Recording;

use super::content::{Channel, Content};
use super::errors::{Errors, Kind};
use super::words::{count, duration, short};

/// Text of the section of loads.
pub(super) const LOAD: &str =
    "A cable stretches under load: a slope is compliance, a step at zero play. The grey ground shows where the samples are.";
/// Text of the section of directions.
pub(super) const DIRECTION: &str =
    "Friction and play leave the error on another branch when the motion turns. One branch: no hysteresis.";
/// Text of the section of friction.
pub(super) const FRICTION: &str =
    "A step at zero velocity is Coulomb friction, a slope viscous friction; gravity and acceleration add the spread.";

/// Last part of a path.
pub(super) fn file_name(path: &str) -> String {
    let name = path.rsplit('/').next().unwrap_or_default();
    if name.is_empty() { "Recording".to_owned() } else { name.to_owned() }
}

/// Where it came from and its metadata.
pub(super) fn subtitle(recording: &Recording, content: &Content<'_>) -> String {
    let words = recording.metadata.iter().take(6).map(|(key, value)| format!("{key} {value}"));
    let arms = match (content.tip.is_some(), content.joints.len(), content.motors.len()) {
        (true, 0, _) => "tip".to_owned(),
        (true, joints, _) => format!("tip and {joints} joints"),
        (false, 0, 0) => "no joints or tip by known names".to_owned(),
        (false, 0, motors) => format!("{motors} motors"),
        (false, joints, _) => format!("{joints} joints"),
    };
    [arms].into_iter().chain(words).collect::<Vec<_>>().join(" · ")
}

/// Times of the true positions: of the tip, or else of the joint that has most.
fn true_positions(content: &Content<'_>) -> Option<Vec<f64>> {
    let times = |channel: &Channel<'_>| -> Option<Vec<f64>> {
        let seen = channel.truth.as_ref()?.values.iter().zip(content.time.iter()).filter(|(value, _)| value.is_finite());
        Some(seen.map(|(_, t)| *t).collect()).filter(|times: &Vec<f64>| !times.is_empty())
    };
    let tip = content.tip.iter().flatten().filter_map(times).max_by_key(Vec::len);
    tip.or_else(|| content.joints.values().filter_map(times).max_by_key(Vec::len))
}

/// Large figures at the top.
pub(super) fn tiles(content: &Content<'_>) -> Vec<(String, String)> {
    let (first, last) = content.span();
    let mut tiles = Vec::new();
    let mut tile = |name: &str, value: String| tiles.push((name.to_owned(), value));
    if content.timed {
        tile("Duration", duration(last - first));
        tile("Rate", rate(&content.time));
    }
    tile("Rows", count(content.time.len()));
    tile("Columns", count(content.columns));
    if let Some(times) = true_positions(content) {
        let rate_hz = (times.len() - 1) as f64 / (times[times.len() - 1] - times[0]);
        let rarer = content.timed && times.len() < content.time.len();
        tile("True positions", if rarer { format!("{} at {} Hz", count(times.len()), short(rate_hz)) } else { count(times.len()) });
    }
    if content.timed {
        let longest = content.time.windows(2).map(|pair| pair[1] - pair[0]).fold(0.0, f64::max);
        tile("Longest gap", format!("{} ms", short(longest * 1e3)));
    }
    tiles
}

fn rate(time: &[f64]) -> String {
    let mut intervals: Vec<f64> = time.windows(2).map(|pair| pair[1] - pair[0]).collect();
    let Some(last) = intervals.len().checked_sub(1) else { return "one sample".to_owned() };
    let mean = intervals.iter().sum::<f64>() / intervals.len() as f64;
    intervals.sort_by(f64::total_cmp);
    let (middle, long) = (intervals[last / 2], intervals[last - last / 100]);
    // Bursts: neither the mean nor the median interval is that of the others.
    if long > 1.8 * middle || middle > 1.8 * mean {
        format!("{} Hz, uneven", short(1.0 / mean))
    } else {
        format!("{} Hz", short(1.0 / middle))
    }
}

/// What a reader must not overlook: what is missing, and what is shown in its place.
pub(super) fn notices(content: &Content<'_>, errors: &Errors) -> Vec<String> {
    let mut notices = Vec::new();
    let kinds: Vec<Kind> = errors.all().map(|error| error.kind).collect();
    let has_truth = true_positions(content).is_some();
    if !has_truth {
        notices.push(if kinds.contains(&Kind::Tracking) {
            "No true position in this recording. Errors below are tracking errors, commanded \u{2212} reported: they say how well the \
             controller follows, not where the arm really is."
                .to_owned()
        } else {
            "No true position and no pair of commanded and reported positions: no error can be shown.".to_owned()
        });
    } else if kinds.contains(&Kind::TrueCommanded) {
        notices
            .push("No reported position beside the true one for some channels: their error is true \u{2212} commanded.".to_owned());
    }
    if has_truth && kinds.is_empty() {
        notices.push("True positions only: nothing that was commanded or reported to compare them with.".to_owned());
    }
    if has_truth && errors.tip.as_ref().is_some_and(|tip| tip[0].kind == Kind::Tracking) {
        notices.push("The tip has no true position: its error is the tracking error, commanded \u{2212} reported.".to_owned());
    }
    if !content.timed {
        notices.push("No time in this recording: the rows are numbered.".to_owned());
    }
    if !kinds.is_empty() && content.joints.values().chain(content.motors.values()).all(|channel| channel.load.is_none()) {
        notices.push("No torque, force or amplifier command: the error cannot be shown against load.".to_owned());
    }
    notices
}

/// All errors in one table.
pub(super) fn table(errors: &Errors) -> Option<(Vec<String>, Vec<Vec<String>>)> {
    let header = ["", "Difference", "Unit", "Samples", "Mean", "SD", "RMS", "Median size", "95 % below", "Greatest"];
    let rows: Vec<Vec<String>> = errors
        .all()
        .map(|error| {
            let s = error.statistics;
            let numbers = [s.mean, s.sd, s.rms, s.median, s.p95, s.max].map(short);
            let words = [error.label.clone(), error.kind.words().to_owned(), error.unit.to_owned(), count(s.count)];
            words.into_iter().chain(numbers).collect()
        })
        .collect();
    (!rows.is_empty()).then(|| (header.map(str::to_owned).to_vec(), rows))
}

/// A question to a channel.
type Has = fn(&Channel<'_>) -> bool;

/// What a complete recording would have as well.
fn missing(content: &Content<'_>) -> Vec<String> {
    let parts: [(&str, Has); 3] = [
        ("commanded", |channel| channel.commanded.is_some()),
        ("reported", |channel| channel.reported.is_some()),
        ("true", |channel| channel.truth.is_some()),
    ];
    let tip: Vec<&Channel<'_>> = content.tip.iter().flatten().collect();
    let joints: Vec<&Channel<'_>> = content.joints.values().collect();
    let mut missing = Vec::new();
    for (whose, channels) in [("tip position", &tip), ("joint positions", &joints)] {
        let absent = parts.iter().filter(|(_, has)| !channels.iter().any(|channel| has(channel)));
        missing.extend(absent.map(|(name, _)| format!("{name} {whose}")));
    }
    let any = |has: Has| joints.iter().copied().chain(content.motors.values()).any(has);
    if !any(|channel| channel.velocity.is_some()) {
        missing.push("velocities".to_owned());
    }
    if !any(|channel| channel.load.is_some()) {
        missing.push("torques or amplifier commands".to_owned());
    }
    missing
}

/// How the figures were made.
pub(super) fn reading(content: &Content<'_>, others_drawn: usize) -> Vec<String> {
    let mut lines = vec![
        "Error = true \u{2212} reported; corrected = reported + error. Tracking error = commanded \u{2212} reported.".to_owned(),
        "Lines over time show the least and the greatest value per pixel column: no peak is lost, but single samples do not show.".to_owned(),
        "95 % below: 95th percentile of the size of the error. SD: about the mean. 3D: length of the error vector.".to_owned(),
        "Pictures of relations leave the outermost percent of the samples on each side outside the frame; figures in captions and tables count all."
            .to_owned(),
    ];
    let standing =
        "Rising and falling: speed above a tenth of its RMS; where no velocity is recorded it comes from the positions over 20 ms.";
    lines.push(standing.to_owned());
    let missing = missing(content);
    if !missing.is_empty() {
        lines.push(format!("Not in this recording: {}.", missing.join(", ")));
    }
    let rest: Vec<String> = content.others.iter().skip(others_drawn).map(|family| family.name.clone()).collect();
    if !rest.is_empty() {
        lines.push(format!("Not drawn: {}.", rest.join(", ")));
    }
    lines
}
