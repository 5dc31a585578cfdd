//! `raywright volume`: subcommands about volumes, one file each, and what they share.

mod info;
mod source;

use clap::Subcommand;

use super::Failure;

#[derive(Debug, Subcommand)]
pub(crate) enum VolumeCommand {
    /// Show sizes, type, values, orientation and faults of a volume
    Info(info::InfoArgs),
}

/// Runs a subcommand.
pub(crate) fn run(command: &VolumeCommand) -> Result<(), Failure> {
    match command {
        VolumeCommand::Info(args) => info::run(args),
    }
}
