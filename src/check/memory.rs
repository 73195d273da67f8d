//! Memory that must not move, and the transport's shared files.
//!
//! This module contains `unsafe`: asking for the size of a file system, which has no safe call in our tree.

use super::limits::user_id;
use super::{Finding, Tree};
use ravenpose_transport::ROOM;
use std::fmt::Write as _;
use std::os::unix::ffi::OsStrExt;
use std::os::unix::fs::MetadataExt;
use std::path::Path;

/// iceoryx2's own directory, and the directory and prefix of its shared memory.
const TRANSPORT_ROOT: &str = "/tmp/iceoryx2";
const SHARED: &str = "/dev/shm";
const PREFIX: &str = "iox2_";
/// Why one user (F37).
const SAME_USER: &str = "the transport has no rights management, so service, controller and clients must run as the same user";

/// Can pages wander to disk?
pub(super) fn swap(tree: &Tree) -> Finding {
    let id = "memory.swap";
    let remedy = "swapoff -a, and take the swap lines out of /etc/fstab";
    let text = match tree.read("/proc/swaps") {
        Ok(text) => text,
        Err(cause) => return Finding::unknown(id, cause, remedy),
    };
    let areas: Vec<&str> = text.lines().skip(1).filter_map(|line| line.split_whitespace().next()).collect();
    if areas.is_empty() {
        return Finding::ok(id, "none");
    }
    let found =
        format!("on ({}): the service locks its pages, but the controller's and the disk's delays remain", areas.join(", "));
    Finding::warn(id, found, remedy)
}

/// Does the kernel collect huge pages behind our back? Advice only.
pub(super) fn huge_pages(tree: &Tree) -> Finding {
    let id = "memory.huge_pages";
    let remedy = "add transparent_hugepage=madvise to the kernel command line";
    match tree.read("/sys/kernel/mm/transparent_hugepage/enabled") {
        Err(cause) => Finding::unknown(id, cause, remedy),
        Ok(text) if text.contains("[always]") => {
            Finding::warn(id, "transparent huge pages: always; collecting them stalls threads now and then", remedy)
        }
        Ok(text) => match text.split_whitespace().find(|word| word.starts_with('[')) {
            Some(mode) => Finding::ok(id, format!("transparent huge pages: {}", mode.trim_matches(['[', ']']))),
            None => Finding::unknown(id, format!("transparent_hugepage/enabled holds {text:?}"), remedy),
        },
    }
}

/// May the kernel move locked pages when it compacts memory?
pub(super) fn compaction(tree: &Tree) -> Finding {
    let id = "memory.compaction";
    let path = "/proc/sys/vm/compact_unevictable_allowed";
    let remedy = "sysctl -w vm.compact_unevictable_allowed=0, and at each boot: \
                  echo vm.compact_unevictable_allowed = 0 >> /etc/sysctl.d/60-ravenpose.conf";
    match tree.read(path).as_deref() {
        Ok("0") => Finding::ok(id, "locked pages stay where they are"),
        Ok("1") => {
            let found = "vm.compact_unevictable_allowed = 1: compaction moves locked pages too, and the loop faults on each until it is moved";
            Finding::warn(id, found, remedy)
        }
        Ok(text) => Finding::unknown(id, format!("{path} holds {text:?}"), remedy),
        Err(cause) => Finding::unknown(id, format!("{cause}; a kernel without CONFIG_COMPACTION has no such file"), remedy),
    }
}

/// Is there room for the segments?
pub(super) fn shared_memory(tree: &Tree) -> Finding {
    match space(&tree.path(SHARED)) {
        Ok((total, free)) => judge_shared_memory(total, free, taken(&tree.path(SHARED))),
        Err(cause) => {
            Finding::unknown("memory.shared", format!("{SHARED} cannot be examined ({cause})"), "mount -t tmpfs tmpfs /dev/shm")
        }
    }
}

/// Bytes that the transport has there already: the service's own, if it runs, or another program's.
fn taken(shared: &Path) -> u64 {
    let files = std::fs::read_dir(shared).into_iter().flatten().flatten();
    let ours = files.filter(|file| file.file_name().as_bytes().starts_with(PREFIX.as_bytes()));
    ours.filter_map(|file| file.metadata().ok()).map(|file| 512 * file.blocks()).sum()
}

pub(super) fn judge_shared_memory(total: u64, free: u64, taken: u64) -> Finding {
    let id = "memory.shared";
    let mut found = format!("{SHARED}: {} of {} MiB free", free >> 20, total >> 20);
    if taken > 0 {
        let _ = write!(found, ", {} MiB taken by the transport", taken >> 20);
    }
    if free >= ROOM {
        return Finding::ok(id, found);
    }
    let remedy = "remove what is not needed from /dev/shm, or: mount -o remount,size=1G /dev/shm (and the same size in /etc/fstab)";
    let found = format!("{found}, {} MiB are needed", ROOM.div_ceil(1 << 20));
    if free + taken >= ROOM {
        return Finding::warn(id, format!("{found}: of those the service may have its own already, if it runs"), remedy);
    }
    Finding::fail(id, found, remedy)
}

/// Total and free bytes of a file system.
fn space(path: &Path) -> std::io::Result<(u64, u64)> {
    let path = std::ffi::CString::new(path.as_os_str().as_bytes())?;
    let mut answer = std::mem::MaybeUninit::<libc::statvfs>::zeroed();
    // SAFETY: `path` is a C string and `answer` is writable for the duration of the call; zeroed memory is a valid statvfs.
    let (code, answer) = unsafe { (libc::statvfs(path.as_ptr(), answer.as_mut_ptr()), answer.assume_init()) };
    if code != 0 {
        return Err(std::io::Error::last_os_error());
    }
    Ok((answer.f_blocks.saturating_mul(answer.f_frsize), answer.f_bavail.saturating_mul(answer.f_frsize)))
}

/// Whose is the transport's directory?
pub(super) fn transport_root(tree: &Tree) -> Finding {
    let id = "transport.root";
    let create = "install /usr/lib/tmpfiles.d/ravenposed.conf and run systemd-tmpfiles --create ravenposed.conf";
    let metadata = match std::fs::symlink_metadata(tree.path(TRANSPORT_ROOT)) {
        Ok(metadata) => metadata,
        Err(cause) if cause.kind() == std::io::ErrorKind::NotFound => {
            let found = format!("{TRANSPORT_ROOT} is absent: the first program to start makes it, and shuts every other user out");
            return Finding::warn(id, found, create);
        }
        Err(cause) => return Finding::unknown(id, format!("{TRANSPORT_ROOT} cannot be examined ({cause})"), create),
    };
    let me = match user_id(tree) {
        Ok(me) => me,
        Err(cause) => return Finding::unknown(id, cause, format!("ls -ld {TRANSPORT_ROOT}")),
    };
    let renew = format!("stop all programs, rm -rf {TRANSPORT_ROOT} {SHARED}/{PREFIX}*, then {create}");
    if !metadata.is_dir() {
        return Finding::fail(id, format!("{TRANSPORT_ROOT} is not a directory"), renew);
    }
    if metadata.uid() != me {
        let (owner, me) = (user_name(tree, metadata.uid()), user_name(tree, me));
        let found = format!("{TRANSPORT_ROOT} belongs to {owner}, this is {me}: {SAME_USER}");
        return Finding::fail(id, found, format!("run this as {owner}; if that is the wrong user, {renew}"));
    }
    if metadata.mode() & 0o022 != 0 {
        let found = format!("{TRANSPORT_ROOT} has mode {:o}: other users can put files there", metadata.mode() & 0o7777);
        return Finding::fail(id, found, format!("chmod 0750 {TRANSPORT_ROOT}"));
    }
    Finding::ok(id, format!("{TRANSPORT_ROOT} belongs to {}, as it must", user_name(tree, me)))
}

/// Are there shared segments of another user?
pub(super) fn transport_files(tree: &Tree) -> Finding {
    let id = "transport.files";
    let (names, me) = match (tree.list(SHARED), user_id(tree)) {
        (Ok(names), Ok(me)) => (names, me),
        (Err(cause), _) | (_, Err(cause)) => return Finding::unknown(id, cause, format!("ls -l {SHARED}")),
    };
    let ours: Vec<u32> = names
        .iter()
        .filter(|name| name.starts_with(PREFIX))
        .filter_map(|name| std::fs::symlink_metadata(tree.path(&format!("{SHARED}/{name}"))).ok().map(|metadata| metadata.uid()))
        .collect();
    let Some(&owner) = ours.iter().find(|&&uid| uid != me) else {
        return Finding::ok(id, format!("{} shared files, none of another user", ours.len()));
    };
    let foreign = ours.iter().filter(|&&uid| uid != me).count();
    let (owner, me) = (user_name(tree, owner), user_name(tree, me));
    let found = format!("{foreign} of {} files {SHARED}/{PREFIX}* belong to {owner}, this is {me}: {SAME_USER}", ours.len());
    Finding::fail(id, found, format!("run this as {owner}; if those are left over, stop all programs and rm {SHARED}/{PREFIX}*"))
}

/// A user's name, or its number.
fn user_name(tree: &Tree, uid: u32) -> String {
    let name = tree.read("/etc/passwd").ok().and_then(|text| {
        text.lines().find_map(|line| {
            let mut fields = line.split(':');
            let name = fields.next()?;
            (fields.nth(1)?.parse() == Ok(uid)).then(|| name.to_owned())
        })
    });
    name.unwrap_or_else(|| format!("user {uid}"))
}
