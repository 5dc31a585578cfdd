//! `hits`: our hits beside Embree's, and beside exact ones, over scenes and kinds of rays.
//!
//! Every ray is asked five times: our closest hit, the same of another tree, our any hit, Embree's closest hit, and all
//! exact hits, from a tree of f64 with exact sides of edges. Our trees have to agree to the last bit, and the others
//! judge them. That the exact tree tells what the loop over all triangles does is looked up for a few rays of each
//! kind, spread over all; a difference ends the run.

mod scenes;

use std::{error::Error, path::PathBuf, thread, time::Instant};

use clap::Args;
use raywright_bvh::{Accuracy, BuildParams, Bvh, Hit, Quality, Ray};
use raywright_validation::{
    embree::{BuildQuality, Embree, EmbreeError, EmbreeHit, Scene as EmbreeScene, SceneSettings},
    exact::{self, ExactTree},
    hits::{Answer, Class, Judge, RayKind, Rays},
};

use self::scenes::{Scene, scenes};
use super::{Verdict, trees::default_data};

/// Arguments of `hits`.
#[derive(Debug, Args)]
#[command(after_help = "\
same: the same triangle, or both none. Ties are differences within what rounding may do: two triangles at an edge,
or at one distance; a touch at an outline, or at an end of the ray. ill-conditioned: a triangle so thin, or seen
so nearly edge-on, that nothing is certain. other misses, other invents: ours is right. leak: ours passes between
triangles where moved vertices leave no gap, which the fast test may do. bug: ours is wrong.

Closed meshes are asked beside the scenes. Two threads, one for each accuracy. Embree is found as for
`trees --random`; without it our hits are compared with exact ones alone.")]
pub(crate) struct HitsArgs {
    /// The folder with scenes (default: ../shared/data beside the checkout)
    #[arg(long, value_name = "DIR")]
    data: Option<PathBuf>,
    /// Scenes, by the names of their folders
    #[arg(long = "scene", value_name = "NAME", default_values = ["sponza", "conference", "fireplace_room", "sibenik", "bmw_m6"])]
    scenes: Vec<String>,
    /// Rays of each kind, for each scene and accuracy
    #[arg(long, default_value_t = 100_000)]
    rays: usize,
    /// Rays of each kind whose exact hits are looked up by the loop over all triangles too
    #[arg(long, default_value_t = 10)]
    exact: usize,
    /// Seed of the rays
    #[arg(long, default_value_t = 1)]
    seed: u64,
}

/// Faults that are told of each kind.
const TOLD: usize = 3;

/// Counts of one kind of rays.
#[derive(Clone, Debug, Default)]
struct Counts {
    classes: [u64; Class::ALL.len()],
    /// The first faults, as they can be asked again.
    told: Vec<String>,
}

impl Counts {
    fn add(&mut self, class: Class, is_fault: bool, tell: impl FnOnce() -> String) {
        self.classes[class as usize] += 1;
        if is_fault && self.told.len() < TOLD {
            self.told.push(format!("{}: {}", class.name(), tell()));
        }
    }
}

/// What came of one accuracy; rows by kinds of rays.
struct Outcome {
    accuracy: Accuracy,
    rays: u64,
    beside_embree: Option<Vec<Counts>>,
    beside_exact: Vec<Counts>,
}

/// Compares all; says on standard output what came of it.
pub(crate) fn run(args: &HitsArgs) -> Result<Verdict, Box<dyn Error>> {
    let folder = args
        .data
        .clone()
        .unwrap_or_else(default_data)
        .join("scenes");
    let scenes = scenes(&folder, &args.scenes)?;
    let outcomes = thread::scope(|scope| {
        let threads = [Accuracy::Robust, Accuracy::Fast].map(|accuracy| {
            let scenes = &scenes;
            // An error crosses threads as text: not every one may.
            scope.spawn(move || compare(args, scenes, accuracy).map_err(|error| error.to_string()))
        });
        threads.map(|thread| {
            thread
                .join()
                .unwrap_or_else(|_| Err("a thread panicked".into()))
        })
    });
    let (mut rays, mut faults) = (0, 0);
    for outcome in outcomes {
        let outcome = outcome?;
        rays += outcome.rays;
        let name = name_of(outcome.accuracy);
        if let Some(rows) = &outcome.beside_embree {
            faults += print(&format!("{name}, beside Embree's"), rows, outcome.accuracy);
        }
        let title = format!("{name}, beside exact hits");
        faults += print(&title, &outcome.beside_exact, outcome.accuracy);
    }
    println!("\n{rays} rays, {faults} faults");
    Ok(if faults == 0 {
        Verdict::AllEqual
    } else {
        Verdict::SomethingDiffers
    })
}

fn name_of(accuracy: Accuracy) -> &'static str {
    match accuracy {
        Accuracy::Robust => "robust",
        Accuracy::Fast => "fast",
    }
}

fn is_fault(class: Class, accuracy: Accuracy) -> bool {
    match accuracy {
        Accuracy::Robust => matches!(class, Class::Bug | Class::Leak),
        Accuracy::Fast => class == Class::Bug,
    }
}

fn compare(
    args: &HitsArgs,
    scenes: &[Scene],
    accuracy: Accuracy,
) -> Result<Outcome, Box<dyn Error>> {
    let embree = match Embree::find() {
        Ok(embree) => Some(embree),
        Err(error @ EmbreeError::NotFound { .. }) => {
            eprintln!("skipped, nothing compared with Embree: {error}");
            None
        }
        Err(error) => return Err(error.into()),
    };
    let device = embree.as_ref().map(|embree| embree.device(0)).transpose()?;
    if let Some(device) = &device {
        let (version, isa) = (device.version(), device.instruction_set());
        eprintln!("{} beside Embree {version} ({isa})", name_of(accuracy));
    }
    let rows = vec![Counts::default(); RayKind::ALL.len()];
    let mut outcome = Outcome {
        accuracy,
        rays: 0,
        beside_embree: device.as_ref().map(|_| rows.clone()),
        beside_exact: rows,
    };
    let mut params = BuildParams::default();
    params.accuracy = accuracy;
    let settings = SceneSettings {
        accuracy,
        ..SceneSettings::of_quality(BuildQuality::Medium)
    };
    for scene in scenes {
        let start = Instant::now();
        let meshes = [&scene.mesh];
        let peer = match &device {
            Some(device) => Some(device.scene(&meshes, &settings)?.commit()?),
            None => None,
        };
        compare_scene(args, scene, &params, peer.as_ref(), &mut outcome)?;
        let seconds = start.elapsed().as_secs_f64();
        eprintln!("{}, {}: {seconds:.1} s", name_of(accuracy), scene.name);
    }
    Ok(outcome)
}

fn compare_scene(
    args: &HitsArgs,
    Scene { name, mesh }: &Scene,
    params: &BuildParams,
    peer: Option<&EmbreeScene<'_>>,
    outcome: &mut Outcome,
) -> Result<(), Box<dyn Error>> {
    let meshes = [mesh];
    let tree = Bvh::build(&meshes, params)?;
    let mut other_params = *params;
    other_params.quality = Quality::Morton;
    other_params.branching_factor = 2;
    let other_tree = Bvh::build(&meshes, &other_params)?;
    let exact_tree = ExactTree::new(&meshes);
    let judge = Judge::new(&meshes, params.accuracy);
    let mut rays = Rays::new(mesh, &tree, args.seed);
    let looked_up_each = args.rays.div_ceil(args.exact.max(1));
    for kind in RayKind::ALL {
        for (index, ray) in rays.of(kind, args.rays).iter().enumerate() {
            outcome.rays += 1;
            let ours = tree.closest_hit(ray);
            let tell = |theirs: &dyn std::fmt::Debug| {
                let kind = kind.name();
                format!("{name}, {kind}: {ray:?}, ours {ours:?}, other {theirs:?}")
            };
            let until = judge.farthest(ray, ours.map(answer));
            let hits = exact_tree.hits_until(ray, until);
            if args.exact > 0 && index % looked_up_each == 0 {
                let mut looked_up = exact::all_hits(&meshes, ray);
                looked_up.retain(|hit| hit.t <= until);
                if looked_up != hits {
                    return Err(format!("the exact tree: {}", tell(&(hits, looked_up))).into());
                }
            }
            let row = &mut outcome.beside_exact[kind as usize];
            let any = tree.any_hit(ray);
            let by_other_tree = other_tree.closest_hit(ray);
            if any != ours.is_some() || by_other_tree != ours {
                row.add(Class::Bug, true, || {
                    format!(
                        "any hit {any}, other tree {by_other_tree:?}, {}",
                        tell(&hits)
                    )
                });
                continue;
            }
            let is_fault = |class| is_fault(class, params.accuracy);
            let ours = ours.map(answer);
            let class = judge.class_beside_all(ray, ours, &hits);
            row.add(class, is_fault(class), || tell(&hits));
            if let (Some(peer), Some(rows)) = (peer, &mut outcome.beside_embree) {
                let theirs = ask(peer, ray);
                let class = judge.class(ray, ours, theirs);
                rows[kind as usize].add(class, is_fault(class), || tell(&theirs));
            }
        }
    }
    Ok(())
}

fn answer(hit: Hit) -> Answer {
    Answer {
        t: hit.t,
        uv: [hit.u, hit.v],
        ids: [hit.geometry_id, hit.primitive_id],
    }
}

fn ask(scene: &EmbreeScene<'_>, ray: &Ray) -> Option<Answer> {
    scene.closest_hit(ray).map(|hit: EmbreeHit| Answer {
        t: hit.t,
        uv: [hit.u, hit.v],
        ids: [hit.geometry_id, hit.primitive_id],
    })
}

/// Prints the rows; how many faults there are.
fn print(title: &str, rows: &[Counts], accuracy: Accuracy) -> u64 {
    println!("\n{title}");
    print!("  {:<14}", "rays");
    for class in Class::ALL {
        print!("{:>16}", class.name());
    }
    println!();
    let mut faults = 0;
    for (kind, row) in RayKind::ALL.iter().zip(rows) {
        print!("  {:<14}", kind.name());
        for (class, count) in Class::ALL.into_iter().zip(row.classes) {
            print!("{count:>16}");
            faults += if is_fault(class, accuracy) { count } else { 0 };
        }
        println!();
    }
    for fault in rows.iter().flat_map(|row| &row.told) {
        println!("  {fault}");
    }
    faults
}
