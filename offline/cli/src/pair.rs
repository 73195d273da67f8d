//! `ravenpose pair`: reported and true tip positions of the same moments, with the clock and the frame between them; as a table, or as the
//! recording with its truth inside, which `ravenpose train` learns from.

use crate::{output, read, registration};
use arm::Side;
use recordings::open::{Opened, open};
use recordings::pairs::{Clock, ClockChoice, Options, Pair, Paired, RegistrationChoice, Reported, Truth, pair, stated_offset_s};
use recordings::save::{self, StateFormat};
use recordings::stream::{self, Record};
use recordings::table::TableSource;
use recordings::{Arms, Recording, tidy};
use std::fmt::Write as _;
use std::path::Path;
use std::process::ExitCode;

/// What is to be paired.
pub(crate) struct Wish<'a> {
    /// Recording with the reported tip.
    pub(crate) run: &'a Path,
    /// The true tip, where it is in a file of its own.
    pub(crate) truth: Option<&'a Path>,
    /// Of a recording of both arms: the one that is paired.
    pub(crate) arm: Option<&'a str>,
    /// A table of pairs, or a recording with the truth inside.
    pub(crate) out: &'a Path,
    /// cameras.toml whose `[registration]` is the frame.
    pub(crate) cameras: Option<&'a Path>,
    /// cameras.toml that the fitted frame is written to.
    pub(crate) register: Option<&'a Path>,
    /// The truth is on the states' clock and in frame 0 of the arm (a simulation).
    pub(crate) same: bool,
    /// What is known of the clocks' offset; otherwise the two recordings' own start times, otherwise that they begin together.
    pub(crate) offset_s: Option<f64>,
    /// That offset is exact.
    pub(crate) clock_known: bool,
    /// The fixture's axes are the end effector's.
    pub(crate) mounting_known: bool,
}

pub(crate) fn run(wish: &Wish) -> Result<ExitCode, String> {
    let (run, out, offset_s) = (wish.run, wish.out, wish.offset_s);
    if offset_s.is_some_and(|offset_s| !offset_s.is_finite()) {
        return Err("--offset-s: must be a number of seconds".to_owned());
    }
    let format = StateFormat::of_name(out);
    if let Some(StateFormat::StateFile | StateFormat::Columns235 | StateFormat::Columns252) = format {
        return Err(format!("{}: this format holds no true tip; name the output .csv, .mcap, .bag or .parquet", out.display()));
    }
    let is_table = out.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("csv"));
    if format.is_none() && !is_table {
        return Err(format!("{}: not a format of pairs; name the output .csv, .mcap, .bag or .parquet", out.display()));
    }
    output::check_file(out, &[run].into_iter().chain(wish.truth).collect::<Vec<_>>())?;
    let known = wish.cameras.map(registration::read).transpose()?;
    let (recording, mut status) = read::all_of(run, of_one_arm(run, wish.arm)?)?;
    let separate = match wish.truth.map(read::read).transpose()? {
        None => None,
        Some((truth, of_truth)) => {
            if of_truth != ExitCode::SUCCESS {
                status = of_truth;
            }
            Some(truth)
        }
    };
    let reported = Reported::from_recording(&recording).map_err(|error| error.to_string())?;
    let frames = match &separate {
        Some(truth) => Truth::from_recording(truth).map_err(|error| error.to_string())?,
        None => Truth::of_run(&recording).map_err(|error| format!("{error}; give it with --truth"))?,
    };
    let mut options = if wish.same { Options::same_clock_and_frame() } else { Options::default() };
    options.mounting_known = wish.mounting_known;
    if let Some(known) = known {
        options.registration = RegistrationChoice::Known(known);
    }
    if let ClockChoice::Fit { expected_offset_s, window_s, .. } = &mut options.clock {
        let stated = || separate.as_ref().and_then(|truth| stated_offset_s(&recording, truth));
        if let Some(found) = offset_s.or_else(stated) {
            *expected_offset_s = found;
            let source = if offset_s.is_some() { "as told" } else { "by the start times of both" };
            let how = if wish.clock_known { "taken as exact".to_owned() } else { format!("searched {window_s} s to both sides") };
            say!("the truth's time 0 is at {found:.3} s of the states, {source}; {how}");
        }
        if wish.clock_known {
            options.clock = ClockChoice::Known(Clock { offset_s: *expected_offset_s, ..Clock::IDENTITY });
        }
    }
    let paired = pair(&reported, &frames, &options).map_err(|error| format!("{}: {error}", run.display()))?;
    if wish.mounting_known && paired.report.orientation.is_none() {
        let what = "--mounting-known: states and truth do not both have orientations";
        return Err(format!("{}: {what}; leave it out, or give a truth with qw, qx, qy, qz", run.display()));
    }
    if let Some(format) = format {
        let is_green = recording.metadata.get("arm").is_some_and(|arm| arm == Side::Green.name());
        let side = if is_green { Side::Green } else { Side::Gold };
        recording_with_truth(wish, &paired, side, format)?;
    } else {
        let text = table(&paired, &recording);
        output::all(out, text.as_bytes())?;
    }
    let report = out.with_extension("report.json");
    output::all(&report, paired.report.to_json().as_bytes())?;
    output::say(format_args!("{}", paired.report));
    say!("{}: {} pairs; {}: the report", out.display(), paired.pairs.len(), report.display());
    if let Some(cameras) = wish.register {
        let name = run.file_name().unwrap_or_default().to_string_lossy();
        registration::write(cameras, &paired.report.registration, &name)?;
        say!("{}: [registration] is that of this run; a constant error of the arm is in it", cameras.display());
    }
    Ok(status)
}

/// The run as a table of one arm: the one that is asked for, or that there is.
fn of_one_arm(run: &Path, arm: Option<&str>) -> Result<Box<dyn TableSource>, String> {
    let options = tidy::Options { orientation: true, ..tidy::Options::default() };
    let table = |arms| tidy::open(run, tidy::Options { arms, ..options }).map_err(|error| error.to_string());
    let source = table(None)?;
    let is_of_both = tidy::has_both_arms(source.columns());
    let held = source.metadata().iter().find(|(key, _)| key == "arm").map(|(_, held)| held.as_str());
    match arm {
        _ if is_of_both && !is_of_states(run)? => {
            Err(format!("{}: is a table of both arms; give the recording of states, or convert that with --arm", run.display()))
        }
        None if is_of_both => Err(format!("{}: holds both arms; say which one with --arm gold or --arm green", run.display())),
        Some(arm) if is_of_both => table(Some(if arm == "green" { Arms::Green } else { Arms::Gold })),
        Some(arm) if held.is_some_and(|held| held != arm) => {
            Err(format!("{}: is of the {} arm; leave --arm out", run.display(), held.unwrap_or_default()))
        }
        _ => Ok(source),
    }
}

fn is_of_states(run: &Path) -> Result<bool, String> {
    Ok(matches!(open(run).map_err(|error| error.to_string())?, Opened::States(_)))
}

/// The states as they are, and after the last one before each pair its true position: on the states' clock, in frame 0. Truth that
/// the recording held for that arm is left out.
fn recording_with_truth(wish: &Wish, paired: &Paired, side: Side, format: StateFormat) -> Result<(), String> {
    let (run, out) = (wish.run, wish.out);
    let Opened::States(mut source) = open(run).map_err(|error| error.to_string())? else {
        let remedy = "name the output .csv for the table of pairs, or convert the run to .mcap first";
        return Err(format!(
            "{}: is a table, not a recording of states: {} cannot be made of it; {remedy}",
            run.display(),
            out.display()
        ));
    };
    let mut metadata = source.metadata().to_vec();
    if !wish.same && !stream::is_truth_measured(&metadata) {
        let (key, value) = stream::TRUTH_MEASURED;
        metadata.push((key.to_owned(), value.to_owned()));
    }
    let mut sink = save::create_states(out, format, &metadata).map_err(|error| error.to_string())?;
    let mut pairs = paired.pairs.iter().peekable();
    let mut start_ns = None;
    let truth_of = |pair: &Pair, time_ns: i64| {
        Record::Truth(stream::Truth {
            position_m: pair.truth_m,
            // With a fitted mounting it is the truth but for a constant: not to be learnt from.
            quaternion_wxyz: pair.truth_wxyz.filter(|_| wish.mounting_known).unwrap_or([f64::NAN; 4]),
            ..stream::Truth::unknown(time_ns, side)
        })
    };
    let at_ns = |start_ns: i64, pair: &Pair| start_ns + (pair.state_time_s * 1e9).round() as i64;
    while let Some(record) = source.next().map_err(|error| error.to_string())? {
        let time_ns = record.time_ns();
        match &record {
            Record::State(_) => {
                let start_ns = *start_ns.get_or_insert(time_ns);
                while let Some(pair) = pairs.next_if(|pair| at_ns(start_ns, pair) < time_ns) {
                    sink.write(&truth_of(pair, at_ns(start_ns, pair))).map_err(|error| error.to_string())?;
                }
            }
            Record::Truth(truth) if truth.side == side => continue,
            Record::Truth(_) => {}
        }
        sink.write(&record).map_err(|error| error.to_string())?;
    }
    // Those of the last state.
    for pair in pairs {
        sink.write(&truth_of(pair, at_ns(start_ns.unwrap_or(0), pair))).map_err(|error| error.to_string())?;
    }
    sink.finish().map_err(|error| error.to_string())
}

/// One row per pair: times on both clocks, reported and true position and the label, mm, frame 0.
fn table(paired: &Paired, recording: &Recording) -> String {
    let mut text = format!("# recording = {}\n# label = truth - reported, frame 0 of the arm\n", recording.name.escape_debug());
    text.push_str("t_s,truth_t_s,x_mm,y_mm,z_mm,truth_x_mm,truth_y_mm,truth_z_mm,label_x_mm,label_y_mm,label_z_mm\n");
    for pair in &paired.pairs {
        let _ = write!(text, "{:.9},{:.9}", pair.state_time_s, pair.truth_time_s);
        for value in pair.reported_m.iter().chain(&pair.truth_m).chain(&pair.label_m) {
            let _ = write!(text, ",{:.6}", value * 1e3);
        }
        text.push('\n');
    }
    text
}
