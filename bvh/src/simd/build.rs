//! Enters the loops of the builders over eight lanes: one function per instruction set, into which
//! the loop is inlined whole.

#[cfg(target_arch = "x86_64")]
use super::avx2;
use super::{Isa, Lanes};

/// Eight lanes whose halves can be exchanged.
pub(crate) trait Halves: Lanes<8> {
    /// The upper four lanes before the lower four.
    fn swap_halves(self) -> Self;
}

impl Halves for wide::f32x8 {
    #[inline(always)]
    fn swap_halves(self) -> Self {
        let [a, b, c, d, e, f, g, h] = self.to_array();
        Self::new([e, f, g, h, a, b, c, d])
    }
}

/// A loop over boxes, generic over lanes. `run` must be `#[inline(always)]`.
pub(crate) trait EightLanes {
    /// What it finds.
    type Output;

    /// Runs it.
    fn run<L: Halves>(self) -> Self::Output;
}

/// Runs a loop by an instruction set that this machine has.
#[inline]
pub(crate) fn run<K: EightLanes>(isa: Isa, kernel: K) -> K::Output {
    match isa {
        Isa::Portable => kernel.run::<wide::f32x8>(),
        #[cfg(target_arch = "x86_64")]
        // SAFETY: builders take their `Isa` from `Isa::best`, which names none that this machine
        // does not have, and every instruction set but the portable one includes AVX2.
        _ => unsafe { run_avx2(kernel) },
        #[cfg(not(target_arch = "x86_64"))]
        _ => kernel.run::<wide::f32x8>(),
    }
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,fma,bmi1,bmi2,popcnt,lzcnt")]
fn run_avx2<K: EightLanes>(kernel: K) -> K::Output {
    kernel.run::<avx2::F32x8>()
}
