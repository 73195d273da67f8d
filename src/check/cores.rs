//! Questions about the core of the loop.

use super::{Finding, Tree, cpu_list, show_cpu_list};

/// Exit latency of an idle state that still leaves the wake-up in the tens of microseconds.
const IDLE_LATENCY_MAX_US: u64 = 10;
const CPU: &str = "/sys/devices/system/cpu";
const CHOOSE: &str = "set core = N in the [loop] table of ravenposed.toml, then ask again";

fn not_chosen(id: &'static str) -> Finding {
    Finding::unknown(id, "no core is chosen", CHOOSE)
}

/// Kernel parameters that keep everything else away from a core.
fn isolate(tree: &Tree, core: usize) -> String {
    let others = tree.others(core);
    format!(
        "add isolcpus=managed_irq,domain,{core} nohz_full={core} rcu_nocbs={core} irqaffinity={others} to the kernel command line, reboot"
    )
}

/// Does the chosen core exist, and does it run?
pub(super) fn chosen(tree: &Tree, core: Option<usize>) -> Finding {
    let id = "core.chosen";
    let Some(core) = core else {
        return Finding::warn(id, "no core is chosen: the kernel moves the loop about, and its caches with it", CHOOSE);
    };
    let online = match tree.read_cpu_list(&format!("{CPU}/online")) {
        Ok(online) => online,
        Err(cause) => return Finding::unknown(id, cause, "look at nproc --all"),
    };
    if online.contains(&core) {
        return Finding::ok(id, format!("core {core} is online"));
    }
    let instead = format!("set core to one of {} in the [loop] table of ravenposed.toml", show_cpu_list(&online));
    if tree.path(&format!("{CPU}/cpu{core}")).is_dir() {
        let remedy = format!("echo 1 > {CPU}/cpu{core}/online, or {instead}");
        return Finding::fail(id, format!("core {core} is offline"), remedy);
    }
    Finding::fail(id, format!("there is no core {core}"), instead)
}

/// Is the scheduler kept off the core?
pub(super) fn isolated(tree: &Tree, core: Option<usize>) -> Finding {
    let id = "core.isolated";
    let list = match tree.read_cpu_list(&format!("{CPU}/isolated")) {
        Ok(list) => list,
        Err(cause) => return Finding::unknown(id, cause, core.map_or(CHOOSE.to_owned(), |core| isolate(tree, core))),
    };
    let shown = if list.is_empty() { "none".to_owned() } else { show_cpu_list(&list) };
    match core {
        None => Finding::warn(id, format!("isolated cores: {shown}; no core is chosen"), CHOOSE),
        Some(core) if list.contains(&core) => Finding::ok(id, format!("core {core} is isolated")),
        Some(core) => Finding::warn(id, format!("core {core} is not isolated (isolated: {shown})"), isolate(tree, core)),
    }
}

/// Is the scheduler's tick off on the core?
pub(super) fn nohz_full(tree: &Tree, core: Option<usize>) -> Finding {
    let id = "core.nohz_full";
    let Some(core) = core else { return not_chosen(id) };
    match tree.read_cpu_list(&format!("{CPU}/nohz_full")) {
        Err(cause) => Finding::unknown(
            id,
            format!("{cause}; a kernel without NO_HZ_FULL has no such file"),
            format!("with a kernel that has NO_HZ_FULL, add nohz_full={core} to the kernel command line"),
        ),
        Ok(list) if list.contains(&core) => Finding::ok(id, format!("no tick on core {core} while one thread runs there")),
        Ok(_) => Finding::warn(id, format!("the tick interrupts core {core} 100 to 1000 times a second"), isolate(tree, core)),
    }
}

/// Does the clock frequency stay up? Asks the chosen core, or all.
pub(super) fn governor(tree: &Tree, core: Option<usize>) -> Finding {
    let id = "core.governor";
    let bios = "switch off frequency scaling (SpeedStep, Cool'n'Quiet) in the BIOS, or ask the host's administrator";
    let asked = match core {
        Some(core) => vec![core],
        None => match tree.read_cpu_list(&format!("{CPU}/online")) {
            Ok(online) => online,
            Err(cause) => return Finding::unknown(id, cause, bios),
        },
    };
    let mut slow = Vec::new();
    for &core in &asked {
        match tree.read(&format!("{CPU}/cpu{core}/cpufreq/scaling_governor")) {
            Err(cause) => return Finding::unknown(id, cause, bios),
            Ok(name) if name == "performance" => {}
            Ok(name) => slow.push((core, name)),
        }
    }
    let Some((_, name)) = slow.first() else {
        return Finding::ok(id, format!("performance on core {}", show_cpu_list(&asked)));
    };
    let cores = show_cpu_list(&slow.iter().map(|(core, _)| *core).collect::<Vec<_>>());
    let remedy =
        format!("cpupower -c {cores} frequency-set -g performance (at each boot: in a unit, or GOVERNOR= of cpufrequtils)");
    Finding::warn(id, format!("{name} on core {cores}: the clock is slow when the loop wakes"), remedy)
}

/// Does another hardware thread share the core's units and caches?
pub(super) fn smt(tree: &Tree, core: Option<usize>) -> Finding {
    let id = "core.smt";
    let Some(core) = core else { return not_chosen(id) };
    let off = "add nosmt to the kernel command line";
    let siblings = match tree.read_cpu_list(&format!("{CPU}/cpu{core}/topology/thread_siblings_list")) {
        Ok(siblings) => siblings,
        Err(cause) => return Finding::unknown(id, cause, off),
    };
    let siblings: Vec<usize> = siblings.into_iter().filter(|&sibling| sibling != core).collect();
    if siblings.is_empty() {
        return Finding::ok(id, format!("core {core} shares its units with nobody"));
    }
    let list = show_cpu_list(&siblings);
    let one_by_one: Vec<String> = siblings.iter().map(|sibling| format!("echo 0 > {CPU}/cpu{sibling}/online")).collect();
    let remedy = format!("{}; or {off}", one_by_one.join("; "));
    Finding::warn(id, format!("core {core} shares its units with core {list}: whatever runs there slows the loop"), remedy)
}

/// Which interrupts are served on the core?
pub(super) fn interrupts(tree: &Tree, core: Option<usize>) -> Finding {
    let id = "core.interrupts";
    let Some(core) = core else { return not_chosen(id) };
    let names = match tree.list("/proc/irq") {
        Ok(names) => names,
        Err(cause) => return Finding::unknown(id, cause, "look at /proc/interrupts as root"),
    };
    let (mut served, mut may, mut unread, mut total) = (Vec::new(), 0, 0, 0);
    for number in names.iter().filter(|name| name.bytes().all(|byte| byte.is_ascii_digit())) {
        let base = format!("/proc/irq/{number}");
        let allowed = tree.read_cpu_list(&format!("{base}/smp_affinity_list"));
        // Where it really goes; a managed interrupt is allowed everywhere and yet kept away by isolcpus=managed_irq.
        let effective = tree.read_cpu_list(&format!("{base}/effective_affinity_list")).ok().filter(|list| !list.is_empty());
        total += 1;
        match (allowed, effective) {
            (_, Some(effective)) if effective.contains(&core) => served.push(number.as_str()),
            (Ok(allowed), None) if allowed.contains(&core) => served.push(number.as_str()),
            (Ok(allowed), _) => may += usize::from(allowed.contains(&core)),
            (Err(_), Some(_)) => {}
            (Err(_), None) => unread += 1,
        }
    }
    let others = tree.others(core);
    let parameter = format!("irqaffinity={others} on the kernel command line does it at boot");
    if total == 0 || unread == total {
        return Finding::unknown(id, "/proc/irq shows no affinity", format!("run this as root; {parameter}"));
    }
    if served.is_empty() {
        let aside = if may == 0 { String::new() } else { format!(" ({may} of {total} would be allowed)") };
        return Finding::ok(id, format!("none is served on core {core}{aside}"));
    }
    let described: Vec<String> = served.iter().take(6).map(|number| describe(tree, number)).collect();
    let more = if served.len() > 6 { ", ..." } else { "" };
    let numbers = served.join(" ");
    let remedy = format!("for i in {numbers}; do echo {others} > /proc/irq/$i/smp_affinity_list; done; {parameter}");
    Finding::warn(id, format!("{} of {total} are served on core {core}: {}{more}", served.len(), described.join(", ")), remedy)
}

/// Number and name of an interrupt; the name is that of a directory.
fn describe(tree: &Tree, number: &str) -> String {
    let base = format!("/proc/irq/{number}");
    let names = tree.list(&base).unwrap_or_default();
    let action = names.iter().find(|name| tree.path(&format!("{base}/{name}")).is_dir());
    action.map_or_else(|| number.to_owned(), |action| format!("{number} {action}"))
}

/// Does a daemon move interrupts back?
pub(super) fn irqbalance(tree: &Tree, core: Option<usize>) -> Finding {
    let id = "core.irqbalance";
    let stop = "systemctl disable --now irqbalance";
    // Without sight of process 1 (hidepid) the absence of a name proves nothing.
    if let Err(cause) = tree.read("/proc/1/comm") {
        return Finding::unknown(id, cause, format!("run this as root; {stop}"));
    }
    let processes = match tree.list("/proc") {
        Ok(names) => names,
        Err(cause) => return Finding::unknown(id, cause, stop),
    };
    let is_it = |pid: &String| {
        pid.bytes().all(|byte| byte.is_ascii_digit())
            && tree.read(&format!("/proc/{pid}/comm")).is_ok_and(|name| name == "irqbalance")
    };
    if !processes.iter().any(is_it) {
        return Finding::ok(id, "does not run");
    }
    let Some(core) = core else { return Finding::warn(id, "runs and moves interrupts", stop) };
    let is_isolated = tree.read_cpu_list(&format!("{CPU}/isolated")).is_ok_and(|list| list.contains(&core));
    if is_isolated || banned(tree).contains(&core) {
        return Finding::ok(id, format!("runs, but leaves core {core} alone"));
    }
    let remedy = format!("write IRQBALANCE_BANNED_CPULIST={core} to /etc/default/irqbalance and restart it; or {stop}");
    Finding::warn(id, format!("runs and may move interrupts to core {core}"), remedy)
}

/// Cores that irqbalance is told to avoid.
fn banned(tree: &Tree) -> Vec<usize> {
    let text = tree.read("/etc/default/irqbalance").unwrap_or_default();
    let value = text.lines().filter_map(|line| line.trim().strip_prefix("IRQBALANCE_BANNED_CPULIST=")).next_back();
    value.and_then(|value| cpu_list(value.trim_matches('"'))).unwrap_or_default()
}

/// How deep may the core sleep? Asks core 0 when none is chosen.
pub(super) fn idle(tree: &Tree, core: Option<usize>) -> Finding {
    let id = "core.idle";
    let base = format!("{CPU}/cpu{}/cpuidle", core.unwrap_or(0));
    let remedy = "hold_cpu_dma_latency = true in the [loop] table of ravenposed.toml (measured: wake-up p50 15 instead of 32-45 us); \
                  or processor.max_cstate=1 intel_idle.max_cstate=1 on the kernel command line";
    let states = match tree.list(&base) {
        Ok(states) => states,
        Err(cause) => {
            return Finding::unknown(id, format!("{cause}; the kernel or the host manages idling in some other way"), remedy);
        }
    };
    let mut deepest: Option<(u64, String)> = None;
    for state in &states {
        let read = |name: &str| tree.read(&format!("{base}/{state}/{name}"));
        let (Ok(latency), Ok(disabled)) = (read("latency"), read("disable")) else {
            return Finding::unknown(id, format!("{base}/{state} cannot be read"), remedy);
        };
        let Ok(latency_us) = latency.parse::<u64>() else {
            return Finding::unknown(id, format!("{base}/{state}/latency holds {latency:?}"), remedy);
        };
        if disabled == "0" && deepest.as_ref().is_none_or(|(deepest_us, _)| latency_us > *deepest_us) {
            deepest = Some((latency_us, read("name").unwrap_or_else(|_| state.clone())));
        }
    }
    match deepest {
        None => Finding::unknown(id, format!("{base} shows no enabled state"), remedy),
        Some((latency_us, name)) if latency_us <= IDLE_LATENCY_MAX_US => {
            Finding::ok(id, format!("deepest state {name}, {latency_us} us to leave"))
        }
        Some((latency_us, name)) => {
            Finding::warn(id, format!("idles as deep as {name}, which takes {latency_us} us to leave"), remedy)
        }
    }
}

/// Could the service forbid deep sleep?
pub(super) fn dma_latency(tree: &Tree) -> Finding {
    let path = "/dev/cpu_dma_latency";
    let id = "core.dma_latency";
    let remedy = "install ravenposed.service.d/cpu-dma-latency.conf and its udev rule; or leave hold_cpu_dma_latency = false";
    // Opening alone asks nothing of the kernel: a wish needs a write.
    match std::fs::File::options().write(true).open(tree.path(path)) {
        Ok(_) => Finding::ok(id, format!("{path} may be written")),
        Err(cause) => Finding::warn(id, format!("{path} cannot be opened for writing ({cause})"), remedy),
    }
}
