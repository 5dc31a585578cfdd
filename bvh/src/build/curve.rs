//! What all builders along a Morton curve share.

use wide::f32x4;

use super::{primitive::Bounds, tasks};

/// The box of the doubled centroids of items.
pub(crate) fn centroid_bounds<T: Sync>(
    items: &[T],
    doubled_centroid: impl Fn(&T) -> f32x4 + Sync,
) -> Bounds {
    tasks::map_merge(
        items,
        &|items: &[T]| {
            let mut bounds = Bounds::EMPTY;
            for item in items {
                bounds.extend_by_point(doubled_centroid(item));
            }
            bounds
        },
        &|mut a: Bounds, b| {
            a.extend(&b);
            a
        },
    )
}

/// Moves bit i of 21 to bit 3i.
pub(crate) fn spread_bits(x: u32) -> u64 {
    let x = u64::from(x);
    let x = (x | x << 32) & 0x001f_0000_0000_ffff;
    let x = (x | x << 16) & 0x001f_0000_ff00_00ff;
    let x = (x | x << 8) & 0x100f_00f0_0f00_f00f;
    let x = (x | x << 4) & 0x10c3_0c30_c30c_30c3;
    (x | x << 2) & 0x1249_2492_4924_9249
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bits_are_spread_by_three() {
        for x in (0..1 << 21).step_by(97) {
            let expected = (0..21).map(|bit| u64::from(x >> bit & 1) << (3 * bit));
            assert_eq!(spread_bits(x), expected.sum::<u64>());
        }
    }
}
