//! How fast is a ray? Node widths and instruction sets of our tree side by side on the built-in
//! scenes, and with `--features peers` the crate obvhs. Fails if a kernel has lost its instruction set.
//!
//! Run: `cargo bench -p raywright-benches --bench rays [--features peers]`

mod instruction_sets;

use std::process::ExitCode;

use raywright_benches::{
    goals::Goals,
    rays::{RaySet, SIDE, ray_sets},
    turns::measure,
};
use raywright_bvh::{BuildParams, Bvh, Isa, Ray, Work};
use raywright_tracer::{World, generate};

const ROUNDS: usize = 9;

/// Side of the picture whose rays every kernel is asked about.
const KERNEL_SIDE: u32 = 128;

/// Something that is asked with rays.
struct Engine {
    name: String,
    /// Distance of the closest hit; infinite if there is none.
    closest: Box<dyn Fn(&Ray) -> f32>,
    any: Box<dyn Fn(&Ray) -> bool>,
}

fn main() -> ExitCode {
    let (mut goals, mut lost) = (Goals::default(), Vec::new());
    for name in generate::NAMES {
        let world = World::new(generate::by_name(name).expect("a built-in scene"));
        let tree = build(&world, 8);
        let engines = engines(&world);
        println!(
            "\n{name}: {} triangles, one thread, {ROUNDS} rounds in turns",
            world.scene().triangle_count()
        );
        for set in ray_sets(&world, &tree, SIDE) {
            table(name, &set, &engines, &tree, &mut goals);
        }
        let primary = &ray_sets(&world, &tree, KERNEL_SIDE)[0];
        lost.extend(instruction_sets::lost_kernels(&world, primary));
    }
    goals.check(
        "every kernel has its instruction set".to_owned(),
        lost.is_empty(),
    );
    goals.print();
    for kernel in &lost {
        eprintln!("error: {kernel}");
    }
    match lost.is_empty() {
        true => ExitCode::SUCCESS,
        false => ExitCode::FAILURE,
    }
}

fn build(world: &World, branching_factor: u32) -> Bvh {
    let mut params = BuildParams::default();
    params.branching_factor = branching_factor;
    world
        .build_tree(&params, &mut Default::default())
        .expect("a tree")
}

fn engines(world: &World) -> Vec<Engine> {
    let mut engines = Vec::new();
    for branching_factor in [8, 16, 4, 2] {
        for isa in Isa::ALL.into_iter().rev() {
            let Some(tree) = build(world, branching_factor).with_isa(isa) else {
                println!("skipped: this machine does not have {isa}");
                continue;
            };
            let tree = std::rc::Rc::new(tree);
            let any_tree = tree.clone();
            engines.push(Engine {
                name: format!("{branching_factor} children, {isa}"),
                closest: Box::new(move |ray| {
                    tree.closest_hit(ray).map_or(f32::INFINITY, |hit| hit.t)
                }),
                any: Box::new(move |ray| any_tree.any_hit(ray)),
            });
        }
    }
    #[cfg(feature = "peers")]
    engines.push(peers::obvhs(world));
    engines
}

fn table(scene: &str, set: &RaySet, engines: &[Engine], tree: &Bvh, goals: &mut Goals) {
    let mut work = Work::default();
    for ray in &set.rays {
        let _ = tree.closest_hit_with_work(ray, &mut work);
    }
    let per_ray = |n: u64| n as f64 / set.rays.len() as f64;
    println!(
        "\n{} ({} rays; closest hit visits {:.1} nodes of 8 and {:.1} blocks per ray)",
        set.name,
        set.rays.len(),
        per_ray(work.nodes),
        per_ray(work.blocks)
    );
    let expected: Vec<f32> = set
        .rays
        .iter()
        .map(|ray| (engines[0].closest)(ray))
        .collect();
    let turns = measure(engines.len(), ROUNDS, |engine| {
        for ray in &set.rays {
            if set.any_hit {
                std::hint::black_box((engines[engine].any)(ray));
            } else {
                std::hint::black_box((engines[engine].closest)(ray));
            }
        }
    });
    println!(
        "{:<24}{:>10}{:>8}{:>18}{:>10}",
        "", "Mrays/s", "speed", "quartiles", "differ"
    );
    for (engine, (time, speed)) in engines.iter().zip(turns.times.iter().zip(&turns.speed)) {
        let differ = set.rays.iter().zip(&expected).filter(|(ray, expected)| {
            if set.any_hit {
                (engine.any)(ray) != expected.is_finite()
            } else {
                let t = (engine.closest)(ray);
                t != **expected && (t - **expected).abs() > 1e-4 * **expected
            }
        });
        println!(
            "{:<24}{:>10.2}{:>8.2}{:>18}{:>10}",
            engine.name,
            set.rays.len() as f64 / time.as_secs_f64() / 1e6,
            speed.median,
            format!("{:.2} … {:.2}", speed.quartiles[0], speed.quartiles[1]),
            differ.count()
        );
    }
    // Within a round, the speed of one engine relative to another.
    let speed_of = |name: &str| {
        let engine = engines.iter().position(|engine| engine.name == name)?;
        Some(turns.speed[engine].median)
    };
    for (fast, slow) in [("avx2", "portable"), ("avx512", "avx2")] {
        let speeds = [fast, slow].map(|isa| speed_of(&format!("8 children, {isa}")));
        if let [Some(fast_speed), Some(slow_speed)] = speeds {
            let what = format!("{scene}, {}: {fast} is not slower than {slow}", set.name);
            goals.check(what, fast_speed >= slow_speed * 0.97);
        }
    }
}

#[cfg(feature = "peers")]
mod peers {
    use std::{rc::Rc, time::Duration};

    use obvhs::{
        BvhBuildParams,
        cwbvh::builder::build_cwbvh_from_tris,
        ray::{Ray as ObvhsRay, RayHit},
        triangle::Triangle,
    };
    use raywright_bvh::Ray;
    use raywright_tracer::World;

    use super::Engine;

    /// The fastest pure-Rust peer: a compressed tree with eight children, its medium build.
    pub(super) fn obvhs(world: &World) -> Engine {
        let meshes = world.scene().meshes.iter().map(|mesh| &mesh.triangles);
        let corners =
            meshes.flat_map(|mesh| (0..mesh.triangles().len() as u32).map(|id| mesh.corners(id)));
        let triangles: Vec<Triangle> = corners
            .map(|corners| {
                let [v0, v1, v2] = corners.map(|v| v.to_array().into());
                Triangle { v0, v1, v2 }
            })
            .collect();
        let tree = build_cwbvh_from_tris(
            &triangles,
            BvhBuildParams::medium_build(),
            &mut Duration::default(),
        );
        // In the order of the leaves, as its documentation advises for speed.
        let sorted: Vec<Triangle> = tree
            .primitive_indices
            .iter()
            .map(|&i| triangles[i as usize])
            .collect();
        let shared = Rc::new((tree, sorted));
        let any = shared.clone();
        let convert = |ray: &Ray| {
            let vector = |v: raywright_bvh::Vec3| v.to_array().into();
            ObvhsRay::new(
                vector(ray.origin),
                vector(ray.direction),
                ray.t_min,
                ray.t_max,
            )
        };
        Engine {
            name: "obvhs CWBVH, medium".into(),
            closest: Box::new(move |ray| {
                let (tree, triangles) = &*shared;
                let mut hit = RayHit::none();
                tree.ray_traverse(convert(ray), &mut hit, |ray, id| {
                    triangles[id].intersect(ray)
                });
                hit.t
            }),
            any: Box::new(move |ray| {
                let (tree, triangles) = &*any;
                !tree.ray_traverse_miss(convert(ray), |ray, id| triangles[id].intersect(ray))
            }),
        }
    }
}
