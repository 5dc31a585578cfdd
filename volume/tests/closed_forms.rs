//! Pictures of media whose integrals are known, and how fast they come near as the step shrinks.
//!
//! `data/integrals.json` has the values, each checked against a march of 4000 samples and more. Rays
//! run along z through volumes in which the value is the depth; the eye is put so that samples lie in
//! the middle of their steps, or at their ends. Samples in the middle are the midpoint rule: exact
//! where the extinction is linear, of second order where it is smooth, of first order at jumps. So is
//! whatever has its samples at the ends. The table of 1024 entries is an error of its own.

use glam::Vec3;
use raywright_imaging::OrthographicCamera;
use raywright_volume::{
    Appearance, Behind, CastOptions, ControlPoint, Integration, Picture, Raycaster,
    TransferFunction, ValueScale, Volume, Voxels,
};
use serde_json::Value;

fn reference() -> Value {
    serde_json::from_str(include_str!("data/integrals.json")).expect("JSON")
}

/// The parameters of a case by name, its opacity and its colour.
fn case(name: &str) -> (impl Fn(&str) -> f64, [f64; 2]) {
    let all = reference();
    let found = all["integrals"].as_array().expect("a list").clone();
    let case = found.into_iter().find(|case| case["name"] == name);
    let case = case.expect("a case of that name");
    let known = ["opacity", "colour"].map(|key| case[key].as_f64().expect("a number"));
    let parameters = case["parameters"].clone();
    (
        move |key: &str| parameters[key].as_f64().expect("a parameter"),
        known,
    )
}

/// 3 × 3 × (length + 1) voxels whose value is their depth.
fn depths(length: usize) -> Volume {
    let values = (0..9 * (length + 1)).map(|i| (i / 9) as f32).collect();
    let dims = [3, 3, length + 1];
    Volume::new(dims, [1.0; 3], Voxels::F32(values), ValueScale::default()).expect("a grid")
}

/// Opacity and colour by depth.
fn medium(length: f64, of: impl Fn(f64) -> [f64; 2]) -> TransferFunction {
    const POINTS: usize = 4096;
    let points = (0..=POINTS).map(|i| {
        let depth = length * i as f64 / POINTS as f64;
        let [opacity, colour] = of(depth).map(|v| v as f32);
        ControlPoint::from([depth as f32, colour, colour, colour, opacity])
    });
    TransferFunction::new(points.collect::<Vec<_>>()).expect("a function")
}

/// Where samples lie in their steps.
#[derive(Clone, Copy)]
enum Samples {
    Middle,
    Ends,
}

/// The picture of 3 × 3 rays along z, of which the one in the middle is at x, y.
fn look(
    volume: &Volume,
    appearance: impl Into<Appearance>,
    [x, y]: [f32; 2],
    samples: Samples,
    options: &CastOptions,
) -> Picture {
    let before = match samples {
        Samples::Middle => 8.5,
        Samples::Ends => 8.0,
    };
    let eye = Vec3::new(x, y, -before * options.step);
    let camera = OrthographicCamera::new(eye, eye + Vec3::Z, Vec3::Y, 0.001).expect("a camera");
    let caster = Raycaster::new(volume).expect("a volume of usual size");
    let prepared = caster
        .prepare_appearance(appearance.into())
        .expect("an appearance");
    prepared.render(camera, [3, 3], options).expect("a picture")
}

fn never_ending(step: f32) -> CastOptions {
    let mut options = CastOptions::default();
    (options.step, options.termination, options.behind) = (step, 2.0, Behind::Nothing);
    options
}

/// Opacity and colour in the middle of the picture.
fn integral(
    volume: &Volume,
    appearance: impl Into<Appearance>,
    place: [f32; 2],
    samples: Samples,
    step: f32,
) -> [f64; 2] {
    let picture = look(volume, appearance, place, samples, &never_ending(step));
    [picture.opacity[4], picture.image.pixels()[4][0]].map(f64::from)
}

/// The larger of the two errors.
fn error(found: [f64; 2], known: [f64; 2]) -> f64 {
    (found[0] - known[0]).abs().max((found[1] - known[1]).abs())
}

/// The errors at steps that halve, and that they fall as by the order.
fn check_order(order: i32, steps: &[f32], table: f64, error_at: impl Fn(f32) -> f64) {
    let errors: Vec<f64> = steps.iter().map(|&step| error_at(step)).collect();
    println!("{errors:?}");
    let factor = 2_f64.powi(order);
    for pair in errors.windows(2) {
        let expected = pair[0] / factor;
        assert!(
            (pair[1] - expected).abs() < 0.2 * expected + table,
            "order {order}: {errors:?}"
        );
    }
}

/// The entry that is nearest to a value is beside it; errors cancel along a ray, down to this.
const TABLE: f64 = 3e-5;

#[test]
fn a_constant_medium_is_exact_at_every_step() {
    let (parameter, known) = case("constant");
    let length = parameter("L") as usize;
    let function = medium(parameter("L"), |_| [parameter("alpha"), parameter("c")]);
    for step in [4.0, 2.0, 1.0, 0.5, 0.125] {
        let found = integral(
            &depths(length),
            function.clone(),
            [1.0; 2],
            Samples::Middle,
            step,
        );
        assert!(error(found, known) < 1e-5, "{step}: {found:?} {known:?}");
    }
}

#[test]
fn a_linear_extinction_is_exact_in_the_middle_and_of_first_order_at_ends() {
    let (parameter, known) = case("extinction_ramp");
    let length = parameter("L");
    let [from, to] = ["a", "b"].map(&parameter);
    let colour = parameter("c");
    let extinction = |depth: f64| from + (to - from) * depth / length;
    let function = medium(length, |depth| [-(-extinction(depth)).exp_m1(), colour]);
    let volume = depths(length as usize);
    for step in [4.0, 2.0, 1.0, 0.5, 0.25] {
        let found = integral(&volume, function.clone(), [1.0; 2], Samples::Middle, step);
        assert!(error(found, known) < 1e-4, "{step}: {found:?} {known:?}");
    }
    check_order(1, &[1.0, 0.5, 0.25, 0.125], TABLE, |step| {
        error(
            integral(&volume, function.clone(), [1.0; 2], Samples::Ends, step),
            known,
        )
    });
}

#[test]
fn smooth_media_are_of_second_order() {
    let (parameter, known) = case("opacity_ramp");
    let [length, most, colour] = ["L", "alpha1", "c"].map(&parameter);
    let function = medium(length, |depth| [most * depth / length, colour]);
    let volume = depths(length as usize);
    let at = |step| integral(&volume, function.clone(), [1.0; 2], Samples::Middle, step);
    check_order(2, &[5.0, 2.5, 1.25, 0.625], TABLE, |step| {
        error(at(step), known)
    });
    assert!(error(at(0.125), known) < 1e-4);

    let (parameter, known) = case("colour_ramp");
    let [length, alpha, c0, c1] = ["L", "alpha", "c0", "c1"].map(&parameter);
    let function = medium(length, |depth| [alpha, c0 + c1 * depth]);
    let volume = depths(length as usize);
    let at = |step| integral(&volume, function.clone(), [1.0; 2], Samples::Middle, step);
    check_order(2, &[8.0, 4.0, 2.0], TABLE, |step| error(at(step), known));
    assert!(error(at(0.125), known) < 1e-4);
}

#[test]
fn pre_integration_of_a_linear_field_needs_no_small_steps() {
    let (parameter, known) = case("opacity_ramp");
    let [length, most, colour] = ["L", "alpha1", "c"].map(&parameter);
    let mut appearance = Appearance::from(medium(length, |depth| [most * depth / length, colour]));
    appearance.integration = Integration::PreIntegrated;
    let volume = depths(length as usize);
    for step in [5.0, 2.5, 1.25] {
        let found = integral(&volume, appearance.clone(), [1.0; 2], Samples::Ends, step);
        // 256 places have an error of their own.
        assert!(
            (found[0] - known[0]).abs() < 1e-3,
            "{step}: {found:?} {known:?}"
        );
    }
}

#[test]
fn jumps_are_of_first_order() {
    let (parameter, known) = case("two_slabs");
    let [first, second] = ["L1", "L2"].map(&parameter);
    let [tau1, tau2] = ["tau1", "tau2"].map(|key| -(-parameter(key)).exp_m1());
    let [c1, c2] = ["c1", "c2"].map(&parameter);
    let points = [
        [0.0, c1, c1, c1, tau1],
        [first, c1, c1, c1, tau1],
        [first, c2, c2, c2, tau2],
        [first + second, c2, c2, c2, tau2],
    ];
    let points = points.map(|point| ControlPoint::from(point.map(|v| v as f32)));
    let function = TransferFunction::new(points.to_vec()).expect("a function");
    let volume = depths((first + second) as usize);
    // A whole number of steps in both: exact.
    let found = integral(&volume, function.clone(), [1.0; 2], Samples::Middle, 1.0);
    assert!(error(found, known) < 1e-5, "{found:?} {known:?}");
    for step in [0.8, 0.4, 0.2, 0.1, 0.05, 0.025] {
        let found = integral(&volume, function.clone(), [1.0; 2], Samples::Middle, step);
        assert!(
            error(found, known) < 0.2 * f64::from(step),
            "{step}: {found:?} {known:?}"
        );
    }
}

/// The value at every voxel of a cube, by its place from the middle.
fn around_the_middle(side: usize, of: impl Fn(Vec3) -> f32) -> Volume {
    let middle = Vec3::splat((side - 1) as f32 / 2.0);
    let value = |i: usize| {
        let place = [i % side, i / side % side, i / (side * side)].map(|c| c as f32);
        of(Vec3::from(place) - middle)
    };
    let values = (0..side * side * side).map(value).collect();
    Volume::new(
        [side; 3],
        [1.0; 3],
        Voxels::F32(values),
        ValueScale::default(),
    )
    .expect("a grid")
}

#[test]
fn a_ball_is_as_opaque_as_its_chord() {
    let (parameter, known) = case("sphere");
    let [radius, impact, tau, colour] = ["r", "b", "tau", "c"].map(&parameter);
    let volume = around_the_middle(49, |place| place.length());
    let alpha = -(-tau).exp_m1();
    let points = [
        [0.0, colour, colour, colour, alpha],
        [radius, colour, colour, colour, alpha],
        [radius, 0.0, 0.0, 0.0, 0.0],
    ];
    let points = points.map(|point| ControlPoint::from(point.map(|v| v as f32)));
    let function = TransferFunction::new(points.to_vec()).expect("a function");
    for step in [1.0, 0.25, 0.0625] {
        let place = [24.0 + impact as f32, 24.0];
        let found = integral(&volume, function.clone(), place, Samples::Middle, step);
        // Two ends, each off by half a step at most, and a field that is linear between voxels.
        let allowed = tau * f64::from(step) + 1e-3;
        assert!(error(found, known) < allowed, "{step}: {found:?} {known:?}");
    }
}

#[test]
fn a_gaussian_cloud() {
    let (parameter, known) = case("gaussian");
    let [most, width, impact, colour] = ["t0", "s", "b", "c"].map(&parameter);
    let volume = around_the_middle(65, |place| {
        let square = f64::from(place.length_squared());
        (most * (-square / (2.0 * width * width)).exp()) as f32
    });
    let [low, high] = volume.range().map(f64::from);
    let points = (0..=4096).map(|i| {
        let tau = low + (high - low) * f64::from(i) / 4096.0;
        let [alpha, colour] = [-(-tau).exp_m1(), colour].map(|v| v as f32);
        ControlPoint::from([tau as f32, colour, colour, colour, alpha])
    });
    let function = TransferFunction::new(points.collect::<Vec<_>>()).expect("a function");
    for step in [2.0, 1.0, 0.5] {
        let place = [32.0 + impact as f32, 32.0];
        let found = integral(&volume, function.clone(), place, Samples::Middle, step);
        // Straight lines between voxels cut off the top: 1/12 of the second derivative along x and y.
        assert!(error(found, known) < 2e-3, "{step}: {found:?} {known:?}");
    }
}

#[test]
fn a_ray_ends_at_the_sample_that_the_formula_says() {
    for case in reference()["termination"].as_array().expect("a list") {
        let number = |key: &str| case[key].as_f64().expect("a number");
        let length = (number("samples") * number("s")) as usize + 8;
        let function = medium(length as f64, |_| [number("alpha"), 0.5]);
        let mut options = never_ending(number("s") as f32);
        options.termination = number("threshold") as f32;
        let picture = look(
            &depths(length),
            function,
            [1.0; 2],
            Samples::Middle,
            &options,
        );
        let before = picture.base + f64::from(picture.end[4]) - number("samples");
        // The first sample in the volume has the number 9.
        assert_eq!(before, 9.0, "{case}");
        assert_eq!(picture.work.samples % 9, 0);
    }
}
