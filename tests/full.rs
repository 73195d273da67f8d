//! Shared memory that is too small or gets full (F39): one line at the start, and no bus error ever, in whichever process. A disk that gets
//! full (F34): nothing half-written is left.
//!
//! Each test runs once more, as root, with a `/dev/shm` of its own.

mod common;
#[path = "common/service.rs"]
mod service;
#[path = "common/stalls.rs"]
mod stalls;

use ravenpose::histogram::{Histograms, STAGES};
use ravenpose::report::{Log, hgrm};
use ravenpose_transport::{Reader, TransportError, Writer, now_ns, sleep_until_ns};
use ravenpose_wire::{ArmStatus, CorrectedPose, RavenState};
use service::{CONFIG, World, role, telling};
use stalls::despite_stops;
use std::io::Write as _;
use std::path::Path;
use std::process::Command;
use std::time::Duration;

const ROLE: &str = "small /dev/shm";

/// Runs this test once more with a `/dev/shm` of its own; whether it is the one that has it.
fn has_its_own(test: &str) -> bool {
    if role().as_deref() == Some(ROLE) {
        return true;
    }
    let unshare = |script: &str| {
        let mut command = Command::new("unshare");
        command.args(["--mount", "sh", "-c", script]);
        command
    };
    let mount = "mount -t tmpfs -o size=1m tmpfs /dev/shm";
    if !unshare(mount).output().is_ok_and(|answer| answer.status.success()) {
        println!("skipped: no /dev/shm of its own can be mounted here (root only)");
        return false;
    }
    let answer = unshare(&format!("{mount} && exec \"$0\" \"$@\""))
        .arg(std::env::current_exe().expect("this program"))
        .args([test, "--exact", "--nocapture"])
        .env("RAVENPOSE_TEST_ROLE", ROLE)
        .output()
        .expect("unshare");
    let [said, wrong] = [&answer.stdout, &answer.stderr].map(|bytes| String::from_utf8_lossy(bytes));
    assert!(answer.status.success() && said.contains("1 passed"), "{}: {said}{wrong}", answer.status);
    println!("{said}");
    false
}

fn resize(kib: u64) {
    let size = format!("remount,size={kib}k");
    assert!(Command::new("mount").args(["-o", &size, "/dev/shm"]).status().expect("mount").success());
}

/// Is it the one line about shared memory?
fn names_it(line: &str) -> bool {
    line.contains("/dev/shm has") && line.contains("KiB are needed") && line.contains("mount -o remount,size=1G /dev/shm")
}

/// `true` if it opened; an error must be the one about shared memory.
fn opened<T>(port: Result<T, TransportError>) -> bool {
    match port {
        Ok(_) => true,
        Err(error) => {
            assert!(matches!(error, TransportError::Room { .. }) && names_it(&error.to_string()), "{error}");
            false
        }
    }
}

#[test]
fn too_little_is_refused_with_one_line_by_service_robot_and_client() {
    if !has_its_own("too_little_is_refused_with_one_line_by_service_robot_and_client") {
        return;
    }
    let mut started = Vec::new();
    for kib in [16, 300, 1024, 4096, 5800, 6600, 8192, 16_384, 24_000, 28_000, 32_768, 36_000, 40_000, 48_000, 65_536] {
        resize(kib);
        let world = World::new("little");
        let publisher = opened(Writer::<RavenState>::open(&world.settings));
        let reader = opened(Reader::<CorrectedPose>::open(&world.settings, 64));
        let config = world.config(CONFIG);
        let mut service = service::Process(
            world
                .service(&config)
                .stderr(std::fs::File::create(world.dir.0.join("service.log")).expect("log"))
                .spawn()
                .expect("service"),
        );
        let mut running = false;
        world.until("running or refused", || {
            running = world.log().contains("ravenposed: running");
            running || service.0.try_wait().expect("status").is_some()
        });
        if running {
            service.signal(libc::SIGTERM);
        }
        let status = service.end();
        assert_eq!(status.code(), Some(if running { 0 } else { 2 }), "{kib} KiB: {status}: {}", world.log());
        assert!(running || world.log().lines().last().is_some_and(names_it), "{kib} KiB: {}", world.log());
        started.push((publisher, reader, running));
    }
    assert_eq!((started[0], started[started.len() - 1]), ((false, false, false), (true, true, true)));
    let never_worse = started.windows(2).all(|pair| {
        let ((publisher, reader, running), (with_more, reader_with_more, running_with_more)) = (pair[0], pair[1]);
        publisher <= with_more && reader <= reader_with_more && running <= running_with_more
    });
    assert!(never_worse, "{started:?}");
}

#[test]
fn full_later_nothing_changes_but_for_newcomers() {
    if !has_its_own("full_later_nothing_changes_but_for_newcomers") {
        return;
    }
    resize(65_536);
    let (path, disk) = (Path::new("/dev/shm/filling"), Path::new("/dev/shm/disk"));
    despite_stops(|| {
        let _ = (std::fs::remove_file(path), std::fs::remove_dir_all(disk));
        let world = World::new("later");
        // The disk of statistics and histograms gets full with it.
        let config = world.config(CONFIG);
        let text = std::fs::read_to_string(&config)
            .expect("configuration")
            .replace(&format!("histogram_dir = \"{}", world.dir.0.display()), &format!("histogram_dir = \"{}", disk.display()));
        let mut service = world.start(&world.dir.file("ravenposed.toml", text), &[]);
        let writer = Writer::<RavenState>::open(&world.settings).expect("writer");
        let reader = world.poses();
        let (mut sequence, mut valid) = (0, 0);
        let mut last = 0;
        let mut run = |ms: u64| {
            valid = 0;
            let start = now_ns();
            for turn in 0..ms {
                sequence += 1;
                let mut state = telling(sequence, now_ns());
                state.source_id = 7;
                state.seal(sequence);
                writer.send(&state).expect("sent");
                while let Some(pose) = reader.next().expect("pose") {
                    assert!(service::whole(&pose) && pose.sequence > last, "{pose:?}");
                    last = pose.sequence;
                    valid += u64::from(pose.arm.iter().all(|arm| arm.status == ArmStatus::Valid as u32));
                }
                sleep_until_ns(start + (turn as i64 + 1) * 1_000_000);
            }
            valid
        };
        run(500);
        let mut filling = std::fs::File::create(path).expect("file");
        while filling.write_all(&[1; 4096]).is_ok() {}
        // Longer than a writer takes to use each of its places, and the service to write its statistics.
        let during = run(6000);
        assert!(during > 3000, "{during} valid poses");
        assert!(!opened(Reader::<CorrectedPose>::open(&world.settings, 64)), "there is no room");
        assert!(run(500) > 100);
        drop(filling);
        std::fs::remove_file(path).expect("removed");
        assert!(opened(Reader::<CorrectedPose>::open(&world.settings, 64)), "there is room again");
        assert!(run(500) > 100);
        service.signal(libc::SIGTERM);
        assert_eq!(service.end().code(), Some(0), "{}", world.log());
        assert!(world.log().contains("the histogram log cannot be written (No space left on device"), "{}", world.log());
        let logged_s: f64 = whole_files(&disk.join("histograms")).iter().sum();
        assert!(logged_s > 7.0, "{logged_s} s of at least 7.5 s are in the log");
    });
}

/// Asserts that all files of histograms in a directory are whole; returns the lengths of the log's intervals, s.
fn whole_files(dir: &Path) -> Vec<f64> {
    let mut lengths = Vec::new();
    for file in std::fs::read_dir(dir).expect("a directory").flatten() {
        let (path, text) = (file.path(), std::fs::read_to_string(file.path()).expect("text"));
        match path.extension().and_then(|extension| extension.to_str()) {
            Some("hgrm") => {
                let mut lines = text.lines();
                assert!(lines.next().is_some_and(|line| line.trim_start().starts_with("Value ")), "{}: {text}", path.display());
                assert!(
                    text.ends_with("]\n") && lines.last().is_some_and(|line| line.starts_with("#[Buckets")),
                    "{}: {text}",
                    path.display()
                );
            }
            Some("hlog") if text.is_empty() => {}
            Some("hlog") => {
                let of_stages: Vec<_> = text.lines().filter_map(|line| line.strip_prefix("Tag=")).collect();
                assert!(text.ends_with('\n') && of_stages.len() % STAGES.len() == 0, "{}: {text}", path.display());
                let length = |line: &&str| line.split(',').nth(2)?.parse::<f64>().ok();
                lengths.extend(of_stages.iter().step_by(STAGES.len()).map(|line| length(line).expect("a length")));
            }
            _ => panic!("left behind: {}", path.display()),
        }
    }
    lengths
}

/// Intervals written to a disk that may be full.
const INTERVALS: usize = 20;

#[test]
fn a_full_disk_leaves_old_files_or_whole_new_ones() {
    if !has_its_own("a_full_disk_leaves_old_files_or_whole_new_ones") {
        return;
    }
    let mut failed = 0;
    for pages in 5.. {
        resize(4 * pages);
        let dir = Path::new("/dev/shm/histograms");
        let log = Log::create(dir).expect("a log");
        let (mut total, mut appended, mut written) = (Histograms::new(), 0, 0);
        for interval in 1..=INTERVALS as i64 {
            let mut now = Histograms::new();
            for (stage, _) in STAGES {
                (1..3000).for_each(|step| now.record(stage, 100 * interval * step));
            }
            total.add(&now);
            appended += usize::from(log.append(&now, Duration::from_secs(1)).is_ok());
            let before = whole_files(dir).len();
            let whole = log.summarise(&total).is_ok();
            written += usize::from(whole);
            assert_eq!((whole_files(dir).len(), before), (appended, appended), "{pages} pages");
            if whole {
                for (stage, name) in STAGES {
                    let file = std::fs::read_to_string(dir.join(format!("{name}.hgrm"))).expect("written");
                    assert_eq!(file, hgrm(total.stage(stage)), "{pages} pages");
                }
            }
        }
        std::fs::remove_dir_all(dir).expect("removed");
        if (appended, written) == (INTERVALS, INTERVALS) {
            break;
        }
        failed += 1;
    }
    println!("{failed} sizes of the disk were too small for something");
    assert!(failed > 10, "the disk was never full");
}
