//! How kernel recursive least squares learns, and what it refuses.

/// How a model learns.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct KrlsParams {
    /// γ of the kernel exp(−γ|u − v|²), per squared unit of the features; above 0.
    pub gamma: f64,
    /// A vector whose residual δ is above this is novel; 1e-9 or more. Above 1.01 nothing
    /// is novel after the first.
    pub tolerance: f64,
    /// Vectors in the dictionary at most, from 1. One learning step costs the square of it.
    pub limit: usize,
    /// λ, the weight of the past after one step; above 0, at most 1: nothing is forgotten.
    pub forgetting: f64,
}

impl Default for KrlsParams {
    /// The values of the paper, with a limit of 256.
    fn default() -> Self {
        Self {
            gamma: 0.000_25,
            tolerance: 0.006,
            limit: 256,
            forgetting: 1.0,
        }
    }
}

impl KrlsParams {
    /// With another γ.
    #[must_use]
    pub fn with_gamma(self, gamma: f64) -> Self {
        Self { gamma, ..self }
    }

    /// With another tolerance.
    #[must_use]
    pub fn with_tolerance(self, tolerance: f64) -> Self {
        Self { tolerance, ..self }
    }

    /// With another limit.
    #[must_use]
    pub fn with_limit(self, limit: usize) -> Self {
        Self { limit, ..self }
    }

    /// With another forgetting factor.
    #[must_use]
    pub fn with_forgetting(self, forgetting: f64) -> Self {
        Self { forgetting, ..self }
    }

    pub(super) fn check(&self) -> Result<(), KrlsError> {
        let fault = |name, value, allowed| {
            Err(KrlsError::Parameter {
                name,
                value,
                allowed,
            })
        };
        if !(self.gamma > 0.0 && self.gamma.is_finite()) {
            return fault("gamma", self.gamma, "above 0 and finite");
        }
        if !(self.tolerance >= 1e-9 && self.tolerance.is_finite()) {
            return fault("tolerance", self.tolerance, "1e-9 or more");
        }
        if self.limit == 0 {
            return fault("limit", 0.0, "1 or more");
        }
        if !(self.forgetting > 0.0 && self.forgetting <= 1.0) {
            return fault("forgetting", self.forgetting, "above 0, at most 1");
        }
        Ok(())
    }
}

/// Why a model refuses.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum KrlsError {
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
    /// A feature is infinite or not a number.
    #[error("feature {index} is {value}: features must be finite")]
    Feature {
        /// Which one, from 0.
        index: usize,
        /// Its value.
        value: f64,
    },
    /// A target is infinite, not a number, or beyond 1e100.
    #[error("a target of {value}: it must be finite, and at most 1e100 in magnitude")]
    Target {
        /// Its value.
        value: f64,
    },
}
