//! The types of number that files store, and the order of their bytes.

use std::{fmt, str::FromStr};

use serde::{Deserialize, Serialize};

/// A type of number that can be read. In memory it becomes `u8`, `u16` or `f32`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum VoxelType {
    /// 8 bits without sign.
    U8,
    /// 8 bits with sign; kept as [`VoxelType::U8`] with an offset.
    I8,
    /// 16 bits without sign.
    U16,
    /// 16 bits with sign; kept as [`VoxelType::U16`] with an offset.
    I16,
    /// 32 bits without sign; rounded to `f32`.
    U32,
    /// 32 bits with sign; rounded to `f32`.
    I32,
    /// Single precision.
    F32,
    /// Double precision; rounded to `f32`.
    F64,
}

impl VoxelType {
    /// All of them.
    pub const ALL: [Self; 8] = [
        Self::U8,
        Self::I8,
        Self::U16,
        Self::I16,
        Self::U32,
        Self::I32,
        Self::F32,
        Self::F64,
    ];

    /// Bytes of one number in a file.
    #[must_use]
    pub fn bytes(self) -> u64 {
        match self {
            Self::U8 | Self::I8 => 1,
            Self::U16 | Self::I16 => 2,
            Self::U32 | Self::I32 | Self::F32 => 4,
            Self::F64 => 8,
        }
    }

    /// Its name: that of the type in Rust.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::U8 => "u8",
            Self::I8 => "i8",
            Self::U16 => "u16",
            Self::I16 => "i16",
            Self::U32 => "u32",
            Self::I32 => "i32",
            Self::F32 => "f32",
            Self::F64 => "f64",
        }
    }
}

impl fmt::Display for VoxelType {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// A name that is none of the known ones.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("`{name}` is unknown; known are {known}")]
pub struct UnknownName {
    /// What was given.
    pub name: String,
    /// What is known.
    pub known: &'static str,
}

impl FromStr for VoxelType {
    type Err = UnknownName;

    fn from_str(name: &str) -> Result<Self, UnknownName> {
        let found = Self::ALL.into_iter().find(|t| t.name() == name);
        found.ok_or_else(|| UnknownName {
            name: name.into(),
            known: "u8, i8, u16, i16, u32, i32, f32, f64",
        })
    }
}

/// Which byte of a number comes first.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Endian {
    /// The lowest.
    Little,
    /// The highest.
    Big,
}

impl Endian {
    /// Its name.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Little => "little",
            Self::Big => "big",
        }
    }
}

impl fmt::Display for Endian {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl FromStr for Endian {
    type Err = UnknownName;

    fn from_str(name: &str) -> Result<Self, UnknownName> {
        match name {
            "little" => Ok(Self::Little),
            "big" => Ok(Self::Big),
            _ => Err(UnknownName {
                name: name.into(),
                known: "little, big",
            }),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_there_and_back() {
        for voxel_type in VoxelType::ALL {
            assert_eq!(voxel_type.name().parse(), Ok(voxel_type));
            let json = serde_json::to_string(&voxel_type).unwrap();
            assert_eq!(json, format!("\"{voxel_type}\""));
        }
        for endian in [Endian::Little, Endian::Big] {
            assert_eq!(endian.name().parse(), Ok(endian));
        }
        let error = "i64".parse::<VoxelType>().unwrap_err();
        assert!(error.to_string().contains("`i64`") && error.to_string().contains("u16"));
        assert!("middle".parse::<Endian>().is_err());
    }
}
