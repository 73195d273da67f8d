//! Table I against the truth of rendered scenes: `cargo run --release -p ravenpose-vision --example accuracy -- FOLDER...`
//!
//! Each folder is rig and scene in one, with `truth.csv`. Default and paper mode, and the cause: with the true cameras
//! (`cameras_true.json`) what is left is the error of the circles.

use std::path::Path;
use std::time::Instant;
use vision::accuracy::{HEAD, compare, lines, read_truth};
use vision::commands;
use vision::track::Mode;

fn main() -> Result<(), vision::Error> {
    print!("{HEAD}");
    let mut notes = Vec::new();
    for folder in std::env::args().skip(1) {
        let folder = Path::new(&folder);
        let name = folder.file_name().map_or_else(String::new, |name| name.to_string_lossy().into_owned());
        let truth = read_truth(&folder.join("truth.csv"))?;
        let rig = vision::rig::read(folder)?;
        let Some(fixture) = &rig.fixture else { continue };
        for (mode, label) in [(Mode::Default, "default"), (Mode::Paper, "paper")] {
            let calibrated = commands::calibrate(folder, mode)?;
            let file = std::env::temp_dir().join(format!("ravenpose-accuracy-{}.toml", std::process::id()));
            commands::write_cameras(&calibrated, &file)?;
            let begun = Instant::now();
            let tracked = commands::track(&file, folder, mode, &mut |_, _| {});
            let seconds = begun.elapsed().as_secs_f64();
            drop(std::fs::remove_file(&file));
            let tracked = tracked?;
            let frames = tracked.rows.len();
            match compare(&tracked, &truth, fixture) {
                Some(found) => {
                    print!("{}", lines(&format!("{name}, {label}"), &found));
                    notes.push(format!(
                        "{name}, {label}: {} of {frames} frames measured, {} wrong, orientation {:.3} deg RMS, {:.1} frames/s",
                        found.measured,
                        found.wrong,
                        found.orientation_deg,
                        frames as f64 / seconds
                    ));
                }
                None => notes.push(format!("{name}, {label}: 0 of {frames} frames measured")),
            }
        }
    }
    println!("\n{}", notes.join("\n"));
    Ok(())
}
