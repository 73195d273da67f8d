//! A machine that refuses what real time needs: the start is refused with one line, or goes on where the configuration allows it, and
//! then every message says so.

mod common;
#[path = "common/service.rs"]
mod service;
#[path = "common/stalls.rs"]
mod stalls;

use ravenpose::report::Stats;
use service::{CONFIG, World, publish_forever, role};
use stalls::despite_stops;
use std::os::unix::fs::chown;
use std::os::unix::process::CommandExt;
use std::process::Command;

/// `nobody` on Debian.
const NOBODY: u32 = 65_534;

/// Makes the command run as an ordinary user who may neither lock memory nor have FIFO.
fn without_rights(command: &mut Command) -> &mut Command {
    // SAFETY: only system calls between fork and exec.
    unsafe {
        command.pre_exec(|| {
            let none = libc::rlimit { rlim_cur: 0, rlim_max: 0 };
            let small = libc::rlimit { rlim_cur: 65_536, rlim_max: 65_536 };
            libc::setrlimit(libc::RLIMIT_RTPRIO, &raw const none);
            libc::setrlimit(libc::RLIMIT_MEMLOCK, &raw const small);
            Ok(())
        })
    };
    command.uid(NOBODY).gid(NOBODY)
}

/// The configuration with the copies of [`world`].
fn config(world: &World, more: &str) -> std::path::PathBuf {
    let path = world.config(more);
    let text = std::fs::read_to_string(&path).expect("configuration");
    let model = common::untrained();
    let copy = world.dir.0.join(model.file_name().expect("a file"));
    std::fs::write(&path, text.replace(&model.display().to_string(), &copy.display().to_string())).expect("configuration");
    path
}

/// The copy of the service in [`world`].
fn service_of(world: &World, config: &std::path::Path) -> Command {
    let mut command = world.command(&world.dir.0.join("ravenposed").display().to_string());
    command.arg("--config").arg(config).stdin(std::process::Stdio::null()).stdout(std::process::Stdio::null());
    command
}

/// Only root can become somebody else.
fn may_change_user() -> bool {
    // SAFETY: no arguments, no memory.
    let root = unsafe { libc::geteuid() } == 0;
    if !root {
        println!("skipped: only root can start the service as a user without rights");
    }
    root
}

fn world(name: &str) -> World {
    let world = World::new(name);
    // The checkout may lie where nobody else can look.
    let model = common::untrained();
    for from in [
        env!("CARGO_BIN_EXE_ravenposed").into(),
        std::env::current_exe().expect("this program"),
        model.clone(),
        model.with_extension("onnx.sha256"),
    ] {
        std::fs::copy(&from, world.dir.0.join(from.file_name().expect("a file"))).expect("copied");
    }
    chown(&world.dir.0, Some(NOBODY), Some(NOBODY)).expect("root may give a directory away");
    world
}

#[test]
fn each_missing_right_is_refused_with_one_line_and_its_remedy() {
    if !may_change_user() {
        return;
    }
    for (table, what, remedy) in [
        ("", "memory cannot be locked", "LimitMEMLOCK=infinity"),
        ("lock_memory = false", "SCHED_FIFO priority 80 is refused", "LimitRTPRIO=80"),
        ("lock_memory = false\ncore = 4000", "the loop cannot be pinned to core 4000", "choose loop.core"),
        ("lock_memory = false\nwait = \"spin\"", "real-time throttling is on", "sched_rt_runtime_us=-1"),
    ] {
        let world = world("rights");
        let config = config(&world, &format!("allow_untrained = true\n[loop]\n{table}"));
        let output = without_rights(&mut service_of(&world, &config)).output().expect("service");
        let text = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{text}");
        let last = text.lines().last().expect("a line");
        if what.contains("throttling")
            && std::fs::read_to_string("/proc/sys/kernel/sched_rt_runtime_us").is_ok_and(|v| v.trim() == "-1")
        {
            println!("skipped: real-time throttling is off here");
            continue;
        }
        assert!(last.contains(what) && last.contains(remedy) && last.contains("allow_degraded = true"), "{last}");
    }
}

#[test]
fn a_refused_cpu_dma_latency_alone_is_refused_too() {
    if !may_change_user() {
        return;
    }
    if !std::path::Path::new("/dev/cpu_dma_latency").exists() {
        println!("skipped: this kernel has no /dev/cpu_dma_latency");
        return;
    }
    let world = world("latency");
    let config = config(&world, "allow_untrained = true\n[loop]\nlock_memory = false\nhold_cpu_dma_latency = true");
    // All that the loop needs but root's way past the device's mode.
    let mut command = world.command("setpriv");
    command.args([
        "--reuid=65534",
        "--regid=65534",
        "--clear-groups",
        "--inh-caps=-all,+sys_nice",
        "--ambient-caps=-all,+sys_nice",
    ]);
    let output = command.arg(world.dir.0.join("ravenposed")).arg("--config").arg(config).output().expect("setpriv of util-linux");
    let text = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(2), "{text}");
    assert!(!text.contains("SCHED_FIFO"), "{text}");
    let last = text.lines().last().expect("a line");
    assert!(
        last.contains("/dev/cpu_dma_latency cannot be opened")
            && last.contains("cpu-dma-latency.conf")
            && last.contains("allow_degraded = true"),
        "{last}"
    );
}

#[test]
fn with_allow_degraded_it_goes_on_and_every_message_says_so() {
    if role().as_deref() == Some("publisher") {
        publish_forever();
    }
    if !may_change_user() {
        return;
    }
    despite_stops(|| {
        let world = world("degraded");
        let config = config(&world, CONFIG);
        let log = std::fs::File::create(world.dir.0.join("service.log")).expect("log");
        let mut service = service::Process(without_rights(&mut service_of(&world, &config)).stderr(log).spawn().expect("service"));
        let this = std::env::current_exe().expect("this program");
        let this = world.dir.0.join(this.file_name().expect("a file"));
        let mut publisher = world.command(&this.display().to_string());
        let publisher = without_rights(&mut publisher)
            .args(["with_allow_degraded_it_goes_on_and_every_message_says_so", "--exact", "--nocapture"])
            .env("RAVENPOSE_TEST_ROLE", "publisher")
            .stdout(std::process::Stdio::null())
            .spawn()
            .expect("publisher");
        let _publisher = service::Process(publisher);
        let mut arms = Vec::new();
        world.until("200 poses", || {
            let read = std::fs::read(world.dir.0.join("run/stats.json")).unwrap_or_default();
            let Ok(stats) = serde_json::from_slice::<Stats>(&read) else { return false };
            let published = stats.counter("published");
            arms = stats.arms;
            published.is_some_and(|published| published > 200)
        });
        for arm in &arms {
            assert!(arm.flags.iter().any(|flag| flag == "not_realtime"), "{arm:?}");
        }
        let words = world.log();
        assert!(words.contains("NOT REAL TIME: memory cannot be locked") && words.contains("NOT REAL TIME: SCHED_FIFO"), "{words}");
        service.signal(libc::SIGTERM);
        assert_eq!(service.end().code(), Some(0));
    });
}

/// Leaving memory unlocked is a choice that needs no permission; the messages tell.
#[test]
fn memory_that_is_left_unlocked_is_told() {
    if role().as_deref() == Some("publisher") {
        publish_forever();
    }
    despite_stops(|| {
        let world = World::new("unlocked");
        let config = world.config(&format!("{CONFIG}\n[loop]\nlock_memory = false"));
        let _service = world.start(&config, &[]);
        let reader = world.poses();
        let _publisher = world.role("memory_that_is_left_unlocked_is_told", "publisher");
        world.until("a pose", || {
            let Some(pose) = reader.next().expect("pose") else { return false };
            assert_ne!(pose.arm[0].flags & ravenpose_wire::flag::NOT_REALTIME, 0);
            true
        });
    });
}

#[test]
fn a_rejected_model_is_flagged_where_that_is_allowed() {
    if role().as_deref() == Some("publisher") {
        publish_forever();
    }
    despite_stops(|| {
        let world = World::new("rejected");
        let broken = world.dir.file("broken.onnx", b"not a model");
        world.dir.file("broken.onnx.sha256", "0000000000000000000000000000000000000000000000000000000000000000  broken.onnx\n");
        let path = world.config(CONFIG);
        let text = std::fs::read_to_string(&path).expect("configuration");
        let green = text.find("[green]").expect("green");
        let report = text.find("[report]").expect("report");
        let text = format!("{}[green]\nmodel = \"{}\"\n{}", &text[..green], broken.display(), &text[report..]);
        std::fs::write(&path, text).expect("configuration");
        let _service = world.start(&path, &[]);
        let reader = world.poses();
        let _publisher = world.role("a_rejected_model_is_flagged_where_that_is_allowed", "publisher");
        world.until("a valid pose", || {
            let Some(pose) = reader.next().expect("pose") else { return false };
            assert_ne!(pose.arm[1].flags & ravenpose_wire::flag::MODEL_REJECTED, 0);
            assert_eq!(pose.arm[1].correction_um, [0.0; 3]);
            pose.arm[0].status == ravenpose_wire::ArmStatus::Valid as u32
        });
        assert!(world.log().contains("broken.onnx: SHA-256 is"), "{}", world.log());
    });
}
