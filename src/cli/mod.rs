//! Subcommands, one file each, and what they share.

mod demo;
mod failure;
mod inspect;
mod memory;
mod output;
mod render;
mod rows;
mod run_options;
mod scene;
mod store;
mod study;
mod trace;
mod tune;
mod volume;

use clap::{Parser, Subcommand};

pub(crate) use failure::Failure;

/// A pure-Rust path tracer that tunes its own acceleration structure while it renders.
#[derive(Debug, Parser)]
#[command(version, about, max_term_width = 100)]
#[command(after_help = "\
Exit codes: 0 done, 1 a check failed, 2 bad input or usage, 130 interrupted.
A SCENE is a file (.obj, .obj.gz) or a built-in scene (interior, voxel-terrain).
A VOLUME is a file (.nrrd, .nhdr, .nii, .nii.gz, .hdr, .img, .json, .raw) or a generated volume
(supernova, nebula, marschner-lobb).")]
pub(crate) struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Render a picture of a scene
    #[command(after_long_help = run_options::parameter_help())]
    Render(render::RenderArgs),
    /// Search BVH parameters while frames of a scene are rendered
    #[command(after_long_help = run_options::parameter_help())]
    Tune(tune::TuneArgs),
    /// Show counts, bounds, indicators and tree statistics of a scene
    #[command(after_long_help = run_options::parameter_help())]
    Inspect(inspect::InspectArgs),
    /// Trace rays from a file and write what they hit
    #[command(after_long_help = run_options::parameter_help())]
    Trace(trace::TraceArgs),
    /// Tune a built-in scene and leave a picture and a report: needs no file, takes about a minute
    Demo(demo::DemoArgs),
    /// What tuning left in a folder of logs: look, check, merge, export
    #[command(subcommand)]
    Store(store::StoreCommand),
    /// Measurements that are kept as data
    #[command(subcommand)]
    Study(study::StudyCommand),
    /// Volumes: what is in a file, and pictures of it
    #[command(subcommand)]
    Volume(volume::VolumeCommand),
}

/// Runs a command.
pub(crate) fn run(cli: Cli) -> Result<(), Failure> {
    match cli.command {
        Command::Render(args) => render::run(&args),
        Command::Tune(args) => tune::run(&args),
        Command::Inspect(args) => inspect::run(&args),
        Command::Trace(args) => trace::run(&args),
        Command::Demo(args) => demo::run(&args),
        Command::Store(command) => store::run(&command),
        Command::Study(command) => study::run(&command),
        Command::Volume(command) => volume::run(&command),
    }
}
