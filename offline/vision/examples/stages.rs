//! Where the time of tracking goes: `cargo run --release -p ravenpose-vision --example stages -- [FRAMES]` (part of `make bench-offline`)
//!
//! Renders a recording of four 1280 x 720 cameras (balls, swinging tool, coloured discs behind), then times each stage by itself and
//! all of it as `ravenpose vision track` runs it: the clock, and processor time, which says more on a busy machine.

use renderer::{Motion, Scene as Rendering, render};
use std::time::Instant;
use vision::colour;
use vision::commands;
use vision::frame::Scene;
use vision::recording::Recording;
use vision::track::{Mode, radius_bounds_px};
use vision::update::Ledger;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let frames: usize = std::env::args().nth(1).map_or(Ok(45), |text| text.parse())?;
    let folder = std::env::temp_dir().join(format!("ravenpose-stages-{}", std::process::id()));
    let scene = Rendering::parse("stages", "tool = true\nclutter = 3\nnoise = 3.0")?;
    let rendering = Watch::start();
    render(&scene, &Motion::wandering(0), 1, (frames as f64 - 0.5) / scene.frames_per_s, &folder, &mut |_, _| {})?;
    rendering.line("render", 4 * frames, "image");
    let measured = stages(&folder);
    std::fs::remove_dir_all(&folder)?;
    Ok(measured?)
}

fn stages(folder: &std::path::Path) -> Result<(), vision::Error> {
    let calibration = Watch::start();
    let calibrated = commands::calibrate(folder, Mode::Default)?;
    calibration.line("calibrate", 1, "rig");
    let rig = vision::rig::read(folder)?;
    let Some(fixture) = &rig.fixture else { return Ok(()) };
    let recording = Recording::open(&rig, folder)?;

    let reading = Watch::start();
    let mut images = Vec::new();
    for frame in &recording.frames {
        images.push(recording.images(frame)?.into_iter().map(|(image, _)| image).collect::<Vec<_>>());
    }
    reading.line("read and decode", images.len(), "frame");

    let learning = Watch::start();
    let ranges = colour::learn(&fixture.balls, images.iter().step_by(images.len().div_ceil(8)).flatten().flatten());
    learning.line("learn colours", 1, "recording");

    let cameras: Vec<_> = calibrated.cameras.iter().map(|known| known.camera.clone()).collect();
    let scene = Scene {
        cameras: &cameras,
        bearing_px: calibrated.cameras.iter().map(|known| known.bearing_px).collect(),
        fixture,
        ranges,
        radius_px: radius_bounds_px(&cameras, fixture),
        halo_px: [0.15, 0.25],
    };
    let searching = Watch::start();
    drop(scene.measure(&images[0], None));
    searching.line("search everywhere, rims, pose", 1, "frame");
    let mut ledger = Ledger::new(cameras.len(), false);
    let following = Watch::start();
    for (frame, own) in recording.frames.iter().zip(&images) {
        let expected = ledger.expected(frame.t_s);
        match scene.measure(own, expected.as_ref().map(|(pose, near)| (pose, *near))) {
            Ok(measured) => ledger.measured(frame.t_s, &measured.fitted.pose, &measured.views),
            Err(_) => ledger.lost(&[]),
        }
    }
    following.line("rims and pose near the last ones", images.len(), "frame");

    let file = folder.join("cameras.toml");
    std::fs::write(&file, commands::cameras_text(&calibrated)).map_err(vision::Error::write(&file))?;
    let whole = Watch::start();
    let tracked = commands::track(&file, folder, Mode::Default, &mut |_, _| {})?;
    let seconds = whole.line("track, all of it", tracked.rows.len(), "frame");
    let measured = tracked.rows.iter().filter(|row| row.found.is_ok()).count();
    println!("{measured} of {} frames measured, {:.1} frames/s", tracked.rows.len(), tracked.rows.len() as f64 / seconds);
    Ok(())
}

/// Clock and processor time since a moment.
struct Watch(Instant, f64);

impl Watch {
    fn start() -> Self {
        Self(Instant::now(), cpu_s())
    }

    /// Says what a stage took; answers its seconds.
    fn line(&self, stage: &str, count: usize, unit: &str) -> f64 {
        let (seconds, cpu) = (self.0.elapsed().as_secs_f64(), cpu_s() - self.1);
        let each = 1e3 / count as f64;
        println!("{stage:34} {:8.1} ms per {unit}, {:8.1} ms of one core", seconds * each, cpu * each);
        seconds
    }
}

/// Processor time of this process, s.
fn cpu_s() -> f64 {
    let stat = std::fs::read_to_string("/proc/self/stat").unwrap_or_default();
    // Fields 14 and 15, user and system, in hundredths of a second.
    stat.split_whitespace().skip(13).take(2).filter_map(|ticks| ticks.parse::<f64>().ok()).sum::<f64>() / 100.0
}
