//! The systemd protocol, with a notification socket of our own.

mod common;
#[path = "common/service.rs"]
mod service;
#[path = "common/stalls.rs"]
mod stalls;

use ravenpose_transport::now_ns;
use service::{CONFIG, PATIENCE, World, publish_forever, role};
use stalls::despite_stops;
use std::os::unix::net::UnixDatagram;
use std::os::unix::process::ExitStatusExt;
use std::time::{Duration, Instant};

/// One at a time: each brings several processes, and there are two cores.
static MACHINE: std::sync::Mutex<()> = std::sync::Mutex::new(());

fn machine() -> std::sync::MutexGuard<'static, ()> {
    MACHINE.lock().unwrap_or_else(std::sync::PoisonError::into_inner)
}

struct Socket(UnixDatagram);

impl Socket {
    /// The next message within `timeout`.
    fn hear(&self, timeout: Duration) -> Option<String> {
        let mut bytes = [0; 4096];
        self.0.set_read_timeout(Some(timeout)).expect("timeout");
        self.0.recv(&mut bytes).ok().map(|size| String::from_utf8_lossy(&bytes[..size]).into_owned())
    }

    fn hear_until(&self, wanted: &str) {
        let begun = Instant::now();
        while !self.hear(Duration::from_millis(100)).is_some_and(|text| text.contains(wanted)) {
            assert!(begun.elapsed() < PATIENCE, "{wanted} did not come");
        }
    }
}

fn start(world: &World, arguments: &[&str]) -> (Socket, service::Process) {
    let log = std::fs::File::create(world.dir.0.join("service.log")).expect("log");
    start_with(world, arguments, log.into())
}

fn start_with(world: &World, arguments: &[&str], log: std::process::Stdio) -> (Socket, service::Process) {
    let path = world.dir.0.join("notify");
    let socket = Socket(UnixDatagram::bind(&path).expect("socket"));
    let config = world.config(CONFIG);
    let child = world.service(&config).args(arguments).env("NOTIFY_SOCKET", &path).stderr(log).spawn().expect("service");
    (socket, service::Process(child))
}

#[test]
fn ready_then_watchdog_while_the_heartbeat_moves_then_stopping() {
    let _machine = machine();
    despite_stops(|| {
        let world = World::new("ready");
        let (socket, mut service) = start(&world, &[]);
        socket.hear_until("READY=1");
        // Also without any robot: the loop is healthy.
        for _ in 0..10 {
            socket.hear_until("WATCHDOG=1");
        }
        service.signal(libc::SIGTERM);
        socket.hear_until("STOPPING=1");
        assert_eq!(service.end().code(), Some(0));
    });
}

#[test]
fn a_stuck_loop_is_no_longer_fed() {
    if role().as_deref() == Some("publisher") {
        publish_forever();
    }
    let _machine = machine();
    despite_stops(|| {
        let mut soonest = i64::MAX;
        for round in 0..3 {
            let world = World::new(&format!("stuck{round}"));
            // After 200 messages: busy for an hour.
            let (socket, mut service) = start(&world, &["--test-hook", "200:1:3600000000"]);
            socket.hear_until("READY=1");
            let _publisher = world.role("a_stuck_loop_is_no_longer_fed", "publisher");
            let reader = world.poses();
            // It ends itself after 180 ms of its own time without a turn, and is not fed meanwhile: systemd would end it too.
            let begun = Instant::now();
            let (mut last_feed, mut last_pose_ns) = (Instant::now(), now_ns());
            while service.0.try_wait().expect("status").is_none() {
                if socket.hear(Duration::from_millis(1)).is_some_and(|text| text.contains("WATCHDOG=1")) {
                    last_feed = Instant::now();
                }
                while let Some(pose) = reader.next().expect("pose") {
                    last_pose_ns = pose.publish_time_ns;
                }
                assert!(begun.elapsed() < PATIENCE, "a stuck loop goes on\n{}", world.log());
            }
            // Without rights the loop may be held up by anything, and is given 5 s.
            if !world.log().contains("NOT REAL TIME") {
                soonest = soonest.min(now_ns() - last_pose_ns);
            }
            let unfed = last_feed.elapsed();
            println!("ended {} ms after the last feed", unfed.as_millis());
            assert!(unfed > Duration::from_millis(100), "a stuck loop was fed {unfed:?} before the end");
            assert_eq!(service.end().signal(), Some(libc::SIGABRT), "{}", world.log());
            assert!(world.log().contains("the loop is stuck"), "{}", world.log());
        }
        if soonest == i64::MAX {
            println!("its time is not judged: no real-time rights here");
            return;
        }
        println!("ended {} us after the last pose", soonest / 1000);
        // F43. The machine may hold up one of them; not all.
        assert!(soonest <= 250_000_000, "{soonest} ns");
    });
}

/// F35, F43. A log that nobody reads holds up neither a loop that works nor the end of one that does not.
#[test]
fn a_log_that_hangs_holds_up_neither_the_watchdog_nor_the_end() {
    if role().as_deref() == Some("publisher") {
        publish_forever();
    }
    let _machine = machine();
    despite_stops(|| {
        let world = World::new("mute");
        let (unread, log) = std::io::pipe().expect("a pipe");
        let filler = log.try_clone().expect("a pipe");
        let (socket, mut service) = start_with(&world, &["--test-hook", "3000:1:3600000000"], log.into());
        socket.hear_until("READY=1");
        // After its last line at the start, a few looks later.
        (0..5).for_each(|_| socket.hear_until("WATCHDOG=1"));
        let full = fill(filler);
        let _publisher = world.role("a_log_that_hangs_holds_up_neither_the_watchdog_nor_the_end", "publisher");
        let reader = world.poses();
        // Each arm's first pose, its first correction and more are worth lines; 3000 poses come all the same, then a loop that is stuck.
        let (begun, mut poses, mut feeds) = (Instant::now(), 0, 0);
        while service.0.try_wait().expect("status").is_none() {
            feeds += u64::from(socket.hear(Duration::from_millis(5)).is_some_and(|text| text.contains("WATCHDOG=1")));
            while reader.next().expect("pose").is_some() {
                poses += 1;
            }
            assert!(begun.elapsed() < PATIENCE, "a log that hangs keeps a stuck loop alive; {poses} poses");
        }
        assert!(!full.is_finished(), "the log does not hang");
        assert_eq!(service.end().signal(), Some(libc::SIGABRT));
        assert!(poses > 1500 && feeds > 12, "{poses} poses and {feeds} feeds in 3 s");
        drop(unread);
        let _ = full.join();
    });
}

/// Writes until nothing more goes in, and stays so until nobody can read any more.
fn fill(mut pipe: std::io::PipeWriter) -> std::thread::JoinHandle<()> {
    use std::io::Write;
    let written = std::sync::Arc::new(std::sync::atomic::AtomicUsize::new(0));
    let count = std::sync::Arc::clone(&written);
    let filling = std::thread::spawn(move || {
        while pipe.write_all(b"x").is_ok() {
            count.fetch_add(1, std::sync::atomic::Ordering::Relaxed);
        }
    });
    let mut before = usize::MAX;
    loop {
        std::thread::sleep(Duration::from_millis(100));
        let now = written.load(std::sync::atomic::Ordering::Relaxed);
        if now == before && now > 0 {
            return filling;
        }
        before = now;
    }
}

/// F35. Statistics are written aside and renamed; a pipe in that place, which nobody reads, holds up whoever opens it.
#[test]
fn a_disk_that_hangs_holds_up_neither_loop_nor_watchdog() {
    if role().as_deref() == Some("publisher") {
        publish_forever();
    }
    let lasting = std::env::var("RAVENPOSE_HANG_S").ok().and_then(|text| text.parse().ok()).unwrap_or(4);
    let _machine = machine();
    despite_stops(|| {
        let world = World::new("hang");
        let run = world.dir.0.join("run");
        std::fs::create_dir(&run).expect("a directory");
        let pipe = run.join("stats.json.new");
        assert!(std::process::Command::new("mkfifo").arg(&pipe).status().expect("mkfifo").success());
        let (socket, mut service) = start(&world, &[]);
        socket.hear_until("READY=1");
        let _publisher = world.role("a_disk_that_hangs_holds_up_neither_loop_nor_watchdog", "publisher");
        let reader = world.poses();
        let (begun, mut poses, mut feeds) = (Instant::now(), 0, 0);
        while begun.elapsed() < Duration::from_secs(lasting) {
            feeds += u64::from(socket.hear(Duration::from_millis(5)).is_some_and(|text| text.contains("WATCHDOG=1")));
            while let Some(pose) = reader.next().expect("pose") {
                poses += u64::from(pose.arm[0].status == ravenpose_wire::ArmStatus::Valid as u32);
            }
        }
        assert!(!run.join("stats.json").exists(), "the disk does not hang");
        assert!(poses > 500 * lasting && feeds > 4 * lasting, "{poses} valid poses, {feeds} feeds in {lasting} s");
        // The end waits for a hanging disk only so long.
        service.signal(libc::SIGTERM);
        socket.hear_until("STOPPING=1");
        assert_eq!(service.end().code(), Some(0), "{}", world.log());
    });
}

#[test]
fn a_refused_start_never_says_ready() {
    let world = World::new("refused");
    let path = world.dir.0.join("notify");
    let socket = Socket(UnixDatagram::bind(&path).expect("socket"));
    let config = world.dir.file("bad.toml", "nonsense = 1\n");
    let output = world.service(&config).env("NOTIFY_SOCKET", &path).output().expect("service");
    assert_eq!(output.status.code(), Some(2));
    assert_eq!(socket.hear(Duration::from_millis(100)), None);
}
