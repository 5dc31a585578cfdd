//! All classes of extremes with few rays: none fails, and what they count is what they should.

use std::path::Path;

use raywright_validation::extremes::{CLASSES, GOLDEN, Settings, Verdict};

#[test]
fn no_class_fails() {
    let settings = Settings {
        rays: 200,
        golden: Path::new(env!("CARGO_MANIFEST_DIR"))
            .join("../../shared/data/golden/robust/cases.json"),
    };
    let mut failed = Vec::new();
    for class in CLASSES.into_iter().chain([GOLDEN]) {
        let findings = class.run(&settings);
        assert!(
            !findings.figures.is_empty() || findings.verdict() == Verdict::Recorded,
            "T{:02} counts nothing",
            class.number
        );
        if findings.verdict() == Verdict::Fail {
            failed.push(format!("T{:02}: {:?}", class.number, findings.faults));
        }
    }
    assert!(failed.is_empty(), "{}", failed.join("\n"));
}
