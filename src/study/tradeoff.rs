//! The trade of speed for accuracy in volume raycasting: many settings of the knobs, each with the
//! time of a picture and its distance from a reference, which has a sample every eighth of a voxel and
//! no early termination.
//!
//! Invariant: settings take turns, round by round, so that slow minutes of the machine meet all of
//! them; pictures do not change between rounds, and are compared once.

use std::time::Instant;

use crate::{
    imaging::{AnyCamera, CancelToken, Difference, Image},
    volume::{
        Appearance, AppearanceError, Behind, CastError, CastOptions, Integration, Interpolation,
        Prepared, Raycaster, Skipping,
    },
};

/// Step of the reference, lengths of a voxel.
pub const REFERENCE_STEP: f32 = 0.125;

/// One value for each knob.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct Setting {
    /// As [`CastOptions::step`].
    pub step: f32,
    /// As [`CastOptions::termination`].
    pub termination: f32,
    /// As [`CastOptions::behind`].
    pub behind: Behind,
    /// As [`Appearance::interpolation`].
    pub interpolation: Interpolation,
    /// As [`Appearance::integration`].
    pub integration: Integration,
    /// Pixels along each side of the square that one ray stands for; between rays colours are linear.
    pub pixels_per_ray: u32,
}

impl Setting {
    /// What pictures are made with if nobody wishes otherwise.
    pub const NORMAL: Self = Self {
        step: 1.0,
        termination: 0.98,
        behind: Behind::TheSame,
        interpolation: Interpolation::Trilinear,
        integration: Integration::Samples,
        pixels_per_ray: 1,
    };

    /// In few words.
    #[must_use]
    pub fn words(&self) -> String {
        let mut words = format!("step {}", self.step);
        if self.termination < 1.0 {
            words += &format!(", ends at {}", self.termination);
            if self.behind == Behind::Nothing {
                words += " with nothing behind";
            }
        }
        if self.interpolation == Interpolation::Nearest {
            words += ", nearest voxel";
        }
        if self.integration == Integration::PreIntegrated {
            words += ", pre-integrated";
        }
        if self.pixels_per_ray > 1 {
            words += &format!(", a ray for {0} × {0} pixels", self.pixels_per_ray);
        }
        words
    }
}

/// A knob that is turned alone, all others being as in [`Setting::NORMAL`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Knob {
    /// Distance between samples.
    Step,
    /// Threshold at which rays end.
    Termination,
    /// What is taken to be behind.
    Behind,
    /// Between voxels.
    Interpolation,
    /// Between samples.
    Integration,
    /// Pixels per ray.
    Resolution,
}

impl Knob {
    /// All knobs.
    pub const ALL: [Self; 6] = [
        Self::Step,
        Self::Termination,
        Self::Behind,
        Self::Interpolation,
        Self::Integration,
        Self::Resolution,
    ];

    /// Its name for people.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Step => "step",
            Self::Termination => "termination",
            Self::Behind => "behind",
            Self::Interpolation => "interpolation",
            Self::Integration => "integration",
            Self::Resolution => "pixels per ray",
        }
    }

    /// The settings along it.
    #[must_use]
    pub fn settings(self) -> Vec<Setting> {
        let normal = Setting::NORMAL;
        match self {
            Self::Step => [0.25, 0.5, 0.75, 1.0, 1.5, 2.0, 3.0, 4.0, 6.0, 8.0]
                .map(|step| Setting { step, ..normal })
                .to_vec(),
            Self::Termination => [1.0, 0.999, 0.995, 0.99, 0.98, 0.95, 0.9]
                .map(|termination| Setting {
                    termination,
                    ..normal
                })
                .to_vec(),
            Self::Behind => [Behind::TheSame, Behind::Nothing]
                .map(|behind| Setting { behind, ..normal })
                .to_vec(),
            Self::Interpolation => [Interpolation::Trilinear, Interpolation::Nearest]
                .map(|interpolation| Setting {
                    interpolation,
                    ..normal
                })
                .to_vec(),
            Self::Integration => [Integration::Samples, Integration::PreIntegrated]
                .map(|integration| Setting {
                    integration,
                    ..normal
                })
                .to_vec(),
            Self::Resolution => [1, 2, 4]
                .map(|pixels_per_ray| Setting {
                    pixels_per_ray,
                    ..normal
                })
                .to_vec(),
        }
    }
}

/// All settings of the study: along every knob, and a grid over all of them.
#[must_use]
pub fn settings() -> Vec<Setting> {
    let mut all = Vec::new();
    let mut add = |setting: Setting| {
        if !all.contains(&setting) {
            all.push(setting);
        }
    };
    Knob::ALL
        .into_iter()
        .flat_map(Knob::settings)
        .for_each(&mut add);
    for (interpolation, integration) in [
        (Interpolation::Trilinear, Integration::Samples),
        (Interpolation::Trilinear, Integration::PreIntegrated),
        (Interpolation::Nearest, Integration::Samples),
    ] {
        for pixels_per_ray in [1, 2, 4] {
            for step in [0.25, 0.5, 1.0, 2.0, 4.0, 8.0] {
                for termination in [1.0, 0.995, 0.98, 0.95, 0.9] {
                    add(Setting {
                        step,
                        termination,
                        interpolation,
                        integration,
                        pixels_per_ray,
                        ..Setting::NORMAL
                    });
                }
            }
        }
    }
    all
}

/// What a setting cost and gave.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Outcome {
    /// The setting.
    pub setting: Setting,
    /// Times of its pictures, milliseconds, round by round.
    pub times_ms: Vec<f64>,
    /// From the reference.
    pub difference: Difference,
}

impl Outcome {
    /// Median of the times, milliseconds.
    #[must_use]
    pub fn time_ms(&self) -> f64 {
        let mut times = self.times_ms.clone();
        times.sort_by(f64::total_cmp);
        times.get(times.len() / 2).copied().unwrap_or(f64::NAN)
    }

    /// Root of the mean square error in levels of 255.
    #[must_use]
    pub fn error(&self) -> f64 {
        self.difference.rmse * 255.0
    }
}

/// What a study found.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Tradeoff {
    /// One for each of [`settings`], in that order.
    pub outcomes: Vec<Outcome>,
    /// Median over the rounds of (time without skipping ÷ time with it) at the normal setting; both
    /// pictures are equal.
    pub skipping_gain: f64,
}

/// Why a study ended without a result.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum StudyError {
    /// No picture.
    #[error(transparent)]
    Cast(#[from] CastError),
    /// No appearance.
    #[error(transparent)]
    Appearance(#[from] AppearanceError),
    /// It was told to end.
    #[error("interrupted")]
    Cancelled,
}

/// What is looked at.
#[derive(Clone, Debug)]
pub struct Subject<'a> {
    /// The volume.
    pub caster: &'a Raycaster<'a>,
    /// Its appearance; interpolation and integration are knobs of the study.
    pub appearance: Appearance,
    /// From where.
    pub camera: AnyCamera,
    /// Width and height of pictures, pixels.
    pub size: [u32; 2],
    /// Everything else of pictures.
    pub options: CastOptions,
}

/// Measures all settings `rounds` times; `tell` hears of every picture.
///
/// # Errors
/// [`StudyError`].
pub fn run(
    subject: &Subject<'_>,
    rounds: u32,
    cancel: &CancelToken,
    mut tell: impl FnMut(),
) -> Result<Tradeoff, StudyError> {
    let prepare = |interpolation, integration| {
        let mut appearance = subject.appearance.clone();
        appearance.interpolation = interpolation;
        appearance.integration = integration;
        subject.caster.prepare_appearance(appearance)
    };
    let plain = prepare(Interpolation::Trilinear, Integration::Samples)?;
    let nearest = prepare(Interpolation::Nearest, Integration::Samples)?;
    let integrated = prepare(Interpolation::Trilinear, Integration::PreIntegrated)?;
    let of = |setting: &Setting| match (setting.interpolation, setting.integration) {
        (Interpolation::Nearest, _) => &nearest,
        (_, Integration::PreIntegrated) => &integrated,
        _ => &plain,
    };
    let mut options = subject.options;
    options.step = REFERENCE_STEP;
    options.termination = 1.0;
    let reference = plain.render(subject.camera, subject.size, &options)?.image;

    let mut outcomes: Vec<Outcome> = Vec::new();
    let mut gains = Vec::new();
    for round in 0..rounds.max(1) {
        for (index, setting) in settings().into_iter().enumerate() {
            if cancel.is_cancelled() {
                return Err(StudyError::Cancelled);
            }
            let (image, time) = picture(of(&setting), subject, &setting, subject.options.skipping)?;
            if round == 0 {
                let Some(difference) = Difference::of(&image, &reference) else {
                    unreachable!("all pictures have the size of the reference");
                };
                outcomes.push(Outcome {
                    setting,
                    times_ms: Vec::new(),
                    difference,
                });
            }
            outcomes[index].times_ms.push(time);
            tell();
        }
        let normal = Setting::NORMAL;
        let [without, with] = [Skipping::None, Skipping::Distance]
            .map(|skipping| picture(&plain, subject, &normal, skipping));
        gains.push(without?.1 / with?.1);
    }
    gains.sort_by(f64::total_cmp);
    Ok(Tradeoff {
        outcomes,
        skipping_gain: gains[gains.len() / 2],
    })
}

/// A picture in full size and its time, milliseconds.
fn picture(
    prepared: &Prepared<'_>,
    subject: &Subject<'_>,
    setting: &Setting,
    skipping: Skipping,
) -> Result<(Image, f64), StudyError> {
    let mut options = subject.options;
    options.step = setting.step;
    options.termination = setting.termination;
    options.behind = setting.behind;
    options.skipping = skipping;
    let [width, height] = subject.size;
    let size = subject.size.map(|n| n.div_ceil(setting.pixels_per_ray));
    let start = Instant::now();
    let mut image = prepared.render(subject.camera, size, &options)?.image;
    if setting.pixels_per_ray > 1 {
        image = image.resized(width, height).map_err(CastError::from)?;
    }
    Ok((image, start.elapsed().as_secs_f64() * 1e3))
}

impl Tradeoff {
    /// The outcomes that no other beats in both time and error, the fastest first.
    #[must_use]
    pub fn front(&self) -> Vec<&Outcome> {
        front(self.outcomes.iter())
    }

    /// The outcome of the normal setting.
    #[must_use]
    pub fn normal(&self) -> Option<&Outcome> {
        self.outcomes
            .iter()
            .find(|outcome| outcome.setting == Setting::NORMAL)
    }

    /// The most accurate setting that takes at most so many milliseconds.
    #[must_use]
    pub fn within_time(&self, time_ms: f64) -> Option<&Outcome> {
        self.front()
            .into_iter()
            .rev()
            .find(|outcome| outcome.time_ms() <= time_ms)
    }

    /// The fastest setting whose error is at most so many levels of 255.
    #[must_use]
    pub fn within_error(&self, error: f64) -> Option<&Outcome> {
        self.front()
            .into_iter()
            .find(|outcome| outcome.error() <= error)
    }

    /// How many times faster than without it a picture is with pre-integration, at the error of the
    /// normal setting; `None` if one of them never gets there.
    #[must_use]
    pub fn integration_gain(&self) -> Option<f64> {
        let error = self.normal()?.error();
        let fastest = |integration| {
            let own = self.outcomes.iter();
            own.filter(|outcome| outcome.setting.integration == integration)
                .filter(|outcome| outcome.error() <= error)
                .map(Outcome::time_ms)
                .min_by(f64::total_cmp)
        };
        Some(fastest(Integration::Samples)? / fastest(Integration::PreIntegrated)?)
    }
}

/// Those that no other beats in both time and error, by rising time and falling error.
fn front<'a>(outcomes: impl Iterator<Item = &'a Outcome>) -> Vec<&'a Outcome> {
    let mut sorted: Vec<&Outcome> = outcomes.filter(|o| !o.error().is_nan()).collect();
    sorted.sort_by(|a, b| {
        (a.time_ms().total_cmp(&b.time_ms())).then(a.error().total_cmp(&b.error()))
    });
    let mut least = f64::INFINITY;
    sorted.retain(|outcome| {
        let is_better = outcome.error() < least;
        least = least.min(outcome.error());
        is_better
    });
    sorted
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::volume::generate;

    #[test]
    fn along_every_knob_there_is_the_normal_setting_and_no_setting_twice() {
        for knob in Knob::ALL {
            assert!(knob.settings().contains(&Setting::NORMAL), "{knob:?}");
        }
        let all = settings();
        for (i, setting) in all.iter().enumerate() {
            assert!(!all[..i].contains(setting));
        }
    }

    #[test]
    fn a_small_study() {
        let generated = generate::by_name("marschner-lobb", [24; 3], 1).unwrap();
        let caster = Raycaster::new(&generated.volume).unwrap();
        let subject = Subject {
            caster: &caster,
            appearance: generated.transfer_function.clone().into(),
            camera: generated.camera.into(),
            size: [40, 30],
            options: CastOptions::default(),
        };
        let mut told = 0;
        let study = run(&subject, 2, &CancelToken::default(), || told += 1).unwrap();
        assert_eq!(told, 2 * study.outcomes.len());
        assert!(study.outcomes.iter().all(|o| o.times_ms.len() == 2));
        // A finer step without termination comes nearer to the reference.
        let error = |step: f32| {
            let setting = Setting {
                step,
                termination: 1.0,
                ..Setting::NORMAL
            };
            study
                .outcomes
                .iter()
                .find(|o| o.setting == setting)
                .unwrap()
                .error()
        };
        assert!(error(0.25) < error(1.0) && error(1.0) < error(4.0));
        // Nobody beats the front.
        let front = study.front();
        for outcome in &study.outcomes {
            let (time, error) = (outcome.time_ms(), outcome.error());
            assert!(
                front
                    .iter()
                    .any(|f| f.time_ms() <= time && f.error() <= error)
            );
            for f in &front {
                assert!(!(time < f.time_ms() && error < f.error()));
            }
        }
        // What is recommended keeps its promise, and nothing is promised that cannot be.
        let least = front.last().unwrap().error();
        let within = study.within_error(1.5 * least).unwrap();
        assert!(within.error() <= 1.5 * least);
        assert!(study.within_error(-1.0).is_none() && study.within_time(0.0).is_none());
        let best = study.within_time(f64::INFINITY).unwrap();
        assert!(study.outcomes.iter().all(|o| o.error() >= best.error()));

        let cancel = CancelToken::default();
        cancel.cancel();
        assert!(matches!(
            run(&subject, 1, &cancel, || ()),
            Err(StudyError::Cancelled)
        ));
    }
}
