//! The wall clock of service and robot jumps by an hour forth and back (F25): nothing of what they do may change.
//!
//! The machine's own clock belongs to everybody on it. Therefore a library is preloaded (`common/wall_clock.c`) that answers for it.

mod common;
#[path = "common/service.rs"]
mod service;
#[path = "common/stalls.rs"]
mod stalls;

use ravenpose::report::Stats;
use ravenpose_wire::ArmStatus;
use service::{CONFIG, World, publish_forever, role, whole};
use stalls::despite_stops;
use std::collections::BTreeSet;
use std::path::Path;
use std::process::Command;
use std::time::{Duration, Instant, SystemTime};

const TEST: &str = "a_wall_clock_that_jumps_changes_nothing";

/// What readers see of some seconds, from the first valid pose on, and what the service writes meanwhile.
#[derive(Debug, PartialEq)]
struct Seen {
    /// Status, flags and steps announced since the first of each arm.
    arms: BTreeSet<(u32, u32, u32)>,
    /// Does each interval of the histogram log begin where the one before ended, and how many whole seconds are they at least (3)?
    intervals: (bool, u64),
    /// Whole hours that the files' own dates are off.
    hours_off: BTreeSet<i64>,
}

fn see(name: &str, clock: Option<&Path>) -> Seen {
    const LASTING: Duration = Duration::from_millis(4500);
    let mut world = World::new(name);
    if let Some(clock) = clock {
        world.more.push(("LD_PRELOAD", clock.into()));
    }
    let config = world.config(CONFIG);
    let mut service = world.start(&config, &[]);
    let _publisher = world.role(TEST, "publisher");
    let reader = world.poses();
    let mut seen = Seen { arms: BTreeSet::new(), intervals: (true, 0), hours_off: BTreeSet::new() };
    let mut began = None;
    let mut last = (0, 0);
    let now_s = || SystemTime::now().duration_since(SystemTime::UNIX_EPOCH).expect("after 1970").as_secs();
    world.until("some seconds, and a wrong clock where one jumps", || {
        while let Some(pose) = reader.next().expect("pose") {
            assert!(whole(&pose), "{pose:?}");
            assert!(pose.sequence > last.0 && pose.source_sequence > last.1, "{pose:?} after {last:?}");
            last = (pose.sequence, pose.source_sequence);
            if pose.arm.iter().all(|arm| arm.status == ArmStatus::Valid as u32) {
                began.get_or_insert((Instant::now(), pose));
            }
            if let Some((_, first)) = began {
                let of_each = pose.arm.iter().zip(&first.arm);
                seen.arms
                    .extend(of_each.map(|(arm, first)| (arm.status, arm.flags, arm.reset_count.wrapping_sub(first.reset_count))));
            }
        }
        let stats = std::fs::read(world.dir.0.join("run/stats.json")).unwrap_or_default();
        if let Ok(stats) = serde_json::from_slice::<Stats>(&stats) {
            seen.hours_off.insert((stats.written_unix_s as i64 - now_s() as i64 + 1800).div_euclid(3600));
        }
        // A clock that jumps has to be met while it is wrong, or nothing was tested.
        let met = clock.is_none() || seen.hours_off.len() > 1;
        met && began.is_some_and(|(began, _)| began.elapsed() > LASTING)
    });
    service.signal(libc::SIGTERM);
    assert_eq!(service.end().code(), Some(0), "{}", world.log());
    for file in std::fs::read_dir(world.dir.0.join("histograms")).expect("histograms").flatten() {
        if file.path().extension().is_some_and(|extension| extension == "hlog") {
            let log = std::fs::read_to_string(file.path()).expect("log");
            let of_one_stage = log.lines().filter_map(|line| line.strip_prefix("Tag=total,"));
            let number = |text: Option<&str>| text.and_then(|text| text.parse::<f64>().ok());
            let mut end = 0.0;
            for line in of_one_stage {
                let mut numbers = line.split(',');
                let begin = number(numbers.next()).expect("a time");
                seen.intervals.0 &= (begin - end).abs() < 0.1;
                end = begin + number(numbers.next()).expect("a length");
            }
            // How long the last seconds took is the machine's.
            seen.intervals.1 = (end as u64).min(3);
        }
    }
    seen
}

#[test]
fn a_wall_clock_that_jumps_changes_nothing() {
    if role().as_deref() == Some("publisher") {
        publish_forever();
    }
    let here = common::TempDir::new("clock");
    let clock = here.0.join("wall_clock.so");
    let source = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/common/wall_clock.c");
    let mut compiler = Command::new("cc");
    compiler.args(["-shared", "-fPIC", "-O1", "-Wall", "-Wextra", "-Werror", "-o"]).args([&clock, &source]);
    match compiler.status() {
        Ok(status) => assert!(status.success(), "{status}"),
        Err(error) => {
            println!("skipped: no C compiler for the clock: cc: {error}");
            return;
        }
    }
    despite_stops(|| {
        let right = see("clockright", None);
        let jumping = see("clockjumps", Some(&clock));
        assert_eq!(right.hours_off, BTreeSet::from([0]));
        assert!(jumping.hours_off.len() > 1, "the service's clock does not jump: {jumping:?}");
        assert_eq!((&jumping.arms, &jumping.intervals), (&right.arms, &right.intervals));
        assert_eq!(right.intervals, (true, 3));
    });
}
