//! What this process may do, and the control groups that it is in.

use super::{Finding, Tree};

/// Highest priority that stays below RAVEN's control loop (FIFO 96).
const PRIORITY_MAX: i32 = 95;
/// Locked address space that the service needs: measured 264 MiB (`VmLck` with both shipped models for both arms), doubled.
const MEMLOCK_MIN: u64 = 512 << 20;
/// Capability numbers of `<linux/capability.h>`.
const CAP_IPC_LOCK: u32 = 14;
const CAP_SYS_NICE: u32 = 23;

/// Is the wanted priority one that leaves the controller in front?
pub(super) fn priority(wanted: i32) -> Finding {
    let id = "limits.priority";
    if (1..=PRIORITY_MAX).contains(&wanted) {
        return Finding::ok(id, format!("FIFO {wanted}, below the controller's 96"));
    }
    let found = format!("FIFO {wanted} is not within 1 to {PRIORITY_MAX}; RAVEN's control loop has 96 and must win");
    Finding::fail(id, found, "set priority = 80 in the [loop] table of ravenposed.toml")
}

/// May this process ask for the priority?
pub(super) fn rtprio(tree: &Tree, wanted: i32) -> Finding {
    let id = "limits.rtprio";
    let remedy =
        "LimitRTPRIO=95 in the unit; for a shell `raven - rtprio 95` in /etc/security/limits.d/ravenpose.conf, then log in anew";
    if has_capability(tree, CAP_SYS_NICE) {
        return Finding::ok(id, "CAP_SYS_NICE: any priority is allowed");
    }
    match limit(tree, "Max realtime priority") {
        Err(cause) => Finding::unknown(id, cause, remedy),
        Ok(allowed) if allowed >= u64::from(wanted.unsigned_abs()) => {
            Finding::ok(id, format!("RLIMIT_RTPRIO {allowed} allows FIFO {wanted}"))
        }
        Ok(allowed) => {
            Finding::fail(id, format!("RLIMIT_RTPRIO is {allowed} and there is no CAP_SYS_NICE: FIFO {wanted} is refused"), remedy)
        }
    }
}

/// May this process lock its memory?
pub(super) fn memlock(tree: &Tree) -> Finding {
    let id = "limits.memlock";
    let remedy = "LimitMEMLOCK=infinity in the unit; for a shell `raven - memlock unlimited` in /etc/security/limits.d/ravenpose.conf, then log in anew";
    if has_capability(tree, CAP_IPC_LOCK) {
        return Finding::ok(id, "CAP_IPC_LOCK: any amount may be locked");
    }
    match limit(tree, "Max locked memory") {
        Err(cause) => Finding::unknown(id, cause, remedy),
        Ok(u64::MAX) => Finding::ok(id, "RLIMIT_MEMLOCK is unlimited"),
        Ok(bytes) if bytes >= MEMLOCK_MIN => {
            Finding::warn(id, format!("RLIMIT_MEMLOCK is {} MiB: enough today, a larger model may not fit", bytes >> 20), remedy)
        }
        Ok(bytes) => {
            let found = format!("RLIMIT_MEMLOCK is {} KiB and there is no CAP_IPC_LOCK: memory cannot be locked", bytes >> 10);
            Finding::fail(id, found, remedy)
        }
    }
}

/// The soft limit of a row of `/proc/self/limits`; `u64::MAX` is unlimited.
fn limit(tree: &Tree, name: &str) -> Result<u64, String> {
    let text = tree.read("/proc/self/limits")?;
    let value = text.lines().find_map(|line| line.strip_prefix(name)?.split_whitespace().next());
    match value {
        Some("unlimited") => Ok(u64::MAX),
        Some(number) => number.parse().map_err(|_| format!("/proc/self/limits: {name} is {number:?}, not a number")),
        None => Err(format!("/proc/self/limits has no row {name:?}")),
    }
}

/// A capability counts only in the first user namespace: the kernel asks there for priorities and locked memory.
fn has_capability(tree: &Tree, number: u32) -> bool {
    let everybody = tree.read("/proc/self/uid_map").is_ok_and(|map| map.split_whitespace().eq(["0", "0", "4294967295"]));
    let effective = status_field(tree, "CapEff:").and_then(|mask| u64::from_str_radix(&mask, 16).ok()).unwrap_or(0);
    everybody && effective >> number & 1 == 1
}

/// The first word of a line of `/proc/self/status`.
fn status_field(tree: &Tree, name: &str) -> Option<String> {
    let text = tree.read("/proc/self/status").ok()?;
    text.lines().find_map(|line| line.strip_prefix(name)?.split_whitespace().next().map(str::to_owned))
}

/// The effective user id of this process.
pub(super) fn user_id(tree: &Tree) -> Result<u32, String> {
    let text = tree.read("/proc/self/status")?;
    let uid = text.lines().find_map(|line| line.strip_prefix("Uid:")?.split_whitespace().nth(1)?.parse().ok());
    uid.ok_or_else(|| "/proc/self/status has no Uid line".to_owned())
}

/// The control group of a version-1 controller (`Some("cpu")`) or of version 2 (`None`), as a path below its mount.
fn group_of(lines: &str, controller: Option<&str>) -> Option<String> {
    lines.lines().find_map(|line| {
        let mut fields = line.splitn(3, ':');
        let (number, controllers, path) = (fields.next()?, fields.next()?, fields.next()?);
        let matches = match controller {
            Some(name) => controllers.split(',').any(|one| one == name),
            None => number == "0" && controllers.is_empty(),
        };
        matches.then(|| path.trim_end_matches('/').to_owned())
    })
}

/// Every group from `leaf` up to, but without, the root: the root has no limits.
fn ancestors(leaf: &str) -> impl Iterator<Item = &str> {
    std::iter::successors(Some(leaf), |path| path.rsplit_once('/').map(|(parent, _)| parent)).filter(|path| !path.is_empty())
}

/// Does a control group ration processor time?
pub(super) fn cpu_quota(tree: &Tree) -> Finding {
    let id = "limits.cpu_quota";
    let lines = match tree.read("/proc/self/cgroup") {
        Ok(lines) => lines,
        Err(cause) => return Finding::unknown(id, cause, "look at systemctl show -p CPUQuotaPerSecUSec ravenposed.service"),
    };
    if let Some(leaf) = group_of(&lines, Some("cpu")) {
        return quota_v1(tree, &leaf);
    }
    let Some(leaf) = group_of(&lines, None) else {
        return Finding::unknown(id, "/proc/self/cgroup names no group", "look at cat /proc/self/cgroup");
    };
    let mut asked = leaf.is_empty();
    for group in ancestors(&leaf) {
        // Groups without the cpu controller have no such file; their parents may have one.
        let base = format!("/sys/fs/cgroup{group}");
        let Ok(quota) = tree.read(&format!("{base}/cpu.max")) else {
            asked |=
                tree.read(&format!("{base}/cgroup.controllers")).is_ok_and(|all| !all.split_whitespace().any(|one| one == "cpu"));
            continue;
        };
        asked = true;
        if !quota.starts_with("max") {
            let remedy = format!("take CPUQuota= out of the unit or slice, or: echo max > {base}/cpu.max");
            return Finding::warn(id, format!("{base}/cpu.max is {quota:?}: threads other than the FIFO loop are paused"), remedy);
        }
    }
    if asked {
        return Finding::ok(id, "none");
    }
    Finding::unknown(id, format!("/sys/fs/cgroup{leaf}/cpu.max cannot be read"), "mount cgroup2 at /sys/fs/cgroup")
}

fn quota_v1(tree: &Tree, leaf: &str) -> Finding {
    let id = "limits.cpu_quota";
    for group in ancestors(leaf) {
        let base = format!("/sys/fs/cgroup/cpu{group}");
        if tree.read(&format!("{base}/cpu.rt_runtime_us")).is_ok_and(|text| text == "0") {
            let remedy = format!("echo 950000 > {base}/cpu.rt_runtime_us, its parents first; or a kernel without RT_GROUP_SCHED");
            return Finding::fail(id, format!("{base}/cpu.rt_runtime_us is 0: FIFO is refused in this group"), remedy);
        }
        match tree.read(&format!("{base}/cpu.cfs_quota_us")) {
            Err(cause) => return Finding::unknown(id, cause, "mount the cpu controller at /sys/fs/cgroup/cpu"),
            Ok(quota) if quota.starts_with('-') => {}
            Ok(quota) => {
                let remedy = format!("take CPUQuota= out of the unit or slice, or: echo -1 > {base}/cpu.cfs_quota_us");
                return Finding::warn(
                    id,
                    format!("{base}/cpu.cfs_quota_us is {quota}: threads other than the FIFO loop are paused"),
                    remedy,
                );
            }
        }
    }
    Finding::ok(id, "none")
}

/// Does a control group keep the loop off its core? (`CPUAffinity=` does not, `AllowedCPUs=` does.)
pub(super) fn cpuset(tree: &Tree, core: Option<usize>) -> Finding {
    let id = "limits.cpuset";
    let Some(core) = core else { return Finding::ok(id, "no core is chosen, none can be forbidden") };
    let remedy = format!("take AllowedCPUs= out of the unit or slice, or add {core} to it");
    let lines = match tree.read("/proc/self/cgroup") {
        Ok(lines) => lines,
        Err(cause) => return Finding::unknown(id, cause, remedy),
    };
    let (mount, leaf) = match (group_of(&lines, Some("cpuset")), group_of(&lines, None)) {
        (Some(leaf), _) => ("/sys/fs/cgroup/cpuset", leaf),
        (None, Some(leaf)) => ("/sys/fs/cgroup", leaf),
        (None, None) => return Finding::unknown(id, "/proc/self/cgroup names no group", remedy),
    };
    let mut asked = leaf.is_empty();
    for group in ancestors(&leaf) {
        // Version 2 lists the controllers of a group; without cpuset there is no such file and nothing is restricted.
        asked |= tree.read(&format!("{mount}{group}/cgroup.controllers")).is_ok();
        for name in ["cpuset.cpus.effective", "cpuset.effective_cpus"] {
            let path = format!("{mount}{group}/{name}");
            let Ok(allowed) = tree.read_cpu_list(&path) else { continue };
            return if allowed.contains(&core) {
                Finding::ok(id, format!("core {core} is allowed"))
            } else {
                Finding::fail(
                    id,
                    format!("{path} is {}: the loop cannot go to core {core}", super::show_cpu_list(&allowed)),
                    remedy,
                )
            };
        }
    }
    if asked {
        return Finding::ok(id, "no group restricts the cores");
    }
    Finding::unknown(id, format!("{mount}{leaf} cannot be read"), remedy)
}
