//! Enters the kernels: one function per instruction set that carries the target features, into
//! which the generic kernel is inlined whole. A helper that were not inlined would be compiled for
//! the baseline and lose its speed without a sound; the benchmark `rays` watches the ratio.

use wide::{f32x4, f32x8};

use super::{
    Isa, PushChildren,
    portable::{Halves, Pair},
};
#[cfg(target_arch = "x86_64")]
use super::{avx2, avx512};
use crate::{
    layout::{block::Block, tree::Tree},
    traverse::{
        kernel::{self, Candidate, Watch},
        setup::{Asked, RaySetup},
        stream::{self, Together, Waiting},
        triangle::TriangleTest,
    },
};

/// The lane types that serve nodes of `N` children under each instruction set.
pub(crate) trait Width<const N: usize> {
    /// Portable lanes.
    type Portable: PushChildren<N>;
    /// AVX2 lanes.
    #[cfg(target_arch = "x86_64")]
    type Avx2: PushChildren<N>;
    /// AVX-512 lanes.
    #[cfg(target_arch = "x86_64")]
    type Avx512: PushChildren<N>;
}

/// Names the widths that have kernels.
#[derive(Debug)]
pub(crate) struct Widths;

impl Width<2> for Widths {
    type Portable = Pair<f32x4>;
    #[cfg(target_arch = "x86_64")]
    type Avx2 = Pair<avx2::F32x4>;
    #[cfg(target_arch = "x86_64")]
    type Avx512 = Pair<avx2::F32x4>;
}

impl Width<4> for Widths {
    type Portable = f32x4;
    #[cfg(target_arch = "x86_64")]
    type Avx2 = avx2::F32x4;
    #[cfg(target_arch = "x86_64")]
    type Avx512 = avx512::F32x4;
}

impl Width<8> for Widths {
    type Portable = f32x8;
    #[cfg(target_arch = "x86_64")]
    type Avx2 = avx2::F32x8;
    #[cfg(target_arch = "x86_64")]
    type Avx512 = avx512::F32x8;
}

impl Width<16> for Widths {
    type Portable = Halves<f32x8>;
    #[cfg(target_arch = "x86_64")]
    type Avx2 = Halves<avx2::F32x8>;
    #[cfg(target_arch = "x86_64")]
    type Avx512 = avx512::F32x16;
}

/// What `tell` makes of the closest hit of a ray with a tree.
#[inline]
pub(crate) fn closest<const N: usize, const W: usize, B: Block, A: TriangleTest<B>, O: Watch, H>(
    isa: Isa,
    tree: &Tree<N, W, B>,
    ray: impl Asked,
    watch: &mut O,
    tell: impl FnOnce(&Candidate, &RaySetup) -> H,
) -> Option<H>
where
    Widths: Width<N>,
{
    match isa {
        #[cfg(target_arch = "x86_64")]
        // SAFETY: a tree holds `Isa::Avx2` only if it was detected (`Bvh::with_isa`).
        Isa::Avx2 => unsafe { closest_avx2::<N, W, B, A, O, H, _, _>(tree, ray, watch, tell) },
        #[cfg(target_arch = "x86_64")]
        // SAFETY: as above, for `Isa::Avx512`.
        Isa::Avx512 => unsafe { closest_avx512::<N, W, B, A, O, H, _, _>(tree, ray, watch, tell) },
        _ => kernel::closest::<N, W, B, A, <Widths as Width<N>>::Portable, f32x4, O, H>(
            tree, ray, watch, tell,
        ),
    }
}

/// Whether a ray hits anything in a tree.
#[inline]
pub(crate) fn any<const N: usize, const W: usize, B: Block, A: TriangleTest<B>, O: Watch>(
    isa: Isa,
    tree: &Tree<N, W, B>,
    ray: impl Asked,
    watch: &mut O,
) -> bool
where
    Widths: Width<N>,
{
    match isa {
        #[cfg(target_arch = "x86_64")]
        // SAFETY: as in `closest`.
        Isa::Avx2 => unsafe { any_avx2::<N, W, B, A, O, _>(tree, ray, watch) },
        #[cfg(target_arch = "x86_64")]
        // SAFETY: as in `closest`.
        Isa::Avx512 => unsafe { any_avx512::<N, W, B, A, O, _>(tree, ray, watch) },
        _ => kernel::any::<N, W, B, A, <Widths as Width<N>>::Portable, f32x4, O>(tree, ray, watch),
    }
}

/// Tells all hits of a ray with a tree, in no certain order.
#[inline]
pub(crate) fn all<const N: usize, const W: usize, B: Block, A: TriangleTest<B>>(
    isa: Isa,
    tree: &Tree<N, W, B>,
    ray: &RaySetup,
    visit: impl FnMut(Candidate),
) where
    Widths: Width<N>,
{
    match isa {
        #[cfg(target_arch = "x86_64")]
        // SAFETY: as in `closest`.
        Isa::Avx2 => unsafe { all_avx2::<N, W, B, A, _>(tree, ray, visit) },
        #[cfg(target_arch = "x86_64")]
        // SAFETY: as in `closest`.
        Isa::Avx512 => unsafe { all_avx512::<N, W, B, A, _>(tree, ray, visit) },
        _ => kernel::all::<N, W, B, A, <Widths as Width<N>>::Portable, f32x4>(tree, ray, visit),
    }
}

/// Visits the primitives that a ray meets, about from the nearest to the farthest.
#[inline]
pub(crate) fn visit<const N: usize, const W: usize, B: Block, A: TriangleTest<B>>(
    isa: Isa,
    tree: &Tree<N, W, B>,
    ray: &RaySetup,
    meet: &mut dyn FnMut(&Candidate) -> f32,
) where
    Widths: Width<N>,
{
    match isa {
        #[cfg(target_arch = "x86_64")]
        // SAFETY: as in `closest`, the tree being that of a `BoxBvh` (`BoxBvh::with_isa`).
        Isa::Avx2 => unsafe { visit_avx2::<N, W, B, A>(tree, ray, meet) },
        #[cfg(target_arch = "x86_64")]
        // SAFETY: as above, for `Isa::Avx512`.
        Isa::Avx512 => unsafe { visit_avx512::<N, W, B, A>(tree, ray, meet) },
        _ => kernel::visit::<N, W, B, A, <Widths as Width<N>>::Portable, f32x4>(tree, ray, meet),
    }
}

/// Traces a batch of rays with a tree, several in flight.
#[inline]
pub(crate) fn stream<
    const ANY: bool,
    const N: usize,
    const W: usize,
    B: Block,
    A: TriangleTest<B>,
>(
    isa: Isa,
    tree: &Tree<N, W, B>,
    batch: Waiting<'_>,
    together: Together,
    tell: impl FnMut(usize, &Candidate, &RaySetup),
) where
    Widths: Width<N>,
{
    match isa {
        #[cfg(target_arch = "x86_64")]
        // SAFETY: as in `closest`.
        Isa::Avx2 => unsafe { stream_avx2::<ANY, N, W, B, A, _>(tree, batch, together, tell) },
        #[cfg(target_arch = "x86_64")]
        // SAFETY: as in `closest`.
        Isa::Avx512 => unsafe { stream_avx512::<ANY, N, W, B, A, _>(tree, batch, together, tell) },
        _ => stream::trace::<
            ANY,
            N,
            W,
            B,
            A,
            <Widths as Width<N>>::Portable,
            f32x4,
            <Widths as Width<16>>::Portable,
        >(tree, batch, together, tell),
    }
}

/// The five entries of an instruction set.
#[cfg(target_arch = "x86_64")]
macro_rules! entries {
    ($closest:ident, $any:ident, $all:ident, $visit:ident, $stream:ident, $lanes:ident, $features:literal) => {
        #[target_feature(enable = $features)]
        fn $stream<
            const ANY: bool,
            const N: usize,
            const W: usize,
            B: Block,
            A: TriangleTest<B>,
            F: FnMut(usize, &Candidate, &RaySetup),
        >(
            tree: &Tree<N, W, B>,
            batch: Waiting<'_>,
            together: Together,
            tell: F,
        ) where
            Widths: Width<N>,
        {
            stream::trace::<
                ANY,
                N,
                W,
                B,
                A,
                <Widths as Width<N>>::$lanes,
                avx2::F32x4,
                <Widths as Width<16>>::$lanes,
            >(tree, batch, together, tell);
        }

        #[target_feature(enable = $features)]
        fn $closest<
            const N: usize,
            const W: usize,
            B: Block,
            A: TriangleTest<B>,
            O: Watch,
            H,
            R: Asked,
            F: FnOnce(&Candidate, &RaySetup) -> H,
        >(
            tree: &Tree<N, W, B>,
            ray: R,
            watch: &mut O,
            tell: F,
        ) -> Option<H>
        where
            Widths: Width<N>,
        {
            kernel::closest::<N, W, B, A, <Widths as Width<N>>::$lanes, avx2::F32x4, O, H>(
                tree, ray, watch, tell,
            )
        }

        #[target_feature(enable = $features)]
        fn $any<const N: usize, const W: usize, B: Block, A: TriangleTest<B>, O: Watch, R: Asked>(
            tree: &Tree<N, W, B>,
            ray: R,
            watch: &mut O,
        ) -> bool
        where
            Widths: Width<N>,
        {
            kernel::any::<N, W, B, A, <Widths as Width<N>>::$lanes, avx2::F32x4, O>(
                tree, ray, watch,
            )
        }

        #[target_feature(enable = $features)]
        fn $all<const N: usize, const W: usize, B: Block, A: TriangleTest<B>, F>(
            tree: &Tree<N, W, B>,
            ray: &RaySetup,
            visit: F,
        ) where
            Widths: Width<N>,
            F: FnMut(Candidate),
        {
            kernel::all::<N, W, B, A, <Widths as Width<N>>::$lanes, avx2::F32x4>(tree, ray, visit);
        }

        #[target_feature(enable = $features)]
        fn $visit<const N: usize, const W: usize, B: Block, A: TriangleTest<B>>(
            tree: &Tree<N, W, B>,
            ray: &RaySetup,
            meet: &mut dyn FnMut(&Candidate) -> f32,
        ) where
            Widths: Width<N>,
        {
            kernel::visit::<N, W, B, A, <Widths as Width<N>>::$lanes, avx2::F32x4>(tree, ray, meet);
        }
    };
}

#[cfg(target_arch = "x86_64")]
entries!(
    closest_avx2,
    any_avx2,
    all_avx2,
    visit_avx2,
    stream_avx2,
    Avx2,
    "avx2,fma,bmi1,bmi2,popcnt,lzcnt"
);

#[cfg(target_arch = "x86_64")]
entries!(
    closest_avx512,
    any_avx512,
    all_avx512,
    visit_avx512,
    stream_avx512,
    Avx512,
    "avx512f,avx512vl,avx512dq,avx2,fma,bmi1,bmi2,popcnt,lzcnt"
);
