//! Lanes by AVX2 and FMA intrinsics.
//!
//! Invariant of the whole file: a value of [`F32x4`] or [`F32x8`] exists only inside the kernels
//! that `dispatch` enters after [`Isa::Avx2`](super::Isa) was found to be available. The types
//! cannot be made outside this crate, whose only user of them is `dispatch`. That is the argument
//! of every block below, and why the operations may be safe functions.

use std::arch::x86_64::{
    __m128, __m256, __m256i, _CMP_LE_OQ, _CMP_NEQ_OQ, _mm_add_ps, _mm_and_ps, _mm_andnot_ps,
    _mm_cmp_ps, _mm_div_ps, _mm_fmadd_ps, _mm_loadu_ps, _mm_max_ps, _mm_min_ps, _mm_movemask_ps,
    _mm_mul_ps, _mm_set1_ps, _mm_storeu_ps, _mm_sub_ps, _mm_xor_ps, _mm256_add_ps, _mm256_and_ps,
    _mm256_and_si256, _mm256_andnot_ps, _mm256_blendv_ps, _mm256_castps_si256, _mm256_castsi256_ps,
    _mm256_cmp_ps, _mm256_div_ps, _mm256_fmadd_ps, _mm256_loadu_ps, _mm256_loadu_si256,
    _mm256_max_ps, _mm256_min_ps, _mm256_movemask_ps, _mm256_mul_ps, _mm256_permutevar8x32_epi32,
    _mm256_permutevar8x32_ps, _mm256_set1_epi32, _mm256_set1_ps, _mm256_setr_epi32,
    _mm256_slli_epi32, _mm256_srlv_epi32, _mm256_storeu_ps, _mm256_storeu_si256, _mm256_sub_ps,
    _mm256_xor_ps,
};

use super::{
    Lanes, PushChildren, last_as_they_lie, last_child,
    portable::{Half, Halves, MaskHalves},
    stack::Stack,
};

/// Four lanes in an SSE register.
#[derive(Clone, Copy, Debug)]
pub(crate) struct F32x4(pub(super) __m128);

/// Eight lanes in an AVX register.
#[derive(Clone, Copy, Debug)]
pub(crate) struct F32x8(pub(super) __m256);

/// The result of a comparison of four lanes.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Mask4(__m128);

/// The result of a comparison of eight lanes.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Mask8(pub(super) __m256);

/// Also for `avx512`, with the argument of its header in place of this one's.
macro_rules! lanes_by_intrinsics {
    ($lanes:ident, $mask:ident, $n:literal, $set1:ident, $load:ident, $store:ident, $add:ident, $sub:ident,
     $mul:ident, $div:ident, $fmadd:ident, $min:ident, $max:ident, $and:ident, $andnot:ident, $xor:ident,
     $cmp:ident, $and_mask:ident, $movemask:ident $(, $push:item)?) => {
        impl std::ops::BitAnd for $mask {
            type Output = Self;
            #[inline(always)]
            fn bitand(self, other: Self) -> Self {
                // SAFETY: the instructions are available wherever a value of this type exists
                // (file header).
                Self(unsafe { $and_mask(self.0, other.0) })
            }
        }

        impl Lanes<$n> for $lanes {
            type Mask = $mask;

            #[inline(always)]
            fn splat(value: f32) -> Self {
                // SAFETY: only kernels entered after detection call this (file header).
                Self(unsafe { $set1(value) })
            }
            #[inline(always)]
            fn load(array: &[f32; $n]) -> Self {
                // SAFETY: as `splat`; the array holds exactly the lanes that are read, and the
                // unaligned load asks for no alignment.
                Self(unsafe { $load(array.as_ptr()) })
            }
            #[inline(always)]
            fn store(self) -> [f32; $n] {
                let mut array = [0.0; $n];
                // SAFETY: as `splat`; the array holds exactly the lanes that are written, and the unaligned store asks for no alignment.
                unsafe { $store(array.as_mut_ptr(), self.0) };
                array
            }
            #[inline(always)]
            fn add(self, other: Self) -> Self {
                // SAFETY: the instructions are available wherever a value of this type exists
                // (file header).
                Self(unsafe { $add(self.0, other.0) })
            }
            #[inline(always)]
            fn sub(self, other: Self) -> Self {
                // SAFETY: as `add`.
                Self(unsafe { $sub(self.0, other.0) })
            }
            #[inline(always)]
            fn mul(self, other: Self) -> Self {
                // SAFETY: as `add`.
                Self(unsafe { $mul(self.0, other.0) })
            }
            #[inline(always)]
            fn div(self, other: Self) -> Self {
                // SAFETY: as `add`.
                Self(unsafe { $div(self.0, other.0) })
            }
            #[inline(always)]
            fn mul_add(self, factor: Self, addend: Self) -> Self {
                // SAFETY: as `add`; FMA is detected together with AVX2.
                Self(unsafe { $fmadd(self.0, factor.0, addend.0) })
            }
            #[inline(always)]
            fn min(self, other: Self) -> Self {
                // SAFETY: as `add`.
                Self(unsafe { $min(self.0, other.0) })
            }
            #[inline(always)]
            fn max(self, other: Self) -> Self {
                // SAFETY: as `add`.
                Self(unsafe { $max(self.0, other.0) })
            }
            #[inline(always)]
            fn abs(self) -> Self {
                // SAFETY: as `add`.
                Self(unsafe { $andnot($set1(-0.0), self.0) })
            }
            #[inline(always)]
            fn xor_sign(self, sign: Self) -> Self {
                // SAFETY: as `add`.
                Self(unsafe { $xor(self.0, $and(sign.0, $set1(-0.0))) })
            }
            #[inline(always)]
            fn le(self, other: Self) -> Self::Mask {
                // SAFETY: as `add`.
                $mask(unsafe { $cmp::<_CMP_LE_OQ>(self.0, other.0) })
            }
            #[inline(always)]
            fn is_nonzero(self) -> Self::Mask {
                // SAFETY: as `add`.
                $mask(unsafe { $cmp::<_CMP_NEQ_OQ>(self.0, $set1(0.0)) })
            }
            #[inline(always)]
            fn bits(mask: Self::Mask) -> u32 {
                // SAFETY: as `add`.
                (unsafe { $movemask(mask.0) }) as u32
            }
        }

        impl PushChildren<$n> for $lanes {
            $($push)?
        }
    };
}

pub(super) use lanes_by_intrinsics;

lanes_by_intrinsics!(
    F32x4,
    Mask4,
    4,
    _mm_set1_ps,
    _mm_loadu_ps,
    _mm_storeu_ps,
    _mm_add_ps,
    _mm_sub_ps,
    _mm_mul_ps,
    _mm_div_ps,
    _mm_fmadd_ps,
    _mm_min_ps,
    _mm_max_ps,
    _mm_and_ps,
    _mm_andnot_ps,
    _mm_xor_ps,
    _mm_cmp_ps,
    _mm_and_ps,
    _mm_movemask_ps
);

lanes_by_intrinsics!(
    F32x8,
    Mask8,
    8,
    _mm256_set1_ps,
    _mm256_loadu_ps,
    _mm256_storeu_ps,
    _mm256_add_ps,
    _mm256_sub_ps,
    _mm256_mul_ps,
    _mm256_div_ps,
    _mm256_fmadd_ps,
    _mm256_min_ps,
    _mm256_max_ps,
    _mm256_and_ps,
    _mm256_andnot_ps,
    _mm256_xor_ps,
    _mm256_cmp_ps,
    _mm256_and_ps,
    _mm256_movemask_ps,
    /// Sorts by one permutation and closes the gaps by another, without a branch.
    #[inline(always)]
    fn push_children<const ANY: bool>(
        self,
        entered: Self::Mask,
        children: &[u32; 8],
        order: u64,
        stack: &mut Stack<'_, 8, ANY>,
    ) -> u32 {
        let mask = Self::bits(entered);
        if ANY {
            push_references(stack, mask, children);
            return last_as_they_lie(mask, children);
        }
        // SAFETY: AVX2 is available (file header). The load reads the eight words of `children`.
        let (slots, words) = unsafe {
            let shifts = _mm256_setr_epi32(0, 3, 6, 9, 12, 15, 18, 21);
            let fields = _mm256_set1_epi32(order as u32 as i32);
            (
                _mm256_and_si256(_mm256_srlv_epi32(fields, shifts), _mm256_set1_epi32(7)),
                _mm256_loadu_si256(children.as_ptr().cast::<__m256i>()),
            )
        };
        let sorted = sorted_mask(entered, slots);
        // SAFETY: as above.
        let (references, distances) = unsafe {
            let slots = _mm256_permutevar8x32_epi32(slots, closing(sorted));
            (
                _mm256_permutevar8x32_epi32(words, slots),
                _mm256_permutevar8x32_ps(self.0, slots),
            )
        };
        push_eight(stack, references, distances, mask.count_ones());
        last_child(sorted, children, order)
    }
);

impl Half for F32x8 {
    #[inline(always)]
    fn push_children_of_both<const ANY: bool>(
        both: Halves<Self>,
        entered: MaskHalves<Mask8>,
        children: &[u32; 16],
        order: u64,
        stack: &mut Stack<'_, 16, ANY>,
    ) -> u32 {
        let mask = Halves::<Self>::bits(entered);
        if ANY {
            let (halves, _) = children.as_chunks();
            push_references(stack, mask & 255, &halves[0]);
            push_references(stack, mask >> 8, &halves[1]);
            return last_as_they_lie(mask, children);
        }
        let mut entered_in_order = 0;
        for half in 0..2 {
            // SAFETY: AVX2 is available (file header). The loads read eight words each of the
            // sixteen of `children`.
            let (sorted, references, distances) = unsafe {
                let fields = _mm256_setr_epi32(0, 4, 8, 12, 16, 20, 24, 28);
                let order = _mm256_set1_epi32((order >> (32 * half)) as u32 as i32);
                let slots = _mm256_srlv_epi32(order, fields);
                // Bit 3 of a slot, moved to the sign, tells which half it is in.
                let upper = _mm256_castsi256_ps(_mm256_slli_epi32::<28>(slots));
                let low = sorted_mask(entered.0, slots);
                let high = sorted_mask(entered.1, slots);
                let is_high = _mm256_movemask_ps(upper) as u32;
                let sorted = low & !is_high | high & is_high;
                let close = closing(sorted);
                let slots = _mm256_permutevar8x32_epi32(slots, close);
                let upper = _mm256_permutevar8x32_ps(upper, close);
                let words = children.as_ptr().cast::<__m256i>();
                let references = [
                    _mm256_permutevar8x32_epi32(_mm256_loadu_si256(words), slots),
                    _mm256_permutevar8x32_epi32(_mm256_loadu_si256(words.add(1)), slots),
                ];
                let distances = [
                    _mm256_permutevar8x32_ps(both.0.0, slots),
                    _mm256_permutevar8x32_ps(both.1.0, slots),
                ];
                (
                    sorted,
                    _mm256_castps_si256(_mm256_blendv_ps(
                        _mm256_castsi256_ps(references[0]),
                        _mm256_castsi256_ps(references[1]),
                        upper,
                    )),
                    _mm256_blendv_ps(distances[0], distances[1], upper),
                )
            };
            push_eight(stack, references, distances, sorted.count_ones());
            entered_in_order |= sorted << (8 * half);
        }
        last_child(entered_in_order, children, order)
    }
}

/// The bits of a mask of eight lanes in the order of `slots`, of which the lowest three bits count. The mask as it is
/// compared is sorted, since the way from its bits back to a vector is long.
#[inline(always)]
fn sorted_mask(mask: Mask8, slots: __m256i) -> u32 {
    // SAFETY: AVX2 is available wherever a vector of this module exists (file header).
    unsafe { _mm256_movemask_ps(_mm256_permutevar8x32_ps(mask.0, slots)) as u32 }
}

/// The permutation that closes the gaps of a mask of eight lanes.
#[inline(always)]
fn closing(mask: u32) -> __m256i {
    let row = &COMPRESS[mask as usize & 255];
    // SAFETY: AVX2 is available (file header); the load reads the eight words of the row.
    unsafe { _mm256_loadu_si256(row.as_ptr().cast::<__m256i>()) }
}

/// Pushes those of eight references that `mask` has bits of, as they lie, onto a stack of references alone: `ANY` is true.
#[inline(always)]
fn push_references<const N: usize, const ANY: bool>(
    stack: &mut Stack<'_, N, ANY>,
    mask: u32,
    references: &[u32; 8],
) {
    const {
        assert!(
            N >= 8,
            "a push may write as many entries as a node has children"
        )
    };
    debug_assert!(ANY);
    let (reference, _) = stack.top(8);
    // SAFETY: as in `push_eight`; with `ANY` (both callers ask for it) no distance is counted in; the load reads the eight of them.
    unsafe {
        let words = _mm256_loadu_si256(references.as_ptr().cast::<__m256i>());
        let words = _mm256_permutevar8x32_epi32(words, closing(mask));
        _mm256_storeu_si256(reference.cast::<__m256i>(), words);
        stack.grow(mask.count_ones());
    }
}

/// Pushes the first `count ≤ 8` of eight entries.
#[inline(always)]
fn push_eight<const N: usize, const ANY: bool>(
    stack: &mut Stack<'_, N, ANY>,
    references: __m256i,
    distances: __m256,
    count: u32,
) {
    const {
        assert!(
            N >= 8,
            "a push may write as many entries as a node has children"
        )
    };
    let (reference, distance) = stack.top(8);
    // SAFETY: AVX2 is available (file header). By the invariant of the stack (checked in builds
    // with debug assertions) N ≥ 8 entries from the top on lie inside each array; unaligned stores
    // ask for no alignment. They initialise eight entries, of which at most eight are counted in.
    unsafe {
        _mm256_storeu_si256(reference.cast::<__m256i>(), references);
        _mm256_storeu_ps(distance, distances);
        stack.grow(count);
    }
}

impl super::build::Halves for F32x8 {
    #[inline(always)]
    fn swap_halves(self) -> Self {
        // SAFETY: AVX2 is available wherever a value of this type exists (file header).
        Self(unsafe { std::arch::x86_64::_mm256_permute2f128_ps::<1>(self.0, self.0) })
    }
}

/// Row m lists the set bits of m from the lowest to the highest, then zeros: the permutation that
/// closes the gaps of a mask.
static COMPRESS: [[u32; 8]; 256] = {
    let mut table = [[0; 8]; 256];
    let mut mask = 0;
    while mask < 256 {
        let (mut bit, mut filled) = (0, 0);
        while bit < 8 {
            if mask >> bit & 1 == 1 {
                table[mask][filled] = bit as u32;
                filled += 1;
            }
            bit += 1;
        }
        mask += 1;
    }
    table
};
