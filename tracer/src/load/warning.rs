//! What was left out of a file that was accepted, as values with counts.
//!
//! A large file can have the same fault in a million places: one [`Warning`] per kind is kept,
//! with the number of occurrences and the first of them.

use std::fmt;

use super::error::excerpt;

/// What was left out or changed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
#[non_exhaustive]
pub enum WarningKind {
    /// A material library could not be read.
    MissingMaterialLibrary,
    /// A material is used that no library defines; it became a grey one of that name. The count
    /// is of names.
    UnknownMaterial,
    /// A material is defined again; the first definition is used.
    DuplicateMaterial,
    /// A value of a material cannot be read or used and was skipped.
    BadMaterialValue,
    /// A reflectance outside 0..=1 was clamped.
    ClampedReflectance,
    /// A texture exists, or was not looked for; textures are not rendered.
    IgnoredTexture,
    /// A texture is named that does not exist; it would not be rendered either.
    MissingTexture,
    /// A material has a specular part, or is a mirror or glass; only its diffuse part is rendered.
    IgnoredSpecular,
    /// A material is transparent; it is rendered as opaque.
    IgnoredTransparency,
    /// A face has vertex normals; surfaces are shaded flat.
    IgnoredNormals,
    /// A triangle of zero area was dropped.
    DegenerateTriangles,
    /// A triangle with a coordinate that is NaN or infinite was dropped.
    NonFiniteTriangles,
    /// A polygon that is not simple, or too large to look at closely, was split as if it were
    /// convex.
    FannedPolygons,
    /// A point or line element was skipped.
    IgnoredElements,
    /// A statement that is unknown or not supported was skipped.
    UnknownStatement,
}

impl WarningKind {
    /// The sentence after the count, for one and for several.
    fn sentence(self) -> (&'static str, &'static str) {
        match self {
            Self::MissingMaterialLibrary => (
                "material library cannot be read",
                "material libraries cannot be read",
            ),
            Self::UnknownMaterial => (
                "material is not defined in any library and is rendered as grey",
                "materials are not defined in any library and are rendered as grey",
            ),
            Self::DuplicateMaterial => (
                "material is defined again; the first definition is used",
                "materials are defined again; the first definitions are used",
            ),
            Self::BadMaterialValue => (
                "material value cannot be used and was skipped",
                "material values cannot be used and were skipped",
            ),
            Self::ClampedReflectance => (
                "reflectance outside 0 to 1 was clamped",
                "reflectances outside 0 to 1 were clamped",
            ),
            Self::IgnoredTexture => (
                "texture is not rendered: textures are not supported",
                "textures are not rendered: textures are not supported",
            ),
            Self::MissingTexture => (
                "texture file is missing (textures are not rendered in any case)",
                "texture files are missing (textures are not rendered in any case)",
            ),
            Self::IgnoredSpecular => (
                "material has a specular part that is not rendered",
                "materials have a specular part that is not rendered",
            ),
            Self::IgnoredTransparency => (
                "transparent material is rendered as opaque",
                "transparent materials are rendered as opaque",
            ),
            Self::IgnoredNormals => (
                "face has vertex normals, which are not used: surfaces are shaded flat",
                "faces have vertex normals, which are not used: surfaces are shaded flat",
            ),
            Self::DegenerateTriangles => (
                "triangle of zero area was dropped",
                "triangles of zero area were dropped",
            ),
            Self::NonFiniteTriangles => (
                "triangle with coordinates that are not finite was dropped",
                "triangles with coordinates that are not finite were dropped",
            ),
            Self::FannedPolygons => (
                "polygon is not simple, or has too many corners, and was split as if convex",
                "polygons are not simple, or have too many corners, and were split as if convex",
            ),
            Self::IgnoredElements => (
                "point or line element was skipped",
                "point and line elements were skipped",
            ),
            Self::UnknownStatement => (
                "statement is unknown or not supported and was skipped",
                "statements are unknown or not supported and were skipped",
            ),
        }
    }
}

/// One kind of thing that was left out, how often, and where first.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Warning {
    /// What.
    pub kind: WarningKind,
    /// How often.
    pub count: usize,
    /// The file of the first occurrence as the scene file names it; `None` is the scene file.
    pub library: Option<String>,
    /// The line of the first occurrence, from 1.
    pub line: usize,
    /// What the first occurrence says, shortened; empty if the line number says it all.
    pub example: String,
}

impl fmt::Display for Warning {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (one, several) = self.kind.sentence();
        let sentence = if self.count == 1 { one } else { several };
        let first = if self.count == 1 { "" } else { "first " };
        write!(f, "{} {sentence} ({first}", self.count)?;
        if !self.example.is_empty() {
            write!(f, "`{}` ", self.example)?;
        }
        write!(f, "at ")?;
        if let Some(library) = &self.library {
            write!(f, "{library}, ")?;
        }
        write!(f, "line {})", self.line)
    }
}

/// Where something was found.
#[derive(Clone, Copy, Debug)]
pub(super) struct Place<'a> {
    /// The material library, or `None` for the scene file.
    pub(super) library: Option<&'a str>,
    pub(super) line: usize,
}

/// Collects warnings, one per kind.
#[derive(Debug, Default)]
pub(super) struct Warnings {
    found: Vec<Warning>,
}

impl Warnings {
    pub(super) fn add(&mut self, kind: WarningKind, place: Place<'_>, example: &[u8]) {
        match self.found.iter_mut().find(|known| known.kind == kind) {
            Some(known) => known.count += 1,
            None => self.found.push(Warning {
                kind,
                count: 1,
                library: place.library.map(str::to_owned),
                line: place.line,
                example: excerpt(example),
            }),
        }
    }

    pub(super) fn count(&self, kind: WarningKind) -> usize {
        self.found
            .iter()
            .find(|known| known.kind == kind)
            .map_or(0, |known| known.count)
    }

    pub(super) fn into_sorted(mut self) -> Vec<Warning> {
        self.found.sort_by_key(|warning| warning.kind);
        self.found
    }
}

impl From<Vec<Warning>> for Warnings {
    fn from(found: Vec<Warning>) -> Self {
        Self { found }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_warning_is_a_sentence_with_count_and_first_place() {
        let mut warnings = Warnings::default();
        let at = |line| Place {
            library: Some("a.mtl"),
            line,
        };
        warnings.add(WarningKind::UnknownStatement, at(7), b"foo");
        warnings.add(WarningKind::BadMaterialValue, at(8), b"Kd x");
        warnings.add(WarningKind::UnknownStatement, at(9), b"bar");
        let texts: Vec<String> = warnings
            .into_sorted()
            .iter()
            .map(ToString::to_string)
            .collect();
        assert_eq!(
            texts,
            [
                "1 material value cannot be used and was skipped (`Kd x` at a.mtl, line 8)",
                "2 statements are unknown or not supported and were skipped \
                 (first `foo` at a.mtl, line 7)",
            ]
        );
    }

    #[test]
    fn quotes_are_short() {
        let mut warnings = Warnings::default();
        let place = Place {
            library: None,
            line: 1,
        };
        warnings.add(WarningKind::UnknownStatement, place, &[b'x'; 1 << 20]);
        assert!(warnings.into_sorted()[0].to_string().len() < 200);
    }
}
