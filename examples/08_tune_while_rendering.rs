//! Tuning while one renders: each frame is a sample of the picture, and now and then some of its tiles try another
//! tree, which a thread has built beside the frames before.
//!
//! Half way the camera turns round. When frames take another time than they did, one probe tells whether trees
//! are to be compared anew or the machine alone is another.
//!
//! Run: `cargo run --release --example 08_tune_while_rendering [SCENE.obj]`

use std::{env, error::Error, path::Path, thread};

use raywright::{
    bvh::{BuildParams, Isa},
    imaging::CancelToken,
    tracer::{World, automatic_camera, generate, load::load_scene},
    tune::{Hybrid, Metric, ParameterSpace, Settings, SpaceAxes, WallClock, portfolio},
    tuner::GaussianProcess,
};

const FRAMES: u32 = 160;

/// Trials may take a fifth of all time here, so that there is something to see.
const OVERHEAD: f64 = 0.2;

fn main() -> Result<(), Box<dyn Error>> {
    let scene = match env::args().nth(1) {
        Some(path) => load_scene(Path::new(&path))?.scene,
        None => generate::by_name("interior").ok_or("a built-in scene")?,
    };
    let (given, strong) = (scene.camera, BuildParams::default());
    let world = World::new(scene);
    let camera = match given {
        Some(camera) => camera,
        None => automatic_camera(&world, &world.build_tree(&strong, &mut Default::default())?),
    };
    let settings = Settings {
        width: 480,
        height: 270,
        path_length: 3,
        metric: Metric::Render,
        seed: 1,
        isa: Isa::best(),
    };
    let axes = SpaceAxes::Canonical;
    let space = ParameterSpace::new(&strong, &[], axes)?;
    let search = || Box::new(GaussianProcess::new()) as _;
    let cancel = CancelToken::new();
    thread::scope(|scope| {
        let clock = WallClock::start();
        let run = Hybrid::new(&world, camera, settings, space, &strong, search, clock)?;
        let mut run = run
            .with_starts(&portfolio(&strong, settings.metric, axes))
            .with_overhead_limit(OVERHEAD)
            .with_background_builds(scope);
        for frame in 0..FRAMES {
            let Some(done) = run.frame(&cancel)? else {
                break;
            };
            if let Some(candidate) = done.candidate {
                let outcome = match candidate.outcome {
                    Ok(probed) => {
                        format!("{} at {:.3}", probed.decision.name(), probed.cost_ratio[0])
                    }
                    Err(failure) => failure.to_string(),
                };
                println!("frame {frame}: {}: {outcome}", candidate.reason);
            }
            if frame == FRAMES / 2 {
                let mut elsewhere = camera;
                elsewhere.origin += 0.5 * (camera.target - camera.origin);
                elsewhere.target = camera.origin;
                run.move_camera(elsewhere)?;
                println!(
                    "frame {frame}: the camera turns round; is anything tried? {}",
                    run.is_searching()
                );
            }
        }
        println!("best: {:?}", run.incumbent());
        Ok(())
    })
}
