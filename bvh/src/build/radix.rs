//! Least significant digit radix sort by some bits of a key: stable, three passes for 30 bits.
//! Serial: the keys of a million primitives are sorted in some ten milliseconds, and the passes
//! wait for memory rather than for arithmetic.

use super::{control::BuildControl, tasks::PIECE_SIZE};
use crate::error::BuildError;

/// Bits per pass: a table of counts that stays in the first cache.
const DIGIT_BITS: u32 = 11;
const DIGITS: usize = 1 << DIGIT_BITS;

/// Sorts `items` by the bits of their keys from `low_bit` up to and without `high_bit`, above which
/// there are none; equal ones keep their order. `scratch` is memory for a copy. After a failure the
/// items are in no order, and some are lost.
pub(crate) fn sort<T: Copy + Default>(
    items: &mut [T],
    scratch: &mut Vec<T>,
    low_bit: u32,
    high_bit: u32,
    key: impl Fn(&T) -> u64,
    control: &BuildControl,
) -> Result<(), BuildError> {
    scratch.resize(items.len(), T::default());
    let (mut from, mut to) = (items, &mut scratch[..]);
    let mut in_scratch = false;
    let mut shift = low_bit;
    while shift < high_bit {
        let digit = |item: &T| (key(item) >> shift) as usize & (DIGITS - 1);
        let mut places = [0_u32; DIGITS];
        for piece in from.chunks(PIECE_SIZE) {
            control.check()?;
            for item in piece {
                places[digit(item)] += 1;
            }
        }
        let mut next = 0;
        for place in &mut places {
            next += std::mem::replace(place, next);
        }
        for piece in from.chunks(PIECE_SIZE) {
            control.check()?;
            for item in piece {
                let place = &mut places[digit(item)];
                to[*place as usize] = *item;
                *place += 1;
            }
        }
        std::mem::swap(&mut from, &mut to);
        in_scratch = !in_scratch;
        shift += DIGIT_BITS;
    }
    if in_scratch {
        to.copy_from_slice(from);
    }
    Ok(())
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
            let control = BuildControl::default();
            let sorted = sort(&mut keys, &mut Vec::new(), 32, 62, |key| *key, &control);
            prop_assert!(sorted.is_ok());
            prop_assert_eq!(keys, expected);
        }
    }
}
