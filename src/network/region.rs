//! Memory for the weights of a plan: one piece for all layers, in huge pages where the system has them.
//!
//! Weights that have left the caches cost a walk through the page tables per page as well, and those have left them too: a page of
//! 2 MiB needs one for the whole network, pages of 4 KiB hundreds (docs/decisions/0013).
//!
//! This module contains `unsafe`: pages seen as lines, and advice to the kernel about them.

use super::instructions::Line;
use std::ops::{Deref, Range};
use std::sync::Arc;

/// Lines of a huge page, of x86-64 and of Arm with pages of 4 KiB.
const LINES: usize = (2 << 20) / size_of::<Line>();
/// So many lines, a sixteenth of a huge page, are worth one.
const WORTH_ONE: usize = LINES / 16;

/// A huge page, where the kernel makes it one.
#[repr(C, align(0x20_0000))]
struct Page([Line; LINES]);

/// Lines in one piece of memory.
enum Region {
    Small(Box<[Line]>),
    Huge { pages: Box<[Page]>, count: usize },
}

impl Region {
    /// All parts, one behind the other.
    fn of(parts: &[&[Line]]) -> Self {
        let count: usize = parts.iter().map(|part| part.len()).sum();
        if count < WORTH_ONE {
            return Self::Small(parts.concat().into_boxed_slice());
        }
        // SAFETY: a page is lines, a line is bytes, and any byte is one, zero too.
        let pages = unsafe { Box::<[Page]>::new_zeroed_slice(count.div_ceil(LINES)).assume_init() };
        let mut region = Self::Huge { pages, count };
        let mut rest = region.lines_mut();
        for part in parts {
            let (here, behind) = rest.split_at_mut(part.len());
            here.copy_from_slice(part);
            rest = behind;
        }
        region
    }

    fn lines(&self) -> &[Line] {
        match self {
            Self::Small(lines) => lines,
            // SAFETY: pages are lines without gaps, and `of` made as many pages as so many lines need.
            Self::Huge { pages, count } => unsafe { std::slice::from_raw_parts(pages.as_ptr().cast(), *count) },
        }
    }

    fn lines_mut(&mut self) -> &mut [Line] {
        match self {
            Self::Small(lines) => lines,
            // SAFETY: as above.
            Self::Huge { pages, count } => unsafe { std::slice::from_raw_parts_mut(pages.as_mut_ptr().cast(), *count) },
        }
    }

    /// Asks for huge pages in place of those that are there, now: what the kernel would do by and by would stop the loop. Where it refuses
    /// (it is older than 6.1, or no such page is free) the lines stay where they are. Are they in huge pages now?
    fn move_to_huge_pages(&mut self) -> bool {
        match self {
            #[cfg(target_os = "linux")]
            Self::Huge { pages, .. } => {
                let (start, bytes) = (pages.as_mut_ptr(), size_of_val(&**pages));
                let advise = |advice| {
                    // SAFETY: the pages are this region's own, and none of these changes what they hold.
                    unsafe { libc::madvise(start.cast(), bytes, advice) == 0 }
                };
                advise(libc::MADV_HUGEPAGE);
                let moved = advise(libc::MADV_COLLAPSE);
                advise(libc::MADV_NOHUGEPAGE);
                moved
            }
            _ => false,
        }
    }
}

/// The lines of one layer, in a region of its own or in one with other layers.
#[derive(Clone)]
pub(super) struct Lines {
    region: Arc<Region>,
    own: Range<usize>,
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

/// Moves all of them into one region, in their order; says whether that is in huge pages.
pub(super) fn gather<'a>(parts: impl Iterator<Item = &'a mut Lines>) -> bool {
    let mut parts: Vec<&mut Lines> = parts.collect();
    let mut region = Region::of(&parts.iter().map(|lines| &***lines).collect::<Vec<_>>());
    let moved = region.move_to_huge_pages();
    let region = Arc::new(region);
    let mut end = 0;
    for lines in &mut parts {
        let own = end..end + lines.len();
        end = own.end;
        **lines = Lines { region: Arc::clone(&region), own };
    }
    moved
}

#[cfg(test)]
mod tests {
    use super::{LINES, Line, Lines, Page, WORTH_ONE, gather};

    fn filled(count: usize, with: u8) -> Lines {
        vec![Line([with; 64]); count].into_boxed_slice().into()
    }

    #[test]
    fn what_is_gathered_lies_in_order_in_one_piece_and_says_the_same() {
        for counts in [[3, 0, 5], [WORTH_ONE, 7, 1], [LINES, 1, 3 * LINES + 1]] {
            let mut parts: Vec<Lines> = counts.into_iter().zip(1..).map(|(count, with)| filled(count, with)).collect();
            gather(parts.iter_mut());
            for (part, (count, with)) in parts.iter().zip(counts.into_iter().zip(1_u8..)) {
                assert!(part.len() == count && part.iter().all(|line| line.0 == [with; 64]), "{counts:?}");
            }
            for pair in parts.windows(2) {
                assert_eq!(pair[0].as_ptr_range().end, pair[1].as_ptr_range().start, "{counts:?}");
            }
            let aligned = if counts.iter().sum::<usize>() >= WORTH_ONE { align_of::<Page>() } else { align_of::<Line>() };
            assert_eq!(parts[0].as_ptr() as usize % aligned, 0, "{counts:?}");
        }
    }

    #[test]
    fn a_part_outlives_the_others() {
        let mut parts = [filled(2, 1), filled(2, 9)];
        gather(parts.iter_mut());
        let [first, last] = parts;
        drop(first);
        assert!(last.iter().all(|line| line.0 == [9; 64]));
    }

    #[test]
    fn nothing_is_nothing() {
        let mut none = filled(0, 0);
        assert!(!gather(std::iter::once(&mut none)) && none.is_empty());
    }

    /// KiB of huge pages of the mapping that holds an address.
    #[cfg(target_os = "linux")]
    fn huge_kib(address: usize) -> Option<u64> {
        let maps = std::fs::read_to_string("/proc/self/smaps").ok()?;
        let begins = |line: &str| {
            let (from, to) = line.split_whitespace().next()?.split_once('-')?;
            Some(usize::from_str_radix(from, 16).ok()?..usize::from_str_radix(to, 16).ok()?)
        };
        let mut lines = maps.lines().skip_while(|line| begins(line).is_none_or(|range| !range.contains(&address)));
        lines.find_map(|line| line.strip_prefix("AnonHugePages:"))?.split_whitespace().next()?.parse().ok()
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn the_weights_of_a_network_are_where_they_are_said_to_be() {
        let mut parts = [filled(LINES / 2, 3), filled(LINES / 2 + 1, 4)];
        let moved = gather(parts.iter_mut());
        assert!(parts.iter().zip(3..).all(|(part, with)| part.iter().all(|line| line.0 == [with; 64])));
        let Some(kib) = huge_kib(parts[0].as_ptr() as usize) else { panic!("no /proc/self/smaps") };
        if moved {
            // Two, since a line is too many for one. The mapping may be one with its neighbours.
            assert!(kib >= 2 * size_of::<Page>() as u64 / 1024, "{kib} KiB");
        } else {
            eprintln!("skipped: this kernel moves nothing to huge pages ({kib} KiB there)");
        }
    }
}
