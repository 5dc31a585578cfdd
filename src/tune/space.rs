//! BVH parameters as a search space, made from the one parameter table of the tree.
//!
//! Searched are the parameters that change no hit.
//! Invariant: every configuration of the space is valid; only `max_depth` can turn out too small,
//! which depends on the scene.

use raywright_bvh::{
    BuildParams, PARAMETERS, Parameter, ParameterFault, ParameterRange, ParameterValue,
};
use raywright_tuner::{CanonRule, Config, Param, Scale, Space, SpaceError, Value};

/// Why no search space was made.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum SpaceFault {
    /// Fixed values that cannot be built.
    Fixed(Vec<ParameterFault>),
    /// All parameters are fixed, or the ranges contradict each other.
    Space(SpaceError),
}

impl std::fmt::Display for SpaceFault {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Fixed(faults) => {
                let faults: Vec<String> = faults.iter().map(ToString::to_string).collect();
                f.write_str(&faults.join("; "))
            }
            Self::Space(error) => error.fmt(f),
        }
    }
}

impl std::error::Error for SpaceFault {}

/// A search space over some of the BVH parameters; the others stay as given.
#[derive(Clone, Debug)]
pub struct ParameterSpace {
    space: Space,
    base: BuildParams,
}

impl ParameterSpace {
    /// The space of all parameters but those named in `fixed`, which keep their value in `base`.
    ///
    /// # Errors
    /// If `base` is not valid or nothing is left to search.
    pub fn new(base: &BuildParams, fixed: &[&str]) -> Result<Self, SpaceFault> {
        base.validate().map_err(SpaceFault::Fixed)?;
        let searched = |name: &str| !fixed.contains(&name);
        let params: Vec<Param> = PARAMETERS
            .iter()
            .filter(|p| !p.changes_hits && searched(p.name))
            .filter_map(param_of)
            .collect();
        let mut space = Space::new(params).map_err(SpaceFault::Space)?;
        let has = |space: &Space, name: &str| space.params().iter().any(|p| p.name == name);
        if has(&space, "min_leaf_size") && has(&space, "max_leaf_size") {
            space = space
                .with_at_most("min_leaf_size", "max_leaf_size")
                .map_err(SpaceFault::Space)?;
        }
        if has(&space, "sah_block_size") {
            let rule = CanonRule::FloorToPowerOfTwo("sah_block_size".into());
            space = space.with_canon(rule).map_err(SpaceFault::Space)?;
        }
        if has(&space, "traversal_cost") && has(&space, "intersection_cost") {
            let rule = CanonRule::OnlyRatio {
                numerator: "traversal_cost".into(),
                denominator: "intersection_cost".into(),
            };
            space = space.with_canon(rule).map_err(SpaceFault::Space)?;
        }
        Ok(Self { space, base: *base })
    }

    /// The space, for a tuner.
    #[must_use]
    pub fn space(&self) -> &Space {
        &self.space
    }

    /// The parameters of a configuration.
    ///
    /// # Panics
    /// If `config` is of another space.
    #[must_use]
    pub fn params(&self, config: &Config) -> BuildParams {
        let mut params = self.base;
        for (name, value) in config.iter() {
            let text = match (word_values(name), value) {
                (Some(words), Value::Integer(index)) => words[index as usize].to_owned(),
                (_, value) => number_text(value),
            };
            params
                .set(name, &text)
                .expect("the space is made from the parameter table");
        }
        params
    }
}

/// A number as text that reads back as the same f32.
fn number_text(value: Value) -> String {
    match value {
        Value::Real(value) => (value as f32).to_string(),
        other => other.to_string(),
    }
}

/// The words of a parameter that are searched, if it has words.
fn word_values(name: &str) -> Option<&'static [&'static str]> {
    PARAMETERS
        .iter()
        .find(|p| p.name == name)
        .and_then(|p| match p.tuned {
            ParameterRange::Words(words) => Some(words),
            _ => None,
        })
}

/// A parameter for the search; `None` if it has a single value. Words are numbered in the
/// order of the table.
fn param_of(parameter: &Parameter) -> Option<Param> {
    let (name, doc) = (parameter.name, parameter.meaning);
    Some(match parameter.tuned {
        ParameterRange::Integers(min, max) => {
            Param::integer(name, i64::from(min)..=i64::from(max), Scale::Linear, doc)
        }
        ParameterRange::OneOf(values) => {
            Param::ordinal(name, values.iter().map(|&v| i64::from(v)).collect(), doc)
        }
        ParameterRange::Reals(min, max) => {
            Param::real(name, f64::from(min)..=f64::from(max), Scale::Linear, doc)
        }
        ParameterRange::Words(words) if words.len() > 1 => {
            Param::ordinal(name, (0..words.len() as i64).collect(), doc)
        }
        ParameterRange::Words(..) => return None,
    })
}

/// Name and value of every parameter, as text.
#[must_use]
pub fn described(params: &BuildParams) -> Vec<(String, String)> {
    let text = |value: ParameterValue| value.to_string();
    PARAMETERS
        .iter()
        .filter_map(|p| Some((p.name.to_owned(), text(params.get(p.name)?))))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_configuration_is_valid_and_min_is_at_most_max() {
        let space = ParameterSpace::new(&BuildParams::default(), &[]).unwrap();
        let dimensions = space.space().dimensions();
        for i in 0..2000_u64 {
            // A Weyl sequence per axis fills the cube evenly.
            let unit: Vec<f64> = (0..dimensions)
                .map(|axis| (i as f64 * (0.618_033_988_749 + axis as f64 * 0.137)).fract())
                .collect();
            let params = space.params(&space.space().decode(&unit));
            assert_eq!(params.validate(), Ok(()));
            assert!(params.min_leaf_size <= params.max_leaf_size);
        }
    }

    #[test]
    fn accuracy_is_never_searched_and_fixed_parameters_keep_their_value() {
        let mut base = BuildParams::default();
        base.branching_factor = 4;
        let space = ParameterSpace::new(&base, &["branching_factor"]).unwrap();
        let names: Vec<&str> = space
            .space()
            .params()
            .iter()
            .map(|p| p.name.as_str())
            .collect();
        assert!(
            !names.contains(&"accuracy") && !names.contains(&"branching_factor"),
            "{names:?}"
        );
        let config = space
            .space()
            .decode(&vec![0.99; space.space().dimensions()]);
        assert_eq!(space.params(&config).branching_factor, 4);
    }
}
