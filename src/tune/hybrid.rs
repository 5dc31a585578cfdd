//! The tuner that never costs a frame: candidates are tried on some tiles, the incumbent keeps the rest.
//!
//! The first frame is rendered with given parameters, the strong default as a rule. Then each frame with a
//! candidate is a [probe](super::probe): build it, trace a few tiles of the frame through it, go on for as long
//! as nothing can be said, and finish the frame with the better tree. Starts come first (known-good
//! parameters, what earlier runs left), then what a search proposes; what is best by the search's own account
//! but not shown to be is tried once more, and what was measured of it is put together. A run stops trying
//! when nothing is promised or nothing was found for long; from then on the incumbent is watched, and when its
//! frames take longer or shorter than they did, one probe of the second best tells a change of the scene from
//! a change of the machine: only in the one the ratio of the two changes, and the search begins again.
//!
//! Trials take at most a given share of all time, and half of what they saved: what would be one too many waits
//! for frames of the incumbent, see [`budget`].
//!
//! Costs that the search sees are ratios of paired tiles, chained from incumbent to incumbent, times what the
//! first frame cost: the drift of a machine is in none of them.
//!
//! Invariants: every frame adds one sample to every pixel, whatever was tried; the picture depends on seed
//! and number of frames alone. A candidate that cannot be built or is hopeless costs its build and 1/32 of
//! the tiles. Nothing here reads a clock but the stage's.

mod background;
mod budget;
mod change;
mod frame;
mod incumbent;
mod report;
mod trial;

use std::{collections::HashMap, fmt, thread::Scope, time::Duration};

use raywright_bvh::BuildParams;
use raywright_imaging::{Camera, CancelToken, Film};
use raywright_tracer::World;
use raywright_tuner::{ChangeDetector, Config, Outcome, Reason, Search, Trial, Tuner};

use super::{
    comparison::Comparison,
    probe::{INTERRUPTED, ProbeRatio},
    space::ParameterSpace,
    stage::{Clock, SessionError, Settings, Stage, add_frame},
};
use background::{Background, Built};
use budget::Budget;
use frame::Frame;
use incumbent::Incumbent;
pub use report::{Candidate, HybridFrame, Probed};

/// Gain that is not worth a trial, as a share of the cost; and proposals in a row that promise less.
const LEAST_GAIN: f64 = 0.005;
const QUIET_PROPOSALS: u32 = 5;

/// The most that trials take of all time beyond half of what they save, as a share, if nothing else is said.
pub const DEFAULT_OVERHEAD: f64 = 0.02;

/// New candidates in a row without a new incumbent after which nothing more is tried.
const PATIENCE: u32 = 12;

/// Probes of a candidate that could not be told from the incumbent.
const MOST_PROBES: u32 = 3;

/// Weight of the last frame in what a tile is expected to take.
const FRESH: f64 = 0.2;

/// Standard deviation of the logarithm of the time of a frame that is taken for noise at least.
const LEAST_NOISE: f64 = 0.01;

/// Makes searches that have not begun.
struct MakeSearch(Box<dyn Fn() -> Box<dyn Search> + Send + Sync>);

impl fmt::Debug for MakeSearch {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str((self.0)().name())
    }
}

/// A tuning run whose candidates are tried on tiles.
#[derive(Debug)]
pub struct Hybrid<'a, C> {
    stage: Stage<'a, C>,
    space: ParameterSpace,
    search: MakeSearch,
    tuner: Tuner,
    first: BuildParams,
    starts: Vec<BuildParams>,
    /// What earlier runs left, until the first frame tells how fast the machine is.
    known: Vec<(Config, Outcome)>,
    film: Film,
    /// For the samples of the next frame.
    spare: Option<Film>,
    finished: u32,
    incumbent: Option<Incumbent>,
    /// Seconds that a thread is expected to work for each tile with the incumbent.
    tiles: Vec<f64>,
    /// Seconds of a frame for each second that its threads work.
    wall_per_work: f64,
    /// Seconds that the first frame cost.
    unit: f64,
    /// What is known of candidates beside this incumbent, and by how many probes.
    probed: HashMap<Config, (ProbeRatio, u32)>,
    quiet: u32,
    fruitless: u32,
    is_searching: bool,
    /// Whether nothing is ever tried.
    is_frozen: bool,
    detector: ChangeDetector,
    /// What is to be tried to see whether something has changed, and the logarithm of what its cost was over
    /// that of the incumbent.
    check: Option<(Config, f64)>,
    begun: u64,
    /// What trials may take.
    budget: Budget,
    /// A trial that waits for time.
    waiting: Option<Trial>,
    /// Where candidates are built if frames are not to wait for it.
    background: Option<Background<'a>>,
}

/// What is done for a trial in a frame.
enum Step {
    /// It is tried: with a tree that is ready, or one that is to be built.
    Try(Trial, Option<Box<Built>>),
    /// Its tree is begun beside the frame.
    Begin(Trial, BuildParams),
}

impl<'a, C: Clock> Hybrid<'a, C> {
    /// A run that has not begun; its first frame is rendered with `first`, and `search` proposes what is
    /// tried after the starts.
    ///
    /// # Errors
    /// If camera, picture size or instruction set cannot be used.
    pub fn new(
        world: &'a World,
        camera: Camera,
        settings: Settings,
        space: ParameterSpace,
        first: &BuildParams,
        search: impl Fn() -> Box<dyn Search> + Send + Sync + 'static,
        clock: C,
    ) -> Result<Self, SessionError> {
        let stage = Stage::new(world, camera, settings, clock)?;
        let film = stage.film()?;
        let tuner = Tuner::new(space.space().clone(), search(), settings.seed);
        Ok(Self {
            tiles: Vec::new(),
            wall_per_work: 1.0,
            stage,
            space,
            search: MakeSearch(Box::new(search)),
            tuner,
            first: *first,
            starts: Vec::new(),
            known: Vec::new(),
            film,
            spare: None,
            finished: 0,
            incumbent: None,
            unit: 0.0,
            probed: HashMap::new(),
            quiet: 0,
            fruitless: 0,
            is_searching: true,
            is_frozen: false,
            detector: ChangeDetector::new(LEAST_NOISE),
            check: None,
            begun: 0,
            budget: Budget::new(DEFAULT_OVERHEAD),
            waiting: None,
            background: None,
        })
    }

    /// The same run, in which nothing is tried: all frames with the first parameters, and no clock is read for a
    /// tile.
    #[must_use]
    pub fn frozen(mut self) -> Self {
        (self.is_searching, self.is_frozen) = (false, true);
        self
    }

    /// The same run, in which trials (builds and slower tiles) take at most this share of all time so far, or of
    /// 120 frames if there were fewer, and half of what better trees saved; a trial that would be one too many
    /// waits. [`DEFAULT_OVERHEAD`] otherwise; 0: nothing is tried; infinite: nothing waits.
    #[must_use]
    pub fn with_overhead_limit(mut self, share: f64) -> Self {
        self.budget.share = share;
        self
    }

    /// The same run, in which no frame waits for the tree of a candidate: a thread of `scope` builds it beside
    /// the frames of the incumbent and yields to them. What is told of such a build is the time that the thread
    /// has worked. Only where trees serve any number of frames ([`Metric::Render`](super::Metric::Render)):
    /// where frames bear a share of their build, nothing is built in the background.
    ///
    /// The run has to begin within the scope: see the example `08_tune_while_rendering`.
    #[must_use]
    pub fn with_background_builds<'env: 'a>(mut self, scope: &'a Scope<'a, 'env>) -> Self
    where
        C: Clone + Send + 'a,
    {
        let is_free = self.stage.settings.metric.build_share() == 0.0;
        self.background = is_free.then(|| Background::new(scope, self.stage.clock()));
        self
    }

    /// The same run with parameters that are tried before the search proposes any, in this order. Values
    /// that the space does not have are moved to the nearest, but a tree of another quality or width is
    /// another tree: it is left out.
    #[must_use]
    pub fn with_starts(mut self, starts: &[BuildParams]) -> Self {
        let kind = |params: &BuildParams| (params.quality, params.branching_factor);
        let is_held = |start: &&BuildParams| {
            // What cannot be built is an error of the first frame.
            self.space
                .config(start)
                .map_or(true, |held| kind(&self.space.params(&held)) == kind(start))
        };
        self.starts = starts.iter().filter(is_held).copied().collect();
        self
    }

    /// The same run, in which some outcomes are known, with costs in seconds by the metric. If those of the
    /// first parameters are among them, all are scaled by what the first frame costs now.
    #[must_use]
    pub fn with_known(mut self, known: impl IntoIterator<Item = (Config, Outcome)>) -> Self {
        self.known.extend(known);
        self
    }

    /// Renders the next frame; `None` if `cancel` was set before it was done.
    ///
    /// # Errors
    /// If the first parameters cannot be built, or the tuner refuses a measurement.
    pub fn frame(&mut self, cancel: &CancelToken) -> Result<Option<HybridFrame>, SessionError> {
        self.frame_told(cancel, |_| ())
    }

    /// The same; `begins` hears of a trial before it is built.
    ///
    /// # Errors
    /// As [`frame`](Self::frame).
    pub fn frame_told(
        &mut self,
        cancel: &CancelToken,
        begins: impl FnOnce(&Trial),
    ) -> Result<Option<HybridFrame>, SessionError> {
        let mut start = self.stage.now();
        // Memory that is new costs more than a sample of each pixel.
        let film = self.spare.take().map_or_else(|| self.stage.film(), Ok)?;
        let mut frame = Frame::new(film, self.stage.tiles(), self.finished, cancel);
        let Some(mut incumbent) = self.incumbent.take() else {
            return self.first_frame(frame, start, begins);
        };
        let usual = self.render_time();
        let built = self.rebuild(&mut incumbent);
        let rebuild = built.as_ref().map_or(0.0, Duration::as_secs_f64);
        let step = built.and_then(|build| Ok((build, self.next_step(&incumbent)?)));
        let is_beside = self.is_building() || matches!(step, Ok((_, Some(Step::Begin(..)))));
        let tried = step.and_then(|(build, step)| {
            let (trial, ready) = match step {
                Some(Step::Try(trial, None)) => {
                    start += self.time_of(|| begins(&trial));
                    (Some(trial), None)
                }
                Some(Step::Try(trial, ready)) => (Some(trial), ready.map(|built| *built)),
                Some(Step::Begin(trial, params)) => {
                    start += self.time_of(|| begins(&trial));
                    self.begin_beside(trial, params);
                    (None, None)
                }
                None => (None, None),
            };
            let Some(trial) = trial else {
                self.trace_rest(&mut frame, &incumbent.tree)?;
                return Ok(frame.is_done().then_some((None, build)));
            };
            let tried = self.try_candidate(&mut frame, &mut incumbent, &trial, ready)?;
            Ok(tried.map(|(candidate, own)| (Some(candidate), build + own)))
        });
        let params = incumbent.params;
        self.incumbent = Some(incumbent);
        let Some((candidate, build)) = tried? else {
            return Ok(None);
        };
        let render = (self.stage.now() - start).saturating_sub(build);
        if self.is_frozen {
            self.learn_whole(render);
        } else if !is_beside {
            // Frames beside which something is built tell nothing of the others.
            self.learn_sharing(render, frame.work, candidate.is_some());
            self.watch(&frame.times);
        }
        add_frame(&mut self.film, &frame.film);
        self.spare = Some(frame.film);
        self.finished += 1;
        let time = self.stage.now() - start;
        let lost = if candidate.is_some() || is_beside {
            (time.as_secs_f64() - rebuild - usual).max(0.0)
        } else {
            0.0
        };
        let usual = self.incumbent_cost().unwrap_or(0.0);
        let saved = self.saved_by_frame();
        self.budget
            .add_frame(time.as_secs_f64(), usual, lost, saved);
        Ok(Some(HybridFrame {
            candidate,
            time,
            build,
            incumbent: params,
            incumbent_cost: self.incumbent_cost().unwrap_or(0.0),
        }))
    }

    /// All tiles with the first parameters.
    fn first_frame(
        &mut self,
        mut frame: Frame<'_>,
        mut start: Duration,
        begins: impl FnOnce(&Trial),
    ) -> Result<Option<HybridFrame>, SessionError> {
        let config = self.config(&self.first)?;
        let starts = self.starts.iter().map(|params| self.config(params));
        let starts: Vec<Config> = starts.collect::<Result<_, _>>()?;
        let trial = self.tuner.ask_for(&config);
        start += self.time_of(|| begins(&trial));
        let (mut tree, mut build) = self.stage.build(&self.first).map_err(SessionError::Build)?;
        if !self.is_frozen && self.background.is_none() {
            // The first to touch its memory takes up to four times as long as those after it, which tells
            // nothing of what others will take.
            self.stage.recycle(tree);
            (tree, build) = self.stage.build(&self.first).map_err(SessionError::Build)?;
        }
        self.trace_rest(&mut frame, &tree)?;
        if !frame.is_done() {
            self.stage.recycle(tree);
            self.tell(&trial, Outcome::Cancelled)?;
            return Ok(None);
        }
        self.tiles = vec![0.0; self.stage.tiles()];
        for &(tile, time) in &frame.times {
            self.tiles[tile] = time;
        }
        let render = (self.stage.now() - start).saturating_sub(build);
        if self.is_frozen {
            self.learn_whole(render);
        } else {
            let share = render.as_secs_f64() / frame.work;
            if share > 0.0 && share.is_finite() {
                self.wall_per_work = share;
            }
        }
        let config = trial.canonical.clone();
        let incumbent = Incumbent::first(config, self.first, tree, build.as_secs_f64());
        self.incumbent = Some(incumbent);
        self.unit = self.incumbent_cost().unwrap_or(0.0);
        self.tell(&trial, Outcome::Done { cost: self.unit })?;
        self.tell_known(&trial.canonical)?;
        for config in starts {
            self.tuner.add_new_start(config);
        }
        add_frame(&mut self.film, &frame.film);
        self.spare = Some(frame.film);
        self.finished += 1;
        let time = self.stage.now() - start;
        self.budget.begin();
        self.budget
            .add_frame(time.as_secs_f64(), self.unit, 0.0, 0.0);
        Ok(Some(HybridFrame {
            candidate: None,
            time,
            build,
            incumbent: self.first,
            incumbent_cost: self.unit,
        }))
    }

    /// How long something takes that is no part of a frame: a log that is written, say.
    fn time_of(&self, run: impl FnOnce()) -> Duration {
        let begun = self.stage.now();
        run();
        self.stage.now() - begun
    }

    /// The configuration of some parameters.
    fn config(&self, params: &BuildParams) -> Result<Config, SessionError> {
        self.space.config(params).map_err(SessionError::Space)
    }

    /// Tells the tuner what earlier runs left, at the speed that the machine has now.
    fn tell_known(&mut self, first: &Config) -> Result<(), SessionError> {
        let known = std::mem::take(&mut self.known);
        let same: Vec<f64> = known
            .iter()
            .filter(|(config, _)| self.space.space().canonical(config) == *first)
            .filter_map(|(_, outcome)| match outcome {
                Outcome::Done { cost } => Some(*cost),
                _ => None,
            })
            .collect();
        let mean = same.iter().sum::<f64>() / same.len() as f64;
        let scale = if mean > 0.0 { self.unit / mean } else { 1.0 };
        for (config, outcome) in known {
            let outcome = match outcome {
                Outcome::Done { cost } => Outcome::Done { cost: cost * scale },
                other => other,
            };
            self.tuner
                .tell_known(&config, outcome)
                .map_err(SessionError::Tell)?;
        }
        Ok(())
    }

    /// Builds the tree of the incumbent anew if its time has come.
    fn rebuild(&mut self, incumbent: &mut Incumbent) -> Result<Duration, SessionError> {
        let per_tree = self.stage.settings.metric.frames_per_tree();
        let is_due = per_tree.is_some_and(|frames| self.finished.is_multiple_of(frames.get()));
        if !is_due {
            return Ok(Duration::ZERO);
        }
        let built = self.stage.build(&incumbent.params);
        let (tree, time) = built.map_err(SessionError::Build)?;
        self.stage
            .recycle(incumbent.rebuilt(tree, time.as_secs_f64()));
        Ok(time)
    }

    /// What is done for trials in the next frame: what is wished, unless it is too dear yet.
    fn next_step(&mut self, incumbent: &Incumbent) -> Result<Option<Step>, SessionError> {
        if self.is_frozen {
            return Ok(None);
        }
        // A check goes first, and what is built or waits is taken for nothing else.
        if let Some((config, _)) = &self.check {
            let canonical = self.space.space().canonical(config);
            let building = self.background.as_mut();
            let other = building.filter(|own| {
                own.trial()
                    .is_some_and(|trial| trial.canonical != canonical)
            });
            let given_up = other.and_then(Background::give_up);
            for trial in given_up.into_iter().chain(self.waiting.take()) {
                self.tell(&trial, Outcome::Cancelled)?;
            }
        }
        if let Some(background) = self.background.as_mut().filter(|own| own.is_building()) {
            let finished = background.finished();
            return Ok(finished.map(|(trial, built)| Step::Try(trial, Some(Box::new(built)))));
        }
        let trial = match self.waiting.take() {
            Some(trial) => trial,
            None => match self.wished_trial(incumbent)? {
                Some(trial) => trial,
                None => return Ok(None),
            },
        };
        let params = self.space.params(&trial.config);
        let (own, build) = (incumbent.params.quality, incumbent.build());
        let expected = self.budget.expected_build(params.quality, own, build);
        if !self.budget.allows(expected, trial.reason == Reason::Start) {
            self.waiting = Some(trial);
            return Ok(None);
        }
        // The incumbent beside itself needs no tree.
        let is_own = trial.canonical == incumbent.config;
        Ok(Some(if self.background.is_some() && !is_own {
            Step::Begin(trial, params)
        } else {
            Step::Try(trial, None)
        }))
    }

    /// Whether a tree is being built beside the frames.
    fn is_building(&self) -> bool {
        self.background
            .as_ref()
            .is_some_and(Background::is_building)
    }

    /// Begins the tree of a trial beside the frames.
    fn begin_beside(&mut self, trial: Trial, params: BuildParams) {
        let world = self.stage.world();
        if let Some(background) = &mut self.background {
            background.begin(world, params, trial);
        }
    }

    /// What would be tried next if it cost nothing.
    fn wished_trial(&mut self, incumbent: &Incumbent) -> Result<Option<Trial>, SessionError> {
        if let Some((config, _)) = &self.check {
            return Ok(Some(self.tuner.ask_for(config)));
        }
        if let Some(config) = self.rival(incumbent) {
            return Ok(Some(self.tuner.ask_for(&config)));
        }
        if !self.is_searching {
            return Ok(None);
        }
        let trial = self.tuner.ask();
        match self.tuner.expected_gain() {
            Some(gain) if gain < LEAST_GAIN => self.quiet += 1,
            Some(_) => self.quiet = 0,
            None => {}
        }
        let has_starts = self.tuner.has_starts();
        let is_hopeless = self.quiet >= QUIET_PROPOSALS || self.fruitless >= PATIENCE;
        if is_hopeless && !has_starts {
            self.is_searching = false;
            self.tell(&trial, Outcome::Cancelled)?;
            return Ok(None);
        }
        Ok(Some(trial))
    }

    /// What is the best by the account of the search, and neither the incumbent nor known to be no better.
    fn rival(&self, incumbent: &Incumbent) -> Option<Config> {
        let best = self.tuner.incumbent()?;
        let probes = self.probed.get(&best.canonical).map_or(0, |known| known.1);
        let is_rival = best.canonical != incumbent.config && probes < MOST_PROBES;
        (is_rival && best.cost < self.unit * incumbent.log_cost().exp())
            .then(|| best.config.clone())
    }

    /// Tells the tuner an outcome.
    fn tell(&mut self, trial: &Trial, outcome: Outcome) -> Result<(), SessionError> {
        let told = self.tuner.tell(trial.id, outcome);
        told.map(|_| ()).map_err(SessionError::Tell)
    }

    /// Renders from another place of the same scene from the next frame on. The picture begins anew. Whether
    /// the place asks for another tree is noticed by the times of frames.
    ///
    /// # Errors
    /// If the camera cannot be used.
    pub fn move_camera(&mut self, camera: Camera) -> Result<(), SessionError> {
        camera.validate().map_err(SessionError::Camera)?;
        self.stage.camera = camera;
        self.film = self.stage.film()?;
        Ok(())
    }

    /// Measures `tuned` beside both baselines; as [`Session::compare`](super::Session::compare).
    ///
    /// # Errors
    /// If a baseline cannot be built or the camera cannot be used.
    pub fn compare(
        &mut self,
        tuned: &BuildParams,
        rounds: usize,
        cancel: &CancelToken,
        progress: impl Fn(usize, usize),
    ) -> Result<Comparison, SessionError> {
        self.stage.compare(tuned, rounds, cancel, progress)
    }

    /// The parameters that frames are rendered with; `None` before the first frame.
    #[must_use]
    pub fn incumbent(&self) -> Option<BuildParams> {
        self.incumbent.as_ref().map(|incumbent| incumbent.params)
    }

    /// What a frame with the incumbent costs by the metric, in seconds, as its tiles took lately.
    #[must_use]
    pub fn incumbent_cost(&self) -> Option<f64> {
        let incumbent = self.incumbent.as_ref()?;
        let metric = self.stage.settings.metric;
        Some(metric.cost(incumbent.build(), self.render_time()))
    }

    /// Seconds by which a frame surely costs less than with the first incumbent of this search.
    fn saved_by_frame(&self) -> f64 {
        let incumbent = self.incumbent.as_ref();
        let log_cost = incumbent.map_or(0.0, Incumbent::sure_log_cost);
        self.incumbent_cost().unwrap_or(0.0) * (-log_cost).exp_m1()
    }

    /// Seconds that a frame is expected to take to render with the incumbent.
    fn render_time(&self) -> f64 {
        self.wall_per_work * self.tiles.iter().sum::<f64>()
    }

    /// Learns from a frame how well threads share its work. In the parts of a probe they wait for each other, so that a
    /// frame with a candidate says at most that they share it better; and so it is with a frame that was interrupted.
    fn learn_sharing(&mut self, render: Duration, work: f64, has_candidate: bool) {
        let share = render.as_secs_f64() / work;
        if share > 0.0 && share < self.wall_per_work {
            self.wall_per_work = share;
        } else if share < INTERRUPTED * self.wall_per_work && !has_candidate {
            self.wall_per_work += FRESH * (share - self.wall_per_work);
        }
    }

    /// Learns from a frame whose tiles were not timed.
    fn learn_whole(&mut self, render: Duration) {
        let share = render.as_secs_f64() / self.tiles.len() as f64;
        self.tiles.fill(share);
    }

    /// Whether something is still tried.
    #[must_use]
    pub fn is_searching(&self) -> bool {
        self.is_searching
    }

    /// The space that is searched.
    #[must_use]
    pub fn space(&self) -> &ParameterSpace {
        &self.space
    }

    /// The picture so far: one sample per pixel for every finished frame.
    #[must_use]
    pub fn film(&self) -> &Film {
        &self.film
    }
}

#[cfg(test)]
mod tests;
