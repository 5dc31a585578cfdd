//! The description of one parameter: name, possible values, when it is active, what it means.
//!
//! A parameter is data; how its values lie on the unit interval is the subject of `axis`.

use std::fmt;
use std::ops::RangeInclusive;

use crate::Value;

/// How a range is spread over its axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "store", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "store", serde(rename_all = "snake_case"))]
pub enum Scale {
    /// Equal differences take equal room.
    Linear,
    /// Equal ratios take equal room; needs a positive lower bound.
    Log,
}

/// The possible values of a parameter. All bounds are inclusive.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "store", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "store", serde(rename_all = "snake_case"))]
pub enum Kind {
    /// `false` or `true`.
    Bool,
    /// Every integer of a range.
    Integer {
        /// Smallest value.
        min: i64,
        /// Largest value.
        max: i64,
        /// Linear, or logarithmic with `min` at least 1.
        scale: Scale,
    },
    /// The listed integers, strictly increasing; each takes the same room.
    Ordinal(Vec<i64>),
    /// The reals of a range, to ten significant digits (see [`Space`](crate::Space)).
    Real {
        /// Smallest value.
        min: f64,
        /// Largest value.
        max: f64,
        /// Linear, or logarithmic with `min` above 0.
        scale: Scale,
    },
}

impl fmt::Display for Kind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let suffix = |scale: &Scale| match scale {
            Scale::Linear => "",
            Scale::Log => ", logarithmic",
        };
        match self {
            Kind::Bool => f.write_str("false or true"),
            Kind::Integer { min, max, scale } => {
                write!(f, "an integer in {min}..={max}{}", suffix(scale))
            }
            Kind::Ordinal(values) => write!(f, "one of {values:?}"),
            Kind::Real { min, max, scale } => {
                write!(f, "a real in {min}..={max}{}", suffix(scale))
            }
        }
    }
}

/// When a parameter matters: another one, described earlier, is active and has one of the values.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "store", derive(serde::Serialize, serde::Deserialize))]
pub struct Condition {
    /// Name of the boolean, integer or ordinal parameter that decides.
    pub param: String,
    /// Values of it that make the conditional parameter active.
    pub values: Vec<Value>,
}

/// One parameter of a space.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "store", derive(serde::Serialize, serde::Deserialize))]
pub struct Param {
    /// Unique within the space.
    pub name: String,
    /// Its possible values.
    pub kind: Kind,
    /// `None`: always active.
    pub active_if: Option<Condition>,
    /// One sentence for the people who read tables of parameters.
    pub doc: String,
}

impl Param {
    /// A parameter that is `false` or `true`.
    pub fn boolean(name: &str, doc: &str) -> Param {
        Param::new(name, Kind::Bool, doc)
    }

    /// A parameter that takes every integer of `range`.
    pub fn integer(name: &str, range: RangeInclusive<i64>, scale: Scale, doc: &str) -> Param {
        let (min, max) = range.into_inner();
        Param::new(name, Kind::Integer { min, max, scale }, doc)
    }

    /// A parameter that takes the listed integers, given in increasing order.
    pub fn ordinal(name: &str, values: Vec<i64>, doc: &str) -> Param {
        Param::new(name, Kind::Ordinal(values), doc)
    }

    /// A parameter that takes the reals of `range`.
    pub fn real(name: &str, range: RangeInclusive<f64>, scale: Scale, doc: &str) -> Param {
        let (min, max) = range.into_inner();
        Param::new(name, Kind::Real { min, max, scale }, doc)
    }

    /// The same parameter, active only if the earlier parameter `param` has one of `values`.
    #[must_use]
    pub fn active_if<V: Into<Value>>(
        mut self,
        param: &str,
        values: impl IntoIterator<Item = V>,
    ) -> Param {
        self.active_if = Some(Condition {
            param: param.to_owned(),
            values: values.into_iter().map(Into::into).collect(),
        });
        self
    }

    fn new(name: &str, kind: Kind, doc: &str) -> Param {
        Param {
            name: name.to_owned(),
            kind,
            active_if: None,
            doc: doc.to_owned(),
        }
    }
}
