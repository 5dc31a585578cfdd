//! What a build is told and tells while it runs: cancellation, progress, a limit of memory.
//!
//! Invariant: control changes whether a tree is built, never which.

use std::sync::{
    Arc,
    atomic::{AtomicBool, AtomicUsize, Ordering},
};

use super::{
    BuildWorkspace, LeafReference, primitive::PrimitiveRef, record::Record, recursion::Lists,
};
use crate::{
    error::BuildError,
    layout::spares::Spares,
    params::{BuildParams, Dynamics, Quality},
};

/// Ranges of at least so many references ask whether to go on: some hundred microseconds of work.
const CHECK_SIZE: usize = 1024;

/// Ranges below this are reported as a whole.
const REPORT_SIZE: usize = 4096;

/// Called with the references that are in finished subtrees, and with all of them; from any
/// thread, not always in ascending order.
pub type ProgressFn = dyn Fn(usize, usize) + Send + Sync;

/// Control of the builds in a [`BuildWorkspace`].
#[derive(Clone, Default)]
pub struct BuildControl {
    /// Ends the build with [`BuildError::Cancelled`] soon after it becomes true.
    pub cancelled: Option<Arc<AtomicBool>>,
    /// Hears how far the build is.
    pub progress: Option<Arc<ProgressFn>>,
    /// Most bytes that the workspace may take; a build that needs more by
    /// [`BuildWorkspace::bytes_needed`] does not begin. What earlier builds and recycled trees left
    /// counts too: it is freed where the next build would else pass the limit, so that a limit
    /// without room for a tree has each tree take new memory. Lists of meshes, 4 bytes for each,
    /// come on top, and so does the memory of the trees while they are trees.
    pub memory_limit: Option<usize>,
}

impl std::fmt::Debug for BuildControl {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("BuildControl")
            .field("cancelled", &self.cancelled)
            .field("progress", &self.progress.is_some())
            .field("memory_limit", &self.memory_limit)
            .finish()
    }
}

/// The control of one build.
pub(crate) struct Running<'a> {
    control: &'a BuildControl,
    done: AtomicUsize,
    total: usize,
}

impl<'a> Running<'a> {
    pub(crate) fn new(control: &'a BuildControl, total: usize) -> Self {
        Self {
            control,
            done: AtomicUsize::new(0),
            total,
        }
    }

    /// Asks whether to go on.
    pub(crate) fn check(&self) -> Result<(), BuildError> {
        self.control.check()
    }

    /// Asks whether to go on, if the range is long.
    pub(crate) fn check_range(&self, n: usize) -> Result<(), BuildError> {
        self.control.check_range(n)
    }

    /// Reports a finished range of `n` references within one of `parent`; the counts of cut
    /// primitives may pass the total, which is then reported.
    pub(crate) fn finished(&self, n: usize, parent: usize) {
        if let Some(progress) = &self.control.progress
            && n < REPORT_SIZE
            && parent >= REPORT_SIZE
        {
            let done = self.done.fetch_add(n, Ordering::Relaxed) + n;
            progress(done.min(self.total), self.total);
        }
    }
}

impl BuildControl {
    /// Asks whether to go on, if the range is long.
    pub(crate) fn check_range(&self, n: usize) -> Result<(), BuildError> {
        if n >= CHECK_SIZE {
            self.check()?;
        }
        Ok(())
    }

    pub(crate) fn check(&self) -> Result<(), BuildError> {
        match &self.cancelled {
            Some(cancelled) if cancelled.load(Ordering::Relaxed) => Err(BuildError::Cancelled),
            _ => Ok(()),
        }
    }
}

/// The most bytes that a build of each quality has needed since memory was freed last. No buffer is
/// larger than a build of some quality said, so that the sum is what the buffers are together, at
/// most.
#[derive(Debug, Default)]
pub(crate) struct Announced([usize; Quality::Optimized as usize + 1]);

impl Announced {
    fn begin_build(&mut self, needed: usize, quality: Quality) {
        let most = &mut self.0[quality as usize];
        *most = needed.max(*most);
    }

    fn sum(&self) -> usize {
        self.0
            .iter()
            .fold(0, |sum, &bytes| sum.saturating_add(bytes))
    }
}

impl BuildWorkspace {
    /// Begins a build over `n` primitives: refuses one that is cancelled or needs too much memory,
    /// and forgets the references of the last.
    pub(crate) fn begin(&mut self, n: usize, params: &BuildParams) -> Result<(), BuildError> {
        self.control.check()?;
        let needed = Self::bytes_needed(n, params);
        if let Some(limit) = self.control.memory_limit
            && needed > limit
        {
            return Err(BuildError::MemoryLimit { needed, limit });
        }
        self.announced.begin_build(needed, params.quality);
        self.keep_limit(needed, params.quality);
        self.spares.begin_build();
        self.references.clear();
        Ok(())
    }

    /// Frees what was kept if the limit might not hold otherwise: first that of trees, then all.
    fn keep_limit(&mut self, needed: usize, quality: Quality) {
        let Some(limit) = self.control.memory_limit else {
            return;
        };
        if self.announced.sum() + self.spares.bytes() > limit {
            self.spares = Spares::default();
        }
        if self.announced.sum() > limit {
            self.free();
            self.announced.begin_build(needed, quality);
        }
    }

    /// Keeps the parts of a tree for the next one, if there is to be one and the limit allows.
    pub(crate) fn keep_parts(&mut self, params: &BuildParams, keep: impl FnOnce(&mut Spares)) {
        if params.dynamics == Dynamics::Static {
            return;
        }
        keep(&mut self.spares);
        if let Some(limit) = self.control.memory_limit
            && self.bytes() > limit
        {
            self.spares = Spares::default();
        }
    }

    fn free(&mut self) {
        *self = Self {
            control: self.control.clone(),
            ..Self::default()
        };
    }

    /// Ends a build: frees the memory if the next build is far away.
    pub(crate) fn end(&mut self, params: &BuildParams) {
        if params.dynamics == Dynamics::Static {
            self.free();
        }
    }

    /// Bytes that a build over `n` primitives takes in the workspace, at most, and in the hands of
    /// one thread; further threads take some kilobytes more while they build. The tree itself is not
    /// counted, nor are lists of meshes, 4 bytes for each. Buffers are kept from build to build and
    /// grow to the largest of them: a workspace that serves several qualities holds up to the sum of
    /// what each needs, if no [`BuildControl::memory_limit`] forbids it.
    #[must_use]
    pub fn bytes_needed(n: usize, params: &BuildParams) -> usize {
        let capacity = params.reference_capacity(n);
        let record = 2 * size_of::<Record>() + size_of::<LeafReference>();
        let per_reference = match params.quality {
            // Keys and a copy of them to sort.
            Quality::Morton => size_of::<PrimitiveRef>() + record + 2 * size_of::<u64>(),
            // A binary tree and what is known of its nodes besides, which is measured in a test.
            _ if params.is_collapsed() => 2 * size_of::<PrimitiveRef>() + record + BINARY_BYTES,
            _ => 2 * size_of::<PrimitiveRef>() + record,
        };
        let lists = Lists::bytes_needed(capacity, params);
        capacity.saturating_mul(per_reference).saturating_add(lists)
    }
}

/// Bytes per reference of a binary tree that is optimised or not, and collapsed, at most.
const BINARY_BYTES: usize = 768;
