//! `ravenpose vision`: where the cameras stand, and where the end effector is in their images.

use crate::output;
use crate::progress::Progress;
use crate::read::PARTLY;
use crate::registration;
use ::vision::commands::{self, Calibrated};
use ::vision::marking::Marking;
use ::vision::marking::server::Server;
use ::vision::outcome::Tracked;
use ::vision::track::Mode;
use ::vision::video::{self, Shot, Source};
use clap::Subcommand;
use recordings::mcap_file::ImageSource;
use recordings::open::Kind;
use recordings::stream::StreamError;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

/// What to do.
#[derive(Subcommand)]
pub(crate) enum Wish {
    /// Poses and lenses of all cameras from their chessboards and hand-marked markers
    Calibrate {
        /// Folder with rig.toml, markers.csv and chessboard/
        rig: PathBuf,
        /// cameras.toml to write
        #[arg(long)]
        out: PathBuf,
        /// Each camera by itself, lenses as given, as in the paper
        #[arg(long)]
        paper: bool,
    },
    /// Pose of the end effector in each frame of a recording, or `lost`
    Track {
        /// cameras.toml of `vision calibrate`
        #[arg(long)]
        cameras: PathBuf,
        /// Folder with rig.toml, frames.csv and frames/
        scene: PathBuf,
        /// truth.csv to write
        #[arg(long)]
        out: PathBuf,
        /// Hough circles, midpoints, Nelder-Mead, as in the paper
        #[arg(long)]
        paper: bool,
        /// Folder for index.html: which circles were found, which were suspended and why
        #[arg(long)]
        overlay: Option<PathBuf>,
    },
    /// Frames of a scene from webcams or video files, one per camera
    Record {
        /// CAMERA=SOURCE: a name of rig.toml, and /dev/videoN, a video file or a recording of `ravenpose record`
        #[arg(required = true)]
        sources: Vec<String>,
        /// Folder with rig.toml
        #[arg(long)]
        rig: PathBuf,
        /// New scene folder to write
        #[arg(long)]
        out: PathBuf,
        /// Stop after so many seconds; needed for webcams
        #[arg(long)]
        seconds: Option<f64>,
        /// Frames of the scene per second
        #[arg(long, default_value_t = 15.0)]
        frames_per_s: f64,
        /// Program for videos other than AVI of Motion JPEG, ffmpeg by itself; given, also for webcams, which are read directly otherwise
        #[arg(long)]
        ffmpeg: Option<PathBuf>,
    },
    /// Click the markers in the images, on a page of this machine; markers.csv is written with each click
    Mark {
        /// Folder with rig.toml
        rig: PathBuf,
        /// Folder with NAME.jpg or .png of each camera, else markers/, the first of frames/NAME/, or chessboard/ of the rig
        #[arg(long)]
        images: Option<PathBuf>,
        /// Port of 127.0.0.1; 0 takes any free one
        #[arg(long, default_value_t = 8470)]
        port: u16,
    },
    /// Camera images of a simulated recording, in the format that calibrate and track read, with the truth beside them
    Render {
        /// Recording with the true pose of the end effector (`ravenpose simulate`)
        run: PathBuf,
        /// New folder to write
        #[arg(long)]
        out: PathBuf,
        /// easy, occlusion, hard, or a file (docs/vision.md lists its keys)
        #[arg(long, default_value = "easy")]
        scene: String,
        /// Rig, placement errors and noise follow from it
        #[arg(long, default_value_t = 0)]
        seed: u64,
        /// Length, from the recording's beginning
        #[arg(long, default_value_t = 10.0)]
        seconds: f64,
    },
}

pub(crate) fn run(wish: &Wish) -> Result<ExitCode, String> {
    match wish {
        Wish::Calibrate { rig, out, paper } => calibrate(rig, out, mode(*paper)),
        Wish::Track { cameras, scene, out, paper, overlay } => track(cameras, scene, out, mode(*paper), overlay.as_deref()),
        Wish::Record { sources, rig, out, seconds, frames_per_s, ffmpeg } => {
            record(sources, rig, out, *seconds, *frames_per_s, ffmpeg.as_deref())
        }
        Wish::Mark { rig, images, port } => mark(rig, images.as_deref(), *port),
        Wish::Render { run, out, scene, seed, seconds } => render(run, out, scene, *seed, *seconds),
    }
}

fn mode(paper: bool) -> Mode {
    if paper { Mode::Paper } else { Mode::Default }
}

fn calibrate(rig: &Path, out: &Path, mode: Mode) -> Result<ExitCode, String> {
    let inputs = ["rig.toml", "markers.csv"].map(|name| rig.join(name));
    output::check_file(out, &inputs.each_ref().map(PathBuf::as_path))?;
    let found = commands::calibrate(rig, mode).map_err(|error| error.to_string())?;
    let kept = registration::kept(out);
    let text = commands::cameras_text(&found) + kept.as_deref().unwrap_or_default();
    output::all(out, text.as_bytes())?;
    let _ = output::say(format_args!("{}", calibrated_words(&found)));
    if kept.is_some() {
        say!(
            "note: {}: its [registration] is kept; if the markers were moved since, write it anew: ravenpose pair --register",
            out.display()
        );
    }
    for remark in &found.remarks {
        complain!("ravenpose: {remark}");
    }
    Ok(ExitCode::SUCCESS)
}

fn calibrated_words(found: &Calibrated) -> String {
    let mut lines = Vec::new();
    for known in &found.cameras {
        let c = known.camera.centre_m * 1e3;
        lines.push(format!(
            "{}: at {:.1}, {:.1}, {:.1} mm, markers {:.2} px RMS, work space seen to {:.2} px",
            known.camera.name, c.x, c.y, c.z, known.reprojection_rms_px, known.bearing_px
        ));
    }
    for odd in &found.contradictions {
        let what = odd.camera.as_ref().map_or_else(|| "its place".to_owned(), |camera| format!("its mark in {camera}"));
        lines.push(format!(
            "marker {} (markers.csv line {}): {what} contradicts the rest by {:.1} px and was left out",
            odd.marker, odd.line, odd.off_px
        ));
    }
    lines.join("\n") + "\n"
}

fn track(cameras: &Path, scene: &Path, out: &Path, mode: Mode, overlay: Option<&Path>) -> Result<ExitCode, String> {
    let inputs = ["rig.toml", "frames.csv"].map(|name| scene.join(name));
    output::check_file(out, &[cameras, &inputs[0], &inputs[1]])?;
    if let Some(folder) = overlay {
        output::check_folder(folder, "--overlay")?;
    }
    let mut progress = Progress::frames();
    let tracked = commands::track(cameras, scene, mode, &mut |done, all| progress.at(done as u64, all as u64));
    progress.end();
    let tracked = tracked.map_err(|error| error.to_string())?;
    output::all(out, commands::truth_text(&tracked).as_bytes())?;
    let _ = output::say(format_args!("{}", tracked_words(&tracked)));
    if let Some(folder) = overlay {
        let text = commands::overlay_text(cameras, scene, &tracked).map_err(|error| error.to_string())?;
        output::make_folder(folder)?;
        let page = folder.join("index.html");
        output::all(&page, text.as_bytes())?;
        say!("{}: the frames, with what was found in them", page.display());
    }
    Ok(ExitCode::SUCCESS)
}

fn tracked_words(tracked: &Tracked) -> String {
    let measured = tracked.rows.iter().filter(|row| row.found.is_ok()).count();
    let mut lines = vec![format!("{measured} of {} frames measured", tracked.rows.len())];
    for row in tracked.rows.iter().filter(|row| row.found.is_err()) {
        if let Err(lost) = &row.found {
            lines.push(format!("frame {} lost: {}", row.frame, lost.words(&tracked.balls)));
        }
    }
    lines.extend(tracked.moved().map(|(camera, [odd, seen])| {
        format!(
            "{}: contradicts the others, or shows no ball where they see it, in {odd} of the {seen} frames of which it has an image; if nothing is in \
             its way it has moved: calibrate anew",
            tracked.cameras[camera]
        )
    }));
    for remark in tracked.rows.iter().flat_map(|row| &row.remarks) {
        lines.push(remark.clone());
    }
    if let Some(exposure_s) = tracked.exposure_s {
        lines.push(format!("exposure {:.1} ms: poses moved back to its beginning", exposure_s * 1e3));
    }
    lines.join("\n") + "\n"
}

/// Told by its first bytes: the recording may be one that was cut off, RUN.mcap.part. A device is not read for that.
fn is_mcap(path: &Path) -> bool {
    path.is_file() && recordings::open::kind(path).is_ok_and(|kind| kind == Kind::Mcap)
}

/// A camera's images in a recording of `ravenpose record`.
struct Recorded {
    path: PathBuf,
    images: ImageSource,
}

impl Recorded {
    fn open(path: &Path, camera: &str) -> Result<Self, String> {
        let images = ImageSource::open(path, camera).map_err(|error| error.to_string())?;
        Ok(Self { path: path.to_owned(), images })
    }
}

impl Source for Recorded {
    fn next(&mut self) -> ::vision::Result<Option<Shot>> {
        let image = self.images.next_image().map_err(|error| {
            let StreamError { what, remedy, .. } = error;
            ::vision::Error::content(&self.path, "images", what, remedy)
        })?;
        if image.is_none()
            && let Some(damage) = self.images.damage()
        {
            complain!("{}: {}: {}; images before it are there", self.path.display(), damage.place, damage.what);
        }
        Ok(image.map(|image| Shot { t_s: image.time_ns as f64 / 1e9, taken_ns: None, jpeg: image.jpeg }))
    }

    fn since_1970(&self) -> bool {
        true
    }
}

fn record(
    sources: &[String],
    rig: &Path,
    out: &Path,
    seconds: Option<f64>,
    frames_per_s: f64,
    ffmpeg: Option<&Path>,
) -> Result<ExitCode, String> {
    let rig = ::vision::rig::read(rig).map_err(|error| error.to_string())?;
    let names: Vec<&str> = rig.cameras.iter().map(|camera| camera.name.as_str()).collect();
    let mut opened: Vec<Option<Box<dyn Source>>> = names.iter().map(|_| None).collect();
    for source in sources {
        let (name, path) =
            source.split_once('=').ok_or_else(|| format!("{source}: is not CAMERA=SOURCE; write cam0=/dev/video0"))?;
        let Some(index) = names.iter().position(|own| *own == name) else {
            return Err(format!("{source}: camera {name} is not in {}; it holds {}", rig.file.display(), names.join(", ")));
        };
        if opened[index].is_some() {
            return Err(format!("{source}: camera {name} has a source already; give each camera one"));
        }
        let own = if is_mcap(Path::new(path)) {
            Box::new(Recorded::open(Path::new(path), name)?)
        } else {
            video::open(Path::new(path), ffmpeg, rig.size_px, frames_per_s).map_err(|error| error.to_string())?
        };
        if own.live() && seconds.is_none() {
            return Err(format!("{source}: a webcam has no end; say how long with --seconds"));
        }
        opened[index] = Some(own);
    }
    let mut progress = Progress::frames();
    let made = video::record::record(&rig, opened, frames_per_s, seconds, out, &mut |done, all| {
        progress.at(done as u64, all.max(done) as u64);
    });
    progress.end();
    let made = made.map_err(|error| error.to_string())?;
    let images: Vec<String> = names.iter().zip(&made.images).map(|(name, count)| format!("{name} {count}")).collect();
    say!("{}: {} frames; images: {}", out.display(), made.frames, images.join(", "));
    let mut status = ExitCode::SUCCESS;
    for (name, damaged) in names.iter().zip(&made.damaged).filter(|(_, damaged)| **damaged > 0) {
        complain!("ravenpose: camera {name}: {damaged} images were damaged and are left out");
        status = ExitCode::from(PARTLY);
    }
    for (camera, after_s, said) in &made.ended {
        let said = said.as_deref().unwrap_or("its video is shorter than another");
        complain!("ravenpose: camera {}: ended after {after_s:.1} s: {said}; record again what is missing", names[*camera]);
        status = ExitCode::from(PARTLY);
    }
    Ok(status)
}

fn mark(rig: &Path, images: Option<&Path>, port: u16) -> Result<ExitCode, String> {
    let marking = Marking::open(rig, images, |path, text| output::all(path, text.as_bytes())).map_err(|error| error.to_string())?;
    let file = marking.file();
    let server = Server::bind(marking, port).map_err(|error| error.to_string())?;
    say!("{}: open it in a browser of this machine; Finish or Ctrl-C ends", server.url());
    say!("{}: {} marks", file.display(), server.run());
    Ok(ExitCode::SUCCESS)
}

const TRUE_PLACE: [&str; 3] = ["truth_x_m", "truth_y_m", "truth_z_m"];
const TRUE_TURN: [&str; 4] = ["truth_qw", "truth_qx", "truth_qy", "truth_qz"];

fn render(run: &Path, out: &Path, scene: &str, seed: u64, seconds: f64) -> Result<ExitCode, String> {
    let scene = renderer::Scene::named(scene).map_err(|error| error.to_string())?;
    let (recording, status) = crate::read::read(run)?;
    let column = |name: &str| {
        recording.column(name).ok_or_else(|| {
            format!("{}: no column {name}; give a recording of ravenpose simulate, which holds the true pose", run.display())
        })
    };
    let (mut place, mut turn) = ([&[][..]; 3], [&[][..]; 4]);
    for (own, name) in place.iter_mut().zip(TRUE_PLACE).chain(turn.iter_mut().zip(TRUE_TURN)) {
        *own = column(name)?;
    }
    let motion =
        renderer::Motion::new(&run.display().to_string(), column("t_s")?, place, turn).map_err(|error| error.to_string())?;
    let mut progress = Progress::images();
    let made = renderer::render(&scene, &motion, seed, seconds, out, &mut |done, all| progress.at(done as u64, all as u64));
    progress.end();
    let made = made.map_err(|error| error.to_string())?;
    say!("{}: {} frames of {} cameras, balls in view of two of them in {}", out.display(), made.frames, made.cameras, made.in_view);
    Ok(status)
}
