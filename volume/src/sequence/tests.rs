use super::*;

const SMALL: &str = r#"{ "format": "raywright-sequence-1", "volume": "a.nrrd", "duration_s": 4, "fps": 10,
  "viewport": [64, 32],
  "camera": [{ "t": 0, "position": [9, 0, 0], "focal": [0, 0, 0], "up": [0, 0, 1], "vfov_deg": 30 },
             { "t": 4, "position": [0, 9, 0], "focal": [0, 0, 0], "up": [0, 0, 1], "vfov_deg": 50 }],
  "tf": [{ "t": 0, "points": [[0, 0, 0, 0, 0], [10, 1, 1, 1, 0.8]] },
         { "t": 2, "points": [[0, 0, 0, 0, 0.4]], "blend_s": 1 }],
  "events": [{ "t": 0, "kind": "window", "range": [10, 30] },
             { "t": 1, "kind": "clip", "box": [[0, 0, 0], [5, 6, 7]] },
             { "t": 1, "kind": "window", "range": null },
             { "t": 2, "kind": "iso", "values": [3.5, 4] },
             { "t": 3, "kind": "idle", "duration_s": 0.5 },
             { "t": 3, "kind": "clip", "box": null }],
  "seed": 5, "note": "small" }"#;

fn small() -> Sequence {
    Sequence::parse(SMALL.as_bytes()).unwrap()
}

#[test]
fn moments_of_a_small_sequence() {
    let sequence = small();
    assert_eq!(sequence.frames(), 40);
    assert_eq!(sequence.time_of(15), 1.5);
    let at = |time: f64| sequence.at(time).unwrap();
    let start = at(-1.0);
    assert_eq!(start.time, 0.0);
    assert_eq!(start.camera, sequence.camera[0].camera());
    assert!((start.function.at(20.0)[3] - 0.4).abs() < 1e-6);
    assert_eq!((start.clip, start.function_key), (None, 0));
    let later = at(1.0);
    assert_eq!(later.clip.unwrap().max.to_array(), [5.0, 6.0, 7.0]);
    assert!((later.function.at(5.0)[3] - 0.4).abs() < 1e-6);
    let half = at(2.5);
    assert!(half.blending && half.function_key == 1);
    assert!((half.function.at(10.0)[3] - 0.6).abs() < 1e-6);
    assert_eq!(half.iso_values, [3.5, 4.0]);
    assert_eq!(half.camera.vertical_fov_degrees, 42.5);
    let end = at(f64::INFINITY);
    assert_eq!((end.time, end.clip, end.blending), (4.0, None, false));
    assert!(at(3.2).idle && !end.idle);
    assert!(matches!(
        sequence.at(f64::NAN),
        Err(SequenceError::Time { .. })
    ));
}

#[test]
fn there_and_back() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("s.json");
    small().write(&path).unwrap();
    assert_eq!(Sequence::read(&path).unwrap(), small());
    let absent = Sequence::read(&folder.path().join("none.json"));
    assert!(matches!(absent, Err(SequenceError::Io { .. })));
}

#[test]
fn what_is_refused() {
    type Change = fn(&mut Sequence);
    let changes: [(Change, &str); 18] = [
        (|s| s.format = "other".into(), "the format is `other`"),
        (|s| s.duration_s = 0.0, "duration_s is 0"),
        (|s| s.duration_s = f64::NAN, "duration_s is NaN"),
        (|s| s.fps = -3.0, "fps is -3"),
        (|s| s.fps = 1e9, "at most 1e7 frames"),
        (|s| s.viewport[1] = 0, "viewport is 0"),
        (|s| s.camera.clear(), "`camera` has no key"),
        (|s| s.tf.clear(), "`tf` has no key"),
        (
            |s| s.camera[1].t = 4.5,
            "`camera`, key 1: its time 4.5 is not within 0 to 4",
        ),
        (
            |s| s.camera[0].t = f64::NAN,
            "`camera`, key 0: its time NaN",
        ),
        (|s| s.tf[0].t = 3.0, "`tf`, key 1: its time 2 is below 3"),
        (
            |s| s.events[5].t = 2.5,
            "`events`, key 5: its time 2.5 is below 3",
        ),
        (|s| s.events[0].t = -0.1, "`events`, key 0: its time -0.1"),
        (|s| s.camera[1].focal = [0.0, 9.0, 0.0], "`camera`, key 1"),
        (|s| s.tf[1].blend_s = -1.0, "`tf`, key 1: blend_s is -1"),
        (
            |s| {
                s.events[0].kind = EventKind::Window {
                    range: Some([2.0, 2.0]),
                }
            },
            "`events`, key 0: width of range is 0",
        ),
        (
            |s| {
                s.events[1].kind = EventKind::Iso {
                    values: vec![1.0, f32::NAN],
                }
            },
            "`events`, key 1: values is NaN",
        ),
        (
            |s| {
                s.events[4].kind = EventKind::Idle {
                    duration_s: f64::INFINITY,
                }
            },
            "`events`, key 4: duration_s is inf",
        ),
    ];
    for (change, expected) in changes {
        let mut sequence = small();
        change(&mut sequence);
        let message = sequence.check().unwrap_err().to_string();
        assert!(message.contains(expected), "{message}");
    }
    for text in [
        "",
        "{}",
        "[]",
        &SMALL.replace("\"idle\"", "\"sleep\""),
        &SMALL.replace("0.8", "8"),
    ] {
        let refused = Sequence::parse(text.as_bytes());
        assert!(
            matches!(refused, Err(SequenceError::Json(_))),
            "{refused:?}"
        );
    }
}

#[test]
fn an_up_that_vanishes_on_the_way_is_no_view() {
    let mut sequence = small();
    sequence.camera[1].up = [0.0, 0.0, -1.0];
    sequence.check().unwrap();
    sequence.at(1.0).unwrap();
    let middle = sequence.at(2.0);
    assert!(
        matches!(middle, Err(SequenceError::NoView { .. })),
        "{middle:?}"
    );
}
