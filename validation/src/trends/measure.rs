//! Measures one sweep of one scene: both engines in turn, value by value, round by round.
//!
//! Values come in a new order in each round, and the engines take turns at being first, so that neither what the
//! machine does meanwhile nor what the caches hold favours one of them. The first round is not counted. Times are those
//! that the process works, where the system tells them (Linux); both engines are to work with one thread.

use std::{cell::RefCell, hint::black_box, time::Duration};

use rand::{SeedableRng, seq::SliceRandom};
use rand_xoshiro::Xoshiro256PlusPlus;
use raywright_bvh::{BuildParams, BuildWorkspace, Bvh, Rounding};

use super::{Quantity, Series, Subject, Sweep, Trend, TrendsError, subject::work_time};
use crate::{
    embree::{BuildArguments, BuildQuality, Device, EmbreeError, SceneSettings},
    golden::Figures,
    tree::Tree,
};

/// What came of a sweep.
#[derive(Clone, Debug)]
pub struct Swept {
    /// One for each quantity that either engine tells.
    pub trends: Vec<Trend>,
    /// What could not be measured, and why.
    pub notes: Vec<String>,
}

/// Sweeps a parameter over a scene, with `rounds` rounds of times.
///
/// # Errors
/// What the engines refuse, but for a value that one of them refuses: this is left out and noted.
pub fn sweep(
    subject: &Subject,
    sweep: &'static Sweep,
    device: &Device,
    rounds: usize,
) -> Result<Swept, TrendsError> {
    let mut notes = Vec::new();
    let mut values = Vec::new();
    for place in 0..sweep.values.len() {
        let mut params = sweep.params(place);
        params.rounding = subject.rounding;
        let value = if sweep.is_flag() {
            Value::of_scenes(place, params)
        } else {
            Value::of_builders(subject, device, place, params)
        };
        match value {
            Ok(value) => values.push(value),
            Err(error @ (TrendsError::Build(_) | TrendsError::Embree(_))) => {
                notes.push(format!("{}: {error}", sweep.values[place]));
            }
            Err(error) => return Err(error),
        }
    }
    for value in values.iter().filter(|value| value.theirs.is_none()) {
        if !sweep.is_flag() {
            let value = sweep.values[value.place];
            notes.push(format!(
                "{value}: Embree's tree could not be made again, so it was not traced"
            ));
        }
    }
    let mut series: Vec<[Series; 2]> = vec![Default::default(); Quantity::ALL.len()];
    let mut random = Xoshiro256PlusPlus::seed_from_u64(1);
    for round in 0..=rounds {
        let mut order: Vec<usize> = (0..values.len()).collect();
        order.shuffle(&mut random);
        let mut rows = vec![[Vec::new(), Vec::new()]; values.len()];
        for index in order {
            let engines = [round % 2, 1 - round % 2];
            for engine in engines {
                rows[index][engine] = values[index].measure(subject, device, engine)?;
            }
        }
        if round > 0 {
            record(&mut series, &values, &rows);
        }
    }
    let trends = Quantity::ALL.into_iter().zip(series);
    // Flags have no counts and costs.
    let trends = trends.filter(|(_, series)| series.iter().any(|series| !series.places.is_empty()));
    let trends = trends.map(|(quantity, mut series)| {
        if !matches!(quantity, Quantity::BuildTime | Quantity::TraceTime) {
            // The same in each round.
            series
                .iter_mut()
                .for_each(|series| series.rounds.truncate(1));
        }
        Trend::new(subject.name(), sweep, quantity, series)
    });
    Ok(Swept {
        trends: trends.collect(),
        notes,
    })
}

/// Adds a round to the series of each quantity.
fn record(series: &mut [[Series; 2]], values: &[Value], rows: &[[Vec<Measured>; 2]]) {
    for (which, quantity) in Quantity::ALL.into_iter().enumerate() {
        for engine in 0..2 {
            let (mut places, mut round) = (Vec::new(), Vec::new());
            for (value, row) in values.iter().zip(rows) {
                let measured = row[engine].iter().find(|measured| measured.0 == quantity);
                if let Some(&(_, amount)) = measured {
                    places.push(value.place);
                    round.push(amount);
                }
            }
            if !places.is_empty() {
                series[which][engine].places = places;
                series[which][engine].rounds.push(round);
            }
        }
    }
}

type Measured = (Quantity, f64);

/// One value of a sweep, ready to be measured again and again.
struct Value {
    place: usize,
    params: BuildParams,
    /// Our tree, and Embree's in our layout.
    ours: Option<Bvh>,
    theirs: Option<Bvh>,
    /// What is the same in each round, of ours and of Embree's.
    fixed: [Vec<Measured>; 2],
    workspace: RefCell<BuildWorkspace>,
}

impl Value {
    fn of_scenes(place: usize, params: BuildParams) -> Result<Self, TrendsError> {
        Ok(Self {
            place,
            params,
            ours: None,
            theirs: None,
            fixed: Default::default(),
            workspace: Default::default(),
        })
    }

    fn of_builders(
        subject: &Subject,
        device: &Device,
        place: usize,
        params: BuildParams,
    ) -> Result<Self, TrendsError> {
        let own_tree = Tree::of(&subject.hierarchy(&params)?);
        let before = device.bytes();
        let arguments = arguments(&params, subject.triangles())?;
        let corners = |reference| subject.set.corners(reference);
        let built = device.build(&subject.primitives, Some(&corners), &arguments)?;
        let memory = device.bytes() - before;
        let tree = built.tree()?;
        drop(built);
        let ours = Bvh::build(&[&subject.mesh], &params)?;
        let theirs = again(subject, &params, &tree)?;
        let of_tree = |tree: &Tree, bytes: usize, traced: Option<&Bvh>| {
            let figures = Figures::of(tree, &subject.bounds, 1);
            let mut fixed = vec![
                (Quantity::TreeNodes, (figures.inner + figures.leaves) as f64),
                (Quantity::Memory, bytes as f64),
            ];
            // A scene without area has no cost.
            if let (Some(nodes), Some(primitives)) = (figures.sah_trav, figures.sah_prim) {
                fixed.push((Quantity::SahCost, nodes + primitives));
            }
            if let Some(traced) = traced {
                let [nodes, blocks] = subject.work(traced);
                fixed.push((Quantity::NodesVisited, nodes));
                fixed.push((Quantity::BlocksTested, blocks));
            }
            fixed
        };
        Ok(Self {
            place,
            params,
            fixed: [
                of_tree(&own_tree, ours.stats().bytes, Some(&ours)),
                of_tree(&tree, memory, theirs.as_ref()),
            ],
            ours: Some(ours),
            theirs,
            workspace: Default::default(),
        })
    }

    fn measure(
        &self,
        subject: &Subject,
        device: &Device,
        engine: usize,
    ) -> Result<Vec<Measured>, TrendsError> {
        let mut measured = self.fixed[engine].clone();
        match (&self.ours, engine) {
            (Some(_), 0) => {
                let start = work_time();
                black_box(subject.hierarchy(&self.params)?);
                measured.push(build_time(start));
            }
            (Some(_), _) => {
                let arguments = arguments(&self.params, subject.triangles())?;
                let corners = |reference| subject.set.corners(reference);
                let start = work_time();
                let built = device.build(&subject.primitives, Some(&corners), &arguments)?;
                measured.push(build_time(start));
                black_box(&built);
            }
            (None, 0) => return self.measure_own_scene(subject),
            (None, _) => return self.measure_embree_scene(subject, device),
        }
        if let Some(tree) = [&self.ours, &self.theirs][engine] {
            let time = subject.trace(|ray| tree.closest_hit(ray).is_some());
            measured.push((Quantity::TraceTime, time));
        }
        Ok(measured)
    }

    fn measure_own_scene(&self, subject: &Subject) -> Result<Vec<Measured>, TrendsError> {
        let mut workspace = self.workspace.borrow_mut();
        let start = work_time();
        let tree = Bvh::build_in(&[&subject.mesh], &self.params, &mut workspace)?;
        let mut measured = vec![build_time(start)];
        let time = subject.trace(|ray| tree.closest_hit(ray).is_some());
        measured.push((Quantity::TraceTime, time));
        let bytes = tree.stats().bytes + workspace.bytes();
        measured.push((Quantity::Memory, bytes as f64));
        tree.recycle(&mut workspace);
        Ok(measured)
    }

    fn measure_embree_scene(
        &self,
        subject: &Subject,
        device: &Device,
    ) -> Result<Vec<Measured>, TrendsError> {
        let settings = SceneSettings {
            dynamics: self.params.dynamics,
            leaf_format: self.params.leaf_format,
            accuracy: self.params.accuracy,
            ..SceneSettings::of_quality(BuildQuality::Medium)
        };
        let prepared = device.scene(&[&subject.mesh], &settings)?;
        let before = device.bytes();
        let start = work_time();
        let scene = prepared.commit()?;
        let mut measured = vec![build_time(start)];
        let memory = device.bytes().saturating_sub(before);
        measured.push((Quantity::Memory, memory as f64));
        let time = subject.trace(|ray| scene.closest_hit(ray).is_some());
        measured.push((Quantity::TraceTime, time));
        Ok(measured)
    }
}

fn build_time(start: Duration) -> Measured {
    let time = work_time().saturating_sub(start);
    (Quantity::BuildTime, 1e3 * time.as_secs_f64())
}

fn arguments(params: &BuildParams, count: usize) -> Result<BuildArguments, TrendsError> {
    let why = "a quality that Embree does not have";
    Ok(BuildArguments::of(params, count).ok_or(EmbreeError::Crashes { why })?)
}

/// Embree's tree in our layout, if our builder makes the same tree to the last bit.
fn again(subject: &Subject, params: &BuildParams, tree: &Tree) -> Result<Option<Bvh>, TrendsError> {
    let mut params = *params;
    params.rounding = Rounding::Embree;
    if Tree::of(&subject.hierarchy(&params)?) != *tree {
        return Ok(None);
    }
    // Of scaled coordinates: the scale is a power of two, which changes no bit but beyond the range of f32.
    let again = Bvh::build(&[&subject.mesh], &params)?;
    let (stats, figures) = (again.stats(), Figures::of(tree, &subject.bounds, 1));
    let near = |a: f64, b: Option<f64>| b.is_none_or(|b| (a - b).abs() <= 1e-6 * b);
    let is_same = (stats.nodes, stats.leaves, stats.references)
        == (figures.inner, figures.leaves, figures.refs)
        && near(stats.sah_nodes, figures.sah_trav)
        && near(stats.sah_primitives, figures.sah_prim);
    Ok(is_same.then_some(again))
}
