//! Lanes that fetch from tables: what a volume raycaster needs beyond [`Lanes`].
//!
//! The types of the lanes cannot be named outside this crate, so that they exist only inside
//! [`LaneKernel::run`] after [`run`] has found the instruction set. That is what makes their
//! operations safe functions. Tables are read inside their bounds whatever the index: it is limited
//! first, which costs one instruction beside some twenty of a gather.
//!
//! Invariant: as in [`super`], every operation gives the same bits in every implementation, for
//! finite operands in the range of `i32` where integers come from them.

mod portable;
#[cfg(target_arch = "x86_64")]
mod x86;

use wide::f32x8;

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
    /// `table[index]` and `table[index + 1]`.
    fn gather_pairs(table: &[f32], index: Self::Int) -> [Self; 2];
    /// The numbers of `table[index]`, then those of `table[index + 1]`.
    fn gather_squares_u8(table: &[[u8; 2]], index: Self::Int) -> [Self; 4];
    /// The numbers of `table[index]`, then those of `table[index + 1]`.
    fn gather_squares_u16(table: &[[u16; 2]], index: Self::Int) -> [Self; 4];
    /// The first three numbers of `table[index]`.
    fn gather_triples(table: &[[u16; 4]], index: Self::Int) -> [Self; 3];
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
            let floats = [0.25, 0.5, 0.75_f32];
            let byte_pairs = [[1, 2], [3, 4], [5, 255_u8]];
            let word_pairs = [[100, 200], [300, 400], [500, 65535_u16]];
            let triples = [[1, 2, 3, 4], [65535, 6, 65534, 8_u16]];
            let [a, b] = L::gather_pairs(&floats, index);
            let [c, d, e, f] = L::gather_squares_u8(&byte_pairs, index);
            let [g, h, i, j] = L::gather_squares_u16(&word_pairs, index);
            let [k, l, m] = L::gather_triples(&triples, index);
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
                g,
                h,
                i,
                j,
                k,
                l,
                m,
            ]
            .iter()
            .flat_map(|lanes| [lanes.store()[0], lanes.store()[N - 1]].map(f32::to_bits))
            .collect()
        }
    }

    #[test]
    fn every_instruction_set_gives_the_same_bits_inside_the_tables() {
        let numbers = [0.0, -0.0, 0.5, 1.5, -2.5, 7.99, -1e6, 3e8];
        let pairs = numbers.iter().flat_map(|x| numbers.map(|y| (*x, y)));
        for (x, y) in pairs.step_by(if cfg!(miri) { 13 } else { 1 }) {
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

    /// Where `index` is asked for in every second lane, and the place before it in the others.
    struct Places {
        index: i32,
    }

    impl LaneKernel for Places {
        type Output = Vec<f32>;

        #[inline(always)]
        fn run<const N: usize, L: GatherLanes<N>>(self) -> Vec<f32> {
            let mut lanes = [0.0; N];
            for (lane, place) in lanes.iter_mut().enumerate() {
                *place = (self.index - (lane as i32 & 1)) as f32;
            }
            let index = L::load(&lanes).truncate();
            let byte_pairs: Vec<[u8; 2]> = (0..20).map(|i| [i, 100 + i]).collect();
            let word_pairs: Vec<[u16; 2]> = (0..20).map(|i| [i, 1000 + i]).collect();
            let triples: Vec<[u16; 4]> = (0..20).map(|i| [i, 100 + i, 200 + i, 7]).collect();
            let floats: Vec<f32> = (0..20_u8).map(f32::from).collect();
            let mut all = L::gather_squares_u8(&byte_pairs, index).to_vec();
            all.extend(L::gather_squares_u16(&word_pairs, index));
            all.extend(L::gather_triples(&triples, index));
            all.extend(L::gather_pairs(&floats, index));
            all.iter()
                .flat_map(|lanes| lanes.store()[..2].to_vec())
                .collect()
        }
    }

    #[test]
    fn what_is_fetched_is_what_lies_there() {
        for isa in Isa::ALL.into_iter().filter(|isa| isa.is_available()) {
            let found = run(isa, Places { index: 7 });
            let numbers = |of: fn(f32) -> f32| [of(7.0), of(6.0)];
            let expected = [
                numbers(|i| i),
                numbers(|i| 100.0 + i),
                numbers(|i| 1.0 + i),
                numbers(|i| 101.0 + i),
                numbers(|i| i),
                numbers(|i| 1000.0 + i),
                numbers(|i| 1.0 + i),
                numbers(|i| 1001.0 + i),
                numbers(|i| i),
                numbers(|i| 100.0 + i),
                numbers(|i| 200.0 + i),
                numbers(|i| i),
                numbers(|i| 1.0 + i),
            ];
            assert_eq!(found, expected.concat(), "{isa}");
        }
    }
}
