//! What the NRRD reader makes of headers, row by row of the design's table of inputs.

mod files;

use files::{Files, gzip, nrrd_header, one};
use raywright_volume::load::{
    CompanionFiles, DataError, HeaderError, LoadError, LoadOptions, Loaded, PlacementSource,
    Warning, read_volume,
};

fn read(files: &Files, name: &str) -> Result<Loaded, LoadError> {
    read_volume(files, name, &LoadOptions::default())
}

/// An attached file.
fn attached(header: &str, data: &[u8]) -> Result<Loaded, LoadError> {
    let bytes = [header.as_bytes(), b"\n", data].concat();
    read(&one("a.nrrd", bytes), "a.nrrd")
}

/// A detached header with its voxels in `a.raw`.
fn detached(header: &str, data: &[u8]) -> Result<Loaded, LoadError> {
    let mut files = one("a.nhdr", header);
    files.insert("a.raw".into(), data.to_vec());
    read(&files, "a.nhdr")
}

fn shorts() -> Vec<u8> {
    (-5_i16..7).flat_map(i16::to_le_bytes).collect()
}

/// The file has the twelve voxels −5 … 6.
#[track_caller]
fn assert_whole(loaded: &Result<Loaded, LoadError>, warnings: usize) {
    let loaded = loaded.as_ref().expect("a volume");
    assert_eq!(loaded.volume.dims(), [3, 2, 2]);
    assert_eq!(loaded.volume.value([0, 0, 0]), -5.0);
    assert_eq!(loaded.volume.value([1, 0, 1]), 2.0);
    assert_eq!(loaded.volume.range(), [-5.0, 6.0]);
    assert_eq!(loaded.warnings.len(), warnings, "{:?}", loaded.warnings);
}

/// The causes of an error, joined.
fn message(result: Result<Loaded, LoadError>) -> String {
    let error = result.expect_err("refused");
    let mut text = error.to_string();
    let mut cause = std::error::Error::source(&error);
    while let Some(error) = cause {
        text = format!("{text}: {error}");
        cause = error.source();
    }
    text
}

#[test]
fn header_faults_name_field_and_line() {
    let good = nrrd_header("short", "raw", "");
    assert_whole(&attached(&good, &shorts()), 0);
    for (from, to, expected) in [
        ("type: short\n", "", "`type` is missing"),
        ("dimension: 3\n", "", "`dimension` is missing"),
        ("sizes: 3 2 2\n", "", "`sizes` is missing"),
        ("encoding: raw\n", "", "`encoding` is missing"),
        ("endian: little\n", "", "order of the bytes"),
        (
            "sizes: 3 2 2",
            "sizes: 3 two 2",
            "line 5: `sizes` is `3 two 2`",
        ),
        ("sizes: 3 2 2", "sizes: 3 -2 2", "line 5: `sizes`"),
        ("sizes: 3 2 2", "sizes: 3 0 2", "line 5: `sizes`"),
        ("sizes: 3 2 2", "sizes: 3 2", "line 5: `sizes`"),
        (
            "sizes: 3 2 2",
            "sizes: 3 2 99999999999999999999",
            "line 5: `sizes`",
        ),
        ("sizes: 3 2 2", "sizes: 99999999999 99999999999 2", "limit"),
        ("dimension: 3", "dimension: 0", "line 4: `dimension`"),
        ("dimension: 3", "dimension: 17", "line 4: `dimension`"),
        (
            "dimension: 3\nsizes: 3 2 2",
            "dimension: 2\nsizes: 3 4",
            "3 axes",
        ),
        (
            "dimension: 3\nsizes: 3 2 2",
            "dimension: 4\nsizes: 3 2 2 2",
            "3 axes",
        ),
        ("endian: little", "endian: middle", "line 7: `endian`"),
        (
            "endian: little",
            "endian: little\nendian: big",
            "line 8: `endian` is given again",
        ),
        ("type: short", "type: complex", "type complex"),
        ("type: short", "type: block", "type block"),
        ("type: short", "type: long long", "type long long"),
        (
            "encoding: raw",
            "encoding: bzip2",
            "line 6: the encoding `bzip2`",
        ),
        ("encoding: raw", "encoding: ascii", "the encoding `ascii`"),
        (
            "encoding: raw",
            "encoding: raw\nkinds: RGB-color domain domain",
            "type rgb-color",
        ),
        (
            "encoding: raw",
            "encoding: raw\nbyte skip: -2",
            "`byte skip`",
        ),
        (
            "encoding: raw",
            "encoding: raw\nline skip: -1",
            "`line skip`",
        ),
        (
            "encoding: raw",
            "encoding: raw\nspacings: 1 2",
            "`spacings`",
        ),
        (
            "encoding: raw",
            "encoding: raw\nspace directions: (1,0,0)",
            "`space directions`",
        ),
        (
            "encoding: raw",
            "encoding: raw\nspace origin: 1 2 3",
            "`space origin`",
        ),
        ("NRRD0004", "NRRD0009", "begins with `NRRD0009`"),
    ] {
        assert!(good.contains(from), "{from}");
        let text = message(attached(&good.replace(from, to), &shorts()));
        assert!(
            text.contains(expected) && text.contains("a.nrrd"),
            "{to}: {text}"
        );
    }
    let endless = [b"NRRD0004\n", &[b'x'; 70_000][..]].concat();
    let text = message(read(&one("a.nrrd", endless), "a.nrrd"));
    assert!(text.contains("line 2: more than 65536 bytes"), "{text}");
    let text = message(read(&one("a.nrrd", good), "a.nrrd"));
    assert!(
        text.contains("the file ends before the empty line"),
        "{text}"
    );
}

#[test]
fn four_axes_of_which_the_last_is_one() {
    let header = nrrd_header("short", "raw", "spacings: 1 2 3 nan\n");
    let header = header.replace("dimension: 3\nsizes: 3 2 2", "dimension: 4\nsizes: 3 2 2 1");
    let loaded = attached(&header, &shorts());
    assert_whole(&loaded, 0);
    assert_eq!(loaded.unwrap().volume.spacing(), [1.0, 2.0, 3.0]);
}

#[test]
fn types_of_one_byte_need_no_endian() {
    let header = nrrd_header("int8", "raw", "").replace("endian: little\n", "");
    let bytes: Vec<u8> = (-5_i8..7).map(|v| v as u8).collect();
    assert_whole(&attached(&header, &bytes), 0);
}

#[test]
fn big_endian_and_all_versions() {
    let bytes: Vec<u8> = (-5_i16..7).flat_map(i16::to_be_bytes).collect();
    for version in 1..=5 {
        let header = nrrd_header("short", "raw", "")
            .replace("little", "BIG")
            .replace("NRRD0004", &format!("NRRD000{version}"))
            .replace('\n', "\r\n");
        let bytes = [header.as_bytes(), b"\r\n", &bytes].concat();
        assert_whole(&read(&one("a.NRRD", bytes), "a.NRRD"), 0);
    }
}

/// mhe/pynrrd#4: the voxels begin directly behind the one empty line, whatever they look like.
#[test]
fn voxels_that_look_like_lines() {
    let header = nrrd_header("uchar", "raw", "");
    let data = b"\n\n\r\n# a: bc\n";
    assert_eq!(data.len(), 12);
    let volume = attached(&header, data).unwrap().volume;
    assert_eq!(volume.value([0, 0, 0]), 10.0);
    assert_eq!(volume.value([2, 1, 1]), 10.0);
}

#[test]
fn too_few_and_too_many_voxels() {
    for encoding in ["raw", "gzip"] {
        let header = nrrd_header("short", encoding, "");
        let stored = |bytes: &[u8]| match encoding {
            "raw" => bytes.to_vec(),
            _ => gzip(bytes),
        };
        let short = attached(&header, &stored(&shorts()[..23]));
        assert!(
            matches!(
                short,
                Err(LoadError::Data {
                    source: DataError::Short {
                        expected: 24,
                        found: 23
                    },
                    ..
                })
            ),
            "{short:?}"
        );
        let long = attached(&header, &stored(&[&shorts()[..], b"xyz"].concat()));
        assert_whole(&long, 1);
        let bytes = (encoding == "raw").then_some(3);
        assert_eq!(long.unwrap().warnings, [Warning::ExtraData { bytes }]);
    }
}

#[test]
fn gzip_members_garbage_cuts_and_bombs() {
    let header = nrrd_header("short", "gzip", "");
    let (a, b) = (gzip(&shorts()[..7]), gzip(&shorts()[7..]));
    assert_whole(&attached(&header, &[&a[..], &b].concat()), 0);
    let garbage = attached(&header, &[&a[..], &b, &[0; 512]].concat());
    assert_whole(&garbage, 1);
    assert_eq!(garbage.unwrap().warnings, [Warning::GzipGarbage]);
    let cut = gzip(&shorts());
    for end in 0..cut.len() {
        let result = attached(&header, &cut[..end]);
        assert!(
            matches!(
                result,
                Err(LoadError::Data {
                    source: DataError::TruncatedGzip | DataError::Short { .. },
                    ..
                })
            ),
            "{end}: {result:?}"
        );
    }
    // 64 MiB in 64 KiB, of which 25 bytes are unpacked.
    let mut bomb = shorts();
    bomb.resize(1 << 26, 0);
    assert_whole(&attached(&header, &gzip(&bomb)), 1);
    let text = message(attached(&header, b"no gzip"));
    assert!(text.contains("not valid gzip data"), "{text}");
}

#[test]
fn skips_of_detached_headers() {
    let lines = "data file: a.raw\nline skip: 2\nbyte skip: 3\n";
    let data = [b"one\ntwo\nabc", &shorts()[..]].concat();
    assert_whole(&detached(&nrrd_header("short", "raw", lines), &data), 0);
    // Lines are counted as stored, bytes after decompression.
    let data = [b"one\ntwo\n", &gzip(&[b"abc", &shorts()[..]].concat())[..]].concat();
    assert_whole(&detached(&nrrd_header("short", "gzip", lines), &data), 0);
    for data in [&b"one\n"[..], b"one\ntwo\nab", b"one\ntwo\nabc1234"] {
        let result = detached(&nrrd_header("short", "raw", lines), data);
        assert!(message(result).contains("bytes of voxels are needed"));
    }
}

/// mhe/pynrrd#70: also where the data are compressed.
#[test]
fn a_byte_skip_of_minus_one_takes_the_end() {
    let lines = "data file: a.raw\nbyte skip: -1\n";
    let data = [b"some header of another program", &shorts()[..]].concat();
    assert_whole(&detached(&nrrd_header("short", "raw", lines), &data), 0);
    assert_whole(
        &detached(&nrrd_header("short", "gzip", lines), &gzip(&data)),
        0,
    );
    assert_whole(
        &attached(&nrrd_header("short", "raw", "byte skip: -1\n"), &data),
        0,
    );
    let zipped = nrrd_header("short", "gzip", "byte skip: -1\n");
    assert_whole(&attached(&zipped, &gzip(&data)), 0);
    let short = attached(&zipped, &gzip(&data[..20]));
    assert!(message(short).contains("24 bytes of voxels are needed, 20 are there"));
}

#[test]
fn data_files_elsewhere_lists_and_patterns() {
    let read_with = |name: &str, options: &LoadOptions| {
        let lines = format!("data file: {name}\n");
        let mut files = one("a.nhdr", nrrd_header("short", "raw", &lines));
        for name in ["../b.raw", "sub/b.raw", "with blank.raw", "100%.raw"] {
            files.insert(name.into(), shorts());
        }
        read_volume(&files, "a.nhdr", options)
    };
    let default = LoadOptions::default();
    for name in ["sub/b.raw", "./sub\\b.raw", "with blank.raw", "100%.raw"] {
        assert_whole(&read_with(name, &default), 0);
    }
    for name in ["../b.raw", "/b.raw", "sub/../../b.raw", "C:\\b.raw"] {
        let result = read_with(name, &default);
        assert!(
            matches!(result, Err(LoadError::OutsideFolder { .. })),
            "{name}: {result:?}"
        );
    }
    let anywhere = LoadOptions::default().with_companions(CompanionFiles::Anywhere);
    assert_whole(&read_with("../b.raw", &anywhere), 0);
    assert!(matches!(
        read_with("absent.raw", &default),
        Err(LoadError::Io { .. })
    ));
    for name in ["LIST", "LIST 2", "slice%03d.raw 1 2 1"] {
        let result = read_with(name, &default);
        assert!(
            matches!(
                result,
                Err(LoadError::Header {
                    source: HeaderError::Unsupported { .. },
                    ..
                })
            ),
            "{name}: {result:?}"
        );
    }
}

#[test]
fn space_directions_and_origin() {
    let lines = "space: left-posterior-superior\nspace directions: (0,-2,0) (0.5,0,0) (0,0,3)\n\
                 space origin: (5, 6, -7)\nspacings: 9 9 9\n";
    let loaded = attached(&nrrd_header("short", "raw", lines), &shorts()).unwrap();
    assert_eq!(loaded.volume.spacing(), [2.0, 0.5, 3.0]);
    let orientation = loaded.volume.orientation();
    assert_eq!(orientation.origin.to_array(), [5.0, 6.0, -7.0]);
    assert_eq!(orientation.axes[0].to_array(), [0.0, -1.0, 0.0]);
    let placement = &loaded.source.placements[0];
    assert_eq!(placement.space, "left-posterior-superior");
    assert_eq!(placement.source, PlacementSource::SpaceDirections);
    for lines in [
        "space directions: (0,0,0) (1,0,0) (0,0,1)\n",
        "space directions: none (1,0,0) (0,0,1)\n",
        "space directions: (nan,0,0) (0,1,0) (0,0,1)\n",
        "space directions: (1e300,0,0) (0,1,0) (0,0,1)\n",
        "space origin: (1,2)\n",
    ] {
        let loaded = attached(&nrrd_header("short", "raw", lines), &shorts()).unwrap();
        let source = PlacementSource::SpaceDirections;
        let unusable = Warning::PlacementUnusable { source };
        assert!(loaded.warnings.contains(&unusable), "{lines}");
        assert!(loaded.source.placements.is_empty());
    }
}

#[test]
fn spacings_that_cannot_be() {
    let header = nrrd_header("short", "raw", "spacings: -2 0 nan\n");
    let loaded = attached(&header, &shorts());
    assert_whole(&loaded, 2);
    assert_eq!(loaded.unwrap().volume.spacing(), [2.0, 1.0, 1.0]);
}

#[test]
fn unknown_fields_are_told_and_pairs_are_not() {
    let header = nrrd_header("short", "raw", "spacing: 1 2 3\nfoo: bar\nkey:=value\n");
    let loaded = attached(&header, &shorts());
    assert_whole(&loaded, 1);
    let text = loaded.unwrap().warnings[0].to_string();
    assert!(
        text.contains("2 header fields") && text.contains("`spacing: 1 2 3` in line 8"),
        "{text}"
    );
}

#[test]
fn limits_come_before_memory() {
    let header = nrrd_header("double", "gzip", "").replace("3 2 2", "4096 4096 4096");
    let result = attached(&header, &gzip(&[0; 100]));
    assert!(matches!(
        result,
        Err(LoadError::Data {
            source: DataError::Short {
                expected: 0x80_0000_0000,
                found: 100
            },
            ..
        })
    ));
    let options = LoadOptions::default().with_max_voxels(11);
    let bytes = [nrrd_header("short", "raw", "\n").as_bytes(), &shorts()].concat();
    let result = read_volume(&one("a.nrrd", bytes), "a.nrrd", &options);
    assert!(message(result).contains("3 x 2 x 2 voxels are more than the limit of 11"));
}
