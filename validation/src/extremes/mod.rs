//! Extremes: one report over all that breaks ray tracers, class by class, with the figures of Embree 4.4 beside.
//!
//! Source: `design/robustness.md` of the shared folder, section 8 (the classes and what each must hold) and section
//! 1 (what Embree does with the same input). A class passes if its criterion holds, fails if it does not, and is
//! recorded if a part of the criterion cannot be tested here, or is one that the engine does not promise: then the
//! report says which.
//!
//! Invariant: but for times, a report is a function of the settings and the machine's instruction sets.

mod accuracy;
mod cancel;
mod errors;
mod golden_rays;
mod intervals;
mod kernels;
mod leaks;
pub mod meshes;
mod modes;
mod overlaps;
mod running;
mod scales;
mod symmetry;
mod thin;
mod trees;
mod values;

use std::{
    fmt,
    panic::{AssertUnwindSafe, catch_unwind},
    path::PathBuf,
};

use raywright_bvh::{BuildError, MeshError, RefitError};

pub use accuracy::{ABSENT, Row, measure};

/// How much is asked of each class.
#[derive(Clone, Debug)]
pub struct Settings {
    /// Rays of each cell of a class: of each mesh and kind. Sizes of meshes that a class makes large on purpose
    /// follow it.
    pub rays: usize,
    /// The file of golden rays; where it is absent, their class is recorded.
    pub golden: PathBuf,
}

/// Fewer rays are asked of smaller meshes.
const FEW_RAYS: usize = 1000;

impl Settings {
    /// The three closed meshes: those of Embree's table, if rays are not few.
    fn closed(&self) -> Result<[meshes::ClosedMesh; 3], MeshError> {
        if self.are_few() {
            meshes::small_closed()
        } else {
            meshes::closed()
        }
    }

    fn are_few(&self) -> bool {
        self.rays < FEW_RAYS
    }
}

/// What came of a class.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Verdict {
    /// The criterion holds.
    Pass,
    /// It does not.
    Fail,
    /// It holds in so far as it was tested or promised; the report says what was not.
    Recorded,
}

impl fmt::Display for Verdict {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(match self {
            Self::Pass => "pass",
            Self::Fail => "fail",
            Self::Recorded => "recorded",
        })
    }
}

/// A number of a class.
#[derive(Clone, Debug, PartialEq)]
pub struct Figure {
    /// What was counted or measured.
    pub what: String,
    /// What it is here.
    pub ours: String,
    /// What it is in Embree 4.4; empty where nobody measured.
    pub embree: &'static str,
}

/// What a class found.
#[derive(Clone, Debug, Default)]
pub struct Findings {
    /// The numbers.
    pub figures: Vec<Figure>,
    /// Where the criterion does not hold.
    pub faults: Vec<String>,
    /// What of the criterion was not tested, or is not promised.
    pub deviations: Vec<String>,
}

impl Findings {
    /// What comes of it.
    #[must_use]
    pub fn verdict(&self) -> Verdict {
        match (self.faults.is_empty(), self.deviations.is_empty()) {
            (false, _) => Verdict::Fail,
            (true, false) => Verdict::Recorded,
            (true, true) => Verdict::Pass,
        }
    }

    fn figure(&mut self, what: impl Into<String>, ours: impl fmt::Display, embree: &'static str) {
        self.figures.push(Figure {
            what: what.into(),
            ours: ours.to_string(),
            embree,
        });
    }

    /// A part of the criterion.
    fn demand(&mut self, holds: bool, fault: impl FnOnce() -> String) {
        if !holds {
            self.faults.push(fault());
        }
    }

    fn deviates(&mut self, text: impl Into<String>) {
        self.deviations.push(text.into());
    }
}

/// Why a class ended early, which is a fault of the engine: the inputs are valid.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
enum ExtremesError {
    #[error(transparent)]
    Build(#[from] BuildError),
    #[error(transparent)]
    Mesh(#[from] MeshError),
    #[error(transparent)]
    Refit(#[from] RefitError),
    #[error(transparent)]
    Threads(#[from] rayon::ThreadPoolBuildError),
    #[error(transparent)]
    Golden(#[from] crate::golden::GoldenError),
    #[error("golden rays: {0}")]
    Case(String),
}

type Run = fn(&Settings, &mut Findings) -> Result<(), ExtremesError>;

/// A class of tests.
#[derive(Clone, Copy, Debug)]
pub struct Class {
    /// Its number in the suite.
    pub number: u32,
    /// What it is about.
    pub title: &'static str,
    run: Run,
}

impl Class {
    /// Runs it. A panic is a fault.
    #[must_use]
    pub fn run(&self, settings: &Settings) -> Findings {
        let mut findings = Findings::default();
        let ended = catch_unwind(AssertUnwindSafe(|| (self.run)(settings, &mut findings)));
        match ended {
            Ok(Ok(())) => {}
            Ok(Err(error)) => findings.faults.push(format!("ended by an error: {error}")),
            Err(_) => findings.faults.push("ended by a panic".to_owned()),
        }
        findings
    }
}

const fn class(number: u32, title: &'static str, run: Run) -> Class {
    Class { number, title, run }
}

/// The classes that concern trees, builders and kernels.
pub const CLASSES: [Class; 26] = [
    class(1, "bounds of the kernels' errors", errors::bounds),
    class(2, "kernels equal the slow twin", kernels::twins),
    class(3, "leaks, random rays", leaks::random),
    class(4, "trees reject no hit", kernels::closure),
    class(5, "leaks at edges", leaks::edges),
    class(6, "leaks at vertices", leaks::vertices),
    class(7, "symmetric solids", symmetry::solids),
    class(8, "axis-parallel rays, zeros of both signs", symmetry::axes),
    class(9, "intervals", intervals::ends),
    class(10, "invalid rays", intervals::invalid),
    class(11, "scale", scales::scale),
    class(12, "offset", scales::offset),
    class(13, "mixed scale", scales::mixed),
    class(14, "slivers, grazing rays", thin::slivers),
    class(15, "triangles without area", thin::degenerate),
    class(16, "vertices that are not finite", values::vertices),
    class(17, "identical and concentric triangles", trees::identical),
    class(18, "deep trees", trees::deep),
    class(19, "coplanar overlap", overlaps::coplanar),
    class(21, "stack", trees::stack),
    class(22, "limits, memory", values::limits),
    class(23, "cancellation, panic", cancel::cancel),
    class(24, "hostile calls", values::hostile),
    class(26, "determinism over threads", running::determinism),
    class(27, "concurrency", running::concurrency),
    class(28, "refit", running::refit),
];

/// Golden rays, which need their file.
pub const GOLDEN: Class = class(33, "golden rays", golden_rays::golden);

/// The classes of other rooms: number, title, where their tests are, and what these leave out.
pub const ELSEWHERE: [(u32, &str, &str); 6] = [
    (
        20,
        "secondary rays",
        "tracer/src/surface.rs (self hits; no chain of ten bounces)",
    ),
    (
        25,
        "frame control",
        "volume/tests/steering.rs, volume/src/steer (no spikes of single frames)",
    ),
    (
        29,
        "loaders",
        "tracer/tests/load_obj.rs, volume/tests/hostile_files.rs",
    ),
    (30, "store", "tuner/tests/store"),
    (
        31,
        "volumes",
        "volume/src/cast/tests, volume/tests/skipping_changes_no_pixel.rs",
    ),
    (
        32,
        "differences from Embree",
        "the command hits of this program",
    ),
];
