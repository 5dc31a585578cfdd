//! `raywright volume tradeoff`: what each knob of raycasting costs and gives, and which setting to take.

use std::{fmt::Write, fs, path::PathBuf};

use clap::Args;
use comfy_table::{CellAlignment, Table, presets};
use raywright::{
    report::tradeoff::{COLUMNS, TradeoffHeader, cells, tradeoff_page},
    study::tradeoff::{Knob, Outcome, StudyError, Subject, Tradeoff, run as study, settings},
    volume::{CastOptions, Raycaster},
};

use super::{aim::AimOptions, look::LookOptions, source::VolumeOptions};
use crate::cli::{
    Failure, output,
    run_options::{RunOptions, cancel_on_interrupt},
};

#[derive(Debug, Args)]
pub(crate) struct TradeoffArgs {
    #[command(flatten)]
    volume: VolumeOptions,
    #[command(flatten)]
    aim: AimOptions,
    #[command(flatten)]
    look: LookOptions,
    /// Width in pixels
    #[arg(long, default_value_t = 512)]
    width: u32,
    /// Height in pixels
    #[arg(long, default_value_t = 512)]
    height: u32,
    /// How often every setting is measured
    #[arg(long, default_value_t = 3, value_parser = clap::value_parser!(u32).range(1..))]
    rounds: u32,
    /// Recommend the most accurate setting that takes at most so many milliseconds
    #[arg(long, value_name = "MS")]
    time: Option<f64>,
    /// Recommend the fastest setting with at most this root mean square error, levels of 255
    #[arg(long, value_name = "LEVELS")]
    error: Option<f64>,
    /// Folder for VOLUME-tradeoff.html and VOLUME-tradeoff.csv
    #[arg(short, long, default_value = ".")]
    output: PathBuf,
    #[command(flatten)]
    run: RunOptions,
}

/// Measures all settings, prints the best and leaves a page and a table.
pub(crate) fn run(args: &TradeoffArgs) -> Result<(), Failure> {
    let cancel = cancel_on_interrupt()?;
    args.run.install(|| {
        let stage = args.volume.prepare()?;
        let aim = args.aim.at(&stage, &args.volume.volume)?;
        let caster = Raycaster::new(&stage.volume)?;
        let mut options = CastOptions::default();
        options.isa = args.run.isa();
        let subject = Subject {
            caster: &caster,
            appearance: args.look.appearance(aim.function.clone())?,
            camera: aim.camera,
            size: [args.width, args.height],
            options,
        };
        let folder = output::folder(&args.output)?;
        let bar = output::bar(settings().len() * args.rounds as usize, "pictures");
        let result = study(&subject, args.rounds, &cancel, || bar.inc(1));
        bar.finish_and_clear();
        let result = match result {
            Err(StudyError::Cancelled) => return Err(Failure::Interrupted),
            other => other?,
        };
        let advice = advice(args, &result);
        print(&result, &advice)?;

        let name = args.volume.stem();
        let value = |text: &dyn std::fmt::Display| text.to_string();
        let header = TradeoffHeader {
            volume: name.clone(),
            settings: [
                ("transfer function", value(&aim.function_name)),
                ("camera", value(&aim.camera_name)),
                (
                    "picture",
                    format!("{} × {} pixels", args.width, args.height),
                ),
                ("instruction set", value(&args.run.isa().name())),
                ("threads", value(&rayon::current_num_threads())),
                ("rounds", value(&args.rounds)),
            ]
            .map(|(name, value)| (name.to_owned(), value))
            .to_vec(),
            advice,
        };
        let file = |ending: &str| folder.join(format!("{name}-tradeoff.{ending}"));
        fs::write(file("html"), tradeoff_page(&header, &result))?;
        fs::write(file("csv"), csv(&result))?;
        for path in [file("html"), file("csv")] {
            output::line(path.display())?;
        }
        Ok(())
    })
}

/// Sentences about what was asked for and what was found besides.
fn advice(args: &TradeoffArgs, result: &Tradeoff) -> Vec<String> {
    let figures = |o: &Outcome| {
        let error = o.error();
        format!(
            "{}: {:.2} ms, error {error:.2} of 255",
            o.setting.words(),
            o.time_ms()
        )
    };
    let mut advice = Vec::new();
    if let Some(time) = args.time {
        advice.push(match result.within_time(time) {
            Some(outcome) => format!("In {time} ms, {}.", figures(outcome)),
            None => format!("No setting takes {time} ms or less."),
        });
    }
    if let Some(error) = args.error {
        advice.push(match result.within_error(error) {
            Some(outcome) => format!("With an error of at most {error}, {}.", figures(outcome)),
            None => format!("No setting has an error of {error} or less."),
        });
    }
    if let Some(normal) = result.normal() {
        let mut sentence = format!("By default, {}", figures(normal));
        if let Some(faster) = result.within_error(normal.error()) {
            let gain = normal.time_ms() / faster.time_ms();
            let _ = write!(
                sentence,
                "; as near in 1/{gain:.2} of the time, {}",
                figures(faster)
            );
        }
        advice.push(sentence + ".");
    }
    advice.push(format!(
        "Skipping empty space makes the same picture {:.2} times as fast.",
        result.skipping_gain
    ));
    advice.push(match result.integration_gain() {
        Some(gain) => {
            format!("At the error of the default, pre-integration is {gain:.2} times as fast.")
        }
        None => "Pre-integration never comes as near as the default does.".into(),
    });
    advice
}

fn print(result: &Tradeoff, advice: &[String]) -> Result<(), Failure> {
    section(
        "What no other setting beats",
        result,
        result.front().into_iter(),
    )?;
    for knob in Knob::ALL {
        let settings = knob.settings();
        let own = result
            .outcomes
            .iter()
            .filter(|o| settings.contains(&o.setting));
        section(&format!("One knob: {}", knob.name()), result, own)?;
    }
    advice.iter().try_for_each(output::line)
}

fn section<'a>(
    title: &str,
    result: &Tradeoff,
    outcomes: impl Iterator<Item = &'a Outcome>,
) -> Result<(), Failure> {
    let mut table = Table::new();
    table.load_style(presets::NOTHING);
    table.set_header(COLUMNS);
    for outcome in outcomes {
        table.add_row(cells(result, outcome));
    }
    for column in table.column_iter_mut().skip(1) {
        column.set_cell_alignment(CellAlignment::Right);
    }
    output::line(format_args!("{title}\n{table}\n"))
}

/// All outcomes, for programs.
fn csv(result: &Tradeoff) -> String {
    let mut text = String::from(
        "step,termination,behind,interpolation,integration,pixels_per_ray,median_ms,rmse,rmse_seen,largest,psnr_db,ssim,is_on_front\n",
    );
    let front = result.front();
    for outcome in &result.outcomes {
        let (s, d) = (&outcome.setting, &outcome.difference);
        let is_on_front = front.iter().any(|f| f.setting == outcome.setting);
        let _ = writeln!(
            text,
            "{},{},{:?},{:?},{:?},{},{},{},{},{},{},{},{is_on_front}",
            s.step,
            s.termination,
            s.behind,
            s.interpolation,
            s.integration,
            s.pixels_per_ray,
            outcome.time_ms(),
            d.rmse,
            d.rmse_seen,
            d.largest,
            d.psnr(),
            d.ssim,
        );
    }
    text
}
