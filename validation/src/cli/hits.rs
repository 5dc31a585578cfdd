//! `hits`: our hits beside Embree's, and beside exact ones, over scenes and kinds of rays.

use std::{
    error::Error,
    path::{Path, PathBuf},
};

use clap::Args;
use raywright_bvh::{Accuracy, BuildParams, Bvh, Hit, Ray, TriangleMesh, Vec3};
use raywright_validation::{
    TriangleSet,
    embree::{Embree, EmbreeError, EmbreeHit, Scene, SceneSettings},
    exact, golden,
    hits::{Answer, Class, Judge, RayKind, Rays},
};

use super::{Verdict, trees::default_data};

/// The part of the conference room that is a copy of it at 1/73 of its size.
const MINIATURE: [Vec3; 2] = [
    Vec3::new(1618.0, -1.0, -1017.0),
    Vec3::new(1647.0, 1.5, -993.0),
];

/// Arguments of `hits`.
#[derive(Debug, Args)]
#[command(after_help = "\
same: the same triangle, or both none. Ties are differences within what rounding may do: two triangles at an edge,
or at one distance; a touch at an outline, or at an end of the ray. ill-conditioned: a triangle so thin, or seen
so nearly edge-on, that nothing is certain. other misses, other invents: ours is right. leak: ours misses what it
touches exactly at an edge or vertex within a surface, which the fast test may do. bug: ours is wrong.

Embree is found as for `trees --random`. Without it our hits are compared with exact ones alone.")]
pub(crate) struct HitsArgs {
    /// The folder with scenes (default: ../shared/data beside the checkout)
    #[arg(long, value_name = "DIR")]
    data: Option<PathBuf>,
    /// Scenes, by the names of their folders
    #[arg(long = "scene", value_name = "NAME", default_values = ["sponza", "conference", "fireplace_room", "sibenik", "bmw_m6"])]
    scenes: Vec<String>,
    /// Rays of each kind, for each scene and accuracy
    #[arg(long, default_value_t = 200_000)]
    rays: usize,
    /// Rays of each kind that are compared with all triangles too
    #[arg(long, default_value_t = 10)]
    exact: usize,
    /// Seed of the rays
    #[arg(long, default_value_t = 1)]
    seed: u64,
}

/// Counts of one kind of rays.
#[derive(Clone, Debug, Default)]
struct Counts {
    classes: [u64; Class::ALL.len()],
    /// The first ray of each class that is a fault, as it can be asked again.
    first: Option<String>,
}

impl Counts {
    fn add(&mut self, class: Class, is_fault: bool, tell: impl FnOnce() -> String) {
        self.classes[class as usize] += 1;
        if is_fault && self.first.is_none() {
            self.first = Some(format!("{}: {}", class.name(), tell()));
        }
    }
}

/// Compares all; says on standard output what came of it.
pub(crate) fn run(args: &HitsArgs) -> Result<Verdict, Box<dyn Error>> {
    let folder = args
        .data
        .clone()
        .unwrap_or_else(default_data)
        .join("scenes");
    let embree = match Embree::find() {
        Ok(embree) => Some(embree),
        Err(error @ EmbreeError::NotFound { .. }) => {
            println!("skipped, nothing compared with Embree: {error}");
            None
        }
        Err(error) => return Err(error.into()),
    };
    let device = embree.as_ref().map(|embree| embree.device(0)).transpose()?;
    if let Some(device) = &device {
        println!(
            "beside Embree {} ({})",
            device.version(),
            device.instruction_set()
        );
    }
    let mut total = 0_u64;
    let mut faults = 0_u64;
    for accuracy in [Accuracy::Robust, Accuracy::Fast] {
        let is_fault = |class| match accuracy {
            Accuracy::Robust => matches!(class, Class::Bug | Class::Leak),
            Accuracy::Fast => class == Class::Bug,
        };
        let mut rows = vec![Counts::default(); RayKind::ALL.len()];
        let mut exact_rows = rows.clone();
        for (name, set) in scenes(&folder, &args.scenes)? {
            let mesh = mesh(&set)?;
            let meshes = [&mesh];
            let mut params = BuildParams::default();
            params.accuracy = accuracy;
            let tree = Bvh::build(&meshes, &params)?;
            let judge = Judge::new(&meshes, accuracy);
            let settings = SceneSettings {
                accuracy,
                ..SceneSettings::of_quality(raywright_validation::embree::BuildQuality::Medium)
            };
            let peer = match &device {
                Some(device) => Some(device.scene(&meshes, &settings)?.commit()?),
                None => None,
            };
            let mut rays = Rays::new(&mesh, &tree, args.seed);
            for ((kind, row), exact_row) in
                RayKind::ALL.into_iter().zip(&mut rows).zip(&mut exact_rows)
            {
                for (index, ray) in rays.of(kind, args.rays).iter().enumerate() {
                    let ours = tree.closest_hit(ray);
                    total += 1;
                    let tell = |theirs: Option<Answer>| {
                        format!(
                            "{name}, {}: {ray:?}, ours {ours:?}, other {theirs:?}",
                            kind.name()
                        )
                    };
                    if tree.any_hit(ray) != ours.is_some() {
                        row.add(Class::Bug, true, || {
                            "any hit differs, ".to_owned() + &tell(None)
                        });
                        continue;
                    }
                    if let Some(peer) = &peer {
                        let theirs = ask(peer, ray);
                        let class = judge.class(ray, ours.map(answer), theirs);
                        row.add(class, is_fault(class), || tell(theirs));
                    }
                    if index < args.exact {
                        let theirs = exact::all_hits(&meshes, ray).first().map(|hit| Answer {
                            t: hit.t as f32,
                            uv: hit.uv.map(|x| x as f32),
                            ids: [hit.geometry_id, hit.primitive_id],
                        });
                        let class = judge.class(ray, ours.map(answer), theirs);
                        exact_row.add(class, is_fault(class), || tell(theirs));
                    }
                }
            }
        }
        let title = match accuracy {
            Accuracy::Robust => "robust",
            Accuracy::Fast => "fast",
        };
        if device.is_some() {
            faults += print(&format!("{title}, beside Embree's"), &rows, is_fault);
        }
        faults += print(
            &format!("{title}, beside exact hits"),
            &exact_rows,
            is_fault,
        );
    }
    println!("\n{total} rays, {faults} faults");
    Ok(if faults == 0 {
        Verdict::AllEqual
    } else {
        Verdict::SomethingDiffers
    })
}

/// The scenes of some names; the conference room also without its miniature.
fn scenes(folder: &Path, names: &[String]) -> Result<Vec<(String, TriangleSet)>, Box<dyn Error>> {
    let mut scenes = Vec::new();
    for name in names {
        let path = folder.join(name).join(format!("{name}.obj.gz"));
        let set = golden::read_obj(&path)?;
        if name == "conference" {
            let mut without = set.clone();
            without.triangles.retain(|corners| {
                let is_in = |v: &Vec3| v.cmpge(MINIATURE[0]).all() && v.cmple(MINIATURE[1]).all();
                !corners.iter().all(is_in)
            });
            scenes.push((format!("{name} without its miniature"), without));
        }
        scenes.push((name.clone(), set));
    }
    Ok(scenes)
}

fn mesh(set: &TriangleSet) -> Result<TriangleMesh, Box<dyn Error>> {
    let count = u32::try_from(set.triangles.len())?;
    let triangles = (0..count).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
    Ok(TriangleMesh::new(set.triangles.concat(), triangles)?)
}

fn answer(hit: Hit) -> Answer {
    Answer {
        t: hit.t,
        uv: [hit.u, hit.v],
        ids: [hit.geometry_id, hit.primitive_id],
    }
}

fn ask(scene: &Scene<'_>, ray: &Ray) -> Option<Answer> {
    scene.closest_hit(ray).map(|hit: EmbreeHit| Answer {
        t: hit.t,
        uv: [hit.u, hit.v],
        ids: [hit.geometry_id, hit.primitive_id],
    })
}

/// Prints the rows; how many faults there are.
fn print(title: &str, rows: &[Counts], is_fault: impl Fn(Class) -> bool) -> u64 {
    println!("\n{title}");
    print!("  {:<14}", "rays");
    for class in Class::ALL {
        print!("{:>16}", class.name());
    }
    println!();
    for (kind, row) in RayKind::ALL.iter().zip(rows) {
        print!("  {:<14}", kind.name());
        for count in row.classes {
            print!("{count:>16}");
        }
        println!();
    }
    for row in rows {
        if let Some(first) = &row.first {
            println!("  first fault: {first}");
        }
    }
    let faults = Class::ALL.into_iter().filter(|&class| is_fault(class));
    faults
        .map(|class| {
            rows.iter()
                .map(|row| row.classes[class as usize])
                .sum::<u64>()
        })
        .sum()
}
