//! Lanes that fetch from tables: what a volume raycaster needs beyond [`Lanes`].
//!
//! The types of the lanes cannot be named outside this crate, so that they exist only inside
//! [`LaneKernel::run`] after [`run`] has found the instruction set. That is what makes their
//! operations safe functions. Tables are read inside their bounds whatever the index: it is limited
//! first, which costs one instruction beside some twenty of a gather.
//!
//! Invariant: as in [`super`], every operation gives the same bits in every implementation, for
//! finite operands in the range of `i32` where integers come from them.

use wide::{f32x8, i32x8};

use super::{Isa, Lanes};

/// Lanes that can index tables.
pub trait GatherLanes<const N: usize>: Lanes<N> {
    /// `N` lanes of `i32`.
    type Int: Copy;

    /// The square root, correctly rounded.
    fn sqrt(self) -> Self;
    /// The largest integer that is not larger.
    fn floor(self) -> Self;
    /// `yes` where the mask is set, else `no`.
    fn select(mask: Self::Mask, yes: Self, no: Self) -> Self;
    /// Where `self < other`.
    fn lt(self, other: Self) -> Self::Mask;
    /// The integer part.
    fn truncate(self) -> Self::Int;
    /// The nearest integer, of two the even one.
    fn round(self) -> Self::Int;
    /// The nearest float.
    fn from_int(value: Self::Int) -> Self;
    /// The same integer in every lane.
    fn splat_int(value: i32) -> Self::Int;
    /// Wrapping sum.
    fn add_int(a: Self::Int, b: Self::Int) -> Self::Int;
    /// Wrapping product.
    fn mul_int(a: Self::Int, b: Self::Int) -> Self::Int;
    /// The smaller.
    fn min_int(a: Self::Int, b: Self::Int) -> Self::Int;
    /// Shifted right by `bits` < 32, the sign repeated.
    fn shift_int(a: Self::Int, bits: u32) -> Self::Int;

    /// `table[index]` where the mask is set, else 0.
    fn gather(table: &[f32], index: Self::Int, mask: Self::Mask) -> Self;
    /// `table[index]`; the last three bytes of a table cannot be asked for.
    fn gather_bytes(table: &[u8], index: Self::Int) -> Self::Int;
    /// `table[index]` and `table[index + 1]`; the last three bytes cannot be asked for.
    fn gather_pairs_u8(table: &[u8], index: Self::Int) -> [Self; 2];
    /// `table[index]` and `table[index + 1]`.
    fn gather_pairs_u16(table: &[u16], index: Self::Int) -> [Self; 2];
    /// `table[index]` and `table[index + 1]`.
    fn gather_pairs_f32(table: &[f32], index: Self::Int) -> [Self; 2];
}

/// A loop over lanes of any number. `run` must be `#[inline(always)]`, and so must all it calls
/// with lanes.
pub trait LaneKernel {
    /// What it gives.
    type Output;

    /// Runs it.
    fn run<const N: usize, L: GatherLanes<N>>(self) -> Self::Output;
}

/// Runs a loop by an instruction set.
///
/// # Panics
/// If this machine does not have it.
pub fn run<K: LaneKernel>(isa: Isa, kernel: K) -> K::Output {
    assert!(isa.is_available(), "this machine does not have {isa}");
    match isa {
        #[cfg(target_arch = "x86_64")]
        // SAFETY: the instruction set is available.
        Isa::Avx2 => unsafe { x86::run_avx2(kernel) },
        #[cfg(target_arch = "x86_64")]
        // SAFETY: as above.
        Isa::Avx512 => unsafe { x86::run_avx512(kernel) },
        _ => kernel.run::<8, f32x8>(),
    }
}

/// The largest index of a table of `len` items from which `read` can be read.
#[inline(always)]
fn last_index(len: usize, read: usize) -> i32 {
    assert!(
        (read..=i32::MAX as usize).contains(&len),
        "a table of {len} items cannot be read {read} at a time"
    );
    (len - read) as i32
}

impl GatherLanes<8> for f32x8 {
    type Int = i32x8;

    #[inline(always)]
    fn sqrt(self) -> Self {
        f32x8::sqrt(self)
    }
    #[inline(always)]
    fn floor(self) -> Self {
        f32x8::floor(self)
    }
    #[inline(always)]
    fn select(mask: Self, yes: Self, no: Self) -> Self {
        mask.bitselect(yes, no)
    }
    #[inline(always)]
    fn lt(self, other: Self) -> Self {
        self.simd_lt(other)
    }
    #[inline(always)]
    fn truncate(self) -> i32x8 {
        self.fast_trunc_int()
    }
    #[inline(always)]
    fn round(self) -> i32x8 {
        self.fast_round_int()
    }
    #[inline(always)]
    fn from_int(value: i32x8) -> Self {
        f32x8::from_i32x8(value)
    }
    #[inline(always)]
    fn splat_int(value: i32) -> i32x8 {
        i32x8::splat(value)
    }
    #[inline(always)]
    fn add_int(a: i32x8, b: i32x8) -> i32x8 {
        a + b
    }
    #[inline(always)]
    fn mul_int(a: i32x8, b: i32x8) -> i32x8 {
        a * b
    }
    #[inline(always)]
    fn min_int(a: i32x8, b: i32x8) -> i32x8 {
        a.min(b)
    }
    #[inline(always)]
    fn shift_int(a: i32x8, bits: u32) -> i32x8 {
        a >> bits
    }
    #[inline(always)]
    fn gather(table: &[f32], index: i32x8, mask: Self) -> Self {
        let last = last_index(table.len(), 1);
        let index = index
            .to_array()
            .map(|i| (i as u32).min(last as u32) as usize);
        f32x8::new(index.map(|i| table[i])) & mask
    }
    #[inline(always)]
    fn gather_bytes(table: &[u8], index: i32x8) -> i32x8 {
        let last = last_index(table.len(), 4);
        let index = index
            .to_array()
            .map(|i| (i as u32).min(last as u32) as usize);
        i32x8::new(index.map(|i| table[i].into()))
    }
    #[inline(always)]
    fn gather_pairs_u8(table: &[u8], index: i32x8) -> [Self; 2] {
        let last = last_index(table.len(), 4);
        let index = index
            .to_array()
            .map(|i| (i as u32).min(last as u32) as usize);
        [0, 1].map(|next| f32x8::new(index.map(|i| table[i + next].into())))
    }
    #[inline(always)]
    fn gather_pairs_u16(table: &[u16], index: i32x8) -> [Self; 2] {
        let last = last_index(table.len(), 2);
        let index = index
            .to_array()
            .map(|i| (i as u32).min(last as u32) as usize);
        [0, 1].map(|next| f32x8::new(index.map(|i| table[i + next].into())))
    }
    #[inline(always)]
    fn gather_pairs_f32(table: &[f32], index: i32x8) -> [Self; 2] {
        let last = last_index(table.len(), 2);
        let index = index
            .to_array()
            .map(|i| (i as u32).min(last as u32) as usize);
        [0, 1].map(|next| f32x8::new(index.map(|i| table[i + next])))
    }
}

#[cfg(target_arch = "x86_64")]
mod x86 {
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
        fn gather_pairs_u8(table: &[u8], index: __m256i) -> [Self; 2] {
            let last = last_index(table.len(), 4);
            // SAFETY: as `gather_bytes`.
            unsafe {
                let index = _mm256_min_epu32(index, _mm256_set1_epi32(last));
                let words = _mm256_i32gather_epi32::<1>(table.as_ptr().cast(), index);
                let byte = _mm256_set1_epi32(255);
                let next = _mm256_and_si256(_mm256_srli_epi32::<8>(words), byte);
                [
                    Self(_mm256_cvtepi32_ps(_mm256_and_si256(words, byte))),
                    Self(_mm256_cvtepi32_ps(next)),
                ]
            }
        }
        #[inline(always)]
        fn gather_pairs_u16(table: &[u16], index: __m256i) -> [Self; 2] {
            let last = last_index(table.len(), 2);
            // SAFETY: as `sqrt`; the index is limited so that both items are in the table.
            unsafe {
                let index = _mm256_min_epu32(index, _mm256_set1_epi32(last));
                let words = _mm256_i32gather_epi32::<2>(table.as_ptr().cast(), index);
                let low = _mm256_and_si256(words, _mm256_set1_epi32(0xffff));
                [
                    Self(_mm256_cvtepi32_ps(low)),
                    Self(_mm256_cvtepi32_ps(_mm256_srli_epi32::<16>(words))),
                ]
            }
        }
        #[inline(always)]
        fn gather_pairs_f32(table: &[f32], index: __m256i) -> [Self; 2] {
            let last = last_index(table.len(), 2);
            // SAFETY: as `gather_pairs_u16`.
            unsafe {
                let index = _mm256_min_epu32(index, _mm256_set1_epi32(last));
                [
                    Self(_mm256_i32gather_ps::<4>(table.as_ptr(), index)),
                    Self(_mm256_i32gather_ps::<4>(table.as_ptr().add(1), index)),
                ]
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
        fn gather_pairs_u8(table: &[u8], index: __m512i) -> [Self; 2] {
            let last = last_index(table.len(), 4);
            // SAFETY: as `gather_bytes`.
            unsafe {
                let index = _mm512_min_epu32(index, _mm512_set1_epi32(last));
                let words = _mm512_i32gather_epi32::<1>(index, table.as_ptr().cast());
                let byte = _mm512_set1_epi32(255);
                let next = _mm512_and_si512(_mm512_srli_epi32::<8>(words), byte);
                [
                    Self(_mm512_cvtepi32_ps(_mm512_and_si512(words, byte))),
                    Self(_mm512_cvtepi32_ps(next)),
                ]
            }
        }
        #[inline(always)]
        fn gather_pairs_u16(table: &[u16], index: __m512i) -> [Self; 2] {
            let last = last_index(table.len(), 2);
            // SAFETY: as `sqrt`; the index is limited so that both items are in the table.
            unsafe {
                let index = _mm512_min_epu32(index, _mm512_set1_epi32(last));
                let words = _mm512_i32gather_epi32::<2>(index, table.as_ptr().cast());
                let low = _mm512_and_si512(words, _mm512_set1_epi32(0xffff));
                [
                    Self(_mm512_cvtepi32_ps(low)),
                    Self(_mm512_cvtepi32_ps(_mm512_srli_epi32::<16>(words))),
                ]
            }
        }
        #[inline(always)]
        fn gather_pairs_f32(table: &[f32], index: __m512i) -> [Self; 2] {
            let last = last_index(table.len(), 2);
            // SAFETY: as `gather_pairs_u16`.
            unsafe {
                let index = _mm512_min_epu32(index, _mm512_set1_epi32(last));
                [
                    Self(_mm512_i32gather_ps::<4>(index, table.as_ptr())),
                    Self(_mm512_i32gather_ps::<4>(index, table.as_ptr().add(1))),
                ]
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What the operations give for a few operands, as bits.
    struct Probe {
        x: f32,
        y: f32,
        index: i32,
    }

    impl LaneKernel for Probe {
        type Output = Vec<u32>;

        #[inline(always)]
        fn run<const N: usize, L: GatherLanes<N>>(self) -> Vec<u32> {
            let (x, y) = (L::splat(self.x), L::splat(self.y));
            let index = L::splat_int(self.index);
            let bytes = [9, 8, 7, 6, 5_u8];
            let words = [500, 400, 300_u16];
            let floats = [0.25, 0.5, 0.75_f32];
            let [a, b] = L::gather_pairs_u8(&bytes, index);
            let [c, d] = L::gather_pairs_u16(&words, index);
            let [e, f] = L::gather_pairs_f32(&floats, index);
            let is_less = x.lt(y);
            let sum = L::add_int(x.truncate(), y.round());
            [
                x.abs().sqrt(),
                x.floor(),
                L::select(is_less, x, y),
                L::from_int(sum),
                L::from_int(L::min_int(L::mul_int(sum, index), sum)),
                L::from_int(L::shift_int(sum, 3)),
                L::gather(&floats, index, is_less),
                L::from_int(L::gather_bytes(&bytes, index)),
                a,
                b,
                c,
                d,
                e,
                f,
            ]
            .iter()
            .map(|lanes| lanes.store()[N - 1].to_bits())
            .collect()
        }
    }

    #[test]
    fn every_instruction_set_gives_the_same_bits_inside_the_tables() {
        let numbers = [0.0, -0.0, 0.5, 1.5, -2.5, 7.99, -1e6, 3e8];
        for (x, y) in numbers.iter().flat_map(|x| numbers.map(|y| (*x, y))) {
            // Far outside too: an index is limited before anything is read.
            for index in [0, 1, 2, 5, -1, i32::MAX, i32::MIN] {
                let by = |isa| run(isa, Probe { x, y, index });
                let expected = by(Isa::Portable);
                for isa in Isa::ALL.into_iter().filter(|isa| isa.is_available()) {
                    assert_eq!(by(isa), expected, "{isa}, {x}, {y}, {index}");
                }
            }
        }
    }
}
