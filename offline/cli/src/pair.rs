//! `ravenpose pair`: reported and true tip positions of the same moments, with the clock and the frame between them.

use crate::{output, plot};
use recordings::Recording;
use recordings::pairs::{ClockChoice, Options, Reported, Truth, pair, stated_offset_s};
use std::fmt::Write as _;
use std::path::Path;
use std::process::ExitCode;

/// `same`: the truth is on the states' clock and in frame 0 of the arm (a simulation, an earlier registration). `offset_s`: what is
/// known of the clocks' offset; otherwise the two recordings' own start times, otherwise that they begin together.
pub(crate) fn run(run: &Path, truth: Option<&Path>, out: &Path, same: bool, offset_s: Option<f64>) -> Result<ExitCode, String> {
    if offset_s.is_some_and(|offset_s| !offset_s.is_finite()) {
        return Err("--offset-s: must be a number of seconds".to_owned());
    }
    let recording = plot::read(run)?;
    let separate = truth.map(plot::read).transpose()?;
    let reported = Reported::from_recording(&recording).map_err(|error| error.to_string())?;
    let frames = Truth::from_recording(separate.as_ref().unwrap_or(&recording)).map_err(|error| error.to_string())?;
    let mut options = if same { Options::same_clock_and_frame() } else { Options::default() };
    if let ClockChoice::Fit { expected_offset_s, window_s, .. } = &mut options.clock {
        let stated = || separate.as_ref().and_then(|truth| stated_offset_s(&recording, truth));
        if let Some(found) = offset_s.or_else(stated) {
            *expected_offset_s = found;
            let source = if offset_s.is_some() { "as told" } else { "by the start times of both" };
            say!("the truth's time 0 is at {found:.3} s of the states, {source}; searched {window_s} s to both sides");
        }
    }
    let paired = pair(&reported, &frames, &options).map_err(|error| format!("{}: {error}", run.display()))?;
    let text = table(&paired, &recording);
    output::whole(out, |file| file.write_all(text.as_bytes()).map_err(|error| error.to_string()))?;
    let report = out.with_extension("report.json");
    output::whole(&report, |file| file.write_all(paired.report.to_json().as_bytes()).map_err(|error| error.to_string()))?;
    output::say(format_args!("{}", paired.report));
    say!("{}: {} pairs; {}: the report", out.display(), paired.pairs.len(), report.display());
    Ok(ExitCode::SUCCESS)
}

/// One row per pair: times on both clocks, reported and true position and the label, mm, frame 0.
fn table(paired: &recordings::pairs::Paired, recording: &Recording) -> String {
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
