//! The automatic choice: of our trees and ways to ask them, what is fastest on rays of the same kind
//! that are not measured afterwards.

use raywright_benches::{clock::Clock, rays::RaySet, turns::measure_chunks};
use raywright_bvh::Ray;

use super::{
    engine::{Answers, Engine, Role},
    ours::Ours,
};

const ROUNDS: usize = 3;
const CHUNK: usize = 4096;

/// The fastest of those that can be chosen; `None` if there is none, or no ray to choose by.
pub(crate) fn fastest(engines: &[Engine<'_>], training: &RaySet) -> Option<Ours> {
    let candidates: Vec<(Ours, &Engine<'_>)> = engines
        .iter()
        .filter_map(|engine| match engine.role {
            Role::Ours(ours) if ours.can_be_chosen() => Some((ours, engine)),
            _ => None,
        })
        .collect();
    if candidates.is_empty() || training.rays.is_empty() {
        return None;
    }
    let chunks: Vec<&[Ray]> = training.rays.chunks(CHUNK).collect();
    let mut answers = Answers::default();
    let turns = measure_chunks(
        candidates.len(),
        ROUNDS,
        chunks.len(),
        Clock::ThreadCpu,
        |engine, chunk| {
            candidates[engine]
                .1
                .ask(training, chunks[chunk], &mut answers);
            std::hint::black_box(&mut answers);
        },
    );
    let fastest = candidates.iter().zip(&turns.times).min_by_key(|c| c.1)?;
    Some(fastest.0.0)
}
