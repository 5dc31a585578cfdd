//! How frames are predicted: the paper's way, ours, and what is between them for a study.

use super::{FeatureForm, FeatureScales, KrlsParams, PredictError, WorkCosts};

/// What the cost of a sample is the cost of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum SampleUnit {
    /// A sample as the estimate counts them: between the first block in which something can be seen
    /// and the expected end. Nothing that is learned gets between estimate and cost.
    Estimated,
    /// A sample that is expected to be taken: the estimate corrected by what frames taught.
    Corrected,
    /// As much work as a sample costs to begin with, of all that is estimated: rays, jumps, samples and
    /// the frame itself. So a frame with few samples does not make them dear.
    Weighted,
}

/// How frames are predicted.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct PredictorParams {
    /// How features are made.
    pub features: FeatureForm,
    /// The kernel model of the cost of a sample; `None`: the additive model alone predicts.
    pub cost: Option<KrlsParams>,
    /// What it is the cost of.
    pub unit: SampleUnit,
    /// The kernel model of β = log(samples taken / samples estimated); `None`: β is 0.
    pub bias: Option<KrlsParams>,
    /// Frames over which the present speed of the machine is averaged, apart from everything else,
    /// from 1; `None`: the speed is taken to be what it was.
    pub speed_memory: Option<f64>,
    /// Novelties between which the additive model takes over from the kernel model, 0..=1, the first
    /// below the second; `None`: only while the kernel model knows nothing.
    pub fallback: Option<[f64; 2]>,
    /// Whether kernel models stay within what they were told in recent frames, and follow no trend beyond.
    pub bounded: bool,
    /// Costs to begin with.
    pub cold_start: WorkCosts,
    /// Frames that the additive model remembers, from 1.
    pub additive_memory: f64,
}

impl PredictorParams {
    /// The paper's: the cost of a sample by a kernel model of its features that forgets nothing.
    #[must_use]
    pub fn paper() -> Self {
        Self {
            features: FeatureForm::Scaled(FeatureScales::paper()),
            cost: Some(KrlsParams::default()),
            unit: SampleUnit::Estimated,
            bias: None,
            speed_memory: None,
            fallback: None,
            bounded: false,
            cold_start: WorkCosts::default(),
            additive_memory: 64.0,
        }
    }

    /// Ours: scaled features, forgetting, a learned correction of the estimate, the speed
    /// of the machine apart, the additive model where frames are unlike any before, and no trend beyond
    /// what was seen.
    #[must_use]
    pub fn plus() -> Self {
        let krls = KrlsParams::default().with_limit(128);
        Self {
            features: FeatureForm::Scaled(FeatureScales::default()),
            cost: Some(krls.with_forgetting(0.98)),
            unit: SampleUnit::Weighted,
            bias: Some(krls.with_forgetting(0.98)),
            speed_memory: Some(5.0),
            fallback: Some([0.1, 0.5]),
            bounded: true,
            cold_start: WorkCosts::default(),
            additive_memory: 64.0,
        }
    }

    pub(super) fn check(&self) -> Result<(), PredictError> {
        let fault = |name, value, allowed| PredictError::Parameter {
            name,
            value,
            allowed,
        };
        // A NaN is in no range.
        if let Some(memory) = self.speed_memory
            && !(memory >= 1.0 && memory.is_finite())
        {
            return Err(fault("speed_memory", memory, "1 or more"));
        }
        if !(self.additive_memory >= 1.0 && self.additive_memory.is_finite()) {
            return Err(fault("additive_memory", self.additive_memory, "1 or more"));
        }
        if let Some([low, high]) = self.fallback {
            if !(0.0..1.0).contains(&low) {
                return Err(fault("fallback", low, "0 to 1, ascending"));
            }
            if !(high > low && high <= 1.0) {
                return Err(fault("fallback", high, "0 to 1, ascending"));
            }
        }
        Ok(())
    }
}

impl Default for PredictorParams {
    /// [`PredictorParams::plus`].
    fn default() -> Self {
        Self::plus()
    }
}
