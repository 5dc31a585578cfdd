//! A frame on its way: which of its tiles are done.
//!
//! Invariant: no tile is rendered twice.

use std::time::Duration;

use raywright_bvh::Bvh;
use raywright_imaging::{CancelToken, Film};

use super::Hybrid;
use crate::tune::stage::{Clock, SessionError};

/// A frame that is being rendered.
pub(super) struct Frame<'c> {
    /// One sample of each pixel of the tiles that are done; the others are undefined.
    pub(super) film: Film,
    /// The number of its sample.
    pub(super) sample: u32,
    /// Seconds of the tiles that were traced through the tree that is the incumbent in the end.
    pub(super) times: Vec<(usize, f64)>,
    /// Seconds that threads worked, through whatever tree.
    pub(super) work: f64,
    done: Vec<bool>,
    cancel: &'c CancelToken,
}

impl<'c> Frame<'c> {
    /// A frame of which nothing is rendered, whatever there is in the film.
    pub(super) fn new(film: Film, tiles: usize, sample: u32, cancel: &'c CancelToken) -> Self {
        Self {
            film,
            sample,
            times: Vec::with_capacity(tiles),
            work: 0.0,
            done: vec![false; tiles],
            cancel,
        }
    }

    /// Whether all tiles are done.
    pub(super) fn is_done(&self) -> bool {
        self.done.iter().all(|done| *done)
    }
}

impl<C: Clock> Hybrid<'_, C> {
    /// Traces those tiles that are not done and for which there is a tree; what each took, in seconds: 0 where
    /// nothing is ever tried, since that clock may take half a microsecond to read. No tile is begun after
    /// `limit`.
    pub(super) fn trace<'t>(
        &self,
        frame: &mut Frame<'_>,
        limit: Duration,
        tree_of: impl Fn(usize) -> Option<&'t Bvh> + Sync,
    ) -> Result<Vec<(usize, f64)>, SessionError> {
        let done = &frame.done;
        let left = |tile: usize| if done[tile] { None } else { tree_of(tile) };
        let (stage, is_timed) = (&self.stage, !self.is_frozen);
        let busy = || {
            if is_timed {
                stage.busy()
            } else {
                Duration::ZERO
            }
        };
        let (film, sample, cancel) = (&mut frame.film, frame.sample, frame.cancel);
        let times = stage.render_tiles(film, sample, limit, cancel, busy, left)?;
        for &(tile, time) in &times {
            frame.done[tile] = true;
            frame.work += time;
        }
        Ok(times)
    }

    /// Traces all tiles that are not done.
    pub(super) fn trace_rest(&self, frame: &mut Frame<'_>, tree: &Bvh) -> Result<(), SessionError> {
        let times = self.trace(frame, Duration::MAX, |_| Some(tree))?;
        frame.times.extend(times);
        Ok(())
    }
}
