//! Sequences: what is to be seen at each moment of a recording, so that frame times can be compared.
//!
//! ```json
//! { "format": "raywright-sequence-1", "volume": "stent.nrrd", "duration_s": 30, "fps": 30,
//!   "viewport": [1024, 1024],
//!   "camera": [{ "t": 0, "position": [9, 9, 9], "focal": [0, 0, 0], "up": [0, 0, 1], "vfov_deg": 30 }],
//!   "tf": [{ "t": 0, "points": [[0, 0, 0, 0, 0], [255, 1, 1, 1, 0.8]], "blend_s": 0 }],
//!   "events": [{ "t": 16, "kind": "idle", "duration_s": 4 }], "seed": 1, "note": "" }
//! ```
//!
//! Between two keys the camera's position moves on a great circle around the point looked at, at a
//! distance that is linear in its logarithm; the rest is linear. Before the first key and after the
//! last nothing moves; of two keys at one time the second holds from then on. A transfer function
//! holds from its key on, or is blended in from what was seen then, for `blend_s` seconds. Events:
//!
//! | kind | further keys | meaning, from `t` on |
//! | --- | --- | --- |
//! | `clip` | `box`: two corners, world units, or null | nothing is seen outside |
//! | `iso` | `values` | surfaces that are shown |
//! | `window` | `range`: two ascending values, or null | values between which the transfer function is stretched |
//! | `idle` | `duration_s` | nothing moves: a picture may be refined |
//!
//! Invariants: keys ascend in time and lie within the duration, every camera key describes a view;
//! what is seen is a function of the time alone.

mod blend;
mod camera;
mod error;
mod file;
pub mod script;

use raywright_bvh::Aabb;
use raywright_imaging::Camera;

use crate::{
    appearance::{Appearance, IsoSurface},
    transfer::TransferFunction,
};
pub use error::SequenceError;
pub use file::{CameraKey, Event, EventKind, FORMAT, MAX_FRAMES, Sequence, TransferKey};

/// What is to be seen at a moment.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Moment {
    /// The time, seconds.
    pub time: f64,
    /// The camera.
    pub camera: Camera,
    /// The transfer function, blended and stretched.
    pub function: TransferFunction,
    /// The number of the transfer function's key, from 0: another one is a change that a raycaster
    /// has to prepare for, as is a moment within a blend.
    pub function_key: usize,
    /// Whether the transfer function is being blended.
    pub blending: bool,
    /// The box outside which nothing is seen, world units.
    pub clip: Option<Aabb>,
    /// Values whose surfaces are shown.
    pub iso_values: Vec<f32>,
    /// Whether nothing moves.
    pub idle: bool,
}

impl Moment {
    /// The transfer function and the surfaces, which are white and opaque.
    #[must_use]
    pub fn appearance(&self) -> Appearance {
        let mut appearance = Appearance::from(self.function.clone());
        let surfaces = self.iso_values.iter().map(|&value| IsoSurface {
            value,
            colour: [1.0; 3],
            opacity: 1.0,
        });
        appearance.surfaces = surfaces.collect();
        appearance
    }

    /// Whether the same is to be seen as at another moment: nothing moved.
    #[must_use]
    pub fn shows_the_same(&self, other: &Self) -> bool {
        self.camera == other.camera
            && self.clip == other.clip
            && self.function == other.function
            && self.iso_values == other.iso_values
    }
}

impl Sequence {
    /// Frames of the whole sequence, from 1: a frame at every 1/`fps` seconds before the end.
    #[must_use]
    pub fn frames(&self) -> u64 {
        ((self.duration_s * self.fps).round() as u64).max(1)
    }

    /// The time of a frame, seconds; not beyond the end.
    #[must_use]
    pub fn time_of(&self, frame: u64) -> f64 {
        (frame as f64 / self.fps).min(self.duration_s)
    }

    /// What is to be seen at a time; before 0 what is seen at 0, after the end what is seen then.
    ///
    /// # Errors
    /// [`SequenceError::Time`] if the time is not a number; [`SequenceError::NoView`] where the camera
    /// between two keys describes no view, its `up` vanishing on the way, say.
    pub fn at(&self, time: f64) -> Result<Moment, SequenceError> {
        if time.is_nan() {
            return Err(SequenceError::Time { time });
        }
        let time = time.clamp(0.0, self.duration_s);
        let camera = camera::at(&self.camera, time);
        camera
            .validate()
            .map_err(|source| SequenceError::NoView { time, source })?;
        let mut clip = None;
        let mut window = None;
        let mut iso_values = Vec::new();
        let mut idle = false;
        for event in self.events.iter().take_while(|event| event.t <= time) {
            match &event.kind {
                EventKind::Clip { r#box } => {
                    clip = r#box.map(|[min, max]| Aabb {
                        min: min.into(),
                        max: max.into(),
                    });
                }
                EventKind::Iso { values } => iso_values.clone_from(values),
                EventKind::Window { range } => window = *range,
                EventKind::Idle { duration_s } => idle |= time < event.t + duration_s,
            }
        }
        let key = self.tf.partition_point(|key| key.t <= time).max(1) - 1;
        let blended = blend::at(&self.tf, key, time);
        let blending = blended.is_some();
        let mut function = blended.unwrap_or_else(|| self.tf[key].points.clone());
        if let Some(range) = window {
            function = blend::stretched(&function, range);
        }
        Ok(Moment {
            time,
            camera,
            function,
            function_key: key,
            blending,
            clip,
            iso_values,
            idle,
        })
    }
}

#[cfg(test)]
mod tests;
