//! Triangles of an OBJ file as the golden trees were made from: in file order, polygons as fans,
//! coordinates to the nearest f32, degenerate triangles kept.
//!
//! The tracer's loader divides concave polygons and leaves out degenerate ones, so it would give
//! other primitive numbers. Only what occurs in the scenes is read: `v` and `f` with positive
//! indices; other lines are passed over.

use std::{fs, io::Read, path::Path};

use raywright_bvh::Vec3;

use super::GoldenError;
use crate::triangles::TriangleSet;

/// The triangles of an OBJ file, gzipped if its name ends in `.gz`. Its name is that of the file
/// without endings.
///
/// # Errors
/// If the file cannot be read, or a vertex or face is not understood.
pub fn read_obj(path: &Path) -> Result<TriangleSet, GoldenError> {
    let io = |source| GoldenError::Io {
        path: path.into(),
        source,
    };
    let bytes = fs::read(path).map_err(io)?;
    let mut text = String::new();
    if path.extension().is_some_and(|ending| ending == "gz") {
        flate2::read::MultiGzDecoder::new(&bytes[..])
            .read_to_string(&mut text)
            .map_err(io)?;
    } else {
        bytes.as_slice().read_to_string(&mut text).map_err(io)?;
    }
    let triangles = parse(&text).map_err(|line| GoldenError::Obj {
        path: path.into(),
        line,
        text: text.lines().nth(line - 1).unwrap_or_default().to_owned(),
    })?;
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    Ok(TriangleSet {
        name: name.split('.').next().unwrap_or_default().to_owned(),
        triangles,
        geometries: 1,
    })
}

/// The triangles, or the number of a line that is not understood.
fn parse(text: &str) -> Result<Vec<[Vec3; 3]>, usize> {
    let (mut vertices, mut triangles) = (Vec::new(), Vec::new());
    for (number, line) in text.lines().enumerate() {
        let mut words = line.split_ascii_whitespace();
        let understood = match words.next() {
            Some("v") => vertex(words).map(|v| vertices.push(v)),
            Some("f") => face(words, &vertices, &mut triangles),
            _ => Some(()),
        };
        understood.ok_or(number + 1)?;
    }
    Ok(triangles)
}

fn vertex<'a>(mut words: impl Iterator<Item = &'a str>) -> Option<Vec3> {
    let mut coordinate = || words.next()?.parse::<f32>().ok();
    Some(Vec3::new(coordinate()?, coordinate()?, coordinate()?))
}

fn face<'a>(
    words: impl Iterator<Item = &'a str>,
    vertices: &[Vec3],
    triangles: &mut Vec<[Vec3; 3]>,
) -> Option<()> {
    let corner = |word: &str| {
        let index: usize = word.split('/').next()?.parse().ok()?;
        vertices.get(index.checked_sub(1)?).copied()
    };
    let corners: Vec<Vec3> = words.map(corner).collect::<Option<_>>()?;
    let [first, rest @ ..] = &corners[..] else {
        return None;
    };
    triangles.extend(rest.windows(2).map(|pair| [*first, pair[0], pair[1]]));
    (corners.len() >= 3).then_some(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn polygons_are_fans_and_degenerate_triangles_stay() {
        let text = "# x\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1e0 0\nusemtl a\nf 1/2 2//3 3 4\nf 1 1 2\n";
        let triangles = parse(text).expect("understood");
        assert_eq!(triangles.len(), 3);
        assert_eq!(
            triangles[1],
            [Vec3::ZERO, Vec3::new(1.0, 1.0, 0.0), Vec3::Y]
        );
        assert_eq!(triangles[2], [Vec3::ZERO, Vec3::ZERO, Vec3::X]);
    }

    #[test]
    fn a_line_that_is_not_understood_has_its_number() {
        assert_eq!(parse("v 0 0 0\nf 1 1 2\n"), Err(2));
        assert_eq!(parse("v 0 0 0\nv 0 zero 0\n"), Err(2));
        assert_eq!(parse("v 0 0 0\nf 1 1\n"), Err(2));
        assert_eq!(parse("v 0 0 0\nf 0 1 1\n"), Err(2));
    }
}
