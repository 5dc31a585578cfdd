//! Lanes that fetch, by the crate `wide`: one lane after the other.

use wide::{f32x8, i32x8};

use super::{GatherLanes, last_index};

/// The items at places, the index limited to those from which `READ` items can be read.
#[inline(always)]
fn items<T: Copy, U, const READ: usize>(
    table: &[T],
    index: i32x8,
    of: impl Fn([T; READ]) -> U,
) -> [U; 8] {
    let last = last_index(table.len(), READ) as u32;
    index.to_array().map(|i| {
        let first = (i as u32).min(last) as usize;
        // SAFETY: the index is limited to the table.
        of(unsafe { *table.as_ptr().add(first).cast::<[T; READ]>() })
    })
}

/// The low and the high halves of words, as numbers.
#[inline(always)]
fn halves(words: i32x8) -> [f32x8; 2] {
    let low = words & i32x8::splat(0xffff);
    // The sign is shifted in.
    let high = (words >> 16) & i32x8::splat(0xffff);
    [low, high].map(f32x8::from_i32x8)
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
        f32x8::new(items(table, index, |[item]| item)) & mask
    }
    #[inline(always)]
    fn gather_bytes(table: &[u8], index: i32x8) -> i32x8 {
        i32x8::new(items(table, index, |[item, _, _, _]| item.into()))
    }
    #[inline(always)]
    fn gather_pairs(table: &[f32], index: i32x8) -> [Self; 2] {
        let pairs = items(table, index, |pair: [f32; 2]| pair);
        [0, 1].map(|i| f32x8::new(pairs.map(|pair| pair[i])))
    }
    #[inline(always)]
    fn gather_squares_u8(table: &[[u8; 2]], index: i32x8) -> [Self; 4] {
        let of = |[[a, b], [c, d]]: [[u8; 2]; 2]| i32::from_le_bytes([a, b, c, d]);
        let words = i32x8::new(items(table, index, of));
        let byte = i32x8::splat(0xff);
        let bytes = [words, words >> 8, words >> 16, words >> 24];
        bytes.map(|bytes| f32x8::from_i32x8(bytes & byte))
    }
    #[inline(always)]
    fn gather_squares_u16(table: &[[u16; 2]], index: i32x8) -> [Self; 4] {
        let of = |pairs: [[u16; 2]; 2]| pairs.map(|[a, b]| i32::from(a) | i32::from(b) << 16);
        let pairs = items(table, index, of);
        let [a, b] = halves(i32x8::new(pairs.map(|pair| pair[0])));
        let [c, d] = halves(i32x8::new(pairs.map(|pair| pair[1])));
        [a, b, c, d]
    }
    #[inline(always)]
    fn gather_triples(table: &[[u16; 4]], index: i32x8) -> [Self; 3] {
        let of = |[[a, b, c, _]]: [[u16; 4]; 1]| [i32::from(a) | i32::from(b) << 16, c.into()];
        let triples = items(table, index, of);
        let [a, b] = halves(i32x8::new(triples.map(|triple| triple[0])));
        let c = i32x8::new(triples.map(|triple| triple[1]));
        [a, b, f32x8::from_i32x8(c)]
    }
}
