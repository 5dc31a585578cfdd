//! Lanes by the crate `wide`: the instruction set that the crate is compiled for.

use wide::{f32x4, f32x8};

use super::Lanes;

macro_rules! lanes_by_wide {
    ($wide:ty, $n:literal) => {
        impl Lanes<$n> for $wide {
            type Mask = $wide;

            #[inline(always)]
            fn splat(value: f32) -> Self {
                <$wide>::splat(value)
            }
            #[inline(always)]
            fn load(array: &[f32; $n]) -> Self {
                <$wide>::new(*array)
            }
            #[inline(always)]
            fn store(self) -> [f32; $n] {
                self.to_array()
            }
            #[inline(always)]
            fn add(self, other: Self) -> Self {
                self + other
            }
            #[inline(always)]
            fn sub(self, other: Self) -> Self {
                self - other
            }
            #[inline(always)]
            fn mul(self, other: Self) -> Self {
                self * other
            }
            #[inline(always)]
            fn div(self, other: Self) -> Self {
                self / other
            }
            #[inline(always)]
            fn mul_add(self, factor: Self, addend: Self) -> Self {
                self * factor + addend
            }
            #[inline(always)]
            fn min(self, other: Self) -> Self {
                self.fast_min(other)
            }
            #[inline(always)]
            fn max(self, other: Self) -> Self {
                self.fast_max(other)
            }
            #[inline(always)]
            fn abs(self) -> Self {
                <$wide>::abs(self)
            }
            #[inline(always)]
            fn xor_sign(self, sign: Self) -> Self {
                self ^ (sign & <$wide>::splat(-0.0))
            }
            #[inline(always)]
            fn le(self, other: Self) -> Self::Mask {
                self.simd_le(other)
            }
            #[inline(always)]
            fn is_nonzero(self) -> Self::Mask {
                self.simd_ne(<$wide>::splat(0.0))
            }
            #[inline(always)]
            fn bits(mask: Self::Mask) -> u32 {
                mask.to_bitmask()
            }
        }
    };
}

lanes_by_wide!(f32x4, 4);
lanes_by_wide!(f32x8, 8);

/// Two lanes in the lower half of four; the upper half repeats the lower.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Pair<L>(pub L);

impl<L: Lanes<4>> Lanes<2> for Pair<L> {
    type Mask = L::Mask;

    #[inline(always)]
    fn splat(value: f32) -> Self {
        Self(L::splat(value))
    }
    #[inline(always)]
    fn load(&[a, b]: &[f32; 2]) -> Self {
        Self(L::load(&[a, b, a, b]))
    }
    #[inline(always)]
    fn store(self) -> [f32; 2] {
        let [a, b, _, _] = self.0.store();
        [a, b]
    }
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        Self(self.0.add(other.0))
    }
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        Self(self.0.sub(other.0))
    }
    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        Self(self.0.mul(other.0))
    }
    #[inline(always)]
    fn div(self, other: Self) -> Self {
        Self(self.0.div(other.0))
    }
    #[inline(always)]
    fn mul_add(self, factor: Self, addend: Self) -> Self {
        Self(self.0.mul_add(factor.0, addend.0))
    }
    #[inline(always)]
    fn min(self, other: Self) -> Self {
        Self(self.0.min(other.0))
    }
    #[inline(always)]
    fn max(self, other: Self) -> Self {
        Self(self.0.max(other.0))
    }
    #[inline(always)]
    fn abs(self) -> Self {
        Self(self.0.abs())
    }
    #[inline(always)]
    fn xor_sign(self, sign: Self) -> Self {
        Self(self.0.xor_sign(sign.0))
    }
    #[inline(always)]
    fn le(self, other: Self) -> Self::Mask {
        self.0.le(other.0)
    }
    #[inline(always)]
    fn is_nonzero(self) -> Self::Mask {
        self.0.is_nonzero()
    }
    #[inline(always)]
    fn bits(mask: Self::Mask) -> u32 {
        L::bits(mask) & 3
    }
}
