//! `raywright volume` as a user meets it: results, messages, exit codes.

#![cfg(feature = "cli")]

use std::{
    fs,
    path::Path,
    process::{Command, Output},
};

use serde_json::{Value, json};

fn raywright(folder: &Path, args: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_raywright"));
    command.args(args).current_dir(folder);
    command.output().expect("the binary runs")
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

const HEADER: &str = "NRRD0004\ntype: short\ndimension: 3\nsizes: 3 2 2\nencoding: raw\n\
                      endian: little\nspace directions: (2,0,0) (0,2,0) (0,0,3)\n";

fn voxels() -> Vec<u8> {
    (-5_i16..7).flat_map(i16::to_le_bytes).collect()
}

/// Runs `volume info` with these arguments in a folder with these files.
fn info(files: &[(&str, &[u8])], args: &[&str]) -> Output {
    let folder = tempfile::tempdir().expect("a folder");
    for (name, bytes) in files {
        fs::write(folder.path().join(name), bytes).expect("a file");
    }
    raywright(folder.path(), &[&["volume", "info"], args].concat())
}

fn report(output: &Output) -> Value {
    assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
    serde_json::from_slice(&output.stdout).expect("one JSON object")
}

#[test]
fn info_of_a_file() {
    let bytes = [HEADER.as_bytes(), b"\n", &voxels()].concat();
    let output = info(&[("a.nrrd", &bytes)], &["a.nrrd", "--json"]);
    let report = report(&output);
    for (name, value) in [
        ("schema_version", json!(1)),
        ("format", json!("NRRD")),
        ("dims", json!([3, 2, 2])),
        ("spacing", json!([2.0, 2.0, 3.0])),
        ("type", json!("i16")),
        ("endian", json!("little")),
        ("memory_type", json!("u16")),
        ("range", json!([-5.0, 6.0])),
        ("mean", json!(0.5)),
        ("missing", json!(0)),
        ("data_bytes", json!(24)),
        ("warnings", json!([])),
    ] {
        assert_eq!(report[name], value, "{name}");
    }
    assert_eq!(report["orientations"][0]["source"], "the space directions");
    assert!(output.stderr.is_empty());
    let plain = info(&[("a.nrrd", &bytes)], &["a.nrrd"]);
    let printed = text(&plain.stdout);
    for expected in ["3 x 2 x 2", "i16, little", "-5 .. 6", "orientation by"] {
        assert!(printed.contains(expected), "{printed}");
    }
}

#[test]
fn what_is_unusual_is_noted() {
    let bytes = [HEADER.as_bytes(), b"foo: bar\n\n", &voxels(), b"more"].concat();
    let output = info(&[("a.nrrd", &bytes)], &["a.nrrd", "--json"]);
    let notes = text(&output.stderr);
    assert!(notes.contains("note: 1 header field is unknown"), "{notes}");
    assert!(notes.contains("note: 4 bytes behind the voxels"), "{notes}");
    assert_eq!(
        report(&output)["warnings"].as_array().map(Vec::len),
        Some(2)
    );
}

#[test]
fn raw_voxels_and_missing_values() {
    let values = [1.0_f32, f32::NAN, 3.0, f32::INFINITY];
    let bytes: Vec<u8> = values.iter().flat_map(|v| v.to_be_bytes()).collect();
    let files = [("a.dat", &bytes[..])];
    let args = [
        "a.dat",
        "--json",
        "--dims",
        "2,2,1",
        "--type",
        "f32",
        "--endian",
        "big",
        "--spacing",
        "1,1,2.5",
    ];
    let seen = report(&info(&files, &args));
    assert_eq!(
        (&seen["missing"], &seen["infinite"]),
        (&json!(1), &json!(1))
    );
    assert_eq!(seen["range"], json!([1.0, 3.0]));
    assert_eq!(seen["spacing"], json!([1.0, 1.0, 2.5]));
    let filled = report(&info(&files, &[&args[..], &["--fill", "-7"]].concat()));
    assert_eq!(
        (&filled["missing"], &filled["range"]),
        (&json!(0), &json!([-7.0, 3.0]))
    );
}

#[test]
fn generated_volumes_need_no_file() {
    for name in ["supernova", "nebula", "marschner-lobb"] {
        let seen = report(&info(&[], &[name, "--json", "--dims", "20,16,12"]));
        assert_eq!(
            (&seen["format"], &seen["dims"]),
            (&json!("generated"), &json!([20, 16, 12]))
        );
    }
}

#[test]
fn failures_have_a_cause_a_hint_and_exit_code_2() {
    let cut = [HEADER.as_bytes(), b"\n", &voxels()[..20]].concat();
    let outside = format!("{HEADER}data file: ../a.raw\n");
    let bad = HEADER.replace("3 2 2", "3 0 2") + "\n";
    let files = [
        ("cut.nrrd", &cut[..]),
        ("outside.nhdr", outside.as_bytes()),
        ("bad.nrrd", bad.as_bytes()),
        ("a.raw", b"abcd"),
        ("a.vti", b"abcd"),
        ("a.nii", b"not a header at all"),
    ];
    for (args, expected) in [
        (
            &["cut.nrrd"][..],
            &["24 bytes of voxels are needed, 20 are there"][..],
        ),
        (&["outside.nhdr"], &["../a.raw", "hint:", "--data-anywhere"]),
        (&["bad.nrrd"], &["bad.nrrd", "line 4", "`sizes` is `3 0 2`"]),
        (&["a.raw"], &["description", "hint:", "--type"]),
        (&["a.vti"], &["unknown volume format", ".nii.gz", "--dims"]),
        (&["a.nii"], &["not a NIfTI file"]),
        (&["nowhere.nrrd"], &["nowhere.nrrd", "hint:", "supernova"]),
        (&["a.raw", "--dims", "2,2,1"], &["--dims", "--type"]),
        (
            &["a.raw", "--dims", "2,2,1", "--type", "i64"],
            &["i64", "f64"],
        ),
        (
            &["a.raw", "--dims", "2,1,1", "--type", "u16"],
            &["order of the bytes"],
        ),
        (
            &["a.raw", "--dims", "2,2", "--type", "u8"],
            &["three numbers"],
        ),
        (&["a.raw", "--type", "u8"], &["--dims"]),
        (&["nebula", "--dims", "0,1,1"], &["has none", "hint:"]),
        (
            &["nebula", "--dims", "9999999,9999999,9999999"],
            &["too many"],
        ),
    ] {
        let output = info(&files, args);
        let message = text(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{args:?}: {message}");
        for part in expected {
            assert!(
                message.contains(part),
                "{args:?}: {part:?} is not in: {message}"
            );
        }
    }
}

#[test]
fn rendering_is_the_same_whatever_changes_speed_alone() {
    let folder = tempfile::tempdir().expect("a folder");
    let picture = |name: &str, more: &[&str]| {
        let fixed = [
            "volume",
            "render",
            "supernova",
            "--dims",
            "40,40,40",
            "--tf",
            "fire",
        ];
        let size = ["--width", "60", "--height", "45", "-o", name];
        let output = raywright(folder.path(), &[&fixed[..], &size, more].concat());
        assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
        fs::read(folder.path().join(name)).expect("a picture")
    };
    let first = picture("a.png", &[]);
    for more in [
        &["--skipping", "none"][..],
        &["--isa", "portable"],
        &["--threads", "1"],
    ] {
        assert_eq!(picture("b.png", more), first, "{more:?}");
    }
    assert_ne!(picture("b.png", &["--step", "4"]), first);
}

#[test]
fn an_orbit_leaves_numbered_frames_and_one_report() {
    let folder = tempfile::tempdir().expect("a folder");
    let args = "volume render marschner-lobb --dims 20,20,20 --width 16 --height 16 --orbit 3 -o ml.png --json";
    let output = raywright(folder.path(), &args.split(' ').collect::<Vec<_>>());
    let report = report(&output);
    assert_eq!(
        (&report["frames"], &report["interrupted"]),
        (&json!(3), &json!(false))
    );
    assert!(report["samples"].as_u64() > report["rays"].as_u64());
    let frames: Vec<_> = (0..3)
        .map(|i| fs::read(folder.path().join(format!("ml-000{i}.png"))).expect("a frame"))
        .collect();
    assert!(frames[0] != frames[1] && frames[1] != frames[2]);
    assert!(!folder.path().join("ml.png").exists());
}

#[test]
fn what_cannot_be_rendered_says_what_may_be_tried() {
    let folder = tempfile::tempdir().expect("a folder");
    for (args, cause, hint) in [
        (
            "--tf bones",
            "no transfer function bones",
            "presets are ramp",
        ),
        ("--camera side", "no camera side", "nine numbers"),
        ("--camera 1,1,1,1,1,1,0,0,1", "no direction of view", ""),
        ("--step 0", "above 0", ""),
        ("--termination nan", "termination", ""),
        ("--width 0", "0", ""),
        ("--clip 1,2,3", "no clip box", "two corners"),
        ("--clip nan,0,0,1,1,1", "must be numbers", ""),
    ] {
        let line = format!("volume render nebula --dims 8,8,8 {args}");
        let output = raywright(folder.path(), &line.split(' ').collect::<Vec<_>>());
        let message = text(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{args}: {message}");
        assert!(
            message.contains(cause) && message.contains(hint),
            "{args}: {message}"
        );
    }
}

/// Renders a small generated volume with these arguments; the bytes of the picture.
fn picture(folder: &Path, args: &[&str]) -> Vec<u8> {
    let always = [
        "volume",
        "render",
        "nebula",
        "--dims",
        "32,32,32",
        "--width",
        "48",
        "--height",
        "40",
        "-o",
        "picture.png",
    ];
    let output = raywright(folder, &[&always[..], args].concat());
    assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
    fs::read(folder.join("picture.png")).expect("a picture")
}

#[test]
fn trees_around_what_is_seen_change_no_pixel_and_looks_do() {
    let folder = tempfile::tempdir().expect("a folder");
    let plain = picture(folder.path(), &[]);
    for args in [
        &["--skipping", "hull"][..],
        &[
            "--skipping",
            "segments",
            "--block-edge",
            "4",
            "-D",
            "branching_factor=2",
        ],
        &[
            "--skipping",
            "hull",
            "--block-edge",
            "8",
            "-D",
            "quality=morton",
        ],
    ] {
        assert_eq!(picture(folder.path(), args), plain, "{args:?}");
    }
    for args in [
        &["--jitter"][..],
        &["--orthographic"],
        &["--shade"],
        &["--show", "samples"],
        &["--show", "termination"],
        &["--show", "estimated-termination", "--estimate", "cube"],
        &["--show", "termination-error"],
    ] {
        assert_ne!(picture(folder.path(), args), plain, "{args:?}");
    }
    let output = raywright(
        folder.path(),
        &[
            "volume",
            "render",
            "nebula",
            "--skipping",
            "hull",
            "--block-edge",
            "5",
        ],
    );
    assert_eq!(output.status.code(), Some(2));
    assert!(text(&output.stderr).contains("power of two"));
    for args in [["--block-edge", "8"], ["-D", "branching_factor=2"]] {
        let output = raywright(
            folder.path(),
            &[&["volume", "render", "nebula"], &args[..]].concat(),
        );
        assert_eq!(output.status.code(), Some(2));
        assert!(text(&output.stderr).contains("--skipping hull"));
    }
}

#[test]
fn a_tradeoff_leaves_a_page_and_a_table() {
    let folder = tempfile::tempdir().expect("a folder");
    let output = raywright(
        folder.path(),
        &[
            "volume",
            "tradeoff",
            "marschner-lobb",
            "--dims",
            "24,24,24",
            "--width",
            "40",
            "--height",
            "32",
            "--rounds",
            "1",
            "--error",
            "2",
            "--time",
            "0",
            "-o",
            "out",
        ],
    );
    assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
    let printed = text(&output.stdout);
    assert!(
        printed.contains("With an error of at most 2, "),
        "{printed}"
    );
    assert!(
        printed.contains("No setting takes 0 ms or less."),
        "{printed}"
    );
    let page = folder.path().join("out/marschner-lobb-tradeoff.html");
    let page = fs::read_to_string(page).expect("a page");
    assert!(page.contains("<svg") && page.contains("What no other setting beats"));
    let table = folder.path().join("out/marschner-lobb-tradeoff.csv");
    let table = fs::read_to_string(table).expect("a table");
    let columns = table.lines().next().expect("a head").split(',').count();
    assert!(table.lines().count() > 200);
    assert!(table.lines().all(|line| line.split(',').count() == columns));
}

#[test]
fn an_evaluation_is_repeated_to_the_last_bit() {
    let folder = tempfile::tempdir().expect("a folder");
    let evaluate = || {
        let args = "volume evaluate marschner-lobb --side 24 --fps 2 --seeds 1 --noise 0.05 -o out";
        let output = raywright(folder.path(), &args.split(' ').collect::<Vec<_>>());
        assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
        let frames = fs::read_to_string(folder.path().join("out/evaluation.csv"));
        (text(&output.stdout), frames.expect("a table"))
    };
    let (printed, frames) = evaluate();
    for way in [
        "no adapt",
        "last frame",
        "paper",
        "ours",
        "in parts",
        "two pass",
    ] {
        assert!(printed.contains(way), "{printed}");
    }
    assert!(printed.contains("goals: "), "{printed}");
    // 30 seconds, two starts, four and six ways.
    assert_eq!(frames.lines().count(), 1 + 60 * 2 * 10);
    assert_eq!(evaluate(), (printed, frames));
    let output = raywright(folder.path(), &["volume", "evaluate", "missing.nrrd"]);
    assert_eq!(output.status.code(), Some(2));
}

#[test]
fn a_sequence_is_recorded_played_and_played_again() {
    let folder = tempfile::tempdir().expect("a folder");
    let play = |more: &str| {
        let args = format!(
            "volume play marschner-lobb --dims 20,20,20 --width 24 --height 24 --target-fps 4 --work-clock {more}"
        );
        let output = raywright(folder.path(), &args.split(' ').collect::<Vec<_>>());
        assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
        text(&output.stdout)
    };
    let first = play("--record own.json --save-every 40 -o out");
    // In four of thirty seconds nothing moves, and what is there is refined.
    assert!(first.starts_with("104 frames, ours, in parts"), "{first}");
    let page = fs::read_to_string(folder.path().join("out/marschner-lobb-timeline.html"));
    assert!(page.expect("a page").contains("<svg"));
    let frames = fs::read_dir(folder.path().join("out")).expect("a folder");
    assert_eq!(frames.count(), 1 + 3);
    assert_eq!(play("--sequence own.json -o out"), first);
    assert!(play("--mode last-frame").starts_with("120 frames, last frame"));
    play("--fewer-rays");
    let output = raywright(
        folder.path(),
        &["volume", "play", "marschner-lobb", "--target-fps", "0"],
    );
    assert_eq!(output.status.code(), Some(2));
}
