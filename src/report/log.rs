//! The log of a run: JSON lines, written as the run goes on.
//!
//! Every line is one object; its key `record` says which kind (`header`, `frame` or `summary`), the
//! other keys are the fields of the struct. A line reaches the operating system before the call
//! returns, so that an interrupted run keeps what is done. Invariant: every number in the file is
//! the number that was measured. JSON knows neither NaN nor infinity, and a serialiser would write
//! `null` for them, which here means *absent*: such a record is refused before anything is written.
//! Only ratio and bounds of a probe may be without a value, and are then indeed absent.

use std::error::Error;
use std::fmt;
use std::fs::File;
use std::io::{self, Write};
use std::path::Path;

use serde::Serialize;

use super::record::{ComparisonRow, FrameRecord, ProbeRecord, RunHeader, RunSummary, Spread};

/// Writes the records of one run to a file.
#[derive(Debug)]
pub struct RunLog {
    // Unbuffered on purpose: every line is one call of `write_all`.
    file: File,
}

/// Why a record was not written.
#[derive(Debug)]
#[non_exhaustive]
pub enum LogError {
    /// The record has a number that JSON cannot hold. Nothing was written.
    NotFinite {
        /// Where the number is, as a path: `comparison[1].cost_ms.median`.
        field: String,
        /// The number.
        value: f64,
    },
    /// The record could not be put into words.
    Serialize(serde_json::Error),
    /// The file could not be written; its last line may be cut.
    Io(io::Error),
}

impl fmt::Display for LogError {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            LogError::NotFinite { field, value } => {
                write!(formatter, "{field} is {value}, which JSON cannot hold")
            }
            LogError::Serialize(_) => write!(formatter, "a record could not be serialised"),
            LogError::Io(_) => write!(formatter, "the log could not be written"),
        }
    }
}

impl Error for LogError {
    fn source(&self) -> Option<&(dyn Error + 'static)> {
        match self {
            LogError::NotFinite { .. } => None,
            LogError::Serialize(error) => Some(error),
            LogError::Io(error) => Some(error),
        }
    }
}

/// A line as it is in the file.
#[derive(Serialize)]
#[serde(tag = "record", rename_all = "snake_case")]
enum Line<'a> {
    Header(&'a RunHeader),
    Frame(&'a FrameRecord),
    Summary(&'a RunSummary),
}

impl RunLog {
    /// An empty log at `path`; what was there is lost.
    pub fn create(path: impl AsRef<Path>) -> io::Result<RunLog> {
        Ok(RunLog {
            file: File::create(path)?,
        })
    }

    /// Writes what is tuned, and how: the first line.
    pub fn header(&mut self, header: &RunHeader) -> Result<(), LogError> {
        require_finite(numbers_of_header(header))?;
        self.write(&Line::Header(header))
    }

    /// Writes one frame.
    pub fn frame(&mut self, frame: &FrameRecord) -> Result<(), LogError> {
        require_finite(numbers_of_frame(frame))?;
        self.write(&Line::Frame(frame))
    }

    /// Writes the comparison: the last line.
    pub fn summary(&mut self, summary: &RunSummary) -> Result<(), LogError> {
        require_finite(numbers_of_summary(summary))?;
        self.write(&Line::Summary(summary))
    }

    fn write(&mut self, line: &Line<'_>) -> Result<(), LogError> {
        let mut bytes = serde_json::to_vec(line).map_err(LogError::Serialize)?;
        bytes.push(b'\n');
        self.file.write_all(&bytes).map_err(LogError::Io)
    }
}

fn require_finite(numbers: Vec<(String, f64)>) -> Result<(), LogError> {
    match numbers.into_iter().find(|(_, value)| !value.is_finite()) {
        Some((field, value)) => Err(LogError::NotFinite { field, value }),
        None => Ok(()),
    }
}

// The patterns below name every field, without `..`: a field that is added to a record does not
// compile here until somebody has decided whether it can be infinite.

fn numbers_of_header(header: &RunHeader) -> Vec<(String, f64)> {
    let RunHeader {
        schema_version: _,
        version: _,
        scene: _,
        triangles: _,
        width: _,
        height: _,
        path_length: _,
        metric: _,
        search: _,
        seed: _,
        threads: _,
        instruction_set: _,
        frames_planned: _,
        indicators,
        policy: _,
        frames_per_tree,
    } = header;
    let frames_per_tree = frames_per_tree.map(|frames| ("frames_per_tree".to_string(), frames));
    indicators
        .iter()
        .map(|(name, value)| (format!("indicators[{name}]"), *value))
        .chain(frames_per_tree)
        .collect()
}

fn numbers_of_frame(frame: &FrameRecord) -> Vec<(String, f64)> {
    let FrameRecord {
        frame: _,
        config: _,
        build_ms,
        render_ms,
        cost_ms,
        failure: _,
        incumbent_cost_ms,
        is_incumbent: _,
        frame_ms,
        probe,
        reason: _,
    } = frame;
    let share = probe.as_ref().map(|probe| {
        let ProbeRecord {
            share,
            pairs: _,
            ratio: _,
            lower: _,
            upper: _,
            decision: _,
        } = probe;
        *share
    });
    [
        ("build_ms", build_ms),
        ("render_ms", render_ms),
        ("cost_ms", cost_ms),
        ("incumbent_cost_ms", incumbent_cost_ms),
        ("frame_ms", frame_ms),
        ("probe.share", &share),
    ]
    .into_iter()
    .filter_map(|(name, value)| value.map(|value| (name.to_string(), value)))
    .collect()
}

fn numbers_of_summary(summary: &RunSummary) -> Vec<(String, f64)> {
    let RunSummary {
        rounds: _,
        comparison,
        interrupted: _,
    } = summary;
    let mut numbers = Vec::new();
    for (index, row) in comparison.iter().enumerate() {
        let ComparisonRow {
            name: _,
            config: _,
            build_ms,
            render_ms,
            cost_ms,
            cost_ratio_to_tuned,
        } = row;
        for (name, spread) in [
            ("build_ms", build_ms),
            ("render_ms", render_ms),
            ("cost_ms", cost_ms),
            ("cost_ratio_to_tuned", cost_ratio_to_tuned),
        ] {
            let Spread {
                median,
                lower,
                upper,
            } = *spread;
            for (part, value) in [("median", median), ("lower", lower), ("upper", upper)] {
                numbers.push((format!("comparison[{index}].{name}.{part}"), value));
            }
        }
    }
    numbers
}

#[cfg(test)]
mod tests {
    use std::fs;
    use std::path::PathBuf;

    use serde::Deserialize;

    use super::*;
    use crate::report::example;

    #[derive(Debug, PartialEq, Deserialize)]
    #[serde(tag = "record", rename_all = "snake_case")]
    enum OwnedLine {
        Header(RunHeader),
        Frame(FrameRecord),
        Summary(RunSummary),
    }

    /// A file of its own for each test, removed at the end.
    struct Scratch(PathBuf);

    impl Scratch {
        fn new(name: &str) -> Scratch {
            let name = format!("raywright-log-{}-{name}.jsonl", std::process::id());
            Scratch(std::env::temp_dir().join(name))
        }

        fn text(&self) -> String {
            fs::read_to_string(&self.0).unwrap()
        }
    }

    impl Drop for Scratch {
        fn drop(&mut self) {
            let _ = fs::remove_file(&self.0);
        }
    }

    #[test]
    fn lines_parse_back_and_are_equal() {
        let run = example::run(12);
        let scratch = Scratch::new("round-trip");
        let mut log = RunLog::create(&scratch.0).unwrap();
        log.header(&run.header).unwrap();
        for frame in &run.frames {
            log.frame(frame).unwrap();
        }
        log.summary(run.summary.as_ref().unwrap()).unwrap();

        let mut expected = vec![OwnedLine::Header(run.header)];
        expected.extend(run.frames.into_iter().map(OwnedLine::Frame));
        expected.push(OwnedLine::Summary(run.summary.unwrap()));
        let read: Vec<OwnedLine> = scratch
            .text()
            .lines()
            .map(|line| serde_json::from_str(line).unwrap())
            .collect();
        assert_eq!(read, expected);
    }

    #[test]
    fn fields_lie_beside_the_kind() {
        let scratch = Scratch::new("flat");
        let mut log = RunLog::create(&scratch.0).unwrap();
        log.frame(&example::frame(7)).unwrap();
        let line: serde_json::Value = serde_json::from_str(&scratch.text()).unwrap();
        assert_eq!(line["record"], "frame");
        assert_eq!(line["frame"], 7);
    }

    #[test]
    fn a_line_is_in_the_file_while_the_log_is_open() {
        let scratch = Scratch::new("open");
        let mut log = RunLog::create(&scratch.0).unwrap();
        for written in 1..=3 {
            log.frame(&example::frame(written)).unwrap();
            assert_eq!(scratch.text().lines().count(), written);
            assert!(scratch.text().ends_with('\n'));
        }
    }

    #[test]
    fn line_breaks_in_text_do_not_break_lines() {
        let scratch = Scratch::new("breaks");
        let mut log = RunLog::create(&scratch.0).unwrap();
        let mut frame = example::frame(0);
        frame.failure = Some("first\nsecond \"quoted\" \u{2028}".to_string());
        log.frame(&frame).unwrap();
        assert_eq!(scratch.text().matches('\n').count(), 1);
        let line: OwnedLine = serde_json::from_str(&scratch.text()).unwrap();
        assert_eq!(line, OwnedLine::Frame(frame));
    }

    #[test]
    fn numbers_that_json_cannot_hold_are_refused_and_not_written() {
        let scratch = Scratch::new("not-finite");
        let mut log = RunLog::create(&scratch.0).unwrap();

        let mut frame = example::frame(0);
        frame.render_ms = Some(f64::NAN);
        assert_refused(log.frame(&frame), "render_ms");

        frame.render_ms = None;
        frame.frame_ms = Some(f64::INFINITY);
        assert_refused(log.frame(&frame), "frame_ms");

        let mut run = example::run(1);
        run.header.indicators[3].1 = f64::INFINITY;
        let field = format!("indicators[{}]", run.header.indicators[3].0);
        assert_refused(log.header(&run.header), &field);

        let mut summary = run.summary.unwrap();
        summary.comparison[1].cost_ratio_to_tuned.upper = f64::NEG_INFINITY;
        assert_refused(
            log.summary(&summary),
            "comparison[1].cost_ratio_to_tuned.upper",
        );

        assert_eq!(scratch.text(), "");
    }

    fn assert_refused(result: Result<(), LogError>, expected: &str) {
        match result {
            Err(LogError::NotFinite { field, .. }) => assert_eq!(field, expected),
            other => panic!("{expected} should have been refused, but: {other:?}"),
        }
    }

    /// Lines as version 0.1.0 wrote them, before there were probes.
    #[test]
    fn old_lines_are_read() {
        let header = r#"{"record":"header","schema_version":1,"version":"0.1.0","scene":"rooms","triangles":12,"width":64,"height":36,"path_length":3,"metric":"total","search":"random","seed":1,"threads":2,"instruction_set":"avx2","frames_planned":1,"indicators":[["a",1.5]]}"#;
        let OwnedLine::Header(header) = serde_json::from_str(header).unwrap() else {
            panic!("this is a header");
        };
        assert_eq!((header.policy, header.frames_per_tree), (None, None));
        assert_eq!(header.indicators, [("a".to_string(), 1.5)]);
        let frame = r#"{"record":"frame","frame":3,"config":[["quality","morton"]],"build_ms":2.5,"render_ms":4.0,"cost_ms":6.5,"failure":null,"incumbent_cost_ms":6.5,"is_incumbent":true}"#;
        let OwnedLine::Frame(frame) = serde_json::from_str(frame).unwrap() else {
            panic!("this is a frame");
        };
        assert_eq!(frame.cost_ms, Some(6.5));
        assert_eq!(
            (frame.frame_ms, frame.probe, frame.reason),
            (None, None, None)
        );
    }

    #[test]
    fn a_probe_without_bounds_is_written_and_read() {
        let scratch = Scratch::new("bounds");
        let mut log = RunLog::create(&scratch.0).unwrap();
        let mut frame = example::frame(0);
        frame.probe = Some(ProbeRecord {
            share: 0.25,
            pairs: 2,
            ratio: 1.5,
            lower: f64::NEG_INFINITY,
            upper: f64::INFINITY,
            decision: "undecided".to_string(),
        });
        log.frame(&frame).unwrap();
        let OwnedLine::Frame(read) = serde_json::from_str(&scratch.text()).unwrap() else {
            panic!("this is a frame");
        };
        let probe = read.probe.unwrap();
        assert_eq!((probe.ratio, probe.upper), (1.5, f64::INFINITY));
        assert!(probe.lower.is_nan());
        frame.probe.as_mut().unwrap().share = f64::NAN;
        assert_refused(log.frame(&frame), "probe.share");
    }

    #[test]
    fn absent_numbers_are_null() {
        let scratch = Scratch::new("absent");
        let mut log = RunLog::create(&scratch.0).unwrap();
        let mut frame = example::frame(0);
        frame.cost_ms = None;
        log.frame(&frame).unwrap();
        let line: serde_json::Value = serde_json::from_str(&scratch.text()).unwrap();
        assert_eq!(line["cost_ms"], serde_json::Value::Null);
    }
}
