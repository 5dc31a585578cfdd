//! `raywright volume evaluate`: how well frame times are predicted and steered, in several ways.

mod goals;

use std::{
    fmt::Write as _,
    fs::{self, File},
    io::Write as _,
    path::PathBuf,
};

use clap::{Args, ValueEnum};
use comfy_table::{CellAlignment, Table, presets};
use raywright::{
    report::timeline::{Timeline, TimelineHeader, timeline_page},
    study::steering::{Caster, Clock, Run, Stage, Summary, Way, run as lead, suitable_target},
    volume::{
        Estimator, Raycaster,
        sequence::script::{Start, thirty_seconds},
        steer::Resolution,
    },
};

use goals::goals;

use super::{maps::terminations, render::write_picture, script::views, source::VolumeOptions};
use crate::cli::{
    Failure, output,
    run_options::{RunOptions, cancel_on_interrupt},
};

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum ClockName {
    /// Counted work times fixed costs: repeatable to the last bit
    Work,
    /// Time itself
    Wall,
}

#[derive(Debug, Args)]
pub(crate) struct EvaluateArgs {
    /// Volumes: files with a view file beside them that has sparse, dense, overview and close, or generated ones
    #[arg(required = true)]
    volumes: Vec<String>,
    /// What tells the time
    #[arg(long, value_enum, default_value_t = ClockName::Work)]
    clock: ClockName,
    /// Standard deviation of the noise of the work clock, as a share
    #[arg(long, default_value_t = 0.02)]
    noise: f64,
    /// Seeds of sequences and noise
    #[arg(long, value_delimiter = ',', default_value = "101,102,103")]
    seeds: Vec<u64>,
    /// Moments of the sequence per second
    #[arg(long, default_value_t = 30.0)]
    fps: f64,
    /// Seconds that a frame may take; by default so many that three of four frames with a step of 0.75 are faster
    #[arg(long, value_name = "SECONDS")]
    target: Option<f64>,
    /// Side of pictures in pixels
    #[arg(long, default_value_t = 96)]
    side: u32,
    /// Let our ways leave out rays where steps of two voxels are not enough
    #[arg(long)]
    fewer_rays: bool,
    /// Draw each frame in parts once more with one step, and say how they differ
    #[arg(long)]
    seams: bool,
    /// Folder for evaluation.html and evaluation.csv, which has every frame
    #[arg(short, long, default_value = ".")]
    output: PathBuf,
    #[command(flatten)]
    run: RunOptions,
}

/// All runs of a volume.
struct OfVolume {
    name: String,
    runs: Vec<(Caster, String, Run)>,
    /// Where rays end, as PNG: see [`CAPTION`].
    terminations: Vec<Vec<u8>>,
}

/// What the pictures of terminations show.
const CAPTION: &str = "Where rays end in the dense overview, where they were expected to, and the \
                       difference four times: the nearer the brighter.";

/// Runs all sequences in all ways and prints the table, the goals and where they were missed.
pub(crate) fn run(args: &EvaluateArgs) -> Result<(), Failure> {
    let cancel = cancel_on_interrupt()?;
    args.run.install(|| {
        let folder = output::folder(&args.output)?;
        let sequences = args.volumes.len() * args.seeds.len() * 4;
        let bar = output::bar(sequences, "sequences");
        let mut all = Vec::new();
        // What is there is kept, whatever comes.
        let mut table = File::create(folder.join("evaluation.csv"))?;
        table.write_all(CSV_HEAD.as_bytes())?;
        'volumes: for name in &args.volumes {
            let options = VolumeOptions::named(name);
            let stage = options.prepare()?;
            let views = views(&options, &stage)?;
            let volume = &stage.volume;
            let caster = Raycaster::new(volume)?;
            let estimator = Estimator::new(volume);
            let mut of_volume = OfVolume {
                name: options.stem(),
                runs: Vec::new(),
                terminations: Vec::new(),
            };
            let size = [args.side; 2];
            let ends = terminations(volume, &caster, &views.dense, views.overview, size)?;
            for (image, what) in ends.iter().zip(["true", "estimated", "error"]) {
                let path = folder.join(format!("{}-ends-{what}.png", options.stem()));
                write_picture(image, &path)?;
                of_volume.terminations.push(fs::read(&path)?);
            }
            for (caster_name, &seed) in Caster::ALL
                .into_iter()
                .flat_map(|c| args.seeds.iter().map(move |s| (c, s)))
            {
                let mut stage = Stage::new(volume, &caster, &estimator, [args.side; 2]);
                stage.way_to_skip = caster_name;
                stage.seams = args.seams;
                if args.fewer_rays {
                    stage.resolution = Resolution::Ladder;
                }
                for (start, start_name) in [(Start::Sparse, "sparse"), (Start::Dense, "dense")] {
                    if cancel.is_cancelled() {
                        break 'volumes;
                    }
                    let mut sequence = thirty_seconds(name, volume, &views, start, seed);
                    sequence.fps = args.fps;
                    let clock = match args.clock {
                        ClockName::Work => Clock::Work {
                            noise: args.noise,
                            seed,
                        },
                        ClockName::Wall => Clock::Wall,
                    };
                    let target = match args.target {
                        Some(target) => target,
                        None => suitable_target(&stage, &sequence, clock)?,
                    };
                    for run in lead(&stage, &sequence, ways(caster_name), target, clock)? {
                        let name = format!("{start_name} {seed}");
                        of_volume.runs.push((caster_name, name, run));
                    }
                    bar.inc(1);
                }
            }
            table.write_all(csv(&of_volume).as_bytes())?;
            all.push(of_volume);
        }
        bar.finish_and_clear();
        if all.is_empty() {
            return Err(Failure::Interrupted);
        }
        let rows = rows(&all);
        print_table(&rows)?;
        let sentences = goals(args.clock, &all);
        for sentence in &sentences {
            output::line(sentence)?;
        }
        fs::write(
            folder.join("evaluation.html"),
            page(args, &all, rows, sentences),
        )?;
        for name in ["evaluation.html", "evaluation.csv"] {
            output::line(folder.join(name).display())?;
        }
        // Interrupted: the volumes before are whole.
        match all.len() == args.volumes.len() {
            true => Ok(()),
            false => Err(Failure::Interrupted),
        }
    })
}

/// The ways that are compared with a caster: those of the paper with its own, and all with ours.
fn ways(caster: Caster) -> &'static [Way] {
    match caster {
        Caster::Hull => &[Way::NoAdapt, Way::LastFrame, Way::Paper, Way::TwoPass],
        _ => &Way::ALL,
    }
}

fn summary<'a>(volumes: impl Iterator<Item = &'a OfVolume>, caster: Caster, way: Way) -> Summary {
    let runs = volumes.flat_map(|volume| &volume.runs);
    let own = runs.filter(|(by, _, run)| *by == caster && run.way == way);
    Summary::of(own.map(|(_, _, run)| run))
}

/// Columns of the table that are names.
const NAMES: usize = 3;

/// What its figures are.
const UNITS: &str = "Errors in percent of the target, overhead too (that of 95 % of frames); step in lengths of a voxel.";

const COLUMNS: [&str; 19] = [
    "volume",
    "caster",
    "way",
    "step",
    "geo. step",
    "÷ last",
    "RMSE up",
    "low",
    "all",
    "worst",
    "fastest",
    "slow",
    "> 1.1",
    "lags",
    "p95",
    "overhead",
    "prediction",
    "samples",
    "cost",
];

/// The table, its head first.
fn rows(all: &[OfVolume]) -> Vec<Vec<String>> {
    let mut table = vec![COLUMNS.map(str::to_owned).to_vec()];
    let mut add = |name: &str, volumes: &[&OfVolume]| {
        for (caster, way) in Caster::ALL
            .into_iter()
            .flat_map(|c| ways(c).iter().map(move |&w| (c, w)))
        {
            let last = summary(volumes.iter().copied(), caster, Way::LastFrame).mean_step;
            let s = summary(volumes.iter().copied(), caster, way);
            let percent = |share: f64| format!("{:.1}", 100.0 * share);
            table.push(vec![
                name.to_owned(),
                caster.name().to_owned(),
                way.name().to_owned(),
                format!("{:.3}", s.mean_step),
                format!("{:.3}", s.geometric_step),
                format!("{:.2}", s.mean_step / last),
                percent(s.rmse_up),
                percent(s.rmse_low),
                percent(s.rmse),
                format!("{:+.1}", 100.0 * s.error_up),
                format!("{:+.1}", 100.0 * s.error_low),
                percent(s.slow),
                format!("{:.2}", 100.0 * s.above_tenth),
                s.lags.to_string(),
                format!("{:.3}", s.percentiles[1]),
                percent(s.overhead[1]),
                percent(s.prediction),
                percent(s.samples),
                percent(s.cost),
            ]);
        }
    };
    for volume in all {
        add(&volume.name, &[volume]);
    }
    if all.len() > 1 {
        add("all", &all.iter().collect::<Vec<_>>());
    }
    table
}

fn print_table(rows: &[Vec<String>]) -> Result<(), Failure> {
    let mut table = Table::new();
    table.load_style(presets::NOTHING);
    table.set_header(rows[0].clone());
    table.add_rows(rows[1..].iter().cloned());
    for column in table.column_iter_mut().skip(NAMES) {
        column.set_cell_alignment(CellAlignment::Right);
    }
    output::line(format_args!("{UNITS}\n{table}\n"))
}

/// The page: the table, and the first sequence of every volume frame by frame.
fn page(
    args: &EvaluateArgs,
    all: &[OfVolume],
    table: Vec<Vec<String>>,
    mut sentences: Vec<String>,
) -> String {
    let mut timelines = Vec::new();
    for volume in all {
        for caster in Caster::ALL {
            let own = || volume.runs.iter().filter(|(by, _, _)| *by == caster);
            if let Some((_, first, _)) = own().next() {
                timelines.push(Timeline {
                    title: format!("{}, {first}, {}", volume.name, caster.name()),
                    runs: own()
                        .filter(|(_, s, _)| s == first)
                        .map(|(_, _, run)| run)
                        .collect(),
                    pictures: if caster == Caster::Map {
                        volume.terminations.clone()
                    } else {
                        Vec::new()
                    },
                    caption: CAPTION.to_owned(),
                });
            }
        }
    }
    sentences.insert(0, UNITS.into());
    let setting = |name: &str, value: String| (name.to_owned(), value);
    let header = TimelineHeader {
        title: "Frame times, predicted and steered".into(),
        sentences,
        table,
        names: NAMES,
        settings: vec![
            setting("clock", format!("{:?}", args.clock).to_lowercase()),
            setting("noise of the work clock", args.noise.to_string()),
            setting("seeds", format!("{:?}", args.seeds)),
            setting("moments per second", args.fps.to_string()),
            setting("picture", format!("{0} × {0} pixels", args.side)),
            setting("instruction set", args.run.isa().name().to_owned()),
            setting("threads", rayon::current_num_threads().to_string()),
        ],
    };
    timeline_page(&header, &timelines)
}

const CSV_HEAD: &str = "volume,caster,sequence,way,time_s,target_s,frame_s,cast_s,preparing_s,overhead_s,predicted_s,step,step_spread,samples,estimated_samples,cost_ratio,is_switch,is_within\n";

/// Every frame of every run.
fn csv(volume: &OfVolume) -> String {
    let mut text = String::new();
    for (caster, sequence, run) in &volume.runs {
        for f in &run.frames {
            let _ = writeln!(
                text,
                "{},{},{sequence},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{}",
                volume.name,
                caster.name(),
                run.way.name().replace(',', ""),
                f.time,
                run.target,
                f.frame_time,
                f.cast_time,
                f.preparing,
                f.overhead,
                f.predicted,
                f.step,
                f.step_spread,
                f.samples,
                f.estimated,
                f.cost_ratio,
                f.is_switch,
                f.is_within,
            );
        }
    }
    text
}
