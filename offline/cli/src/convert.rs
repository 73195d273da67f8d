//! `ravenpose convert`: a recording of any format into any other.

use crate::output;
use crate::progress::Progress;
use crate::read::{self, told, told_of};
use arm::Side;
use recordings::cut::{CutSource, CutTable, Stretch};
use recordings::open::{Kind, Opened, kind, open};
use recordings::save::{self, StateFormat, TableFormat};
use recordings::states::{self, Arms};
use recordings::stream::{Channel, Damage, Record, Source, Truth};
use recordings::table::{self, TableSource};
use recordings::tidy;
use recordings::{Recording, csv};
use std::path::Path;
use std::process::ExitCode;

const OUTPUTS: &str = ".mcap, .bag, .rvs, .txt (235 columns), .252.csv, .csv, .csv.gz or .parquet";

/// What `--from` and `--to` ask for.
pub(crate) fn stretch(from: Option<f64>, to: Option<f64>) -> Result<Stretch, String> {
    let stretch = Stretch { from_s: from.unwrap_or(Stretch::ALL.from_s), to_s: to.unwrap_or(Stretch::ALL.to_s) };
    // Written so that NaN fails.
    if stretch.from_s >= 0.0 && stretch.to_s > stretch.from_s {
        return Ok(stretch);
    }
    Err(format!("--from {} --to {}: must be seconds after the first record, the second one larger", stretch.from_s, stretch.to_s))
}

pub(crate) fn run(input: &Path, out: &Path, arm: Option<&str>, stretch: Stretch) -> Result<ExitCode, String> {
    output::check_file(out, &[input])?;
    let states = StateFormat::of_name(out);
    let tables = TableFormat::of_name(out);
    let arms = arm.map(arms_of);
    match (open(input).map_err(|error| error.to_string())?, states, tables) {
        (Opened::States(_), Some(_), _) if arm.is_some() => {
            Err(format!("{}: states keep the arms that they have; leave --arm out, or name a table as the output", out.display()))
        }
        (Opened::Table(_), _, Some(_)) if arm.is_some() => {
            Err(format!("{}: a table keeps its columns as they are; leave --arm out, or name states as the output", out.display()))
        }
        (Opened::States(source), Some(format), _) => states_to_states(input, cut(source, stretch), out, format),
        (Opened::States(_), None, Some(format)) => {
            note_all(format.losses_of_states());
            let options = tidy::Options { arms, ..tidy::Options::default() };
            let table = tidy::open_part(input, options, &|states| cut(states, stretch)).map_err(|error| error.to_string())?;
            table_to_table(input, table, out, format)
        }
        (Opened::Table(source), _, Some(format)) => table_to_table(input, cut_table(input, source, stretch)?, out, format),
        (Opened::Table(_), Some(format), None) => table_to_states(input, out, format, arms, stretch),
        (_, None, None) => Err(format!("{}: no format has this ending; name the output {OUTPUTS}", out.display())),
    }
}

fn cut(source: Box<dyn Source>, stretch: Stretch) -> Box<dyn Source> {
    if stretch == Stretch::ALL { source } else { Box::new(CutSource::new(source, stretch)) }
}

fn cut_table(input: &Path, source: Box<dyn TableSource>, stretch: Stretch) -> Result<Box<dyn TableSource>, String> {
    if stretch == Stretch::ALL {
        return Ok(source);
    }
    match CutTable::new(source, stretch) {
        Some(cut) => Ok(Box::new(cut)),
        None => Err(format!("{}: has no column t_s, which --from and --to need", input.display())),
    }
}

fn arms_of(name: &str) -> Arms {
    match name {
        "green" => Arms::Green,
        "both" => Arms::Both,
        _ => Arms::Gold,
    }
}

/// Why nothing of an input was written: it is damaged from the begin, or has none of what is asked for.
fn nothing_of(input: &Path, what: &str, damage: Option<&Damage>) -> String {
    let why = damage
        .map_or_else(|| format!("it holds no {what}, or none of that time"), |damage| format!("{}: {}", damage.place, damage.what));
    format!("{}: {why}; nothing was written", input.display())
}

/// Says what a format cannot hold.
pub(crate) fn note_all(losses: &[&str]) {
    for loss in losses {
        say!("note: {loss}");
    }
}

/// What the lab's wide text holds that is neither state nor truth. Made of it, another file says so too and has lost it before.
fn note_left_out(input: &Path, metadata: &[(String, String)]) {
    if kind(input).is_ok_and(|kind| kind == Kind::Columns252) {
        metadata.iter().filter(|(key, _)| key == "left_out").for_each(|(_, what)| say!("note: {what}"));
    }
}

fn note_unread(channels: &[Channel]) {
    for channel in channels.iter().filter(|channel| !channel.is_read && channel.messages > 0) {
        say!(
            "note: {} messages on {} ({}) are not in it: states and truth are converted",
            channel.messages,
            channel.topic,
            channel.type_name
        );
    }
}

fn states_to_states(input: &Path, mut source: Box<dyn Source>, out: &Path, format: StateFormat) -> Result<ExitCode, String> {
    note_all(format.losses());
    let metadata = source.metadata().to_vec();
    note_left_out(input, &metadata);
    let mut sink = save::create_states(out, format, &metadata).map_err(|error| error.to_string())?;
    let mut progress = Progress::bytes();
    let records = save::copy_states(source.as_mut(), sink.as_mut(), &mut |done, total| progress.at(done, total));
    progress.end();
    let records = records.map_err(|error| error.to_string())?;
    if records == 0 {
        return Err(nothing_of(input, "state", source.damage()));
    }
    sink.finish().map_err(|error| error.to_string())?;
    note_unread(&source.channels());
    say!("{}: of {records} records", out.display());
    Ok(source.damage().map_or(ExitCode::SUCCESS, |damage| told_of(input, damage, "converted")))
}

fn table_to_table(input: &Path, mut source: Box<dyn TableSource>, out: &Path, format: TableFormat) -> Result<ExitCode, String> {
    let metadata = source.metadata().to_vec();
    let columns = source.columns().to_vec();
    note_left_out(input, &metadata);
    let mut sink = save::create_table(out, format, &columns, &metadata).map_err(|error| error.to_string())?;
    let mut progress = Progress::bytes();
    let rows = table::copy(source.as_mut(), sink.as_mut(), &mut |done, total| progress.at(done, total));
    progress.end();
    let rows = rows.map_err(|error| error.to_string())?;
    if rows == 0 {
        return Err(nothing_of(input, "row", source.damage()));
    }
    sink.finish().map_err(|error| error.to_string())?;
    note_unread(&source.channels());
    say!("{}: {rows} rows, {} columns", out.display(), columns.len());
    Ok(told(input, source.as_ref(), "converted"))
}

/// Full states need a time that rises, joints or motors: the strict reader refuses what lacks them.
fn table_to_states(
    input: &Path,
    out: &Path,
    format: StateFormat,
    arms: Option<Arms>,
    stretch: Stretch,
) -> Result<ExitCode, String> {
    let (mut recording, status) = strict(input)?;
    // What the table does not say of its arm is asked for; what it says is so.
    if let Some(Arms::Gold | Arms::Green) = arms {
        let name = if arms == Some(Arms::Green) { Side::Green } else { Side::Gold }.name().to_owned();
        recording.metadata.entry("arm".to_owned()).or_insert(name);
    }
    let recorded = recording.metadata.get("arm").and_then(|name| Side::from_name(name)).unwrap_or(Side::Gold);
    let arms = arms.unwrap_or(if recorded == Side::Green { Arms::Green } else { Arms::Gold });
    let made = states::from_recording(&recording, arms).map_err(|error| error.to_string())?;
    for note in &made.notes {
        say!("note: {note}");
    }
    note_all(format.losses());
    let metadata: Vec<(String, String)> = recording.metadata.clone().into_iter().collect();
    let mut sink = save::create_states(out, format, &metadata).map_err(|error| error.to_string())?;
    let shows_recorded = arms.sides().contains(&recorded);
    let keeps_truth = format != StateFormat::StateFile && format != StateFormat::Columns235 && shows_recorded;
    let has_truth = || recording.columns.iter().any(|column| column.name.starts_with("truth_"));
    if !shows_recorded && has_truth() {
        say!("note: where the {} arm truly was is left out: it is not shown", recorded.name());
    }
    let mut times_ns: Option<(i64, i64)> = None;
    let mut first_ns = None;
    let mut written = 0_usize;
    for (row, state) in made.states.iter().enumerate() {
        let record = Record::State(Box::new(*state));
        let time_ns = record.time_ns();
        if !stretch.holds((time_ns - *first_ns.get_or_insert(time_ns)) as f64 * 1e-9) {
            continue;
        }
        written += 1;
        times_ns = Some((times_ns.map_or(time_ns, |(first, _)| first), time_ns));
        sink.write(&record).map_err(|error| error.to_string())?;
        if let Some(truth) = truth(&recording, row, time_ns, recorded).filter(|_| keeps_truth) {
            sink.write(&Record::Truth(truth)).map_err(|error| error.to_string())?;
        }
    }
    let Some((first_ns, last_ns)) = times_ns else {
        return Err(format!("{}: it holds no row of that time; nothing was written", input.display()));
    };
    sink.finish().map_err(|error| error.to_string())?;
    // With the period that the last one lasts.
    let span_s = (last_ns - first_ns) as f64 * 1e-9;
    let length_s = span_s * written as f64 / written.saturating_sub(1).max(1) as f64;
    say!("{}: {written} states, {length_s:.3} s", out.display());
    Ok(status)
}

/// A run as a table, and the status to end with. Of text nothing may be amiss; what a file of another kind has lost is told.
fn strict(input: &Path) -> Result<(Recording, ExitCode), String> {
    if kind(input).map_err(|error| error.to_string())? == Kind::Csv {
        return csv::read(input).map(|recording| (recording, ExitCode::SUCCESS)).map_err(|error| error.to_string());
    }
    let Opened::Table(source) = open(input).map_err(|error| error.to_string())? else {
        return Err(format!("{}: is a recording of states", input.display()));
    };
    let (recording, status) = read::all_of(input, source)?;
    let name = input.display();
    let time = recording.time_s().unwrap_or_default();
    if recording.rows() == 0 {
        return Err(format!("{name}: it holds no row; nothing was written"));
    }
    if let Some(row) = time.iter().position(|t| !t.is_finite()) {
        return Err(format!("{name}: row {}: has no time; remove the row", row + 1));
    }
    if let Some(row) = time.windows(2).position(|pair| pair[1] <= pair[0]) {
        let (before, now) = (time[row], time[row + 1]);
        return Err(format!(
            "{name}: row {}: time {now} s does not rise above {before} s; sort the rows and drop repeated times",
            row + 2
        ));
    }
    let is_position = |name: &str| ["mpos_", "jpos_"].iter().any(|start| name.starts_with(start)) && !name.starts_with("jpos_d_");
    for column in recording.columns.iter().filter(|column| is_position(&column.name)) {
        if let Some(row) = column.values.iter().position(|x| !x.is_finite()) {
            return Err(format!(
                "{name}: row {}, column `{}`: is empty or no number; states have every joint",
                row + 1,
                column.name
            ));
        }
    }
    Ok((recording, status))
}

/// What the row says of where the arm truly was; none where it says nothing.
fn truth(recording: &Recording, row: usize, time_ns: i64, side: Side) -> Option<Truth> {
    let cell = |name: &str| recording.column(name).map_or(f64::NAN, |values| values[row]);
    let offset_s = cell("truth_offset_s");
    let seen_ns = if offset_s.is_finite() { time_ns + (offset_s * 1e9).round() as i64 } else { time_ns };
    let mut truth = Truth::unknown(seen_ns, side);
    truth.position_m = ["truth_x_m", "truth_y_m", "truth_z_m"].map(cell);
    truth.quaternion_wxyz = ["truth_qw", "truth_qx", "truth_qy", "truth_qz"].map(cell);
    for joint in 0..arm::JOINTS {
        let unit = if joint == 2 { "m" } else { "rad" };
        truth.joints[joint] = cell(&format!("truth_jpos_{}_{unit}", joint + 1));
        truth.cable_force_n[joint] = cell(&format!("truth_cable_{}_n", joint + 1));
    }
    let numbers = truth.position_m.iter().chain(&truth.quaternion_wxyz).chain(&truth.joints).chain(&truth.cable_force_n);
    let known = numbers.into_iter().any(|value| value.is_finite());
    known.then_some(truth)
}
