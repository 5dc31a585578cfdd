//! `raywright study gains`: what tuning gains on real frames, and what it costs on the way.
//!
//! For each scene, metric, space and seed a run of `tune::Hybrid`, and then its result beside both defaults in
//! turns. A gain is 1 − tuned ÷ default; against the weak default it is never told alone. A twin that tries
//! nothing renders the same frames with the strong default, in turns with the run: what all frames took
//! together stands beside what they took it.

use std::{fmt::Write as _, fs, path::PathBuf, thread::Scope};

use clap::{Args, ValueEnum};
use comfy_table::{Table, presets};
use raywright::{
    bvh::BuildParams,
    imaging::CancelToken,
    tracer::Integrator,
    tune::{
        DEFAULT_OVERHEAD, Decision, Hybrid, Metric, ParameterSpace, Settings, SpaceAxes, WallClock,
        described, portfolio,
    },
    tuner::{GaussianProcess, Search},
};

use super::super::{
    Failure, output,
    run_options::RunOptions,
    scene::{SceneOptions, Stage},
};

/// Pixels of a small frame (426 × 240), and frames of a run that is to have paid.
const SMALL: u32 = 426 * 240;
const LONG: u32 = 300;

#[derive(Debug, Args)]
pub(crate) struct GainsArgs {
    /// Scenes: files or built-in ones
    #[arg(required = true)]
    scenes: Vec<String>,
    /// Seeds of searches and pictures, with commas between
    #[arg(long, value_delimiter = ',', default_values_t = [1, 2, 3, 4, 5])]
    seeds: Vec<u64>,
    /// Frames of a run
    #[arg(long, default_value_t = 80, value_parser = clap::value_parser!(u32).range(2..))]
    frames: u32,
    /// Rounds of the comparison at the end of a run
    #[arg(long, default_value_t = 12, value_parser = clap::value_parser!(u32).range(1..))]
    rounds: u32,
    /// Width of a frame in pixels
    #[arg(long, default_value_t = 640)]
    width: u32,
    /// Height of a frame in pixels
    #[arg(long, default_value_t = 360)]
    height: u32,
    /// Scattering events of a path, K
    #[arg(long, default_value_t = Integrator::DEFAULT_PATH_LENGTH)]
    path_length: u32,
    /// The most that trials may take beyond half of what they save, as a share of all time or of 120 frames
    #[arg(long, default_value_t = DEFAULT_OVERHEAD)]
    overhead: f64,
    /// Build candidates beside the frames, where trees serve any number of them (metric "render")
    #[arg(long)]
    background: bool,
    /// What is made small, with commas between
    #[arg(long, value_enum, value_delimiter = ',', default_values_t = [Feedback::Render, Feedback::Total])]
    metrics: Vec<Feedback>,
    /// The axes, with commas between: those of the paper's eleven parameters, or all that change no pixel
    #[arg(long, value_enum, value_delimiter = ',', default_values_t = [Axes::Eleven, Axes::Wide])]
    spaces: Vec<Axes>,
    /// A row for each run, as CSV
    #[arg(short, long, default_value = "gains.csv")]
    output: PathBuf,
    #[command(flatten)]
    pub(super) run: RunOptions,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Feedback {
    Render,
    Total,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Axes {
    Eleven,
    Wide,
}

impl Feedback {
    fn metric(self) -> Metric {
        match self {
            Self::Render => Metric::Render,
            Self::Total => Metric::Total,
        }
    }
}

impl Axes {
    fn name(self) -> &'static str {
        match self {
            Self::Eleven => "eleven",
            Self::Wide => "wide",
        }
    }

    fn axes(self) -> SpaceAxes {
        match self {
            Self::Eleven => SpaceAxes::Eleven,
            Self::Wide => SpaceAxes::Canonical,
        }
    }
}

/// What a run was.
struct Run {
    scene: String,
    feedback: Feedback,
    axes: Axes,
    seed: u64,
    /// Frames with a candidate, and how many candidates became the incumbent.
    tried: usize,
    accepted: usize,
    /// Tuned ÷ strong and tuned ÷ weak default, medians of rounds.
    strong: f64,
    weak: f64,
    /// All frames of the run ÷ as many with the strong default, and the difference in seconds.
    run_ratio: f64,
    lost_s: f64,
    /// The longest frame of those after the first over the median of them: without builds, and with them.
    slowest: [f64; 2],
    tuned: BuildParams,
}

/// Runs and compares; leaves table, CSV and goals.
pub(super) fn run(args: &GainsArgs, cancel: &CancelToken) -> Result<(), Failure> {
    let mut csv = "scene,metric,space,seed,tried,accepted,tuned_over_strong,tuned_over_weak,run_over_strong,lost_s,slowest_render,slowest_frame,tuned\n".to_owned();
    let mut runs = Vec::new();
    let count = args.scenes.len() * args.metrics.len() * args.spaces.len() * args.seeds.len();
    let bar = output::bar(count, "runs");
    for scene in &args.scenes {
        let stage = SceneOptions::built_in(scene).prepare()?;
        for &feedback in &args.metrics {
            for &axes in &args.spaces {
                for &seed in &args.seeds {
                    let run = std::thread::scope(|scope| {
                        one(args, scope, &stage, feedback, axes, seed, cancel)
                    });
                    let Some(run) = run? else {
                        bar.finish_and_clear();
                        return Err(Failure::Interrupted);
                    };
                    run.write(&mut csv);
                    fs::write(&args.output, &csv)?;
                    runs.push(run);
                    bar.inc(1);
                }
            }
        }
    }
    bar.finish_and_clear();
    print(args, &runs)?;
    output::line(args.output.display())
}

fn one<'a>(
    args: &GainsArgs,
    scope: &'a Scope<'a, '_>,
    stage: &'a Stage,
    feedback: Feedback,
    axes: Axes,
    seed: u64,
    cancel: &CancelToken,
) -> Result<Option<Run>, Failure> {
    let metric = feedback.metric();
    let settings = Settings {
        width: args.width,
        height: args.height,
        path_length: args.path_length,
        metric,
        seed,
        isa: args.run.isa(),
    };
    let strong = BuildParams::default();
    let space = ParameterSpace::new(&strong, &[], axes.axes())?;
    let search = || -> Box<dyn Search> { Box::new(GaussianProcess::new()) };
    let (world, camera) = (&stage.world, stage.camera);
    let run = || {
        let (space, clock) = (space.clone(), WallClock::start());
        Hybrid::new(world, camera, settings, space, &strong, search, clock)
    };
    let mut twin = run()?.frozen();
    let mut hybrid = run()?
        .with_starts(&portfolio(&strong, metric, axes.axes()))
        .with_overhead_limit(args.overhead);
    if args.background {
        hybrid = hybrid.with_background_builds(scope);
    }
    let (mut tried, mut accepted) = (0, 0);
    let (mut seconds, mut usual) = (0.0, 0.0);
    let mut times = [Vec::new(), Vec::new()];
    for _ in 0..args.frames {
        let (Some(frame), Some(other)) = (hybrid.frame(cancel)?, twin.frame(cancel)?) else {
            return Ok(None);
        };
        seconds += frame.time.as_secs_f64();
        usual += other.time.as_secs_f64();
        let render = frame.time.saturating_sub(frame.build);
        for (times, time) in times.iter_mut().zip([render, frame.time]) {
            times.push(time.as_secs_f64());
        }
        if let Some(candidate) = frame.candidate {
            tried += 1;
            let outcome = candidate.outcome.as_ref();
            accepted += usize::from(outcome.is_ok_and(|p| p.decision == Decision::Accepted));
        }
    }
    let tuned = hybrid.incumbent().unwrap_or(strong);
    let comparison = hybrid.compare(&tuned, args.rounds as usize, cancel, |_, _| ())?;
    let costs: Vec<Vec<f64>> = (comparison.rows.iter())
        .map(|row| row.costs_ms(metric))
        .collect();
    let [own, weak_costs, strong_costs] = &costs[..] else {
        return Ok(None);
    };
    if own.len() < args.rounds as usize {
        return Ok(None);
    }
    let ratio_to = |others: &[f64]| {
        let ratios = own.iter().zip(others).map(|(own, other)| own / other);
        median(ratios.collect())
    };
    let slowest = times.map(|mut times| {
        let rest = times.split_off(1);
        rest.iter().copied().fold(0.0, f64::max) / median(rest)
    });
    Ok(Some(Run {
        scene: stage.name.clone(),
        feedback,
        axes,
        seed,
        tried,
        accepted,
        strong: ratio_to(strong_costs),
        weak: ratio_to(weak_costs),
        run_ratio: seconds / usual,
        lost_s: seconds - usual,
        slowest,
        tuned,
    }))
}

impl Run {
    fn write(&self, csv: &mut String) {
        let tuned: Vec<String> = described(&self.tuned)
            .into_iter()
            .map(|(name, value)| format!("{name}={value}"))
            .collect();
        // Writing to a String cannot fail.
        let _ = writeln!(
            csv,
            "{},{},{},{},{},{},{:.4},{:.4},{:.4},{:.3},{:.3},{:.3},{}",
            self.scene,
            self.feedback.metric().name(),
            self.axes.name(),
            self.seed,
            self.tried,
            self.accepted,
            self.strong,
            self.weak,
            self.run_ratio,
            self.lost_s,
            self.slowest[0],
            self.slowest[1],
            tuned.join(" ")
        );
    }
}

/// The table over seeds, and the goals.
fn print(args: &GainsArgs, runs: &[Run]) -> Result<(), Failure> {
    let mut table = Table::new();
    table.load_style(presets::UTF8_FULL_CONDENSED);
    table.set_header([
        "scene",
        "metric",
        "space",
        "gain on the strong default, % (range)",
        "on the weak",
        "tried",
        "accepted",
        "run ÷ strong all the time",
        "lost, s",
        "slowest frame (with builds)",
    ]);
    let group = |scene: Option<&str>, feedback, axes| -> Vec<&Run> {
        let is_one = |run: &&Run| {
            scene.is_none_or(|scene| run.scene == scene)
                && (run.feedback, run.axes) == (feedback, axes)
        };
        runs.iter().filter(is_one).collect()
    };
    let mut scenes: Vec<&str> = runs.iter().map(|run| run.scene.as_str()).collect();
    scenes.dedup();
    let gain = |ratio: f64| 100.0 * (1.0 - ratio);
    for scene in scenes {
        for &feedback in &args.metrics {
            for &axes in &args.spaces {
                let own = group(Some(scene), feedback, axes);
                let of = |value: fn(&Run) -> f64| -> Vec<f64> {
                    own.iter().map(|run| value(run)).collect()
                };
                let strong = of(|run| run.strong);
                let [least, most] = [f64::max, f64::min]
                    .map(|pick| strong.iter().copied().reduce(pick).unwrap_or(f64::NAN));
                table.add_row([
                    scene.to_owned(),
                    feedback.metric().name().to_owned(),
                    axes.name().to_owned(),
                    format!(
                        "{:.1} ({:.1} … {:.1})",
                        gain(median(strong.clone())),
                        gain(least),
                        gain(most)
                    ),
                    format!("{:.0}", gain(median(of(|run| run.weak)))),
                    format!("{:.0}", median(of(|run| run.tried as f64))),
                    format!("{:.0}", median(of(|run| run.accepted as f64))),
                    format!("{:.3}", median(of(|run| run.run_ratio))),
                    format!("{:+.2}", median(of(|run| run.lost_s))),
                    format!(
                        "{:.2} ({:.2})",
                        median(of(|run| run.slowest[0])),
                        median(of(|run| run.slowest[1]))
                    ),
                ]);
            }
        }
    }
    output::line(format_args!(
        "{table}\nmedians over {} seeds of {} frames, {}×{}, K = {}, {} threads",
        args.seeds.len(),
        args.frames,
        args.width,
        args.height,
        args.path_length,
        rayon::current_num_threads()
    ))?;
    let (mut met, mut all) = (0, 0);
    let mut goal = |name: String, value: f64, holds: bool| {
        all += 1;
        met += usize::from(holds);
        if holds {
            return Ok(());
        }
        output::line(format_args!("missed: {name}: {value:.3}"))
    };
    for &feedback in &args.metrics {
        for &axes in &args.spaces {
            let own = group(None, feedback, axes);
            let name = format!("{}, {}", feedback.metric().name(), axes.name());
            let of = |value: fn(&Run) -> f64| own.iter().map(move |run| value(run));
            let mean = |values: &mut dyn Iterator<Item = f64>| {
                let logs: Vec<f64> = values.map(f64::ln).collect();
                (logs.iter().sum::<f64>() / logs.len() as f64).exp()
            };
            let strong = gain(mean(&mut of(|run| run.strong)));
            // The fewer the rays, the more there is to gain by a build that is short.
            let wanted = match feedback {
                Feedback::Render => 3.0,
                Feedback::Total if args.width * args.height <= SMALL => 20.0,
                Feedback::Total => 5.0,
            };
            let what = format!("{name}: mean gain on the strong default at least {wanted} %");
            goal(what, strong, strong >= wanted)?;
            let worst = gain(of(|run| run.strong).fold(0.0, f64::max));
            let what = format!("{name}: no run worse than the strong default by over 1 %");
            goal(what, worst, worst >= -1.0)?;
            let ratio = mean(&mut of(|run| run.run_ratio));
            let most = if args.frames < LONG { 1.02 } else { 1.0 };
            let what = format!("{name}: all frames at most {most} of the strong default's");
            goal(what, ratio, ratio <= most)?;
            if feedback == Feedback::Render {
                let weak = gain(mean(&mut of(|run| run.weak)));
                let what = format!("{name}: mean gain on the weak default at least 50 %");
                goal(what, weak, weak >= 50.0)?;
                if axes == Axes::Wide {
                    let middle = gain(median(of(|run| run.strong).collect()));
                    let what = format!("{name}: median gain on the strong default at least 11 %");
                    goal(what, middle, middle >= 11.0)?;
                }
            }
        }
    }
    output::line(format_args!("goals: {met} of {all} met"))
}

/// The median; NaN of nothing.
fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    let Some(last) = values.len().checked_sub(1) else {
        return f64::NAN;
    };
    0.5 * (values[last / 2] + values[values.len() / 2])
}
