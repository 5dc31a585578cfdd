//! Subcommands, one file each.

mod accuracy;
mod extremes;
mod hits;
mod random;
mod rebuilds;
mod table;
mod trees;
mod trends;

use clap::{Parser, Subcommand};
use raywright_validation::embree::{Embree, EmbreeError};

/// Compares raywright with oracles.
#[derive(Debug, Parser)]
#[command(version, about, max_term_width = 100)]
#[command(
    after_help = "Exit codes: 0 all equal, 1 something differs or grows, 2 bad input or usage."
)]
pub(crate) struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Compare our trees with those of Embree's rtcBuildBVH, to the last bit
    Trees(trees::TreesArgs),
    /// Compare our hits with Embree's and with exact ones, and say what each difference is
    Hits(hits::HitsArgs),
    /// Run the test classes of extremes, with Embree's figures beside
    Extremes(extremes::ExtremesArgs),
    /// Measure what robust hits and small leaves cost in speed, and what they are worth
    Accuracy(accuracy::AccuracyArgs),
    /// Build a scene again and again, and see whether memory grows
    Rebuilds(rebuilds::RebuildsArgs),
    /// Measure whether each parameter pushes ours where it pushes Embree's
    Trends(trends::TrendsArgs),
}

/// What a comparison found. Memory that grows is a difference too.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Verdict {
    AllEqual,
    SomethingDiffers,
}

/// Runs a command.
pub(crate) fn run(cli: Cli) -> Result<Verdict, Box<dyn std::error::Error>> {
    match cli.command {
        Command::Trees(args) => trees::run(&args),
        Command::Hits(args) => hits::run(&args),
        Command::Extremes(args) => extremes::run(&args),
        Command::Accuracy(args) => accuracy::run(&args),
        Command::Rebuilds(args) => rebuilds::run(&args),
        Command::Trends(args) => trends::run(&args),
    }
}

/// The Embree library; `None`, with a line that says so, if there is none.
fn embree_or_skip() -> Result<Option<Embree>, EmbreeError> {
    match Embree::find() {
        Err(error @ EmbreeError::NotFound { .. }) => {
            println!("skipped, nothing compared: {error}");
            Ok(None)
        }
        found => found.map(Some),
    }
}
