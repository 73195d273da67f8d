//! The real service as a process, in a world of its own, with robots and clients as further processes.
#![allow(dead_code, unreachable_pub)]

use super::common::{TempDir, remove_shared_memory, untrained};
use ravenpose_transport::{Reader, Settings, Writer, now_ns, sleep_until_ns};
use ravenpose_wire::{CorrectedPose, RavenState};
use std::ffi::OsString;
use std::path::PathBuf;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

/// How long tests wait for what must come. How long it takes is printed and not judged: a shared machine stops for a good part of a
/// second, several times in a row.
pub const PATIENCE: Duration = Duration::from_secs(90);

/// Limits in time of [`CONFIG`], us: longer than such a machine stops. The limits themselves are tested with a simulated clock
/// (`tests/faults`).
pub const STALE_US: i64 = 1_000_000;

/// Both arms untrained, rights may be missing, and the limits in time wide.
pub const CONFIG: &str =
    "allow_untrained = true\nallow_degraded = true\n[limits]\nstale_us = 1000000\nbudget_us = 100000\nlate_fallback = 1000";

/// A prefix and a directory of their own; everything in them is gone when this is dropped.
pub struct World {
    pub dir: TempDir,
    pub settings: Settings,
    /// More of the environment of its processes.
    pub more: Vec<(&'static str, OsString)>,
}

impl World {
    pub fn new(name: &str) -> Self {
        let dir = TempDir::new(name);
        let settings =
            Settings { prefix: format!("rp{name}{}_", std::process::id()), root: format!("{}/iceoryx2/", dir.0.display()) };
        Self { dir, settings, more: Vec::new() }
    }

    /// A configuration with the untrained model on both arms, allowed, in a format that is exact enough, without the time that a choice takes;
    /// `more` is put in front.
    pub fn config(&self, more: &str) -> PathBuf {
        let model = untrained();
        let text = format!(
            "{more}\n[transport]\nprefix = \"{}\"\nroot = \"{}\"\n[gold]\nmodel = \"{}\"\nweights = \"i16\"\n[green]\nmodel = \"{}\"\nweights = \"i16\"\n[report]\nruntime_dir = \"{}\"\nhistogram_dir = \"{}\"\ninterval_s = 1\n",
            self.settings.prefix,
            self.settings.root,
            model.display(),
            model.display(),
            self.dir.0.join("run").display(),
            self.dir.0.join("histograms").display()
        );
        self.dir.file("ravenposed.toml", text)
    }

    /// A command that runs in this world.
    pub fn command(&self, program: &str) -> Command {
        let mut command = Command::new(program);
        command.env("RAVENPOSE_PREFIX", &self.settings.prefix).env("RAVENPOSE_ROOT", &self.settings.root);
        command.envs(self.more.iter().map(|(name, value)| (name, value)));
        command
    }

    pub fn service(&self, config: &std::path::Path) -> Command {
        let mut command = self.command(env!("CARGO_BIN_EXE_ravenposed"));
        command.arg("--config").arg(config).stdin(Stdio::null()).stdout(Stdio::null());
        command
    }

    /// Starts the service and waits until it runs; its words go to `service.log`.
    pub fn start(&self, config: &std::path::Path, arguments: &[&str]) -> Process {
        let path = self.dir.0.join("service.log");
        let log = std::fs::File::create(&path).expect("log");
        let child = self.service(config).args(arguments).stderr(log).spawn().expect("the service starts");
        let mut process = Process(child);
        let begun = Instant::now();
        loop {
            let text = std::fs::read_to_string(&path).unwrap_or_default();
            if text.contains("ravenposed: running") {
                return process;
            }
            assert!(process.0.try_wait().expect("status").is_none() && begun.elapsed() < PATIENCE, "{text}");
            std::thread::sleep(Duration::from_millis(2));
        }
    }

    /// Waits until it is so.
    pub fn until(&self, what: &str, mut so: impl FnMut() -> bool) {
        let begun = Instant::now();
        while !so() {
            assert!(begun.elapsed() < PATIENCE, "{what}: not within {} s\n{}", PATIENCE.as_secs(), self.log());
            std::thread::sleep(Duration::from_millis(1));
        }
    }

    pub fn log(&self) -> String {
        std::fs::read_to_string(self.dir.0.join("service.log")).unwrap_or_default()
    }

    /// This test again as a process of its own with a role.
    pub fn role(&self, test: &str, role: &str) -> Process {
        let this = std::env::current_exe().expect("this program");
        let child = self
            .command(&this.display().to_string())
            .args([test, "--exact", "--nocapture", "--test-threads=1"])
            .env("RAVENPOSE_TEST_ROLE", role)
            .stdin(Stdio::null())
            .stdout(Stdio::piped())
            .spawn()
            .expect("the role starts");
        Process(child)
    }

    pub fn poses(&self) -> Reader<CorrectedPose> {
        Reader::open(&self.settings, 64).expect("a reader of poses")
    }
}

impl Drop for World {
    fn drop(&mut self) {
        remove_shared_memory(&self.settings.prefix);
    }
}

/// A child that is killed when dropped.
pub struct Process(pub Child);

impl Process {
    pub fn kill(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }

    pub fn signal(&self, signal: i32) {
        // SAFETY: a signal to a child that was not waited for yet: the number is still ours.
        unsafe { libc::kill(self.0.id() as i32, signal) };
    }

    /// Waits for the end.
    pub fn end(&mut self) -> std::process::ExitStatus {
        let begun = Instant::now();
        loop {
            if let Some(status) = self.0.try_wait().expect("status") {
                return status;
            }
            assert!(begun.elapsed() < PATIENCE, "the process does not end");
            std::thread::sleep(Duration::from_millis(1));
        }
    }
}

impl Drop for Process {
    fn drop(&mut self) {
        self.kill();
    }
}

/// The part of the role, if this process is one.
pub fn role() -> Option<String> {
    std::env::var("RAVENPOSE_TEST_ROLE").ok()
}

/// A state whose every position tells its own sequence number and time, so that a mixture of two is seen.
pub fn telling(sequence: u64, time_ns: i64) -> RavenState {
    let mut state = RavenState::new();
    state.arms = 3;
    state.runlevel = 3;
    state.type_ = [49, 22];
    state.dt_nsec = 1_000_000;
    let (mark, time) = marks(sequence, time_ns);
    state.pos = [mark, time, mark, mark, time, mark];
    for arm in 0..2 {
        state.jpos[arm * 8..arm * 8 + 3].copy_from_slice(&[30.0, 90.0, 22.9]);
        state.jpos_d[arm * 8..arm * 8 + 3].copy_from_slice(&[30.0, 90.0, 22.9]);
        state.enc_vals[arm * 8] = mark;
        for axis in 0..3 {
            state.ori[arm * 9 + axis * 4] = 1.0;
        }
    }
    state.source_time_ns = time_ns;
    state
}

/// Small numbers made of a sequence number and a time.
pub fn marks(sequence: u64, time_ns: i64) -> (i32, i32) {
    ((sequence % 200_000) as i32, (time_ns / 1000 % 200_000) as i32)
}

/// Is every position of the pose that of the state it claims to answer?
pub fn whole(pose: &CorrectedPose) -> bool {
    let (mark, time) = marks(pose.source_sequence, pose.source_time_ns);
    let expected = [f64::from(mark), f64::from(time), f64::from(mark)];
    pose.admit().is_ok()
        && pose.arm.iter().all(|arm| {
            arm.raw_position_um == expected
                && (0..3).all(|axis| arm.corrected_position_um[axis] == expected[axis] + arm.correction_um[axis])
        })
}

/// Publishes telling states at 1 kHz until killed, each written slowly in two halves, so that a kill often meets a half-written one.
pub fn publish_forever() -> ! {
    let settings = Settings::from_env();
    let writer: Writer<RavenState> = Writer::open(&settings).expect("writer");
    let source = now_ns() as u64 | 1;
    let mut sequence = 0;
    let mut next = now_ns();
    loop {
        sequence += 1;
        let mut state = telling(sequence, now_ns());
        state.source_id = source;
        state.seal(sequence);
        if let Ok(mut loan) = writer.loan() {
            let half = size_of::<RavenState>() / 2;
            let to: *mut u8 = loan.as_mut_ptr().cast();
            let from: *const u8 = std::ptr::from_ref(&state).cast();
            // SAFETY: both are states; the two halves are the whole.
            unsafe { std::ptr::copy_nonoverlapping(from, to, half) };
            let until = now_ns() + 200_000;
            while now_ns() < until {
                std::hint::spin_loop();
            }
            // SAFETY: as above; now everything is written.
            let _ = unsafe {
                std::ptr::copy_nonoverlapping(from.add(half), to.add(half), half);
                loan.send_written()
            };
        }
        next = (next + 1_000_000).max(now_ns() - 1_000_000);
        sleep_until_ns(next);
    }
}
