use super::*;

fn outlook(angle: f64, lit_share: f64) -> Outlook {
    Outlook {
        volume_version: 0,
        direction: [angle.cos(), angle.sin(), 0.0],
        pixels_per_voxel: 2.0,
        rays: 1e5,
        length: 8e6,
        longest: 1e7,
        lit_length: 8e6 * lit_share,
        seen_length: 3e6 * lit_share,
        jumps: 1.2e6,
        coarse_steps: 12.0,
    }
}

fn work(outlook: &Outlook, quality: Quality) -> Work {
    let samples = outlook.lit_length / quality.coarseness() * 0.8;
    let rays = outlook.rays(quality) as u64;
    Work {
        rays,
        samples: samples as u64,
        lit_samples: (0.5 * samples) as u64,
        skips: rays * 5,
        ..Work::default()
    }
}

fn costs() -> crate::predict::WorkCosts {
    crate::predict::WorkCosts::default().scaled(1.7)
}

/// A frame of a tour, and what it takes.
fn frame(i: u32) -> (Outlook, Quality, Work, f64) {
    let outlook = outlook(f64::from(i) * 0.05, 0.5 + 0.3 * (f64::from(i) * 0.03).sin());
    let quality = Quality::with_step(1.0 + 0.5 * (f64::from(i) * 0.4).sin());
    let work = work(&outlook, quality);
    let time = costs().time(&Counts::from(&work));
    (outlook, quality, work, time)
}

fn tour(predictor: &mut FramePredictor, frames: std::ops::Range<u32>, slow: f64) -> f64 {
    let (mut squares, mut count) = (0.0, 0.0);
    for i in frames {
        let (outlook, quality, work, time) = frame(i);
        let time = time * slow;
        let error = predictor.predict(&outlook, quality).unwrap().time / time - 1.0;
        squares += error * error;
        count += 1.0;
        let lesson = predictor.learn(&outlook, quality, &work, time).unwrap();
        assert_eq!(lesson, Lesson::Learned);
    }
    (squares / count).sqrt()
}

#[test]
fn a_tour_is_learned() {
    let mut plus = FramePredictor::new(PredictorParams::plus()).unwrap();
    let mut paper = FramePredictor::new(PredictorParams::paper()).unwrap();
    tour(&mut plus, 0..40, 1.0);
    tour(&mut paper, 0..40, 1.0);
    let (plus_error, paper_error) = (
        tour(&mut plus, 40..250, 1.0),
        tour(&mut paper, 40..250, 1.0),
    );
    assert!(plus_error < 0.03, "{plus_error}");
    assert!(plus_error < paper_error * 0.5, "{plus_error} {paper_error}");
    // Samples are counted, not guessed at.
    let (outlook, quality, work, _) = frame(100);
    let counts = plus.predict(&outlook, quality).unwrap().counts;
    assert!((counts.samples / work.samples as f64 - 1.0).abs() < 0.02);
}

#[test]
fn a_machine_that_slows_down_is_followed() {
    let mut plus = FramePredictor::new(PredictorParams::plus()).unwrap();
    tour(&mut plus, 0..200, 1.0);
    tour(&mut plus, 200..215, 1.0 / 0.7);
    let error = tour(&mut plus, 215..240, 1.0 / 0.7);
    assert!(error < 0.08, "{error}");
    assert!(plus.speed() > 1.05);
}

#[test]
fn before_the_first_frame_there_is_a_prediction() {
    for params in [PredictorParams::plus(), PredictorParams::paper()] {
        let predictor = FramePredictor::new(params).unwrap();
        let (outlook, quality, _, time) = frame(3);
        let prediction = predictor.predict(&outlook, quality).unwrap();
        assert_eq!(prediction.novelty, 1.0);
        assert!((0.2..5.0).contains(&(prediction.time / time)));
        let product = prediction.samples * prediction.cost_per_sample;
        assert!((product / prediction.time - 1.0).abs() < 1e-12);
    }
}

#[test]
fn a_frame_unlike_any_other_is_known_as_such() {
    let mut plus = FramePredictor::new(PredictorParams::plus()).unwrap();
    tour(&mut plus, 0..60, 1.0);
    let (known, quality, ..) = frame(59);
    let mut unlike = outlook(-1.5, 0.05);
    unlike.pixels_per_voxel = 0.1;
    let [known, unlike] = [known, unlike].map(|o| plus.predict(&o, quality).unwrap());
    assert!(known.novelty < 0.1 && unlike.novelty > 0.5);
    assert!(unlike.deviation > known.deviation);
}

#[test]
fn times_that_cannot_be_teach_nothing() {
    let mut plus = FramePredictor::new(PredictorParams::plus()).unwrap();
    tour(&mut plus, 0..50, 1.0);
    let (outlook, quality, work, time) = frame(50);
    let before = plus.predict(&outlook, quality).unwrap();
    for bad in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        let lesson = plus.learn(&outlook, quality, &work, bad).unwrap();
        assert_eq!(lesson, Lesson::BadTime);
    }
    let stale = outlook.with_volume_version(1);
    assert_eq!(plus.learn(&stale, quality, &work, time), Ok(Lesson::Stale));
    assert_eq!(plus.predict(&outlook, quality).unwrap(), before);
    assert_eq!(plus.frames(), 50);
}

#[test]
fn one_outlier_is_of_limited_weight() {
    for factor in [1e3, 1e-3, 1e200] {
        let mut plus = FramePredictor::new(PredictorParams::plus()).unwrap();
        tour(&mut plus, 0..50, 1.0);
        let (outlook, quality, work, time) = frame(50);
        let lesson = plus.learn(&outlook, quality, &work, time * factor);
        assert_eq!(lesson, Ok(Lesson::Outlier));
        let after = plus.predict(&outlook, quality).unwrap().time / time;
        assert!((0.45..2.2).contains(&after), "{factor}: {after}");
        // What lasts is no outlier for long.
        if factor == 1e3 {
            for _ in 0..60 {
                plus.learn(&outlook, quality, &work, time * factor).unwrap();
            }
            let after = plus.predict(&outlook, quality).unwrap().time / time;
            assert!((0.5..2.0).contains(&(after / factor)), "{after}");
        }
    }
}

#[test]
fn frames_with_nothing_to_see() {
    for (params, taught, vectors) in [
        // Rays and jumps are work too.
        (PredictorParams::plus(), Lesson::Learned, 1),
        (PredictorParams::paper(), Lesson::NoSamples, 0),
    ] {
        let mut predictor = FramePredictor::new(params).unwrap();
        let mut nothing = outlook(0.0, 0.0);
        (nothing.length, nothing.longest) = (0.0, 0.0);
        let quality = Quality::with_step(1.0);
        let work = Work {
            rays: 100_000,
            ..Work::default()
        };
        for _ in 0..50 {
            let lesson = predictor.learn(&nothing, quality, &work, 2e-3).unwrap();
            assert_eq!(lesson, taught);
        }
        let prediction = predictor.predict(&nothing, quality).unwrap();
        assert_eq!(prediction.counts.samples, 0.0);
        assert!((prediction.time / 2e-3 - 1.0).abs() < 0.1, "{prediction:?}");
        assert_eq!(predictor.dictionaries()[0], vectors);
        let step = predictor.safe_step(&nothing, PixelsPerRay::One, 0.03);
        assert_eq!(step, Ok(0.0));
    }
}

#[test]
fn a_safe_step_holds_the_target_without_early_ends() {
    let mut plus = FramePredictor::new(PredictorParams::plus()).unwrap();
    for frames in [0..0, 0..50] {
        tour(&mut plus, frames, 1.0);
        let (outlook, ..) = frame(51);
        for pixels_per_ray in PixelsPerRay::ALL {
            let step = plus.safe_step(&outlook, pixels_per_ray, 0.02).unwrap();
            let quality = Quality {
                step,
                pixels_per_ray,
            };
            let mut longest = outlook;
            longest.lit_length *= longest.longest / longest.length;
            longest.length = longest.longest;
            let time = costs().time(&Counts::from(&work(&longest, quality)));
            // Before the first frame the machine is taken to be faster than it is.
            let allowed = if plus.frames() == 0 { 0.05 } else { 0.023 };
            assert!(time < allowed, "{time}");
        }
        assert_eq!(
            plus.safe_step(&outlook, PixelsPerRay::One, 1e-9),
            Ok(f64::INFINITY)
        );
    }
}

#[test]
fn a_reset_predictor_is_a_new_one() {
    let mut used = FramePredictor::new(PredictorParams::plus()).unwrap();
    tour(&mut used, 0..80, 1.0);
    used.reset(0);
    let mut new = FramePredictor::new(PredictorParams::plus()).unwrap();
    for i in 0..30 {
        let (outlook, quality, work, time) = frame(i);
        assert_eq!(
            used.predict(&outlook, quality).unwrap(),
            new.predict(&outlook, quality).unwrap()
        );
        used.learn(&outlook, quality, &work, time).unwrap();
        new.learn(&outlook, quality, &work, time).unwrap();
    }
}

#[test]
fn what_is_refused() {
    let mut plus = FramePredictor::new(PredictorParams::plus()).unwrap();
    let (outlook, quality, work, time) = frame(0);
    let mut bad = outlook;
    bad.coarse_steps = f64::NAN;
    let named = |error| {
        matches!(
            error,
            PredictError::Outlook {
                name: "coarse_steps",
                ..
            }
        )
    };
    assert!(named(plus.predict(&bad, quality).unwrap_err()));
    assert!(named(plus.learn(&bad, quality, &work, time).unwrap_err()));
    for step in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        let error = plus
            .predict(&outlook, Quality::with_step(step))
            .unwrap_err();
        assert!(matches!(error, PredictError::Step { .. }));
    }
    for change in [
        |p: &mut PredictorParams| p.speed_memory = Some(0.0),
        |p: &mut PredictorParams| p.additive_memory = f64::NAN,
        |p: &mut PredictorParams| p.fallback = Some([0.5, 0.5]),
        |p: &mut PredictorParams| p.fallback = Some([f64::NAN, 0.5]),
    ] {
        let mut params = PredictorParams::plus();
        change(&mut params);
        let error = FramePredictor::new(params).unwrap_err();
        assert!(matches!(error, PredictError::Parameter { .. }), "{error}");
    }
}

#[test]
fn no_trend_is_followed_beyond_what_was_told() {
    // Each frame takes half as many samples of what is estimated: the bias falls, and stays where it was last.
    let mut predictor = FramePredictor::new(PredictorParams::plus()).unwrap();
    let quality = Quality::with_step(1.0);
    let mut told = f64::INFINITY;
    for i in 0..6 {
        let outlook = outlook(f64::from(i) * 0.05, 0.5);
        let mut work = work(&outlook, quality);
        work.samples >>= i;
        let time = costs().time(&Counts::from(&work));
        predictor.learn(&outlook, quality, &work, time).unwrap();
        told = told.min(work.samples as f64);
    }
    let next = outlook(0.3, 0.5);
    let counts = predictor.predict(&next, quality).unwrap().counts;
    assert!(counts.samples >= 0.999 * told, "{} {told}", counts.samples);
    assert!(counts.samples < 2.0 * told, "{} {told}", counts.samples);
}
