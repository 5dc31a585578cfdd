//! Whole pages: everything is in them, and nothing that must not be.

use super::*;
use crate::report::example;
use crate::report::record::{FrameRecord, Spread};

/// What a page must not have, whatever the run: foreign files, script, numbers that are none.
fn assert_sound(html: &str) {
    for foreign in [
        "http://", "https://", "src=\"//", "url(", "@import", "<script",
    ] {
        assert!(!html.contains(foreign), "{foreign}");
    }
    for number in ["NaN", "inf\"", ">inf", "-inf", "\"-0.0\""] {
        assert!(!html.contains(number), "{number}");
    }
    let mut open: Vec<&str> = Vec::new();
    for piece in html.split('<').skip(1) {
        let tag = piece.split('>').next().unwrap();
        let name = tag.split([' ', '\n']).next().unwrap();
        let void = tag.ends_with('/') || ["!DOCTYPE", "meta", "img", "wbr"].contains(&name);
        if let Some(closed) = name.strip_prefix('/') {
            assert_eq!(open.pop(), Some(closed), "{tag}");
        } else if !void {
            open.push(name);
        }
    }
    assert_eq!(open, [""; 0]);
}

fn failed(frame: &mut FrameRecord) {
    frame.build_ms = None;
    frame.render_ms = None;
    frame.cost_ms = None;
    frame.incumbent_cost_ms = None;
    frame.failure = Some("too deep".to_string());
}

#[test]
fn the_page_has_every_frame_parameter_indicator_and_configuration() {
    let run = example::run(80);
    let html = page(&run, None);
    assert_sound(&html);
    for frame in &run.frames {
        let number = frame.frame;
        assert!(html.contains(&format!("<tr><th scope=\"row\" class=\"n\">{number}</th>")));
        assert!(
            html.contains(&format!("<title>frame {number}:")),
            "{number}"
        );
    }
    for (name, value) in &run.frames[0].config {
        assert!(html.contains(&format!(">{name}</th>")), "{name}");
        assert!(html.contains(&format!("{name} = {value}")), "{name}");
    }
    for (name, _) in &run.header.indicators {
        assert!(html.contains(name.as_str()), "{name}");
    }
    assert!(html.contains("Tuned for render time: 1.32 × faster than Table 1&#39;s default"));
    assert!(html.contains("1.040 × faster than Embree&#39;s scene setting"));
    assert_eq!(html.matches("<figcaption>").count(), 11);
}

#[test]
fn the_picture_is_inside() {
    let html = page(&example::run(2), Some(b"foobar"));
    assert!(html.contains("src=\"data:image/png;base64,Zm9vYmFy\""));
    assert!(!page(&example::run(2), None).contains("<img"));
}

#[test]
fn names_with_special_characters_are_harmless() {
    let evil = "</title><script>&\"'";
    let mut run = example::run(20);
    run.header.scene = evil.to_string();
    run.header.search = evil.to_string();
    run.header.indicators[0].0 = evil.to_string();
    for frame in &mut run.frames {
        frame.config[0] = (evil.to_string(), evil.to_string());
    }
    run.frames[11].failure = Some(evil.to_string());
    let comparison = &mut run.summary.as_mut().unwrap().comparison;
    comparison[1].name = evil.to_string();
    comparison[1].config[0].1 = evil.to_string();
    let html = page(&run, None);
    assert_sound(&html);
    assert!(html.contains("&lt;/title&gt;&lt;script&gt;&amp;&quot;&#39;"));
}

#[test]
fn no_frame_is_a_page() {
    let mut run = example::run(0);
    run.summary = None;
    run.header.frames_planned = 80;
    run.header.indicators.clear();
    let html = page(&run, None);
    assert_sound(&html);
    assert!(html.contains("no frame has been tried"));
    assert!(html.contains("0 of 80 planned frames"));
    assert!(html.contains("no comparison"));
}

#[test]
fn one_frame_is_a_page() {
    let html = page(&example::run(1), None);
    assert_sound(&html);
    assert!(html.contains("<title>frame 0:"));
}

#[test]
fn only_failures_are_a_page() {
    let mut run = example::run(9);
    run.frames.iter_mut().for_each(failed);
    run.summary = None;
    let html = page(&run, None);
    assert_sound(&html);
    assert!(html.contains("9 of 9 trials failed"));
    assert!(
        !html.contains(">tried<"),
        "the legend names what is not there"
    );
    assert!(html.contains("All frames failed"));
}

#[test]
fn an_interrupted_run_says_so() {
    let mut run = example::run(9);
    run.header.frames_planned = 80;
    let summary = run.summary.as_mut().unwrap();
    summary.interrupted = true;
    summary.comparison.clear();
    let html = page(&run, None);
    assert_sound(&html);
    assert!(html.contains("interrupted: 9 of 80"));
    assert!(html.contains("no comparison"));
}

#[test]
fn extreme_and_equal_numbers_are_drawn() {
    for cost in [
        0.0,
        5e-324,
        1e-12,
        31.0,
        1e15,
        1e300,
        f64::MAX,
        f64::NAN,
        f64::INFINITY,
    ] {
        let mut run = example::run(12);
        for frame in &mut run.frames {
            frame.build_ms = Some(cost);
            frame.render_ms = Some(cost);
            frame.cost_ms = Some(cost);
            frame.incumbent_cost_ms = Some(cost);
        }
        let spread = Spread {
            median: cost,
            lower: cost,
            upper: cost,
        };
        for row in &mut run.summary.as_mut().unwrap().comparison {
            row.build_ms = spread;
            row.render_ms = spread;
            row.cost_ms = spread;
            row.cost_ratio_to_tuned = spread;
        }
        run.header.indicators[0].1 = cost;
        assert_sound(&page(&run, None));
        // And one frame among them that is ordinary.
        run.frames[5].cost_ms = Some(40.0);
        assert_sound(&page(&run, None));
    }
}

#[test]
fn probes_are_a_page() {
    let run = example::probed(60);
    let html = page(&run, None);
    assert_sound(&html);
    for text in [
        "Beyond the same frames",
        "probe in frame 1:",
        "frames per tree",
    ] {
        assert!(html.contains(text), "{text}");
    }
}

#[test]
fn missing_data_are_sentences() {
    let html = page(&example::run(1), None);
    assert!(html.contains("No candidate was probed"));
    assert!(html.contains("told from 20 measured trials on; here are 1"));
    assert!(html.contains("there was no regret at any time"));
    let mut run = example::run(30);
    run.summary = None;
    assert!(page(&run, None).contains("Without a comparison there is no reference"));
}

#[test]
fn numbers_of_probes_and_frames_that_are_none_are_harmless() {
    for odd in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 0.0, -1.0, 1e300] {
        let mut run = example::probed(40);
        run.header.frames_per_tree = Some(odd);
        for (index, frame) in run.frames.iter_mut().enumerate() {
            let probe = frame.probe.as_mut();
            if let Some(probe) = probe {
                match index % 3 {
                    0 => probe.ratio = odd,
                    1 => (probe.lower, probe.upper) = (odd, odd),
                    _ => probe.share = odd,
                }
            }
            if index % 4 == 0 {
                frame.frame_ms = Some(odd);
            }
        }
        assert_sound(&page(&run, None));
        for frame in &mut run.frames {
            frame.frame_ms = Some(odd);
        }
        assert_sound(&page(&run, None));
    }
}

/// Everything that is drawn one by one is limited, so that the page stays small.
#[test]
fn a_long_run_is_a_small_page() {
    for run in [example::run(5000), example::probed(5000)] {
        let html = page(&run, None);
        assert_sound(&html);
        assert!(html.len() < 3_500_000, "{}", html.len());
        assert!(html.contains("The first and the last 500 of 5000 frames"));
        assert!(html.contains("are drawn here and below"));
    }
    let mut run = example::run(5000);
    run.frames.iter_mut().for_each(failed);
    run.summary = None;
    let html = page(&run, None);
    assert_sound(&html);
    assert!(
        html.contains(">0–4999<") && html.len() < 1_500_000,
        "{}",
        html.len()
    );
}

#[test]
#[ignore = "writes pages for people to look at, into the folder for temporary files"]
fn pages_to_look_at() {
    let mut failed_all = example::run(9);
    failed_all.frames.iter_mut().for_each(failed);
    failed_all.summary = None;
    let mut none = example::run(0);
    none.summary = None;
    let mut equal = example::run(40);
    for frame in &mut equal.frames {
        (frame.build_ms, frame.render_ms) = (Some(5.0), Some(15.0));
        (frame.cost_ms, frame.incumbent_cost_ms) = (Some(20.0), Some(20.0));
    }
    let folder = std::env::temp_dir().join("raywright-pages");
    std::fs::create_dir_all(&folder).unwrap();
    for (name, run) in [
        ("plain", example::run(80)),
        ("probed", example::probed(80)),
        ("long", example::run(5000)),
        ("long-probed", example::probed(5000)),
        ("one", example::run(1)),
        ("failed", failed_all),
        ("none", none),
        ("equal", equal),
    ] {
        std::fs::write(folder.join(format!("{name}.html")), page(&run, None)).unwrap();
    }
}
