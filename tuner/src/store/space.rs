//! A stored space: its description as data, from which the space itself can be made again.

use serde::{Deserialize, Serialize};

use super::id::hash;
use super::{Fields, SpaceId};
use crate::{CanonRule, Param, Space, SpaceError};

/// The description of a space.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct SpaceFacts {
    /// Named by trials. The sentences for people do not enter it.
    pub id: SpaceId,
    /// The parameters.
    pub params: Vec<Param>,
    /// Constraints: names of the lesser and the greater parameter.
    pub at_most: Vec<(String, String)>,
    /// Rules of the canonical form.
    pub canon: Vec<CanonRule>,
    /// Fields of later versions.
    #[serde(flatten)]
    pub extra: Fields,
}

impl SpaceFacts {
    /// Describes `space`; equal spaces give equal ids.
    pub fn new(space: &Space) -> SpaceFacts {
        let params = space.params().to_vec();
        let at_most: Vec<_> = space.at_most().collect();
        let canon: Vec<_> = space.canon().collect();
        let without_doc = params.iter().cloned().map(|mut param| {
            param.doc.clear();
            param
        });
        let hashed = (without_doc.collect::<Vec<_>>(), &at_most, &canon);
        // Parameters of a space are finite numbers and texts, which always have a JSON text.
        let text = serde_json::to_string(&hashed).unwrap_or_default();
        SpaceFacts {
            id: SpaceId::new(hash(&text)),
            params,
            at_most,
            canon,
            extra: Fields::new(),
        }
    }

    /// The space that is described.
    ///
    /// # Errors
    ///
    /// If the description is not of a possible space; never for one that [`SpaceFacts::new`] made.
    pub fn space(&self) -> Result<Space, SpaceError> {
        let mut space = Space::new(self.params.clone())?;
        for (lesser, greater) in &self.at_most {
            space = space.with_at_most(lesser, greater)?;
        }
        for rule in &self.canon {
            space = space.with_canon(rule.clone())?;
        }
        Ok(space)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Scale;

    #[test]
    fn the_space_comes_back() {
        let space = Space::new(vec![
            Param::integer("low", 1..=16, Scale::Log, "Least."),
            Param::integer("high", 1..=32, Scale::Linear, "Most."),
            Param::boolean("on", "Switch."),
            Param::real("alpha", 1e-7..=0.1, Scale::Log, "Threshold.").active_if("on", [true]),
            Param::ordinal("width", vec![2, 4, 8], "Children."),
        ])
        .and_then(|space| space.with_at_most("low", "high"))
        .and_then(|space| space.with_canon(CanonRule::FloorToPowerOfTwo("width".to_owned())))
        .unwrap();
        let facts = SpaceFacts::new(&space);
        let text = serde_json::to_string(&facts).unwrap();
        let read: SpaceFacts = serde_json::from_str(&text).unwrap();
        assert_eq!(read, facts);
        assert_eq!(read.space().unwrap(), space);
    }
}
