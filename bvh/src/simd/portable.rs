//! Lanes by the crate `wide`: the instruction set that the crate is compiled for.

use wide::{f32x4, f32x8};

use super::{Lanes, PushChildren, stack::Stack};

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

        impl PushChildren<$n> for $wide {}
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

impl<L: Lanes<4>> PushChildren<2> for Pair<L> {}

/// Sixteen lanes in two halves.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Halves<L>(pub L, pub L);

/// Eight lanes that can be half of sixteen.
pub(crate) trait Half: PushChildren<8> {
    /// [`Lanes::push_children`] of both halves.
    #[inline(always)]
    fn push_children_of_both<const ANY: bool>(
        both: Halves<Self>,
        entered: MaskHalves<Self::Mask>,
        children: &[u32; 16],
        order: u64,
        stack: &mut Stack<'_, 16, ANY>,
    ) -> u32 {
        let (mask, distances) = (Halves::<Self>::bits(entered), both.store());
        for k in 0..16 {
            let slot = if ANY {
                k
            } else {
                (order >> (4 * k)) as usize & 15
            };
            stack.push_if((mask >> slot) & 1, children[slot], distances[slot]);
        }
        stack.peek().unwrap_or(0)
    }
}

impl Half for f32x8 {}

/// A comparison of sixteen lanes in two halves.
#[derive(Clone, Copy, Debug)]
pub(crate) struct MaskHalves<M>(pub M, pub M);

impl<M: std::ops::BitAnd<Output = M>> std::ops::BitAnd for MaskHalves<M> {
    type Output = Self;
    #[inline(always)]
    fn bitand(self, other: Self) -> Self {
        Self(self.0 & other.0, self.1 & other.1)
    }
}

impl<L: Half> Lanes<16> for Halves<L> {
    type Mask = MaskHalves<L::Mask>;

    #[inline(always)]
    fn splat(value: f32) -> Self {
        Self(L::splat(value), L::splat(value))
    }
    #[inline(always)]
    fn load(array: &[f32; 16]) -> Self {
        let (halves, _) = array.as_chunks();
        Self(L::load(&halves[0]), L::load(&halves[1]))
    }
    #[inline(always)]
    fn store(self) -> [f32; 16] {
        let (low, high) = (self.0.store(), self.1.store());
        std::array::from_fn(|i| if i < 8 { low[i] } else { high[i - 8] })
    }
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        Self(self.0.add(other.0), self.1.add(other.1))
    }
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        Self(self.0.sub(other.0), self.1.sub(other.1))
    }
    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        Self(self.0.mul(other.0), self.1.mul(other.1))
    }
    #[inline(always)]
    fn div(self, other: Self) -> Self {
        Self(self.0.div(other.0), self.1.div(other.1))
    }
    #[inline(always)]
    fn mul_add(self, factor: Self, addend: Self) -> Self {
        Self(
            self.0.mul_add(factor.0, addend.0),
            self.1.mul_add(factor.1, addend.1),
        )
    }
    #[inline(always)]
    fn min(self, other: Self) -> Self {
        Self(self.0.min(other.0), self.1.min(other.1))
    }
    #[inline(always)]
    fn max(self, other: Self) -> Self {
        Self(self.0.max(other.0), self.1.max(other.1))
    }
    #[inline(always)]
    fn abs(self) -> Self {
        Self(self.0.abs(), self.1.abs())
    }
    #[inline(always)]
    fn xor_sign(self, sign: Self) -> Self {
        Self(self.0.xor_sign(sign.0), self.1.xor_sign(sign.1))
    }
    #[inline(always)]
    fn le(self, other: Self) -> Self::Mask {
        MaskHalves(self.0.le(other.0), self.1.le(other.1))
    }
    #[inline(always)]
    fn is_nonzero(self) -> Self::Mask {
        MaskHalves(self.0.is_nonzero(), self.1.is_nonzero())
    }
    #[inline(always)]
    fn bits(mask: Self::Mask) -> u32 {
        L::bits(mask.0) | L::bits(mask.1) << 8
    }
}

impl<L: Half> PushChildren<16> for Halves<L> {
    #[inline(always)]
    fn push_children<const ANY: bool>(
        self,
        entered: Self::Mask,
        children: &[u32; 16],
        order: u64,
        stack: &mut Stack<'_, 16, ANY>,
    ) -> u32 {
        L::push_children_of_both(self, entered, children, order, stack)
    }
}
