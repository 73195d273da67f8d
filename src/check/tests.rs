//! Fake machines: one that is fit, and every way in which I know a machine not to be. Each check is asked both ways.
#![allow(clippy::unwrap_used, clippy::expect_used)]

use super::*;
use ravenpose_transport::ROOM;
use std::os::unix::fs::{MetadataExt, PermissionsExt};
use std::sync::atomic::{AtomicUsize, Ordering::Relaxed};

static NUMBER: AtomicUsize = AtomicUsize::new(0);
const CORE: usize = 3;

/// A machine's files in a temporary directory, removed when dropped.
struct Machine(PathBuf);

impl Drop for Machine {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

impl Machine {
    fn empty() -> Self {
        let name = format!("ravenpose-check-{}-{}", std::process::id(), NUMBER.fetch_add(1, Relaxed));
        let root = std::env::temp_dir().join(name);
        let _ = std::fs::remove_dir_all(&root);
        std::fs::create_dir_all(&root).unwrap();
        Self(root)
    }

    /// Four cores, core 3 prepared for us.
    fn fit() -> Self {
        let machine = Self::empty();
        let uid = std::fs::metadata(&machine.0).unwrap().uid();
        let status = format!("Name:\tx\nUid:\t{uid}\t{uid}\t{uid}\t{uid}\nCapEff:\t0000000000000000\n");
        for (path, text) in [
            ("/sys/kernel/realtime", "1\n"),
            ("/proc/version", "Linux version 6.12.0-rt (x) #1 SMP PREEMPT_RT\n"),
            ("/proc/cmdline", "quiet\n"),
            ("/proc/sys/kernel/sched_rt_runtime_us", "-1\n"),
            ("/proc/sys/kernel/sched_rt_period_us", "1000000\n"),
            ("/sys/devices/system/clocksource/clocksource0/current_clocksource", "tsc\n"),
            ("/proc/cpuinfo", "processor\t: 0\nflags\t\t: fpu tsc avx2\n"),
            ("/sys/devices/system/cpu/online", "0-3\n"),
            ("/sys/devices/system/cpu/isolated", "3\n"),
            ("/sys/devices/system/cpu/nohz_full", "3\n"),
            ("/sys/devices/system/cpu/cpu3/cpufreq/scaling_governor", "performance\n"),
            ("/sys/devices/system/cpu/cpu3/topology/thread_siblings_list", "3\n"),
            ("/sys/devices/system/cpu/cpu3/cpuidle/state0/name", "POLL\n"),
            ("/sys/devices/system/cpu/cpu3/cpuidle/state0/latency", "0\n"),
            ("/sys/devices/system/cpu/cpu3/cpuidle/state0/disable", "0\n"),
            ("/sys/devices/system/cpu/cpu3/cpuidle/state1/name", "C6\n"),
            ("/sys/devices/system/cpu/cpu3/cpuidle/state1/latency", "133\n"),
            ("/sys/devices/system/cpu/cpu3/cpuidle/state1/disable", "1\n"),
            ("/proc/irq/24/smp_affinity_list", "0-2\n"),
            ("/proc/irq/25/smp_affinity_list", "0-3\n"),
            ("/proc/irq/25/effective_affinity_list", "1\n"),
            ("/proc/1/comm", "systemd\n"),
            ("/dev/cpu_dma_latency", ""),
            ("/proc/self/limits", "Limit  Soft\nMax locked memory  unlimited  unlimited  bytes\nMax realtime priority  95  95\n"),
            ("/proc/self/status", status.as_str()),
            ("/proc/self/uid_map", "         0          0 4294967295\n"),
            ("/proc/self/cgroup", "0::/system.slice/ravenposed.service\n"),
            ("/sys/fs/cgroup/system.slice/ravenposed.service/cpu.max", "max 100000\n"),
            ("/sys/fs/cgroup/system.slice/ravenposed.service/cpuset.cpus.effective", "0-3\n"),
            ("/proc/swaps", "Filename\tType\tSize\tUsed\tPriority\n"),
            ("/sys/kernel/mm/transparent_hugepage/enabled", "always [madvise] never\n"),
            ("/proc/sys/vm/compact_unevictable_allowed", "0\n"),
            ("/dev/shm/iox2_a.data", "x"),
            ("/dev/shm/foreign", "x"),
            ("/tmp/iceoryx2/nodes/x", ""),
            ("/etc/passwd", "root:x:0:0::/root:/bin/sh\nraven:x:995:995::/:/bin/false\n"),
        ] {
            machine.write(path, text);
        }
        machine.mode("/tmp/iceoryx2", 0o750);
        machine
    }

    fn path(&self, path: &str) -> PathBuf {
        self.0.join(path.trim_start_matches('/'))
    }

    fn write(&self, path: &str, text: &str) {
        let path = self.path(path);
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        std::fs::write(path, text).unwrap();
    }

    fn remove(&self, path: &str) {
        let path = self.path(path);
        if path.is_dir() { std::fs::remove_dir_all(path).unwrap() } else { std::fs::remove_file(path).unwrap() }
    }

    fn mode(&self, path: &str, mode: u32) {
        std::fs::set_permissions(self.path(path), std::fs::Permissions::from_mode(mode)).unwrap();
    }

    fn ask(&self, core: Option<usize>, spins: bool) -> Vec<Finding> {
        examine(&Question { sysroot: &self.0, core, priority: 80, spins })
    }

    fn find(&self, id: &str) -> Finding {
        self.ask(Some(CORE), true).into_iter().find(|finding| finding.id == id).expect(id)
    }
}

/// What is wrong, and the words that the finding and its remedy must then have.
struct Case {
    id: &'static str,
    files: &'static [(&'static str, &'static str)],
    level: Level,
    found: &'static str,
    remedy: &'static str,
}

const CPU3: &str = "/sys/devices/system/cpu/cpu3";

#[rustfmt::skip]
const BAD: &[Case] = &[
    Case { id: "kernel.preemption", files: &[("/sys/kernel/realtime", "0"), ("/proc/version", "Linux SMP PREEMPT_DYNAMIC"), ("/sys/kernel/debug/sched/preempt", "none (voluntary) full lazy")], level: Level::Fail, found: "mode voluntary", remedy: "preempt=full" },
    Case { id: "kernel.preemption", files: &[("/sys/kernel/realtime", "0"), ("/proc/version", "Linux SMP PREEMPT_DYNAMIC"), ("/proc/cmdline", "quiet preempt=full")], level: Level::Warn, found: "mode full", remedy: "PREEMPT_RT" },
    Case { id: "kernel.preemption", files: &[("/sys/kernel/realtime", "0"), ("/proc/version", "Linux SMP PREEMPT_DYNAMIC")], level: Level::Warn, found: "unknown", remedy: "PREEMPT_RT" },
    Case { id: "kernel.preemption", files: &[("/sys/kernel/realtime", "0"), ("/proc/version", "Linux SMP PREEMPT x")], level: Level::Warn, found: "not PREEMPT_RT", remedy: "PREEMPT_RT" },
    Case { id: "kernel.preemption", files: &[("/sys/kernel/realtime", "0"), ("/proc/version", "Linux SMP x")], level: Level::Fail, found: "without preemption", remedy: "PREEMPT_RT" },
    Case { id: "kernel.throttling", files: &[("/proc/sys/kernel/sched_rt_runtime_us", "950000")], level: Level::Fail, found: "50 ms of each second", remedy: "sched_rt_runtime_us = -1" },
    Case { id: "kernel.clock_source", files: &[("/sys/devices/system/clocksource/clocksource0/current_clocksource", "hpet")], level: Level::Warn, found: "hpet", remedy: "clocksource=tsc" },
    Case { id: "kernel.clock_source", files: &[("/sys/devices/system/clocksource/clocksource0/current_clocksource", "kvm-clock")], level: Level::Warn, found: "kvm-clock", remedy: "tsc" },
    Case { id: "kernel.virtual", files: &[("/proc/cpuinfo", "flags : fpu hypervisor")], level: Level::Warn, found: "host", remedy: "real hardware" },
    Case { id: "kernel.virtual", files: &[("/proc/cpuinfo", "Features : fp")], level: Level::Warn, found: "unknown", remedy: "real hardware" },
    Case { id: "core.chosen", files: &[("/sys/devices/system/cpu/online", "0-2")], level: Level::Fail, found: "offline", remedy: "echo 1 > /sys/devices/system/cpu/cpu3/online" },
    Case { id: "core.isolated", files: &[("/sys/devices/system/cpu/isolated", "")], level: Level::Warn, found: "isolated: none", remedy: "isolcpus=managed_irq,domain,3 nohz_full=3 rcu_nocbs=3 irqaffinity=0-2" },
    Case { id: "core.isolated", files: &[("/sys/devices/system/cpu/isolated", "1-2")], level: Level::Warn, found: "isolated: 1-2", remedy: "isolcpus" },
    Case { id: "core.isolated", files: &[("/sys/devices/system/cpu/isolated", "rubbish")], level: Level::Warn, found: "unknown", remedy: "isolcpus" },
    Case { id: "core.nohz_full", files: &[("/sys/devices/system/cpu/nohz_full", "(null)")], level: Level::Warn, found: "tick", remedy: "nohz_full=3" },
    Case { id: "core.governor", files: &[("/sys/devices/system/cpu/cpu3/cpufreq/scaling_governor", "powersave")], level: Level::Warn, found: "powersave on core 3", remedy: "cpupower -c 3 frequency-set -g performance" },
    Case { id: "core.smt", files: &[("/sys/devices/system/cpu/cpu3/topology/thread_siblings_list", "1,3")], level: Level::Warn, found: "core 1", remedy: "echo 0 > /sys/devices/system/cpu/cpu1/online" },
    Case { id: "core.interrupts", files: &[("/proc/irq/25/effective_affinity_list", "3"), ("/proc/irq/25/eth0/x", "")], level: Level::Warn, found: "1 of 2 are served on core 3: 25 eth0", remedy: "for i in 25; do echo 0-2 >" },
    Case { id: "core.interrupts", files: &[("/proc/irq/24/smp_affinity_list", "0-3")], level: Level::Warn, found: "24", remedy: "irqaffinity=0-2" },
    Case { id: "core.irqbalance", files: &[("/proc/77/comm", "irqbalance"), ("/sys/devices/system/cpu/isolated", "")], level: Level::Warn, found: "may move", remedy: "IRQBALANCE_BANNED_CPULIST=3" },
    Case { id: "core.idle", files: &[("/sys/devices/system/cpu/cpu3/cpuidle/state1/disable", "0")], level: Level::Warn, found: "C6, which takes 133 us", remedy: "hold_cpu_dma_latency" },
    Case { id: "limits.rtprio", files: &[("/proc/self/limits", "Max realtime priority 0 0")], level: Level::Fail, found: "FIFO 80 is refused", remedy: "LimitRTPRIO=95" },
    Case { id: "limits.rtprio", files: &[("/proc/self/limits", "Max cpu time 0")], level: Level::Warn, found: "unknown", remedy: "LimitRTPRIO=95" },
    Case { id: "limits.memlock", files: &[("/proc/self/limits", "Max locked memory 8388608 8388608 bytes")], level: Level::Fail, found: "8192 KiB", remedy: "LimitMEMLOCK=infinity" },
    Case { id: "limits.memlock", files: &[("/proc/self/limits", "Max locked memory 536870912 536870912 bytes")], level: Level::Warn, found: "512 MiB", remedy: "memlock unlimited" },
    Case { id: "limits.cpu_quota", files: &[("/sys/fs/cgroup/system.slice/cpu.max", "50000 100000")], level: Level::Warn, found: "system.slice/cpu.max", remedy: "CPUQuota=" },
    Case { id: "limits.cpu_quota", files: &[("/proc/self/cgroup", "2:cpu,cpuacct:/a\n0::/a"), ("/sys/fs/cgroup/cpu/a/cpu.cfs_quota_us", "1000")], level: Level::Warn, found: "cfs_quota_us is 1000", remedy: "echo -1" },
    Case { id: "limits.cpu_quota", files: &[("/proc/self/cgroup", "2:cpu:/a"), ("/sys/fs/cgroup/cpu/a/cpu.rt_runtime_us", "0")], level: Level::Fail, found: "FIFO is refused", remedy: "RT_GROUP_SCHED" },
    Case { id: "limits.cpuset", files: &[("/sys/fs/cgroup/system.slice/ravenposed.service/cpuset.cpus.effective", "0-2")], level: Level::Fail, found: "cannot go to core 3", remedy: "AllowedCPUs=" },
    Case { id: "memory.swap", files: &[("/proc/swaps", "Filename\n/dev/sda2 partition 1 0 -2")], level: Level::Warn, found: "/dev/sda2", remedy: "swapoff -a" },
    Case { id: "memory.huge_pages", files: &[("/sys/kernel/mm/transparent_hugepage/enabled", "[always] madvise never")], level: Level::Warn, found: "always", remedy: "transparent_hugepage=madvise" },
    Case { id: "memory.compaction", files: &[("/proc/sys/vm/compact_unevictable_allowed", "1")], level: Level::Warn, found: "moves locked pages", remedy: "sysctl -w vm.compact_unevictable_allowed=0" },
    Case { id: "memory.compaction", files: &[("/proc/sys/vm/compact_unevictable_allowed", "2")], level: Level::Warn, found: "unknown", remedy: "/etc/sysctl.d/60-ravenpose.conf" },
    Case { id: "transport.root", files: &[("/proc/self/status", "Uid:\t995\t995\t995\t995")], level: Level::Fail, found: "this is raven: the transport has no rights management", remedy: "systemd-tmpfiles --create" },
    Case { id: "transport.files", files: &[("/proc/self/status", "Uid:\t995\t995\t995\t995")], level: Level::Fail, found: "same user", remedy: "iox2_*" },
];

#[test]
fn a_fit_machine_has_no_complaint() {
    for finding in Machine::fit().ask(Some(CORE), true) {
        assert_eq!(finding.level, Level::Ok, "{finding}");
        assert_eq!(finding.remedy, None, "{finding}");
    }
}

#[test]
fn every_defect_is_found_with_its_remedy() {
    for case in BAD {
        let machine = Machine::fit();
        assert_eq!(machine.find(case.id).level, Level::Ok, "{} before", case.id);
        if case.files.iter().any(|(path, _)| *path == "/proc/77/comm") {
            // irqbalance alone does no harm to an isolated core.
            machine.write("/proc/77/comm", "irqbalance");
            assert_eq!(machine.find(case.id).level, Level::Ok);
        }
        if case.id == "limits.cpu_quota" && case.files.len() == 1 {
            machine.remove("/sys/fs/cgroup/system.slice/ravenposed.service/cpu.max");
        }
        for (path, text) in case.files {
            machine.write(path, text);
        }
        let finding = machine.find(case.id);
        assert_eq!(finding.level, case.level, "{finding}");
        assert!(finding.found.contains(case.found), "{finding}\nlacks {:?}", case.found);
        let remedy = finding.remedy.clone().unwrap_or_default();
        assert!(remedy.contains(case.remedy), "{finding}\nlacks {:?}", case.remedy);
    }
}

#[test]
fn every_check_has_a_defect_in_the_tests() {
    let elsewhere = ["limits.priority", "core.dma_latency", "memory.shared"];
    for finding in Machine::fit().ask(Some(CORE), true) {
        assert!(BAD.iter().any(|case| case.id == finding.id) || elsewhere.contains(&finding.id), "{} is untested", finding.id);
    }
}

#[test]
fn what_cannot_be_read_is_never_fine() {
    let findings = Machine::empty().ask(Some(CORE), true);
    for finding in findings {
        // Answered by the question itself; the running thread needs no file for it.
        if finding.id == "limits.priority" {
            continue;
        }
        assert_ne!(finding.level, Level::Ok, "{finding}");
        assert!(finding.remedy.is_some(), "{finding}");
        let known_absence = ["transport.root", "core.dma_latency"].contains(&finding.id);
        assert!(known_absence || finding.found.contains("unknown"), "{finding}");
    }
}

#[test]
fn each_line_is_one_line() {
    for machine in [Machine::fit(), Machine::empty()] {
        for finding in machine.ask(None, false).iter().chain(&machine.ask(Some(CORE), true)) {
            assert!(!finding.found.contains('\n') && !finding.found.is_empty());
            assert!(finding.remedy.as_ref().is_none_or(|remedy| !remedy.contains('\n') && !remedy.is_empty()));
            assert!(finding.to_string().lines().count() <= 2);
        }
    }
}

#[test]
fn without_a_core_nothing_about_it_is_fine() {
    let findings = Machine::fit().ask(None, false);
    for id in ["core.chosen", "core.isolated", "core.nohz_full", "core.smt", "core.interrupts"] {
        let finding = findings.iter().find(|finding| finding.id == id).unwrap();
        assert_eq!(finding.level, Level::Warn, "{finding}");
        assert!(finding.found.contains("no core is chosen"), "{finding}");
    }
}

#[test]
fn a_core_that_does_not_exist_fails() {
    let findings = Machine::fit().ask(Some(64), false);
    assert_eq!(findings[4].id, "core.chosen");
    assert_eq!(findings[4].level, Level::Fail);
    assert_eq!(findings[4].found, "there is no core 64");
}

#[test]
fn throttling_matters_only_to_a_loop_that_spins() {
    let machine = Machine::fit();
    machine.write("/proc/sys/kernel/sched_rt_runtime_us", "950000");
    assert_eq!(machine.ask(Some(CORE), true)[1].level, Level::Fail);
    assert_eq!(machine.ask(Some(CORE), false)[1].level, Level::Ok);
    machine.write("/proc/sys/kernel/sched_rt_runtime_us", "1000000");
    assert_eq!(machine.ask(Some(CORE), true)[1].level, Level::Ok);
    machine.remove("/proc/sys/kernel/sched_rt_runtime_us");
    assert_eq!(machine.ask(Some(CORE), true)[1].level, Level::Fail);
    assert_eq!(machine.ask(Some(CORE), false)[1].level, Level::Warn);
}

#[test]
fn priority_stays_below_the_controller() {
    for (priority, level) in [(1, Level::Ok), (95, Level::Ok), (96, Level::Fail), (0, Level::Fail), (-1, Level::Fail)] {
        assert_eq!(limits::priority(priority).level, level, "{priority}");
    }
}

#[test]
fn capabilities_replace_limits_but_not_inside_a_user_namespace() {
    let machine = Machine::fit();
    machine.write("/proc/self/limits", "Max realtime priority 0 0\nMax locked memory 0 0\n");
    machine.write("/proc/self/status", "Uid: 0 0 0 0\nCapEff:\t0000000000804000\n");
    for (map, level) in [("0 0 4294967295", Level::Ok), ("0 1000 1", Level::Fail)] {
        machine.write("/proc/self/uid_map", map);
        assert_eq!(machine.find("limits.rtprio").level, level);
        assert_eq!(machine.find("limits.memlock").level, level);
    }
}

#[test]
fn the_root_group_has_no_quota() {
    let machine = Machine::fit();
    for (groups, level) in [("0::/", Level::Ok), ("3:cpu:/\n0::/x", Level::Ok), ("0::/gone", Level::Warn), ("", Level::Warn)] {
        machine.write("/proc/self/cgroup", groups);
        assert_eq!(machine.find("limits.cpu_quota").level, level, "{groups:?}");
    }
}

#[test]
fn irqbalance_may_run_if_it_leaves_the_core_alone() {
    let machine = Machine::fit();
    machine.write("/proc/77/comm", "irqbalance");
    machine.write("/sys/devices/system/cpu/isolated", "");
    machine.write("/etc/default/irqbalance", "#IRQBALANCE_BANNED_CPULIST=3\n");
    assert_eq!(machine.find("core.irqbalance").level, Level::Warn);
    machine.write("/etc/default/irqbalance", "IRQBALANCE_BANNED_CPULIST=\"2-3\"\n");
    assert_eq!(machine.find("core.irqbalance").level, Level::Ok);
}

#[test]
fn dma_latency_device_must_be_there() {
    let machine = Machine::fit();
    machine.remove("/dev/cpu_dma_latency");
    let finding = machine.find("core.dma_latency");
    assert_eq!(finding.level, Level::Warn);
    assert!(finding.remedy.unwrap().contains("cpu-dma-latency.conf"));
}

#[test]
fn shared_memory_needs_room() {
    // What a container has by itself is enough, also while the service runs.
    assert_eq!(memory::judge_shared_memory(64 << 20, 64 << 20, 0).level, Level::Ok);
    assert_eq!(memory::judge_shared_memory(64 << 20, 25 << 20, 39 << 20).level, Level::Warn);
    assert_eq!(memory::judge_shared_memory(1 << 30, ROOM, 5).level, Level::Ok);
    let full = memory::judge_shared_memory(1 << 30, ROOM - 6, 5);
    assert_eq!(full.level, Level::Fail);
    assert!(full.remedy.unwrap().contains("remount,size="));
}

#[test]
fn the_transport_directory_must_be_a_closed_one() {
    let machine = Machine::fit();
    machine.mode("/tmp/iceoryx2", 0o777);
    let finding = machine.find("transport.root");
    assert_eq!((finding.level, finding.remedy.as_deref()), (Level::Fail, Some("chmod 0750 /tmp/iceoryx2")));
    machine.remove("/tmp/iceoryx2");
    assert_eq!(machine.find("transport.root").level, Level::Warn);
    std::os::unix::fs::symlink("/", machine.path("/tmp/iceoryx2")).unwrap();
    let finding = machine.find("transport.root");
    assert!(finding.level == Level::Fail && finding.found.contains("not a directory"), "{finding}");
}

#[test]
fn cores_sleep_only_as_deep_as_the_enabled_states() {
    let machine = Machine::fit();
    machine.remove(&format!("{CPU3}/cpuidle/state1/latency"));
    assert!(machine.find("core.idle").found.contains("unknown"));
}

#[test]
fn lists_of_cores_are_read_and_written() {
    for (text, cores) in [("", vec![]), ("(null)", vec![]), ("3", vec![3]), ("0-2,5\n", vec![0, 1, 2, 5])] {
        assert_eq!(cpu_list(text), Some(cores), "{text:?}");
    }
    for text in ["a", "1-", "3-1", "0-99999999", "1,,2", "-1"] {
        assert_eq!(cpu_list(text), None, "{text:?}");
    }
    assert_eq!(show_cpu_list(&[0, 1, 2, 5, 7, 8]), "0-2,5,7-8");
    assert_eq!(show_cpu_list(&[]), "");
}

#[test]
fn findings_can_be_printed_sorted_and_written_as_json() {
    let finding = Finding::fail("a.b", "found", "do this");
    assert_eq!(finding.to_string(), format!("FAIL  a.b{:19}found\n{:28}-> do this", "", ""));
    let json = serde_json::to_string(&finding).unwrap();
    assert_eq!(json, r#"{"id":"a.b","level":"fail","found":"found","remedy":"do this"}"#);
    assert_eq!(worst(&[finding, Finding::ok("c", "")]), Level::Fail);
    assert_eq!(worst(&[]), Level::Ok);
}

#[test]
fn this_machine_can_be_examined() {
    let findings = examine(&Question { sysroot: Path::new("/"), core: Some(0), priority: 80, spins: false });
    assert_eq!(findings.len(), Machine::fit().ask(Some(CORE), true).len());
}
