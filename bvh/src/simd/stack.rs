//! The stack of one traversal: child references and their entry distances in two arrays, so that
//! eight can be written by one store each. It is not initialised: clearing it would cost as much
//! as tracing a short ray.
//!
//! Invariant: `top ≤ CAPACITY − 8`, and all entries below `top` are initialised. The deepest tree
//! has [`MAX_LEVELS`] levels and the widest node 8 children of which one is taken at once, so that
//! at most 7 wait per level; [`CAPACITY`] is that, and 8 more for a store that writes past the top.

use std::mem::MaybeUninit;

/// Levels of the deepest tree that `max_depth` allows.
pub(crate) const MAX_LEVELS: usize = 64;
const CAPACITY: usize = 7 * MAX_LEVELS + 1 + 8;

#[derive(Debug)]
pub(crate) struct Stack {
    references: [MaybeUninit<u32>; CAPACITY],
    distances: [MaybeUninit<f32>; CAPACITY],
    top: usize,
}

impl Stack {
    #[inline(always)]
    pub(crate) fn new() -> Self {
        Self {
            references: [const { MaybeUninit::uninit() }; CAPACITY],
            distances: [const { MaybeUninit::uninit() }; CAPACITY],
            top: 0,
        }
    }

    /// Pushes an entry if `bit` is 1, without a branch; `bit` is 0 or 1.
    #[inline(always)]
    pub(crate) fn push_if(&mut self, bit: u32, reference: u32, distance: f32) {
        debug_assert!(self.top < CAPACITY - 7);
        // The index is in bounds by the invariant; min() lets the compiler see it for free.
        let at = self.top.min(CAPACITY - 1);
        self.references[at] = MaybeUninit::new(reference);
        self.distances[at] = MaybeUninit::new(distance);
        self.top += bit as usize;
    }

    /// Pushes the first `count` of eight entries.
    #[cfg(target_arch = "x86_64")]
    #[inline(always)]
    pub(crate) fn push_eight(
        &mut self,
        references: std::arch::x86_64::__m256i,
        distances: std::arch::x86_64::__m256i,
        count: u32,
    ) {
        use std::arch::x86_64::{__m256i, _mm256_storeu_si256};
        debug_assert!(self.top <= CAPACITY - 8);
        // SAFETY: the caller holds AVX2 values, so AVX2 is available. `top ≤ CAPACITY − 8` by the
        // invariant of the type (checked in builds with debug assertions), so that eight elements
        // from `top` on lie inside each array; unaligned stores ask for no alignment.
        unsafe {
            _mm256_storeu_si256(
                self.references.as_mut_ptr().add(self.top).cast::<__m256i>(),
                references,
            );
            _mm256_storeu_si256(
                self.distances.as_mut_ptr().add(self.top).cast::<__m256i>(),
                distances,
            );
        }
        self.top += count as usize;
    }

    /// Takes the top entry: its reference and its distance.
    #[inline(always)]
    pub(crate) fn pop(&mut self) -> Option<(u32, f32)> {
        self.top = self.top.checked_sub(1)?;
        let at = self.top.min(CAPACITY - 1);
        // SAFETY: entries below the old `top` are initialised by the invariant: both push
        // functions write an entry before they raise `top` past it.
        unsafe {
            Some((
                self.references[at].assume_init(),
                self.distances[at].assume_init(),
            ))
        }
    }
}
