//! Golden rays: small scenes and rays whose hits were computed with exact fractions.
//!
//! Source: `cases.json` beside the README in the folder `golden/robust` of the shared data. Its rule: triangles
//! and intervals are closed, triangles have two sides, zero area is never hit, nor is a triangle in whose plane
//! a ray lies.

use std::{fs, path::Path};

use raywright_bvh::{Ray, Vec3};
use serde::Deserialize;

use super::GoldenError;

/// A scene with its rays.
#[derive(Clone, Debug, Deserialize)]
#[non_exhaustive]
pub struct Case {
    /// Its name.
    pub id: String,
    /// What its rays are to show.
    pub title: String,
    /// Coordinates as bits of f32, in hexadecimal digits.
    vertex_bits: Vec<[String; 3]>,
    /// Three vertices for each triangle.
    pub triangles: Vec<[u32; 3]>,
    /// The rays.
    pub rays: Vec<GoldenRay>,
    /// What a build has to say, where a triangle is not sound.
    pub build: Option<Refusal>,
}

/// What a build says of a triangle that is not sound.
#[derive(Clone, Debug, Deserialize)]
#[non_exhaustive]
pub struct Refusal {
    /// If nothing is skipped.
    pub strict: String,
    /// If it is skipped; absent where that is no way out.
    pub skip: Option<String>,
}

/// What a ray has to find.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Expectation {
    /// A hit.
    Hit,
    /// Nothing.
    Miss,
    /// Nothing, without a search: the ray is none.
    InvalidRay,
}

/// A ray and its exact hit.
#[derive(Clone, Debug, Deserialize)]
#[non_exhaustive]
pub struct GoldenRay {
    origin_bits: [String; 3],
    dir_bits: [String; 3],
    tnear: Number,
    tfar: Number,
    /// What it has to find.
    pub expect: Expectation,
    /// Distance of the nearest hit.
    pub t: Option<f64>,
    /// All triangles at that distance.
    #[serde(default)]
    pub accept_prims: Vec<u32>,
    /// Weights of the second and third vertex in the first of these.
    pub uv_of_first: Option<[f64; 2]>,
    /// Its smallest weight.
    pub min_bary: Option<f64>,
    /// Whether the hit is in the interior, on an edge or on a vertex.
    #[serde(default)]
    pub location: Vec<String>,
}

#[derive(Clone, Debug, Deserialize)]
#[serde(untagged)]
enum Number {
    Finite(f32),
    Named(String),
}

impl Number {
    fn value(&self) -> f32 {
        match self {
            Self::Finite(value) => *value,
            // "inf", "-inf", "nan".
            Self::Named(name) => name.parse().unwrap_or(f32::NAN),
        }
    }
}

fn vector(bits: &[String; 3]) -> Vec3 {
    let number = |digits: &String| u32::from_str_radix(digits, 16).map(f32::from_bits);
    let [x, y, z] = bits
        .each_ref()
        .map(|digits| number(digits).unwrap_or(f32::NAN));
    Vec3::new(x, y, z)
}

impl Case {
    /// The vertices.
    #[must_use]
    pub fn vertices(&self) -> Vec<Vec3> {
        self.vertex_bits.iter().map(vector).collect()
    }
}

impl GoldenRay {
    /// The ray.
    #[must_use]
    pub fn ray(&self) -> Ray {
        Ray::new(vector(&self.origin_bits), vector(&self.dir_bits))
            .with_range(self.tnear.value(), self.tfar.value())
    }

    /// Whether the hit lies on an edge or a vertex of some triangle.
    #[must_use]
    pub fn is_on_border(&self) -> bool {
        self.location.iter().any(|place| place != "interior")
    }
}

/// The cases of a file.
///
/// # Errors
/// If it cannot be read, or is not what its README says.
pub fn read_cases(path: &Path) -> Result<Vec<Case>, GoldenError> {
    #[derive(Deserialize)]
    struct Cases {
        cases: Vec<Case>,
    }
    let text = fs::read_to_string(path).map_err(|source| GoldenError::Io {
        path: path.to_owned(),
        source,
    })?;
    let cases: Cases = serde_json::from_str(&text).map_err(|source| GoldenError::Json {
        path: path.to_owned(),
        line: source.line(),
        source,
    })?;
    Ok(cases.cases)
}
