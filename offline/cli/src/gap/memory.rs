//! How much memory this process may still have, of Linux: the machine's, its control group's, its own limit.

use std::fs::read_to_string;

/// The least of what the three leave; none where not even the machine says.
pub(super) fn free_bytes() -> Option<u64> {
    let of_machine = number(&read_to_string("/proc/meminfo").ok()?, "MemAvailable:")? * 1024;
    Some([of_group(), of_process()].into_iter().flatten().fold(of_machine, u64::min))
}

/// What a container or a unit with `MemoryMax=` leaves (version 2 of control groups).
fn of_group() -> Option<u64> {
    let groups = read_to_string("/proc/self/cgroup").ok()?;
    let path = groups.lines().find_map(|line| line.strip_prefix("0::"))?;
    let text = |file: &str| read_to_string(format!("/sys/fs/cgroup{path}/{file}")).ok();
    let of = |file: &str| text(file)?.trim().parse::<u64>().ok();
    // Files that were read stay in memory while nobody else needs it: they count as the group's, and are free.
    let given_back = text("memory.stat").and_then(|stat| number(&stat, "inactive_file ")).unwrap_or(0);
    Some(of("memory.max")?.saturating_sub(of("memory.current")?.saturating_sub(given_back)))
}

/// What `ulimit -v` leaves.
fn of_process() -> Option<u64> {
    let most = number(&read_to_string("/proc/self/limits").ok()?, "Max address space")?;
    let own = number(&read_to_string("/proc/self/status").ok()?, "VmSize:")? * 1024;
    Some(most.saturating_sub(own))
}

/// The number behind a name; none for `unlimited`.
fn number(text: &str, name: &str) -> Option<u64> {
    text.lines().find_map(|line| line.strip_prefix(name))?.split_ascii_whitespace().next()?.parse().ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_free_is_some_of_what_there_is() {
        let all = number(&read_to_string("/proc/meminfo").expect("Linux"), "MemTotal:").expect("a number") * 1024;
        let free = free_bytes().expect("Linux");
        assert!((1..all).contains(&free), "{free} of {all}");
        let limits = "Max cpu time              unlimited            unlimited            seconds\nMax address space         8000 9000 bytes\n";
        assert_eq!((number(limits, "Max cpu time"), number(limits, "Max address space")), (None, Some(8000)));
    }
}
