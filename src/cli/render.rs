//! `raywright render`: a picture of a scene.

use std::{path::PathBuf, time::Instant};

use clap::{Args, ValueEnum};
use raywright::{
    bvh::BuildParams,
    imaging::{Completion, Film, TileLoop, write_image},
    tracer::{Integrator, Shot, View},
};

use super::{
    Failure, output,
    run_options::{ParameterOptions, RunOptions, cancel_on_interrupt},
    scene::SceneOptions,
};

#[derive(Clone, Copy, Debug, ValueEnum)]
enum Show {
    /// Path tracing
    Paths,
    /// Path tracing that finds lights by chance: slow, for checking
    NaivePaths,
    /// Geometric normals
    Normals,
    /// One colour per mesh
    GeometryIds,
    /// One colour per triangle
    PrimitiveIds,
    /// Nodes visited by camera rays, white at 64
    Nodes,
}

#[derive(Debug, Args)]
pub(crate) struct RenderArgs {
    #[command(flatten)]
    scene: SceneOptions,
    /// Where the picture goes: .png, .exr or .pfm (default: SCENE.png in the current folder)
    #[arg(short, long)]
    output: Option<PathBuf>,
    /// Width in pixels
    #[arg(long, default_value_t = 960)]
    width: u32,
    /// Height in pixels
    #[arg(long, default_value_t = 540)]
    height: u32,
    /// Samples per pixel
    #[arg(long, default_value_t = 16, value_parser = clap::value_parser!(u32).range(1..))]
    spp: u32,
    /// Scattering events of a path, K: 0 shows lights alone, 1 adds direct light
    #[arg(long, default_value_t = Integrator::DEFAULT_PATH_LENGTH)]
    path_length: u32,
    /// What to show
    #[arg(long, value_enum, default_value_t = Show::Paths)]
    show: Show,
    /// Seed of all random numbers
    #[arg(long, default_value_t = 1)]
    seed: u64,
    #[command(flatten)]
    run: RunOptions,
    #[command(flatten)]
    parameters: ParameterOptions,
    /// Print times and settings as one JSON object
    #[arg(long)]
    json: bool,
}

#[derive(serde::Serialize)]
struct Report {
    schema_version: u32,
    scene: String,
    output: PathBuf,
    width: u32,
    height: u32,
    samples_per_pixel: u32,
    path_length: u32,
    seed: u64,
    instruction_set: &'static str,
    build_ms: f64,
    render_ms: f64,
    rejected_samples: u64,
    interrupted: bool,
    notes: Vec<String>,
}

/// Renders and writes the picture; an interrupted one is written with what is done.
pub(crate) fn run(args: &RenderArgs) -> Result<(), Failure> {
    let params = args.parameters.applied_to(BuildParams::default())?;
    let cancel = cancel_on_interrupt()?;
    let mut film = Film::new(args.width, args.height)?;
    args.run.install(|| {
        let stage = args.scene.prepare()?;
        let path = args
            .output
            .clone()
            .unwrap_or_else(|| PathBuf::from(format!("{}.png", stage.name)));
        let start = Instant::now();
        let tree = stage.world.build_tree(&params, &mut Default::default())?;
        let tree = tree
            .with_isa(args.run.isa())
            .expect("the option accepts what this machine has");
        let build = start.elapsed();
        let path_length = args.path_length;
        let integrator = match args.show {
            Show::Paths => Integrator::Path { path_length },
            Show::NaivePaths => Integrator::NaivePath { path_length },
            Show::Normals => Integrator::View(View::Normals),
            Show::GeometryIds => Integrator::View(View::GeometryIds),
            Show::PrimitiveIds => Integrator::View(View::PrimitiveIds),
            Show::Nodes => Integrator::View(View::Nodes),
        };
        let shot = Shot {
            world: &stage.world,
            camera: stage.camera,
            integrator,
            seed: args.seed,
        };
        let bar = output::bar(args.spp as usize, "samples");
        let start = Instant::now();
        let tiles = TileLoop::new().with_cancel(&cancel);
        let mut interrupted = false;
        for sample in 0..args.spp {
            if shot.render(&mut film, sample..sample + 1, &tiles, |_| &tree)?
                != Completion::Finished
            {
                interrupted = true;
                break;
            }
            bar.inc(1);
        }
        let render = start.elapsed();
        bar.finish_and_clear();
        write_image(&path, &film.mean())?;
        if film.rejected() > 0 {
            output::note(format_args!(
                "warning: {} samples were not finite and count as black",
                film.rejected()
            ));
        }
        let ms = |d: std::time::Duration| d.as_secs_f64() * 1e3;
        if args.json {
            output::json(&Report {
                schema_version: 1,
                scene: args.scene.scene.clone(),
                output: path,
                width: args.width,
                height: args.height,
                samples_per_pixel: args.spp,
                path_length,
                seed: args.seed,
                instruction_set: args.run.isa().name(),
                build_ms: ms(build),
                render_ms: ms(render),
                rejected_samples: film.rejected(),
                interrupted,
                notes: stage.notes,
            })?;
        } else {
            let done = if interrupted { " (interrupted)" } else { "" };
            output::line(format_args!(
                "{}: build {:.1} ms, render {:.1} ms{done}",
                path.display(),
                ms(build),
                ms(render)
            ))?;
        }
        if interrupted {
            Err(Failure::Interrupted)
        } else {
            Ok(())
        }
    })
}
