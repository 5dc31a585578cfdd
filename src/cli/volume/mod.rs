//! `raywright volume`: subcommands about volumes, one file each, and what they share.

mod aim;
mod evaluate;
mod info;
mod look;
mod maps;
mod play;
mod render;
mod script;
mod skip;
mod source;
mod tradeoff;

use clap::Subcommand;

use super::Failure;

#[derive(Debug, Subcommand)]
pub(crate) enum VolumeCommand {
    /// Show sizes, type, values, orientation and faults of a volume
    Info(info::InfoArgs),
    /// Render a picture of a volume, or the frames of an orbit around it
    #[command(after_long_help = crate::cli::run_options::parameter_help())]
    Render(Box<render::RenderArgs>),
    /// Measure what step, termination, interpolation and resolution cost and give, and recommend a setting
    Tradeoff(Box<tradeoff::TradeoffArgs>),
    /// Play a sequence of views at a frame rate, and leave a timeline
    Play(Box<play::PlayArgs>),
    /// Compare ways to hold a frame time over scripted sequences
    Evaluate(Box<evaluate::EvaluateArgs>),
}

/// Runs a subcommand.
pub(crate) fn run(command: &VolumeCommand) -> Result<(), Failure> {
    match command {
        VolumeCommand::Info(args) => info::run(args),
        VolumeCommand::Render(args) => render::run(args),
        VolumeCommand::Tradeoff(args) => tradeoff::run(args),
        VolumeCommand::Play(args) => play::run(args),
        VolumeCommand::Evaluate(args) => evaluate::run(args),
    }
}
