//! `raywright tune`: a search of BVH parameters while frames are rendered, and its comparison with
//! two baselines in the same run.
//!
//! Every frame is written to the log when it is done, so that an interrupted run keeps what it
//! has. The report is made from the same records.

mod compared;
mod frames;

use std::{
    fs,
    num::NonZeroU32,
    path::{Path, PathBuf},
};

use clap::{Args, ValueEnum};
use raywright::{
    bvh::BuildParams,
    imaging::{CancelToken, write_image},
    report::{
        self,
        log::RunLog,
        record::{FrameRecord, RunHeader, RunRecord, SCHEMA_VERSION},
    },
    tracer::{Indicators, Integrator},
    tune::{
        self, Hybrid, Memory, Metric, ParameterSpace, PredictorKind, Session, Settings, SpaceAxes,
        WallClock,
    },
    tuner::{SEARCH_NAMES, Search, predict::Step, search_by_name},
};

use compared::{print_comparison, summary};
use frames::Frames;

use super::{
    Failure, memory, output,
    run_options::{ParameterOptions, RunOptions, cancel_on_interrupt},
    scene::{SceneOptions, Stage},
};

/// Share of all time that trials take here: a run is for the search, and its frames are few.
const SEARCH_OVERHEAD: f64 = 0.5;

/// A share that is at least 0.
fn share(text: &str) -> Result<f64, String> {
    match text.parse() {
        Ok(share) if share >= 0.0 => Ok(share),
        _ => Err("a number from 0 on is wanted".into()),
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(super) enum MetricOption {
    /// Time to render: the tree serves many frames
    Render,
    /// Time to build and render: the tree is built for each frame
    Total,
}

impl MetricOption {
    /// The metric, for trees that serve so many frames in the total.
    pub(super) fn metric(self, frames_per_tree: NonZeroU32) -> Metric {
        match self {
            Self::Render => Metric::Render,
            Self::Total => Metric::of_frames_per_tree(frames_per_tree),
        }
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Policy {
    /// Tries candidates on some tiles of a frame and keeps the best tree for the rest: known-good parameters,
    /// then a Gaussian process over the canonical axes, until nothing more is to be gained
    Hybrid,
    /// Every frame is a trial: a simplex from a Latin hypercube over the printed axes
    Paper,
    /// Tries nothing: the default parameters in every frame
    Default,
}

impl Policy {
    fn name(self) -> &'static str {
        match self {
            Self::Hybrid => "hybrid",
            Self::Paper => "paper",
            Self::Default => "default",
        }
    }

    fn axes(self) -> Space {
        match self {
            Self::Hybrid => Space::Canonical,
            Self::Paper | Self::Default => Space::Printed,
        }
    }

    fn search(self) -> &'static str {
        match self {
            Self::Hybrid => "gaussian-process",
            Self::Paper | Self::Default => "nelder-mead",
        }
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Predict {
    /// The best configuration of the nearest state
    Nearest,
    /// The configuration of the highest value, learned as in the paper
    Value,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Space {
    /// One for each parameter, as in the paper
    Printed,
    /// Only what builds different trees, near trees near to each other
    Canonical,
    /// The same of the paper's eleven parameters alone
    Eleven,
}

impl From<Space> for SpaceAxes {
    fn from(space: Space) -> Self {
        match space {
            Space::Printed => Self::Printed,
            Space::Canonical => Self::Canonical,
            Space::Eleven => Self::Eleven,
        }
    }
}

/// What is tuned, and for how long.
#[derive(Clone, Debug, Args)]
pub(crate) struct TuneArgs {
    #[command(flatten)]
    scene: SceneOptions,
    /// Frames of the search, one sample per pixel each
    #[arg(long, default_value_t = 80, value_parser = clap::value_parser!(u32).range(1..))]
    frames: u32,
    /// What is made small
    #[arg(long, value_enum, default_value_t = MetricOption::Total)]
    metric: MetricOption,
    /// Frames that a tree serves, with the metric total: each bears its share of the build
    #[arg(long, default_value_t = NonZeroU32::MIN)]
    frames_per_tree: NonZeroU32,
    /// How frames are used
    #[arg(long, value_enum, default_value_t = Policy::Hybrid)]
    policy: Policy,
    /// The most that trials may take with the policy hybrid beyond half of what they save, as a share of all time
    /// or of 120 frames; what would be one too many waits. 0: nothing is tried; 1 and more: none waits long
    #[arg(long, default_value_t = SEARCH_OVERHEAD, value_parser = share)]
    overhead: f64,
    /// With the policy paper and a store: take what this predictor names for the state of the scene, from what
    /// is known of all scenes, and search with a small probability only
    #[arg(long, value_enum, requires = "store")]
    predict: Option<Predict>,
    /// The axes of the search; canonical with the policy hybrid, printed otherwise
    #[arg(long, value_enum)]
    space: Option<Space>,
    /// Try known-good parameters first, as the policy hybrid always does: the default, and what covers
    /// recordings of six scenes
    #[arg(long)]
    portfolio: bool,
    /// A folder that keeps every trial; what is known there of the same machine, scene and settings is not
    /// measured again
    #[arg(long, value_name = "FOLDER")]
    store: Option<PathBuf>,
    /// The search: random, nelder-mead (from a Latin hypercube) or gaussian-process; by default that of the
    /// policy
    #[arg(long, value_parser = clap::builder::PossibleValuesParser::new(SEARCH_NAMES))]
    search: Option<String>,
    /// Rounds of the comparison with both baselines at the end
    #[arg(long, default_value_t = 9, value_parser = clap::value_parser!(u32).range(1..))]
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
    /// Seed of the search and of the pictures
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Folder for the log (.jsonl), the report (.html) and the picture (.png)
    #[arg(short, long, default_value = "raywright-out")]
    output: PathBuf,
    /// A parameter given by -D is not searched
    #[command(flatten)]
    parameters: ParameterOptions,
    #[command(flatten)]
    run: RunOptions,
    /// Print the whole run as one JSON object at its end
    #[arg(long)]
    json: bool,
}

impl TuneArgs {
    /// A short run over a built-in scene.
    pub(crate) fn demo(
        scene: &str,
        output: &Path,
        frames: u32,
        seed: u64,
        run: &RunOptions,
    ) -> Self {
        Self {
            scene: SceneOptions::built_in(scene),
            frames,
            metric: MetricOption::Total,
            frames_per_tree: NonZeroU32::MIN,
            policy: Policy::Hybrid,
            overhead: SEARCH_OVERHEAD,
            predict: None,
            space: None,
            portfolio: false,
            store: None,
            search: None,
            rounds: 7,
            width: 640,
            height: 360,
            path_length: Integrator::DEFAULT_PATH_LENGTH,
            seed,
            output: output.to_owned(),
            parameters: ParameterOptions::default(),
            run: run.clone(),
            json: false,
        }
    }
}

impl TuneArgs {
    /// The name of the search.
    fn search(&self) -> String {
        let own = self.search.clone();
        own.unwrap_or_else(|| self.policy.search().into())
    }
}

/// Tunes; leaves log, report and picture.
pub(crate) fn run(args: &TuneArgs) -> Result<(), Failure> {
    let cancel = cancel_on_interrupt()?;
    args.run.install(|| tune(args, &cancel))
}

fn tune(args: &TuneArgs, cancel: &CancelToken) -> Result<(), Failure> {
    let base = args.parameters.applied_to(BuildParams::default())?;
    let stage = args.scene.prepare()?;
    let fixed = args.parameters.names();
    let axes = args.space.unwrap_or(args.policy.axes());
    let space = ParameterSpace::new(&base, &fixed, axes.into())?;
    let settings = Settings {
        width: args.width,
        height: args.height,
        path_length: args.path_length,
        metric: args.metric.metric(args.frames_per_tree),
        seed: args.seed,
        isa: args.run.isa(),
    };
    if args.path_length < Integrator::DEFAULT_PATH_LENGTH {
        output::note(
            "note: short paths give much weight to coherent camera rays, which misleads a tuner",
        );
    }
    let mut memory = match &args.store {
        Some(folder) => Some(memory::open(
            folder, &space, &base, &fixed, &stage, &settings,
        )?),
        None => None,
    };
    let known = match &memory {
        Some(memory) => memory.known(space.space(), settings.metric)?,
        None => Vec::new(),
    };
    if !known.is_empty() {
        output::note(format_args!(
            "note: {} outcomes of earlier runs are known",
            known.len()
        ));
    }
    let world = &stage.world;
    let (camera, clock) = (stage.camera, WallClock::start());
    let starts = tune::portfolio(&base, settings.metric, axes.into());
    let predicted = match (args.predict, &memory) {
        (Some(predict), Some(memory)) if args.policy == Policy::Paper => {
            predicted(predict, memory, &space, &stage, &settings)?
        }
        _ => None,
    };
    let mut frames = match (args.policy, predicted) {
        (_, Some(params)) => {
            let search = || search_named("random");
            let hybrid = Hybrid::new(world, camera, settings, space, &params, search, clock)?;
            Frames::Tiles(hybrid.frozen())
        }
        (Policy::Hybrid | Policy::Default, None) => {
            let search = args.search();
            let hybrid = Hybrid::new(
                world,
                camera,
                settings,
                space,
                &base,
                move || search_named(&search),
                clock,
            )?;
            Frames::Tiles(match args.policy {
                Policy::Default => hybrid.frozen(),
                _ => hybrid
                    .with_starts(&starts)
                    .with_known(known)
                    .with_overhead_limit(args.overhead),
            })
        }
        (Policy::Paper, None) => {
            let search = search_named(&args.search());
            let session = Session::new(world, camera, settings, space, search, clock)?;
            let session = session.with_known(known)?;
            Frames::Whole(if args.portfolio {
                session.with_starts(&starts)?
            } else {
                session
            })
        }
    };

    let folder = output::folder(&args.output)?;
    let file = |ending: &str| {
        folder.join(format!(
            "{}-{}.{ending}",
            stage.name,
            settings.metric.name()
        ))
    };
    let header = header(args, &stage, &settings);
    let mut log = RunLog::create(file("jsonl"))?;
    log.header(&header)?;
    let mut run = RunRecord {
        header,
        frames: vec![],
        summary: None,
    };
    render_frames(
        args,
        &mut frames,
        settings.metric,
        memory.as_mut(),
        &mut run,
        &mut log,
        cancel,
    )?;
    let searched_all = run.frames.len() == args.frames as usize;

    if let Some(best) = frames.incumbent() {
        // An interrupted search is compared too, unless the user interrupts again.
        let cancel = if searched_all {
            cancel
        } else {
            &CancelToken::new()
        };
        let bar = output::bar(args.rounds as usize + 1, "comparing");
        let comparison = frames.compare(&best, args.rounds as usize, cancel, |done, _| {
            bar.set_position(done as u64)
        })?;
        bar.finish_and_clear();
        let summary = summary(&comparison, settings.metric, !searched_all);
        log.summary(&summary)?;
        if !args.json {
            print_comparison(&summary)?;
        }
        run.summary = Some(summary);
    } else {
        output::note("no frame was finished: nothing to compare");
    }
    let picture = file("png");
    write_image(&picture, &frames.film().mean())?;
    let page = file("html");
    fs::write(&page, report::page(&run, Some(&fs::read(&picture)?)))?;
    if args.json {
        output::json(&run)?;
    } else {
        for path in [page, picture, file("jsonl")] {
            output::line(path.display())?;
        }
    }
    if searched_all && !cancel.is_cancelled() {
        Ok(())
    } else {
        Err(Failure::Interrupted)
    }
}

/// What a predictor names for the state of the scene; `None` if it is to be searched.
fn predicted(
    predict: Predict,
    memory: &Memory,
    space: &ParameterSpace,
    stage: &Stage,
    settings: &Settings,
) -> Result<Option<BuildParams>, Failure> {
    let kind = match predict {
        Predict::Nearest => PredictorKind::NearestNeighbour,
        Predict::Value => PredictorKind::ValueFunction,
    };
    let known = memory.states(space.space(), settings.metric)?;
    let state = Indicators::of(stage.world.scene(), &stage.camera);
    let step = tune::decide(kind, &known, space.space(), state.values(), settings.seed)?;
    let Step::Exploit(point) = step else {
        output::note("note: the choice fell on a search");
        return Ok(None);
    };
    output::note(format_args!(
        "note: all frames with what is predicted from {} outcomes",
        known.len()
    ));
    Ok(Some(space.params(&space.space().decode(&point))))
}

fn header(args: &TuneArgs, stage: &Stage, settings: &Settings) -> RunHeader {
    let scene = stage.world.scene();
    RunHeader {
        schema_version: SCHEMA_VERSION,
        version: env!("CARGO_PKG_VERSION").into(),
        scene: stage.name.clone(),
        triangles: scene.triangle_count(),
        width: settings.width,
        height: settings.height,
        path_length: settings.path_length,
        metric: settings.metric.name().into(),
        search: args.search(),
        seed: settings.seed,
        threads: rayon::current_num_threads(),
        instruction_set: settings.isa.name().into(),
        frames_planned: args.frames as usize,
        indicators: Indicators::of(scene, &stage.camera)
            .named()
            .map(|(name, value)| (name.into(), value))
            .collect(),
        policy: Some(args.policy.name().into()),
        frames_per_tree: settings
            .metric
            .frames_per_tree()
            .map(|frames| frames.get().into()),
    }
}

/// Renders the frames, each logged when it is done.
fn render_frames(
    args: &TuneArgs,
    frames: &mut Frames<'_>,
    metric: Metric,
    mut memory: Option<&mut Memory>,
    run: &mut RunRecord,
    log: &mut RunLog,
    cancel: &CancelToken,
) -> Result<(), Failure> {
    let bar = output::bar(args.frames as usize, "tuning");
    for frame in 0..args.frames as usize {
        let mut begun = None;
        let done = frames.frame(frame, metric, cancel, |trial| {
            begun = memory.as_deref_mut().map(|memory| {
                let stamp = memory.begins(memory::now()?, trial)?;
                Ok::<_, Failure>(stamp)
            });
        })?;
        let (record, ended) = match done {
            Some(done) => (Some(done.record), Some(done.ended)),
            None => (None, None),
        };
        if let (Some(memory), Some(stamp)) = (memory.as_deref_mut(), begun.transpose()?) {
            memory.ended(memory::now()?, stamp, ended, metric)?;
        }
        let Some(record) = record else {
            break;
        };
        log.frame(&record)?;
        if !args.json {
            bar.suspend(|| output::line(frame_line(&record)))?;
        }
        run.frames.push(record);
        bar.inc(1);
    }
    bar.finish_and_clear();
    Ok(())
}

/// A search by one of the names that the option accepts.
fn search_named(name: &str) -> Box<dyn Search> {
    search_by_name(name).expect("the option accepts the names of the tuner")
}

/// One frame on one line; a star marks a new incumbent.
fn frame_line(record: &FrameRecord) -> String {
    let time = |ms: Option<f64>| ms.map_or_else(|| "-".into(), |ms| format!("{ms:.1}"));
    let config: Vec<String> = record
        .config
        .iter()
        .map(|(name, value)| format!("{name}={value}"))
        .collect();
    let probe = record.probe.as_ref().map_or_else(String::new, |probe| {
        format!(
            "  {} at {:.3} on {:.0} % of the tiles",
            probe.decision,
            probe.ratio,
            100.0 * probe.share
        )
    });
    format!(
        "{:>4}{} build {:>7} render {:>7} cost {:>7} best {:>7} ms  {}{}{probe}",
        record.frame,
        if record.is_incumbent { '*' } else { ' ' },
        time(record.build_ms),
        time(record.render_ms),
        time(record.cost_ms),
        time(record.incumbent_cost_ms),
        config.join(" "),
        record
            .failure
            .as_ref()
            .map_or_else(String::new, |failure| format!("  failed: {failure}")),
    )
}
