//! The file of a sequence, and what is refused in it.

use std::{fs::File, io::Read, path::Path};

use raywright_imaging::Camera;
use serde::{Deserialize, Serialize};

use super::SequenceError;
use crate::transfer::TransferFunction;

/// The format of a sequence file.
pub const FORMAT: &str = "raywright-sequence-1";

/// Frames of a sequence at most: three months at 30 a second would be far more.
pub const MAX_FRAMES: f64 = 1e7;

/// Side of a viewport at most, pixels.
const MAX_SIDE: u32 = 1 << 16;

/// Bytes of a file at most.
const MAX_BYTES: u64 = 1 << 26;

/// A sequence. [`Sequence::check`] says whether it has a meaning; what is read has been checked.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Sequence {
    /// [`FORMAT`].
    pub format: String,
    /// The file name of the volume.
    pub volume: String,
    /// The end, seconds; above 0.
    pub duration_s: f64,
    /// Frames a second; above 0.
    pub fps: f64,
    /// Width and height of the picture, pixels.
    pub viewport: [u32; 2],
    /// Keys of the camera, at least one.
    pub camera: Vec<CameraKey>,
    /// Keys of the transfer function, at least one.
    pub tf: Vec<TransferKey>,
    /// What else happens.
    #[serde(default)]
    pub events: Vec<Event>,
    /// For all that is random.
    #[serde(default)]
    pub seed: u64,
    /// For readers.
    #[serde(default)]
    pub note: String,
}

/// Where the camera is at a time.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CameraKey {
    /// The time, seconds.
    pub t: f64,
    /// Where the camera stands, world units.
    pub position: [f32; 3],
    /// The point looked at.
    pub focal: [f32; 3],
    /// The direction that is upwards in the picture.
    pub up: [f32; 3],
    /// Full vertical field of view, degrees.
    pub vfov_deg: f32,
}

impl CameraKey {
    /// The key of a camera at a time.
    #[must_use]
    pub fn new(t: f64, camera: &Camera) -> Self {
        Self {
            t,
            position: camera.origin.to_array(),
            focal: camera.target.to_array(),
            up: camera.up.to_array(),
            vfov_deg: camera.vertical_fov_degrees,
        }
    }

    /// The camera, not validated.
    #[must_use]
    pub fn camera(&self) -> Camera {
        Camera {
            origin: self.position.into(),
            target: self.focal.into(),
            up: self.up.into(),
            vertical_fov_degrees: self.vfov_deg,
        }
    }
}

/// The transfer function from a time on.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TransferKey {
    /// The time, seconds.
    pub t: f64,
    /// The function.
    pub points: TransferFunction,
    /// Seconds over which it is blended in, from 0.
    #[serde(default)]
    pub blend_s: f64,
}

/// Something that happens at a time.
// `deny_unknown_fields` does not go with `flatten`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Event {
    /// The time, seconds.
    pub t: f64,
    /// What happens.
    #[serde(flatten)]
    pub kind: EventKind,
}

/// What happens.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "lowercase")]
#[non_exhaustive]
pub enum EventKind {
    /// Nothing is seen outside a box.
    Clip {
        /// Its lower and upper corner, world units; `None`: everything is seen.
        r#box: Option<[[f32; 3]; 2]>,
    },
    /// Surfaces are shown.
    Iso {
        /// Their values; none: no surface.
        values: Vec<f32>,
    },
    /// The transfer function is stretched to a range of values.
    Window {
        /// The range, ascending; `None`: as it is.
        range: Option<[f32; 2]>,
    },
    /// Nothing moves.
    Idle {
        /// For so many seconds, from 0.
        #[serde(default)]
        duration_s: f64,
    },
}

impl Sequence {
    /// Reads a file.
    ///
    /// # Errors
    /// See [`SequenceError`].
    pub fn read(path: &Path) -> Result<Self, SequenceError> {
        let fault = |source| SequenceError::Io {
            path: path.into(),
            source,
        };
        let mut bytes = Vec::new();
        let file = File::open(path).map_err(fault)?;
        file.take(MAX_BYTES + 1)
            .read_to_end(&mut bytes)
            .map_err(fault)?;
        if bytes.len() as u64 > MAX_BYTES {
            return Err(SequenceError::TooLarge {
                path: path.into(),
                limit: MAX_BYTES,
            });
        }
        Self::parse(&bytes)
    }

    /// Parses the bytes of a file.
    ///
    /// # Errors
    /// See [`SequenceError`].
    pub fn parse(bytes: &[u8]) -> Result<Self, SequenceError> {
        let sequence: Self = serde_json::from_slice(bytes)?;
        sequence.check()?;
        Ok(sequence)
    }

    /// Writes a file.
    ///
    /// # Errors
    /// [`SequenceError::Io`] and [`SequenceError::Json`].
    pub fn write(&self, path: &Path) -> Result<(), SequenceError> {
        let mut text = serde_json::to_vec(self)?;
        text.push(b'\n');
        std::fs::write(path, text).map_err(|source| SequenceError::Io {
            path: path.into(),
            source,
        })
    }

    /// Whether the sequence has a meaning.
    ///
    /// # Errors
    /// The first fault, with the number of the key where it is one of a key.
    pub fn check(&self) -> Result<(), SequenceError> {
        if self.format != FORMAT {
            return Err(SequenceError::Format {
                format: self.format.clone(),
            });
        }
        let out_of_range = |name, value, allowed| {
            Err(SequenceError::OutOfRange {
                name,
                value,
                allowed,
            })
        };
        for (name, value) in [("duration_s", self.duration_s), ("fps", self.fps)] {
            if !(value > 0.0 && value.is_finite()) {
                return out_of_range(name, value, "above 0 and finite");
            }
        }
        let frames = self.duration_s * self.fps;
        if frames > MAX_FRAMES {
            return out_of_range("duration_s * fps", frames, "at most 1e7 frames");
        }
        for side in self.viewport {
            if !(1..=MAX_SIDE).contains(&side) {
                return out_of_range("viewport", f64::from(side), "1 to 65536");
            }
        }
        self.check_times("camera", self.camera.iter().map(|key| key.t))?;
        self.check_times("tf", self.tf.iter().map(|key| key.t))?;
        self.check_times("events", self.events.iter().map(|key| key.t))?;
        for (list, empty) in [
            ("camera", self.camera.is_empty()),
            ("tf", self.tf.is_empty()),
        ] {
            if empty {
                return Err(SequenceError::NoKey { list });
            }
        }
        for (index, key) in self.camera.iter().enumerate() {
            key.camera()
                .validate()
                .map_err(|source| SequenceError::Camera { index, source })?;
        }
        for (index, key) in self.tf.iter().enumerate() {
            check_key("tf", index, "blend_s", key.blend_s, "0 or more", |blend| {
                blend >= 0.0
            })?;
        }
        for (index, event) in self.events.iter().enumerate() {
            check_event(index, event)?;
        }
        Ok(())
    }

    fn check_times(
        &self,
        list: &'static str,
        times: impl Iterator<Item = f64>,
    ) -> Result<(), SequenceError> {
        let mut previous = 0.0;
        for (index, t) in times.enumerate() {
            // A NaN lies in no range.
            if !(0.0..=self.duration_s).contains(&t) {
                return Err(SequenceError::KeyTime {
                    list,
                    index,
                    t,
                    duration_s: self.duration_s,
                });
            }
            if t < previous {
                return Err(SequenceError::NotSorted {
                    list,
                    index,
                    t,
                    previous,
                });
            }
            previous = t;
        }
        Ok(())
    }
}

fn check_key(
    list: &'static str,
    index: usize,
    name: &'static str,
    value: f64,
    allowed: &'static str,
    is_allowed: impl Fn(f64) -> bool,
) -> Result<(), SequenceError> {
    if value.is_finite() && is_allowed(value) {
        return Ok(());
    }
    Err(SequenceError::Key {
        list,
        index,
        name,
        value,
        allowed,
    })
}

fn check_event(index: usize, event: &Event) -> Result<(), SequenceError> {
    let check = |name, value: f32, allowed| {
        check_key("events", index, name, f64::from(value), allowed, |_| true)
    };
    match &event.kind {
        EventKind::Clip { r#box } => {
            for value in r#box.iter().flatten().flatten() {
                check("box", *value, "finite numbers")?;
            }
        }
        EventKind::Iso { values } => {
            for value in values {
                check("values", *value, "finite numbers")?;
            }
        }
        EventKind::Window { range } => {
            for value in range.iter().flatten() {
                check("range", *value, "finite numbers")?;
            }
            if let Some([low, high]) = *range {
                let width = f64::from(high) - f64::from(low);
                check_key("events", index, "width of range", width, "above 0", |w| {
                    w > 0.0
                })?;
            }
        }
        EventKind::Idle { duration_s } => {
            check_key(
                "events",
                index,
                "duration_s",
                *duration_s,
                "0 or more",
                |d| d >= 0.0,
            )?;
        }
    }
    Ok(())
}
