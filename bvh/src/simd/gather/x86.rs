//! Lanes that fetch, by AVX2 and AVX-512. On Zen 4 a gather of sixteen words costs as much as one of
//! sixteen double words, so that more is fetched at a time where it lies together.

use std::arch::x86_64::*;

use super::{GatherLanes, LaneKernel, last_index};
use crate::simd::{avx2, avx512};

#[target_feature(enable = "avx2,fma,bmi1,bmi2,popcnt,lzcnt")]
pub(super) fn run_avx2<K: LaneKernel>(kernel: K) -> K::Output {
    kernel.run::<8, avx2::F32x8>()
}

#[target_feature(enable = "avx512f,avx512vl,avx512dq,avx2,fma,bmi1,bmi2,popcnt,lzcnt")]
pub(super) fn run_avx512<K: LaneKernel>(kernel: K) -> K::Output {
    kernel.run::<16, avx512::F32x16>()
}

/// The low and the high halves of the eight bytes at each place, `SCALE` bytes being an index.
///
/// # Safety
/// The instructions must be available, and the bytes readable.
#[inline(always)]
unsafe fn double_words_avx2<const SCALE: i32>(table: *const i64, index: __m256i) -> [__m256i; 2] {
    // SAFETY: as the caller promises.
    unsafe {
        let first = _mm256_castsi256_si128(index);
        let second = _mm256_extracti128_si256::<1>(index);
        let first = _mm256_castsi256_ps(_mm256_i32gather_epi64::<SCALE>(table, first));
        let second = _mm256_castsi256_ps(_mm256_i32gather_epi64::<SCALE>(table, second));
        // Halves of both, each half of a register by itself; then quarters in their order.
        let low = _mm256_castps_si256(_mm256_shuffle_ps::<0b10_00_10_00>(first, second));
        let high = _mm256_castps_si256(_mm256_shuffle_ps::<0b11_01_11_01>(first, second));
        [low, high].map(|words| _mm256_permute4x64_epi64::<0b11_01_10_00>(words))
    }
}

/// As [`double_words_avx2`].
///
/// # Safety
/// As there.
#[inline(always)]
unsafe fn double_words_avx512<const SCALE: i32>(table: *const i64, index: __m512i) -> [__m512i; 2] {
    // SAFETY: as the caller promises.
    unsafe {
        let first = _mm512_castsi512_si256(index);
        let second = _mm512_extracti64x4_epi64::<1>(index);
        let first = _mm512_i32gather_epi64::<SCALE>(first, table.cast());
        let second = _mm512_i32gather_epi64::<SCALE>(second, table.cast());
        let even = _mm512_setr_epi32(0, 2, 4, 6, 8, 10, 12, 14, 16, 18, 20, 22, 24, 26, 28, 30);
        let odd = _mm512_setr_epi32(1, 3, 5, 7, 9, 11, 13, 15, 17, 19, 21, 23, 25, 27, 29, 31);
        [even, odd].map(|places| _mm512_permutex2var_epi32(first, places, second))
    }
}

/// The operations that differ by their names alone.
macro_rules! common {
    ($int:ty, $sqrt:ident, $truncate:ident, $round:ident, $from:ident, $splat:ident, $add:ident,
     $mul:ident, $min:ident, $shift:ident) => {
        #[inline(always)]
        fn sqrt(self) -> Self {
            // SAFETY: the instructions are available wherever a value of this type exists
            // (file header), here and below.
            Self(unsafe { $sqrt(self.0) })
        }
        #[inline(always)]
        fn truncate(self) -> $int {
            // SAFETY: as `sqrt`.
            unsafe { $truncate(self.0) }
        }
        #[inline(always)]
        fn round(self) -> $int {
            // SAFETY: as `sqrt`.
            unsafe { $round(self.0) }
        }
        #[inline(always)]
        fn from_int(value: $int) -> Self {
            // SAFETY: as `sqrt`.
            Self(unsafe { $from(value) })
        }
        #[inline(always)]
        fn splat_int(value: i32) -> $int {
            // SAFETY: as `sqrt`: kernels alone call it.
            unsafe { $splat(value) }
        }
        #[inline(always)]
        fn add_int(a: $int, b: $int) -> $int {
            // SAFETY: as `sqrt`.
            unsafe { $add(a, b) }
        }
        #[inline(always)]
        fn mul_int(a: $int, b: $int) -> $int {
            // SAFETY: as `sqrt`.
            unsafe { $mul(a, b) }
        }
        #[inline(always)]
        fn min_int(a: $int, b: $int) -> $int {
            // SAFETY: as `sqrt`.
            unsafe { $min(a, b) }
        }
        #[inline(always)]
        fn shift_int(a: $int, bits: u32) -> $int {
            // SAFETY: as `sqrt`.
            unsafe { $shift(a, _mm_cvtsi32_si128(bits as i32)) }
        }
    };
}

impl GatherLanes<8> for avx2::F32x8 {
    type Int = __m256i;

    common!(
        __m256i,
        _mm256_sqrt_ps,
        _mm256_cvttps_epi32,
        _mm256_cvtps_epi32,
        _mm256_cvtepi32_ps,
        _mm256_set1_epi32,
        _mm256_add_epi32,
        _mm256_mullo_epi32,
        _mm256_min_epi32,
        _mm256_sra_epi32
    );

    #[inline(always)]
    fn floor(self) -> Self {
        // SAFETY: as `sqrt`.
        Self(unsafe { _mm256_floor_ps(self.0) })
    }
    #[inline(always)]
    fn select(mask: avx2::Mask8, yes: Self, no: Self) -> Self {
        // SAFETY: as `sqrt`.
        Self(unsafe { _mm256_blendv_ps(no.0, yes.0, mask.0) })
    }
    #[inline(always)]
    fn lt(self, other: Self) -> avx2::Mask8 {
        // SAFETY: as `sqrt`.
        avx2::Mask8(unsafe { _mm256_cmp_ps::<_CMP_LT_OQ>(self.0, other.0) })
    }
    #[inline(always)]
    fn gather(table: &[f32], index: __m256i, mask: avx2::Mask8) -> Self {
        let last = last_index(table.len(), 1);
        // SAFETY: as `sqrt`; the index is limited to the table.
        Self(unsafe {
            let index = _mm256_min_epu32(index, _mm256_set1_epi32(last));
            _mm256_mask_i32gather_ps::<4>(_mm256_setzero_ps(), table.as_ptr(), index, mask.0)
        })
    }
    #[inline(always)]
    fn gather_bytes(table: &[u8], index: __m256i) -> __m256i {
        let last = last_index(table.len(), 4);
        // SAFETY: as `sqrt`; the index is limited so that the four bytes are in the table.
        unsafe {
            let index = _mm256_min_epu32(index, _mm256_set1_epi32(last));
            let words = _mm256_i32gather_epi32::<1>(table.as_ptr().cast(), index);
            _mm256_and_si256(words, _mm256_set1_epi32(255))
        }
    }
    #[inline(always)]
    fn gather_pairs(table: &[f32], index: __m256i) -> [Self; 2] {
        let last = last_index(table.len(), 2);
        // SAFETY: as `sqrt`; the index is limited so that both items are in the table.
        let [low, high] = unsafe {
            let index = _mm256_min_epu32(index, _mm256_set1_epi32(last));
            double_words_avx2::<4>(table.as_ptr().cast(), index)
        };
        // SAFETY: as `sqrt`.
        unsafe { [low, high].map(|words| Self(_mm256_castsi256_ps(words))) }
    }
    #[inline(always)]
    fn gather_squares_u8(table: &[[u8; 2]], index: __m256i) -> [Self; 4] {
        let last = last_index(table.len(), 2);
        // SAFETY: as `gather_pairs`.
        unsafe {
            let index = _mm256_min_epu32(index, _mm256_set1_epi32(last));
            let words = _mm256_i32gather_epi32::<2>(table.as_ptr().cast(), index);
            let byte = _mm256_set1_epi32(0xff);
            [
                _mm256_and_si256(words, byte),
                _mm256_and_si256(_mm256_srli_epi32::<8>(words), byte),
                _mm256_and_si256(_mm256_srli_epi32::<16>(words), byte),
                _mm256_srli_epi32::<24>(words),
            ]
            .map(|bytes| Self(_mm256_cvtepi32_ps(bytes)))
        }
    }
    #[inline(always)]
    fn gather_squares_u16(table: &[[u16; 2]], index: __m256i) -> [Self; 4] {
        let last = last_index(table.len(), 2);
        // SAFETY: as `gather_pairs`.
        unsafe {
            let index = _mm256_min_epu32(index, _mm256_set1_epi32(last));
            let [low, high] = double_words_avx2::<4>(table.as_ptr().cast(), index);
            let word = _mm256_set1_epi32(0xffff);
            [
                _mm256_and_si256(low, word),
                _mm256_srli_epi32::<16>(low),
                _mm256_and_si256(high, word),
                _mm256_srli_epi32::<16>(high),
            ]
            .map(|words| Self(_mm256_cvtepi32_ps(words)))
        }
    }
    #[inline(always)]
    fn gather_triples(table: &[[u16; 4]], index: __m256i) -> [Self; 3] {
        let last = last_index(table.len(), 1);
        // SAFETY: as `sqrt`; the index is limited to the table.
        unsafe {
            let index = _mm256_min_epu32(index, _mm256_set1_epi32(last));
            let [low, high] = double_words_avx2::<8>(table.as_ptr().cast(), index);
            let word = _mm256_set1_epi32(0xffff);
            [
                _mm256_and_si256(low, word),
                _mm256_srli_epi32::<16>(low),
                _mm256_and_si256(high, word),
            ]
            .map(|words| Self(_mm256_cvtepi32_ps(words)))
        }
    }
}

impl GatherLanes<16> for avx512::F32x16 {
    type Int = __m512i;

    common!(
        __m512i,
        _mm512_sqrt_ps,
        _mm512_cvttps_epi32,
        _mm512_cvtps_epi32,
        _mm512_cvtepi32_ps,
        _mm512_set1_epi32,
        _mm512_add_epi32,
        _mm512_mullo_epi32,
        _mm512_min_epi32,
        _mm512_sra_epi32
    );

    #[inline(always)]
    fn floor(self) -> Self {
        // SAFETY: as `sqrt`.
        Self(unsafe {
            _mm512_roundscale_ps::<{ _MM_FROUND_TO_NEG_INF | _MM_FROUND_NO_EXC }>(self.0)
        })
    }
    #[inline(always)]
    fn select(mask: avx512::Mask16, yes: Self, no: Self) -> Self {
        // SAFETY: as `sqrt`.
        Self(unsafe { _mm512_mask_blend_ps(mask.0, no.0, yes.0) })
    }
    #[inline(always)]
    fn lt(self, other: Self) -> avx512::Mask16 {
        // SAFETY: as `sqrt`.
        avx512::Mask16(unsafe { _mm512_cmp_ps_mask::<_CMP_LT_OQ>(self.0, other.0) })
    }
    #[inline(always)]
    fn gather(table: &[f32], index: __m512i, mask: avx512::Mask16) -> Self {
        let last = last_index(table.len(), 1);
        // SAFETY: as `sqrt`; the index is limited to the table.
        Self(unsafe {
            let index = _mm512_min_epu32(index, _mm512_set1_epi32(last));
            let zero = _mm512_setzero_ps();
            _mm512_mask_i32gather_ps::<4>(zero, mask.0, index, table.as_ptr())
        })
    }
    #[inline(always)]
    fn gather_bytes(table: &[u8], index: __m512i) -> __m512i {
        let last = last_index(table.len(), 4);
        // SAFETY: as `sqrt`; the index is limited so that the four bytes are in the table.
        unsafe {
            let index = _mm512_min_epu32(index, _mm512_set1_epi32(last));
            let words = _mm512_i32gather_epi32::<1>(index, table.as_ptr().cast());
            _mm512_and_si512(words, _mm512_set1_epi32(255))
        }
    }
    #[inline(always)]
    fn gather_pairs(table: &[f32], index: __m512i) -> [Self; 2] {
        let last = last_index(table.len(), 2);
        // SAFETY: as `sqrt`; the index is limited so that both items are in the table.
        let [low, high] = unsafe {
            let index = _mm512_min_epu32(index, _mm512_set1_epi32(last));
            double_words_avx512::<4>(table.as_ptr().cast(), index)
        };
        // SAFETY: as `sqrt`.
        unsafe { [low, high].map(|words| Self(_mm512_castsi512_ps(words))) }
    }
    #[inline(always)]
    fn gather_squares_u8(table: &[[u8; 2]], index: __m512i) -> [Self; 4] {
        let last = last_index(table.len(), 2);
        // SAFETY: as `gather_pairs`.
        unsafe {
            let index = _mm512_min_epu32(index, _mm512_set1_epi32(last));
            let words = _mm512_i32gather_epi32::<2>(index, table.as_ptr().cast());
            let byte = _mm512_set1_epi32(0xff);
            [
                _mm512_and_si512(words, byte),
                _mm512_and_si512(_mm512_srli_epi32::<8>(words), byte),
                _mm512_and_si512(_mm512_srli_epi32::<16>(words), byte),
                _mm512_srli_epi32::<24>(words),
            ]
            .map(|bytes| Self(_mm512_cvtepi32_ps(bytes)))
        }
    }
    #[inline(always)]
    fn gather_squares_u16(table: &[[u16; 2]], index: __m512i) -> [Self; 4] {
        let last = last_index(table.len(), 2);
        // SAFETY: as `gather_pairs`.
        unsafe {
            let index = _mm512_min_epu32(index, _mm512_set1_epi32(last));
            let [low, high] = double_words_avx512::<4>(table.as_ptr().cast(), index);
            let word = _mm512_set1_epi32(0xffff);
            [
                _mm512_and_si512(low, word),
                _mm512_srli_epi32::<16>(low),
                _mm512_and_si512(high, word),
                _mm512_srli_epi32::<16>(high),
            ]
            .map(|words| Self(_mm512_cvtepi32_ps(words)))
        }
    }
    #[inline(always)]
    fn gather_triples(table: &[[u16; 4]], index: __m512i) -> [Self; 3] {
        let last = last_index(table.len(), 1);
        // SAFETY: as `sqrt`; the index is limited to the table.
        unsafe {
            let index = _mm512_min_epu32(index, _mm512_set1_epi32(last));
            let [low, high] = double_words_avx512::<8>(table.as_ptr().cast(), index);
            let word = _mm512_set1_epi32(0xffff);
            [
                _mm512_and_si512(low, word),
                _mm512_srli_epi32::<16>(low),
                _mm512_and_si512(high, word),
            ]
            .map(|words| Self(_mm512_cvtepi32_ps(words)))
        }
    }
}
