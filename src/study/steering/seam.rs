//! What steps that differ between the parts of a frame do to it: its distance from a frame with one step,
//! that of as many samples.

use super::{Stage, StudyError};
use crate::{
    imaging::Difference,
    volume::{CastOptions, Drawn, frames::FrameError, sequence::Moment},
};

/// A frame in parts against one with their mean step.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct Seam {
    /// Peak signal-to-noise ratio over the whole frame, decibels.
    pub decibels: f64,
    /// Root mean square of what the difference of two rows, one on either side of a border between parts,
    /// has too much or too little, relative to 1.
    pub border: f64,
    /// The largest one.
    pub largest: f64,
}

impl Seam {
    /// Of a frame that was drawn in parts; nothing if all had one step.
    pub(super) fn of(
        stage: &Stage<'_>,
        moment: &Moment,
        drawn: &Drawn,
    ) -> Result<Option<Self>, StudyError> {
        if drawn.steps.windows(2).all(|pair| pair[0] == pair[1]) {
            return Ok(None);
        }
        let mut options = CastOptions::default();
        options.step = drawn.quality.step as f32;
        options.pixels_per_ray = drawn.quality.pixels_per_ray;
        options.clip = moment.clip;
        let appearance = moment.appearance();
        let prepared = stage
            .caster
            .prepare_appearance(appearance)
            .map_err(FrameError::from)?;
        let uniform = prepared
            .render(moment.camera, stage.size, &options)
            .map_err(FrameError::from)?;
        let (own, uniform) = (&drawn.picture.image, &uniform.image);
        let width = stage.size[0] as usize;
        let (mut squares, mut count, mut largest) = (0.0, 0.0, 0.0_f64);
        let parts = crate::volume::cast::parts(stage.size[1]);
        for end in parts.iter().flatten().map(|rows| rows.end as usize) {
            if end >= stage.size[1] as usize {
                continue;
            }
            for above in (end - 1) * width..end * width {
                for channel in 0..3 {
                    let jump = |pixels: &[[f32; 3]]| {
                        f64::from(pixels[above + width][channel] - pixels[above][channel])
                    };
                    let error = jump(own.pixels()) - jump(uniform.pixels());
                    squares += error * error;
                    largest = largest.max(error.abs());
                    count += 1.0;
                }
            }
        }
        let difference = Difference::of(own, uniform);
        Ok(difference.map(|difference| Self {
            decibels: difference.psnr(),
            border: if count > 0.0 {
                f64::sqrt(squares / count)
            } else {
                0.0
            },
            largest,
        }))
    }
}
