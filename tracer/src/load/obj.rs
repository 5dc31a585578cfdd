//! Wavefront OBJ: triangles and polygons with materials.
//!
//! Source: Alias|Wavefront, "Advanced Visualizer, appendix B1: object files (.obj)". A parser of
//! our own, since the crate `tobj` gives neither line numbers in errors nor anything but fans for
//! polygons, and reads past values it does not understand.
//!
//! Invariants: one pass; a face may use only what earlier lines define, so that negative indices
//! and checks see the lists as they are at that line (mikedh/trimesh#2364,
//! CesiumGS/obj2gltf#184). No triangle has zero area.
//!
//! Not read: curves,
//! surfaces, points, lines, and the values of texture coordinates and normals (both are checked).

use std::collections::HashSet;
use std::io;

use raywright_bvh::{TriangleMesh, Vec3};

use super::error::{IndexKind, ParseError, SyntaxFault, excerpt};
use super::groups::Groups;
use super::index::{corner, place_in_list};
use super::mtl::{Library, TextureReference};
use super::number;
use super::polygon::{Split, Triangulator};
use super::text::Cursor;
use super::warning::{Place, WarningKind, Warnings};
use super::{Limits, Loaded};
use crate::scene::Scene;

/// Reads an OBJ file from memory. `resolve` gives the bytes of a material library by its name in
/// the file; a library that it cannot give is a warning. Textures are not looked for.
///
/// Of `limits`, the number of bytes holds for the libraries: those of the file are there already.
///
/// # Errors
/// The first line that cannot be read, or that there is nothing to render: see [`ParseError`].
pub fn read_obj(
    bytes: &[u8],
    resolve: &mut dyn FnMut(&str) -> io::Result<Vec<u8>>,
    limits: &Limits,
) -> Result<Loaded, ParseError> {
    let (mut loaded, textures) = parse(bytes, resolve, limits)?;
    report_textures(&mut loaded, &textures, |_| true);
    Ok(loaded)
}

/// [`read_obj`] without the warnings on textures, which need [`report_textures`].
pub(super) fn parse(
    bytes: &[u8],
    resolve: &mut dyn FnMut(&str) -> io::Result<Vec<u8>>,
    limits: &Limits,
) -> Result<(Loaded, Vec<TextureReference>), ParseError> {
    let mut parser = Parser::new(bytes, limits);
    while let Some(keyword) = parser.cursor.next_statement() {
        parser.statement(keyword, resolve)?;
    }
    parser.finish()
}

/// Adds a warning for each texture, which `exists` or does not.
pub(super) fn report_textures(
    loaded: &mut Loaded,
    textures: &[TextureReference],
    mut exists: impl FnMut(&str) -> bool,
) {
    let mut warnings = Warnings::from(std::mem::take(&mut loaded.warnings));
    for texture in textures {
        let kind = if exists(&texture.name) {
            WarningKind::IgnoredTexture
        } else {
            WarningKind::MissingTexture
        };
        let place = Place {
            library: Some(&texture.library),
            line: texture.line,
        };
        warnings.add(kind, place, texture.name.as_bytes());
    }
    loaded.warnings = warnings.into_sorted();
}

struct Parser<'a> {
    cursor: Cursor<'a>,
    max_triangles: usize,
    positions: Vec<Vec3>,
    texture_coordinates: usize,
    normals: usize,
    groups: Groups,
    library: Library,
    /// The names of the libraries that were read.
    libraries: HashSet<String>,
    /// How many bytes of libraries may still be read.
    library_bytes_left: u64,
    faces: usize,
    triangles: usize,
    warnings: Warnings,
    triangulator: Triangulator,
    /// The face being read: indices into `positions`, and the positions.
    corners: Vec<u32>,
    corner_positions: Vec<Vec3>,
}

impl<'a> Parser<'a> {
    fn new(bytes: &'a [u8], limits: &Limits) -> Self {
        Self {
            cursor: Cursor::new(bytes),
            max_triangles: limits.max_triangles.min(TriangleMesh::MAX_TRIANGLES),
            positions: Vec::new(),
            texture_coordinates: 0,
            normals: 0,
            groups: Groups::default(),
            library: Library::default(),
            libraries: HashSet::new(),
            library_bytes_left: limits.max_bytes,
            faces: 0,
            triangles: 0,
            warnings: Warnings::default(),
            triangulator: Triangulator::default(),
            corners: Vec::new(),
            corner_positions: Vec::new(),
        }
    }

    fn statement(
        &mut self,
        keyword: &[u8],
        resolve: &mut dyn FnMut(&str) -> io::Result<Vec<u8>>,
    ) -> Result<(), ParseError> {
        let line = self.cursor.line();
        match keyword {
            b"v" => {
                let position = self.position(line)?;
                self.positions.push(position);
            }
            b"vt" => {
                self.check_numbers("vt", 1, "1 to 3", line)?;
                self.texture_coordinates += 1;
            }
            b"vn" => {
                self.check_numbers("vn", 3, "3", line)?;
                self.normals += 1;
            }
            b"f" | b"fo" => self.face(line)?,
            b"o" => self.groups.object(self.cursor.rest(), line),
            b"g" => self.groups.group(self.cursor.rest(), line),
            b"usemtl" => self.groups.material(self.cursor.rest(), line),
            b"mtllib" => self.material_libraries(line, resolve),
            // Smoothing groups change shading normals only.
            b"s" => {}
            b"l" | b"p" => self.warn(WarningKind::IgnoredElements, line, keyword),
            _ => self.warn(WarningKind::UnknownStatement, line, keyword),
        }
        Ok(())
    }

    fn warn(&mut self, kind: WarningKind, line: usize, example: &[u8]) {
        let place = Place {
            library: None,
            line,
        };
        self.warnings.add(kind, place, example);
    }

    fn number(&mut self, line: usize) -> Result<Option<f32>, ParseError> {
        let Some(token) = self.cursor.token() else {
            return Ok(None);
        };
        match number::parse(token) {
            Some(value) => Ok(Some(value)),
            None => Err(ParseError::Syntax {
                line,
                fault: SyntaxFault::NotANumber {
                    token: excerpt(token),
                },
            }),
        }
    }

    /// `x y z`, `x y z w`, `x y z r g b` or `x y z w r g b`. The weight w is for rational curves
    /// and surfaces and does not change a corner of a face; it must not be taken for a colour
    /// (Twinklebear/tobj#52), and colours of vertices are not rendered.
    fn position(&mut self, line: usize) -> Result<Vec3, ParseError> {
        let mut position = Vec3::ZERO;
        let mut count = 0;
        while let Some(value) = self.number(line)? {
            if count < 3 {
                position[count] = value;
            }
            count += 1;
        }
        match count {
            3 | 4 | 6 | 7 => Ok(position),
            _ => Err(number_count("v", count, "3, 4, 6 or 7", line)),
        }
    }

    fn check_numbers(
        &mut self,
        keyword: &'static str,
        at_least: usize,
        allowed: &'static str,
        line: usize,
    ) -> Result<(), ParseError> {
        let mut count = 0;
        while self.number(line)?.is_some() {
            count += 1;
        }
        if (at_least..=3).contains(&count) {
            Ok(())
        } else {
            Err(number_count(keyword, count, allowed, line))
        }
    }

    fn face(&mut self, line: usize) -> Result<(), ParseError> {
        self.corners.clear();
        self.corner_positions.clear();
        let mut has_normal = false;
        while let Some(token) = self.cursor.token() {
            let [position, texture_coordinate, normal] =
                corner(token).ok_or_else(|| ParseError::Syntax {
                    line,
                    fault: SyntaxFault::NotACorner {
                        token: excerpt(token),
                    },
                })?;
            let check = |kind, index: Option<i64>, count| {
                index.map_or(Ok(0), |index| place_in_list(index, count, kind, line))
            };
            let number = check(IndexKind::Position, position, self.positions.len())?;
            check(
                IndexKind::TextureCoordinate,
                texture_coordinate,
                self.texture_coordinates,
            )?;
            check(IndexKind::Normal, normal, self.normals)?;
            has_normal |= normal.is_some();
            self.corners.push(number);
            self.corner_positions.push(self.positions[number as usize]);
        }
        if self.corners.len() < 3 {
            return Err(ParseError::Syntax {
                line,
                fault: SyntaxFault::TooFewCorners {
                    count: self.corners.len(),
                },
            });
        }
        self.faces += 1;
        if has_normal {
            self.warn(WarningKind::IgnoredNormals, line, b"");
        }
        self.add_triangles(line)
    }

    /// Splits the face in `corners` and keeps what has an area.
    fn add_triangles(&mut self, line: usize) -> Result<(), ParseError> {
        let triangles = self.groups.triangles();
        let before = triangles.len();
        let (mut degenerate, mut non_finite) = (0, 0);
        let split = self.triangulator.split(&self.corner_positions, |triangle| {
            let positions = triangle.map(|i| self.corner_positions[i]);
            if !positions.iter().all(|p| p.is_finite()) {
                non_finite += 1;
            } else if has_no_area(positions) {
                degenerate += 1;
            } else {
                triangles.push(triangle.map(|i| self.corners[i]));
            }
        });
        self.triangles += triangles.len() - before;
        if self.triangles > self.max_triangles {
            return Err(ParseError::TooManyTriangles {
                line,
                limit: self.max_triangles,
            });
        }
        for _ in 0..degenerate {
            self.warn(WarningKind::DegenerateTriangles, line, b"");
        }
        for _ in 0..non_finite {
            self.warn(WarningKind::NonFiniteTriangles, line, b"");
        }
        if split == Split::Fanned && non_finite == 0 {
            self.warn(WarningKind::FannedPolygons, line, b"");
        }
        Ok(())
    }

    /// `mtllib`: one name that may have blanks (Twinklebear/tobj#63, #64), or else several.
    fn material_libraries(
        &mut self,
        line: usize,
        resolve: &mut dyn FnMut(&str) -> io::Result<Vec<u8>>,
    ) {
        let whole = self.cursor.rest();
        if whole.is_empty() || self.read_library(&whole, resolve) {
            return;
        }
        let mut missing: Vec<&str> = whole.split_whitespace().collect();
        let count = missing.len();
        if count > 1 {
            missing.retain(|name| !self.read_library(name, resolve));
        }
        // None of several found: then it was one name after all.
        let names = if missing.len() == count {
            vec![whole.as_str()]
        } else {
            missing
        };
        for name in names {
            self.warn(WarningKind::MissingMaterialLibrary, line, name.as_bytes());
        }
    }

    /// Whether there is such a library; reads it the first time.
    fn read_library(
        &mut self,
        name: &str,
        resolve: &mut dyn FnMut(&str) -> io::Result<Vec<u8>>,
    ) -> bool {
        if self.libraries.contains(name) {
            return true;
        }
        if self.library_bytes_left == 0 {
            return false;
        }
        let Ok(bytes) = resolve(name) else {
            return false;
        };
        // Many names can lead to one file: what counts is what is read in all.
        let left = self.library_bytes_left.checked_sub(bytes.len() as u64);
        self.library_bytes_left = left.unwrap_or(0);
        if left.is_none() {
            return false;
        }
        self.libraries.insert(name.to_owned());
        self.library.read(&bytes, name, &mut self.warnings);
        true
    }

    fn finish(mut self) -> Result<(Loaded, Vec<TextureReference>), ParseError> {
        if self.faces == 0 {
            return Err(ParseError::NoFaces);
        }
        if self.triangles == 0 {
            return Err(ParseError::NoUsableTriangles {
                degenerate: self.warnings.count(WarningKind::DegenerateTriangles),
                non_finite: self.warnings.count(WarningKind::NonFiniteTriangles),
            });
        }
        let mut scene = Scene {
            materials: self.library.materials,
            ..Scene::default()
        };
        scene.meshes =
            self.groups
                .into_meshes(&self.positions, &mut scene.materials, &mut self.warnings);
        let loaded = Loaded {
            scene,
            warnings: self.warnings.into_sorted(),
        };
        Ok((loaded, self.library.textures))
    }
}

fn number_count(
    keyword: &'static str,
    count: usize,
    allowed: &'static str,
    line: usize,
) -> ParseError {
    ParseError::Syntax {
        line,
        fault: SyntaxFault::NumberCount {
            keyword,
            count,
            allowed,
        },
    }
}

/// Whether the area is exactly zero, evaluated in `f64`, where no product underflows.
fn has_no_area(corners: [Vec3; 3]) -> bool {
    let [a, b, c] = corners.map(Vec3::as_dvec3);
    (b - a).cross(c - a) == glam::DVec3::ZERO
}
