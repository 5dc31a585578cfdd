//! A search space: parameters, conditions between them, order constraints, canonical rules.
//!
//! A space is data. It maps the unit cube, where searches live, onto configurations. Mixed types,
//! constraints and conditions end here: a search sees real axes only and cannot propose anything
//! that is not a configuration.
//!
//! Invariants: `decode` fulfils every range and constraint by construction; `decode(encode(c)) == c`
//! for every configuration of the space; `canonical` is idempotent.

use std::sync::Arc;

use crate::canon::ResolvedRule;
use crate::{CanonRule, Config, Kind, Param, SpaceError, Value};

/// The set of configurations that a search may propose.
///
/// Real values are kept to ten significant decimal digits: of the larger bound of the range on a
/// linear scale, of the value on a logarithmic one. [`Space::new`] rounds the bounds likewise.
///
/// A constraint holds for all configurations, also when one of its parameters is inactive.
#[derive(Clone, Debug, PartialEq)]
pub struct Space {
    params: Vec<Param>,
    names: Arc<[String]>,
    /// For each parameter, index of the deciding parameter and the values that activate.
    conditions: Vec<Option<(usize, Vec<Value>)>>,
    /// Pairs (lesser, greater); no parameter is in two of them.
    order: Vec<(usize, usize)>,
    rules: Vec<ResolvedRule>,
}

impl Space {
    /// The space of `params`, which become its axes in the given order.
    ///
    /// # Errors
    ///
    /// Without parameters; for a name used twice; for a range that is empty, not finite, beyond
    /// 1e12, too narrow, or logarithmic and not positive; for a condition on something else than an
    /// earlier discrete parameter and its possible values.
    pub fn new(params: Vec<Param>) -> Result<Space, SpaceError> {
        if params.is_empty() {
            return Err(SpaceError::NoParams);
        }
        let mut checked: Vec<Param> = Vec::with_capacity(params.len());
        let mut conditions = Vec::with_capacity(params.len());
        for mut param in params {
            let name = || param.name.clone();
            if checked.iter().any(|known| known.name == param.name) {
                return Err(SpaceError::DuplicateParam { name: name() });
            }
            conditions.push(resolve_condition(&param, &checked)?);
            param.kind = param.kind.checked(&param.name)?;
            checked.push(param);
        }
        Ok(Space {
            names: checked.iter().map(|param| param.name.clone()).collect(),
            params: checked,
            conditions,
            order: Vec::new(),
            rules: Vec::new(),
        })
    }

    /// The same space with the constraint `lesser <= greater`.
    ///
    /// It holds by construction: decoding sorts the two numbers, and where their ranges differ
    /// moves each to the nearest value of its own range. No proposal is wasted on a violation.
    ///
    /// # Errors
    ///
    /// For unknown names; unless both are integers (or ordinals) or both reals, and different;
    /// if no two values are in order; if either is already part of a constraint.
    pub fn with_at_most(mut self, lesser: &str, greater: &str) -> Result<Space, SpaceError> {
        let (low, high) = (self.index(lesser)?, self.index(greater)?);
        for index in [low, high] {
            if self.order.iter().any(|&(a, b)| a == index || b == index) {
                let name = self.params[index].name.clone();
                return Err(SpaceError::ConstrainedTwice { name });
            }
        }
        let lowest = self.params[low].kind.lowest();
        let highest = self.params[high].kind.highest();
        if low == high || !is_at_most(lowest, highest) {
            return Err(SpaceError::NotOrderable {
                lesser: lesser.to_owned(),
                greater: greater.to_owned(),
            });
        }
        self.order.push((low, high));
        Ok(self)
    }

    /// The same space with one more rule of its canonical form.
    ///
    /// # Errors
    ///
    /// For unknown names; if the rule does not fit the type or range of its parameters; if one of
    /// them is already subject to a rule or decides a condition (then the values the rule joins
    /// would not do the same).
    pub fn with_canon(mut self, rule: CanonRule) -> Result<Space, SpaceError> {
        let (rule, fits) = match rule {
            CanonRule::FloorToPowerOfTwo(name) => {
                let fits: fn(Value) -> bool = |low| matches!(low, Value::Integer(1..));
                (ResolvedRule::FloorToPowerOfTwo(self.index(&name)?), fits)
            }
            CanonRule::OnlyRatio {
                numerator,
                denominator,
            } => {
                let numerator = self.index(&numerator)?;
                let denominator = self.index(&denominator)?;
                if numerator == denominator {
                    return Err(SpaceError::RuledTwice {
                        name: self.names[numerator].clone(),
                    });
                }
                let fits: fn(Value) -> bool = |low| matches!(low, Value::Real(0.0..));
                (
                    ResolvedRule::OnlyRatio {
                        numerator,
                        denominator,
                    },
                    fits,
                )
            }
        };
        for index in rule.params() {
            let Param { name, kind, .. } = &self.params[index];
            if !fits(kind.lowest()) {
                return Err(SpaceError::RuleDoesNotFit {
                    name: name.clone(),
                    kind: kind.clone(),
                });
            }
            let ruled = self
                .rules
                .iter()
                .any(|known| known.params().any(|other| other == index));
            let decides = self.conditions.iter().flatten().any(|&(on, _)| on == index);
            if ruled || decides {
                return Err(SpaceError::RuledTwice { name: name.clone() });
            }
        }
        self.rules.push(rule);
        Ok(self)
    }

    /// The parameters in the order of the axes.
    pub fn params(&self) -> &[Param] {
        &self.params
    }

    /// Number of parameters, which is the number of axes of the unit cube.
    pub fn dimensions(&self) -> usize {
        self.params.len()
    }

    /// The configuration at a point of the unit cube. Coordinates outside `[0, 1]` are projected
    /// onto it, NaN counts as 0.
    ///
    /// # Panics
    ///
    /// If `unit` does not have one coordinate per parameter.
    pub fn decode(&self, unit: &[f64]) -> Config {
        assert_eq!(
            unit.len(),
            self.dimensions(),
            "one coordinate per parameter"
        );
        let values = self
            .params
            .iter()
            .zip(unit)
            .map(|(param, &unit)| param.kind.decode(unit));
        self.in_order(values.collect())
    }

    /// The point of the unit cube that stands for `config`: bin centres, places of reals.
    /// A canonical configuration outside the ranges is projected onto them.
    ///
    /// # Panics
    ///
    /// If `config` belongs to a space with other parameters.
    pub fn encode(&self, config: &Config) -> Vec<f64> {
        assert!(
            self.has_names_of(config),
            "the configuration belongs to another space"
        );
        let values = self.params.iter().zip(config.values());
        values
            .map(|(param, &value)| param.kind.encode(value))
            .collect()
    }

    /// The configuration with the given values. Inactive parameters may be left out; reals are
    /// rounded to ten digits.
    ///
    /// # Errors
    ///
    /// For names that are unknown, given twice, or missing though active; for values of another
    /// type or outside the range; for a broken constraint.
    pub fn config(&self, given: &[(&str, Value)]) -> Result<Config, SpaceError> {
        let mut values: Vec<Option<Value>> = vec![None; self.dimensions()];
        for &(name, value) in given {
            let index = self.index(name)?;
            let kind = &self.params[index].kind;
            if !kind.contains(value) {
                let (name, kind) = (name.to_owned(), kind.clone());
                return Err(SpaceError::NotAValue { name, value, kind });
            }
            if values[index].replace(kind.round(value)).is_some() {
                return Err(SpaceError::GivenTwice {
                    name: name.to_owned(),
                });
            }
        }
        let resting: Vec<Value> = (0..values.len()).map(|index| self.resting(index)).collect();
        let filled: Vec<Value> = values
            .iter()
            .zip(&resting)
            .map(|(value, rest)| value.unwrap_or(*rest))
            .collect();
        let active = self.active(&filled);
        if let Some(index) = (0..values.len()).find(|&i| active[i] && values[i].is_none()) {
            return Err(SpaceError::Missing {
                name: self.names[index].clone(),
            });
        }
        let config = Config::new(self.names.clone(), filled);
        self.check(&config)?;
        Ok(config)
    }

    /// Whether `config` is one of this space: its parameters, its ranges, its constraints.
    ///
    /// # Errors
    ///
    /// The first thing that does not hold.
    pub fn check(&self, config: &Config) -> Result<(), SpaceError> {
        if !self.has_names_of(config) {
            return Err(SpaceError::ForeignConfig);
        }
        let values = config.values();
        for (Param { name, kind, .. }, &value) in self.params.iter().zip(values) {
            if !kind.contains(value) || kind.round(value) != value {
                let (name, kind) = (name.clone(), kind.clone());
                return Err(SpaceError::NotAValue { name, value, kind });
            }
        }
        for &(low, high) in &self.order {
            if !is_at_most(values[low], values[high]) {
                return Err(SpaceError::OutOfOrder {
                    lesser: self.names[low].clone(),
                    lesser_value: values[low],
                    greater: self.names[high].clone(),
                    greater_value: values[high],
                });
            }
        }
        Ok(())
    }

    /// The canonical form: the same for configurations that are known to do the same.
    ///
    /// Rules are applied to active parameters, inactive ones get a fixed value: the highest for the
    /// greater side of a constraint, the lowest otherwise. The result is a key and may lie outside
    /// the ranges of the space.
    ///
    /// # Panics
    ///
    /// If `config` belongs to a space with other parameters.
    pub fn canonical(&self, config: &Config) -> Config {
        assert!(
            self.has_names_of(config),
            "the configuration belongs to another space"
        );
        let mut values = config.values().to_vec();
        // No rule changes a parameter that decides a condition, so activity is settled beforehand.
        let active = self.active(&values);
        for rule in &self.rules {
            if rule.params().all(|index| active[index]) {
                rule.apply(&mut values);
            }
        }
        for (index, value) in values.iter_mut().enumerate() {
            if !active[index] {
                *value = self.resting(index);
            }
        }
        Config::new(self.names.clone(), values)
    }

    /// The constraints: names of the lesser and the greater parameter.
    #[cfg(feature = "store")]
    pub(crate) fn at_most(&self) -> impl Iterator<Item = (String, String)> {
        let name = |index: usize| self.names[index].clone();
        self.order
            .iter()
            .map(move |&(low, high)| (name(low), name(high)))
    }

    /// The rules of the canonical form.
    #[cfg(feature = "store")]
    pub(crate) fn canon(&self) -> impl Iterator<Item = CanonRule> {
        self.rules.iter().map(|rule| rule.with_names(&self.names))
    }

    /// Widths of the narrowest bins, axis by axis; 0 for reals.
    pub(crate) fn steps(&self) -> Vec<f64> {
        self.params.iter().map(|param| param.kind.step()).collect()
    }

    /// Number of configurations with constraints ignored; `None` if infinite or beyond `u64`.
    pub(crate) fn count(&self) -> Option<u64> {
        let mut counts = self.params.iter().map(|param| param.kind.count());
        counts.try_fold(1u64, |product, count| product.checked_mul(count?))
    }

    /// Configuration number `index` of a countable space; with constraints some come twice.
    pub(crate) fn nth(&self, mut index: u64) -> Config {
        let mut values = Vec::with_capacity(self.dimensions());
        for param in &self.params {
            let count = param
                .kind
                .count()
                .expect("only countable spaces are enumerated");
            values.push(param.kind.nth(index % count));
            index /= count;
        }
        self.in_order(values)
    }

    /// Values of the axes, made to fulfil the constraints.
    ///
    /// Out of order means a > b. Then min(a, b) = b goes to the lesser and a to the greater. The
    /// lesser becomes at most b, or its lowest value, which is at most a and at most the highest of
    /// the greater; likewise for the greater: in all four cases they are in order.
    fn in_order(&self, mut values: Vec<Value>) -> Config {
        for &(low, high) in &self.order {
            let (a, b) = (values[low], values[high]);
            if !is_at_most(a, b) {
                values[low] = self.params[low].kind.at_most(b);
                values[high] = self.params[high].kind.at_least(a);
            }
        }
        Config::new(self.names.clone(), values)
    }

    /// Which parameters are active: those whose condition holds and whose deciders are active too.
    fn active(&self, values: &[Value]) -> Vec<bool> {
        let mut active = Vec::with_capacity(values.len());
        for condition in &self.conditions {
            active.push(match condition {
                None => true,
                Some((on, wanted)) => active[*on] && wanted.contains(&values[*on]),
            });
        }
        active
    }

    /// The value of an inactive parameter; chosen such that constraints with it hold.
    fn resting(&self, index: usize) -> Value {
        let kind = &self.params[index].kind;
        if self.order.iter().any(|&(_, high)| high == index) {
            kind.highest()
        } else {
            kind.lowest()
        }
    }

    fn index(&self, name: &str) -> Result<usize, SpaceError> {
        let position = self.params.iter().position(|param| param.name == name);
        position.ok_or_else(|| SpaceError::UnknownParam {
            name: name.to_owned(),
        })
    }

    fn has_names_of(&self, config: &Config) -> bool {
        Arc::ptr_eq(&self.names, config.names()) || self.names == *config.names()
    }
}

/// Index of the parameter that decides about `param`, and the values that activate it.
fn resolve_condition(
    param: &Param,
    earlier: &[Param],
) -> Result<Option<(usize, Vec<Value>)>, SpaceError> {
    let Some(condition) = &param.active_if else {
        return Ok(None);
    };
    let (name, on) = (param.name.clone(), condition.param.clone());
    let Some(index) = earlier.iter().position(|known| known.name == on) else {
        return Err(SpaceError::ConditionNotEarlier { name, on });
    };
    let kind = &earlier[index].kind;
    if condition.values.is_empty() || matches!(kind, Kind::Real { .. }) {
        return Err(SpaceError::ConditionNotDiscrete { name, on });
    }
    if let Some(&value) = condition
        .values
        .iter()
        .find(|&&value| !kind.contains(value))
    {
        return Err(SpaceError::NotAValue {
            name: on,
            value,
            kind: kind.clone(),
        });
    }
    Ok(Some((index, condition.values.clone())))
}

/// Whether both are numbers of one type and in order.
fn is_at_most(a: Value, b: Value) -> bool {
    match (a, b) {
        (Value::Integer(a), Value::Integer(b)) => a <= b,
        (Value::Real(a), Value::Real(b)) => a <= b,
        _ => false,
    }
}
