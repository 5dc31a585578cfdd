//! Names of writers, records, machines, scenes and spaces.
//!
//! A record is named by its writer and a number; the other ids are hashes of what they name, so
//! that two writers on one machine give it the same id without having met. Hash: 64-bit FNV-1a
//! (Fowler, Noll & Vo, RFC 9923) of the JSON text with sorted names. It is good against accident,
//! not against intent.

use std::fmt;

use serde::{Deserialize, Serialize};

use super::StoreError;

/// Name of a writer, unique among all writers whose logs may ever be merged. It is told, not
/// drawn: a host name and a process number, say, or random digits.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub struct WriterId(String);

impl WriterId {
    /// The writer called `id`.
    ///
    /// # Errors
    ///
    /// Unless `id` has 1 to 64 characters, all of a–z, 0–9, `-` and `_`: it names a file, also on
    /// systems that do not tell upper from lower case.
    pub fn new(id: &str) -> Result<WriterId, StoreError> {
        let allowed = |byte| matches!(byte, b'a'..=b'z' | b'0'..=b'9' | b'-' | b'_');
        match (1..=64).contains(&id.len()) && id.bytes().all(allowed) {
            true => Ok(WriterId(id.to_owned())),
            false => Err(StoreError::BadWriterId { id: id.to_owned() }),
        }
    }

    /// The name.
    pub fn as_str(&self) -> &str {
        &self.0
    }
}

impl TryFrom<String> for WriterId {
    type Error = StoreError;

    fn try_from(id: String) -> Result<WriterId, StoreError> {
        WriterId::new(&id)
    }
}

impl From<WriterId> for String {
    fn from(id: WriterId) -> String {
        id.0
    }
}

impl fmt::Display for WriterId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

/// Names a record: who wrote it, and the how-manieth it was. Numbers may have gaps.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub struct Stamp {
    /// The writer.
    pub writer: WriterId,
    /// Increases from record to record of the writer.
    pub sequence: u64,
}

impl fmt::Display for Stamp {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}/{}", self.writer, self.sequence)
    }
}

macro_rules! hash_id {
    ($(#[$doc:meta])* $name:ident) => {
        $(#[$doc])*
        #[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
        #[serde(transparent)]
        pub struct $name(String);

        impl $name {
            /// The id with this text. Ids are usually taken from what they name.
            pub fn new(id: impl Into<String>) -> $name {
                $name(id.into())
            }

            /// The text.
            pub fn as_str(&self) -> &str {
                &self.0
            }
        }

        impl fmt::Display for $name {
            fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str(&self.0)
            }
        }
    };
}

hash_id!(
    /// Names a machine: the hash of its [`Facts`](super::Facts).
    MachineId
);
hash_id!(
    /// Names a scene: the hash of its [`Facts`](super::Facts).
    SceneId
);
hash_id!(
    /// Names a space: the hash of its [`SpaceFacts`](super::SpaceFacts).
    SpaceId
);

/// Hash of a text, as 16 hexadecimal digits.
pub(crate) fn hash(text: &str) -> String {
    const OFFSET_BASIS: u64 = 0xcbf2_9ce4_8422_2325;
    const PRIME: u64 = 0x0000_0100_0000_01b3;
    let hash = text.bytes().fold(OFFSET_BASIS, |hash, byte| {
        (hash ^ u64::from(byte)).wrapping_mul(PRIME)
    });
    format!("{hash:016x}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn hash_is_that_of_the_standard() {
        assert_eq!(hash(""), "cbf29ce484222325");
        assert_eq!(hash("a"), "af63dc4c8601ec8c");
        assert_eq!(hash("foobar"), "85944171f73967e8");
    }

    #[test]
    fn a_writer_id_cannot_leave_its_folder() {
        for bad in ["", "..", "a/b", "a\\b", "A", "a.b", "ä", &"x".repeat(65)] {
            assert!(WriterId::new(bad).is_err(), "{bad}");
        }
        assert!(WriterId::new("host-1_42").is_ok());
    }
}
