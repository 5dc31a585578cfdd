//! The command line of raywright. Results go to standard output, progress and warnings to standard
//! error. Exit codes: 0 done, 1 a check failed, 2 bad input or usage, 130 interrupted.
#![forbid(unsafe_code)]

mod cli;

use std::process::ExitCode;

use clap::Parser;

fn main() -> ExitCode {
    match cli::run(cli::Cli::parse()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(failure) => failure.report(),
    }
}
