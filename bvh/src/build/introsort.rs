//! An unstable sort whose order of equal elements is that of the standard library that Embree is
//! compiled with: introspective sort (Musser, *Introspective Sorting and Selection Algorithms*,
//! 1997) with median of three, and insertion sort below 17 elements. Needed only where trees are
//! compared with Embree's to the last bit.

/// Below this an insertion sort finishes.
const SMALL: usize = 16;

/// Sorts by a strict order.
pub(crate) fn sort<T: Copy>(items: &mut [T], less: impl Fn(&T, &T) -> bool) {
    if items.len() < 2 {
        return;
    }
    let limit = 2 * items.len().ilog2();
    coarse(items, limit, &less);
    let (first, rest) = (items.len().min(SMALL), SMALL.min(items.len()));
    for i in 1..first {
        if less(&items[i], &items[0]) {
            items[..=i].rotate_right(1);
        } else {
            sink(items, i, &less);
        }
    }
    for i in rest..items.len() {
        sink(items, i, &less);
    }
}

/// Moves element `i` before all that it is less than, among those in front of it. One that is not
/// greater is known to be there.
fn sink<T: Copy>(items: &mut [T], i: usize, less: &impl Fn(&T, &T) -> bool) {
    let mut at = i;
    while at > 0 && less(&items[i], &items[at - 1]) {
        at -= 1;
    }
    items[at..=i].rotate_right(1);
}

/// Sorts all but the order within stretches of [`SMALL`].
fn coarse<T: Copy>(mut items: &mut [T], mut limit: u32, less: &impl Fn(&T, &T) -> bool) {
    while items.len() > SMALL {
        if limit == 0 {
            // Embree's library sorts by a heap here, in an order of equal elements that nobody has
            // needed yet.
            items.sort_unstable_by(|a, b| less(b, a).cmp(&less(a, b)));
            return;
        }
        limit -= 1;
        let cut = partition(items, less);
        let (left, right) = items.split_at_mut(cut);
        coarse(right, limit, less);
        items = left;
    }
}

/// Partitions around the median of the second, middle and last element; returns the first place
/// of the right side.
fn partition<T: Copy>(items: &mut [T], less: &impl Fn(&T, &T) -> bool) -> usize {
    let (a, m, z) = (1, items.len() / 2, items.len() - 1);
    let below = |i: usize, j: usize| less(&items[i], &items[j]);
    let median = if below(a, m) {
        if below(m, z) {
            m
        } else if below(a, z) {
            z
        } else {
            a
        }
    } else if below(a, z) {
        a
    } else if below(m, z) {
        z
    } else {
        m
    };
    items.swap(0, median);
    let pivot = items[0];
    let (mut i, mut j) = (1, items.len());
    loop {
        while less(&items[i], &pivot) {
            i += 1;
        }
        j -= 1;
        while less(&pivot, &items[j]) {
            j -= 1;
        }
        if i >= j {
            return i;
        }
        items.swap(i, j);
        i += 1;
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn sorts_whatever_the_order_and_the_number_of_equal_elements(
            keys in prop::collection::vec(0..50_u32, 0..400),
        ) {
            let mut items: Vec<(u32, usize)> = keys.iter().copied().zip(0..).collect();
            sort(&mut items, |a, b| a.0 < b.0);
            prop_assert!(items.is_sorted_by_key(|item| item.0));
            items.sort_unstable_by_key(|item| item.1);
            prop_assert_eq!(items.into_iter().map(|item| item.0).collect::<Vec<_>>(), keys);
        }
    }

    #[test]
    fn sorted_reversed_and_constant_runs() {
        for n in [16, 17, 33, 1000] {
            let sorted: Vec<usize> = (0..n).collect();
            for mut items in [sorted.clone(), sorted.iter().rev().copied().collect()] {
                sort(&mut items, |a, b| a < b);
                assert_eq!(items, sorted);
            }
            let mut same = vec![7; n];
            sort(&mut same, |a, b| a < b);
            assert_eq!(same, vec![7; n]);
        }
    }
}
