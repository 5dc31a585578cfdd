//! The command line as a user meets it: exit codes, messages, files left behind.

#![cfg(feature = "cli")]

use std::{
    fs,
    io::Write,
    path::Path,
    process::{Command, Output},
};

use serde_json::Value;

fn raywright(folder: &Path, args: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_raywright"));
    command
        .args(args)
        .current_dir(folder)
        .env_remove("RAYWRIGHT_ISA")
        .env_remove("RAYWRIGHT_THREADS");
    command.output().expect("the binary runs")
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

const TRIANGLE: &str = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";

/// Renders a small picture of a file with this content.
fn render(name: &str, content: &[u8]) -> Output {
    let folder = tempfile::tempdir().expect("a folder");
    fs::write(folder.path().join(name), content).expect("a file");
    let output = raywright(
        folder.path(),
        &[
            "render", name, "--width", "8", "--height", "8", "--spp", "1",
        ],
    );
    assert!(
        !text(&output.stderr).contains("panicked"),
        "{}",
        text(&output.stderr)
    );
    output
}

/// Bad input: exit code 2 and a message that holds every one of `expected`.
fn refused(name: &str, content: &[u8], expected: &[&str]) {
    let output = render(name, content);
    let message = text(&output.stderr);
    assert_eq!(output.status.code(), Some(2), "{message}");
    for expected in expected {
        assert!(
            message.contains(expected),
            "{expected:?} is not in: {message}"
        );
    }
}

/// Good enough: exit code 0 and a note that holds every one of `expected`.
fn noted(content: &str, expected: &[&str]) {
    let output = render("scene.obj", content.as_bytes());
    let message = text(&output.stderr);
    assert_eq!(output.status.code(), Some(0), "{message}");
    for expected in expected {
        assert!(
            message.contains(expected),
            "{expected:?} is not in: {message}"
        );
    }
}

#[test]
fn an_index_out_of_range_is_refused_with_its_line() {
    refused(
        "scene.obj",
        format!("{TRIANGLE}f 1 2 4\n").as_bytes(),
        &["scene.obj", "line 4", "4"],
    );
    refused(
        "scene.obj",
        format!("{TRIANGLE}f 1 2 -4\n").as_bytes(),
        &["line 4", "-4"],
    );
    refused(
        "scene.obj",
        format!("{TRIANGLE}f 0 1 2\n").as_bytes(),
        &["line 4"],
    );
}

#[test]
fn no_faces_and_no_usable_faces_are_refused() {
    refused("scene.obj", TRIANGLE.as_bytes(), &["no face"]);
    refused("scene.obj", b"", &["no face"]);
    refused(
        "scene.obj",
        b"v nan 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n",
        &["not finite"],
    );
}

#[test]
fn nan_coordinates_drop_their_triangles_with_a_count() {
    noted(
        &format!("{TRIANGLE}v nan 0 0\nv inf 0 0\nf 1 2 3\nf 1 2 4\nf 1 2 5\n"),
        &["2 triangles", "not finite"],
    );
}

#[test]
fn a_missing_material_library_is_noted() {
    noted(
        &format!("mtllib nowhere.mtl\n{TRIANGLE}usemtl red\nf 1 2 3\n"),
        &["nowhere.mtl", "red"],
    );
}

#[test]
fn degenerate_faces_are_counted_and_a_dark_scene_gets_a_sky() {
    noted(
        &format!("{TRIANGLE}f 1 2 3\nf 1 1 2\nf 1 2 2\n"),
        &["2 triangles of zero area", "no lights", "sky"],
    );
}

#[test]
fn a_truncated_or_damaged_gzip_is_refused() {
    let mut encoder = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::best());
    let many: String = (0..2000)
        .map(|i| format!("v {i} {} 0\n", i * 7919 % 1000))
        .collect();
    encoder
        .write_all(format!("{many}f 1 2 3\n").as_bytes())
        .expect("memory");
    let whole = encoder.finish().expect("memory");
    assert_eq!(render("scene.obj.gz", &whole).status.code(), Some(0));
    refused("scene.obj.gz", &whole[..whole.len() / 2], &["scene.obj.gz"]);
    refused("scene.obj.gz", &whole[..5], &["scene.obj.gz"]);
    refused("scene.obj.gz", b"this is no gzip", &["scene.obj.gz"]);
}

#[test]
fn nonsense_is_refused_with_its_line() {
    refused("scene.obj", b"v 0 0\n", &["line 1"]);
    refused(
        "scene.obj",
        format!("{TRIANGLE}f 1 two 3\n").as_bytes(),
        &["line 4"],
    );
    refused("scene.obj", &[0xff, 0x00, 0x80, b'\n', b'f'], &[]);
    refused("scene.stl", b"solid", &["unknown", ".obj"]);
}

#[test]
fn a_file_that_is_absent_gets_a_hint() {
    let folder = tempfile::tempdir().expect("a folder");
    let output = raywright(folder.path(), &["render", "nowhere.obj"]);
    assert_eq!(output.status.code(), Some(2));
    let message = text(&output.stderr);
    assert!(
        message.contains("nowhere.obj")
            && message.contains("hint:")
            && message.contains("interior"),
        "{message}"
    );
}

#[test]
fn usage_errors_have_exit_code_2_and_advice() {
    let folder = tempfile::tempdir().expect("a folder");
    for (args, expected) in [
        (&["render", "interior", "-D", "max_dept=3"][..], "max_depth"),
        (&["render", "interior", "-D", "max_depth=99"], "1..=64"),
        (
            &["render", "interior", "-D", "quality=best"],
            "spatial-splits",
        ),
        (&["render", "interior", "-D", "max_depth"], "NAME=VALUE"),
        (
            &["render", "interior", "-D", "ray_packets=on"],
            "one at a time",
        ),
        (&["render", "interior", "--isa", "sse9"], "portable"),
        (&["render", "interior", "--spp", "0"], "spp"),
        (&["render", "interior", "--width", "0"], "0"),
        (&["render", "interior", "--fov", "180"], "180"),
        (
            &[
                "render",
                "interior",
                "-o",
                "picture.xyz",
                "--width",
                "8",
                "--height",
                "8",
                "--spp",
                "1",
            ],
            "png",
        ),
        (
            &[
                "render",
                "interior",
                "-D",
                "branching_factor=2",
                "-D",
                "max_depth=9",
            ],
            "levels are needed",
        ),
        (&["tune", "interior", "--search", "magic"], "nelder-mead"),
        (&["dance"], "Usage"),
    ] {
        let output = raywright(folder.path(), args);
        let message = text(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{args:?}: {message}");
        assert!(
            message.contains(expected),
            "{args:?}: {expected:?} is not in: {message}"
        );
    }
}

#[test]
fn render_writes_every_format_and_one_json_object() {
    let folder = tempfile::tempdir().expect("a folder");
    for ending in ["png", "exr", "pfm"] {
        let file = format!("picture.{ending}");
        let size = ["--width", "16", "--height", "9", "--spp", "1"];
        let output = raywright(
            folder.path(),
            &[&["render", "interior", "--json", "-o", &file][..], &size].concat(),
        );
        assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
        let report: Value = serde_json::from_slice(&output.stdout).expect("one JSON object");
        assert_eq!(
            (&report["schema_version"], &report["width"]),
            (&1.into(), &16.into())
        );
        assert!(report["render_ms"].as_f64().is_some_and(|ms| ms > 0.0));
        assert!(
            fs::metadata(folder.path().join(&file)).is_ok_and(|m| m.len() > 100),
            "{file}"
        );
    }
}

#[test]
fn views_show_what_they_are_called() {
    let folder = tempfile::tempdir().expect("a folder");
    let mut pictures = Vec::new();
    for show in [
        "paths",
        "naive-paths",
        "normals",
        "geometry-ids",
        "primitive-ids",
        "nodes",
    ] {
        let args = [
            "render", "interior", "--show", show, "-o", "view.png", "--width", "32", "--height",
            "18", "--spp", "1",
        ];
        let output = raywright(folder.path(), &args);
        assert_eq!(
            output.status.code(),
            Some(0),
            "{show}: {}",
            text(&output.stderr)
        );
        pictures.push(fs::read(folder.path().join("view.png")).expect("a picture"));
    }
    pictures.sort();
    pictures.dedup();
    assert_eq!(pictures.len(), 6, "no two views are the same");
}

#[test]
fn inspect_tells_counts_indicators_and_tree() {
    let folder = tempfile::tempdir().expect("a folder");
    let output = raywright(
        folder.path(),
        &[
            "inspect",
            "voxel-terrain",
            "--json",
            "-D",
            "branching_factor=4",
        ],
    );
    assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
    let report: Value = serde_json::from_slice(&output.stdout).expect("one JSON object");
    assert_eq!(report["indicators"].as_array().map(Vec::len), Some(17));
    assert_eq!(
        report["parameters"][1],
        serde_json::json!(["branching_factor", "4"])
    );
    let references = report["tree"]
        .as_array()
        .expect("rows")
        .iter()
        .find(|row| row[0] == "references");
    assert_eq!(
        references.expect("a row")[1].as_f64(),
        report["triangles"].as_f64()
    );
    let plain = raywright(folder.path(), &["inspect", "voxel-terrain"]);
    assert!(text(&plain.stdout).contains("sah_cost"));
}

#[test]
fn tune_leaves_log_report_and_picture() {
    let folder = tempfile::tempdir().expect("a folder");
    let args = [
        "tune", "interior", "--frames", "12", "--rounds", "2", "--width", "48", "--height", "27",
        "--seed", "3",
    ];
    let output = raywright(folder.path(), &args);
    assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
    let printed = text(&output.stdout);
    for expected in [
        "tuned",
        "Table 1's default",
        "Embree's scene setting",
        "interior-total.html",
    ] {
        assert!(
            printed.contains(expected),
            "{expected:?} is not in: {printed}"
        );
    }
    let out = folder.path().join("raywright-out");
    let log = fs::read_to_string(out.join("interior-total.jsonl")).expect("a log");
    let records: Vec<Value> = log
        .lines()
        .map(|line| serde_json::from_str(line).expect("JSON"))
        .collect();
    let kinds: Vec<&str> = records
        .iter()
        .filter_map(|r| r["record"].as_str())
        .collect();
    assert_eq!(kinds.len(), 14);
    assert_eq!((kinds[0], kinds[13]), ("header", "summary"));
    assert_eq!(records[13]["comparison"].as_array().map(Vec::len), Some(3));
    assert_eq!(records[0]["indicators"].as_array().map(Vec::len), Some(17));
    let page = fs::read_to_string(out.join("interior-total.html")).expect("a page");
    assert!(page.contains("<svg") && page.contains("data:image/png;base64,"));
    assert!(fs::metadata(out.join("interior-total.png")).is_ok());
}

#[test]
fn a_fixed_parameter_is_not_searched() {
    let folder = tempfile::tempdir().expect("a folder");
    let size = [
        "--width", "16", "--height", "9", "--frames", "6", "--rounds", "1",
    ];
    let output = raywright(
        folder.path(),
        &[
            &[
                "tune",
                "interior",
                "--policy",
                "paper",
                "--json",
                "-D",
                "branching_factor=4",
                "--metric",
                "render",
            ][..],
            &size,
        ]
        .concat(),
    );
    assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
    let run: Value = serde_json::from_slice(&output.stdout).expect("one JSON object");
    let frames = run["frames"].as_array().expect("frames");
    assert_eq!(frames.len(), 6);
    for frame in frames {
        assert_eq!(
            frame["config"][1],
            serde_json::json!(["branching_factor", "4"])
        );
        assert_eq!(frame["cost_ms"], frame["render_ms"]);
    }
}

/// A policy is in the log, with what it did.
#[test]
fn policies_use_frames_in_their_own_way() {
    let folder = tempfile::tempdir().expect("a folder");
    let run = |policy: &str| -> Value {
        let args = [
            "tune",
            "interior",
            "--json",
            "--policy",
            policy,
            "--width",
            "64",
            "--height",
            "48",
            "--frames",
            "6",
            "--rounds",
            "1",
            "--frames-per-tree",
            "3",
            "--overhead",
            "1e9",
        ];
        let output = raywright(folder.path(), &args);
        assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
        let run: Value = serde_json::from_slice(&output.stdout).expect("one JSON object");
        assert_eq!(run["header"]["policy"], policy);
        assert_eq!(run["header"]["frames_per_tree"], 3.0);
        assert_eq!(run["frames"].as_array().map(Vec::len), Some(6));
        run
    };
    let probes = |run: &Value| {
        let frames = run["frames"].as_array().expect("frames").iter();
        frames.filter(|frame| frame["probe"].is_object()).count()
    };
    let hybrid = run("hybrid");
    assert!(probes(&hybrid) >= 3, "{hybrid}");
    let [paper, default] = ["paper", "default"].map(run);
    assert_eq!((probes(&paper), probes(&default)), (0, 0));
    let configs: Vec<&Value> = default["frames"]
        .as_array()
        .expect("frames")
        .iter()
        .map(|frame| &frame["config"])
        .collect();
    assert!(configs.iter().all(|config| *config == configs[0]));
}

/// Ctrl-C keeps what is done: a log of whole lines, a page, a picture, exit code 130.
#[cfg(unix)]
#[test]
fn an_interrupted_run_keeps_what_is_done() {
    let folder = tempfile::tempdir().expect("a folder");
    let mut child = Command::new(env!("CARGO_BIN_EXE_raywright"))
        .args([
            "tune", "interior", "--frames", "100000", "--rounds", "1", "--width", "64", "--height",
            "36",
        ])
        .current_dir(folder.path())
        .stdout(std::process::Stdio::null())
        .stderr(std::process::Stdio::null())
        .spawn()
        .expect("the binary runs");
    let log = folder.path().join("raywright-out/interior-total.jsonl");
    let lines = || fs::read_to_string(&log).map_or(0, |text| text.lines().count());
    for _ in 0..600 {
        if lines() > 5 {
            break;
        }
        std::thread::sleep(std::time::Duration::from_millis(100));
    }
    assert!(lines() > 5, "frames are logged while the run goes on");
    let interrupt = Command::new("kill")
        .args(["-INT", &child.id().to_string()])
        .status()
        .expect("kill runs");
    assert!(interrupt.success());
    assert_eq!(child.wait().expect("it ends").code(), Some(130));
    let text = fs::read_to_string(&log).expect("a log");
    let last: Value =
        serde_json::from_str(text.lines().last().expect("lines")).expect("whole lines");
    assert_eq!(
        (&last["record"], &last["interrupted"]),
        (&"summary".into(), &true.into())
    );
    assert!(fs::metadata(folder.path().join("raywright-out/interior-total.html")).is_ok());
}
