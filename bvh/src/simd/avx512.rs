//! Lanes by AVX-512: eight by 256-bit registers (VL), sixteen by one register of 512 bits.
//!
//! What pays is `vpcompressd`, which closes the gaps of a list in one instruction. It is only ever
//! used on a register, with a full store behind it: to memory it is microcoded on Zen 4 and makes
//! rays 1.3 to 1.8 times slower.
//!
//! Invariant of the whole file: a value of [`F32x8`] or [`F32x16`] exists only inside the kernels
//! that `dispatch` enters after [`Isa::Avx512`](super::Isa) was found to be available, which
//! includes all of [`Isa::Avx2`](super::Isa). That is the argument of every block below, and why
//! the operations may be safe functions.

use std::arch::x86_64::{
    __m128, __m256, __m512, __mmask8, __mmask16, _CMP_LE_OQ, _CMP_NEQ_OQ, _cvtmask8_u32,
    _cvtmask16_u32, _kand_mask8, _kand_mask16, _mm_add_ps, _mm_and_ps, _mm_and_si128,
    _mm_andnot_ps, _mm_cmp_ps, _mm_div_ps, _mm_fmadd_ps, _mm_loadu_ps, _mm_maskz_compress_epi32,
    _mm_maskz_compress_ps, _mm_max_ps, _mm_min_ps, _mm_movemask_ps, _mm_mul_ps, _mm_permutevar_ps,
    _mm_set1_epi32, _mm_set1_ps, _mm_setr_epi32, _mm_sllv_epi32, _mm_srlv_epi32, _mm_storeu_ps,
    _mm_sub_ps, _mm_test_epi32_mask, _mm_xor_ps, _mm256_add_ps, _mm256_and_ps, _mm256_and_si256,
    _mm256_andnot_ps, _mm256_cmp_ps_mask, _mm256_div_ps, _mm256_fmadd_ps, _mm256_loadu_ps,
    _mm256_maskz_compress_epi32, _mm256_maskz_compress_ps, _mm256_max_ps, _mm256_min_ps,
    _mm256_mul_ps, _mm256_permutevar8x32_ps, _mm256_set1_epi32, _mm256_set1_ps, _mm256_setr_epi32,
    _mm256_sllv_epi32, _mm256_srlv_epi32, _mm256_storeu_ps, _mm256_sub_ps, _mm256_test_epi32_mask,
    _mm256_xor_ps, _mm512_add_ps, _mm512_and_ps, _mm512_and_si512, _mm512_andnot_ps,
    _mm512_cmp_ps_mask, _mm512_div_ps, _mm512_fmadd_ps, _mm512_loadu_ps, _mm512_mask_set1_epi32,
    _mm512_maskz_compress_epi32, _mm512_maskz_compress_ps, _mm512_max_ps, _mm512_min_ps,
    _mm512_mul_ps, _mm512_permutexvar_ps, _mm512_set1_epi32, _mm512_set1_ps, _mm512_setr_epi32,
    _mm512_sllv_epi32, _mm512_srlv_epi32, _mm512_storeu_ps, _mm512_sub_ps, _mm512_test_epi32_mask,
    _mm512_xor_ps,
};

use super::{
    Lanes, PushChildren, avx2::lanes_by_intrinsics, last_as_they_lie, last_child, stack::Stack,
};

/// Four lanes in a register of 128 bits.
#[derive(Clone, Copy, Debug)]
pub(crate) struct F32x4(__m128);

/// Eight lanes in a register of 256 bits.
#[derive(Clone, Copy, Debug)]
pub(crate) struct F32x8(__m256);

/// Sixteen lanes in a register of 512 bits.
#[derive(Clone, Copy, Debug)]
pub(crate) struct F32x16(pub(super) __m512);

/// The result of a comparison of four lanes.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Mask4(__m128);

/// The result of a comparison of eight lanes.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Mask8(__mmask8);

/// The result of a comparison of sixteen lanes.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Mask16(pub(super) __mmask16);

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
    _mm_movemask_ps,
    /// Sorts by one permutation and closes the gaps by compression, without a branch.
    #[inline(always)]
    fn push_children<const ANY: bool>(
        self,
        entered: Self::Mask,
        children: &[u32; 4],
        order: u64,
        stack: &mut Stack<'_, 4, ANY>,
    ) -> u32 {
        let mask = Self::bits(entered);
        let (reference, distance) = stack.top(4);
        // SAFETY: the instructions are available (file header). The load reads the four words of
        // `children`. By the invariant of the stack, N = 4 entries from the top on lie inside each
        // array; all four are written, and at most four are counted in.
        unsafe {
            if ANY {
                let words = _mm_loadu_ps(children.as_ptr().cast::<f32>());
                let words = _mm_maskz_compress_ps(mask as u8, words);
                _mm_storeu_ps(reference.cast::<f32>(), words);
                stack.grow(mask.count_ones());
                return last_as_they_lie(mask, children);
            }
            let fields = _mm_set1_epi32(order as u32 as i32);
            let slots = _mm_srlv_epi32(fields, _mm_setr_epi32(0, 2, 4, 6));
            let bits = _mm_sllv_epi32(_mm_set1_epi32(1), _mm_and_si128(slots, _mm_set1_epi32(3)));
            let entered = _mm_test_epi32_mask(bits, _mm_set1_epi32(mask as i32));
            let slots = _mm_maskz_compress_epi32(entered, slots);
            let words = _mm_loadu_ps(children.as_ptr().cast::<f32>());
            _mm_storeu_ps(reference.cast::<f32>(), _mm_permutevar_ps(words, slots));
            _mm_storeu_ps(distance, _mm_permutevar_ps(self.0, slots));
            stack.grow(mask.count_ones());
            last_child(u32::from(entered), children, order)
        }
    }
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
    _mm256_cmp_ps_mask,
    _kand_mask8,
    _cvtmask8_u32,
    /// As with four lanes.
    #[inline(always)]
    fn push_children<const ANY: bool>(
        self,
        entered: Self::Mask,
        children: &[u32; 8],
        order: u64,
        stack: &mut Stack<'_, 8, ANY>,
    ) -> u32 {
        let mask = Self::bits(entered);
        let (reference, distance) = stack.top(8);
        // SAFETY: as with four lanes, for eight.
        unsafe {
            if ANY {
                let words = _mm256_loadu_ps(children.as_ptr().cast::<f32>());
                let words = _mm256_maskz_compress_ps(mask as u8, words);
                _mm256_storeu_ps(reference.cast::<f32>(), words);
                stack.grow(mask.count_ones());
                return last_as_they_lie(mask, children);
            }
            let fields = _mm256_set1_epi32(order as u32 as i32);
            let slots = _mm256_srlv_epi32(fields, _mm256_setr_epi32(0, 3, 6, 9, 12, 15, 18, 21));
            let lanes = _mm256_and_si256(slots, _mm256_set1_epi32(7));
            let bits = _mm256_sllv_epi32(_mm256_set1_epi32(1), lanes);
            let entered = _mm256_test_epi32_mask(bits, _mm256_set1_epi32(mask as i32));
            let slots = _mm256_maskz_compress_epi32(entered, slots);
            let words = _mm256_loadu_ps(children.as_ptr().cast::<f32>());
            let words = _mm256_permutevar8x32_ps(words, slots);
            _mm256_storeu_ps(reference.cast::<f32>(), words);
            _mm256_storeu_ps(distance, _mm256_permutevar8x32_ps(self.0, slots));
            stack.grow(mask.count_ones());
            last_child(u32::from(entered), children, order)
        }
    }
);

lanes_by_intrinsics!(
    F32x16,
    Mask16,
    16,
    _mm512_set1_ps,
    _mm512_loadu_ps,
    _mm512_storeu_ps,
    _mm512_add_ps,
    _mm512_sub_ps,
    _mm512_mul_ps,
    _mm512_div_ps,
    _mm512_fmadd_ps,
    _mm512_min_ps,
    _mm512_max_ps,
    _mm512_and_ps,
    _mm512_andnot_ps,
    _mm512_xor_ps,
    _mm512_cmp_ps_mask,
    _kand_mask16,
    _cvtmask16_u32,
    /// As with four lanes; the upper eight slots are in the upper half of `order`.
    #[inline(always)]
    fn push_children<const ANY: bool>(
        self,
        entered: Self::Mask,
        children: &[u32; 16],
        order: u64,
        stack: &mut Stack<'_, 16, ANY>,
    ) -> u32 {
        let mask = Self::bits(entered);
        let (reference, distance) = stack.top(16);
        // SAFETY: as with four lanes, for sixteen.
        unsafe {
            if ANY {
                let words = _mm512_loadu_ps(children.as_ptr().cast::<f32>());
                let words = _mm512_maskz_compress_ps(mask as u16, words);
                _mm512_storeu_ps(reference.cast::<f32>(), words);
                stack.grow(mask.count_ones());
                return last_as_they_lie(mask, children);
            }
            let shifts =
                _mm512_setr_epi32(0, 4, 8, 12, 16, 20, 24, 28, 0, 4, 8, 12, 16, 20, 24, 28);
            let low = _mm512_set1_epi32(order as u32 as i32);
            let fields = _mm512_mask_set1_epi32(low, 0xff00, (order >> 32) as i32);
            let slots = _mm512_srlv_epi32(fields, shifts);
            let lanes = _mm512_and_si512(slots, _mm512_set1_epi32(15));
            let bits = _mm512_sllv_epi32(_mm512_set1_epi32(1), lanes);
            let entered = _mm512_test_epi32_mask(bits, _mm512_set1_epi32(mask as i32));
            let slots = _mm512_maskz_compress_epi32(entered, slots);
            let words = _mm512_loadu_ps(children.as_ptr().cast::<f32>());
            let words = _mm512_permutexvar_ps(slots, words);
            _mm512_storeu_ps(reference.cast::<f32>(), words);
            _mm512_storeu_ps(distance, _mm512_permutexvar_ps(slots, self.0));
            stack.grow(mask.count_ones());
            last_child(u32::from(entered), children, order)
        }
    }
);
