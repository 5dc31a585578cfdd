//! The stack of one traversal: child references and their entry distances in two arrays, so that
//! a register full can be written by one store each. It is not initialised: clearing it would cost
//! as much as tracing a short ray.
//!
//! Invariant: `top ≤ CAPACITY − N` before a push of up to N entries, and all entries below `top`
//! are initialised. A tree has at most [`MAX_LEVELS`] levels (emission asserts it), so that at most
//! MAX_LEVELS − 1 nodes lie on a path. Each leaves at most N − 1 of its N children waiting, hence
//! the last of them finds at most (N − 1)(MAX_LEVELS − 2) entries and room for N more.

use std::mem::MaybeUninit;

/// Levels of the deepest tree that `max_depth` allows.
pub(crate) const MAX_LEVELS: usize = 64;

/// Room for the entries of a stack for nodes of `N` children. The arrays are used as flat ones.
///
/// Its alignment makes the compiler align the frame of a kernel: the vectors that it keeps there would otherwise lie
/// across cache lines, as it decides where they go after it has decided about the frame.
#[derive(Debug)]
#[repr(align(64))]
pub(crate) struct StackMemory<const N: usize> {
    references: [[MaybeUninit<u32>; N]; MAX_LEVELS - 1],
    distances: [[MaybeUninit<f32>; N]; MAX_LEVELS - 1],
    /// Entries of a stack that was left.
    left: usize,
}

impl<const N: usize> StackMemory<N> {
    #[inline(always)]
    pub(crate) fn new() -> Self {
        Self {
            references: [const { [const { MaybeUninit::uninit() }; N] }; MAX_LEVELS - 1],
            distances: [const { [const { MaybeUninit::uninit() }; N] }; MAX_LEVELS - 1],
            left: 0,
        }
    }
}

/// The stack for nodes of `N` children; where `ANY` hit is sought, of references alone. It is apart from its memory, so
/// that `top` stays in a register: next to arrays with computed places it would be stored and loaded again at every push
/// and pop.
#[derive(Debug)]
pub(crate) struct Stack<'a, const N: usize, const ANY: bool> {
    memory: &'a mut StackMemory<N>,
    top: usize,
}

impl<'a, const N: usize> Stack<'a, N, false> {
    /// The stack that was left in `memory`.
    #[inline(always)]
    pub(crate) fn resume(memory: &'a mut StackMemory<N>) -> Self {
        let top = memory.left;
        Self { memory, top }
    }

    /// Leaves its entries in its memory.
    #[inline(always)]
    pub(crate) fn leave(self) {
        self.memory.left = self.top;
    }
}

impl<'a, const N: usize, const ANY: bool> Stack<'a, N, ANY> {
    const CAPACITY: usize = N * (MAX_LEVELS - 1);

    /// An empty stack.
    #[inline(always)]
    pub(crate) fn new(memory: &'a mut StackMemory<N>) -> Self {
        Self { memory, top: 0 }
    }

    /// Pushes an entry if `bit` is 1, without a branch; `bit` is 0 or 1.
    #[inline(always)]
    pub(crate) fn push_if(&mut self, bit: u32, reference: u32, distance: f32) {
        debug_assert!(self.top < Self::CAPACITY);
        // The index is in bounds by the invariant; min() lets the compiler see it for free.
        let at = self.top.min(Self::CAPACITY - 1);
        self.memory.references.as_flattened_mut()[at] = MaybeUninit::new(reference);
        if !ANY {
            self.memory.distances.as_flattened_mut()[at] = MaybeUninit::new(distance);
        }
        self.top += bit as usize;
    }

    /// Where the next entries go.
    #[cfg(target_arch = "x86_64")]
    #[inline(always)]
    pub(super) fn top(&mut self, lanes: usize) -> (*mut u32, *mut f32) {
        debug_assert!(self.top + lanes <= Self::CAPACITY);
        (
            self.memory
                .references
                .as_flattened_mut()
                .as_mut_ptr()
                .cast::<u32>()
                .wrapping_add(self.top),
            self.memory
                .distances
                .as_flattened_mut()
                .as_mut_ptr()
                .cast::<f32>()
                .wrapping_add(self.top),
        )
    }

    /// Counts in `count` entries that were written at [`Stack::top`].
    ///
    /// # Safety
    /// So many entries of both arrays were initialised there, with `ANY` of the references.
    #[cfg(target_arch = "x86_64")]
    #[inline(always)]
    pub(super) unsafe fn grow(&mut self, count: u32) {
        self.top += count as usize;
    }

    /// Drops the top entry.
    #[inline(always)]
    pub(crate) fn drop_top(&mut self) {
        self.top = self.top.saturating_sub(1);
    }

    /// The reference of the top entry.
    #[inline(always)]
    pub(crate) fn peek(&self) -> Option<u32> {
        let at = self.top.checked_sub(1)?;
        // SAFETY: as in `pop`.
        unsafe {
            Some(
                self.memory
                    .references
                    .as_flattened()
                    .get_unchecked(at)
                    .assume_init(),
            )
        }
    }

    /// Takes the top entry: its reference and its distance, with `ANY` −∞.
    #[inline(always)]
    pub(crate) fn pop(&mut self) -> Option<(u32, f32)> {
        self.top = self.top.checked_sub(1)?;
        debug_assert!(self.top < Self::CAPACITY);
        // SAFETY: by the invariant `top` was at most CAPACITY before, and all entries below it were
        // written: it is raised only past such. A stack that is made anew is empty, and the type of one that is
        // resumed is that of the one that was left: it has distances.
        unsafe {
            Some((
                self.memory
                    .references
                    .as_flattened()
                    .get_unchecked(self.top)
                    .assume_init(),
                if ANY {
                    f32::NEG_INFINITY
                } else {
                    self.memory
                        .distances
                        .as_flattened()
                        .get_unchecked(self.top)
                        .assume_init()
                },
            ))
        }
    }
}
