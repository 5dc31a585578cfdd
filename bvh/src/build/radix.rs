//! Least significant digit radix sort of 64-bit keys by some of their upper bits: stable, three
//! passes for 30 bits. Serial: the keys of a million primitives are sorted in some ten
//! milliseconds, and the passes wait for memory rather than for arithmetic.

/// Bits per pass: a table of counts that stays in the first cache.
const DIGIT_BITS: u32 = 10;
const DIGITS: usize = 1 << DIGIT_BITS;

/// Sorts `keys` by their bits from `low_bit` up to and without `high_bit`; equal ones keep their
/// order. `scratch` is memory for a copy.
pub(crate) fn sort(keys: &mut [u64], scratch: &mut Vec<u64>, low_bit: u32, high_bit: u32) {
    scratch.resize(keys.len(), 0);
    let (mut from, mut to) = (keys, &mut scratch[..]);
    let mut in_scratch = false;
    let mut shift = low_bit;
    while shift < high_bit {
        let digit = |key: u64| (key >> shift) as usize & (DIGITS - 1);
        let mut places = [0_u32; DIGITS];
        for &key in &*from {
            places[digit(key)] += 1;
        }
        let mut next = 0;
        for place in &mut places {
            next += std::mem::replace(place, next);
        }
        for &key in &*from {
            let place = &mut places[digit(key)];
            to[*place as usize] = key;
            *place += 1;
        }
        std::mem::swap(&mut from, &mut to);
        in_scratch = !in_scratch;
        shift += DIGIT_BITS;
    }
    if in_scratch {
        to.copy_from_slice(from);
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn sorts_by_the_upper_bits_and_keeps_the_order_of_equals(
            high in prop::collection::vec(0..1_u64 << 30, 0..3000),
            few in any::<bool>(),
        ) {
            let high = high.into_iter().map(|h| if few { h % 7 } else { h });
            let mut keys: Vec<u64> = high.zip(0..).map(|(h, i)| h << 32 | i).collect();
            let mut expected = keys.clone();
            expected.sort_by_key(|key| key >> 32);
            sort(&mut keys, &mut Vec::new(), 32, 62);
            prop_assert_eq!(keys, expected);
        }
    }
}
