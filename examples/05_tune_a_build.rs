//! Tuning in a loop of one's own: ask for parameters, build, trace, tell what it cost.
//!
//! Here the cost is the number of boxes and blocks that rays test, so that the outcome is the same
//! on every machine; a renderer would tell the time of its frame.
//!
//! Run: `cargo run --release --example 05_tune_a_build`

use raywright::{
    bvh::{BuildParams, BuildWorkspace, Ray, Work},
    tracer::{World, generate},
    tune::{ParameterSpace, SpaceAxes},
    tuner::{Outcome, Tuner, search_by_name},
};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let scene = generate::by_name("interior").ok_or("a built-in scene")?;
    let camera = scene.camera.ok_or("with a camera")?;
    let world = World::new(scene);
    let projection = camera.projection(64, 36)?;
    let rays: Vec<Ray> = (0..64 * 36)
        .map(|i| {
            Ray::new(
                projection.origin(),
                projection.direction((i % 64) as f32 + 0.5, (i / 64) as f32 + 0.5),
            )
        })
        .collect();

    let space = ParameterSpace::new(&BuildParams::default(), &[], SpaceAxes::Printed)?;
    let search = search_by_name("nelder-mead").ok_or("a search")?;
    let mut tuner = Tuner::new(space.space().clone(), search, 1);
    let mut workspace = BuildWorkspace::default();
    for _ in 0..40 {
        let trial = tuner.ask();
        let outcome = match world.build_tree(&space.params(&trial.config), &mut workspace) {
            Ok(tree) => {
                let mut work = Work::default();
                for ray in &rays {
                    let _ = tree.closest_hit_with_work(ray, &mut work);
                }
                // The next build takes the memory of this tree.
                tree.recycle(&mut workspace);
                // A node of N boxes and a block of four triangles cost about the same.
                Outcome::Done {
                    cost: (work.nodes + work.blocks) as f64 / rays.len() as f64,
                }
            }
            Err(error) => Outcome::Failed {
                reason: error.to_string(),
            },
        };
        if tuner.tell(trial.id, outcome)?.is_incumbent {
            let best = tuner.incumbent().ok_or("just told")?;
            println!("{:>6.2} per ray: {}", best.cost, best.config);
        }
    }
    Ok(())
}
