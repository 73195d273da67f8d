//! The unit is a product: it must verify, score, hold the settings of faults.md, and start for real where a systemd runs.
#![allow(missing_docs)]

use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::time::{Duration, Instant};

const BINARY: &str = env!("CARGO_BIN_EXE_ravenposed");
/// How often the service looks at the loop's heartbeat (`TICK` in src/watch.rs), ms.
const TICK_MS: u64 = 30;

fn source(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("systemd").join(name)
}

fn text(name: &str) -> String {
    std::fs::read_to_string(source(name)).unwrap_or_else(|cause| panic!("{name}: {cause}"))
}

/// A directory of this test's own, removed when dropped.
struct Scratch(PathBuf);

impl Scratch {
    fn new(parent: &Path, name: &str) -> Self {
        let path = parent.join(format!("ravenpose-{name}-{}", std::process::id()));
        let _ = std::fs::remove_dir_all(&path);
        std::fs::create_dir_all(&path).expect("a scratch directory");
        Self(path)
    }

    /// A copy of the unit that starts the binary of this build.
    fn unit(&self) -> PathBuf {
        let unit = text("ravenposed.service").replace("ExecStart=/usr/bin/ravenposed", &format!("ExecStart={BINARY}"));
        assert!(unit.contains(BINARY));
        self.write("ravenposed.service", &unit)
    }

    fn write(&self, name: &str, contents: &str) -> PathBuf {
        let path = self.0.join(name);
        std::fs::create_dir_all(path.parent().expect("a parent")).expect("a directory");
        std::fs::write(&path, contents).expect("a file");
        path
    }
}

impl Drop for Scratch {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

fn run(program: &str, arguments: &[&str]) -> Output {
    Command::new(program).args(arguments).env("LC_ALL", "C.UTF-8").output().unwrap_or_else(|cause| panic!("{program}: {cause}"))
}

fn output(program: &str, arguments: &[&str]) -> String {
    String::from_utf8_lossy(&run(program, arguments).stdout).trim().to_owned()
}

/// First line of `systemd-analyze --version`, or `None` after saying plainly that the test skips.
fn analyze() -> Option<String> {
    match Command::new("systemd-analyze").arg("--version").output() {
        Ok(answer) if answer.status.success() => Some(String::from_utf8_lossy(&answer.stdout).lines().next()?.to_owned()),
        _ => {
            println!("skipped: systemd-analyze is not installed");
            None
        }
    }
}

/// Verifies a unit; the answer is everything that systemd has to say about it.
fn verify(unit: &Path) -> String {
    let answer = run("systemd-analyze", &["verify", "--man=no", unit.to_str().expect("a path in UTF-8")]);
    let said = [answer.stdout, answer.stderr].map(|bytes| String::from_utf8_lossy(&bytes).into_owned()).concat();
    if answer.status.success() { said } else { format!("{said}{}", answer.status) }
}

/// The values of a key, in order.
fn values<'a>(unit: &'a str, key: &str) -> Vec<&'a str> {
    unit.lines().filter_map(|line| line.strip_prefix(key)?.strip_prefix('=')).collect()
}

/// The only value of a key.
fn value<'a>(unit: &'a str, key: &str) -> &'a str {
    match values(unit, key)[..] {
        [only] => only,
        ref all => panic!("{key}= stands {} times", all.len()),
    }
}

#[test]
fn unit_and_drop_ins_verify_without_a_word() {
    if analyze().is_none() {
        return;
    }
    let scratch = Scratch::new(&std::env::temp_dir(), "verify");
    let unit = scratch.unit();
    assert_eq!(verify(&unit), "");
    for name in ["isolated-core.conf", "cpu-dma-latency.conf", "controller-user.conf"] {
        let name = format!("ravenposed.service.d/{name}");
        let _ = scratch.write(&name, &text(&name));
        assert_eq!(verify(&unit), "", "{name}");
    }
    let controller = scratch.write("raven-controller.service", "[Service]\nExecStart=/bin/sh -c true\n");
    let name = "raven-controller.service.d/ravenpose.conf";
    let _ = scratch.write(name, &text(name));
    assert_eq!(verify(&controller), "");
    // The proof that a word would have been said, about the unit and about a drop-in.
    let _ = scratch.write("ravenposed.service.d/wrong.conf", "[Service]\nNoSuchSetting=yes\n");
    assert!(verify(&unit).contains("NoSuchSetting"));
}

#[test]
fn exposure_is_low_and_each_remaining_point_is_explained() {
    let Some(version) = analyze() else { return };
    let scratch = Scratch::new(&std::env::temp_dir(), "security");
    let unit = scratch.unit();
    let report = output("systemd-analyze", &["security", "--offline=true", "--no-pager", unit.to_str().expect("a path in UTF-8")]);
    let level =
        report.lines().find_map(|line| line.split_once("Overall exposure level for ")?.1.split_once(": ")?.1.split(' ').next());
    let level: f64 = level.and_then(|level| level.parse().ok()).unwrap_or_else(|| panic!("no exposure level in {report}"));
    println!("exposure {level} ({version})");
    assert!(level <= 1.0, "{report}");
    if !version.starts_with("systemd 252 ") {
        println!("skipped in part: {version} may count points that 252 does not know; their explanations are not checked");
        return;
    }
    let unit = text("ravenposed.service");
    let explained: Vec<&str> = unit.lines().filter(|line| line.starts_with("# 0.")).collect();
    let counted: Vec<&str> = report.lines().filter_map(|line| line.trim().strip_prefix('✗')?.split_whitespace().next()).collect();
    for name in &counted {
        let key = name.split("=~AF").next().unwrap_or(name);
        assert!(explained.iter().any(|line| line.contains(key)), "{name} is not explained in the unit");
    }
    assert_eq!(explained.len(), counted.len(), "explained {explained:?}, counted {counted:?}");
}

#[test]
fn what_must_be_so_is_so() {
    let unit = text("ravenposed.service");
    for (key, wanted) in [
        ("Type", "notify"),
        ("NotifyAccess", "main"),
        ("ExecStart", "/usr/bin/ravenposed --config /etc/ravenpose/ravenposed.toml"),
        ("User", "raven"),
        ("Group", "raven"),
        ("Restart", "on-failure"),
        ("RemoveIPC", "no"),
        ("PrivateTmp", "no"),
        ("ReadWritePaths", "-/tmp/iceoryx2 /dev/shm"),
        ("RestrictRealtime", "no"),
        ("LimitMEMLOCK", "infinity"),
        ("LimitCORE", "0"),
        ("PrivateNetwork", "yes"),
        ("RestrictAddressFamilies", "AF_UNIX"),
        ("CapabilityBoundingSet", ""),
        ("AmbientCapabilities", ""),
        ("ProtectSystem", "strict"),
        ("MemoryDenyWriteExecute", "yes"),
        ("NoNewPrivileges", "yes"),
        ("DevicePolicy", "closed"),
        ("RuntimeDirectory", "ravenpose"),
        ("StateDirectory", "ravenpose"),
        ("LogsDirectory", "ravenpose"),
    ] {
        assert_eq!(value(&unit, key), wanted, "{key}");
    }
    for present in ["CPUAffinity", "MemoryMax", "StartLimitBurst", "StartLimitIntervalSec"] {
        assert!(!value(&unit, present).is_empty(), "{present}");
    }
    for absent in ["DynamicUser", "CPUSchedulingPolicy", "AllowedCPUs", "Requires", "BindsTo", "PartOf"] {
        assert!(values(&unit, absent).is_empty(), "{absent}");
    }
    let priority: u32 = value(&unit, "LimitRTPRIO").parse().expect("a number");
    assert!(priority < 96, "RAVEN's control loop has FIFO 96 and must win");
}

#[test]
fn a_stuck_loop_is_seen_and_a_crash_repaired_in_time() {
    let unit = text("ravenposed.service");
    let ms = |key: &str| -> u64 { value(&unit, key).strip_suffix("ms").and_then(|number| number.parse().ok()).expect(key) };
    assert!(ms("WatchdogSec") + TICK_MS <= 250, "F43");
    assert!(ms("WatchdogSec") >= 3 * TICK_MS, "one late look must not kill the service");
    assert!(ms("RestartSec") <= 500, "F02: two seconds to the first valid message, start included");
}

#[test]
fn system_calls_of_the_loop_are_allowed_after_the_groups_are_denied() {
    let unit = text("ravenposed.service");
    let filters = values(&unit, "SystemCallFilter");
    assert_eq!(filters.len(), 3);
    assert_eq!(filters[0], "@system-service");
    assert!(filters[1].starts_with('~') && filters[1].contains("@resources") && filters[1].contains("@privileged"));
    for call in ["sched_setscheduler", "sched_setaffinity", "@memlock"] {
        assert!(filters[2].split(' ').any(|one| one == call), "{call}");
    }
}

#[test]
fn all_files_name_the_same_user() {
    let unit = text("ravenposed.service");
    let user = value(&unit, "User");
    let controller = text("raven-controller.service.d/ravenpose.conf");
    assert_eq!(value(&controller, "User"), user);
    let sysusers = text("ravenposed.sysusers.conf");
    assert!(sysusers.lines().any(|line| line.split_whitespace().take(2).eq(["u", user])));
    let tmpfiles = text("ravenposed.tmpfiles.conf");
    let rows: Vec<Vec<&str>> = tmpfiles.lines().map(|line| line.split_whitespace().collect()).collect();
    assert!(rows.contains(&vec!["d", "/tmp/iceoryx2", "0750", user, user, "-"]));
    for kept in ["/tmp/iceoryx2", "/dev/shm/iox2_*"] {
        assert!(rows.iter().any(|row| row.starts_with(&["x", kept])), "{kept} is open to tmp cleaners (F38)");
    }
}

#[test]
fn the_controller_does_not_depend_on_us() {
    let controller = text("raven-controller.service.d/ravenpose.conf");
    assert_eq!(value(&controller, "Wants"), "ravenposed.service");
    for tie in ["After", "Requires", "Requisite", "BindsTo", "PartOf", "Upholds"] {
        assert!(values(&controller, tie).is_empty(), "{tie}= would let the controller wait for us or fall with us");
    }
    assert_eq!(value(&controller, "RemoveIPC"), "no");
    assert_eq!(value(&controller, "PrivateTmp"), "no");
}

/// A copy of the unit under another name with its own directories; everything is undone when dropped.
struct Live {
    name: String,
    unit: PathBuf,
    scratch: Scratch,
    shared: PathBuf,
}

impl Live {
    /// Everything but name, user, paths and the transport's place stays as it is in the unit.
    fn install() -> Self {
        use std::os::unix::fs::PermissionsExt;
        // Not in /run (often noexec) nor in a home (hidden by ProtectHome=).
        let scratch = Scratch::new(Path::new("/var/tmp"), "live");
        let tag = format!("ravenpose-test-{}", std::process::id());
        let shared = Path::new("/dev/shm").join(&tag);
        let binary = scratch.0.join("ravenposed");
        std::fs::copy(BINARY, &binary).expect("a copy of the binary");
        let models = Path::new(env!("CARGO_MANIFEST_DIR")).join("models");
        for name in ["untrained.onnx", "untrained.onnx.sha256"] {
            std::fs::copy(models.join(name), scratch.0.join(name)).expect("a copy of the model");
        }
        let config = format!(
            "allow_untrained = true\nallow_degraded = true\n[transport]\nprefix = \"t{}_\"\nroot = \"{}/\"\n\
             [gold]\nmodel = \"untrained.onnx\"\n[report]\nruntime_dir = \"/run/{tag}\"\nhistogram_dir = \"/var/lib/{tag}\"\n",
            std::process::id(),
            shared.display()
        );
        let config = scratch.write("ravenposed.toml", &config);
        for path in [&scratch.0, &binary] {
            std::fs::set_permissions(path, std::fs::Permissions::from_mode(0o755)).expect("permissions");
        }
        let user = if run("id", &["raven"]).status.success() { "raven" } else { "nobody" };
        let mut unit = String::new();
        for line in text("ravenposed.service").lines() {
            let line = match line.split_once('=').map_or(line, |(key, _)| key) {
                "ExecStart" => format!("ExecStart={} --config {}", binary.display(), config.display()),
                "User" => format!("User={user}"),
                "ExecStartPre" | "Group" => continue,
                key @ ("RuntimeDirectory" | "StateDirectory" | "LogsDirectory") => format!("{key}={tag}"),
                _ => line.to_owned(),
            };
            unit.push_str(&line);
            unit.push('\n');
        }
        let name = format!("{tag}.service");
        let path = Path::new("/run/systemd/system").join(&name);
        std::fs::write(&path, unit).expect("a transient unit");
        let live = Self { name, unit: path, scratch, shared };
        assert!(run("systemctl", &["daemon-reload"]).status.success());
        live
    }

    fn show(&self, property: &str) -> String {
        output("systemctl", &["show", "--value", "-p", property, &self.name])
    }

    fn log(&self) -> String {
        format!("{}\n{}", self.scratch.0.display(), output("journalctl", &["--no-pager", "-n", "40", "-u", &self.name]))
    }

    /// Waits until another process than `old` is active; returns its pid and how long that took.
    fn next(&self, old: &str) -> (String, Duration) {
        let began = Instant::now();
        while began.elapsed() < Duration::from_secs(5) {
            let pid = self.show("MainPID");
            if self.show("ActiveState") == "active" && pid != old && pid != "0" {
                return (pid, began.elapsed());
            }
            std::thread::sleep(Duration::from_millis(10));
        }
        panic!("not active again within 5 s\n{}", self.log());
    }
}

impl Drop for Live {
    fn drop(&mut self) {
        let _ = run("systemctl", &["stop", &self.name]);
        let _ = std::fs::remove_file(&self.unit);
        let _ = run("systemctl", &["daemon-reload"]);
        let _ = run("systemctl", &["reset-failed", &self.name]);
        let tag = self.name.trim_end_matches(".service");
        for path in [self.shared.clone(), Path::new("/var/lib").join(tag), Path::new("/var/log").join(tag)] {
            let _ = std::fs::remove_dir_all(path);
        }
        let prefix = format!("t{}_", std::process::id());
        for entry in std::fs::read_dir("/dev/shm").into_iter().flatten().flatten() {
            if entry.file_name().to_string_lossy().starts_with(&prefix) {
                let _ = std::fs::remove_file(entry.path());
            }
        }
    }
}

/// Runs a test of this file once more, as root, where a systemd is the first process; says so if there can be none.
fn under_a_systemd_of_its_own(test: &str) {
    const INSIDE: &str = "RAVENPOSE_TEST_SYSTEMD";
    assert!(std::env::var_os(INSIDE).is_none(), "a systemd of its own, and it does not run");
    let this = std::env::current_exe().expect("this program");
    let answer = Command::new(Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/common/systemd.sh"))
        .arg(this)
        .args([test, "--exact", "--nocapture"])
        .env(INSIDE, "1")
        .output()
        .expect("a shell");
    let [said, why] = [&answer.stdout, &answer.stderr].map(|bytes| String::from_utf8_lossy(bytes));
    match answer.status.code() {
        Some(0) if said.contains("1 passed") => println!("under a systemd of its own: {said}"),
        Some(125) => println!("skipped: no systemd runs here: {why}"),
        _ => panic!("under a systemd of its own: {}: {said}{why}", answer.status),
    }
}

#[test]
fn starts_restarts_and_stops_under_a_real_systemd() {
    if output("id", &["-u"]) != "0" {
        println!("skipped: only root may start a unit");
        return;
    }
    if !Path::new("/run/systemd/system").is_dir() {
        under_a_systemd_of_its_own("starts_restarts_and_stops_under_a_real_systemd");
        return;
    }
    let live = Live::install();
    assert!(run("systemctl", &["start", &live.name]).status.success(), "{}", live.log());
    let (first, _) = live.next("");

    let status = std::fs::read_to_string(format!("/proc/{first}/status")).expect("the process's status");
    let field = |name: &str| status.lines().find_map(|line| line.strip_prefix(name)).unwrap_or_default().trim();
    assert_eq!(field("NoNewPrivs:"), "1");
    assert_eq!(field("Seccomp:"), "2");
    assert_eq!(field("CapEff:"), "0000000000000000");
    assert!(!field("Uid:").starts_with('0'));

    assert!(run("kill", &["-KILL", &first]).status.success());
    let (second, took) = live.next(&first);
    println!("after SIGKILL: active again in {} ms", took.as_millis());
    assert!(took <= Duration::from_secs(2), "F02");

    // A stopped process feeds no watchdog, like one whose loop is stuck. The bound holds detection and restart; systemd's own timer
    // may be 250 ms late.
    assert!(run("kill", &["-STOP", &second]).status.success());
    let (_, took) = live.next(&second);
    println!("after SIGSTOP: active again in {} ms", took.as_millis());
    assert!(took <= Duration::from_secs(2), "F43");
    assert!(live.log().contains("Watchdog timeout") || live.show("NRestarts") == "2", "{}", live.log());

    let began = Instant::now();
    assert!(run("systemctl", &["stop", &live.name]).status.success());
    println!("stopped in {} ms", began.elapsed().as_millis());
    assert_eq!(live.show("Result"), "success");
    assert_eq!(live.show("ExecMainStatus"), "0", "F42");
}
