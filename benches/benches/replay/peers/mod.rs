//! Searches that are not ours, from crates and, where it has them, from Python.

mod cma_es;
mod driven;
mod python;
mod simplex;
mod tpe;

use raywright_tuner::{Search, Space};

use crate::methods::{Method, Starts, THREE};
use driven::Driven;
use python::Python;

/// What peers that know only costs are told of a failure: worse than anything that was measured.
const FAILURE: f64 = 100.0;

const CRATES: [Method; 6] = [
    Method::peer("crate tpe", tpe::NAME, Starts::Nothing),
    Method::peer("3 starts + crate tpe", tpe::NAME, THREE),
    Method::peer("strong default + crate cmaes", cma_es::NAME, Starts::Strong),
    Method::peer("3 starts + crate cmaes", cma_es::NAME, THREE),
    Method::peer(
        "strong default + crate argmin, simplex",
        simplex::NAME,
        Starts::Strong,
    ),
    Method::peer("3 starts + crate argmin, simplex", simplex::NAME, THREE),
];

/// Seeds of those that take a second for a run, and those that take most of a minute.
const FEWER: u64 = 5;
const FEWEST: u64 = 1;

/// Names are those of the script. SMAC's Gaussian process is not among them: a run of 80 frames takes more than
/// five minutes.
const SAMPLERS: [Method; 5] = [
    Method::peer("Optuna TPE", "optuna-tpe", Starts::Nothing).with_seeds(FEWER),
    Method::peer("3 starts + Optuna TPE", "optuna-tpe", THREE).with_seeds(FEWER),
    Method::peer(
        "3 starts + Optuna TPE, multivariate",
        "optuna-tpe-multivariate",
        THREE,
    )
    .with_seeds(FEWER),
    Method::peer("3 starts + Optuna GP", "optuna-gp", THREE).with_seeds(FEWEST),
    Method::peer("3 starts + SMAC, forest", "smac-forest", THREE).with_seeds(FEWEST),
];

/// The peers that can be had.
#[derive(Debug)]
pub(crate) struct Peers {
    python: Option<Python>,
}

impl Peers {
    /// Looks for Python's; says on standard output what is left out.
    pub(crate) fn open() -> Peers {
        let python = Python::open();
        match &python {
            Err(why) => println!("left out: Optuna and SMAC: {why}"),
            Ok(python) => {
                for method in SAMPLERS.iter().filter(|m| !python.has(m.search_name())) {
                    println!("left out: {}: not installed", method.name);
                }
            }
        }
        Peers {
            python: python.ok(),
        }
    }

    pub(crate) fn methods(&self) -> Vec<Method> {
        let has = |method: &Method| {
            let python = self.python.as_ref();
            python.is_some_and(|python| python.has(method.search_name()))
        };
        let samplers = SAMPLERS.into_iter().filter(has);
        CRATES.into_iter().chain(samplers).collect()
    }

    pub(crate) fn search(
        &self,
        name: &'static str,
        space: &Space,
        frames: usize,
    ) -> Option<Box<dyn Search>> {
        Some(match name {
            tpe::NAME => Box::new(tpe::Tpe::default()),
            cma_es::NAME => Box::new(Driven::new(name, cma_es::run)),
            simplex::NAME => Box::new(Driven::new(name, simplex::run)),
            _ => Box::new(self.python.as_ref()?.sampler(name, space, frames)),
        })
    }

    /// Why Python gave no answer since that was asked last.
    pub(crate) fn failure(&self) -> Option<String> {
        self.python.as_ref()?.failure()
    }
}
