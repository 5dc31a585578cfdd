//! Rays through the trees: ours by our traversal, Embree's by its own. Ours have nodes of eight as
//! Embree's, and of sixteen; the goals are about the width that one register holds.

use std::{cell::RefCell, rc::Rc};

use raywright_benches::{
    clock::Clock,
    goals::Goals,
    rays::{RaySet, ray_sets},
    scenes::BenchScene,
    turns::{geometric_mean, measure_chunks},
};
use raywright_bvh::{BuildParams, Bvh, Isa, Quality, Ray};
use raywright_validation::embree::{BuildQuality, Device, SceneSettings};

use super::builds::params_of;

const ROUNDS: usize = 5;
const CHUNK: usize = 8192;
/// The goal of our best trees beside Embree's best, as a ratio of speeds.
const OPTIMIZED_GOAL: f64 = 1.15;
/// The goal of binned SAH beside Embree's medium on diffuse rays of one scene.
const BINNED_GOAL: f64 = 0.9;
const BINNED_SCENE: &str = "sponza";
const WIDTHS: [u32; 2] = [8, 16];
/// How many rays are in flight together where several are.
const IN_FLIGHT: [usize; 3] = [4, 8, 16];
/// Rays that may differ: hits at edges are decided by rounding.
const DIFFERENT_GOAL: f64 = 2e-4;

/// Something that is asked with many rays. Distances of closest hits are infinite where there is
/// none; an occlusion is 1 or 0.
struct Engine<'a> {
    name: String,
    closest: Box<Ask<'a>>,
    any: Box<Ask<'a>>,
}

/// Answers of rays, one for each.
type Ask<'a> = dyn Fn(&[Ray], &mut [f32]) + 'a;

/// Ratios of speeds over all scenes.
#[derive(Debug, Default)]
pub(crate) struct Summary {
    rows: Vec<Row>,
    /// The largest share of rays of a set whose answer is not Embree's, and where.
    most_different: (f64, String),
}

#[derive(Debug)]
struct Row {
    scene: String,
    set: &'static str,
    /// Speed of our optimised tree ÷ that of Embree's high tree.
    optimized: Option<f64>,
    /// Speed of our binned SAH ÷ that of Embree's medium tree.
    binned: f64,
}

impl Summary {
    pub(crate) fn measure(&mut self, scene: &BenchScene, device: Option<&Device>) {
        let Some(device) = device else { return };
        let world = &scene.world;
        let tree = world
            .build_tree(&Default::default(), &mut Default::default())
            .expect("a tree");
        let sets = ray_sets(world, &tree);
        drop(tree);
        let mut engines = vec![
            embree(device, scene, BuildQuality::Medium, ""),
            embree(device, scene, BuildQuality::High, ""),
            embree(device, scene, BuildQuality::Medium, " again"),
        ];
        let (mut places, mut streams) = (Vec::new(), Vec::new());
        for quality in [
            Quality::BinnedSah,
            Quality::SpatialSplits,
            Quality::Optimized,
        ] {
            for width in WIDTHS {
                let params = match (quality, width) {
                    (Quality::BinnedSah, 16) => BuildParams::sixteen_children(),
                    _ => {
                        let mut params = params_of(quality);
                        params.branching_factor = width;
                        params
                    }
                };
                match Bvh::build(&[&scene.mesh], &params) {
                    Ok(tree) => {
                        places.push(((quality, width), engines.len()));
                        let tree = Rc::new(tree);
                        engines.push(ours(tree.clone()));
                        streams.extend(IN_FLIGHT.map(|n| ours_in_flight(&tree, n)));
                    }
                    Err(error) => println!("\nno rays through {quality:?}, {width}: {error}"),
                }
            }
        }
        engines.append(&mut streams);
        let key = |quality| (quality, judged_width());
        let place = |quality| places.iter().find(|p| p.0 == key(quality)).map(|p| p.1);
        for set in sets {
            let speed = self.table(scene, &set, &engines);
            let against = |quality, base: usize| Some(speed(place(quality)?, base));
            let row = Row {
                scene: scene.name.clone(),
                set: set.name,
                optimized: against(Quality::Optimized, 1),
                binned: against(Quality::BinnedSah, 0).unwrap_or(0.0),
            };
            self.rows.push(row);
        }
    }

    /// Compares answers, then times; the speed of an engine ÷ that of another.
    fn table(
        &mut self,
        scene: &BenchScene,
        set: &RaySet,
        engines: &[Engine<'_>],
    ) -> impl Fn(usize, usize) -> f64 + use<> {
        let ask = |engine: &Engine<'_>, rays: &[Ray], answers: &mut [f32]| {
            if set.any_hit {
                (engine.any)(rays, answers);
            } else {
                (engine.closest)(rays, answers);
            }
        };
        let answers = |engine| {
            let mut answers = vec![0.0; set.rays.len()];
            ask(engine, &set.rays, &mut answers);
            answers
        };
        let expected = answers(&engines[0]);
        let differ: Vec<usize> = engines
            .iter()
            .map(|engine| {
                let pairs = answers(engine).into_iter().zip(&expected);
                pairs
                    .filter(|(got, expected)| differs(*got, **expected))
                    .count()
            })
            .collect();
        let chunks: Vec<&[Ray]> = set.rays.chunks(CHUNK).collect();
        let mut buffer = vec![0.0; CHUNK];
        let turns = measure_chunks(
            engines.len(),
            ROUNDS,
            chunks.len(),
            Clock::ThreadCpu,
            |engine, chunk| {
                let rays = chunks[chunk];
                ask(&engines[engine], rays, &mut buffer[..rays.len()]);
                std::hint::black_box(&mut buffer);
            },
        );
        println!(
            "\n{} rays ({}); {}, {ROUNDS} rounds in turns by chunks of {CHUNK}",
            set.name,
            set.rays.len(),
            Clock::ThreadCpu.name()
        );
        println!(
            "  {:<44}{:>10}{:>8}{:>18}{:>10}",
            "", "Mrays/s", "speed", "quartiles", "differ"
        );
        for (i, engine) in engines.iter().enumerate() {
            let speed = turns.speed[i];
            println!(
                "  {:<36}{:>10.2}{:>8.3}{:>18}{:>10}",
                engine.name,
                set.rays.len() as f64 / turns.times[i].as_secs_f64() / 1e6,
                speed.median,
                format!("{:.3} … {:.3}", speed.quartiles[0], speed.quartiles[1]),
                differ[i]
            );
            let share = differ[i] as f64 / set.rays.len().max(1) as f64;
            if share > self.most_different.0 {
                let what = format!("{}, {}, {}", scene.name, set.name, engine.name);
                self.most_different = (share, what);
            }
        }
        move |engine, base| turns.time_ratio(base, engine).median
    }

    pub(crate) fn judge(&self, goals: &mut Goals) {
        println!(
            "\nrays: speed at one thread, ours ({} children) ÷ Embree's, each by its own traversal",
            judged_width()
        );
        for row in &self.rows {
            let optimized = match row.optimized {
                Some(speed) => format!("{speed:.3}"),
                None => "not built".into(),
            };
            println!(
                "{}, {}: Optimized ÷ high {optimized}, BinnedSah ÷ medium {:.3}",
                row.scene, row.set, row.binned
            );
        }
        let (share, place) = &self.most_different;
        let what = format!("{share:.1e} of the rays have another answer ({place})");
        println!("{what}");
        goals.check(what, *share <= DIFFERENT_GOAL);

        let counted = || self.rows.iter().filter(|row| row.set != "primary");
        let optimized: Option<Vec<f64>> = counted().map(|row| row.optimized).collect();
        let (mean, text) = match optimized {
            Some(speeds) => {
                let mean = geometric_mean(&speeds);
                (mean, format!("{mean:.3}"))
            }
            None => (0.0, "not built".into()),
        };
        let what = format!(
            "Optimized ÷ Embree high on diffuse and shadow rays, geometric mean {text}, goal ≥ {OPTIMIZED_GOAL}"
        );
        println!("{what}");
        goals.check(what, mean >= OPTIMIZED_GOAL);

        let is_judged = |row: &&Row| row.scene == BINNED_SCENE && row.set == "diffuse";
        if let Some(row) = self.rows.iter().find(is_judged) {
            let what = format!(
                "BinnedSah ÷ Embree medium on diffuse rays of {BINNED_SCENE}: {:.3}, goal ≥ {BINNED_GOAL}",
                row.binned
            );
            goals.check(what, row.binned >= BINNED_GOAL);
        }
    }
}

/// As many children as one register holds.
fn judged_width() -> u32 {
    match Isa::best() {
        Isa::Avx512 => 16,
        _ => 8,
    }
}

fn differs(got: f32, expected: f32) -> bool {
    // A hit beside a miss is a difference, whatever its distance from infinity.
    got.is_finite() != expected.is_finite() || (got - expected).abs() > 1e-4 * expected.abs()
}

fn name_of(tree: &Bvh) -> String {
    let params = tree.params();
    let (quality, children) = (params.quality, params.branching_factor);
    format!("raywright {quality:?}, {children} children, {}", tree.isa())
}

fn ours_in_flight<'a>(tree: &Bvh, in_flight: usize) -> Engine<'a> {
    let tree = Rc::new(tree.clone().with_in_flight(in_flight));
    let any = tree.clone();
    let (hits, are_hit) = (RefCell::new(vec![]), RefCell::new(vec![]));
    Engine {
        name: format!("{}, {in_flight} in flight", name_of(&tree)),
        closest: Box::new(move |rays, answers| {
            let hits = &mut *hits.borrow_mut();
            tree.closest_hits(rays, hits);
            for (hit, answer) in hits.iter().zip(answers) {
                *answer = hit.map_or(f32::INFINITY, |hit| hit.t);
            }
        }),
        any: Box::new(move |rays, answers| {
            let are_hit = &mut *are_hit.borrow_mut();
            any.any_hits(rays, are_hit);
            for (&is_hit, answer) in are_hit.iter().zip(answers) {
                *answer = f32::from(u8::from(is_hit));
            }
        }),
    }
}

fn ours<'a>(tree: Rc<Bvh>) -> Engine<'a> {
    let any = tree.clone();
    Engine {
        name: name_of(&tree),
        closest: Box::new(move |rays, answers| {
            for (ray, answer) in rays.iter().zip(answers) {
                *answer = tree.closest_hit(ray).map_or(f32::INFINITY, |hit| hit.t);
            }
        }),
        any: Box::new(move |rays, answers| {
            for (ray, answer) in rays.iter().zip(answers) {
                *answer = f32::from(u8::from(any.any_hit(ray)));
            }
        }),
    }
}

fn embree<'a>(
    device: &'a Device,
    scene: &BenchScene,
    quality: BuildQuality,
    note: &str,
) -> Engine<'a> {
    let settings = SceneSettings::of_quality(quality);
    let scene = device
        .scene(&[&scene.mesh], &settings)
        .and_then(|scene| scene.commit())
        .expect("a scene");
    let scene = Rc::new(scene);
    let any = scene.clone();
    Engine {
        name: format!("Embree {quality:?}{note}"),
        closest: Box::new(move |rays, answers| {
            for (ray, answer) in rays.iter().zip(answers) {
                *answer = scene.closest_hit(ray).map_or(f32::INFINITY, |hit| hit.t);
            }
        }),
        any: Box::new(move |rays, answers| {
            for (ray, answer) in rays.iter().zip(answers) {
                *answer = f32::from(u8::from(any.any_hit(ray)));
            }
        }),
    }
}
