//! Large pages for what rays read all over: a tree of some MiB lies on thousands of small pages, more than the
//! processor remembers the places of, and each that it does not costs a ray a further way through memory. Embree asks
//! for them as well, where it runs on Linux.

use std::mem::MaybeUninit;

/// Asks the system to back memory by large pages, as far as it covers them. What that does depends on the system:
/// it may do nothing, and does on others than Linux.
pub(crate) fn ask_for_large_pages<T>(memory: &mut [MaybeUninit<T>]) {
    #[cfg(target_os = "linux")]
    {
        /// Advice is given for whole pages; this many bytes are a whole number of them on all systems.
        const PAGE: usize = 1 << 16;
        let first = memory.as_mut_ptr().cast::<u8>();
        let gap = first.addr().next_multiple_of(PAGE) - first.addr();
        let len = size_of_val(memory).saturating_sub(gap) / PAGE * PAGE;
        if len < LARGE_PAGE {
            return;
        }
        // SAFETY: the range lies within `memory`; this advice changes neither what is in it nor who may use it.
        // The system may refuse, and then pages stay as they are.
        let _ = unsafe { libc::madvise(first.wrapping_add(gap).cast(), len, libc::MADV_HUGEPAGE) };
    }
    #[cfg(not(target_os = "linux"))]
    let _ = memory;
}

/// Bytes of the large pages of most systems: smaller memory has no use for the advice.
#[cfg(target_os = "linux")]
const LARGE_PAGE: usize = 2 << 20;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_in_memory_stays() {
        for (len, skipped) in [(0, 0), (1000, 1), (1 << 20, 0), (1 << 20, 12_345)] {
            let mut memory: Vec<_> = (0..len as u64).map(MaybeUninit::new).collect();
            ask_for_large_pages(&mut memory[skipped..]);
            for (number, item) in memory.iter_mut().enumerate() {
                item.write(number as u64 + 1);
            }
            ask_for_large_pages(&mut memory[skipped..]);
            assert!((1..=len as u64).eq(memory.iter().map(|item| {
                // SAFETY: all were written.
                unsafe { item.assume_init() }
            })));
        }
    }
}
