//! The SIMD room: the only place of this crate with `unsafe`.
//!
//! Four layers after BurntSushi/memchr: [`Lanes`] is the handful of operations that traversal
//! needs; `traverse::kernel` is the algorithm over it, `#[inline(always)]`; `portable`, `avx2`
//! and `avx512` are the implementations; `dispatch` enters one kernel per instruction set,
//! chosen once by [`Isa`].
//!
//! Beside them stand what else a kernel needs and safe Rust does not have: the `stack`, prefetching, large `pages`.
//!
//! Invariant: the operations of [`Lanes`] other than [`Lanes::mul_add`] round once each in the
//! same way in every implementation, so that a triangle test gives the same bits everywhere.
//! `mul_add` may round once or twice and is for box tests alone, which are conservative.

#[cfg(target_arch = "x86_64")]
pub(crate) mod avx2;
#[cfg(target_arch = "x86_64")]
pub(crate) mod avx512;
pub(crate) mod build;
pub(crate) mod dispatch;
pub(crate) mod gather;
pub(crate) mod isa;
pub(crate) mod pages;
pub(crate) mod portable;
pub(crate) mod stack;

pub use gather::{GatherLanes, LaneKernel, run};
pub use isa::Isa;

/// `N` lanes of `f32`.
pub trait Lanes<const N: usize>: Copy {
    /// One bit per lane, before it is read out.
    type Mask: Copy + std::ops::BitAnd<Output = Self::Mask>;

    /// The same value in every lane.
    fn splat(value: f32) -> Self;
    /// The lanes of an array.
    fn load(array: &[f32; N]) -> Self;
    /// The lanes as an array.
    fn store(self) -> [f32; N];
    /// Sum.
    fn add(self, other: Self) -> Self;
    /// Difference.
    fn sub(self, other: Self) -> Self;
    /// Product.
    fn mul(self, other: Self) -> Self;
    /// Quotient, correctly rounded.
    fn div(self, other: Self) -> Self;
    /// `self · factor + addend`, rounded once or twice: for box tests alone.
    fn mul_add(self, factor: Self, addend: Self) -> Self;
    /// The smaller; unspecified if one is NaN.
    fn min(self, other: Self) -> Self;
    /// The larger; unspecified if one is NaN.
    fn max(self, other: Self) -> Self;
    /// The magnitude.
    fn abs(self) -> Self;
    /// This value, its sign flipped where `sign` is negative (−0 included).
    fn xor_sign(self, sign: Self) -> Self;
    /// Where `self ≤ other`.
    fn le(self, other: Self) -> Self::Mask;
    /// Where `self` is not 0.
    fn is_nonzero(self) -> Self::Mask;
    /// Bit i of the result is lane i.
    fn bits(mask: Self::Mask) -> u32;
}

/// Lanes that hold what a ray finds at the children of a node.
pub(crate) trait PushChildren<const N: usize>: Lanes<N> {
    /// Pushes onto a stack the children that are `entered`, each with its distance from `self`, in the order of the child
    /// numbers that `order` holds in fields of `log2(N)` bits, lowest field first; returns the last of them, which is on
    /// top then. To take it from there would mean to wait for the store. With `ANY` references alone are pushed, as they
    /// lie, whatever `order` is. Unspecified if none is entered.
    #[inline(always)]
    fn push_children<const ANY: bool>(
        self,
        entered: Self::Mask,
        children: &[u32; N],
        order: u64,
        stack: &mut stack::Stack<'_, N, ANY>,
    ) -> u32 {
        let (mask, distances) = (Self::bits(entered), self.store());
        let bits = N.trailing_zeros();
        for k in 0..N as u32 {
            let slot = if ANY {
                k as usize
            } else {
                (order >> (k * bits)) as usize & (N - 1)
            };
            stack.push_if((mask >> slot) & 1, children[slot], distances[slot]);
        }
        stack.peek().unwrap_or(0)
    }
}

/// The child in the last place that `entered` has a bit of, the places being in the order of `order`.
#[cfg(target_arch = "x86_64")]
#[inline(always)]
fn last_child<const N: usize>(entered: u32, children: &[u32; N], order: u64) -> u32 {
    let place = entered.leading_zeros() ^ 31;
    let slot = order >> ((place * N.trailing_zeros()) & 63);
    children[slot as usize & (N - 1)]
}

/// The last child that `entered` has a bit of.
#[cfg(target_arch = "x86_64")]
#[inline(always)]
fn last_as_they_lie<const N: usize>(entered: u32, children: &[u32; N]) -> u32 {
    children[(entered.leading_zeros() ^ 31) as usize & (N - 1)]
}

/// Each of three values in every lane.
#[inline(always)]
pub fn splat_all<const N: usize, L: Lanes<N>>([x, y, z]: [f32; 3]) -> [L; 3] {
    [L::splat(x), L::splat(y), L::splat(z)]
}

/// Asks for all cache lines of something before they are needed.
#[inline(always)]
pub(crate) fn prefetch_all<T>(item: &T) {
    const LINE: usize = 64;
    let first = std::ptr::from_ref(item).cast::<u8>();
    for line in 0..size_of::<T>().div_ceil(LINE) {
        prefetch_at(first.wrapping_add(line * LINE));
    }
}

/// Asks for a cache line before it is needed; does nothing where there is no such instruction.
#[inline(always)]
pub(crate) fn prefetch<T>(item: &T) {
    prefetch_at(std::ptr::from_ref(item).cast());
}

#[inline(always)]
fn prefetch_at(address: *const u8) {
    #[cfg(target_arch = "x86_64")]
    {
        use std::arch::x86_64::{_MM_HINT_T0, _mm_prefetch};
        // SAFETY: SSE is part of x86-64; a prefetch reads nothing that the program can see and
        // may be given any address.
        unsafe { _mm_prefetch::<_MM_HINT_T0>(address.cast()) };
    }
    #[cfg(not(target_arch = "x86_64"))]
    let _ = address;
}
