//! `ravenpose record` beside a publisher of states and poses.
#![allow(missing_docs)]

use ravenpose_transport::{Settings, Writer, now_ns};
use ravenpose_wire::{CorrectedPose, RavenState};
use recordings::mcap_file::McapSource;
use recordings::stream::{Record, Source};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

struct World {
    folder: PathBuf,
    settings: Settings,
}

impl World {
    fn new(name: &str) -> Self {
        let folder = std::env::temp_dir().join(format!("ravenpose-record-{name}-{}", std::process::id()));
        std::fs::create_dir_all(&folder).expect("folder");
        let settings =
            Settings { prefix: format!("rprec{name}{}_", std::process::id()), root: format!("{}/iceoryx2/", folder.display()) };
        Self { folder, settings }
    }

    fn record(&self, out: &Path, seconds: Option<&str>) -> Child {
        let mut command = Command::new(env!("CARGO_BIN_EXE_ravenpose"));
        command.args(["record", "--out"]).arg(out).stdout(Stdio::piped()).stderr(Stdio::piped());
        command.env("RAVENPOSE_PREFIX", &self.settings.prefix).env("RAVENPOSE_ROOT", &self.settings.root);
        if let Some(seconds) = seconds {
            command.args(["--seconds", seconds]);
        }
        command.spawn().expect("ravenpose runs")
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
    let world = World::new("whole");
    let stop = AtomicBool::new(false);
    let out = world.folder.join("run.mcap");
    std::thread::scope(|scope| {
        let publisher = scope.spawn(|| publish(&world.settings, &stop));
        let output = world.record(&out, Some("3")).wait_with_output().expect("output");
        stop.store(true, Ordering::Relaxed);
        let _ = publisher.join().expect("publisher");
        let said = String::from_utf8_lossy(&output.stdout).into_owned() + &String::from_utf8_lossy(&output.stderr);
        assert!(output.status.code().is_some_and(|code| code < 2), "{said}");
        let states = states_of(&out);
        assert!(states.len() > 500, "{} states; {said}", states.len());
        assert!(states.windows(2).all(|pair| pair[0].sequence < pair[1].sequence && pair[0].source_id == 77), "{said}");
        assert!(states.iter().all(|state| state.mpos[0] == state.sequence as f32));
        let missed = states.last().expect("states").sequence - states[0].sequence + 1 - states.len() as u64;
        assert!(
            said.contains(&format!("{} states,", states.len())) && said.contains(&format!("recorder: {missed} states")),
            "{said}"
        );
    });
    assert!(!out.with_extension("mcap.part").exists());
}

/// `RAVENPOSE_RECORD_SECONDS=3600 cargo test --release -p ravenpose-cli --test record -- --nocapture nothing_is_lost` is the hour.
#[test]
fn nothing_is_lost() {
    let world = World::new("long");
    let stop = AtomicBool::new(false);
    let out = world.folder.join("run.mcap");
    let seconds = std::env::var("RAVENPOSE_RECORD_SECONDS").unwrap_or_else(|_| "5".to_owned());
    std::thread::scope(|scope| {
        let publisher = scope.spawn(|| publish(&world.settings, &stop));
        let output = world.record(&out, Some(&seconds)).wait_with_output().expect("output");
        stop.store(true, Ordering::Relaxed);
        let sent = publisher.join().expect("publisher");
        let said = String::from_utf8_lossy(&output.stdout).into_owned() + &String::from_utf8_lossy(&output.stderr);
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
        println!("{states} states of {sent} in the file, {missed} missed; {said}");
        assert!(seconds == "5" || said.contains("recorder: 0 states"), "{said}");
        assert!(states as f64 > 900.0 * (seconds.parse::<f64>().expect("seconds") - 2.0), "{said}");
        // A machine that other tests load may stall a process for longer than a thousand states.
        if seconds != "5" {
            assert_eq!(missed, 0, "{said}");
        }
    });
}

#[test]
fn a_killed_recorder_leaves_all_but_the_last_second() {
    let world = World::new("killed");
    let stop = AtomicBool::new(false);
    let out = world.folder.join("run.mcap");
    let part = world.folder.join("run.mcap.part");
    std::thread::scope(|scope| {
        let publisher = scope.spawn(|| publish(&world.settings, &stop));
        let mut child = world.record(&out, None);
        let begun = Instant::now();
        while begun.elapsed() < Duration::from_secs(20) && std::fs::metadata(&part).map_or(0, |meta| meta.len()) < 150_000 {
            std::thread::sleep(Duration::from_millis(20));
        }
        let killed_ns = now_ns();
        child.kill().expect("killed");
        let _ = child.wait();
        stop.store(true, Ordering::Relaxed);
        let _ = publisher.join().expect("publisher");
        let states = states_of(&part);
        let last = states.last().expect("states");
        println!("{} states, the last one {} ms before the kill", states.len(), (killed_ns - last.source_time_ns) / 1_000_000);
        assert!(killed_ns - last.source_time_ns < 1_000_000_000);
        assert!(!out.exists());
    });
}

#[test]
fn nothing_is_overwritten() {
    let world = World::new("there");
    let out = world.folder.join("run.mcap");
    std::fs::write(&out, "mine").expect("file");
    let output = world.record(&out, Some("1")).wait_with_output().expect("output");
    assert_eq!(output.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&output.stderr).contains("is there already"));
    assert_eq!(std::fs::read_to_string(&out).expect("file"), "mine");
}
