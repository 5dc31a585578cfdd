//! Values of NRRD fields: numbers, lists of them, vectors, names.

use super::{
    super::{HeaderError, Place, VoxelType, error::quote},
    lines::Field,
};

impl Field {
    /// The error that this value is not what is expected.
    pub(super) fn refused(&self, expected: &'static str) -> HeaderError {
        HeaderError::Value {
            place: Place::Line(self.line),
            field: self.name,
            found: quote(&self.value),
            expected,
        }
    }

    /// The value as text without regard to case; empty if it is none.
    pub(super) fn lower(&self) -> String {
        str::from_utf8(&self.value)
            .unwrap_or("")
            .to_ascii_lowercase()
    }

    /// A number.
    pub(super) fn number<T: std::str::FromStr>(
        &self,
        expected: &'static str,
    ) -> Result<T, HeaderError> {
        let text = str::from_utf8(&self.value).ok();
        text.and_then(|text| text.parse().ok())
            .ok_or_else(|| self.refused(expected))
    }

    /// A number for each axis.
    pub(super) fn numbers<T: std::str::FromStr>(
        &self,
        axes: usize,
        expected: &'static str,
    ) -> Result<Vec<T>, HeaderError> {
        let text = str::from_utf8(&self.value).ok();
        let numbers: Option<Vec<T>> = text.and_then(|text| {
            // One more than needed shows that there are too many.
            let words = text.split_ascii_whitespace().take(axes + 1);
            words.map(|word| word.parse().ok()).collect()
        });
        numbers
            .filter(|numbers| numbers.len() == axes)
            .ok_or_else(|| self.refused(expected))
    }

    /// Vectors in parentheses, or `none`; at most `limit` of them.
    pub(super) fn vectors(&self, limit: usize) -> Result<Vec<Option<Vec<f64>>>, HeaderError> {
        let refused = || self.refused("a vector (x,y,z) or `none` for each axis");
        let text = str::from_utf8(&self.value).map_err(|_| refused())?;
        let mut rest = text.trim_ascii_start();
        let mut vectors = Vec::new();
        while !rest.is_empty() {
            if vectors.len() == limit {
                return Err(refused());
            }
            if let Some(behind) = rest.strip_prefix("none") {
                vectors.push(None);
                rest = behind.trim_ascii_start();
                continue;
            }
            let inside = rest.strip_prefix('(').and_then(|rest| rest.split_once(')'));
            let (inside, behind) = inside.ok_or_else(refused)?;
            let numbers: Result<Vec<f64>, _> =
                inside.split(',').map(|word| word.trim().parse()).collect();
            vectors.push(Some(numbers.map_err(|_| refused())?));
            rest = behind.trim_ascii_start();
        }
        Ok(vectors)
    }

    /// The type of voxels.
    pub(super) fn voxel_type(&self) -> Result<VoxelType, HeaderError> {
        let words: Vec<String> = self
            .lower()
            .split_ascii_whitespace()
            .map(str::to_owned)
            .collect();
        Ok(match words.join(" ").as_str() {
            "signed char" | "int8" | "int8_t" => VoxelType::I8,
            "uchar" | "unsigned char" | "uint8" | "uint8_t" => VoxelType::U8,
            "short" | "short int" | "signed short" | "signed short int" | "int16" | "int16_t" => {
                VoxelType::I16
            }
            "ushort" | "unsigned short" | "unsigned short int" | "uint16" | "uint16_t" => {
                VoxelType::U16
            }
            "int" | "signed int" | "int32" | "int32_t" => VoxelType::I32,
            "uint" | "unsigned int" | "uint32" | "uint32_t" => VoxelType::U32,
            "float" => VoxelType::F32,
            "double" => VoxelType::F64,
            _ => {
                return Err(HeaderError::VoxelType {
                    place: Place::Line(self.line),
                    name: quote(&self.value),
                });
            }
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn field(value: &str) -> Field {
        Field {
            name: "sizes",
            line: 3,
            value: value.into(),
        }
    }

    #[test]
    fn numbers_one_per_axis() {
        let numbers = |text: &str| field(text).numbers::<u64>(3, "three").ok();
        assert_eq!(numbers("1 2\t 3"), Some(vec![1, 2, 3]));
        for text in [
            "1 2",
            "1 2 3 4",
            "1 2 -3",
            "1 2 x",
            "1 2 99999999999999999999",
            "",
        ] {
            assert_eq!(numbers(text), None, "{text}");
        }
        let not_utf8 = Field {
            value: vec![b'1', 0xff],
            ..field("")
        };
        assert!(not_utf8.numbers::<u64>(1, "one").is_err());
    }

    #[test]
    fn vectors_and_none() {
        let vectors = |text: &str| field(text).vectors(4).ok();
        let v = |numbers: &[f64]| Some(numbers.to_vec());
        assert_eq!(
            vectors("none (1,2, 3)( -1e0 ,0,0.5 )"),
            Some(vec![None, v(&[1.0, 2.0, 3.0]), v(&[-1.0, 0.0, 0.5])])
        );
        for text in ["(1,2", "1,2,3", "(a)", "()", "(1) (1) (1) (1) (1)", "none,"] {
            assert_eq!(vectors(text), None, "{text}");
        }
    }

    #[test]
    fn all_names_of_types() {
        for (names, expected) in [
            ("signed char,int8,int8_t", VoxelType::I8),
            ("uchar,unsigned char,uint8,uint8_t", VoxelType::U8),
            (
                "short,short int,signed short,signed short int,int16,int16_t",
                VoxelType::I16,
            ),
            (
                "ushort,unsigned short,unsigned short int,uint16,uint16_t",
                VoxelType::U16,
            ),
            ("int,signed int,int32,int32_t", VoxelType::I32),
            ("uint,unsigned int,uint32,uint32_t", VoxelType::U32),
            ("float,FLOAT", VoxelType::F32),
            ("double", VoxelType::F64),
        ] {
            for name in names.split(',') {
                assert_eq!(field(name).voxel_type(), Ok(expected), "{name}");
            }
        }
        for name in ["long long", "uint64", "block", "char", "complex", ""] {
            let error = field(name).voxel_type().unwrap_err().to_string();
            assert!(error.contains(name) && error.contains("line 3"), "{error}");
        }
    }
}
