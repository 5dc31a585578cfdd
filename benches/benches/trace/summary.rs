//! All scenes together: means, the worst scene, and the goals.

use std::{fmt, ops::RangeInclusive};

use raywright_benches::{goals::Goals, turns::geometric_mean};
use raywright_bvh::Isa;

use super::{
    embree::EmbreeScene,
    engine::{Engine, Role},
    ours::{Ours, TreeKind},
    table::Measured,
};

/// Least mean speed of binned SAH beside Embree's medium by set: with all that the machine has where
/// that is AVX-512, and with AVX2.
const SAME_KIND_GOALS: [(&str, f64, f64); 4] = [
    ("primary", 1.3, 1.1),
    ("diffuse", 1.2, 1.05),
    ("shadow", 1.1, 1.0),
    ("random segments", 1.1, 1.0),
];
/// On the worst scene and set of these.
const SAME_KIND_WORST_GOAL: f64 = 0.95;

/// Least mean speed of the automatic choice beside the best of Embree by set.
const AUTOMATIC_GOALS: [(&str, f64); 3] = [("diffuse", 1.6), ("shadow", 1.5), ("primary", 1.3)];
/// On the worst scene and set of these.
const AUTOMATIC_WORST_GOAL: f64 = 1.05;

/// Least mean speeds on diffuse rays beside Embree's own scenes with the same flag.
const ROBUST_GOAL: f64 = 1.1;
const COMPACT_GOAL: f64 = 1.1;
/// Most bytes per triangle of the compact tree, on every scene.
const COMPACT_BYTES_GOAL: f64 = 36.0;
/// Least mean speed of the automatic choice beside the fastest other crate on diffuse rays.
const PEERS_GOAL: f64 = 2.0;
/// Rays that may differ: hits at edges are decided by rounding.
const DIFFERENT_GOAL: f64 = 2e-4;

/// What one and the same engine may seem to gain or lose where times are worth something.
const NOISE: RangeInclusive<f64> = 0.95..=1.05;

/// Two engines that are compared.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Contest {
    SameKindAvx512,
    SameKindAvx2,
    Automatic,
    Robust,
    Compact,
    Peers,
}

impl Contest {
    const ALL: [Self; 6] = [
        Self::SameKindAvx512,
        Self::SameKindAvx2,
        Self::Automatic,
        Self::Robust,
        Self::Compact,
        Self::Peers,
    ];

    /// Ours as a multiple of the other's speed; `None` if one was not measured.
    fn speed(self, measured: &Measured) -> Option<f64> {
        let beside = |tree, scene| {
            let ours = Role::Ours(Ours::single(tree));
            measured.speed(ours, Role::Embree(scene))
        };
        match self {
            Self::SameKindAvx512 => (Isa::best() == Isa::Avx512)
                .then(|| beside(TreeKind::same(), EmbreeScene::Medium))
                .flatten(),
            Self::SameKindAvx2 => beside(TreeKind::Avx2, EmbreeScene::Avx2),
            Self::Automatic => measured.choice_beside_best().map(|best| best.0),
            Self::Robust => beside(TreeKind::Robust, EmbreeScene::Robust),
            Self::Compact => beside(TreeKind::Compact, EmbreeScene::Compact),
            Self::Peers => measured.choice_beside_peers(),
        }
    }
}

impl fmt::Display for Contest {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::SameKindAvx512 => "same kind of tree ÷ Embree medium, AVX-512",
            Self::SameKindAvx2 => "same kind of tree ÷ Embree medium, AVX2",
            Self::Automatic => "automatic choice ÷ best of Embree",
            Self::Robust => "robust ÷ Embree robust",
            Self::Compact => "compact ÷ Embree compact",
            Self::Peers => "automatic choice ÷ fastest other crate",
        })
    }
}

/// What was found on all scenes.
#[derive(Debug, Default)]
pub(crate) struct Summary {
    results: Vec<Outcome>,
    /// Bytes per triangle of the compact tree by scene.
    compact_bytes: Vec<(String, f64)>,
    /// The largest share of rays of a set whose answer is not Embree's, and where.
    most_different: (f64, String),
    /// Speed of Embree's medium scene built again ÷ that of the first, and where.
    noise: Vec<(f64, String)>,
}

#[derive(Debug)]
struct Outcome {
    contest: Contest,
    scene: String,
    set: &'static str,
    speed: f64,
}

impl Summary {
    pub(crate) fn add(&mut self, scene: &str, set: &'static str, measured: &Measured) {
        for contest in Contest::ALL {
            self.results
                .extend(contest.speed(measured).map(|speed| Outcome {
                    contest,
                    scene: scene.to_owned(),
                    set,
                    speed,
                }));
        }
        let [medium, again] = [EmbreeScene::Medium, EmbreeScene::Again].map(Role::Embree);
        let noise = measured.speed(again, medium);
        self.noise
            .extend(noise.map(|speed| (speed, format!("{scene}, {set}"))));
        if let Some((share, role)) = measured.most_different()
            && share > self.most_different.0
        {
            self.most_different = (share, format!("{scene}, {set}, {role}"));
        }
    }

    pub(crate) fn note_bytes(&mut self, scene: &str, engines: &[Engine<'_>]) {
        let compact = Role::Ours(Ours::single(TreeKind::Compact));
        let engine = engines.iter().find(|engine| engine.role == compact);
        let bytes = engine.and_then(|engine| engine.bytes_per_triangle);
        self.compact_bytes
            .extend(bytes.map(|bytes| (scene.to_owned(), bytes)));
    }

    pub(crate) fn judge(&self, goals: &mut Goals) {
        println!();
        for (speed, place) in &self.noise {
            if !NOISE.contains(speed) {
                println!("not to be believed: Embree medium again ÷ itself {speed:.3} ({place})");
            }
        }
        println!("speeds at one thread, geometric mean over the scenes");
        let same_kind = |goal: fn(&(&'static str, f64, f64)) -> f64| {
            SAME_KIND_GOALS.map(|line| (line.0, goal(&line)))
        };
        let (avx512, avx2) = (same_kind(|line| line.1), same_kind(|line| line.2));
        self.judge_sets(
            goals,
            Contest::SameKindAvx512,
            &avx512,
            SAME_KIND_WORST_GOAL,
        );
        self.judge_sets(goals, Contest::SameKindAvx2, &avx2, SAME_KIND_WORST_GOAL);
        self.judge_sets(
            goals,
            Contest::Automatic,
            &AUTOMATIC_GOALS,
            AUTOMATIC_WORST_GOAL,
        );
        self.judge_set(goals, Contest::Robust, "diffuse", ROBUST_GOAL);
        self.judge_set(goals, Contest::Compact, "diffuse", COMPACT_GOAL);
        self.judge_set(goals, Contest::Peers, "diffuse", PEERS_GOAL);
        if let Some((scene, bytes)) = self.compact_bytes.iter().max_by(|a, b| a.1.total_cmp(&b.1)) {
            let what = format!(
                "compact: up to {bytes:.1} bytes per triangle ({scene}), goal ≤ {COMPACT_BYTES_GOAL}"
            );
            check(goals, what, *bytes <= COMPACT_BYTES_GOAL);
        }
        let (share, place) = &self.most_different;
        let what = format!(
            "up to {share:.1e} of the rays have another answer ({place}), goal ≤ {DIFFERENT_GOAL:.0e}"
        );
        check(goals, what, *share <= DIFFERENT_GOAL);
    }

    /// A goal for the mean of each set, and one for the worst scene of all of them.
    fn judge_sets(
        &self,
        goals: &mut Goals,
        contest: Contest,
        sets: &[(&'static str, f64)],
        least_on_worst: f64,
    ) {
        for &(set, least) in sets {
            self.judge_set(goals, contest, set, least);
        }
        let all = self.results.iter().filter(|result| {
            result.contest == contest && sets.iter().any(|(set, _)| *set == result.set)
        });
        let Some(worst) = all.min_by(|a, b| a.speed.total_cmp(&b.speed)) else {
            return;
        };
        let what = format!(
            "{contest}, worst: {:.3} ({}, {}), goal ≥ {least_on_worst}",
            worst.speed, worst.scene, worst.set
        );
        check(goals, what, worst.speed >= least_on_worst);
    }

    fn judge_set(&self, goals: &mut Goals, contest: Contest, set: &str, least: f64) {
        let results: Vec<&Outcome> = self
            .results
            .iter()
            .filter(|result| result.contest == contest && result.set == set)
            .collect();
        let Some(worst) = results.iter().min_by(|a, b| a.speed.total_cmp(&b.speed)) else {
            println!("{contest}, {set}: not measured, not judged");
            return;
        };
        let speeds: Vec<f64> = results.iter().map(|result| result.speed).collect();
        let mean = geometric_mean(&speeds);
        let what = format!(
            "{contest}, {set}: {mean:.3} (worst {:.3}, {}), goal ≥ {least}",
            worst.speed, worst.scene
        );
        check(goals, what, mean >= least);
    }
}

/// Prints a goal with what was found, and counts it.
fn check(goals: &mut Goals, what: String, met: bool) {
    println!("{what}: {}", if met { "met" } else { "missed" });
    goals.check(what, met);
}
