//! `raywright volume`: subcommands about volumes, one file each, and what they share.

mod info;
mod look;
mod render;
mod source;

use clap::Subcommand;

use super::Failure;

#[derive(Debug, Subcommand)]
pub(crate) enum VolumeCommand {
    /// Show sizes, type, values, orientation and faults of a volume
    Info(info::InfoArgs),
    /// Render a picture of a volume, or the frames of an orbit around it
    Render(Box<render::RenderArgs>),
}

/// Runs a subcommand.
pub(crate) fn run(command: &VolumeCommand) -> Result<(), Failure> {
    match command {
        VolumeCommand::Info(args) => info::run(args),
        VolumeCommand::Render(args) => render::run(args),
    }
}
