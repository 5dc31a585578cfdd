//! A configuration: one value for every parameter of a space, in the order of the space.
//!
//! Invariant: configurations are made by a [`Space`](crate::Space) only, so every real in them is
//! finite and no real is `-0.0`. Equality is therefore an equivalence and agrees with the hash,
//! which lets a canonical configuration be the key of a map.

use std::fmt;
use std::hash::{Hash, Hasher};
use std::sync::Arc;

/// The value of one parameter. As JSON: `true`, `3`, or `3.0`, which is another value than `3`.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "store", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "store", serde(untagged))]
pub enum Value {
    /// Of a boolean parameter.
    Bool(bool),
    /// Of an integer or ordinal parameter.
    Integer(i64),
    /// Of a real parameter.
    Real(f64),
}

impl fmt::Display for Value {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Value::Bool(value) => value.fmt(f),
            Value::Integer(value) => value.fmt(f),
            Value::Real(value) => value.fmt(f),
        }
    }
}

impl From<bool> for Value {
    fn from(value: bool) -> Value {
        Value::Bool(value)
    }
}

impl From<i32> for Value {
    fn from(value: i32) -> Value {
        Value::Integer(value.into())
    }
}

impl From<i64> for Value {
    fn from(value: i64) -> Value {
        Value::Integer(value)
    }
}

impl From<f64> for Value {
    fn from(value: f64) -> Value {
        Value::Real(value)
    }
}

impl Hash for Value {
    fn hash<H: Hasher>(&self, state: &mut H) {
        match self {
            Value::Bool(value) => (0u8, value).hash(state),
            Value::Integer(value) => (1u8, value).hash(state),
            // Adding zero turns -0.0, which equals 0.0, into 0.0.
            Value::Real(value) => (2u8, (value + 0.0).to_bits()).hash(state),
        }
    }
}

/// Values for all parameters of a space; printed as `a=1 b=true`.
#[derive(Clone, PartialEq)]
pub struct Config {
    names: Arc<[String]>,
    values: Vec<Value>,
}

impl Config {
    pub(crate) fn new(names: Arc<[String]>, values: Vec<Value>) -> Config {
        debug_assert_eq!(names.len(), values.len());
        Config { names, values }
    }

    /// The value of the parameter `name`, or `None` if there is none of that name.
    pub fn get(&self, name: &str) -> Option<Value> {
        let index = self.names.iter().position(|known| known == name)?;
        Some(self.values[index])
    }

    /// The value of the integer or ordinal parameter `name`.
    pub fn integer(&self, name: &str) -> Option<i64> {
        match self.get(name)? {
            Value::Integer(value) => Some(value),
            _ => None,
        }
    }

    /// The value of the boolean parameter `name`.
    pub fn boolean(&self, name: &str) -> Option<bool> {
        match self.get(name)? {
            Value::Bool(value) => Some(value),
            _ => None,
        }
    }

    /// The value of the real parameter `name`.
    pub fn real(&self, name: &str) -> Option<f64> {
        match self.get(name)? {
            Value::Real(value) => Some(value),
            _ => None,
        }
    }

    /// Names and values in the order of the space.
    pub fn iter(&self) -> impl ExactSizeIterator<Item = (&str, Value)> {
        self.names
            .iter()
            .map(String::as_str)
            .zip(self.values.iter().copied())
    }

    pub(crate) fn names(&self) -> &Arc<[String]> {
        &self.names
    }

    pub(crate) fn values(&self) -> &[Value] {
        &self.values
    }
}

impl Eq for Config {}

impl Hash for Config {
    /// Hashes the values alone: within one map all keys share their names.
    fn hash<H: Hasher>(&self, state: &mut H) {
        self.values.hash(state);
    }
}

impl fmt::Display for Config {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (index, (name, value)) in self.iter().enumerate() {
            let gap = if index == 0 { "" } else { " " };
            write!(f, "{gap}{name}={value}")?;
        }
        Ok(())
    }
}

impl fmt::Debug for Config {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "Config({self})")
    }
}

#[cfg(test)]
mod tests {
    use std::collections::HashMap;

    use super::*;

    fn config(values: [Value; 3]) -> Config {
        let names: Arc<[String]> = ["a", "b", "c"].map(String::from).into();
        Config::new(names, values.to_vec())
    }

    #[test]
    fn prints_names_and_values() {
        let config = config([1.into(), true.into(), 0.5.into()]);
        assert_eq!(config.to_string(), "a=1 b=true c=0.5");
    }

    #[test]
    fn typed_access_needs_name_and_type() {
        let config = config([1.into(), true.into(), 0.5.into()]);
        assert_eq!(config.integer("a"), Some(1));
        assert_eq!(config.boolean("b"), Some(true));
        assert_eq!(config.real("c"), Some(0.5));
        assert_eq!(config.real("a"), None);
        assert_eq!(config.integer("b"), None);
        assert_eq!(config.boolean("d"), None);
    }

    #[test]
    fn equal_configurations_are_one_key() {
        let mut map = HashMap::new();
        map.insert(config([1.into(), true.into(), 0.0.into()]), "first");
        map.insert(config([1.into(), true.into(), (-0.0).into()]), "second");
        map.insert(config([1.into(), false.into(), 0.0.into()]), "third");
        assert_eq!(map.len(), 2);
        assert_eq!(map[&config([1.into(), true.into(), 0.0.into()])], "second");
    }
}
