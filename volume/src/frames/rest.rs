//! Refinement while nothing moves: the picture is drawn again with half the step, and again, down to the
//! shortest, while the last one stays to be seen.
//!
//! Compositing does not add up, so that finer pictures are made anew. Each is made some rows at a time,
//! so that it can be left at any moment.
//!
//! Invariant: a finished picture is the one that a direct render makes with its step, bit for bit.

use raywright_imaging::Camera;

use crate::{
    cast::{CastError, CastOptions, Picture, PixelsPerRay, Prepared, Work},
    predict::Quality,
};

/// A picture that is being refined.
#[derive(Debug)]
pub(super) struct Rest {
    camera: Camera,
    size: [u32; 2],
    options: CastOptions,
    shortest: f64,
    /// The step of the last finished picture.
    step: f64,
    /// The next one, and how many of its rows there are already.
    next: Option<(Picture, u32)>,
}

impl Rest {
    /// Refinement of a picture of this quality, down to the shortest step with a ray for every pixel.
    pub(super) fn new(
        camera: Camera,
        size: [u32; 2],
        options: CastOptions,
        quality: Quality,
        shortest: f64,
    ) -> Self {
        // A picture with fewer rays has yet to get its full ones.
        let has_all = quality.pixels_per_ray == PixelsPerRay::One;
        Self {
            camera,
            size,
            options: CastOptions {
                pixels_per_ray: PixelsPerRay::One,
                ..options
            },
            shortest,
            step: quality.step * if has_all { 1.0 } else { 2.0 },
            next: None,
        }
    }

    /// Whether there is nothing finer.
    pub(super) fn is_done(&self) -> bool {
        self.step <= self.shortest
    }

    /// Refines until `go_on` says no, asked before each few rows with the work so far, or a picture is
    /// finished: then that is returned, with its step.
    pub(super) fn advance(
        &mut self,
        prepared: &Prepared<'_>,
        go_on: impl FnMut(&Work) -> bool,
    ) -> Result<Option<(Picture, f64)>, CastError> {
        if self.is_done() {
            return Ok(None);
        }
        let step = (self.step * 0.5).max(self.shortest);
        let options = CastOptions {
            step: step as f32,
            ..self.options
        };
        let (mut picture, row) = match self.next.take() {
            Some(next) => next,
            None => (prepared.blank(self.camera, self.size, &options)?, 0),
        };
        let end = prepared.render_rows(self.camera, &options, &mut picture, row, go_on)?;
        if end < self.size[1] {
            self.next = Some((picture, end));
            return Ok(None);
        }
        self.step = step;
        Ok(Some((picture, step)))
    }
}
