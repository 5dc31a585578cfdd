//! The quality that a prediction asks for: longer steps first, then fewer rays.
//!
//! | rung | pixels for a ray | steps, voxels |
//! | --- | --- | --- |
//! | 0 | 1 | up to 2 |
//! | 1 | 2, as on a checkerboard | up to 4 |
//! | 2 | 4 | up to the limit |
//!
//! The first rung on which the target can be held is taken, and on it the step that meets it. To
//! a finer rung than that of the last frame it goes only if there is a tenth of the time to spare, so
//! that resolution does not flicker. With [`Resolution::Full`] there is but the first rung, with steps
//! up to the limit.
//!
//! Invariants: the quality is one of a rung; its coarseness is at least `shrink_limit` times that of
//! the last frame.

use super::{
    mode::{Pass, Resolution, SteeringParams},
    model::TimeModel,
    search::{SearchEnd, StepLimits, search_step},
};
use crate::predict::{PixelsPerRay, Quality};

/// The longest steps of all rungs but the last.
const LONGEST_STEPS: [f64; 2] = [2.0, 4.0];

/// The share of the target that a finer rung has to hold.
const RESERVE: f64 = 0.9;

struct Rung {
    pixels_per_ray: PixelsPerRay,
    limits: StepLimits,
}

fn rungs(params: &SteeringParams) -> Vec<Rung> {
    let StepLimits { shortest, longest } = params.limits;
    let rung = |(pixels_per_ray, most): (PixelsPerRay, f64)| Rung {
        pixels_per_ray,
        limits: StepLimits {
            shortest,
            longest: most.clamp(shortest, longest),
        },
    };
    match params.resolution {
        Resolution::Full => vec![rung((PixelsPerRay::One, longest))],
        Resolution::Ladder => {
            let most = [LONGEST_STEPS[0], LONGEST_STEPS[1], longest];
            PixelsPerRay::ALL.into_iter().zip(most).map(rung).collect()
        }
    }
}

/// The quality for the next frame, `last` being that of the frame before.
pub(super) fn decide(
    params: &SteeringParams,
    last: Option<Quality>,
    model: &impl TimeModel,
) -> Pass {
    let rungs = rungs(params);
    let (index, mut pass) = first_that_holds(params, &rungs, last, model);
    if let Some(last) = last {
        hold_back(
            &mut pass,
            &rungs[index..],
            last.coarseness() * params.shrink_limit,
        );
        if pass.held_back {
            pass.forecast = pass.forecast.map(|_| model.forecast(pass.quality));
        }
    }
    pass
}

fn first_that_holds(
    params: &SteeringParams,
    rungs: &[Rung],
    last: Option<Quality>,
    model: &impl TimeModel,
) -> (usize, Pass) {
    let mut index = 0;
    loop {
        let rung = &rungs[index];
        let is_last = index + 1 == rungs.len();
        let finer = last.is_some_and(|last| rung.pixels_per_ray < last.pixels_per_ray);
        let target = params.target * if finer { RESERVE } else { 1.0 };
        let (pass, end) = on_rung(params, rung, target, last, model);
        // Without a time a coarser rung would tell no more.
        if is_last || !(end == SearchEnd::Longest || pass.over_budget) {
            return (index, pass);
        }
        index += 1;
    }
}

fn on_rung(
    params: &SteeringParams,
    rung: &Rung,
    target: f64,
    last: Option<Quality>,
    model: &impl TimeModel,
) -> (Pass, SearchEnd) {
    let quality = |step: f64| Quality {
        step,
        pixels_per_ray: rung.pixels_per_ray,
    };
    let start = match last {
        Some(last) if last.pixels_per_ray == rung.pixels_per_ray => last.step,
        Some(last) => last.coarseness() / rung.pixels_per_ray.count(),
        None => params.fixed_step,
    };
    let found = search_step(target, start, rung.limits, |step| {
        let forecast = model.forecast(quality(step));
        // Nothing is added where a deviation is not known.
        forecast.time * (1.0 + params.caution * forecast.deviation.max(0.0))
    });
    let mut step = found.step;
    let mut over_budget = found.end == SearchEnd::Longest;
    let mut safe = found.end == SearchEnd::NoTime;
    if !safe && model.forecast(quality(step)).novelty > params.safe_novelty {
        safe = true;
        let safest = model.safe_step(rung.pixels_per_ray, target);
        over_budget |= safest > rung.limits.longest;
        step = step.max(safest.min(rung.limits.longest));
    }
    let pass = Pass {
        forecast: Some(model.forecast(quality(step))),
        safe,
        over_budget,
        ..Pass::plain(quality(step))
    };
    (pass, found.end)
}

/// Makes a pass as coarse as it has to be: by a longer step, or if there is none, fewer rays. The
/// rungs begin with that of the pass.
fn hold_back(pass: &mut Pass, rungs: &[Rung], least: f64) {
    if pass.quality.coarseness() >= least {
        return;
    }
    pass.held_back = true;
    for rung in rungs {
        let step = least / rung.pixels_per_ray.count();
        pass.quality = Quality {
            step: step.clamp(rung.limits.shortest, rung.limits.longest),
            pixels_per_ray: rung.pixels_per_ray,
        };
        if step <= rung.limits.longest {
            return;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::steer::{Forecast, Mode};

    /// A machine whose time is exact, `scale` / coarseness + `fixed`.
    struct Exact {
        scale: f64,
        fixed: f64,
        deviation: f64,
        novelty: f64,
    }

    impl TimeModel for Exact {
        fn forecast(&self, quality: Quality) -> Forecast {
            Forecast {
                time: self.scale / quality.coarseness() + self.fixed,
                deviation: self.deviation,
                novelty: self.novelty,
            }
        }

        fn safe_step(&self, pixels_per_ray: PixelsPerRay, target: f64) -> f64 {
            3.0 * self.scale / pixels_per_ray.count() / (target - self.fixed).max(0.0)
        }
    }

    fn exact(scale: f64) -> Exact {
        Exact {
            scale,
            fixed: 0.0,
            deviation: 0.0,
            novelty: 0.0,
        }
    }

    fn params(resolution: Resolution) -> SteeringParams {
        SteeringParams {
            resolution,
            ..SteeringParams::new(Mode::Predicted, 0.1)
        }
    }

    fn decided(params: &SteeringParams, last: Option<Quality>, model: &Exact) -> Pass {
        decide(params, last, model)
    }

    #[test]
    fn longer_steps_first_then_fewer_rays() {
        let params = params(Resolution::Ladder);
        for (scale, pixels_per_ray, step) in [
            (0.01, PixelsPerRay::One, 0.25),
            (0.1, PixelsPerRay::One, 1.0),
            (0.19, PixelsPerRay::One, 1.9),
            (0.3, PixelsPerRay::Checker, 1.5),
            (0.7, PixelsPerRay::Checker, 3.5),
            (1.2, PixelsPerRay::Four, 3.0),
            (3.0, PixelsPerRay::Four, 7.5),
        ] {
            let pass = decided(&params, None, &exact(scale));
            assert_eq!(pass.quality.pixels_per_ray, pixels_per_ray, "{scale}");
            assert!((pass.quality.step / step - 1.0).abs() < 0.02, "{pass:?}");
            assert!(!pass.over_budget && !pass.safe && !pass.held_back);
        }
        let pass = decided(&params, None, &exact(30.0));
        assert!(pass.over_budget && pass.quality.coarseness() == 32.0);
        let full = SteeringParams {
            resolution: Resolution::Full,
            ..params
        };
        let pass = decided(&full, None, &exact(0.3));
        assert_eq!(pass.quality.pixels_per_ray, PixelsPerRay::One);
        assert!((pass.quality.step - 3.0).abs() < 0.05);
    }

    #[test]
    fn a_finer_resolution_needs_a_reserve() {
        let params = params(Resolution::Ladder);
        let last = Some(Quality {
            step: 1.0,
            pixels_per_ray: PixelsPerRay::Checker,
        });
        let pass = decided(&params, last, &exact(0.195));
        assert_eq!(pass.quality.pixels_per_ray, PixelsPerRay::Checker);
        let pass = decided(&params, last, &exact(0.17));
        assert_eq!(pass.quality.pixels_per_ray, PixelsPerRay::One);
    }

    #[test]
    fn samples_become_denser_slowly_on_the_way_up_as_well() {
        let params = params(Resolution::Ladder);
        let mut last = Quality {
            step: 8.0,
            pixels_per_ray: PixelsPerRay::Four,
        };
        let mut frames = 0;
        while last.coarseness() > 0.5 {
            let pass = decided(&params, Some(last), &exact(0.05));
            let ratio = pass.quality.coarseness() / last.coarseness();
            assert!((0.8 - 1e-12..1.0).contains(&ratio), "{last:?} {pass:?}");
            last = pass.quality;
            frames += 1;
        }
        // 0.8^19 < 0.5/32 < 0.8^18.
        assert_eq!(frames, 19);
        assert_eq!(last.pixels_per_ray, PixelsPerRay::One);
    }

    #[test]
    fn what_is_unknown_gets_a_safe_step() {
        let params = SteeringParams {
            safe_novelty: 0.5,
            ..params(Resolution::Full)
        };
        let mut model = exact(0.1);
        model.novelty = 0.6;
        let pass = decided(&params, None, &model);
        assert!(pass.safe && (pass.quality.step - 3.0).abs() < 1e-9);
        model.fixed = 0.2;
        let pass = decided(&params, None, &model);
        assert!(pass.safe && pass.over_budget && pass.quality.step == 8.0);
    }

    #[test]
    fn a_deviation_is_kept_in_reserve() {
        let params = SteeringParams {
            caution: 2.0,
            ..params(Resolution::Full)
        };
        let mut model = exact(0.1);
        model.deviation = 0.1;
        let pass = decided(&params, None, &model);
        assert!((pass.quality.step - 1.2).abs() < 0.02, "{pass:?}");
        model.deviation = f64::NAN;
        let pass = decided(&params, None, &model);
        assert!((pass.quality.step - 1.0).abs() < 0.02, "{pass:?}");
    }
}
