//! The predictors that are compared, and what each answers in a state that it was not told of.

use std::error::Error;

use raywright_benches::recordings::{Metric, SpaceKind};
use raywright_tuner::predict::{
    Features, Kernel, LeastSquares, NearestNeighbour, Portfolio, Predictor, RadialBasis,
    RadialSettings, Reward, Scaling, StepSize, Terms, greedy_members,
};

use crate::recorded::{Case, Table};

/// A way to a configuration without a search.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Method {
    /// A named row, whatever the state.
    Fixed(&'static str),
    Nearest(Scaling),
    Radial(RadialSettings),
    LeastSquares(Terms),
    /// Of so many members the best of the nearest state.
    PortfolioUnmeasured(usize),
    /// So many members, each measured for a frame.
    PortfolioMeasured(usize),
    /// What the nearest neighbour and least squares say, and a portfolio of so many members; all measured.
    ShortlistMeasured(usize),
}

/// What came out in a state.
#[derive(Clone, Debug)]
pub(crate) struct Answer {
    /// Cost of each frame before the choice.
    pub(crate) probes: Vec<f64>,
    /// Cost of the frames after it.
    pub(crate) kept: f64,
}

const GAUSSIAN: Kernel = Kernel::Gaussian;

pub(crate) fn methods() -> Vec<(&'static str, SpaceKind, Method)> {
    use SpaceKind::{Canonical, Printed};
    let printed = RadialSettings::printed();
    let rescaled = RadialSettings::rescaled();
    let slow = printed.with_step(StepSize::Fixed(0.01));
    let gaussian = Terms::Radial {
        kernel: GAUSSIAN,
        seed: 0,
    };
    vec![
        ("weak default", Printed, Method::Fixed("weak2")),
        ("strong default", Printed, Method::Fixed("strong8")),
        (
            "nearest, raw features",
            Printed,
            Method::Nearest(Scaling::Raw),
        ),
        (
            "nearest, as printed",
            Printed,
            Method::Nearest(Scaling::Printed),
        ),
        (
            "nearest, rescaled",
            Canonical,
            Method::Nearest(Scaling::Rescaled),
        ),
        (
            "radial, as printed, alpha 0.01",
            Printed,
            Method::Radial(slow),
        ),
        (
            "radial, as printed, alpha 0.1",
            Printed,
            Method::Radial(printed),
        ),
        ("radial, log-ratio", Canonical, Method::Radial(rescaled)),
        (
            "radial, log-ratio, Gaussian",
            Canonical,
            Method::Radial(rescaled.with_kernel(GAUSSIAN)),
        ),
        (
            "least squares, Gaussian",
            Canonical,
            Method::LeastSquares(gaussian),
        ),
        (
            "least squares, quadratic",
            Canonical,
            Method::LeastSquares(Terms::Quadratic),
        ),
        (
            "portfolio of 5, nearest state's best",
            Canonical,
            Method::PortfolioUnmeasured(5),
        ),
        (
            "portfolio of 3, measured",
            Canonical,
            Method::PortfolioMeasured(3),
        ),
        (
            "portfolio of 5, measured",
            Canonical,
            Method::PortfolioMeasured(5),
        ),
        (
            "nearest + least squares, measured",
            Canonical,
            Method::ShortlistMeasured(0),
        ),
        (
            "nearest + least squares + 3, measured",
            Canonical,
            Method::ShortlistMeasured(3),
        ),
        (
            "nearest + least squares + 5, measured",
            Canonical,
            Method::ShortlistMeasured(5),
        ),
    ]
}

/// λ of least squares: little beside hundreds of samples.
const RIDGE: f64 = 0.1;

impl Method {
    pub(crate) fn is_fixed(self) -> bool {
        matches!(self, Method::Fixed(_))
    }

    /// Learns from some cases and answers in another, of which the recorded rows alone are looked at, and
    /// those only where they are asked for.
    pub(crate) fn answer(
        self,
        features: &Features,
        known: &[(&Case, &Table)],
        asked: (&Case, &Table),
        metric: Metric,
        seed: u64,
    ) -> Result<Answer, Box<dyn Error>> {
        let (case, table) = asked;
        let state = &case.state.features;
        let axes = table.points[0].len();
        match self {
            Method::Fixed(name) => {
                let kept = case.problem.named(name, metric);
                Ok(Answer {
                    probes: Vec::new(),
                    kept: kept.ok_or_else(|| format!("no row {name}"))?,
                })
            }
            Method::Nearest(scaling) => {
                let model = NearestNeighbour::new(features.clone(), axes, scaling);
                predicted(Box::new(model), false, known, asked, metric)
            }
            Method::Radial(settings) => {
                let model = RadialBasis::new(features.clone(), axes, settings, seed)?;
                let in_seconds = settings.reward == Reward::Inverse;
                predicted(Box::new(model), in_seconds, known, asked, metric)
            }
            Method::LeastSquares(terms) => {
                let terms = match terms {
                    Terms::Radial { kernel, .. } => Terms::Radial { kernel, seed },
                    Terms::Quadratic => terms,
                };
                let model = LeastSquares::new(features.clone(), axes, terms, RIDGE)?;
                predicted(Box::new(model), false, known, asked, metric)
            }
            Method::PortfolioUnmeasured(size) => {
                let portfolio = portfolio(features, known, metric, size)?;
                let point = portfolio.predict(state, &[])?.ok_or("no member")?;
                Ok(Answer {
                    probes: Vec::new(),
                    kept: case.cost(table.nearest(&point), metric),
                })
            }
            Method::PortfolioMeasured(size) => {
                measured(portfolio(features, known, metric, size)?, asked, metric)
            }
            Method::ShortlistMeasured(size) => {
                let nearest = NearestNeighbour::new(features.clone(), axes, Scaling::Rescaled);
                let squares = LeastSquares::new(features.clone(), axes, Terms::Quadratic, RIDGE)?;
                let mut members = vec![
                    point(Box::new(nearest), false, known, asked, metric)?,
                    point(Box::new(squares), false, known, asked, metric)?,
                ];
                members.extend(greedy_members(&costs(known, metric), size)?);
                let shortlist = Portfolio::new(features.clone(), Scaling::Rescaled, members)?;
                measured(shortlist, asked, metric)
            }
        }
    }
}

/// Measures all members for a frame each, and keeps the best.
fn measured(
    mut portfolio: Portfolio,
    (case, table): (&Case, &Table),
    metric: Metric,
) -> Result<Answer, Box<dyn Error>> {
    let state = &case.state.features;
    let mut probes = Vec::new();
    while let Some(member) = portfolio.next(state)?.map(<[f64]>::to_vec) {
        let cost = case.cost(table.nearest(&member), metric);
        portfolio.learn(state, &member, cost)?;
        probes.push(cost);
    }
    let point = portfolio.predict(state, &[])?.ok_or("no member")?;
    Ok(Answer {
        probes,
        kept: case.cost(table.nearest(&point), metric),
    })
}

/// Tells a predictor what the searches of the known cases saw, the first frames of all before the second
/// ones, and asks it for another case, the rows of which are the candidates.
fn point(
    mut model: Box<dyn Predictor>,
    in_seconds: bool,
    known: &[(&Case, &Table)],
    (case, table): (&Case, &Table),
    metric: Metric,
) -> Result<Vec<f64>, Box<dyn Error>> {
    let longest = known.iter().map(|(case, _)| case.samples.len()).max();
    for index in 0..longest.unwrap_or(0) {
        for (case, table) in known {
            let Some(&(row, cost)) = case.samples.get(index) else {
                continue;
            };
            let unit = if in_seconds {
                case.state.seconds(metric)
            } else {
                1.0
            };
            model.learn(&case.state.features, &table.points[row], unit * cost)?;
        }
    }
    let point = model.predict(&case.state.features, &table.points)?;
    Ok(point.ok_or("nothing was learned")?)
}

fn predicted(
    model: Box<dyn Predictor>,
    in_seconds: bool,
    known: &[(&Case, &Table)],
    asked: (&Case, &Table),
    metric: Metric,
) -> Result<Answer, Box<dyn Error>> {
    let point = point(model, in_seconds, known, asked, metric)?;
    let (case, table) = asked;
    Ok(Answer {
        probes: Vec::new(),
        kept: case.cost(table.nearest(&point), metric),
    })
}

/// For each known case the rows of its table, and their costs.
fn costs(known: &[(&Case, &Table)], metric: Metric) -> Vec<Vec<(Vec<f64>, f64)>> {
    let of = |&(case, table): &(&Case, &Table)| {
        let rows = case.problem.rows.iter().zip(&table.points);
        rows.filter_map(|(row, point)| Some((point.clone(), row.costs?[metric as usize])))
            .collect()
    };
    known.iter().map(of).collect()
}

/// A portfolio over the whole tables of the known cases: searches have hardly a row in common.
fn portfolio(
    features: &Features,
    known: &[(&Case, &Table)],
    metric: Metric,
    size: usize,
) -> Result<Portfolio, Box<dyn Error>> {
    let states = costs(known, metric);
    let members = greedy_members(&states, size)?;
    let mut portfolio = Portfolio::new(features.clone(), Scaling::Rescaled, members)?;
    for ((case, _), measured) in known.iter().zip(&states) {
        for (point, cost) in measured {
            portfolio.learn(&case.state.features, point, *cost)?;
        }
    }
    Ok(portfolio)
}
