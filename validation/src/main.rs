//! The command line of the validation room. Results go to standard output, progress to standard
//! error. Exit codes: 0 all equal, 1 something differs, 2 bad input or usage.
#![forbid(unsafe_code)]

mod cli;

use std::process::ExitCode;

use clap::Parser;

fn main() -> ExitCode {
    match cli::run(cli::Cli::parse()) {
        Ok(cli::Verdict::AllEqual) => ExitCode::SUCCESS,
        Ok(cli::Verdict::SomethingDiffers) => ExitCode::from(1),
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::from(2)
        }
    }
}
