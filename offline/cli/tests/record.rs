//! `ravenpose record` beside a publisher of states and poses.
#![allow(missing_docs)]

#[path = "../../../tests/common/stalls.rs"]
mod stalls;

use ravenpose_transport::{Settings, Writer, now_ns};
use ravenpose_wire::{CorrectedPose, RavenState};
use recordings::mcap_file::{ImageSource, McapSource};
use recordings::stream::{Record, Source};
use stalls::despite_stops;
use std::ffi::OsString;
use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

struct World {
    folder: PathBuf,
    settings: Settings,
    /// More of the recorder's environment.
    more: Vec<(&'static str, OsString)>,
}

impl World {
    fn new(name: &str) -> Self {
        let folder = std::env::temp_dir().join(format!("ravenpose-record-{name}-{}", std::process::id()));
        std::fs::create_dir_all(&folder).expect("folder");
        let settings =
            Settings { prefix: format!("rprec{name}{}_", std::process::id()), root: format!("{}/iceoryx2/", folder.display()) };
        Self { folder, settings, more: Vec::new() }
    }

    fn record(&self, out: &Path, seconds: Option<&str>, more: &[&str]) -> Child {
        let mut command = Command::new(env!("CARGO_BIN_EXE_ravenpose"));
        command.args(["record", "--out"]).arg(out).args(more).stdout(Stdio::piped()).stderr(Stdio::piped());
        command.env("RAVENPOSE_PREFIX", &self.settings.prefix).env("RAVENPOSE_ROOT", &self.settings.root);
        command.envs(self.more.iter().map(|(name, value)| (name, value)));
        if let Some(seconds) = seconds {
            command.args(["--seconds", seconds]);
        }
        command.spawn().expect("ravenpose runs")
    }

    /// Records for so many seconds beside a publisher: the exit status, what was said, and how many states were sent.
    fn recorded(&self, out: &Path, seconds: &str, more: &[&str]) -> (Option<i32>, String, u64) {
        let stop = AtomicBool::new(false);
        std::thread::scope(|scope| {
            let publisher = scope.spawn(|| publish(&self.settings, &stop));
            let (code, said) = said(self.record(out, Some(seconds), more));
            stop.store(true, Ordering::Relaxed);
            (code, said, publisher.join().expect("publisher"))
        })
    }
}

impl Drop for World {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.folder);
        for entry in std::fs::read_dir("/dev/shm").into_iter().flatten().flatten() {
            if entry.file_name().to_string_lossy().starts_with(&self.settings.prefix) {
                let _ = std::fs::remove_file(entry.path());
            }
        }
    }
}

/// Exit status, and both of its outputs.
fn said(child: Child) -> (Option<i32>, String) {
    let output = child.wait_with_output().expect("output");
    (output.status.code(), String::from_utf8_lossy(&output.stdout).into_owned() + &String::from_utf8_lossy(&output.stderr))
}

/// States and poses at 1 kHz until told to stop; returns how many states were sent.
fn publish(settings: &Settings, stop: &AtomicBool) -> u64 {
    let states = Writer::<RavenState>::open(settings).expect("states");
    let poses = Writer::<CorrectedPose>::open(settings).expect("poses");
    let (begun, mut sequence) = (Instant::now(), 0);
    while !stop.load(Ordering::Relaxed) {
        sequence += 1;
        let mut state = RavenState::new();
        state.source_id = 77;
        state.source_time_ns = now_ns();
        state.type_ = [49, 0];
        state.arms = 1;
        state.mpos[0] = sequence as f32;
        state.seal(sequence);
        states.send(&state).expect("sent");
        let mut pose = CorrectedPose::new();
        pose.source_sequence = sequence;
        pose.publish_time_ns = now_ns();
        pose.sequence = sequence;
        pose.guard_head = sequence;
        pose.guard_tail = sequence;
        poses.send(&pose).expect("sent");
        let due = begun + Duration::from_millis(sequence);
        std::thread::sleep(due.saturating_duration_since(Instant::now()));
    }
    sequence
}

fn states_of(path: &Path) -> Vec<RavenState> {
    let mut source = McapSource::open(path).expect("MCAP");
    let mut states = Vec::new();
    while let Some(record) = source.next().expect("record") {
        if let Record::State(state) = record {
            states.push(*state);
        }
    }
    states
}

#[test]
fn what_is_recorded_is_whole_and_in_order() {
    despite_stops(|| {
        let world = World::new("whole");
        let out = world.folder.join("run.mcap");
        let (code, said, _) = world.recorded(&out, "3", &[]);
        assert!(code.is_some_and(|code| code < 2), "{said}");
        let states = states_of(&out);
        assert!(states.len() > 500, "{} states; {said}", states.len());
        assert!(states.windows(2).all(|pair| pair[0].sequence < pair[1].sequence && pair[0].source_id == 77), "{said}");
        assert!(states.iter().all(|state| state.mpos[0] == state.sequence as f32));
        // Their header is empty: readers then go by the recorder's clock.
        let header_ns = |state: &RavenState| Record::State(Box::new(*state)).time_ns();
        let ahead_ns = header_ns(&states[0]) - states[0].source_time_ns;
        assert!(states.iter().all(|state| header_ns(state) - state.source_time_ns == ahead_ns), "{ahead_ns}");
        assert!((ahead_ns - wall_clock_ahead_ns()).abs() < 2_000_000_000, "{ahead_ns}");
        let missed = states.last().expect("states").sequence - states[0].sequence + 1 - states.len() as u64;
        assert!(
            said.contains(&format!("{} states,", states.len())) && said.contains(&format!("recorder: {missed} states")),
            "{said}"
        );
        assert!(!out.with_extension("mcap.part").exists());
    });
}

/// The wall clock minus the monotonic one.
fn wall_clock_ahead_ns() -> i64 {
    let since_1970 = std::time::SystemTime::now().duration_since(std::time::UNIX_EPOCH).expect("after 1970");
    since_1970.as_nanos() as i64 - now_ns()
}

/// The number behind some words.
fn count_of(said: &str, words: &str) -> u64 {
    let digits = |text: &str| text.chars().take_while(char::is_ascii_digit).collect::<String>();
    said.split(words).nth(1).and_then(|rest| digits(rest).parse().ok()).expect("a number")
}

/// States, poses and four webcams of 1280 x 720 px, 20 images a second each.
/// `RAVENPOSE_RECORD_SECONDS=3600 cargo test --release -p ravenpose-cli --test record -- --nocapture nothing_is_lost` is the hour.
#[test]
fn nothing_is_lost() {
    match std::env::var("RAVENPOSE_RECORD_SECONDS") {
        Ok(seconds) => whole_for(&seconds, true),
        // A machine that other tests load may stall a process for longer than a link keeps states.
        Err(_) => despite_stops(|| whole_for("5", false)),
    }
}

/// All that came is in the file, and with `nothing_missed` all that was sent came.
fn whole_for(seconds: &str, nothing_missed: bool) {
    let world = World::new("long");
    let out = world.folder.join("run.mcap");
    let program = webcam(&world, "camera", [1280, 720], "1000000");
    let mut more = vec!["--ffmpeg", program.to_str().expect("UTF-8"), "--frames-per-s", "20"];
    more.extend(["--camera", "cam0=/dev/null", "--camera", "cam1=/dev/null"]);
    more.extend(["--camera", "cam2=/dev/null", "--camera", "cam3=/dev/null"]);
    let (_, said, sent) = world.recorded(&out, seconds, &more);
    let mut source = McapSource::open(&out).expect("MCAP");
    let (mut states, mut last) = (0_u64, None);
    let mut missed = 0;
    while let Some(record) = source.next().expect("record") {
        if let Record::State(state) = record {
            missed += last.map_or(0, |last: u64| state.sequence - last - 1);
            last = Some(state.sequence);
            states += 1;
        }
    }
    let images = source.channels().iter().filter(|channel| channel.topic.starts_with("/camera/")).map(|c| c.messages).sum::<u64>();
    println!("{images} images, {states} states of {sent} in the file, {missed} missed; {said}");
    // What is said is what is in the file.
    assert!(said.contains(&format!(": {states} states, ")) && said.contains(&format!("recorder: {missed} states")), "{said}");
    let counted: u64 = (0..4).map(|k| count_of(&said, &format!("cam{k}: "))).sum();
    assert_eq!(counted, images, "{said}");
    // Until the end, and most of them.
    assert!(last.is_some_and(|last| last + 3_000 > sent), "{last:?} of {sent}; {said}");
    let wanted_s = seconds.parse::<f64>().expect("seconds") - 2.0;
    assert!(images as f64 > 4.0 * 10.0 * wanted_s && states as f64 > 900.0 * wanted_s, "{said}");
    if nothing_missed {
        assert!(missed == 0 && said.matches(" images, 0 missed").count() == 4, "{said}");
    }
}

#[test]
fn a_killed_recorder_leaves_all_but_the_last_second() {
    despite_stops(|| {
        let world = World::new("killed");
        let stop = AtomicBool::new(false);
        let out = world.folder.join("run.mcap");
        let part = world.folder.join("run.mcap.part");
        let killed_ns = std::thread::scope(|scope| {
            let publisher = scope.spawn(|| publish(&world.settings, &stop));
            let mut child = world.record(&out, None, &[]);
            let begun = Instant::now();
            while begun.elapsed() < Duration::from_mins(1) && std::fs::metadata(&part).map_or(0, |meta| meta.len()) < 150_000 {
                std::thread::sleep(Duration::from_millis(20));
            }
            let killed_ns = now_ns();
            child.kill().expect("killed");
            let _ = child.wait();
            stop.store(true, Ordering::Relaxed);
            let _ = publisher.join().expect("publisher");
            killed_ns
        });
        assert!(!out.exists());
        let missing_ns = killed_ns - states_of(&part).last().expect("states").source_time_ns;
        println!("the last state is {} ms older than the kill", missing_ns / 1_000_000);
        assert!(missing_ns < 1_000_000_000, "{missing_ns} ns are missing");
    });
}

#[test]
fn nothing_is_overwritten() {
    let world = World::new("there");
    let out = world.folder.join("run.mcap");
    std::fs::write(&out, "mine").expect("file");
    let (code, said) = said(world.record(&out, Some("1"), &[]));
    assert!(code == Some(2) && said.contains("is there already"), "{code:?} {said}");
    assert_eq!(std::fs::read_to_string(&out).expect("file"), "mine");
}

/// A program that sends four images in turn, as ffmpeg sends a webcam's: 20 a second, or so many and no more.
fn webcam(world: &World, name: &str, [w, h]: [u32; 2], images: &str) -> PathBuf {
    let chunk = |id: &[u8], content: &[u8]| {
        let mut all = [id, &(content.len() as u32).to_le_bytes(), content].concat();
        all.resize(all.len() + content.len() % 2, 0);
        all
    };
    let mut header = [&b"vidsMJPG"[..], &[0; 12], &1_u32.to_le_bytes(), &20_u32.to_le_bytes()].concat();
    header.resize(56, 0);
    let stream = chunk(b"LIST", &[&b"strl"[..], &chunk(b"strh", &header)].concat());
    let head = chunk(b"LIST", &[&b"hdrl"[..], &stream].concat());
    let size = 0x7fff_ff00_u32.to_le_bytes();
    let begin = [b"RIFF", &size[..], b"AVI ", &head, b"LIST", &size, b"movi"].concat();
    std::fs::write(world.folder.join(format!("{name}-begin")), begin).expect("file");
    for index in 0..4_u32 {
        let mut jpeg = Vec::new();
        let picture = image::GrayImage::from_fn(w, h, |x, y| image::Luma([((x + 40 * index) / 3 + y * y / 400) as u8]));
        image::codecs::jpeg::JpegEncoder::new(&mut jpeg).encode_image(&picture).expect("image");
        std::fs::write(world.folder.join(format!("{name}-{index}")), chunk(b"00dc", &jpeg)).expect("file");
    }
    let program = world.folder.join(format!("{name}-ffmpeg"));
    let stem = world.folder.join(name);
    let stem = stem.display();
    let script = format!(
        "#!/bin/sh\ncat {stem}-begin\nn=0\nwhile [ $n -lt {images} ]; do cat {stem}-$((n % 4)) || exit; n=$((n + 1)); sleep 0.05; done\n"
    );
    std::fs::write(&program, script).expect("script");
    std::fs::set_permissions(&program, std::fs::Permissions::from_mode(0o755)).expect("script");
    program
}

#[test]
fn images_of_webcams_are_on_the_clock_of_the_states_and_become_a_scene() {
    despite_stops(|| {
        let world = World::new("webcams");
        let program = webcam(&world, "camera", [64, 48], "1000000");
        let out = world.folder.join("run.mcap");
        let ffmpeg = program.to_str().expect("UTF-8");
        // Any device stands for the webcam: the program asks nothing of it.
        let more = ["--ffmpeg", ffmpeg, "--camera", "cam0=/dev/null", "--camera", "cam1=/dev/zero", "--image-size", "64x48"];
        let (code, text, _) = world.recorded(&out, "3", &more);
        assert!(code.is_some_and(|code| code < 2) && text.contains("cam0: ") && text.contains("cam1: "), "{text}");
        let states = states_of(&out);
        assert!(states.len() > 500);
        let ahead_ns = wall_clock_ahead_ns();
        let wall = |monotonic_ns: i64| monotonic_ns + ahead_ns;
        let mut source = McapSource::open(&out).expect("MCAP");
        while source.next().expect("record").is_some() {}
        let channels = source.channels();
        for camera in ["cam0", "cam1"] {
            let mut images = ImageSource::open(&out, camera).expect("images");
            let all: Vec<_> = std::iter::from_fn(|| images.next_image().expect("image")).collect();
            let topic = format!("/camera/{camera}/compressed");
            let shown = channels.iter().find(|channel| channel.topic == topic).expect("channel");
            assert_eq!((shown.messages, shown.type_name.as_str()), (all.len() as u64, "sensor_msgs/CompressedImage"));
            assert!(all.len() >= 10 && all.windows(2).all(|pair| pair[0].time_ns < pair[1].time_ns));
            // The four pictures in turn, each whole.
            let begin = |name: usize| std::fs::read(world.folder.join(format!("camera-{name}"))).expect("file")[8..].to_vec();
            let first = (0..4).find(|&name| begin(name).starts_with(&all[0].jpeg)).expect("one of the pictures");
            for (index, image) in all.iter().enumerate() {
                assert!(begin((first + index) % 4).starts_with(&image.jpeg) && image.jpeg.len() > 100, "{index}");
            }
            // On one clock: the images lie in the time in which states were heard, or as long beside it as a shared machine stops.
            let (first_ns, last_ns) = (wall(states[0].source_time_ns), wall(states.last().expect("state").source_time_ns));
            let (image_ns, final_ns) = (all[0].time_ns, all.last().expect("image").time_ns);
            assert!(
                (image_ns - first_ns).abs() < 2_000_000_000 && (final_ns - last_ns).abs() < 2_000_000_000,
                "{image_ns} {first_ns}"
            );
        }
        let absent = ImageSource::open(&out, "cam7").expect("MCAP").next_image().expect_err("no such camera").to_string();
        assert!(absent.contains("/camera/cam7/compressed") && absent.contains("/camera/cam0/compressed"), "{absent}");

        let rig = world.folder.join("rig");
        std::fs::create_dir_all(&rig).expect("folder");
        let camera = |name: &str| {
            format!(
                "[[camera]]\nname = \"{name}\"\nfx = 60.0\nfy = 60.0\ncx = 32.0\ncy = 24.0\ndistortion = [0.0, 0.0, 0.0, 0.0]\n\
             chessboard_origin_mm = [0.0, 0.0, 0.0]\nchessboard_rotation = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]\n"
            )
        };
        let head = "resolution = [64, 48]\n[chessboard]\nsquare_mm = 9.0\ninner_corners = [8, 6]\n[fixture]\nball_offset_mm = 38.0\n\
                ball_radius_mm = 20.0\nx_ball = \"green\"\ny_ball = \"yellow\"\nneg_x_ball = \"red\"\n";
        std::fs::write(rig.join("rig.toml"), head.to_owned() + &camera("cam0") + &camera("cam1")).expect("file");
        let scene = world.folder.join("scene");
        let mut command = Command::new(env!("CARGO_BIN_EXE_ravenpose"));
        command.args(["vision", "record", "--frames-per-s", "20", "--rig"]).arg(&rig).arg("--out").arg(&scene);
        command
            .args(["cam0", "cam1"].map(|name| format!("{name}={}", out.display())))
            .stdout(Stdio::piped())
            .stderr(Stdio::piped());
        let (code, text) = said(command.spawn().expect("runs"));
        assert_eq!(code, Some(0), "{text}");
        let frames = std::fs::read_to_string(scene.join("frames.csv")).expect("frames.csv");
        let start: f64 =
            frames.lines().next().and_then(|line| line.strip_prefix("# start_unix_s = ")).expect("start").parse().expect("s");
        let first = ImageSource::open(&out, "cam0").expect("images").next_image().expect("image").expect("image").time_ns;
        assert!((start - first as f64 / 1e9).abs() < 1.0, "{start} {first}");
        assert!(frames.lines().count() > 10, "{frames}");
    });
}

/// Puts webcams without hardware into the recorder: `common/webcam.c`, which is `what`. `None` after saying why not.
fn with_webcams(world: &mut World, what: &str) -> Option<()> {
    let library = world.folder.join("webcam.so");
    let source = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/common/webcam.c");
    let mut compiler = Command::new("cc");
    compiler.args(["-shared", "-fPIC", "-Wall", "-Wextra", "-Werror", "-o"]).args([&library, &source]).args(["-ldl", "-lpthread"]);
    match compiler.status() {
        Ok(status) => assert!(status.success(), "{status}"),
        Err(error) => {
            println!("skipped: no C compiler for the webcam: cc: {error}");
            return None;
        }
    }
    let mut jpeg = Vec::new();
    let picture = image::GrayImage::from_fn(64, 48, |x, y| image::Luma([(3 * x + y) as u8]));
    image::codecs::jpeg::JpegEncoder::new(&mut jpeg).encode_image(&picture).expect("image");
    std::fs::write(world.folder.join("image.jpg"), jpeg).expect("file");
    world.more = vec![
        ("LD_PRELOAD", library.into()),
        ("RAVENPOSE_WEBCAM_JPEG", world.folder.join("image.jpg").into()),
        ("RAVENPOSE_WEBCAM_LOG", world.folder.join("stamps").into()),
        ("RAVENPOSE_WEBCAM_IS", what.into()),
    ];
    Some(())
}

const TWO_WEBCAMS: [&str; 8] = [
    "--camera",
    "cam0=/dev/ravenpose-webcam0",
    "--camera",
    "cam1=/dev/ravenpose-webcam1",
    "--image-size",
    "64x48",
    "--frames-per-s",
    "20",
];

#[test]
fn images_of_webcams_are_whole_and_have_the_kernels_stamps() {
    for what in ["whole", "lossy"] {
        despite_stops(|| {
            let mut world = World::new(what);
            let Some(()) = with_webcams(&mut world, what) else { return };
            let out = world.folder.join("run.mcap");
            let (code, said, _) = world.recorded(&out, "3", &TWO_WEBCAMS);
            assert!(code.is_some_and(|code| code < 2), "{said}");
            let states = states_of(&out);
            // Of the recorder's clock to the monotonic one.
            let ahead_ns = Record::State(Box::new(states[0])).time_ns() - states[0].source_time_ns;
            let log = std::fs::read_to_string(world.folder.join("stamps")).expect("stamps");
            let jpeg = std::fs::read(world.folder.join("image.jpg")).expect("image");
            for camera in 0..2 {
                let stamps: Vec<i64> = log
                    .lines()
                    .filter_map(|line| line.strip_prefix(&format!("{camera} ")))
                    .map(|line| line.split(' ').nth(1).and_then(|stamp| stamp.parse().ok()).expect("a stamp"))
                    .collect();
                let mut images = ImageSource::open(&out, &format!("cam{camera}")).expect("images");
                let all: Vec<_> = std::iter::from_fn(|| images.next_image().expect("image")).collect();
                assert!(all.len() >= 10 && all.windows(2).all(|pair| pair[0].time_ns < pair[1].time_ns), "{said}");
                for image in &all {
                    assert!(stamps.contains(&(image.time_ns - ahead_ns)), "{} is no stamp", image.time_ns);
                    assert!(image.jpeg == jpeg, "an image of {} bytes", image.jpeg.len());
                }
            }
        });
    }
}

#[test]
fn webcams_that_cannot_do_what_is_asked_are_one_line() {
    for (what, words) in [
        ("yuyv", "it sends no Motion JPEG; give --ffmpeg ffmpeg"),
        ("large", "it sends 128x48 px instead of 64x48"),
        ("blind", "it takes no images"),
    ] {
        let mut world = World::new(what);
        let Some(()) = with_webcams(&mut world, what) else { return };
        let out = world.folder.join("run.mcap");
        let (code, said) = said(world.record(&out, Some("1"), &TWO_WEBCAMS));
        assert!(code == Some(2) && said.trim().lines().count() == 1 && said.contains(words), "{code:?} {said}");
        assert!(said.contains("/dev/ravenpose-webcam") && !out.exists() && !out.with_extension("mcap.part").exists());
    }
}

#[test]
fn a_webcam_that_is_unplugged_does_not_stop_the_recording() {
    despite_stops(|| {
        let mut world = World::new("unplugged");
        let Some(()) = with_webcams(&mut world, "unplugged") else { return };
        let out = world.folder.join("run.mcap");
        let (code, said, _) = world.recorded(&out, "3", &TWO_WEBCAMS[..2]);
        assert!(code == Some(1) && said.contains("ended early") && said.contains("it was unplugged"), "{code:?} {said}");
        let states = states_of(&out);
        assert!(states.last().expect("states").source_time_ns - states[0].source_time_ns > 1_500_000_000);
    });
}

#[test]
fn a_webcam_that_fails_does_not_stop_the_recording() {
    despite_stops(|| {
        let world = World::new("fails");
        let program = webcam(&world, "short", [64, 48], "5");
        let out = world.folder.join("run.mcap");
        let more = ["--ffmpeg", program.to_str().expect("UTF-8"), "--camera", "cam0=/dev/null"];
        let (code, said, _) = world.recorded(&out, "3", &more);
        assert!(code == Some(1) && said.contains("ended early: it ended by itself"), "{code:?} {said}");
        let states = states_of(&out);
        assert!(states.last().expect("states").source_time_ns - states[0].source_time_ns > 1_500_000_000);
    });
}

#[test]
fn a_wrong_webcam_is_one_line_and_leaves_no_file() {
    let world = World::new("wrong");
    let out = world.folder.join("run.mcap");
    for (camera, words) in [
        ("cam0", "is not NAME=DEVICE"),
        ("a b=/dev/null", "letters, digits"),
        ("cam0=clip.avi", "vision record"),
        ("cam0=/dev/video-of-nobody", "no such device"),
    ] {
        let (code, said) = said(world.record(&out, Some("1"), &["--camera", camera]));
        assert!(code == Some(2) && said.trim().lines().count() == 1 && said.contains(words), "{code:?} {said}");
        assert!(!out.exists() && !out.with_extension("mcap.part").exists());
    }
}
