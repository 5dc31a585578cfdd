//! What a build is told and tells while it runs: cancellation, progress, a limit of memory.
//!
//! Invariant: control changes whether a tree is built, never which.

use std::sync::{
    Arc,
    atomic::{AtomicBool, AtomicUsize, Ordering},
};

use super::{BuildWorkspace, LeafReference, primitive::PrimitiveRef, record::Record};
use crate::{
    error::BuildError,
    params::{BuildParams, Dynamics, Quality},
};

/// Ranges of at least so many references ask whether to go on: some hundred microseconds of work.
pub(crate) const CHECK_SIZE: usize = 1024;

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
    /// Most bytes that the workspace may take; a build that needs more does not begin.
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
    pub(crate) fn check(&self) -> Result<(), BuildError> {
        match &self.cancelled {
            Some(cancelled) if cancelled.load(Ordering::Relaxed) => Err(BuildError::Cancelled),
            _ => Ok(()),
        }
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
        self.references.clear();
        Ok(())
    }

    /// Ends a build: frees the memory if the next build is far away.
    pub(crate) fn end(&mut self, params: &BuildParams) {
        if params.dynamics == Dynamics::Static {
            *self = Self {
                control: self.control.clone(),
                ..Self::default()
            };
        }
    }

    /// Bytes that a build over `n` primitives takes in the workspace, at most; the tree itself is
    /// not counted.
    #[must_use]
    pub fn bytes_needed(n: usize, params: &BuildParams) -> usize {
        let capacity = params.reference_capacity(n);
        let record = 2 * size_of::<Record>() + size_of::<LeafReference>();
        let per_reference = match params.quality {
            // Keys and a copy of them to sort.
            Quality::Morton => size_of::<PrimitiveRef>() + record + 2 * size_of::<u64>(),
            Quality::BinnedSah | Quality::SpatialSplits => 2 * size_of::<PrimitiveRef>() + record,
            // A binary tree and what is known of its nodes besides, which is measured in a test.
            Quality::Agglomerative | Quality::Optimized => {
                2 * size_of::<PrimitiveRef>() + record + BINARY_BYTES
            }
        };
        capacity.saturating_mul(per_reference)
    }
}

/// Bytes per reference of a binary tree that is optimised and collapsed, at most.
const BINARY_BYTES: usize = 768;
