//! The folder of a rendered recording: images, what the lab knows, and the truth.

use crate::backdrop::{self, Plate};
use crate::error::{Error, Result};
use crate::eye::{Lens, Sights};
use crate::film::{Grain, blurred, developed};
use crate::motion::Motion;
use crate::random::Random;
use crate::rig::{CORNERS, Rig, SQUARE_M, WORKSPACE_M};
use crate::scene::Scene;
use crate::stage::Stage;
use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};
use std::fmt::Write as _;
use std::path::Path;
use std::sync::atomic::{AtomicUsize, Ordering};

/// What was rendered.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Rendered {
    /// Frames.
    pub frames: usize,
    /// Cameras.
    pub cameras: usize,
    /// Frames in which two cameras have all balls in their image, hidden or not.
    pub in_view: usize,
}

/// Renders a recording from its first moment on, `seconds` long at most, into a new folder: `rig.toml`, `markers.csv`,
/// `chessboard/`, `markers/` (to mark anew), `frames.csv`, `frames/`, and for judging only `truth.csv`, `cameras_true.json`, `registration_true.json`.
/// Everything follows from scene, motion and `seed`. `progress` is told images done and in all.
///
/// # Errors
/// If the folder holds something, something cannot be written, or the motion is shorter than a frame.
pub fn render(
    scene: &Scene,
    motion: &Motion,
    seed: u64,
    seconds: f64,
    out: &Path,
    progress: &mut dyn FnMut(usize, usize),
) -> Result<Rendered> {
    // One without a name of its own ("." and "..") cannot be put in place whole.
    if std::fs::read_dir(out).is_ok_and(|mut entries| entries.next().is_some()) || out.is_file() || out.file_name().is_none() {
        return Err(Error::Occupied { folder: out.display().to_string() });
    }
    let aside = out.with_extension(format!("part{}", std::process::id()));
    let made = all(scene, motion, seed, seconds, &aside, progress)
        .and_then(|rendered| std::fs::rename(&aside, out).map_err(|error| Error::write(out, &error)).map(|()| rendered));
    if made.is_err() {
        // What is left of it is of no use to anybody.
        drop(std::fs::remove_dir_all(&aside));
    }
    made
}

fn all(
    scene: &Scene,
    motion: &Motion,
    seed: u64,
    seconds: f64,
    out: &Path,
    progress: &mut dyn FnMut(usize, usize),
) -> Result<Rendered> {
    let [from_s, last_s] = motion.span_s();
    let to_s = last_s.min(from_s + seconds.max(0.0));
    let frames = ((to_s - from_s) * scene.frames_per_s) as usize + 1;
    let mut random = Random::new(seed, 2);
    let tilt = Vector3::new(random.normal(), random.normal(), 0.0) * 0.06;
    let turn = UnitQuaternion::from_scaled_axis(Vector3::z() * random.between(-3.1, 3.1)) * UnitQuaternion::from_scaled_axis(tilt);
    let placed = Isometry3::from_parts(Translation3::from(WORKSPACE_M - turn * motion.middle_m(from_s, to_s)), turn);
    let rig = Rig::drawn(scene, seed);
    let stage = Stage::new(scene, motion, placed);
    let times_s: Vec<f64> = (0..frames).map(|k| from_s + k as f64 / scene.frames_per_s).collect();

    for station in &rig.stations {
        folder(&out.join("frames").join(&station.eye.name))?;
    }
    folder(&out.join("chessboard"))?;
    folder(&out.join("markers"))?;
    text(&out.join("rig.toml"), &rig_text(scene, &rig))?;
    text(&out.join("markers.csv"), &markers_text(scene, &rig, seed))?;
    text(&out.join("cameras_true.json"), &cameras_text(&rig))?;
    text(&out.join("registration_true.json"), &registration_text(scene, &placed))?;
    text(&out.join("truth.csv"), &truth_text(scene, &stage, &times_s))?;
    images(scene, &rig, &stage, &times_s, seed, out, progress)?;
    let mut list = String::from("frame,t_s\n");
    for (frame, t_s) in times_s.iter().enumerate() {
        let _ = writeln!(list, "{frame},{:.6}", t_s - scene.clock_offset_s);
    }
    text(&out.join("frames.csv"), &list)?;
    let sees_all = |t_s: f64| {
        let balls = stage.balls_m(t_s);
        rig.stations.iter().filter(|station| balls.iter().all(|ball| station.eye.sees(ball).is_some())).count() >= 2
    };
    Ok(Rendered { frames, cameras: rig.stations.len(), in_view: times_s.iter().filter(|t| sees_all(**t)).count() })
}

fn folder(path: &Path) -> Result<()> {
    std::fs::create_dir_all(path).map_err(|error| Error::write(path, &error))
}

fn text(file: &Path, content: &str) -> Result<()> {
    std::fs::write(file, content).map_err(|error| Error::write(file, &error))
}

fn picture(file: &Path, image: &image::RgbImage, quality: u8) -> Result<()> {
    let mut bytes = Vec::new();
    image::codecs::jpeg::JpegEncoder::new_with_quality(&mut bytes, quality)
        .encode_image(image)
        .map_err(|error| Error::write(file, &error))?;
    std::fs::write(file, bytes).map_err(|error| Error::write(file, &error))
}

/// All images, a thread per core.
fn images(
    scene: &Scene,
    rig: &Rig,
    stage: &Stage<'_>,
    times_s: &[f64],
    seed: u64,
    out: &Path,
    progress: &mut dyn FnMut(usize, usize),
) -> Result<()> {
    let grain = Grain::new();
    let sets: Vec<(Sights, Plate)> = rig
        .stations
        .iter()
        .enumerate()
        .map(|(camera, station)| {
            let sights = station.eye.sights();
            let wall = backdrop::wall(scene, &station.eye, &mut Random::new(seed, 100 + camera as u64));
            (sights, wall)
        })
        .collect();
    for (camera, station) in rig.stations.iter().enumerate() {
        let plate = blurred(&backdrop::board(&station.eye, &sets[camera].0, &station.board), scene.blur_px);
        // Boards are taken at leisure: in good white light.
        let plain = Scene { tint: [1.0; 3], noise: scene.noise.min(2.0), ..scene.clone() };
        let image = developed(&plate, &plain, &grain, &mut Random::new(seed, 200 + camera as u64));
        picture(&out.join("chessboard").join(format!("{}.jpg", station.eye.name)), &image, scene.jpeg_quality)?;
        let mut plate = sets[camera].1.clone();
        stage.paint_markers(&station.eye, &sets[camera].0, rig.markers.iter().map(|marker| marker.true_m), &mut plate);
        let image = developed(&blurred(&plate, scene.blur_px), scene, &grain, &mut Random::new(seed, 300 + camera as u64));
        picture(&out.join("markers").join(format!("{}.jpg", station.eye.name)), &image, scene.jpeg_quality)?;
    }
    let total = times_s.len() * rig.stations.len();
    let next = AtomicUsize::new(0);
    let one = |index: usize| -> Result<()> {
        let (frame, camera) = (index / rig.stations.len(), index % rig.stations.len());
        let mut random = Random::new(seed, 1000 + index as u64);
        let (black, missing) = (random.share() < scene.black, random.share() < scene.missing);
        let eye = &rig.stations[camera].eye;
        if missing {
            return Ok(());
        }
        let (sights, wall) = &sets[camera];
        let mut plate = wall.clone();
        stage.paint(eye, sights, times_s[frame], &mut plate);
        if black {
            plate.light.fill([0.0; 3]);
        }
        let image = developed(&blurred(&plate, scene.blur_px), scene, &grain, &mut random);
        picture(&out.join("frames").join(&eye.name).join(format!("{frame:06}.jpg")), &image, scene.jpeg_quality)
    };
    let workers = std::thread::available_parallelism().map_or(1, usize::from).min(total.max(1));
    std::thread::scope(|scope| {
        let (done, reports) = std::sync::mpsc::channel();
        for _ in 0..workers {
            let (done, next, one) = (done.clone(), &next, &one);
            scope.spawn(move || {
                loop {
                    let index = next.fetch_add(1, Ordering::Relaxed);
                    // Nobody listens any more after a fault.
                    if index >= total || done.send(one(index)).is_err() {
                        break;
                    }
                }
            });
        }
        drop(done);
        for (finished, report) in reports.iter().enumerate() {
            if let Err(error) = report {
                next.store(total, Ordering::Relaxed);
                return Err(error);
            }
            progress(finished + 1, total);
        }
        Ok(())
    })
}

fn lens_text(lens: &Lens) -> String {
    let [k1, k2, p1, p2] = lens.bend;
    format!(
        "fx = {0:.3}\nfy = {0:.3}\ncx = {1:.3}\ncy = {2:.3}\ndistortion = [{k1:.6}, {k2:.6}, {p1:.6}, {p2:.6}]  # k1 k2 p1 p2\n",
        lens.focal_px, lens.centre_px[0], lens.centre_px[1]
    )
}

fn rig_text(scene: &Scene, rig: &Rig) -> String {
    let [w, h] = scene.resolution;
    let [x, y, neg_x] = &scene.balls;
    let mut text = format!(
        "# rig as a lab would have measured it, with its errors\nresolution = [{w}, {h}]\n\n[chessboard]\nsquare_mm = {}\n\
         inner_corners = [{}, {}]\n\n[fixture]\nball_offset_mm = {:?}\nball_radius_mm = {:?}\nx_ball = \"{x}\"\ny_ball = \"{y}\"\n\
         neg_x_ball = \"{neg_x}\"\n",
        SQUARE_M * 1e3,
        CORNERS[0],
        CORNERS[1],
        scene.ball_offset_mm,
        scene.ball_radius_mm
    );
    for station in &rig.stations {
        let board = &station.believed_board;
        let origin = board.origin_m * 1e3;
        let row = |r: usize| format!("[{:.6}, {:.6}, {:.6}]", board.axes[(r, 0)], board.axes[(r, 1)], board.axes[(r, 2)]);
        let _ = write!(text, "\n[[camera]]\nname = \"{}\"\n{}", station.eye.name, lens_text(&station.believed_lens));
        let _ = writeln!(text, "chessboard_origin_mm = [{:.3}, {:.3}, {:.3}]", origin.x, origin.y, origin.z);
        let _ = writeln!(text, "chessboard_rotation = [{}, {}, {}]", row(0), row(1), row(2));
    }
    text
}

fn markers_text(scene: &Scene, rig: &Rig, seed: u64) -> String {
    let mut random = Random::new(seed, 3);
    let mut text = String::from("marker,x_mm,y_mm,z_mm,camera,u_px,v_px\n");
    for station in &rig.stations {
        for (index, marker) in rig.markers.iter().enumerate() {
            let Some([u, v]) = station.eye.sees(&marker.true_m) else { continue };
            let (du, dv) = (scene.mark_error_px * random.normal(), scene.mark_error_px * random.normal());
            let at = marker.measured_m * 1e3;
            let _ =
                writeln!(text, "m{index:02},{:.2},{:.2},{:.2},{},{:.1},{:.1}", at.x, at.y, at.z, station.eye.name, u + du, v + dv);
        }
    }
    text
}

fn cameras_text(rig: &Rig) -> String {
    let cameras: Vec<String> = rig
        .stations
        .iter()
        .map(|station| {
            let eye = &station.eye;
            let row = |r: usize| format!("[{}, {}, {}]", eye.axes[(r, 0)], eye.axes[(r, 1)], eye.axes[(r, 2)]);
            let c = eye.place_m * 1e3;
            format!(
                " {{\"C\": [{}, {}, {}], \"R\": [{}, {}, {}], \"f\": {}, \"c\": [{}, {}], \"k\": {:?}}}",
                c.x,
                c.y,
                c.z,
                row(0),
                row(1),
                row(2),
                eye.lens.focal_px,
                eye.lens.centre_px[0],
                eye.lens.centre_px[1],
                eye.lens.bend
            )
        })
        .collect();
    format!("[\n{}\n]\n", cameras.join(",\n"))
}

/// From the world to frame 0 of the recording, as a registration has to find it.
fn registration_text(scene: &Scene, placed: &Isometry3<f64>) -> String {
    let back = placed.inverse();
    let matrix = back.rotation.to_rotation_matrix();
    let row = |r: usize| format!("[{}, {}, {}]", matrix[(r, 0)], matrix[(r, 1)], matrix[(r, 2)]);
    let t = back.translation.vector * 1e3;
    format!(
        "{{\"world_to_frame_0\": {{\"rotation\": [{}, {}, {}], \"translation_mm\": [{}, {}, {}]}}, \"clock_offset_s\": {}}}\n",
        row(0),
        row(1),
        row(2),
        t.x,
        t.y,
        t.z,
        scene.clock_offset_s
    )
}

fn truth_text(scene: &Scene, stage: &Stage<'_>, times_s: &[f64]) -> String {
    let mut text = String::from("frame,t_s,x_mm,y_mm,z_mm,qw,qx,qy,qz");
    for name in &scene.balls {
        let _ = write!(text, ",{name}_x_mm,{name}_y_mm,{name}_z_mm");
    }
    text.push('\n');
    for (frame, t_s) in times_s.iter().enumerate() {
        let pose = stage.pose(*t_s);
        let (p, q) = (pose.translation.vector * 1e3, pose.rotation.quaternion());
        let _ = write!(text, "{frame},{:.6},{:.4},{:.4},{:.4}", t_s - scene.clock_offset_s, p.x, p.y, p.z);
        let _ = write!(text, ",{:.6},{:.6},{:.6},{:.6}", q.w, q.i, q.j, q.k);
        for ball in stage.balls_m(*t_s) {
            let _ = write!(text, ",{:.4},{:.4},{:.4}", ball.x * 1e3, ball.y * 1e3, ball.z * 1e3);
        }
        text.push('\n');
    }
    text
}
