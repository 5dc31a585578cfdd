//! The ways to choose the quality of a frame, as one state machine.
//!
//! Bruder, Frey, Ertl, 2016, compare four: a fixed step; a step from the time of the last frame; one
//! from a prediction; and two passes, of which the first is cheap. In the paper the first of two
//! passes has "a quarter of the current step size", which taken literally costs four frames: meant
//! is a quarter of the samples. The literal form is kept for studies.
//!
//! A caller asks for a pass, draws it, tells its time, and may be asked to draw again:
//!
//! ```
//! use raywright_volume::steer::{Mode, Next, NoModel, Steering, SteeringParams};
//!
//! let mut steering = Steering::new(SteeringParams::new(Mode::TwoPass, 1.0 / 30.0))?;
//! for _frame in 0..10 {
//!     let mut pass = steering.begin(&NoModel);
//!     loop {
//!         let seconds = 0.02 / pass.quality.step; // Here the frame would be drawn and timed.
//!         match steering.finish(seconds)? {
//!             Next::DrawAgain(again) => pass = again,
//!             Next::Shown { .. } => break,
//!         }
//!     }
//! }
//! # Ok::<(), raywright_volume::steer::SteeringError>(())
//! ```
//!
//! Invariants: from one shown frame to the next, samples become denser by a factor of at most
//! 1/`shrink_limit`, and sparser by any; a time that cannot be changes nothing.

use serde::{Deserialize, Serialize};

use super::{
    ladder::decide,
    model::{Forecast, TimeModel},
    search::StepLimits,
};
use crate::{grid::Volume, predict::Quality};

/// How the quality of the next frame is chosen.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Mode {
    /// Always the same step.
    NoAdapt,
    /// From the time of the last frame.
    LastFrame,
    /// From a prediction.
    Predicted,
    /// A pass with a quarter of the samples; if there is time left, another one, which is shown.
    TwoPass,
    /// The same with a quarter of the step in the first pass.
    TwoPassLiteral,
}

impl Mode {
    /// All of them.
    pub const ALL: [Self; 5] = [
        Self::NoAdapt,
        Self::LastFrame,
        Self::Predicted,
        Self::TwoPass,
        Self::TwoPassLiteral,
    ];

    /// Its name, as in files.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::NoAdapt => "no-adapt",
            Self::LastFrame => "last-frame",
            Self::Predicted => "predicted",
            Self::TwoPass => "two-pass",
            Self::TwoPassLiteral => "two-pass-literal",
        }
    }
}

/// Whether rays may be left out when longer steps are not enough.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Resolution {
    /// A ray for every pixel, always.
    Full,
    /// Steps up to 2 voxels; then a ray for two pixels, with steps up to 4; then one for four.
    Ladder,
}

/// How a frame's quality is chosen.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct SteeringParams {
    /// The way.
    pub mode: Mode,
    /// What a frame may take, seconds; infinite: the shortest step.
    pub target: f64,
    /// Steps that are allowed.
    pub limits: StepLimits,
    /// The step of [`Mode::NoAdapt`], and what the other ways begin with; lengths of a voxel.
    pub fixed_step: f64,
    /// By how much steps may shrink from frame to frame: 0.8 in the paper; above 0, at most 1.
    pub shrink_limit: f64,
    /// Standard deviations that are added to a predicted time, from 0.
    pub caution: f64,
    /// Novelty above which the step is a safe one; 1: never.
    pub safe_novelty: f64,
    /// Whether [`Mode::Predicted`] may leave out rays.
    pub resolution: Resolution,
}

impl SteeringParams {
    /// A way and a target in seconds; the rest as in the paper.
    #[must_use]
    pub fn new(mode: Mode, target: f64) -> Self {
        Self {
            mode,
            target,
            limits: StepLimits::default(),
            fixed_step: 0.75,
            shrink_limit: 0.8,
            caution: 0.0,
            safe_novelty: 1.0,
            resolution: Resolution::Full,
        }
    }

    /// With what the paper wishes for and we have: a prediction's deviation is kept in reserve, and
    /// unknown frames are drawn with a safe step.
    #[must_use]
    pub fn cautious(mode: Mode, target: f64) -> Self {
        Self {
            caution: 1.0,
            safe_novelty: 0.5,
            ..Self::new(mode, target)
        }
    }

    /// With steps that suit a volume.
    #[must_use]
    pub fn for_volume(self, volume: &Volume) -> Self {
        Self {
            limits: StepLimits::for_volume(volume),
            ..self
        }
    }

    fn check(&self) -> Result<(), SteeringError> {
        let fault = |name, value, allowed| {
            Err(SteeringError::Parameter {
                name,
                value,
                allowed,
            })
        };
        let within = |value: f64, low: f64, high: f64| value >= low && value <= high;
        if self.target.is_nan() || self.target <= 0.0 {
            return fault("target", self.target, "above 0");
        }
        if !self.limits.is_valid() {
            return Err(SteeringError::Limits {
                shortest: self.limits.shortest,
                longest: self.limits.longest,
            });
        }
        if !within(self.fixed_step, f64::MIN_POSITIVE, f64::MAX) {
            return fault("fixed_step", self.fixed_step, "above 0 and finite");
        }
        if !within(self.shrink_limit, f64::MIN_POSITIVE, 1.0) {
            return fault("shrink_limit", self.shrink_limit, "above 0, at most 1");
        }
        if !within(self.caution, 0.0, f64::MAX) {
            return fault("caution", self.caution, "0 or more");
        }
        if !within(self.safe_novelty, 0.0, 1.0) {
            return fault("safe_novelty", self.safe_novelty, "0 to 1");
        }
        Ok(())
    }
}

/// Why steering is not possible.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SteeringError {
    /// A parameter has no meaning.
    #[error("{name} is {value}, allowed is {allowed}")]
    Parameter {
        /// Its name.
        name: &'static str,
        /// Its value.
        value: f64,
        /// What is allowed.
        allowed: &'static str,
    },
    /// The limits of the step are no interval of positive numbers.
    #[error("steps from {shortest} to {longest} voxels: they must ascend, above 0 and finite")]
    Limits {
        /// The shortest.
        shortest: f64,
        /// The longest.
        longest: f64,
    },
    /// A time was told for a pass that nobody was asked for.
    #[error("a time was told without a pass that has begun")]
    NoPass,
}

/// Something to draw.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct Pass {
    /// How finely.
    pub quality: Quality,
    /// What it is expected to take; of [`Mode::Predicted`] alone.
    pub forecast: Option<Forecast>,
    /// Frames like this one are unknown, or cannot be predicted: the step is a safe one.
    pub safe: bool,
    /// Samples would be denser but for the limit from frame to frame.
    pub held_back: bool,
    /// Not even the coarsest quality is expected to hold the target.
    pub over_budget: bool,
}

impl Pass {
    pub(super) fn plain(quality: Quality) -> Self {
        Self {
            quality,
            forecast: None,
            safe: false,
            held_back: false,
            over_budget: false,
        }
    }
}

/// What comes after a pass.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Next {
    /// The frame is drawn once more; what was drawn is dropped.
    DrawAgain(Pass),
    /// What was drawn is shown.
    Shown {
        /// Its quality.
        quality: Quality,
        /// The time of all passes of the frame, seconds.
        frame_time: f64,
    },
}

/// Where in a frame steering is.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Phase {
    Between,
    First(Pass),
    Second { pass: Pass, first_time: f64 },
}

/// Chooses the quality of frame after frame.
#[derive(Clone, Debug, PartialEq)]
pub struct Steering {
    params: SteeringParams,
    phase: Phase,
    /// Quality and pass time of the last frame shown.
    shown: Option<(Quality, f64)>,
}

impl Steering {
    /// Steering that has shown no frame.
    ///
    /// # Errors
    /// [`SteeringError::Parameter`] and [`SteeringError::Limits`].
    pub fn new(params: SteeringParams) -> Result<Self, SteeringError> {
        params.check()?;
        Ok(Self {
            params,
            phase: Phase::Between,
            shown: None,
        })
    }

    /// How it chooses.
    #[must_use]
    pub fn params(&self) -> &SteeringParams {
        &self.params
    }

    /// Changes the target, seconds.
    ///
    /// # Errors
    /// [`SteeringError::Parameter`]; the target is as before.
    pub fn set_target(&mut self, target: f64) -> Result<(), SteeringError> {
        let params = SteeringParams {
            target,
            ..self.params
        };
        params.check()?;
        self.params = params;
        Ok(())
    }

    /// The quality of the last frame shown.
    #[must_use]
    pub fn shown(&self) -> Option<Quality> {
        self.shown.map(|(quality, _)| quality)
    }

    /// What to draw first in the next frame. Only [`Mode::Predicted`] asks the model. A pass that was
    /// begun and not finished is forgotten.
    pub fn begin(&mut self, model: &impl TimeModel) -> Pass {
        let params = &self.params;
        let last_step = match self.shown {
            Some((quality, _)) => quality.step,
            None => params.fixed_step,
        };
        let clamp = |step: f64| step.clamp(params.limits.shortest, params.limits.longest);
        let pass = match params.mode {
            Mode::NoAdapt => Pass::plain(Quality::with_step(params.fixed_step)),
            Mode::LastFrame => {
                let wish = match self.shown {
                    Some((quality, time)) if is_time(time) => quality.step * (time / params.target),
                    _ => last_step,
                };
                self.held_back(clamp(wish))
            }
            Mode::Predicted => {
                let last = self.shown.map(|(quality, _)| quality);
                decide(params, last, model)
            }
            Mode::TwoPass => Pass::plain(Quality::with_step(clamp(4.0 * last_step))),
            Mode::TwoPassLiteral => Pass::plain(Quality::with_step(clamp(0.25 * last_step))),
        };
        self.phase = Phase::First(pass);
        pass
    }

    /// Tells that the pass was drawn in another quality than it was to be, before its time is told.
    pub fn drew(&mut self, quality: Quality) {
        if let Phase::First(pass) | Phase::Second { pass, .. } = &mut self.phase {
            pass.quality = quality;
        }
    }

    /// Tells the time of the pass that was to be drawn, seconds.
    ///
    /// # Errors
    /// [`SteeringError::NoPass`].
    pub fn finish(&mut self, time: f64) -> Result<Next, SteeringError> {
        let two_passes = matches!(self.params.mode, Mode::TwoPass | Mode::TwoPassLiteral);
        match self.phase {
            Phase::Between => Err(SteeringError::NoPass),
            Phase::First(pass)
                if two_passes && is_time(time) && time < self.params.target / 2.0 =>
            {
                let StepLimits { shortest, longest } = self.params.limits;
                // What the rest of the budget is enough for.
                let wish = pass.quality.step * (time / (self.params.target - time));
                let pass = self.held_back(wish.clamp(shortest, longest));
                self.phase = Phase::Second {
                    pass,
                    first_time: time,
                };
                Ok(Next::DrawAgain(pass))
            }
            Phase::First(pass) => Ok(self.show(pass.quality, time, time)),
            Phase::Second { pass, first_time } => {
                Ok(self.show(pass.quality, time, first_time + time))
            }
        }
    }

    /// Forgets the frames that were shown.
    pub fn reset(&mut self) {
        self.phase = Phase::Between;
        self.shown = None;
    }

    fn show(&mut self, quality: Quality, time: f64, frame_time: f64) -> Next {
        self.phase = Phase::Between;
        self.shown = Some((quality, time));
        Next::Shown {
            quality,
            frame_time,
        }
    }

    /// A step, no shorter than the limit from frame to frame allows.
    fn held_back(&self, step: f64) -> Pass {
        let least = match self.shown {
            Some((quality, _)) => quality.step * self.params.shrink_limit,
            None => 0.0,
        };
        let least = least.min(self.params.limits.longest);
        Pass {
            held_back: step < least,
            ..Pass::plain(Quality::with_step(step.max(least)))
        }
    }
}

/// Whether a number can be what a frame took.
fn is_time(time: f64) -> bool {
    time > 0.0 && time.is_finite()
}

#[cfg(test)]
mod tests;
