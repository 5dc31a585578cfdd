//! What can go wrong: describing a space, giving a configuration, telling an outcome.
//!
//! Fields, not texts: a caller can point at the parameter and at the allowed values.

use crate::{Kind, TrialId, Value};

/// A space, or a configuration of one, that is not possible.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SpaceError {
    /// A space needs at least one parameter.
    #[error("a space needs at least one parameter")]
    NoParams,
    /// Two parameters share a name.
    #[error("parameter {name} is described twice")]
    DuplicateParam {
        /// The shared name.
        name: String,
    },
    /// No parameter has this name.
    #[error("there is no parameter {name}")]
    UnknownParam {
        /// The name that was looked for.
        name: String,
    },
    /// The range holds no value, or an ordinal has no or unordered values.
    #[error("parameter {name}: {kind} is empty or not in increasing order")]
    EmptyRange {
        /// The parameter.
        name: String,
        /// Its range as given.
        kind: Kind,
    },
    /// A bound is not finite or too large, or the range too narrow to be resolved.
    #[error(
        "parameter {name}: {kind} cannot be resolved (bounds must be finite, at most 1e12 in \
         magnitude, and for reals at least 1e-12 and a millionth of the larger bound apart)"
    )]
    UnusableRange {
        /// The parameter.
        name: String,
        /// Its range as given.
        kind: Kind,
    },
    /// A logarithmic scale over numbers that are not positive.
    #[error("parameter {name}: a logarithmic scale needs a positive lower bound, not {kind}")]
    LogOfNonPositive {
        /// The parameter.
        name: String,
        /// Its range as given.
        kind: Kind,
    },
    /// A condition looks at a parameter that is not described before the conditional one.
    #[error("parameter {name}: its condition looks at {on}, which is not an earlier parameter")]
    ConditionNotEarlier {
        /// The conditional parameter.
        name: String,
        /// The parameter the condition looks at.
        on: String,
    },
    /// A condition looks at a real parameter, or lists no value.
    #[error(
        "parameter {name}: a condition needs a discrete parameter and at least one value of it, not {on}"
    )]
    ConditionNotDiscrete {
        /// The conditional parameter.
        name: String,
        /// The parameter the condition looks at.
        on: String,
    },
    /// The parameter cannot take this value.
    #[error("parameter {name} cannot be {value}: it is {kind}")]
    NotAValue {
        /// The parameter.
        name: String,
        /// The value that was given.
        value: Value,
        /// What it may be.
        kind: Kind,
    },
    /// The two parameters cannot be ordered: not both integers or both reals, or no pair of values
    /// fulfils the constraint.
    #[error("{lesser} <= {greater} cannot be a constraint: not comparable, or never fulfilled")]
    NotOrderable {
        /// The parameter that should be at most the other.
        lesser: String,
        /// The other one.
        greater: String,
    },
    /// A parameter may take part in one constraint.
    #[error("parameter {name} is already part of a constraint")]
    ConstrainedTwice {
        /// The parameter.
        name: String,
    },
    /// A rule of the canonical form does not fit the parameter.
    #[error("parameter {name}: this canonical rule does not apply to {kind}")]
    RuleDoesNotFit {
        /// The parameter.
        name: String,
        /// What the parameter is.
        kind: Kind,
    },
    /// A parameter may be subject to one rule, and to none when a condition looks at it.
    #[error("parameter {name} is already subject to a rule, or a condition looks at it")]
    RuledTwice {
        /// The parameter.
        name: String,
    },
    /// A configuration gives a parameter more than once.
    #[error("parameter {name} is given twice")]
    GivenTwice {
        /// The parameter.
        name: String,
    },
    /// A configuration lacks an active parameter.
    #[error("parameter {name} is missing")]
    Missing {
        /// The parameter.
        name: String,
    },
    /// A configuration breaks a constraint.
    #[error("{lesser} = {lesser_value} must be at most {greater} = {greater_value}")]
    OutOfOrder {
        /// The parameter that should be at most the other.
        lesser: String,
        /// Its value.
        lesser_value: Value,
        /// The other parameter.
        greater: String,
        /// Its value.
        greater_value: Value,
    },
    /// The configuration has other parameters than the space.
    #[error("the configuration belongs to another space")]
    ForeignConfig,
}

/// An outcome that cannot be accepted. The tuner is unchanged.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum TellError {
    /// No such trial was ever handed out.
    #[error("{id} was never asked")]
    UnknownTrial {
        /// The trial that was told.
        id: TrialId,
    },
    /// The trial has its outcome already.
    #[error("{id} was told already")]
    AlreadyTold {
        /// The trial that was told.
        id: TrialId,
    },
    /// A cost must be a finite number of at least zero. The trial stays open.
    #[error("{id}: a cost must be finite and at least 0, not {cost}")]
    BadCost {
        /// The trial that was told.
        id: TrialId,
        /// The refused cost.
        cost: f64,
    },
}
