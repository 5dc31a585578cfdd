//! Two threads, each with half of the rays, by wall time. On a machine with other jobs the ratios
//! say little, so that nothing is judged by them.

use std::thread;

use raywright_benches::{clock::Clock, rays::RaySet, turns::measure_by};
use raywright_bvh::RayPackets;

use super::{
    embree::EmbreeScene,
    engine::{Answers, Engine, Role},
    ours::{Calls, Ours, TreeKind},
};

const ROUNDS: usize = 5;

/// Measures and prints some of the engines.
pub(crate) fn table(set: &RaySet, engines: &[Engine<'_>]) {
    let engines: Vec<&Engine<'_>> = engines.iter().filter(|e| is_threaded(e.role)).collect();
    let halves = set.rays.split_at(set.rays.len() / 2);
    let mut answers = [Answers::default(), Answers::default()];
    let mut run = |engine: usize| {
        let engine = engines[engine];
        let [first, second] = &mut answers;
        thread::scope(|scope| {
            scope.spawn(|| engine.ask(set, halves.0, first));
            scope.spawn(|| engine.ask(set, halves.1, second));
        });
        std::hint::black_box(&mut answers);
    };
    let turns = measure_by(engines.len(), ROUNDS, |engine| {
        // As with one thread, what is timed finds its own tree in the cache.
        run(engine);
        Clock::Wall.time(|| run(engine))
    });
    println!(
        "\n{}, two threads; {}, {ROUNDS} rounds in turns",
        set.name,
        Clock::Wall.name()
    );
    println!(
        "  {:<42}{:>10}{:>8}{:>18}",
        "", "Mrays/s", "speed", "quartiles"
    );
    for (place, engine) in engines.iter().enumerate() {
        let speed = turns.speed[place];
        println!(
            "  {:<42}{:>10.2}{:>8.3}{:>18}",
            engine.role.to_string(),
            set.rays.len() as f64 / turns.times[place].as_secs_f64() / 1e6,
            speed.median,
            format!("{:.3} … {:.3}", speed.quartiles[0], speed.quartiles[1])
        );
    }
}

fn is_threaded(role: Role) -> bool {
    match role {
        Role::Embree(scene) => EmbreeScene::BEST.contains(&scene),
        Role::Ours(ours) => {
            let trees = [TreeKind::Binned(16), TreeKind::Optimized(16)];
            let eight = Ours {
                tree: TreeKind::Optimized(16),
                calls: Calls::Batch(8, RayPackets::Off),
            };
            ours == eight || trees.map(Ours::single).contains(&ours)
        }
        Role::Peer(_) => false,
    }
}
