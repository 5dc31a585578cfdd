//! One set of rays by one thread: answers compared, times taken, a table printed.

use raywright_benches::{
    clock::Clock,
    rays::RaySet,
    turns::{Ratio, Turns, measure_chunks},
};
use raywright_bvh::Ray;

use super::{
    embree::EmbreeScene,
    engine::{Answers, Engine, Role},
    ours::{Calls, Ours},
};

const ROUNDS: usize = 5;
const CHUNK: usize = 8192;
/// Distances that differ by more, relative to their size, are other hits.
const TOLERANCE: f32 = 1e-4;

/// What was found about a set.
pub(crate) struct Measured {
    roles: Vec<Role>,
    turns: Turns,
    /// Rays that each engine answers differently than the first one.
    different: Vec<usize>,
    rays: usize,
    pub(crate) choice: Option<Ours>,
}

impl Measured {
    /// The speed of an engine as a multiple of that of another; `None` if one was not measured.
    pub(crate) fn speed(&self, of: Role, base: Role) -> Option<f64> {
        let place = |role| self.roles.iter().position(|r| *r == role);
        Some(self.turns.time_ratio(place(base)?, place(of)?).median)
    }

    /// The automatic choice beside whatever was fastest of Embree, with its name.
    pub(crate) fn choice_beside_best(&self) -> Option<(f64, EmbreeScene)> {
        let choice = Role::Ours(self.choice?);
        let speeds = EmbreeScene::BEST
            .iter()
            .filter_map(|&scene| Some((self.speed(choice, Role::Embree(scene))?, scene)));
        speeds.min_by(|a, b| a.0.total_cmp(&b.0))
    }

    /// The automatic choice beside the fastest engine of another crate.
    pub(crate) fn choice_beside_peers(&self) -> Option<f64> {
        let choice = Role::Ours(self.choice?);
        let peers = self.roles.iter().filter(|r| matches!(r, Role::Peer(_)));
        peers
            .filter_map(|&peer| self.speed(choice, peer))
            .min_by(f64::total_cmp)
    }

    /// The largest share of rays that an engine of ours answers differently, and which.
    pub(crate) fn most_different(&self) -> Option<(f64, Role)> {
        let ours = self.roles.iter().zip(&self.different);
        ours.filter(|(role, _)| matches!(role, Role::Ours(_)))
            .map(|(&role, &count)| (count as f64 / self.rays as f64, role))
            .max_by(|a, b| a.0.total_cmp(&b.0))
    }

    fn print(&self, set: &RaySet) {
        println!(
            "\n{}, {} hit ({} rays); {}, {ROUNDS} rounds in turns by chunks of {CHUNK}",
            set.name,
            if set.any_hit { "any" } else { "closest" },
            self.rays,
            Clock::ThreadCpu.name()
        );
        println!(
            "  {:<42}{:>10}{:>8}{:>18}{:>10}",
            "", "Mrays/s", "speed", "quartiles", "differ"
        );
        for place in 0..self.roles.len() {
            self.print_row(&self.roles[place].to_string(), place);
        }
        let Some(choice) = self.choice else { return };
        let role = Role::Ours(choice);
        if let Some(place) = self.roles.iter().position(|r| *r == role) {
            self.print_row(&format!("automatic: {choice}"), place);
        }
        if let Some((speed, scene)) = self.choice_beside_best() {
            println!("  automatic ÷ the best of Embree ({scene}): {speed:.3}");
        }
    }

    fn print_row(&self, name: &str, place: usize) {
        let Ratio { median, quartiles } = self.turns.speed[place];
        println!(
            "  {name:<42}{:>10.2}{median:>8.3}{:>18}{:>10}",
            self.rays as f64 / self.turns.times[place].as_secs_f64() / 1e6,
            format!("{:.3} … {:.3}", quartiles[0], quartiles[1]),
            self.different[place]
        );
    }
}

/// Compares, measures and prints.
pub(crate) fn measure(set: &RaySet, engines: &[Engine<'_>], choice: Option<Ours>) -> Measured {
    let different = different(set, engines);
    let chunks: Vec<&[Ray]> = set.rays.chunks(CHUNK).collect();
    let mut answers = Answers::default();
    let turns = measure_chunks(
        engines.len(),
        ROUNDS,
        chunks.len(),
        Clock::ThreadCpu,
        |engine, chunk| {
            engines[engine].ask(set, chunks[chunk], &mut answers);
            std::hint::black_box(&mut answers);
        },
    );
    let measured = Measured {
        roles: engines.iter().map(|engine| engine.role).collect(),
        turns,
        different,
        rays: set.rays.len(),
        choice,
    };
    measured.print(set);
    measured
}

/// How many rays each engine answers differently than the first.
fn different(set: &RaySet, engines: &[Engine<'_>]) -> Vec<usize> {
    let answers = |engine: &Engine<'_>| {
        let mut answers = Answers::default();
        engine.ask(set, &set.rays, &mut answers);
        answers
    };
    let expected = answers(&engines[0]);
    let count = |engine| {
        let got: Answers = answers(engine);
        if set.any_hit {
            let pairs = got.is_hit.iter().zip(&expected.is_hit);
            pairs.filter(|(got, expected)| got != expected).count()
        } else {
            let pairs = got.closest.iter().zip(&expected.closest);
            pairs
                .filter(|(got, expected)| differ(got.t, expected.t))
                .count()
        }
    };
    engines.iter().map(count).collect()
}

fn differ(got: f32, expected: f32) -> bool {
    // A hit beside a miss is a difference, whatever its distance from infinity.
    got.is_finite() != expected.is_finite()
        || (got.is_finite() && (got - expected).abs() > TOLERANCE * expected.abs())
}

/// What a triangle takes in each tree.
pub(crate) fn print_bytes(engines: &[Engine<'_>]) {
    println!("bytes per triangle:");
    for engine in engines {
        let is_batch = matches!(engine.role, Role::Ours(ours) if ours.calls != Calls::Single);
        if let Some(bytes) = engine.bytes_per_triangle.filter(|_| !is_batch) {
            println!("  {:<42}{bytes:>8.1}", engine.role.to_string());
        }
    }
}
