//! `raywright demo`: the whole road on a built-in scene, in about a minute.

use std::path::PathBuf;

use clap::Args;

use super::{
    Failure, output,
    run_options::RunOptions,
    tune::{self, TuneArgs},
};

/// The scene that is tuned.
const SCENE: &str = "interior";

#[derive(Debug, Args)]
pub(crate) struct DemoArgs {
    /// Frames of the search
    #[arg(long, default_value_t = 60, value_parser = clap::value_parser!(u32).range(1..))]
    frames: u32,
    /// Seed of the search and of the picture
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Folder for the log, the report and the picture
    #[arg(short, long, default_value = "raywright-out")]
    output: PathBuf,
    #[command(flatten)]
    run: RunOptions,
}

/// Tunes the demo scene.
pub(crate) fn run(args: &DemoArgs) -> Result<(), Failure> {
    output::note(format_args!(
        "tuning BVH parameters on the built-in scene {SCENE:?}; the picture forms on the way"
    ));
    tune::run(&TuneArgs::demo(
        SCENE,
        &args.output,
        args.frames,
        args.seed,
        &args.run,
    ))
}
