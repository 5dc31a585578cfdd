//! Whether what was found still holds, and what is done if not.
//!
//! The frames of the incumbent are watched; on an alarm the second best is tried once. If its cost over that of
//! the incumbent is what it was, the machine has changed and nothing else; if not, the search begins again.
//!
//! Invariant: what was told is not forgotten without being asked again: the best are starts of the next search.

use raywright_imaging::Camera;
use raywright_tracer::World;
use raywright_tuner::{ChangeDetector, Config, Outcome, Tuner};

use super::{FRESH, Hybrid, Incumbent, LEAST_NOISE, Probed};
use crate::tune::{
    probe::INTERRUPTED,
    stage::{Clock, SessionError},
};

/// A change of the ratio of two trees below this is none, as a logarithm.
const SAME: f64 = 0.05;

/// Outcomes that are told again when the search begins again: the best.
const KEPT: usize = 3;

impl<'a, C: Clock> Hybrid<'a, C> {
    /// Looks whether frames take what they took: `times` of tiles with the incumbent.
    pub(super) fn watch(&mut self, times: &[(usize, f64)]) {
        let factor = self.learn_tiles(times, FRESH);
        if self.detector.add(factor.ln()) && !self.is_searching {
            self.check = self.yardstick();
        }
    }

    /// Learns what tiles are expected to take, `weight` of it from these times; what they took over what was expected.
    ///
    /// Tiles that are not among them follow by that factor: else those of which much is known would differ from the
    /// others by what the machine does, and a candidate that is tried on either would seem better or worse.
    pub(super) fn learn_tiles(&mut self, times: &[(usize, f64)], weight: f64) -> f64 {
        let took: f64 = times.iter().map(|(_, time)| time).sum();
        let expected: f64 = times.iter().map(|&(tile, _)| self.tiles[tile]).sum();
        let factor = took / expected;
        if !(factor > 0.0 && factor.is_finite()) {
            return factor;
        }
        let mut is_known = vec![false; self.tiles.len()];
        for &(tile, time) in times {
            is_known[tile] = true;
            let own = &mut self.tiles[tile];
            let most = INTERRUPTED * factor * *own;
            *own += weight * (time.min(most) - *own);
        }
        let follow = 1.0 + weight * (factor - 1.0);
        for (own, _) in self
            .tiles
            .iter_mut()
            .zip(is_known)
            .filter(|(_, known)| !known)
        {
            *own *= follow;
        }
        factor
    }

    /// The best of what is not the incumbent.
    fn yardstick(&self) -> Option<(Config, f64)> {
        let incumbent = self.incumbent.as_ref()?;
        let records = self.tuner.records().iter();
        let others = records
            .filter(|record| record.canonical != incumbent.config && record.cost.is_finite());
        let best = others.min_by(|a, b| a.cost.total_cmp(&b.cost))?;
        let log = (best.cost / self.unit).ln() - incumbent.log_cost();
        Some((best.config.clone(), log))
    }

    /// After a probe of what is known: the search begins again if its cost over that of the incumbent is not
    /// what it was.
    pub(super) fn checked(&mut self, incumbent: &mut Incumbent, probed: &Probed, known: f64) {
        let now = (probed.cost / self.unit).ln() - incumbent.log_cost();
        if (now - known).abs() > SAME.max(2.0 * probed.ratio.deviation) {
            self.begin_again(incumbent);
        }
    }

    /// Searches once more, beginning with what was best.
    pub(super) fn begin_again(&mut self, incumbent: &mut Incumbent) {
        let mut records: Vec<_> = self.tuner.records().to_vec();
        records.sort_by(|a, b| a.cost.total_cmp(&b.cost));
        let best = records.into_iter().filter(|record| !record.has_failed());
        let mut starts: Vec<Config> = best.take(KEPT).map(|record| record.config).collect();
        let portfolio = self.starts.iter();
        starts.extend(portfolio.filter_map(|params| self.space.config(params).ok()));
        self.begun += 1;
        let seed = self.stage.settings.seed.wrapping_add(self.begun);
        self.tuner = Tuner::new(self.space.space().clone(), (self.search.0)(), seed);
        let cost = self.unit * incumbent.log_cost().exp();
        let config = self.space.config(&incumbent.params);
        if let Ok(config) = config {
            // A cost that was told before can be told again.
            let _ = self.tuner.tell_known(&config, Outcome::Done { cost });
        }
        for config in starts {
            self.tuner.add_new_start(config);
        }
        self.probed.clear();
        (self.quiet, self.fruitless) = (0, 0);
        self.waiting = None;
        if let Some(background) = &mut self.background {
            background.give_up();
        }
        incumbent.begin_again();
        self.budget.begin();
        self.is_searching = true;
    }

    /// Renders another scene, or from another camera, from the next frame on; both to be those that
    /// differ from before in what concerns trees. The incumbent's parameters stay, its tree is built anew, and
    /// the search begins again.
    ///
    /// # Errors
    /// If the camera cannot be used, or the incumbent's parameters do not suit the scene.
    pub fn change_scene(&mut self, world: &'a World, camera: Camera) -> Result<(), SessionError> {
        camera.validate().map_err(SessionError::Camera)?;
        self.stage.show(world, camera);
        if let Some(mut incumbent) = self.incumbent.take() {
            let built = self.stage.build(&incumbent.params);
            let (tree, time) = built.map_err(SessionError::Build)?;
            self.stage
                .recycle(incumbent.moved(tree, time.as_secs_f64()));
            self.begin_again(&mut incumbent);
            self.detector = ChangeDetector::new(LEAST_NOISE);
            self.incumbent = Some(incumbent);
        }
        Ok(())
    }
}
