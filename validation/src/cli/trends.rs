//! `trends`: what each parameter does to ours and to Embree's, measured in turn.

use std::{
    error::Error,
    fs,
    path::{Path, PathBuf},
};

use clap::{Args, ValueEnum};
use raywright_bvh::Rounding;
use raywright_validation::{
    TriangleSet, golden,
    trends::{self, Agreement, ENGINES, SWEEPS, Subject, Sweep, Trend},
};

use super::{Verdict, embree_or_skip, random::keep_to_one_core, trees::default_data};

/// Arguments of `trends`.
#[derive(Debug, Args)]
#[command(after_help = "\
Builders are compared without layout (rtcBuildBVH beside our hierarchy); trace time and counts of work are those of
our kernels over either tree, Embree's being made once more by our builder and believed only if it is Embree's to the
last bit. The flags dynamics, leaf_format and accuracy compare our whole trees with Embree's scenes, each traced by
its own kernels. One thread, one core; on Linux, times are what the process works, whatever else runs.

A direction is the sign of Spearman's rank correlation within rounds; it is flat if the interval of 95 % over rounds
holds 0. Files in DIR: measurements.csv (one line for each measurement), trends.csv (the table), trends.html.

Embree is found as for `trees --random`. Exit code 1 if a parameter pushes a quantity in opposite directions.")]
pub(crate) struct TrendsArgs {
    /// Scenes: names of folders in the shared data or of built-in sets, or OBJ files
    #[arg(long = "scene", value_name = "SCENE", default_values = ["sponza", "conference", "fireplace_room"])]
    scenes: Vec<String>,
    /// Only this parameter; may be given more than once
    #[arg(long = "parameter", value_name = "NAME", value_parser = parameter)]
    parameters: Vec<&'static Sweep>,
    /// Rounds of times that count
    #[arg(long, default_value_t = 9, value_parser = clap::value_parser!(u32).range(1..))]
    rounds: u32,
    /// Rays of each of three kinds (primary, diffuse, shadow)
    #[arg(long, default_value_t = 20_000, value_parser = clap::value_parser!(u32).range(1..))]
    rays: u32,
    /// Whose rounding our builder follows
    #[arg(long, value_enum, default_value = "exact")]
    rounding: RoundingArg,
    /// The folder with scenes (default: ../shared/data beside the checkout)
    #[arg(long, value_name = "DIR")]
    data: Option<PathBuf>,
    /// Write files to this folder
    #[arg(short, long, value_name = "DIR")]
    output: Option<PathBuf>,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum RoundingArg {
    Exact,
    Embree,
}

fn parameter(name: &str) -> Result<&'static Sweep, String> {
    let known = || SWEEPS.iter().map(|sweep| sweep.parameter);
    let found = SWEEPS.iter().find(|sweep| sweep.parameter == name);
    found.ok_or_else(|| format!("not one of {}", known().collect::<Vec<_>>().join(", ")))
}

/// Measures all; prints the table and writes the files.
pub(crate) fn run(args: &TrendsArgs) -> Result<Verdict, Box<dyn Error>> {
    let is_on_one_core = keep_to_one_core();
    rayon::ThreadPoolBuilder::new()
        .num_threads(1)
        .build_global()?;
    let Some(embree) = embree_or_skip()? else {
        return Ok(Verdict::AllEqual);
    };
    let device = embree.device(1)?;
    let rounding = match args.rounding {
        RoundingArg::Exact => Rounding::Exact,
        RoundingArg::Embree => Rounding::Embree,
    };
    let folder = args
        .data
        .clone()
        .unwrap_or_else(default_data)
        .join("scenes");
    let (mut all, mut notes, mut sizes) = (Vec::new(), Vec::new(), Vec::new());
    for scene in &args.scenes {
        let subject = Subject::new(read(scene, &folder)?, args.rays as usize, rounding)?;
        sizes.push(format!("{} ({})", subject.name(), subject.triangles()));
        for sweep in &SWEEPS {
            if !args.parameters.is_empty() && !args.parameters.contains(&sweep) {
                continue;
            }
            eprintln!("{}: {}", subject.name(), sweep.parameter);
            let swept = trends::sweep(&subject, sweep, &device, args.rounds as usize)?;
            let place = format!("{}, {}", subject.name(), sweep.parameter);
            notes.extend(swept.notes.iter().map(|note| format!("{place} {note}")));
            all.extend(swept.trends);
        }
    }
    let cores = if is_on_one_core {
        "one core"
    } else {
        "any core"
    };
    let about = format!(
        "Ours with {} rounding beside Embree {} ({}); one thread, {cores}; {} rounds, {} rays of each of three kinds; \
         triangles: {}.",
        match rounding {
            Rounding::Exact => "exact",
            Rounding::Embree => "Embree's",
        },
        device.version(),
        device.instruction_set(),
        args.rounds,
        args.rays,
        sizes.join(", ")
    );
    print(&about, &all, &notes);
    if let Some(folder) = &args.output {
        fs::create_dir_all(folder)?;
        write_measurements(&folder.join("measurements.csv"), &all)?;
        write_trends(&folder.join("trends.csv"), &all)?;
        fs::write(
            folder.join("trends.html"),
            trends::page(&about, &all, &notes)?,
        )?;
    }
    let is_opposite = |trend: &Trend| trend.agreement() == Agreement::No;
    Ok(if all.iter().any(is_opposite) {
        Verdict::SomethingDiffers
    } else {
        Verdict::AllEqual
    })
}

/// A file, a built-in set or a scene of the shared data.
fn read(name: &str, folder: &Path) -> Result<TriangleSet, Box<dyn Error>> {
    if let Some(set) = golden::procedural(name) {
        return Ok(set);
    }
    let file = Path::new(name);
    if file.is_file() {
        return Ok(golden::read_obj(file)?);
    }
    Ok(golden::read_obj(
        &folder.join(name).join(format!("{name}.obj.gz")),
    )?)
}

fn print(about: &str, trends: &[Trend], notes: &[String]) {
    println!("{about}\n");
    println!(
        "{:<18} {:<14} {:<16} {:>5} {:>15} {:>8} {:>6} {:>15} {:>8}  same direction",
        "parameter",
        "quantity",
        "scene",
        "ours",
        "interval",
        "change",
        "Embree",
        "interval",
        "change"
    );
    for trend in trends {
        print!(
            "{:<18} {:<14} {:<16}",
            trend.sweep.parameter,
            trend.quantity.name(),
            trend.scene
        );
        for (engine, width) in [(0, 5), (1, 6)] {
            let correlation = &trend.correlations[engine];
            if correlation.is_known() {
                let [low, high] = correlation.interval;
                let interval = format!("{low:.2} … {high:.2}");
                let change = format!("×{:.3}", trend.series[engine].change());
                print!(" {:>width$.2} {interval:>15} {change:>8}", correlation.rho);
            } else {
                print!(" {:>width$} {:>15} {:>8}", "·", "", "");
            }
        }
        println!("  {}", trend.agreement().name());
    }
    println!();
    for agreement in [
        Agreement::Yes,
        Agreement::No,
        Agreement::OneFlat,
        Agreement::BothFlat,
        Agreement::Unknown,
    ] {
        let is_one = |trend: &&Trend| trend.agreement() == agreement;
        let count = trends.iter().filter(is_one).count();
        println!("{:<14} {count:>4}", agreement.name());
    }
    for note in notes {
        println!("not measured: {note}");
    }
}

/// One line for each measurement.
fn write_measurements(path: &Path, trends: &[Trend]) -> Result<(), Box<dyn Error>> {
    let mut writer = csv::Writer::from_path(path)?;
    let head = [
        "scene",
        "parameter",
        "value",
        "engine",
        "round",
        "quantity",
        "unit",
        "measured",
    ];
    writer.write_record(head)?;
    for trend in trends {
        for (series, engine) in trend.series.iter().zip(ENGINES) {
            for (round, row) in series.rounds.iter().enumerate() {
                for (&place, measured) in series.places.iter().zip(row) {
                    writer.write_record([
                        &trend.scene,
                        trend.sweep.parameter,
                        trend.sweep.values[place],
                        engine,
                        &round.to_string(),
                        trend.quantity.name(),
                        trend.quantity.unit(),
                        &measured.to_string(),
                    ])?;
                }
            }
        }
    }
    Ok(writer.flush()?)
}

/// One line for each parameter, quantity and scene; empty where an engine does not tell.
fn write_trends(path: &Path, trends: &[Trend]) -> Result<(), Box<dyn Error>> {
    let mut writer = csv::Writer::from_path(path)?;
    writer.write_record([
        "scene",
        "parameter",
        "quantity",
        "ours_rho",
        "ours_low",
        "ours_high",
        "ours_change",
        "embree_rho",
        "embree_low",
        "embree_high",
        "embree_change",
        "same_direction",
    ])?;
    for trend in trends {
        let mut record = vec![
            trend.scene.clone(),
            trend.sweep.parameter.to_owned(),
            trend.quantity.name().to_owned(),
        ];
        for (series, correlation) in trend.series.iter().zip(&trend.correlations) {
            let [low, high] = correlation.interval;
            for number in [correlation.rho, low, high, series.change()] {
                let text = number.to_string();
                record.push(if number.is_nan() { String::new() } else { text });
            }
        }
        record.push(trend.agreement().name().to_owned());
        writer.write_record(&record)?;
    }
    Ok(writer.flush()?)
}
