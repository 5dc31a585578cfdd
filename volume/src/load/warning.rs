//! What is unusual about a file that was accepted, as values.

use std::fmt;

use super::{PlacementSource, VoxelType};

/// Something that a user should know: a value was replaced, or information was lost.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum Warning {
    /// There are more bytes of voxels than the header says; the rest was not read.
    ExtraData {
        /// How many, if that is known: of compressed data it is not.
        bytes: Option<u64>,
    },
    /// Something that is no gzip data follows the compressed data.
    GzipGarbage,
    /// A spacing is 0, not a number, or not of this world; 1 was used.
    Spacing {
        /// The axis, from 0.
        axis: usize,
        /// The spacing.
        given: f64,
    },
    /// The place of the voxels in a NIfTI file lies inside its header.
    DataOffset {
        /// What the header says.
        given: f64,
        /// What was used.
        used: u64,
    },
    /// Slope or intercept cannot be used; there is no scaling.
    ScaleIgnored {
        /// The slope.
        slope: f64,
        /// The intercept.
        intercept: f64,
    },
    /// The bits per voxel of a NIfTI header are not those of its type; the type was used.
    Bits {
        /// What the header says.
        given: i32,
        /// The type.
        voxel_type: VoxelType,
    },
    /// A description of the grid's place in space cannot be used.
    PlacementUnusable {
        /// Which.
        source: PlacementSource,
    },
    /// Two descriptions of the grid's place in space differ.
    PlacementsDisagree {
        /// The one that is used.
        used: PlacementSource,
        /// The other.
        other: PlacementSource,
    },
    /// A description of the grid's place has other distances between voxels; they were not used.
    PlacementSpacing {
        /// Which.
        source: PlacementSource,
        /// Its distances.
        given: [f32; 3],
    },
    /// Header fields that are unknown were skipped.
    UnknownFields {
        /// How many.
        count: usize,
        /// The line of the first.
        line: usize,
        /// Its beginning.
        example: String,
    },
    /// Values were rounded to single precision.
    Rounded {
        /// How many.
        count: usize,
        /// The type they had.
        from: VoxelType,
    },
    /// Values are too large for single precision; they became the largest or smallest value.
    TooLarge {
        /// How many.
        count: usize,
    },
    /// Voxels without a value (NaN).
    Missing {
        /// How many.
        count: usize,
    },
    /// Infinite values; they became the largest or smallest value.
    Infinite {
        /// How many.
        count: usize,
    },
}

/// Numbers are written with an exponent where they are long.
impl fmt::Display for Warning {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let plural = |count: usize, one: &'static str, several: &'static str| match count {
            1 => format!("1 {one}"),
            _ => format!("{count} {several}"),
        };
        match self {
            Self::ExtraData { bytes: Some(bytes) } => {
                write!(f, "{bytes} bytes behind the voxels were not read")
            }
            Self::ExtraData { bytes: None } => {
                f.write_str("there are more voxels than the header says; the rest was not read")
            }
            Self::GzipGarbage => {
                f.write_str("the gzip data are followed by something else, which was not read")
            }
            Self::Spacing { axis, given } => {
                let name = ["x", "y", "z"].get(*axis).unwrap_or(&"?");
                write!(f, "the spacing along {name} is {given:?}; 1 is used")
            }
            Self::DataOffset { given, used } => write!(
                f,
                "the voxels are said to begin at byte {given:?}, inside the header; {used} is used"
            ),
            Self::ScaleIgnored { slope, intercept } => write!(
                f,
                "slope {slope:?} and intercept {intercept:?} cannot be used; values are not scaled"
            ),
            Self::Bits { given, voxel_type } => write!(
                f,
                "{given} bits per voxel do not fit the type, which is used: {voxel_type}"
            ),
            Self::PlacementUnusable { source } => {
                write!(f, "{source} cannot be used and is ignored")
            }
            Self::PlacementsDisagree { used, other } => {
                write!(f, "{used} and {other} disagree; {used} is used")
            }
            Self::PlacementSpacing { source, given } => write!(
                f,
                "{source} has other distances between voxels, which are not used: {:?} {:?} {:?}",
                given[0], given[1], given[2]
            ),
            Self::UnknownFields {
                count,
                line,
                example,
            } => write!(
                f,
                "{} (first `{example}` in line {line})",
                plural(
                    *count,
                    "header field is unknown and was skipped",
                    "header fields are unknown and were skipped"
                )
            ),
            Self::Rounded { count, from } => write!(
                f,
                "{} from {from} to single precision",
                plural(*count, "value was rounded", "values were rounded")
            ),
            Self::TooLarge { count } => write!(
                f,
                "{} for single precision and became the nearest that is there",
                plural(*count, "value is too large", "values are too large")
            ),
            Self::Missing { count } => f.write_str(&plural(
                *count,
                "voxel has no value (NaN)",
                "voxels have no value (NaN)",
            )),
            Self::Infinite { count } => write!(
                f,
                "{} and became the nearest finite one",
                plural(*count, "value is infinite", "values are infinite")
            ),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_and_several() {
        let texts = [1, 2].map(|count| Warning::Missing { count }.to_string());
        assert_eq!(
            texts,
            ["1 voxel has no value (NaN)", "2 voxels have no value (NaN)"]
        );
        let disagree = Warning::PlacementsDisagree {
            used: PlacementSource::Sform,
            other: PlacementSource::Qform,
        };
        assert_eq!(
            disagree.to_string(),
            "the sform and the qform disagree; the sform is used"
        );
    }
}
