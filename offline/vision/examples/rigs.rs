//! Many rigs of our own rendering, measured against their truth: `cargo run --release -p ravenpose-vision --example rigs -- [FRAMES [SEED]]`
//!
//! One line per rig: what is unusual about it, frames measured, wrong ones (more than 2 mm off), error in space, orientation.

use renderer::{Motion, Scene, render};
use vision::accuracy::{compare, read_truth};
use vision::commands;
use vision::track::Mode;

/// What is unusual, as lines of a scene file.
const RIGS: [&str; 20] = [
    "",
    "tool = true",
    "tool = true\nlight = [1.0, 0.6, 0.1]\nambient = 0.35\nnoise = 5.0\nexposure_ms = 10.0\nclutter = 3\nblack = 0.05",
    "cameras = 3",
    "cameras = 5\ntool = true",
    "resolution = [640, 480]",
    "resolution = [640, 480]\nfocal = 0.8\nclutter = 4\nnoise = 4.0",
    "focal = 0.75\ndistortion = -0.25",
    "focal = 1.8\ndistance_mm = 900.0",
    "distortion = 0.15",
    "tint = [1.0, 0.7, 0.4]\nbrightness = 0.6",
    "tint = [0.6, 0.8, 1.0]\nbrightness = 0.45\nnoise = 4.0",
    "brightness = 0.3\nnoise = 4.0",
    "background = 0.5",
    "background = 0.8\ngamma = 2.2",
    "clutter = 12",
    "gamma = 2.2",
    "balls = [\"blue\", \"red\", \"green\"]\nclutter = 4",
    "missing = 0.15\nblack = 0.1",
    "exposure_ms = 25.0\ntool = true",
];

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut arguments = std::env::args().skip(1);
    let frames: usize = arguments.next().map_or(Ok(12), |text| text.parse())?;
    let seed: u64 = arguments.next().map_or(Ok(1), |text| text.parse())?;
    let only: Option<String> = arguments.next();
    let motion = Motion::wandering(seed);
    for (index, text) in RIGS.iter().enumerate().filter(|(index, _)| only.as_ref().is_none_or(|o| *o == index.to_string())) {
        let scene = Scene::parse("rig", text)?;
        let folder = std::env::temp_dir().join(format!("ravenpose-rigs-{}-{index}", std::process::id()));
        let seconds = (frames as f64 - 0.5) / scene.frames_per_s;
        let rendered = render(&scene, &motion, seed, seconds, &folder, &mut |_, _| {})?;
        let words = measured(&folder).unwrap_or_else(|error| format!("REFUSED: {error}"));
        println!("{index:2} [{}] {} frames, {} in view: {words}", text.replace('\n', ", "), rendered.frames, rendered.in_view);
        if std::env::var_os("KEEP").is_none() {
            std::fs::remove_dir_all(&folder)?;
        }
    }
    Ok(())
}

fn measured(folder: &std::path::Path) -> Result<String, vision::Error> {
    let calibrated = commands::calibrate(folder, Mode::Default)?;
    let file = folder.join("cameras.toml");
    std::fs::write(&file, commands::cameras_text(&calibrated)).map_err(vision::Error::write(&file))?;
    let tracked = commands::track(&file, folder, Mode::Default, &mut |_, _| {})?;
    let truth = read_truth(&folder.join("truth.csv"))?;
    let rig = vision::rig::read(folder)?;
    let lost: Vec<String> =
        tracked.rows.iter().filter_map(|row| row.found.as_ref().err().map(|lost| format!("{lost:?}"))).collect();
    let Some(found) = rig.fixture.as_ref().and_then(|fixture| compare(&tracked, &truth, fixture)) else {
        return Ok(format!("0 measured {lost:?}"));
    };
    let bad = if found.wrong > 0 { "WRONG " } else { "" };
    Ok(format!(
        "{} measured, {bad}{} wrong, {:.3} mm RMS, {:.3} worst, {:.2} deg; {}{}",
        found.measured,
        found.wrong,
        found.end_effector.rms_mm[3],
        found.end_effector.worst_mm,
        found.orientation_deg,
        lost.join(" "),
        calibrated.remarks.join(" ")
    ))
}
