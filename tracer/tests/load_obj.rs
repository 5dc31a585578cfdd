//! Loading OBJ files as a user does: from disk with libraries beside them, from memory with what
//! other loaders got wrong, damaged files, and the measured figures of real scenes.

use std::fs;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use flate2::Compression;
use flate2::write::GzEncoder;
use proptest::prelude::*;
use raywright_tracer::Scene;
use raywright_tracer::bvh::Vec3;
use raywright_tracer::load::{
    IndexKind, Limits, LoadError, Loaded, ParseError, SyntaxFault, WarningKind, load_scene,
    load_scene_within, read_obj,
};

const SQUARE: &str = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";

fn try_read(text: impl AsRef<[u8]>) -> Result<Loaded, ParseError> {
    let mut no_files = |_: &str| Err(io::ErrorKind::NotFound.into());
    read_obj(text.as_ref(), &mut no_files, &Limits::default())
}

fn read(text: &str) -> Loaded {
    try_read(text).unwrap_or_else(|error| panic!("{error}"))
}

fn kinds(loaded: &Loaded) -> Vec<(WarningKind, usize, usize)> {
    let short = |w: &raywright_tracer::load::Warning| (w.kind, w.count, w.line);
    loaded.warnings.iter().map(short).collect()
}

/// All corners of all triangles, in order.
fn corners(scene: &Scene) -> Vec<[Vec3; 3]> {
    let meshes = scene.meshes.iter().map(|mesh| &mesh.triangles);
    meshes
        .flat_map(|mesh| (0..mesh.triangles().len() as u32).map(|i| mesh.corners(i)))
        .collect()
}

fn area(scene: &Scene) -> f32 {
    let double = |[a, b, c]: [Vec3; 3]| (b - a).cross(c - a).length();
    0.5 * corners(scene).into_iter().map(double).sum::<f32>()
}

fn data(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("tests/data")
        .join(name)
}

fn write_gzip(path: &Path, bytes: &[u8]) -> Vec<u8> {
    let mut encoder = GzEncoder::new(Vec::new(), Compression::fast());
    encoder.write_all(bytes).unwrap();
    let packed = encoder.finish().unwrap();
    fs::write(path, &packed).unwrap();
    packed
}

#[test]
fn edge_cases_file() {
    let loaded = load_scene(&data("edge_cases.obj")).unwrap();
    // 14 faces give 17 triangles, 2 of them without area: the first line of the file.
    assert_eq!(loaded.scene.triangle_count(), 15);
    let meshes: Vec<(&str, &str)> = loaded
        .scene
        .meshes
        .iter()
        .map(|m| {
            (
                m.name.as_str(),
                loaded.scene.materials[m.material].name.as_str(),
            )
        })
        .collect();
    assert_eq!(
        meshes,
        [
            ("first object/a b c", "red"),
            ("first object/a b c", "no_such_material"),
            ("first object/a b c", "default"),
            ("default", "default"),
            ("default", "blue"),
        ]
    );
    let red = &loaded.scene.materials[0];
    assert_eq!(red.diffuse, Vec3::new(0.8, 0.1, 0.1));
    let found: Vec<(WarningKind, usize)> =
        loaded.warnings.iter().map(|w| (w.kind, w.count)).collect();
    assert_eq!(
        found,
        [
            (WarningKind::UnknownMaterial, 1),
            (WarningKind::DuplicateMaterial, 1),
            (WarningKind::BadMaterialValue, 2),
            (WarningKind::MissingTexture, 1),
            (WarningKind::IgnoredTransparency, 1),
            (WarningKind::IgnoredNormals, 3),
            (WarningKind::DegenerateTriangles, 2),
            (WarningKind::IgnoredElements, 2),
        ]
    );
}

mod public_reports {
    use super::*;

    #[test]
    fn tobj_30_a_missing_library_does_not_fail_the_mesh() {
        let loaded = read(&format!(
            "mtllib gone.mtl\n{SQUARE}usemtl wood\nf 1 2 3 4\nf 1 2 3"
        ));
        assert_eq!(loaded.scene.triangle_count(), 3);
        assert_eq!(loaded.scene.materials[0].name, "wood");
        assert_eq!(loaded.scene.materials[0].diffuse, Vec3::splat(0.5));
        assert_eq!(
            kinds(&loaded),
            [
                (WarningKind::MissingMaterialLibrary, 1, 1),
                (WarningKind::UnknownMaterial, 1, 6)
            ]
        );
        assert_eq!(
            loaded.warnings[0].to_string(),
            "1 material library cannot be read (`gone.mtl` at line 1)"
        );
    }

    #[test]
    fn tobj_63_64_library_names_with_blanks_and_several_libraries() {
        let mut asked = Vec::new();
        let mut files = |name: &str| {
            asked.push(name.to_owned());
            match name {
                "my wood.mtl" => Ok(b"newmtl wood\nKd 0.25".to_vec()),
                "b.mtl" => Ok(b"newmtl wood\nKd 1\nnewmtl tin\nKd 0.75".to_vec()),
                _ => Err(io::ErrorKind::NotFound.into()),
            }
        };
        let text = format!(
            "mtllib my wood.mtl\nmtllib a.mtl b.mtl\nmtllib b.mtl\n{SQUARE}\
             usemtl wood\nf 1 2 3\nusemtl tin\nf 1 3 4"
        );
        let loaded = read_obj(text.as_bytes(), &mut files, &Limits::default()).unwrap();
        assert_eq!(asked, ["my wood.mtl", "a.mtl b.mtl", "a.mtl", "b.mtl"]);
        let scene = &loaded.scene;
        let diffuse = |mesh: usize| scene.materials[scene.meshes[mesh].material].diffuse.x;
        assert_eq!([diffuse(0), diffuse(1)], [0.25, 0.75]);
        assert_eq!(
            kinds(&loaded),
            [
                (WarningKind::MissingMaterialLibrary, 1, 2),
                (WarningKind::DuplicateMaterial, 1, 1)
            ]
        );
    }

    #[test]
    fn tobj_52_a_weight_is_no_colour_and_colours_are_accepted() {
        let loaded = read(
            "v 0 0 0 1\nv 1 0 0 0.5 0.5 0.5\nv 0 1 0 1 0.5 0.5 0.5\nv 0 0 1\nf 1 2 3\nf 1 2 4",
        );
        let triangles = corners(&loaded.scene);
        assert_eq!(triangles[0], [Vec3::ZERO, Vec3::X, Vec3::Y]);
        assert_eq!(triangles[1], [Vec3::ZERO, Vec3::X, Vec3::Z]);
    }

    #[test]
    fn obj_rs_39_a_file_without_normals() {
        assert_eq!(
            read(&format!("{SQUARE}vt 0 0\nf 1/1 2/1 3/1"))
                .scene
                .triangle_count(),
            1
        );
    }

    #[test]
    fn trimesh_2364_and_obj2gltf_184_negative_indices_count_back_from_their_line() {
        let loaded = read(
            "v 0 0 0\nv 1 0 0\nv 0 1 0\nf -3 -2 -1\nv 0 0 5\nv 1 0 5\nv 0 1 5\nf -3 -2 -1\nf 1 -2 -1",
        );
        let lift = 5.0 * Vec3::Z;
        assert_eq!(
            corners(&loaded.scene),
            [
                [Vec3::ZERO, Vec3::X, Vec3::Y],
                [lift, lift + Vec3::X, lift + Vec3::Y],
                [Vec3::ZERO, lift + Vec3::X, lift + Vec3::Y],
            ]
        );
    }

    #[test]
    fn tinyobjloader_295_and_assimp_91_no_triangle_of_a_polygon_is_lost() {
        let count = 50;
        let vertices: String = (0..count)
            .map(|i| {
                let (sin, cos) = (i as f32 / count as f32 * std::f32::consts::TAU).sin_cos();
                format!("v {cos} {sin} 0\n")
            })
            .collect();
        let indices: Vec<String> = (1..=count).map(|i| i.to_string()).collect();
        let loaded = read(&format!("{vertices}f {}\nf 1 2 3 4", indices.join(" ")));
        assert_eq!(loaded.scene.triangle_count(), count - 2 + 2);
        assert_eq!(loaded.warnings, []);
    }

    #[test]
    fn assimp_1136_and_3019_concave_polygons() {
        // An arrow head; the fan of its first corner covers 6 instead of 3.
        let arrow = "v 4 -3 0\nv 1 0 0\nv 4 3 0\nv 0 0 0\n";
        for face in ["f 1 2 3 4", "f 2 3 4 1", "f 4 3 2 1"] {
            let loaded = read(&format!("{arrow}{face}"));
            assert_eq!(loaded.scene.triangle_count(), 2);
            assert!((area(&loaded.scene) - 3.0).abs() < 1e-6, "{face}");
            assert_eq!(loaded.warnings, []);
        }
    }

    #[test]
    fn mitsuba3_191_a_zero_normal_that_nobody_uses() {
        let loaded = read(&format!("{SQUARE}vn 0 0 0\nvn 0 0 1\nf 1//2 2//2 3//2"));
        assert_eq!(kinds(&loaded), [(WarningKind::IgnoredNormals, 1, 7)]);
    }
}

mod refused {
    use super::*;

    fn error(text: &str) -> ParseError {
        try_read(text).expect_err(text)
    }

    #[test]
    fn indices_that_name_nothing() {
        for (face, kind, index, count) in [
            ("f 1 2 5", IndexKind::Position, 5, 4),
            ("f 1 2 -5", IndexKind::Position, -5, 4),
            ("f 1/1 2/1 3/2", IndexKind::TextureCoordinate, 2, 1),
            ("f 1//1 2//1 3//1", IndexKind::Normal, 1, 0),
        ] {
            let expected = ParseError::IndexOutOfRange {
                line: 6,
                kind,
                index,
                count,
            };
            assert_eq!(error(&format!("{SQUARE}vt 0 0\n{face}")), expected);
        }
        assert_eq!(
            error(&format!("{SQUARE}f 1 0 2")).to_string(),
            "line 5: vertex index 0; indices count from 1"
        );
    }

    #[test]
    fn statements_that_cannot_be_read() {
        for (text, message) in [
            (
                "v 0 0\n",
                "line 1: `v` with 2 numbers; allowed are 3, 4, 6 or 7",
            ),
            (
                "v 0 0 0 1 1\n",
                "line 1: `v` with 5 numbers; allowed are 3, 4, 6 or 7",
            ),
            ("\nv 0 zero 0\n", "line 2: `zero` is not a number"),
            ("vn 0 0\n", "line 1: `vn` with 2 numbers; allowed are 3"),
            ("vt\n", "line 1: `vt` with 0 numbers; allowed are 1 to 3"),
            (
                "v 0 0 0\n\nf 1 1\n",
                "line 3: face with 2 corners; at least 3 are needed",
            ),
            (
                "v 0 0 0\nf 1 1 \\\n\\\nx\n",
                "line 2: `x` is not a face corner (a, a/b, a//c or a/b/c with whole numbers)",
            ),
        ] {
            assert_eq!(error(text).to_string(), message);
        }
    }

    #[test]
    fn a_file_without_faces() {
        for text in ["", "# nothing\n", SQUARE, "l 1 2\nvp 1\n", "\0\0\0"] {
            assert_eq!(error(text), ParseError::NoFaces);
        }
    }

    #[test]
    fn a_file_of_which_nothing_is_left() {
        assert_eq!(
            error("v 0 0 0\nv 1 0 0\nv nan 0 0\nf 1 2 2\nf 1 2 3\nf 3 2 1"),
            ParseError::NoUsableTriangles {
                degenerate: 1,
                non_finite: 2
            }
        );
    }

    #[test]
    fn more_triangles_than_the_limit() {
        let text = format!("{SQUARE}f 1 2 3 4\nf 1 2 3\n");
        let mut no_files = |_: &str| Err(io::ErrorKind::NotFound.into());
        let mut within = |n| {
            let limits = Limits::default().with_max_triangles(n);
            read_obj(text.as_bytes(), &mut no_files, &limits)
        };
        assert!(within(3).is_ok());
        let expected = ParseError::TooManyTriangles { line: 6, limit: 2 };
        assert_eq!(within(2), Err(expected));
    }

    #[test]
    fn a_token_of_a_megabyte_does_not_become_the_message() {
        let text = format!("v {} 0 0", "x".repeat(1 << 20));
        let ParseError::Syntax {
            fault: SyntaxFault::NotANumber { token },
            ..
        } = error(&text)
        else {
            panic!("another error")
        };
        assert_eq!(token.chars().count(), 60);
    }
}

#[test]
fn triangles_with_coordinates_that_are_not_finite_are_dropped_with_a_count() {
    let loaded = read(
        "v nan 0 0\nv 0 -inf 0\nv 1e999 0 0\nv 0 0 0\nv 1 0 0\nv 0 1 0\n\
         f 1 4 5\nf 4 2 5\nf 3 4 5\nf 4 5 6",
    );
    assert_eq!(corners(&loaded.scene), [[Vec3::ZERO, Vec3::X, Vec3::Y]]);
    assert_eq!(kinds(&loaded), [(WarningKind::NonFiniteTriangles, 3, 7)]);
}

#[test]
fn very_small_and_very_large_triangles_are_kept() {
    let loaded =
        read("v 0 0 0\nv 1e-45 0 0\nv 0 1e-45 0\nv 3e38 0 0\nv 0 3e38 0\nf 1 2 3\nf 1 4 5");
    assert_eq!(loaded.scene.triangle_count(), 2);
}

#[test]
fn meshes_by_object_group_and_material_in_order_of_appearance() {
    let loaded = read(&format!(
        "{SQUARE}f 1 2 3\no a\nusemtl m\nf 1 2 3\ng g\nf 1 2 3\nusemtl n\nf 2 3 4\no empty\no b\n\
         f 1 2 2\nusemtl m\no a\nf 1 3 4"
    ));
    let shape: Vec<(&str, &str, usize)> = loaded
        .scene
        .meshes
        .iter()
        .map(|mesh| {
            let material = loaded.scene.materials[mesh.material].name.as_str();
            (
                mesh.name.as_str(),
                material,
                mesh.triangles.triangles().len(),
            )
        })
        .collect();
    assert_eq!(
        shape,
        [
            ("default", "default", 1),
            ("a", "m", 2),
            ("a/g", "m", 1),
            ("a/g", "n", 1)
        ]
    );
    // Vertices of its own, in the order of use: none that only others need.
    let own = &loaded.scene.meshes[3].triangles;
    assert_eq!(own.vertices(), [Vec3::X, Vec3::new(1., 1., 0.), Vec3::Y]);
    assert_eq!(own.triangles(), [[0, 1, 2]]);
}

#[test]
fn a_library_may_come_after_its_use_and_unused_materials_are_kept() {
    let mut files = |_: &str| Ok(b"newmtl unused\nnewmtl red\nKd 1 0 0\nKe 2".to_vec());
    let text = format!("{SQUARE}usemtl red # c\nf 1 2 3\nmtllib a.mtl");
    let loaded = read_obj(text.as_bytes(), &mut files, &Limits::default()).unwrap();
    assert_eq!(loaded.scene.materials.len(), 2);
    let material = &loaded.scene.materials[loaded.scene.meshes[0].material];
    assert_eq!(material.diffuse, Vec3::X);
    assert_eq!(material.emission, Vec3::splat(2.0));
    assert_eq!(loaded.warnings, []);
}

#[test]
fn libraries_together_have_a_limit() {
    let mut asked = 0;
    let mut files = |_: &str| {
        asked += 1;
        Ok(b"newmtl red # with 30 bytes....".to_vec())
    };
    let text = format!("mtllib a\nmtllib b\nmtllib c\nmtllib d\n{SQUARE}f 1 2 3");
    let limits = Limits::default().with_max_bytes(70);
    let loaded = read_obj(text.as_bytes(), &mut files, &limits).unwrap();
    assert_eq!(asked, 3);
    assert_eq!(
        kinds(&loaded),
        [
            (WarningKind::MissingMaterialLibrary, 2, 3),
            (WarningKind::DuplicateMaterial, 1, 1)
        ]
    );
}

mod files {
    use super::*;

    #[test]
    fn the_ending_chooses_the_format_without_regard_to_case() {
        let folder = tempfile::tempdir().unwrap();
        let text = format!("{SQUARE}f 1 2 3");
        let plain = folder.path().join("A.OBJ");
        fs::write(&plain, &text).unwrap();
        let packed = folder.path().join("a.Obj.GZ");
        write_gzip(&packed, text.as_bytes());
        assert_eq!(load_scene(&plain).unwrap(), load_scene(&packed).unwrap());

        let error = load_scene(Path::new("x/scene.fbx")).unwrap_err();
        assert!(matches!(error, LoadError::UnknownFormat { .. }));
        assert_eq!(
            error.to_string(),
            "x/scene.fbx: unknown scene format; known endings are .obj, .obj.gz"
        );
    }

    #[test]
    fn files_that_cannot_be_read() {
        let folder = tempfile::tempdir().unwrap();
        for name in ["gone.obj", "gone.obj.gz"] {
            let error = load_scene(&folder.path().join(name)).unwrap_err();
            assert!(matches!(error, LoadError::Io { .. }), "{error}");
        }
        for name in ["folder.obj", "folder.obj.gz"] {
            let path = folder.path().join(name);
            fs::create_dir(&path).unwrap();
            let error = load_scene(&path).unwrap_err();
            assert!(matches!(error, LoadError::Io { .. }), "{error}");
        }
    }

    #[test]
    fn gzip_cut_anywhere_is_truncated() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.obj.gz");
        let packed = write_gzip(&path, format!("{SQUARE}f 1 2 3").as_bytes());
        for length in 0..packed.len() {
            fs::write(&path, &packed[..length]).unwrap();
            let error = load_scene(&path).unwrap_err();
            assert!(
                matches!(error, LoadError::TruncatedGzip { .. }),
                "{length}: {error:?}"
            );
        }
    }

    #[test]
    fn gzip_that_is_damaged() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.obj.gz");
        let packed = write_gzip(&path, format!("{SQUARE}f 1 2 3\n").as_bytes());
        let mut wrong_checksum = packed.clone();
        let place = packed.len() - 8;
        wrong_checksum[place] ^= 1;
        let trailing = [&packed[..], b"trailing garbage"].concat();
        for bytes in [wrong_checksum, trailing, SQUARE.as_bytes().to_vec()] {
            fs::write(&path, bytes).unwrap();
            let error = load_scene(&path).unwrap_err();
            assert!(matches!(error, LoadError::Gzip { .. }), "{error:?}");
        }
        // Two members one after the other are one file, as `cat` makes them.
        let both = [packed.clone(), packed].concat();
        fs::write(&path, both).unwrap();
        assert_eq!(load_scene(&path).unwrap().scene.triangle_count(), 2);
    }

    #[test]
    fn more_bytes_than_the_limit_also_after_decompression() {
        let folder = tempfile::tempdir().unwrap();
        let limits = Limits::default().with_max_bytes(1 << 16);
        let bomb = folder.path().join("bomb.obj.gz");
        let packed = write_gzip(&bomb, &vec![b'#'; 1 << 24]);
        assert!(packed.len() < 1 << 17);
        let plain = folder.path().join("long.obj");
        fs::write(&plain, vec![b'#'; (1 << 16) + 1]).unwrap();
        for path in [bomb, plain] {
            let error = load_scene_within(&path, &limits).unwrap_err();
            assert!(
                matches!(error, LoadError::TooLarge { limit: 65536, .. }),
                "{error:?}"
            );
        }
    }

    #[test]
    fn a_parse_error_says_which_file_and_line() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.obj");
        fs::write(&path, "v 0 0 0\nf 1 2 3").unwrap();
        let error = load_scene(&path).unwrap_err();
        assert_eq!(error.to_string(), path.display().to_string());
        let source = std::error::Error::source(&error).unwrap().to_string();
        assert_eq!(
            source,
            "line 2: vertex index 2, but the lines before define 1"
        );
    }

    /// Names with Windows separators or the path of the author's machine, and names that try to
    /// leave the folder, lead to the file beside the scene or to none.
    #[test]
    fn libraries_are_looked_for_beside_the_scene_only() {
        let folder = tempfile::tempdir().unwrap();
        let scenes = folder.path().join("scenes");
        fs::create_dir_all(scenes.join("sub")).unwrap();
        fs::write(folder.path().join("outside.mtl"), "newmtl m\nKd 0.125").unwrap();
        fs::write(scenes.join("beside.mtl"), "newmtl m\nKd 0.25").unwrap();
        fs::write(
            scenes.join("sub/below.mtl"),
            "newmtl m\nKd 0.75\nmap_Kd sub\\wood.png",
        )
        .unwrap();
        fs::write(scenes.join("sub/wood.png"), "").unwrap();
        let absolute = folder.path().join("outside.mtl").display().to_string();
        let path = scenes.join("a.obj");
        for (name, diffuse) in [
            ("beside.mtl", 0.25),
            ("C:\\work\\beside.mtl", 0.25),
            ("/home/author/beside.mtl", 0.25),
            ("../beside.mtl", 0.25),
            ("sub\\below.mtl", 0.75),
            ("./sub/below.mtl", 0.75),
            ("../outside.mtl", 0.5),
            (absolute.as_str(), 0.5),
            ("sub", 0.5),
        ] {
            fs::write(&path, format!("mtllib {name}\n{SQUARE}usemtl m\nf 1 2 3")).unwrap();
            let loaded = load_scene(&path).unwrap();
            assert_eq!(
                loaded.scene.materials[0].diffuse,
                Vec3::splat(diffuse),
                "{name}"
            );
            let textures = loaded
                .warnings
                .iter()
                .find(|w| w.kind == WarningKind::IgnoredTexture);
            assert_eq!(textures.is_some(), diffuse == 0.75, "{name}");
        }
    }
}

proptest! {
    // Without a file of failures: tests of this folder have no place for it.
    #![proptest_config(ProptestConfig { failure_persistence: None, ..Default::default() })]

    #[test]
    fn no_bytes_make_it_panic(bytes in prop::collection::vec(any::<u8>(), 0..400)) {
        let _ = try_read(&bytes);
    }

    #[test]
    fn no_words_make_it_panic(
        words in prop::collection::vec(prop::sample::select(vec![
            "v", "vt", "vn", "f", "o", "g", "usemtl", "mtllib", "newmtl", "Kd", "Ke", "d", "map_Kd",
            "-s", "l", "\n", "\n", "\\\n", "#", "/", "1", "2", "-1", "0", "1/1", "1//1", "0.5",
            "nan", "1e39", "-9223372036854775808", "99999999999999999999", "\r", "\0",
        ]), 0..120),
    ) {
        let text = words.join(" ");
        // The same text as its own library reaches the parser of materials.
        let mut own = |_: &str| Ok(text.clone().into_bytes());
        if let Ok(loaded) = read_obj(text.as_bytes(), &mut own, &Limits::default()) {
            prop_assert!(loaded.scene.triangle_count() > 0);
        }
    }

    /// Changed bytes of a file that uses every statement: read or refused, and what is read can
    /// be rendered.
    #[test]
    fn no_damage_makes_it_panic(
        changes in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..12),
        cut: prop::sample::Index,
    ) {
        let mut object = fs::read(data("edge_cases.obj")).unwrap();
        let mut library = fs::read(data("edge cases.mtl")).unwrap();
        for (place, value) in &changes {
            let place = place.index(object.len() + library.len());
            match place.checked_sub(object.len()) {
                None => object[place] = *value,
                Some(place) => library[place] = *value,
            }
        }
        object.truncate(cut.index(2 * object.len()));
        let mut files = |_: &str| Ok(library.clone());
        if let Ok(loaded) = read_obj(&object, &mut files, &Limits::default()) {
            for mesh in &loaded.scene.meshes {
                let material = &loaded.scene.materials[mesh.material];
                prop_assert!(material.diffuse.cmpge(Vec3::ZERO).all());
                prop_assert!(material.diffuse.cmple(Vec3::ONE).all());
                prop_assert!(material.emission.is_finite());
            }
            prop_assert!(corners(&loaded.scene).iter().flatten().all(|c| c.is_finite()));
        }
    }
}

/// Triangles, those without area, meshes, and bounds, as measured by another program on the
/// scenes that the benchmarks use.
struct Measured {
    name: &'static str,
    triangles: usize,
    zero_area: usize,
    meshes: usize,
    min: [f32; 3],
    max: [f32; 3],
}

#[rustfmt::skip]
const SCENES: [Measured; 9] = [
    Measured { name: "sponza", triangles: 262_205, zero_area: 1, meshes: 381,
        min: [-192.095, -12.6443, -118.281], max: [179.991, 142.943, 110.543] },
    // Fans give 7 without area; 6 of them at a corner on a straight edge, which is split better.
    Measured { name: "sponza_dabrovic", triangles: 66_450, zero_area: 1, meshes: 37,
        min: [-17.4028, -0.9067, -7.7985], max: [17.4172, 15.6533, 7.8015] },
    Measured { name: "conference", triangles: 331_179, zero_area: 53_627, meshes: 526,
        min: [-1020.13, -2.7924, -1055.66], max: [1685.81, 650.293, 668.489] },
    Measured { name: "fireplace_room", triangles: 143_163, zero_area: 190, meshes: 65,
        min: [-0.5134, -0.0031, -3.6354], max: [5.1227, 2.8791, 0.5928] },
    Measured { name: "sibenik", triangles: 75_284, zero_area: 9, meshes: 1,
        min: [-20.1411, -15.3123, -8.4968], max: [20.1411, 15.3, 8.4968] },
    Measured { name: "dragon", triangles: 871_414, zero_area: 108, meshes: 1,
        min: [-0.1083, 0.0527, -0.0504], max: [0.0966, 0.1972, 0.0412] },
    Measured { name: "buddha_lod", triangles: 100_000, zero_area: 0, meshes: 1,
        min: [-0.4610, -1.0022, -0.3239], max: [0.3522, 0.9775, 0.4902] },
    Measured { name: "bmw_m6", triangles: 792_746, zero_area: 164, meshes: 114,
        min: [-23.9736, -1.4330, -28.2915], max: [25.8807, 13.4351, 26.5841] },
    Measured { name: "voxel_terrain", triangles: 1_084_596, zero_area: 0, meshes: 9,
        min: [-184.0, 0.0, -88.0], max: [184.0, 124.0, 88.0] },
];

#[test]
fn measured_scenes() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/data/scenes");
    if !folder.is_dir() {
        eprintln!("skipped: {} is absent", folder.display());
        return;
    }
    for expected in &SCENES {
        let name = expected.name;
        let start = std::time::Instant::now();
        let path = folder.join(name).join(format!("{name}.obj.gz"));
        let loaded = load_scene(&path).unwrap_or_else(|error| panic!("{error}"));
        eprintln!("{name}: {} ms", start.elapsed().as_millis());
        for warning in &loaded.warnings {
            eprintln!("  {warning}");
        }
        let zero_area = loaded
            .warnings
            .iter()
            .find(|w| w.kind == WarningKind::DegenerateTriangles)
            .map_or(0, |w| w.count);
        assert_eq!(zero_area, expected.zero_area, "{name}");
        let kept = expected.triangles - zero_area;
        assert_eq!(loaded.scene.triangle_count(), kept, "{name}");
        assert_eq!(loaded.scene.meshes.len(), expected.meshes, "{name}");
        let vertices = loaded
            .scene
            .meshes
            .iter()
            .flat_map(|m| m.triangles.vertices());
        let (min, max) = vertices.fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(min, max), v| {
            (min.min(*v), max.max(*v))
        });
        for (got, listed) in [(min, expected.min), (max, expected.max)] {
            // The list has four decimals, or six digits.
            let difference = (got - Vec3::from_array(listed)).abs();
            assert!(
                difference.max_element() <= 6e-5,
                "{name}: {got}, listed {listed:?}"
            );
        }
    }
}
