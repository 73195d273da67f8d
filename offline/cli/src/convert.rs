//! `ravenpose convert`: a recording of any format into any other.

use crate::output;
use crate::progress::Progress;
use crate::read::{told, told_of};
use arm::Side;
use recordings::cut::{CutSource, CutTable, Stretch};
use recordings::open::{Opened, open};
use recordings::save::{self, StateFormat, TableFormat};
use recordings::states::{self, Arms};
use recordings::stream::{Record, Source, Truth};
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
        (Opened::States(source), Some(format), _) => states_to_states(input, cut(source, stretch), out, format),
        (Opened::States(_), None, Some(format)) => {
            note_all(format.losses_of_states());
            let options = tidy::Options { arms, ..tidy::Options::default() };
            let table = tidy::open_part(input, options, &|states| cut(states, stretch)).map_err(|error| error.to_string())?;
            table_to_table(input, table, out, format)
        }
        (Opened::Table(source), _, Some(format)) => table_to_table(input, cut_table(input, source, stretch)?, out, format),
        (Opened::Table(_), Some(format), None) => table_to_states(input, out, format, arms.unwrap_or(Arms::Gold), stretch),
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

fn note_all(losses: &[&str]) {
    for loss in losses {
        say!("note: {loss}");
    }
}

fn states_to_states(input: &Path, mut source: Box<dyn Source>, out: &Path, format: StateFormat) -> Result<ExitCode, String> {
    note_all(format.losses());
    let metadata = source.metadata().to_vec();
    let mut sink = save::create_states(out, format, &metadata).map_err(|error| error.to_string())?;
    let mut progress = Progress::bytes();
    let records = save::copy_states(source.as_mut(), sink.as_mut(), &mut |done, total| progress.at(done, total));
    progress.end();
    let records = records.map_err(|error| error.to_string())?;
    if records == 0 {
        let why = source.damage().map_or_else(
            || "it holds no state, or none of that time".to_owned(),
            |damage| format!("{}: {}", damage.place, damage.what),
        );
        return Err(format!("{}: {why}; nothing was written", input.display()));
    }
    sink.finish().map_err(|error| error.to_string())?;
    for channel in source.channels().iter().filter(|channel| !channel.is_read && channel.messages > 0) {
        say!(
            "note: {} messages on {} ({}) are not in it: states and truth are converted",
            channel.messages,
            channel.topic,
            channel.type_name
        );
    }
    say!("{}: of {records} records", out.display());
    Ok(source.damage().map_or(ExitCode::SUCCESS, |damage| told_of(input, damage, "converted")))
}

fn table_to_table(input: &Path, mut source: Box<dyn TableSource>, out: &Path, format: TableFormat) -> Result<ExitCode, String> {
    let metadata = source.metadata().to_vec();
    let columns = source.columns().to_vec();
    let mut sink = save::create_table(out, format, &columns, &metadata).map_err(|error| error.to_string())?;
    let mut progress = Progress::bytes();
    let rows = table::copy(source.as_mut(), sink.as_mut(), &mut |done, total| progress.at(done, total));
    progress.end();
    let rows = rows.map_err(|error| error.to_string())?;
    if rows == 0 {
        return Err(format!("{}: it holds no row, or none of that time; nothing was written", input.display()));
    }
    sink.finish().map_err(|error| error.to_string())?;
    say!("{}: {rows} rows, {} columns", out.display(), columns.len());
    Ok(told(input, source.as_ref(), "converted"))
}

/// Full states need a time that rises, joints or motors: the strict reader refuses what lacks them.
fn table_to_states(input: &Path, out: &Path, format: StateFormat, arms: Arms, stretch: Stretch) -> Result<ExitCode, String> {
    let recording = strict(input)?;
    let made = states::from_recording(&recording, arms).map_err(|error| error.to_string())?;
    for note in &made.notes {
        say!("note: {note}");
    }
    note_all(format.losses());
    let metadata: Vec<(String, String)> = recording.metadata.clone().into_iter().collect();
    let mut sink = save::create_states(out, format, &metadata).map_err(|error| error.to_string())?;
    let keeps_truth = format != StateFormat::StateFile && format != StateFormat::Columns235;
    let side = if arms == Arms::Green { Side::Green } else { Side::Gold };
    let mut first_ns = None;
    let mut written = 0_usize;
    for (row, state) in made.states.iter().enumerate() {
        let record = Record::State(Box::new(*state));
        let time_ns = record.time_ns();
        if !stretch.holds((time_ns - *first_ns.get_or_insert(time_ns)) as f64 * 1e-9) {
            continue;
        }
        written += 1;
        sink.write(&record).map_err(|error| error.to_string())?;
        if let Some(truth) = truth(&recording, row, time_ns, side).filter(|_| keeps_truth) {
            sink.write(&Record::Truth(truth)).map_err(|error| error.to_string())?;
        }
    }
    if written == 0 {
        return Err(format!("{}: it holds no row of that time; nothing was written", input.display()));
    }
    sink.finish().map_err(|error| error.to_string())?;
    say!("{}: {written} states, {:.3} s", out.display(), written as f64 * 1e-3);
    Ok(ExitCode::SUCCESS)
}

fn strict(input: &Path) -> Result<Recording, String> {
    let name = input.to_string_lossy();
    if name.ends_with(".csv") || name.ends_with(".csv.gz") {
        return csv::read(input).map_err(|error| error.to_string());
    }
    match open(input).map_err(|error| error.to_string())? {
        Opened::Table(mut source) => table::collect(&name, source.as_mut()).map_err(|error| error.to_string()),
        Opened::States(_) => Err(format!("{name}: is a recording of states")),
    }
}

/// What the row says of where the arm truly was; none where it says nothing.
fn truth(recording: &Recording, row: usize, time_ns: i64, side: Side) -> Option<Truth> {
    let cell = |name: &str| recording.column(name).map_or(f64::NAN, |values| values[row]);
    let mut truth = Truth::unknown(time_ns, side);
    truth.position_m = ["truth_x_m", "truth_y_m", "truth_z_m"].map(cell);
    for joint in 0..arm::JOINTS {
        let unit = if joint == 2 { "m" } else { "rad" };
        truth.joints[joint] = cell(&format!("truth_jpos_{}_{unit}", joint + 1));
    }
    let known = truth.position_m.iter().chain(&truth.joints).any(|value| value.is_finite());
    known.then_some(truth)
}
