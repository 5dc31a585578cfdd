//! BVH parameters as a search space, made from the one parameter table of the tree.
//!
//! Searched are the parameters that change no hit.
//! Invariant: every configuration of the space is valid; only `max_depth` can turn out too small,
//! which depends on the scene.

use super::canonical::{self, Axis};
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

/// The axes of a search space.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SpaceAxes {
    /// One for each parameter of the table, with its range: the space of the paper and what is ours.
    Printed,
    /// What builds the same tree is one point, and what a builder does not read is no axis.
    Canonical,
    /// The same of the eleven parameters of the paper and their ranges alone.
    Eleven,
}

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
    pub fn new(base: &BuildParams, fixed: &[&str], axes: SpaceAxes) -> Result<Self, SpaceFault> {
        base.validate().map_err(SpaceFault::Fixed)?;
        let is_given = |name: &str| axes == SpaceAxes::Eleven && canonical::OURS.contains(&name);
        let searched = |name: &str| !fixed.contains(&name) && !is_given(name);
        let params = PARAMETERS
            .iter()
            .filter(|p| !p.changes_hits && searched(p.name));
        let params: Vec<Param> = match axes {
            SpaceAxes::Printed => params.filter_map(param_of).collect(),
            SpaceAxes::Canonical | SpaceAxes::Eleven => params
                .filter_map(|p| canonical_of(p, searched, axes == SpaceAxes::Eleven))
                .collect(),
        };
        let mut space = Space::new(params).map_err(SpaceFault::Space)?;
        let has = |space: &Space, name: &str| space.params().iter().any(|p| p.name == name);
        if has(&space, "min_leaf_size") && has(&space, "max_leaf_size") {
            space = space
                .with_at_most("min_leaf_size", "max_leaf_size")
                .map_err(SpaceFault::Space)?;
        }
        if has(&space, "sah_block_size") && axes == SpaceAxes::Printed {
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

    /// The configuration that stands for some parameters, moved to the nearest values of the space; of
    /// parameters that are fixed nothing is asked.
    ///
    /// # Errors
    /// [`SpaceFault::Fixed`] if the parameters are not valid.
    pub fn config(&self, params: &BuildParams) -> Result<Config, SpaceFault> {
        params.validate().map_err(SpaceFault::Fixed)?;
        let ratio = |a: f32, b: f32| f64::from(a) / f64::from(b);
        let value = |param: &Param| -> f64 {
            match param.name.as_str() {
                "leaf_size_ratio" => {
                    ratio(params.max_leaf_size as f32, params.min_leaf_size as f32)
                }
                "cost_ratio" => ratio(params.intersection_cost, params.traversal_cost),
                name => match params.get(name) {
                    Some(ParameterValue::Integer(value)) => f64::from(value),
                    Some(ParameterValue::Real(value)) => f64::from(value),
                    Some(ParameterValue::Choice(word)) => {
                        let words = word_values(name).unwrap_or_default();
                        words.iter().position(|own| *own == word).unwrap_or(0) as f64
                    }
                    None => 0.0,
                },
            }
        };
        let values: Vec<(&str, Value)> = self
            .space
            .params()
            .iter()
            .map(|param| (param.name.as_str(), param.kind.nearest(value(param))))
            .collect();
        self.space.config(&values).map_err(SpaceFault::Space)
    }

    /// The parameters of a configuration.
    ///
    /// # Panics
    /// If `config` is of another space.
    #[must_use]
    pub fn params(&self, config: &Config) -> BuildParams {
        let mut params = self.base;
        let is_searched = |name| self.space.params().iter().any(|p| p.name == name);
        let min_leaf_size = match config.integer("min_leaf_size") {
            Some(size) if is_searched("min_leaf_size") => size as u32,
            _ => self.base.min_leaf_size,
        };
        for (name, value) in config.iter() {
            if let Some(parts) = canonical::parameters(name, value, min_leaf_size) {
                for (name, text) in parts {
                    let known = "the axis is made from the parameter table";
                    params.set(name, &text).expect(known);
                }
                continue;
            }
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
        ParameterRange::OneOf(values) if values.len() > 1 => {
            Param::ordinal(name, values.iter().map(|&v| i64::from(v)).collect(), doc)
        }
        ParameterRange::Reals(min, max) => {
            Param::real(name, f64::from(min)..=f64::from(max), Scale::Linear, doc)
        }
        ParameterRange::Words(words) if words.len() > 1 => {
            Param::ordinal(name, (0..words.len() as i64).collect(), doc)
        }
        ParameterRange::OneOf(_) | ParameterRange::Words(_) => return None,
    })
}

/// The canonical axis of a parameter, active where a builder reads it.
fn canonical_of(
    parameter: &Parameter,
    searched: impl Fn(&str) -> bool,
    eleven: bool,
) -> Option<Param> {
    let qualities = word_values("quality").unwrap_or_default();
    let is_quality = |word: &str| !eleven || canonical::PAPER_QUALITIES.contains(&word);
    let indices = |wanted: &dyn Fn(&str) -> bool| -> Vec<i64> {
        let words = (0..).zip(qualities);
        words
            .filter(|(_, word)| is_quality(word) && wanted(word))
            .map(|(index, _)| index)
            .collect()
    };
    if eleven && parameter.name == "quality" {
        let doc = parameter.meaning;
        return Some(Param::ordinal(parameter.name, indices(&|_| true), doc));
    }
    let axis = match parameter.name {
        // As in the table: nodes of 16 are ours.
        "branching_factor" if eleven => None,
        _ => canonical::axis(parameter, &searched),
    };
    let param = match axis {
        Some(Axis::Instead(param)) => param,
        Some(Axis::None) => return None,
        None => param_of(parameter)?,
    };
    let readers = canonical::readers(parameter.name).filter(|_| searched("quality"));
    Some(match readers {
        None => param,
        Some(readers) => param.active_if("quality", indices(&|word| readers.contains(&word))),
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
    use raywright_bvh::Quality;

    #[test]
    fn every_configuration_is_valid_and_min_is_at_most_max() {
        for axes in [SpaceAxes::Printed, SpaceAxes::Canonical, SpaceAxes::Eleven] {
            check_configurations(axes);
        }
    }

    fn check_configurations(axes: SpaceAxes) {
        let space = ParameterSpace::new(&BuildParams::default(), &[], axes).unwrap();
        let dimensions = space.space().dimensions();
        for i in 0..2000_u64 {
            // A Weyl sequence per axis fills the cube evenly.
            let unit: Vec<f64> = (0..dimensions)
                .map(|axis| (i as f64 * (0.618_033_988_749 + axis as f64 * 0.137)).fract())
                .collect();
            let params = space.params(&space.space().decode(&unit));
            assert_eq!(params.validate(), Ok(()));
            assert!(params.min_leaf_size <= params.max_leaf_size);
            if axes == SpaceAxes::Eleven {
                assert!(params.branching_factor <= 8);
                assert!(!matches!(
                    params.quality,
                    Quality::Agglomerative | Quality::Optimized
                ));
                let base = BuildParams::default();
                assert_eq!(params.rotations, base.rotations);
                assert_eq!(params.split_budget, base.split_budget);
            }
        }
    }

    #[test]
    fn good_parameters_have_their_place_in_every_space() {
        let mut splits = BuildParams::default();
        splits.quality = Quality::SpatialSplits;
        splits.max_depth = 13;
        splits.min_leaf_size = 10;
        for axes in [SpaceAxes::Printed, SpaceAxes::Canonical] {
            let space = ParameterSpace::new(&BuildParams::default(), &[], axes).unwrap();
            for params in [BuildParams::default(), splits] {
                let found = space.params(&space.config(&params).unwrap());
                let own = described(&params);
                for ((name, found), (_, own)) in described(&found).iter().zip(&own) {
                    // Of the costs only the ratio is kept.
                    let kept = axes == SpaceAxes::Printed || !name.ends_with("_cost");
                    assert!(!kept || found == own, "{axes:?} {name}: {found} {own}");
                }
            }
        }
    }

    #[test]
    fn accuracy_is_never_searched_and_fixed_parameters_keep_their_value() {
        let mut base = BuildParams::default();
        base.branching_factor = 4;
        let space = ParameterSpace::new(&base, &["branching_factor"], SpaceAxes::Printed).unwrap();
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
