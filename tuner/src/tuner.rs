//! The tuner: hands out trials, takes outcomes, keeps the records, drives a search.
//!
//! Ask and tell, as in optuna's `study.ask` and `study.tell`, is the only interface that fits into
//! a loop owned by somebody else, such as a renderer. Between search and user stands the database
//! of canonical configurations: what is known is not measured again.
//!
//! Invariants: everything is a function of the space, the search, the seed, the starts and the
//! sequence of asks and tells; `ask` always returns; a canonical form that failed is not asked
//! again unless nothing else is left to ask.

use std::collections::{BTreeMap, VecDeque};

use crate::record::Database;
use crate::rng::Stream;
use crate::search::Search;
use crate::{Config, Outcome, Reason, Record, Space, TellError, Told, Trial, TrialId};

/// Known proposals in a row that are answered from the database before a random configuration is
/// asked instead: in a flat discrete region a simplex would ask for known points for ever.
const DATABASE_ANSWERS: usize = 3;
/// Random draws for a configuration that is new.
const REPLACEMENT_DRAWS: usize = 64;
/// Spaces up to this size are looked through when no draw was new. A few milliseconds at most.
const EXHAUSTIVE_SIZE: u64 = 4096;

/// Online minimisation of a cost over a [`Space`].
///
/// Any number of trials may be open and told in any order. See the [crate] for an example.
#[derive(Debug)]
pub struct Tuner {
    space: Space,
    search: Box<dyn Search>,
    /// For replacements; the search has its own.
    stream: Stream,
    starts: VecDeque<Config>,
    open: BTreeMap<TrialId, Open>,
    database: Database,
    next_trial: u64,
    next_ticket: u64,
}

#[derive(Debug)]
struct Open {
    config: Config,
    canonical: Config,
    origin: Origin,
}

#[derive(Debug)]
enum Origin {
    Start,
    Proposal { ticket: u64, point: Vec<f64> },
    Tuner,
}

impl Tuner {
    /// A tuner that begins at the search's own first proposal. The same seed gives the same run.
    pub fn new(space: Space, mut search: Box<dyn Search>, seed: u64) -> Tuner {
        let mut stream = Stream::new(seed);
        search.begin(&space.steps(), stream.seed());
        Tuner {
            space,
            search,
            stream,
            starts: VecDeque::new(),
            open: BTreeMap::new(),
            database: Database::default(),
            next_trial: 0,
            next_ticket: 0,
        }
    }

    /// The same tuner with one more known-good configuration. Starts are asked first, in the order
    /// given; the search sees their costs.
    ///
    /// # Panics
    ///
    /// If `config` is not a configuration of the space, see [`Space::check`].
    #[must_use]
    pub fn with_start(mut self, config: Config) -> Tuner {
        self.add_start(config);
        self
    }

    /// One more start, unless its canonical form is one already or was measured.
    ///
    /// # Panics
    ///
    /// As [`with_start`](Tuner::with_start).
    pub fn add_new_start(&mut self, config: Config) {
        let canonical = self.space.canonical(&config);
        let is_start = |start: &Config| self.space.canonical(start) == canonical;
        if self.database.get(&canonical).is_none() && !self.starts.iter().any(is_start) {
            self.add_start(config);
        }
    }

    fn add_start(&mut self, config: Config) {
        if let Err(error) = self.space.check(&config) {
            panic!("not a start of this space: {error}");
        }
        self.starts.push_back(config);
    }

    /// The space that is searched.
    pub fn space(&self) -> &Space {
        &self.space
    }

    /// The next trial: a start, else a proposal of the search, else a random new configuration,
    /// else (nothing new was found) the incumbent once more.
    ///
    /// A form that failed is asked again only if all is exhausted: no incumbent, and 64 random
    /// draws (in spaces of at most 4096 configurations, all of them) hit failed forms only.
    pub fn ask(&mut self) -> Trial {
        while let Some(config) = self.starts.pop_front() {
            let canonical = self.space.canonical(&config);
            if !self.database.has_failed(&canonical) {
                return self.hand_out(config, canonical, Origin::Start, Reason::Start);
            }
        }
        for _ in 0..DATABASE_ANSWERS {
            let ticket = self.next_ticket;
            self.next_ticket += 1;
            let proposal = self.search.propose(ticket);
            let config = self.space.decode(&proposal.point);
            let canonical = self.space.canonical(&config);
            let record = self.database.get(&canonical);
            let measured = record.map_or(0, |record| record.n);
            if let Some(record) = record
                && (record.has_failed() || measured >= proposal.samples)
            {
                let estimate = self.database.estimate(record);
                self.search.observe(Some(ticket), &proposal.point, estimate);
            } else if measured + self.open_trials_of(&canonical) >= proposal.samples {
                // On its way; the search may come back to it.
                self.search.withdraw(ticket);
            } else {
                let origin = Origin::Proposal {
                    ticket,
                    point: proposal.point,
                };
                let reason = Reason::Proposed {
                    search: self.search.name(),
                    step: proposal.step,
                };
                return self.hand_out(config, canonical, origin, reason);
            }
        }
        self.ask_without_search()
    }

    /// A trial of a configuration that the user wants to be measured, once more as a rule.
    ///
    /// # Panics
    ///
    /// If `config` is not a configuration of the space, see [`Space::check`].
    pub fn ask_for(&mut self, config: &Config) -> Trial {
        if let Err(error) = self.space.check(config) {
            panic!("not a configuration of this space: {error}");
        }
        let canonical = self.space.canonical(config);
        self.hand_out(config.clone(), canonical, Origin::Tuner, Reason::Replicate)
    }

    /// By which share of the least cost the last proposal of the search is expected to be better; `None` if
    /// the search has no idea of it, or measures something for another reason.
    pub fn expected_gain(&self) -> Option<f64> {
        self.search.expected_gain()
    }

    /// Whether given starts are left to be asked.
    pub fn has_starts(&self) -> bool {
        !self.starts.is_empty()
    }

    /// Ends a trial. An error leaves the tuner as it was.
    ///
    /// # Errors
    ///
    /// If the trial was never asked or is told already, or if the cost is not finite or negative.
    pub fn tell(&mut self, id: TrialId, outcome: Outcome) -> Result<Told, TellError> {
        if id.0 >= self.next_trial {
            return Err(TellError::UnknownTrial { id });
        }
        if !self.open.contains_key(&id) {
            return Err(TellError::AlreadyTold { id });
        }
        let result = match outcome {
            Outcome::Done { cost } if is_cost(cost) => Some(Ok(cost)),
            Outcome::Done { cost } => return Err(TellError::BadCost { id, cost }),
            Outcome::Failed { reason } => Some(Err(reason)),
            Outcome::Cancelled => None,
        };
        let trial = self.open.remove(&id).expect("checked above");
        let canonical = trial.canonical.clone();
        match result {
            Some(result) => self.record(id, trial, result),
            None => self.cancel(trial),
        }
        let is_incumbent = self
            .incumbent()
            .is_some_and(|best| best.canonical == canonical);
        Ok(Told { is_incumbent })
    }

    /// Ends a trial in whose place another configuration was measured: the nearest one of a recorded
    /// table, say. The record is of that one, and the search sees where it lies.
    ///
    /// # Errors
    ///
    /// As [`Tuner::tell`].
    ///
    /// # Panics
    ///
    /// If `config` is not a configuration of the space, see [`Space::check`].
    pub fn tell_instead(
        &mut self,
        id: TrialId,
        config: &Config,
        outcome: Outcome,
    ) -> Result<Told, TellError> {
        if let Err(error) = self.space.check(config) {
            panic!("not a configuration of this space: {error}");
        }
        let is_usable = match outcome {
            Outcome::Done { cost } => is_cost(cost),
            Outcome::Failed { .. } => true,
            Outcome::Cancelled => false,
        };
        if let Some(open) = self.open.get_mut(&id)
            && is_usable
        {
            open.config = config.clone();
            open.canonical = self.space.canonical(config);
            if let Origin::Proposal { point, .. } = &mut open.origin {
                *point = self.space.encode(config);
            }
        }
        self.tell(id, outcome)
    }

    /// Tells what was measured elsewhere or before: the record counts as one of this run, and the search
    /// sees it. A cancelled outcome changes nothing.
    ///
    /// # Errors
    ///
    /// If the cost is not finite or negative.
    ///
    /// # Panics
    ///
    /// If `config` is not a configuration of the space, see [`Space::check`].
    pub fn tell_known(&mut self, config: &Config, outcome: Outcome) -> Result<Told, TellError> {
        if let Err(error) = self.space.check(config) {
            panic!("not a configuration of this space: {error}");
        }
        let canonical = self.space.canonical(config);
        let trial = self.hand_out(config.clone(), canonical, Origin::Tuner, Reason::Known);
        let told = self.tell(trial.id, outcome);
        if told.is_err() {
            self.open.remove(&trial.id);
        }
        told
    }

    /// The best record by mean cost; of equal ones the older. `None` until a trial is done.
    /// Records with a failure do not count.
    pub fn incumbent(&self) -> Option<&Record> {
        self.database.incumbent()
    }

    /// All canonical configurations with an outcome, in the order they were first told.
    pub fn records(&self) -> &[Record] {
        self.database.records()
    }

    fn record(&mut self, id: TrialId, trial: Open, result: Result<f64, String>) {
        self.database
            .add(id, &trial.config, &trial.canonical, result);
        let record = self.database.get(&trial.canonical).expect("just added");
        let estimate = self.database.estimate(record);
        match trial.origin {
            Origin::Proposal { ticket, point } => {
                self.search.observe(Some(ticket), &point, estimate);
            }
            Origin::Start | Origin::Tuner => {
                let point = self.space.encode(&trial.config);
                self.search.observe(None, &point, estimate);
            }
        }
    }

    fn cancel(&mut self, trial: Open) {
        match trial.origin {
            Origin::Start => self.starts.push_front(trial.config),
            Origin::Proposal { ticket, .. } => self.search.withdraw(ticket),
            Origin::Tuner => {}
        }
    }

    /// Something new by chance, else by looking through a small space, else the best of the known.
    fn ask_without_search(&mut self) -> Trial {
        let mut not_failed = None;
        for _ in 0..REPLACEMENT_DRAWS {
            let point = self.stream.point(self.space.dimensions());
            let config = self.space.decode(&point);
            let canonical = self.space.canonical(&config);
            if self.is_new(&canonical) {
                return self.hand_out(config, canonical, Origin::Tuner, Reason::Replacement);
            }
            if not_failed.is_none() && !self.database.has_failed(&canonical) {
                not_failed = Some(config);
            }
        }
        let count = self.space.count().filter(|&count| count <= EXHAUSTIVE_SIZE);
        for index in 0..count.unwrap_or(0) {
            let config = self.space.nth(index);
            let canonical = self.space.canonical(&config);
            if self.is_new(&canonical) {
                return self.hand_out(config, canonical, Origin::Tuner, Reason::Replacement);
            }
            if not_failed.is_none() && !self.database.has_failed(&canonical) {
                not_failed = Some(config);
            }
        }
        // The incumbent is the cheapest thing to run and the estimate that matters most. Without
        // one: something that is open. Without that: everything failed.
        let config = match (self.database.incumbent(), not_failed) {
            (Some(incumbent), _) => incumbent.config.clone(),
            (None, Some(config)) => config,
            (None, None) => self.database.records()[0].config.clone(),
        };
        let canonical = self.space.canonical(&config);
        self.hand_out(config, canonical, Origin::Tuner, Reason::Replicate)
    }

    fn hand_out(
        &mut self,
        config: Config,
        canonical: Config,
        origin: Origin,
        reason: Reason,
    ) -> Trial {
        let id = TrialId(self.next_trial);
        self.next_trial += 1;
        let open = Open {
            config: config.clone(),
            canonical: canonical.clone(),
            origin,
        };
        self.open.insert(id, open);
        Trial {
            id,
            config,
            canonical,
            reason,
        }
    }

    /// Neither recorded nor on its way.
    fn is_new(&self, canonical: &Config) -> bool {
        self.database.get(canonical).is_none() && self.open_trials_of(canonical) == 0
    }

    fn open_trials_of(&self, canonical: &Config) -> usize {
        self.open
            .values()
            .filter(|open| open.canonical == *canonical)
            .count()
    }
}

/// Whether a number can be a cost.
fn is_cost(cost: f64) -> bool {
    cost.is_finite() && cost >= 0.0
}
