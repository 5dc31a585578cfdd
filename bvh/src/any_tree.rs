//! A tree of any width and leaf format, and the triangle test that goes with it: the one place
//! where parameters become types.

use crate::{
    error::BuildError,
    layout::{
        emit::Source,
        node::Node,
        spares::{Part, Spares},
        tree::Tree,
        triangles::{CornerBlock, EdgeBlock, IndexBlock, Triangles},
    },
    params::{Accuracy, BuildParams, LeafFormat},
    simd::{
        Isa,
        dispatch::{self, Width, Widths},
    },
    stats::{TreeStats, sah_cost},
    traverse::{
        fast::Fast,
        kernel::{Candidate, Watch},
        robust::Robust,
        setup::{Asked, RaySetup},
        stream::{Together, Waiting},
    },
};

/// A tree whose nodes are as wide in memory as the smallest width that holds its children.
#[derive(Clone, Debug)]
pub(crate) enum AnyTree {
    Two(Formatted<2, 2>),
    Four(Formatted<4, 2>),
    Eight(Formatted<8, 8>),
    Sixteen(Formatted<16, 16>),
}

/// A tree whose leaves are in the format of its triangle test.
#[derive(Clone, Debug)]
pub(crate) enum Formatted<const N: usize, const W: usize> {
    Fast(Tree<N, W, EdgeBlock>),
    Robust(Tree<N, W, CornerBlock>),
    CompactFast(Tree<N, W, IndexBlock>),
    CompactRobust(Tree<N, W, IndexBlock>),
}

/// Evaluates an expression for the tree of any width.
macro_rules! for_width {
    ($any:expr, $tree:ident => $result:expr) => {
        match $any {
            Self::Two($tree) => $result,
            Self::Four($tree) => $result,
            Self::Eight($tree) => $result,
            Self::Sixteen($tree) => $result,
        }
    };
}
pub(crate) use for_width;

impl AnyTree {
    /// The tree of a build, in spare memory where there is some.
    pub(crate) fn new(
        source: &Source<'_, Triangles<'_>>,
        params: &BuildParams,
        spares: &mut Spares,
    ) -> Result<Self, BuildError> {
        Ok(match params.branching_factor {
            ..=2 => Self::Two(Formatted::new(source, params, spares)?),
            3..=4 => Self::Four(Formatted::new(source, params, spares)?),
            5..=8 => Self::Eight(Formatted::new(source, params, spares)?),
            _ => Self::Sixteen(Formatted::new(source, params, spares)?),
        })
    }

    /// Gives up the tree for its memory.
    pub(crate) fn recycle(self, spares: &mut Spares) {
        for_width!(self, tree => tree.recycle(spares));
    }

    pub(crate) fn stats(&self, params: &BuildParams) -> TreeStats {
        for_width!(self, tree => tree.stats(params))
    }

    pub(crate) fn sah_cost(&self, params: &BuildParams) -> f64 {
        for_width!(self, tree => tree.sah_cost(params))
    }

    /// Moves the tree to other vertices of the same triangles.
    pub(crate) fn refit(&mut self, triangles: &Triangles<'_>) {
        for_width!(self, tree => tree.refit(triangles));
    }

    #[inline]
    pub(crate) fn closest<O: Watch, H>(
        &self,
        isa: Isa,
        ray: impl Asked,
        watch: &mut O,
        tell: impl FnOnce(&Candidate, &RaySetup) -> H,
    ) -> Option<H> {
        for_width!(self, tree => tree.closest(isa, ray, watch, tell))
    }

    #[inline]
    pub(crate) fn any<O: Watch>(&self, isa: Isa, ray: impl Asked, watch: &mut O) -> bool {
        for_width!(self, tree => tree.any(isa, ray, watch))
    }

    #[inline]
    pub(crate) fn stream<const ANY: bool>(
        &self,
        isa: Isa,
        batch: Waiting<'_>,
        together: Together,
        tell: impl FnMut(usize, &Candidate, &RaySetup),
    ) {
        for_width!(self, tree => tree.stream::<ANY>(isa, batch, together, tell))
    }
}

impl<const N: usize, const W: usize> Formatted<N, W>
where
    Widths: Width<N>,
    Node<N, W>: Part,
{
    fn new(
        source: &Source<'_, Triangles<'_>>,
        params: &BuildParams,
        spares: &mut Spares,
    ) -> Result<Self, BuildError> {
        Ok(match (params.leaf_format, params.accuracy) {
            (LeafFormat::Edges, Accuracy::Fast) => Self::Fast(source.emit(spares)?),
            (LeafFormat::Edges, Accuracy::Robust) => Self::Robust(source.emit(spares)?),
            (LeafFormat::Compact, Accuracy::Fast) => Self::CompactFast(source.emit(spares)?),
            (LeafFormat::Compact, Accuracy::Robust) => Self::CompactRobust(source.emit(spares)?),
        })
    }

    fn recycle(self, spares: &mut Spares) {
        match self {
            Self::Fast(tree) => tree.recycle(spares),
            Self::Robust(tree) => tree.recycle(spares),
            Self::CompactFast(tree) | Self::CompactRobust(tree) => tree.recycle(spares),
        }
    }

    fn stats(&self, params: &BuildParams) -> TreeStats {
        match self {
            Self::Fast(tree) => TreeStats::of(tree, params),
            Self::Robust(tree) => TreeStats::of(tree, params),
            Self::CompactFast(tree) | Self::CompactRobust(tree) => TreeStats::of(tree, params),
        }
    }

    fn sah_cost(&self, params: &BuildParams) -> f64 {
        match self {
            Self::Fast(tree) => sah_cost(tree, params),
            Self::Robust(tree) => sah_cost(tree, params),
            Self::CompactFast(tree) | Self::CompactRobust(tree) => sah_cost(tree, params),
        }
    }

    fn refit(&mut self, triangles: &Triangles<'_>) {
        match self {
            Self::Fast(tree) => tree.refit(triangles),
            Self::Robust(tree) => tree.refit(triangles),
            Self::CompactFast(tree) | Self::CompactRobust(tree) => tree.refit(triangles),
        }
    }

    #[inline]
    fn closest<O: Watch, H>(
        &self,
        isa: Isa,
        ray: impl Asked,
        watch: &mut O,
        tell: impl FnOnce(&Candidate, &RaySetup) -> H,
    ) -> Option<H> {
        use dispatch::closest;
        match self {
            Self::Fast(tree) => closest::<N, W, _, Fast, O, H>(isa, tree, ray, watch, tell),
            Self::Robust(tree) => closest::<N, W, _, Robust, O, H>(isa, tree, ray, watch, tell),
            Self::CompactFast(tree) => closest::<N, W, _, Fast, O, H>(isa, tree, ray, watch, tell),
            Self::CompactRobust(tree) => {
                closest::<N, W, _, Robust, O, H>(isa, tree, ray, watch, tell)
            }
        }
    }

    #[inline]
    fn any<O: Watch>(&self, isa: Isa, ray: impl Asked, watch: &mut O) -> bool {
        use dispatch::any;
        match self {
            Self::Fast(tree) => any::<N, W, _, Fast, O>(isa, tree, ray, watch),
            Self::Robust(tree) => any::<N, W, _, Robust, O>(isa, tree, ray, watch),
            Self::CompactFast(tree) => any::<N, W, _, Fast, O>(isa, tree, ray, watch),
            Self::CompactRobust(tree) => any::<N, W, _, Robust, O>(isa, tree, ray, watch),
        }
    }

    #[inline]
    fn stream<const ANY: bool>(
        &self,
        isa: Isa,
        batch: Waiting<'_>,
        together: Together,
        tell: impl FnMut(usize, &Candidate, &RaySetup),
    ) {
        use dispatch::stream;
        match self {
            Self::Fast(tree) => stream::<ANY, N, W, _, Fast>(isa, tree, batch, together, tell),
            Self::Robust(tree) => stream::<ANY, N, W, _, Robust>(isa, tree, batch, together, tell),
            Self::CompactFast(tree) => {
                stream::<ANY, N, W, _, Fast>(isa, tree, batch, together, tell);
            }
            Self::CompactRobust(tree) => {
                stream::<ANY, N, W, _, Robust>(isa, tree, batch, together, tell);
            }
        }
    }
}
