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
            heap_sort(items, less);
            return;
        }
        limit -= 1;
        let cut = partition(items, less);
        let (left, right) = items.split_at_mut(cut);
        coarse(right, limit, less);
        items = left;
    }
}

/// Sorts by a heap with the greatest element on top (Williams, *Algorithm 232: Heapsort*, 1964).
/// One in a thousand Morton builds over real scenes comes here.
fn heap_sort<T: Copy>(items: &mut [T], less: &impl Fn(&T, &T) -> bool) {
    for top in (0..items.len() / 2).rev() {
        settle(items, top, items[top], less);
    }
    for last in (1..items.len()).rev() {
        let value = items[last];
        items[last] = items[0];
        settle(&mut items[..last], 0, value, less);
    }
}

/// Puts `value` into the heap below the free place `top`: the greater child moves up all the way
/// (of equal ones the second), then the value climbs to where it belongs.
fn settle<T: Copy>(heap: &mut [T], top: usize, value: T, less: &impl Fn(&T, &T) -> bool) {
    let mut free = top;
    while 2 * free + 1 < heap.len() {
        let (first, second) = (2 * free + 1, 2 * free + 2);
        let greater = if second < heap.len() && !less(&heap[second], &heap[first]) {
            second
        } else {
            first
        };
        heap[free] = heap[greater];
        free = greater;
    }
    while free > top && less(&heap[(free - 1) / 2], &value) {
        heap[free] = heap[(free - 1) / 2];
        free = (free - 1) / 2;
    }
    heap[free] = value;
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

    /// Keys on which the median of three always fails (McIlroy, *A Killer Adversary for
    /// Quicksort*, 1999), the greatest made equal; the order is that of `std::sort` of GCC's
    /// library.
    #[test]
    fn equal_elements_keep_the_order_of_the_library_when_a_heap_sorts_them() {
        const KEYS: [u32; 40] = [
            24, 1, 24, 3, 24, 5, 24, 7, 24, 9, 24, 11, 24, 13, 24, 15, 24, 17, 20, 19, 0, 2, 4, 6,
            8, 10, 12, 14, 16, 18, 24, 24, 24, 24, 24, 23, 24, 21, 22, 24,
        ];
        const ORDER: [usize; 40] = [
            20, 1, 21, 3, 22, 5, 23, 7, 24, 9, 25, 11, 26, 13, 27, 15, 28, 17, 29, 19, 18, 37, 38,
            35, 6, 36, 16, 39, 2, 8, 30, 31, 14, 10, 32, 33, 0, 4, 12, 34,
        ];
        let mut items: Vec<(u32, usize)> = KEYS.into_iter().zip(0..).collect();
        sort(&mut items, |a, b| a.0 < b.0);
        let order: Vec<usize> = items.iter().map(|item| item.1).collect();
        assert_eq!(order, ORDER);
    }
}
