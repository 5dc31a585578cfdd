//! Wavefront MTL: material libraries of OBJ files.
//!
//! Source: Alias|Wavefront, "Advanced Visualizer, appendix B1: object files" and "MTL material
//! format (Lightwave, OBJ)", version 4.2, 1995. What it leaves open: a material without `Kd` gets
//! 0.8, the default that J. Burkardt's description of the format gives; one without `Ks` or `Ke`
//! has no specular part and no emission.
//!
//! Only what a [`Material`] holds is read. A value that cannot be used is skipped with a warning
//! and leaves the value before it in place: a library never makes a scene fail.

use std::collections::HashSet;

use raywright_bvh::Vec3;

use super::number;
use super::text::Cursor;
use super::warning::{Place, WarningKind, Warnings};
use crate::scene::Material;

const DEFAULT_DIFFUSE: f32 = 0.8;

/// A texture that a library names.
#[derive(Clone, Debug)]
pub(super) struct TextureReference {
    pub(super) name: String,
    pub(super) library: String,
    pub(super) line: usize,
}

/// The materials of all libraries of a file.
#[derive(Debug, Default)]
pub(super) struct Library {
    pub(super) materials: Vec<Material>,
    pub(super) textures: Vec<TextureReference>,
    names: HashSet<String>,
}

/// A material that is being read.
struct Draft {
    material: Material,
    line: usize,
    illumination: Option<f32>,
    opacity: f32,
}

impl Library {
    /// Adds the materials of library `name`. Names that an earlier definition took are skipped:
    /// the format searches its libraries in the order in which they are listed.
    pub(super) fn read(&mut self, bytes: &[u8], name: &str, warnings: &mut Warnings) {
        let mut cursor = Cursor::new(bytes);
        let mut draft: Option<Draft> = None;
        while let Some(keyword) = cursor.next_statement() {
            let line = cursor.line();
            let place = Place {
                library: Some(name),
                line,
            };
            if keyword == b"newmtl" {
                if let Some(done) = draft.replace(Draft::new(cursor.rest(), line)) {
                    self.finish(done, name, warnings);
                }
                continue;
            }
            let values = cursor.quote();
            let quote = || [keyword, b" ", values].concat();
            let Some(current) = &mut draft else {
                warnings.add(WarningKind::UnknownStatement, place, &quote());
                continue;
            };
            if is_texture(keyword) {
                self.textures.push(TextureReference {
                    name: texture_name(&mut cursor),
                    library: name.to_owned(),
                    line,
                });
                continue;
            }
            match current.statement(keyword, &mut cursor) {
                Outcome::Used => {}
                Outcome::Clamped => warnings.add(WarningKind::ClampedReflectance, place, &quote()),
                Outcome::BadValue => warnings.add(WarningKind::BadMaterialValue, place, &quote()),
                Outcome::Unknown => warnings.add(WarningKind::UnknownStatement, place, &quote()),
            }
        }
        if let Some(done) = draft {
            self.finish(done, name, warnings);
        }
    }

    fn finish(&mut self, draft: Draft, library: &str, warnings: &mut Warnings) {
        let place = Place {
            library: Some(library),
            line: draft.line,
        };
        let name = &draft.material.name;
        if !self.names.insert(name.clone()) {
            warnings.add(WarningKind::DuplicateMaterial, place, name.as_bytes());
            return;
        }
        // Models 3 to 9 of the format are the mirrors and glasses.
        let mirror_or_glass = draft.illumination.is_some_and(|model| model >= 3.0);
        if draft.material.specular != Vec3::ZERO || mirror_or_glass {
            warnings.add(WarningKind::IgnoredSpecular, place, name.as_bytes());
        }
        if draft.opacity < 1.0 {
            warnings.add(WarningKind::IgnoredTransparency, place, name.as_bytes());
        }
        self.materials.push(draft.material);
    }
}

/// What became of a statement.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Outcome {
    Used,
    Clamped,
    BadValue,
    Unknown,
}

impl Draft {
    fn new(name: String, line: usize) -> Self {
        Self {
            material: Material::diffuse(name, Vec3::splat(DEFAULT_DIFFUSE)),
            line,
            illumination: None,
            opacity: 1.0,
        }
    }

    fn statement(&mut self, keyword: &[u8], cursor: &mut Cursor<'_>) -> Outcome {
        let material = &mut self.material;
        match keyword {
            b"Kd" => set_reflectance(&mut material.diffuse, cursor),
            b"Ks" => set_reflectance(&mut material.specular, cursor),
            b"Ke" => match colour(cursor) {
                Some(emission) if emission.cmpge(Vec3::ZERO).all() => {
                    material.emission = emission;
                    Outcome::Used
                }
                _ => Outcome::BadValue,
            },
            b"illum" => match scalar(cursor) {
                Some(model) => {
                    self.illumination = Some(model);
                    Outcome::Used
                }
                None => Outcome::BadValue,
            },
            b"d" => {
                let after_option = cursor.clone().token() == Some(b"-halo");
                if after_option {
                    cursor.token();
                }
                self.set_opacity(scalar(cursor))
            }
            b"Tr" => self.set_opacity(scalar(cursor).map(|transparency| 1.0 - transparency)),
            // Ambient, exponent, refraction, filter, and the physically based extension: nothing
            // of a diffuse surface depends on them.
            b"Ka" | b"Ns" | b"Ni" | b"Tf" | b"sharpness" | b"Pr" | b"Pm" | b"Ps" | b"Pc"
            | b"Pcr" | b"aniso" | b"anisor" => Outcome::Used,
            _ => Outcome::Unknown,
        }
    }

    fn set_opacity(&mut self, opacity: Option<f32>) -> Outcome {
        match opacity {
            Some(value) if (0.0..=1.0).contains(&value) => {
                self.opacity = value;
                Outcome::Used
            }
            _ => Outcome::BadValue,
        }
    }
}

fn set_reflectance(target: &mut Vec3, cursor: &mut Cursor<'_>) -> Outcome {
    let Some(value) = colour(cursor) else {
        return Outcome::BadValue;
    };
    *target = value.clamp(Vec3::ZERO, Vec3::ONE);
    if *target == value {
        Outcome::Used
    } else {
        Outcome::Clamped
    }
}

/// One finite number.
fn scalar(cursor: &mut Cursor<'_>) -> Option<f32> {
    number::parse(cursor.token()?).filter(|value| value.is_finite())
}

/// One number for all channels, or three. The forms `spectral file` and `xyz x y z` are not
/// supported and fail as no number.
fn colour(cursor: &mut Cursor<'_>) -> Option<Vec3> {
    let first = scalar(cursor)?;
    if cursor.clone().token().is_none() {
        return Some(Vec3::splat(first));
    }
    Some(Vec3::new(first, scalar(cursor)?, scalar(cursor)?))
}

fn is_texture(keyword: &[u8]) -> bool {
    keyword.starts_with(b"map_")
        || matches!(keyword, b"bump" | b"disp" | b"decal" | b"refl" | b"norm")
}

/// The file name behind the options of a texture statement. Names may contain blanks, so that
/// the options have to be known to tell where they end.
fn texture_name(cursor: &mut Cursor<'_>) -> String {
    loop {
        let before = cursor.clone();
        let Some(option) = cursor.token() else {
            return String::new();
        };
        let values = match option {
            b"-blendu" | b"-blendv" | b"-cc" | b"-clamp" | b"-imfchan" | b"-type" | b"-boost"
            | b"-bm" | b"-texres" => 1,
            b"-mm" => 2,
            // One to three numbers.
            b"-o" | b"-s" | b"-t" => {
                for _ in 0..3 {
                    let before = cursor.clone();
                    if cursor.token().and_then(number::parse).is_none() {
                        *cursor = before;
                        break;
                    }
                }
                0
            }
            _ => {
                *cursor = before;
                return cursor.rest();
            }
        };
        for _ in 0..values {
            cursor.token();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str) -> (Library, Vec<(WarningKind, usize, usize)>) {
        let mut library = Library::default();
        let mut warnings = Warnings::default();
        library.read(text.as_bytes(), "a.mtl", &mut warnings);
        let found = warnings.into_sorted();
        let short = found.iter().map(|w| (w.kind, w.count, w.line)).collect();
        (library, short)
    }

    fn one(text: &str) -> (Material, Vec<(WarningKind, usize, usize)>) {
        let (library, warnings) = read(&format!("newmtl m\n{text}"));
        assert_eq!(library.materials.len(), 1);
        (library.materials[0].clone(), warnings)
    }

    #[test]
    fn values_of_a_material() {
        let (library, warnings) = read(
            "newmtl bright wall # c\r\n\tKd 0.1 .2 3e-1\r\nKe 4 5 6\nNs 10\nNi 1\nd 1\nillum 2\n\
             newmtl\nKd 0.5",
        );
        let wall = Material::diffuse("bright wall", Vec3::new(0.1, 0.2, 0.3))
            .with_emission(Vec3::new(4.0, 5.0, 6.0));
        let unnamed = Material::diffuse("", Vec3::splat(0.5));
        assert_eq!(library.materials, [wall, unnamed]);
        assert_eq!(warnings, []);
    }

    #[test]
    fn a_material_without_kd_has_the_default() {
        assert_eq!(one("Ka 0 0 0").0.diffuse, Vec3::splat(DEFAULT_DIFFUSE));
    }

    #[test]
    fn reflectance_is_clamped_with_a_count() {
        let (material, warnings) = one("Kd 1.5 -0.25 0.5\nKs 0 2 0");
        assert_eq!(material.diffuse, Vec3::new(1.0, 0.0, 0.5));
        assert_eq!(material.specular, Vec3::Y);
        assert_eq!(
            warnings,
            [
                (WarningKind::ClampedReflectance, 2, 2),
                (WarningKind::IgnoredSpecular, 1, 1)
            ]
        );
    }

    #[test]
    fn bad_values_leave_the_value_before() {
        for bad in [
            "Kd",
            "Kd red",
            "Kd 0.1 0.2",
            "Kd nan nan nan",
            "Kd xyz 0.1 0.2 0.3",
            "Kd spectral a.rfl 1",
            "Ke -1 0 0",
            "Ke inf",
            "d 2",
            "Tr x",
            "illum mirror",
        ] {
            let (material, warnings) = one(&format!("Kd 0.25\nKe 2\n{bad}"));
            assert_eq!(material.diffuse, Vec3::splat(0.25), "{bad}");
            assert_eq!(material.emission, Vec3::splat(2.0), "{bad}");
            assert_eq!(warnings, [(WarningKind::BadMaterialValue, 1, 4)], "{bad}");
        }
    }

    #[test]
    fn mirrors_and_glass_are_reported() {
        let (_, mirror) = one("Kd 0\nillum 3");
        assert_eq!(mirror, [(WarningKind::IgnoredSpecular, 1, 1)]);
        for transparent in ["d 0.1", "d -halo 0.1", "Tr 0.9"] {
            let (_, glass) = one(transparent);
            assert_eq!(glass, [(WarningKind::IgnoredTransparency, 1, 1)]);
        }
    }

    #[test]
    fn the_first_definition_of_a_name_is_used() {
        let (library, warnings) = read("newmtl a\nKd 0.1\nnewmtl b\nnewmtl a\nKd 0.2");
        assert_eq!(library.materials.len(), 2);
        assert_eq!(library.materials[0].diffuse, Vec3::splat(0.1));
        assert_eq!(warnings, [(WarningKind::DuplicateMaterial, 1, 4)]);
    }

    /// Twinklebear/tobj#25 read `map_Ns` as a normal map; options precede the name, which may
    /// have blanks.
    #[test]
    fn texture_names_behind_options() {
        let (library, warnings) = read(
            "newmtl m\nmap_Kd -s 2 2 1 -bm 0.5 wood floor.png\nmap_Ns -o 1 -clamp on rough.png\n\
             bump -mm 0 1 b.png # c\nmap_Kd",
        );
        let names: Vec<&str> = library.textures.iter().map(|t| t.name.as_str()).collect();
        assert_eq!(names, ["wood floor.png", "rough.png", "b.png", ""]);
        assert_eq!(warnings, []);
    }

    #[test]
    fn unknown_statements_and_statements_without_a_material() {
        let (library, warnings) = read("Kd 1 1 1\nnewmtl m\nshiny 3");
        assert_eq!(library.materials[0].diffuse, Vec3::splat(DEFAULT_DIFFUSE));
        assert_eq!(warnings, [(WarningKind::UnknownStatement, 2, 1)]);
    }
}
