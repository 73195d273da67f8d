//! Table I against the truth of rendered scenes: `cargo run --release -p ravenpose-vision --example accuracy -- FOLDER...`
//!
//! Each folder is rig and scene in one, with `truth.csv`. Default and paper mode, and the cause where
//! `cameras_true.json` is there: with true cameras what is left is the error of the circles, with true circles that of the cameras.

use std::path::Path;
use std::time::Instant;
use vision::accuracy::{HEAD, compare, line, lines, of_cameras, read_true_cameras, read_truth};
use vision::commands;
use vision::track::{Mode, track};

fn main() -> Result<(), vision::Error> {
    print!("{HEAD}");
    let mut notes = Vec::new();
    for folder in std::env::args().skip(1) {
        let folder = Path::new(&folder);
        let name = folder.file_name().map_or_else(String::new, |name| name.to_string_lossy().into_owned());
        let truth = read_truth(&folder.join("truth.csv"))?;
        let rig = vision::rig::read(folder)?;
        let Some(fixture) = &rig.fixture else { continue };
        let names: Vec<String> = rig.cameras.iter().map(|camera| camera.name.clone()).collect();
        if let Ok(real) = read_true_cameras(&folder.join("cameras_true.json"), &names, rig.size_px) {
            let tracked = track(&real, &vec![0.1; real.len()], &rig, folder, Mode::Default, &mut |_, _| {})?;
            if let Some(found) = compare(&tracked, &truth, fixture) {
                print!("{}", line(&format!("{name}, default"), "end effector, true cameras", &found.end_effector));
            }
            for (mode, label) in [(Mode::Default, "default"), (Mode::Paper, "paper")] {
                let cameras: Vec<_> = commands::calibrate(folder, mode)?.cameras.into_iter().map(|known| known.camera).collect();
                if let Some(spread) = of_cameras(&cameras, &real, &truth, fixture) {
                    print!("{}", line(&format!("{name}, {label}"), "end effector, true circles", &spread));
                }
            }
        }
        for (mode, label) in [(Mode::Default, "default"), (Mode::Paper, "paper")] {
            let calibrated = commands::calibrate(folder, mode)?;
            let file = std::env::temp_dir().join(format!("ravenpose-accuracy-{}.toml", std::process::id()));
            std::fs::write(&file, commands::cameras_text(&calibrated)).map_err(vision::Error::write(&file))?;
            let (begun, cpu_s) = (Instant::now(), cpu_s());
            let tracked = commands::track(&file, folder, mode, &mut |_, _| {});
            let (seconds, cpu_s) = (begun.elapsed().as_secs_f64(), self::cpu_s() - cpu_s);
            drop(std::fs::remove_file(&file));
            let tracked = tracked?;
            let frames = tracked.rows.len();
            match compare(&tracked, &truth, fixture) {
                Some(found) => {
                    print!("{}", lines(&format!("{name}, {label}"), &found));
                    notes.push(format!(
                        "{name}, {label}: {} of {frames} frames measured, {} wrong, orientation {:.3} deg RMS, {:.1} frames/s, {:.0} ms of one core per frame",
                        found.measured,
                        found.wrong,
                        found.orientation_deg,
                        frames as f64 / seconds,
                        1e3 * cpu_s / frames as f64
                    ));
                }
                None => notes.push(format!("{name}, {label}: 0 of {frames} frames measured")),
            }
        }
    }
    println!("\n{}", notes.join("\n"));
    Ok(())
}

/// Processor time of this process, s; on a busy machine it says more than the clock.
fn cpu_s() -> f64 {
    let stat = std::fs::read_to_string("/proc/self/stat").unwrap_or_default();
    // Fields 14 and 15, user and system, in hundredths of a second.
    stat.split_whitespace().skip(13).take(2).filter_map(|ticks| ticks.parse::<f64>().ok()).sum::<f64>() / 100.0
}
