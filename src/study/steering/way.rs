//! Ways to choose steps, as they are compared.

use super::Stage;
use crate::volume::{
    Control, EnclosureKind, EnclosureParams, EstimateMethod, FrameLoopParams, Mode,
    PredictorParams, Skipping, SteeringParams,
};

/// How empty space is left out.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum Caster {
    /// From the first to the last face of the hull of blocks of 16³, as in the paper.
    Hull,
    /// By the distance map, which is faster and makes the cost of a sample depend on more.
    Map,
}

impl Caster {
    /// Both.
    pub const ALL: [Self; 2] = [Self::Hull, Self::Map];

    /// Its name for people.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Hull => "hull",
            Self::Map => "map",
        }
    }
}

/// A way to choose steps, complete with everything that belongs to it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Way {
    /// A fixed step of 0.75 voxels; times are predicted as in [`Way::Paper`].
    NoAdapt,
    /// From the time of the last frame.
    LastFrame,
    /// From the prediction of the paper.
    Paper,
    /// From our prediction, cautiously.
    Ours,
    /// The same, and the step may change between parts of a frame.
    Parts,
    /// Two passes.
    TwoPass,
}

impl Way {
    /// All of them.
    pub const ALL: [Self; 6] = [
        Self::NoAdapt,
        Self::LastFrame,
        Self::Paper,
        Self::Ours,
        Self::Parts,
        Self::TwoPass,
    ];

    /// Its name for people.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::NoAdapt => "no adapt",
            Self::LastFrame => "last frame",
            Self::Paper => "paper",
            Self::Ours => "ours",
            Self::Parts => "ours, in parts",
            Self::TwoPass => "two pass",
        }
    }

    /// Its name on a command line.
    #[must_use]
    pub fn key(self) -> &'static str {
        match self {
            Self::NoAdapt => "no-adapt",
            Self::LastFrame => "last-frame",
            Self::Paper => "paper",
            Self::Ours => "ours",
            Self::Parts => "parts",
            Self::TwoPass => "two-pass",
        }
    }

    /// What it does, in a few words.
    #[must_use]
    pub fn what(self) -> &'static str {
        match self {
            Self::NoAdapt => "A step of 0.75 voxels",
            Self::LastFrame => "From the time of the last frame",
            Self::Paper => "From the prediction of the paper",
            Self::Ours => "From our prediction, cautiously",
            Self::Parts => "From our prediction, and the step may change within a frame",
            Self::TwoPass => "A coarse pass, and a finer one if there is time",
        }
    }

    /// Whether it predicts in our way.
    #[must_use]
    pub fn is_ours(self) -> bool {
        matches!(self, Self::Ours | Self::Parts)
    }

    pub(super) fn params(self, stage: &Stage<'_>, target: f64) -> FrameLoopParams {
        let mode = match self {
            Self::NoAdapt => Mode::NoAdapt,
            Self::LastFrame => Mode::LastFrame,
            Self::Paper | Self::Ours | Self::Parts => Mode::Predicted,
            Self::TwoPass => Mode::TwoPass,
        };
        // What errs is put right within the frame: caution would only cost quality.
        let steering = if self == Self::Ours {
            SteeringParams::cautious(mode, target)
        } else {
            SteeringParams::new(mode, target)
        };
        let mut params = FrameLoopParams::new(steering, stage.size);
        if self == Self::Parts {
            params.steering.shrink_limit = 0.5;
        }
        if self.is_ours() {
            params.steering.resolution = stage.resolution;
        } else {
            params.predictor = PredictorParams::paper();
            params.method = EstimateMethod::CubeRoot;
        }
        if stage.way_to_skip == Caster::Hull {
            params.options.skipping = Skipping::Enclosure;
            params.enclosure = Some(EnclosureParams::new(EnclosureKind::Hull));
        }
        if self == Self::Parts {
            params.control = Control::Parts;
        }
        params
    }
}
