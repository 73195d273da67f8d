//! Memory for the weights of a plan: one piece for all layers, in huge pages where the system has them.
//!
//! Weights that have left the caches cost a walk through the page tables per page as well, and those have left them too: a page of
//! 2 MiB needs one for the whole network, pages of 4 KiB hundreds (docs/decisions/0013).
//!
//! This module contains `unsafe`: a mapping of its own, seen as lines.

use super::instructions::Line;
use std::ops::{Deref, Range};
use std::sync::Arc;

/// So many lines, a sixteenth of a huge page, are worth one.
const WORTH_ONE: usize = (2 << 20) / size_of::<Line>() / 16;

/// Lines in one piece of memory.
enum Region {
    Small(Box<[Line]>),
    #[cfg(all(target_os = "linux", not(miri)))]
    Huge(huge::Lines),
}

impl Region {
    /// All parts, one behind the other.
    fn of(parts: &[&[Line]]) -> Self {
        #[cfg(all(target_os = "linux", not(miri)))]
        if parts.iter().map(|part| part.len()).sum::<usize>() >= WORTH_ONE
            && let Some(lines) = huge::Lines::of(parts)
        {
            return Self::Huge(lines);
        }
        Self::Small(parts.concat().into_boxed_slice())
    }

    fn lines(&self) -> &[Line] {
        match self {
            Self::Small(lines) => lines,
            #[cfg(all(target_os = "linux", not(miri)))]
            Self::Huge(lines) => lines,
        }
    }
}

#[cfg(all(target_os = "linux", not(miri)))]
mod huge {
    use super::Line;
    use std::ops::Deref;
    use std::ptr::NonNull;

    /// A huge page of a machine whose pages have 4 KiB.
    const HUGE: usize = 2 << 20;
    const PAGE: libc::c_long = 4096;
    /// Linux 6.1; the crate has it for glibc only.
    const MADV_COLLAPSE: libc::c_int = 25;
    /// What is in flux for a moment is asked for again.
    const TRIES: usize = 3;

    /// Lines in huge pages.
    pub(super) struct Lines {
        start: NonNull<Line>,
        count: usize,
        bytes: usize,
    }

    // SAFETY: it is plain memory of its own, which nobody writes once it is made.
    unsafe impl Send for Lines {}
    // SAFETY: as above.
    unsafe impl Sync for Lines {}

    impl Lines {
        /// All parts, one behind the other; none where there are no huge pages for them: Linux before 6.1, other sizes of pages, or no memory in
        /// one piece.
        pub(super) fn of(parts: &[&[Line]]) -> Option<Self> {
            // SAFETY: a question.
            if unsafe { libc::sysconf(libc::_SC_PAGESIZE) } != PAGE {
                return None;
            }
            let count: usize = parts.iter().map(|part| part.len()).sum();
            let bytes = (count * size_of::<Line>()).next_multiple_of(HUGE);
            let lines = Self { start: mapped(bytes)?, count, bytes };
            let mut at = lines.start;
            for part in parts {
                // SAFETY: the mapping has room for all parts, and nobody else knows it yet.
                unsafe {
                    std::ptr::copy_nonoverlapping(part.as_ptr(), at.as_ptr(), part.len());
                    at = at.add(part.len());
                }
            }
            // Now, and not by a daemon that would be woken for it and stop the loop: so it is told to keep off. Its pages are small, since
            // nobody asked before they were filled.
            let huge = (0..TRIES).any(|_| lines.advise(MADV_COLLAPSE));
            lines.advise(libc::MADV_NOHUGEPAGE);
            huge.then_some(lines)
        }

        fn advise(&self, advice: libc::c_int) -> bool {
            // SAFETY: the mapping is its own, and no advice that is given here changes what it holds.
            unsafe { libc::madvise(self.start.as_ptr().cast(), self.bytes, advice) == 0 }
        }
    }

    impl Deref for Lines {
        type Target = [Line];

        fn deref(&self) -> &[Line] {
            // SAFETY: so many lines were mapped and filled; a line is bytes.
            unsafe { std::slice::from_raw_parts(self.start.as_ptr(), self.count) }
        }
    }

    impl Drop for Lines {
        fn drop(&mut self) {
            // SAFETY: its own mapping, which nobody sees any more.
            unsafe { libc::munmap(self.start.as_ptr().cast(), self.bytes) };
        }
    }

    /// So many bytes of zeros, a multiple of a huge page, at a multiple of it.
    fn mapped(bytes: usize) -> Option<NonNull<Line>> {
        let (protection, flags) = (libc::PROT_READ | libc::PROT_WRITE, libc::MAP_PRIVATE | libc::MAP_ANONYMOUS);
        // SAFETY: a new mapping, wherever there is room.
        let all = unsafe { libc::mmap(std::ptr::null_mut(), bytes + HUGE, protection, flags, -1, 0) };
        if all == libc::MAP_FAILED {
            return None;
        }
        let before = all.align_offset(HUGE);
        // SAFETY: what is in front of the first huge page and behind the last one, both within the new mapping.
        unsafe {
            let start = all.byte_add(before);
            if before > 0 {
                libc::munmap(all, before);
            }
            if before < HUGE {
                libc::munmap(start.byte_add(bytes), HUGE - before);
            }
            NonNull::new(start.cast())
        }
    }
}

/// The lines of one layer, in a region of its own or in one with other layers.
pub(super) struct Lines {
    region: Arc<Region>,
    own: Range<usize>,
}

impl Lines {
    /// Are they in huge pages?
    pub(super) fn is_huge(&self) -> bool {
        !matches!(*self.region, Region::Small(_))
    }
}

impl Deref for Lines {
    type Target = [Line];

    fn deref(&self) -> &[Line] {
        &self.region.lines()[self.own.clone()]
    }
}

impl From<Box<[Line]>> for Lines {
    fn from(lines: Box<[Line]>) -> Self {
        Self { own: 0..lines.len(), region: Arc::new(Region::Small(lines)) }
    }
}

/// Moves all of them into one region, in their order.
pub(super) fn gather<'a>(parts: impl Iterator<Item = &'a mut Lines>) {
    let mut parts: Vec<&mut Lines> = parts.collect();
    let region = Arc::new(Region::of(&parts.iter().map(|lines| &***lines).collect::<Vec<_>>()));
    let mut end = 0;
    for lines in &mut parts {
        let own = end..end + lines.len();
        end = own.end;
        **lines = Lines { region: Arc::clone(&region), own };
    }
}

#[cfg(test)]
mod tests {
    use super::{Line, Lines, WORTH_ONE, gather};

    fn filled(count: usize, with: u8) -> Lines {
        vec![Line([with; 64]); count].into_boxed_slice().into()
    }

    #[test]
    fn what_is_gathered_lies_in_order_in_one_piece_and_says_the_same() {
        for counts in [[3, 0, 5], [WORTH_ONE, 7, 1], [16 * WORTH_ONE, 1, 48 * WORTH_ONE + 1]] {
            let mut parts: Vec<Lines> = counts.into_iter().zip(1..).map(|(count, with)| filled(count, with)).collect();
            gather(parts.iter_mut());
            for (part, (count, with)) in parts.iter().zip(counts.into_iter().zip(1_u8..)) {
                assert!(part.len() == count && part.iter().all(|line| line.0 == [with; 64]), "{counts:?}");
            }
            for pair in parts.windows(2) {
                assert_eq!(pair[0].as_ptr_range().end, pair[1].as_ptr_range().start, "{counts:?}");
            }
            let aligned = if parts[0].is_huge() { 2 << 20 } else { 64 };
            assert_eq!(parts[0].as_ptr() as usize % aligned, 0, "{counts:?}");
        }
    }

    #[test]
    fn a_part_outlives_the_others() {
        for count in [2, WORTH_ONE] {
            let mut parts = [filled(count, 1), filled(count, 9)];
            gather(parts.iter_mut());
            let [first, last] = parts;
            drop(first);
            assert!(last.iter().all(|line| line.0 == [9; 64]));
        }
    }

    #[test]
    fn nothing_is_nothing() {
        let mut none = filled(0, 0);
        gather(std::iter::once(&mut none));
        assert!(!none.is_huge() && none.is_empty());
    }

    /// KiB of huge pages of the mapping that holds an address.
    #[cfg(all(target_os = "linux", target_arch = "x86_64", not(miri)))]
    fn huge_kib(address: usize) -> Option<u64> {
        let maps = std::fs::read_to_string("/proc/self/smaps").ok()?;
        let begins = |line: &str| {
            let (from, to) = line.split_whitespace().next()?.split_once('-')?;
            Some(usize::from_str_radix(from, 16).ok()?..usize::from_str_radix(to, 16).ok()?)
        };
        let mut lines = maps.lines().skip_while(|line| begins(line).is_none_or(|range| !range.contains(&address)));
        lines.find_map(|line| line.strip_prefix("AnonHugePages:"))?.split_whitespace().next()?.parse().ok()
    }

    /// Arm is emulated by what says yes to any advice.
    #[cfg(all(target_os = "linux", target_arch = "x86_64", not(miri)))]
    #[test]
    fn what_is_said_to_be_in_huge_pages_is() {
        let mut parts = [filled(8 * WORTH_ONE, 3), filled(8 * WORTH_ONE + 1, 4)];
        gather(parts.iter_mut());
        if !parts[0].is_huge() {
            return eprintln!("skipped: this kernel has no huge pages to give");
        }
        // Two, since a line is too many for one. The mapping may be one with its neighbours.
        let kib = huge_kib(parts[0].as_ptr() as usize).expect("/proc/self/smaps");
        assert!(kib >= 4096, "{kib} KiB");
    }
}
