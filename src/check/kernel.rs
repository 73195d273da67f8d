//! Questions to the kernel as a whole.

use super::{Finding, Tree};

/// Can the kernel be interrupted wherever it is?
pub(super) fn preemption(tree: &Tree) -> Finding {
    let id = "kernel.preemption";
    let install =
        "install a PREEMPT_RT kernel (Debian: apt install linux-image-rt-amd64; Ubuntu: pro enable realtime-kernel) and boot it";
    if tree.read("/sys/kernel/realtime").is_ok_and(|text| text == "1") {
        return Finding::ok(id, "PREEMPT_RT (/sys/kernel/realtime is 1)");
    }
    let version = match tree.read("/proc/version") {
        Ok(version) => version,
        Err(cause) => return Finding::unknown(id, cause, install),
    };
    if version.contains("PREEMPT_RT") {
        return Finding::ok(id, "PREEMPT_RT (/proc/version)");
    }
    let until_then = format!("{install}; until then add preempt=full to the kernel command line");
    if version.contains("PREEMPT_DYNAMIC") {
        return match dynamic_mode(tree).as_deref() {
            Some(mode @ ("full" | "lazy")) => Finding::warn(id, format!("PREEMPT_DYNAMIC in mode {mode}, not PREEMPT_RT"), install),
            Some(mode) => Finding::fail(id, format!("PREEMPT_DYNAMIC in mode {mode}: kernel code delays the loop"), until_then),
            None => Finding::unknown(
                id,
                "PREEMPT_DYNAMIC, not PREEMPT_RT; its mode is in /sys/kernel/debug/sched/preempt, which cannot be read",
                until_then,
            ),
        };
    }
    if version.contains("PREEMPT") {
        return Finding::warn(id, "PREEMPT (low-latency desktop), not PREEMPT_RT", install);
    }
    Finding::fail(id, "a kernel without preemption: kernel code delays the loop by milliseconds", install)
}

/// The mode of a PREEMPT_DYNAMIC kernel: debugfs marks it with parentheses; the command line may have set it.
fn dynamic_mode(tree: &Tree) -> Option<String> {
    if let Ok(modes) = tree.read("/sys/kernel/debug/sched/preempt") {
        return modes.split_whitespace().find_map(|mode| Some(mode.strip_prefix('(')?.strip_suffix(')')?.to_owned()));
    }
    let line = tree.read("/proc/cmdline").ok()?;
    line.split_whitespace().filter_map(|word| word.strip_prefix("preempt=")).next_back().map(str::to_owned)
}

/// Does the kernel take the core away from a FIFO thread that never sleeps?
pub(super) fn throttling(tree: &Tree, spins: bool) -> Finding {
    let id = "kernel.throttling";
    let remedy =
        "write kernel.sched_rt_runtime_us = -1 to /etc/sysctl.d/60-ravenpose.conf and run sysctl --system; or wait = \"sleep\"";
    let number = |path: &str| -> Result<i64, String> {
        let text = tree.read(path)?;
        text.parse().map_err(|_| format!("{path} holds {text:?}, not a number"))
    };
    let runtime_us = match number("/proc/sys/kernel/sched_rt_runtime_us") {
        Ok(value) => value,
        Err(cause) if spins => return Finding::fail(id, format!("unknown: {cause}; the loop spins and must know"), remedy),
        Err(cause) => return Finding::unknown(id, cause, "look at sysctl kernel.sched_rt_runtime_us as root"),
    };
    let period_us = number("/proc/sys/kernel/sched_rt_period_us").unwrap_or(1_000_000);
    if runtime_us < 0 || runtime_us >= period_us {
        return Finding::ok(id, format!("off (sched_rt_runtime_us = {runtime_us})"));
    }
    if spins {
        let found = format!(
            "sched_rt_runtime_us = {runtime_us} of {period_us} and the loop spins: the kernel takes about 50 ms of each second from a \
             FIFO thread that never sleeps (measured: p99.9 of the wake-up 45.6 ms instead of 6 us)"
        );
        return Finding::fail(id, found, remedy);
    }
    Finding::ok(
        id,
        format!("sched_rt_runtime_us = {runtime_us}: harmless for a loop that sleeps, and a net under one that is stuck"),
    )
}

/// Is reading the time cheap and steady?
pub(super) fn clock_source(tree: &Tree) -> Finding {
    let id = "kernel.clock_source";
    let remedy =
        "add tsc=reliable clocksource=tsc to the kernel command line; if dmesg | grep -i tsc says unstable, update the BIOS first";
    match tree.read("/sys/devices/system/clocksource/clocksource0/current_clocksource") {
        Err(cause) => Finding::unknown(id, cause, remedy),
        Ok(name) if matches!(name.as_str(), "tsc" | "arch_sys_counter") => Finding::ok(id, name),
        Ok(name) if matches!(name.as_str(), "hpet" | "acpi_pm" | "jiffies" | "refined-jiffies") => {
            Finding::warn(id, format!("{name}: each look at the clock is a system call of a microsecond or more"), remedy)
        }
        Ok(name) => Finding::warn(id, format!("{name}, not tsc"), remedy),
    }
}

/// Does a host decide when we run?
pub(super) fn virtual_machine(tree: &Tree) -> Finding {
    let id = "kernel.virtual";
    let remedy = "judge latency on real hardware only; label every histogram of this machine as virtual";
    let text = match tree.read("/proc/cpuinfo") {
        Ok(text) => text,
        Err(cause) => return Finding::unknown(id, cause, remedy),
    };
    let Some(flags) = text.lines().find(|line| line.starts_with("flags")) else {
        return Finding::unknown(id, "/proc/cpuinfo has no flags line (not an x86 processor)", remedy);
    };
    if flags.split_whitespace().any(|flag| flag == "hypervisor") {
        return Finding::warn(
            id,
            "a virtual machine: bursts of several ms come from the host, no setting in here prevents them",
            remedy,
        );
    }
    Finding::ok(id, "real hardware (no hypervisor flag)")
}
