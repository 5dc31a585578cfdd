//! Kernels against the slow twin.

use glam::Vec3;
use proptest::prelude::*;
use raywright_bvh::{Aabb, Isa};
use raywright_imaging::{AnyCamera, Camera, OrthographicCamera};

use super::*;
use crate::{
    appearance::{Interpolation, Shading},
    grid::{ValueScale, Voxels},
    transfer::ControlPoint,
};

fn function(points: &[[f32; 5]]) -> TransferFunction {
    let points: Vec<ControlPoint> = points.iter().map(|&p| p.into()).collect();
    TransferFunction::new(points).unwrap()
}

/// A blob in the middle of little, and specks.
fn values(dims: [usize; 3], seed: u32) -> Vec<f32> {
    let mut values = Vec::new();
    let mut state = seed | 1;
    for z in 0..dims[2] {
        for y in 0..dims[1] {
            for x in 0..dims[0] {
                let at = |i: usize, axis: usize| (i as f32 + 0.5) / dims[axis] as f32 - 0.5;
                let r = Vec3::new(at(x, 0), at(y, 1), at(z, 2)).length();
                state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                let noise = (state >> 24) as f32 / 40.0;
                let speck = if state >> 16 & 0xfff == 7 { 200.0 } else { 0.0 };
                values.push(
                    (255.0 * (1.0 - 3.0 * r) + noise + speck)
                        .clamp(0.0, 255.0)
                        .round(),
                );
            }
        }
    }
    values
}

fn volumes(dims: [usize; 3], spacing: [f32; 3], seed: u32) -> Vec<Volume> {
    let values = values(dims, seed);
    let new = |voxels, slope| {
        let scale = ValueScale {
            slope,
            intercept: 3.0,
        };
        Volume::new(dims, spacing, voxels, scale).unwrap()
    };
    let mut missing = values.clone();
    for (i, value) in missing.iter_mut().enumerate() {
        if i % 97 == 5 {
            *value = f32::NAN;
        }
    }
    vec![
        new(Voxels::U8(values.iter().map(|&v| v as u8).collect()), 1.0),
        new(
            Voxels::U16(values.iter().map(|&v| v as u16 * 257).collect()),
            -0.01,
        ),
        new(Voxels::F32(values), 0.5),
        new(Voxels::F32(missing), 0.5),
    ]
}

fn functions(volume: &Volume) -> [TransferFunction; 3] {
    let [low, high] = volume.range();
    let at = |share: f32| low + (high - low) * share;
    [
        function(&[
            [at(0.0), 0.2, 0.3, 0.4, 0.0],
            [at(0.5), 0.9, 0.3, 0.4, 0.0],
            [at(1.0), 1.0, 1.0, 0.9, 0.9],
        ]),
        function(&[
            [at(0.1), 0.2, 0.3, 0.4, 0.01],
            [at(0.9), 1.0, 0.1, 0.2, 0.2],
        ]),
        // A narrow band.
        function(&[
            [at(0.41), 0.0, 0.0, 0.0, 0.0],
            [at(0.41), 1.0, 0.8, 0.1, 1.0],
            [at(0.42), 1.0, 0.8, 0.1, 1.0],
            [at(0.42), 0.0, 0.0, 0.0, 0.0],
        ]),
    ]
}

fn check(volume: &Volume, camera: impl Into<AnyCamera>, size: [u32; 2], step: f32) {
    let camera = camera.into();
    for function in functions(volume) {
        check_appearance(volume, function.into(), camera, size, step);
    }
}

/// Compares every kernel with the slow twin and returns the picture.
fn check_appearance(
    volume: &Volume,
    appearance: Appearance,
    camera: impl Into<AnyCamera>,
    size: [u32; 2],
    step: f32,
) -> Picture {
    let camera = camera.into();
    let caster = Raycaster::new(volume).unwrap();
    let options = CastOptions {
        step,
        ..CastOptions::default()
    };
    let prepared = caster.prepare_appearance(appearance.clone()).unwrap();
    let expected = prepared.render_slowly(camera, size, &options).unwrap();
    for isa in Isa::ALL.into_iter().filter(|isa| isa.is_available()) {
        for skipping in [Skipping::None, Skipping::Distance] {
            let options = CastOptions {
                isa,
                skipping,
                ..options
            };
            let picture = prepared.render(camera, size, &options).unwrap();
            for i in 0..picture.opacity.len() {
                let of = |p: &Picture| (p.image.pixels()[i], p.opacity[i], p.end[i]);
                assert_eq!(
                    of(&picture),
                    of(&expected),
                    "pixel {i}, {isa}, {skipping:?}, {appearance:?}"
                );
            }
        }
    }
    expected
}

/// Everything that can be asked for, alone and together.
fn appearances(volume: &Volume, function: &TransferFunction) -> Vec<Appearance> {
    let [low, high] = volume.range();
    let surface = |share: f32, opacity| IsoSurface {
        value: low + (high - low) * share,
        colour: [0.3, 0.9, share * 0.5],
        opacity,
    };
    let shading = Shading {
        light: crate::appearance::Light::From(Vec3::new(1.0, 2.0, -0.5)),
        ..Shading::default()
    };
    let plain = Appearance::from(function.clone());
    let mut all = vec![plain.clone(); 6];
    all[0].interpolation = Interpolation::Nearest;
    all[1].integration = Integration::PreIntegrated;
    all[2].shading = Some(Shading::default());
    all[3].surfaces = vec![surface(0.7, 0.4), surface(0.35, 0.6), surface(1.2, 1.0)];
    all[4].shading = Some(shading);
    all[4].surfaces = vec![surface(0.5, 1.0)];
    all[5].integration = Integration::PreIntegrated;
    all[5].shading = Some(shading);
    all[5].surfaces = vec![surface(0.2, 0.1), surface(0.6, 0.2)];
    all[5].interpolation = Interpolation::Nearest;
    all
}

#[test]
fn every_detail_gives_the_bits_of_the_slow_twin() {
    for (dims, spacing) in [
        ([20, 17, 31], [1.0, 1.5, 0.7]),
        ([1, 9, 8], [1.0; 3]),
        ([9, 1, 12], [1.0; 3]),
        ([3, 40, 1], [0.5, 1.0, 2.0]),
    ] {
        for volume in volumes(dims, spacing, 3) {
            let extent = volume.extent();
            let outside = extent * 0.5 + Vec3::new(1.3, -1.9, 1.1) * (extent.length() + 1.0) * 0.6;
            for (origin, step) in [(outside, 0.8), (extent * 0.45 + 0.01, 2.3)] {
                let camera = Camera::new(origin, extent * 0.51, Vec3::Z, 45.0).unwrap();
                for function in functions(&volume) {
                    for appearance in appearances(&volume, &function) {
                        check_appearance(&volume, appearance, &camera, [37, 29], step);
                    }
                }
            }
        }
    }
}

#[test]
fn every_kernel_gives_the_bits_of_the_slow_twin() {
    let mut lit = 0;
    for (dims, spacing) in [
        ([20, 17, 31], [1.0, 1.5, 0.7]),
        ([1, 9, 8], [1.0; 3]),
        ([9, 1, 12], [1.0; 3]),
        ([3, 40, 1], [0.5, 1.0, 2.0]),
        ([1, 1, 1], [1.0; 3]),
    ] {
        for volume in volumes(dims, spacing, 3) {
            let extent = volume.extent();
            let outside = extent * 0.5 + Vec3::new(1.3, -1.9, 1.1) * (extent.length() + 1.0) * 0.6;
            for origin in [outside, extent * 0.45 + 0.01] {
                let camera = Camera::new(origin, extent * 0.51, Vec3::Z, 45.0).unwrap();
                check(&volume, &camera, [45, 38], 0.8);
                lit += 1;
            }
        }
    }
    assert_eq!(lit, 40);
}

/// The 26 directions to the neighbours of a cell.
fn directions() -> impl Iterator<Item = Vec3> {
    let all = (0..27).map(|i| [i % 3, i / 3 % 3, i / 9].map(|c| c as f32 - 1.0));
    all.map(Vec3::from).filter(|d| *d != Vec3::ZERO)
}

#[test]
fn rays_along_axes_and_diagonals_and_through_faces_and_corners() {
    let volume = &volumes([12, 12, 12], [1.0; 3], 9)[0];
    let middle = Vec3::splat(5.5);
    for direction in directions() {
        let up = if direction.z == 0.0 {
            Vec3::Z
        } else {
            Vec3::new(1.0, -0.3, 0.0)
        };
        let up = if direction.cross(up) == Vec3::ZERO {
            Vec3::Y
        } else {
            up
        };
        // Odd sizes have a pixel in the middle that looks exactly along the direction.
        for centre in [
            middle,
            Vec3::ZERO,
            Vec3::splat(11.0),
            Vec3::new(5.0, 11.0, -0.0),
        ] {
            for far in [0.0, 30.0] {
                // From the border and from outside; zeros of either sign.
                let eye = centre - direction * (far + 0.01);
                let camera = Camera::new(eye, centre, up, 20.0).unwrap();
                check(volume, camera, [5, 3], 1.0);
                let camera = OrthographicCamera::new(eye, centre, up, 9.0).unwrap();
                check(volume, camera, [5, 3], 1.0);
            }
        }
    }
}

#[test]
fn samples_of_far_cameras_lie_where_they_belong() {
    let volume = &volumes([20, 17, 31], [1.0, 1.5, 0.7], 3)[0];
    let extent = volume.extent();
    let (middle, diagonal) = (extent * 0.5, extent.length());
    let mut most = 0.0_f64;
    for direction in directions().map(|d| (d + Vec3::new(0.13, -0.21, 0.08)).normalize()) {
        for far in [0.7, 8.0, 100.0, 1e3, 1e4, 1e5] {
            let eye = middle + direction * (diagonal * far);
            let angle = 2.0 * (0.5 / far).atan().to_degrees();
            let pinhole = Camera::new(eye, middle, Vec3::new(0.1, 0.9, 0.3), angle.min(80.0));
            let parallel = OrthographicCamera::new(eye, middle, Vec3::new(0.1, 0.9, 0.3), diagonal);
            for camera in [AnyCamera::from(pinhole.unwrap()), parallel.unwrap().into()] {
                let (size, step) = ([9, 7], 0.75);
                let frame = camera.picture_frame(size[0], size[1]).unwrap();
                let view = View::new(volume, &frame, step, None, Jitter::None).unwrap();
                let length = f64::from(step) * f64::from(volume.unit_length());
                let mut hit = 0;
                for pixel in 0..size[0] * size[1] {
                    let place = [pixel % size[0], pixel / size[0]].map(|c| c as f32 + 0.5);
                    let lattice = reference::lattice(&view, place[0], place[1], 0.0);
                    let [start, along] = frame.ray(place[0].into(), place[1].into());
                    hit += u32::from(lattice.first <= lattice.last);
                    for k in [lattice.first, lattice.last] {
                        if lattice.first > lattice.last {
                            continue;
                        }
                        let number = view.base() + f64::from(lattice.number) + f64::from(k);
                        for axis in 0..3 {
                            let world = start[axis] + along[axis] * length * number;
                            let exact = world / f64::from(volume.spacing()[axis]);
                            let found = k * lattice.step[axis] + lattice.origin[axis];
                            most = most.max((f64::from(found) - exact).abs());
                        }
                    }
                }
                assert!(hit > 10, "{far} {camera:?}");
            }
        }
    }
    assert!(most < 1e-3, "{most} voxels");
}

#[test]
fn kernels_agree_from_afar_and_among_spacings_that_differ_by_a_thousand() {
    for (spacing, far) in [
        ([1.0, 1.5, 0.7], 1e4),
        ([1000.0, 1.0, 30.0], 1.0),
        ([1e-6; 3], 1.5),
    ] {
        for volume in &volumes([9, 8, 10], spacing, 3) {
            let extent = volume.extent();
            let eye = extent * 0.5 + Vec3::new(0.6, -0.7, 0.4) * (extent.length() * far);
            let angle = (2.0 * (0.5 / far).atan().to_degrees()).min(60.0);
            let camera = Camera::new(eye, extent * 0.5, Vec3::Z, angle).unwrap();
            // Few samples, though a voxel may be a thousand steps long.
            check(volume, camera, [11, 9], 20.0);
            let height = extent.length();
            let camera = OrthographicCamera::new(eye, extent * 0.5, Vec3::Z, height).unwrap();
            check(volume, camera, [11, 9], 20.0);
        }
    }
}

#[test]
fn jitter_moves_samples_of_a_pixel_together_and_less_than_a_step() {
    let volume = &volumes([20, 17, 31], [1.0, 1.5, 0.7], 3)[1];
    let extent = volume.extent();
    let eye = extent * 0.5 + Vec3::new(50.0, -30.0, 20.0);
    let camera = Camera::new(eye, extent * 0.5, Vec3::Z, 40.0).unwrap();
    let caster = Raycaster::new(volume).unwrap();
    let prepared = caster.prepare(&functions(volume)[1]);
    let render = |jitter, isa, skipping| {
        let options = CastOptions {
            jitter,
            isa,
            skipping,
            ..CastOptions::default()
        };
        let fast = prepared.render(camera, [31, 30], &options).unwrap();
        let slow = prepared.render_slowly(camera, [31, 30], &options).unwrap();
        assert_eq!((&fast.image, &fast.end), (&slow.image, &slow.end));
        fast
    };
    let still = render(Jitter::None, Isa::Portable, Skipping::None);
    for isa in Isa::ALL.into_iter().filter(|isa| isa.is_available()) {
        for skipping in [Skipping::None, Skipping::Distance] {
            let moved = render(Jitter::PerPixel, isa, skipping);
            assert_ne!(moved.image, still.image);
            for (a, b) in moved.opacity.iter().zip(&still.opacity) {
                assert!((a - b).abs() < 0.3, "{a} {b}");
            }
        }
    }
}

#[test]
fn pictures_of_any_shape() {
    let volume = &volumes([12, 9, 10], [1.0; 3], 9)[0];
    let caster = Raycaster::new(volume).unwrap();
    let function = &functions(volume)[1];
    let camera = Camera::new(Vec3::splat(30.0), Vec3::splat(5.0), Vec3::Z, 30.0).unwrap();
    let options = CastOptions::default();
    for size in [[1, 1], [1, 20_000], [20_000, 1], [33, 65]] {
        let picture = caster.render(function, camera, size, &options).unwrap();
        assert_eq!(picture.opacity.len(), (size[0] * size[1]) as usize);
        assert!(picture.opacity.iter().all(|o| (0.0..=1.0).contains(o)));
        // Two pixels beside the middle of a flat picture already look past the volume.
        let is_seen = size[0] < 20_000;
        assert_eq!(
            picture.opacity.iter().any(|&o| o > 0.0),
            is_seen,
            "{size:?}"
        );
    }
    for size in [[0, 5], [5, 0]] {
        assert!(caster.render(function, camera, size, &options).is_err());
    }
}

#[test]
fn views_that_cannot_be_cast_are_refused() {
    let volume = &volumes([12, 9, 10], [1.0; 3], 9)[0];
    let caster = Raycaster::new(volume).unwrap();
    let function = &functions(volume)[1];
    let from = |far: f32, step: f32| {
        let camera = Camera::new(Vec3::X * far, Vec3::ZERO, Vec3::Z, 1.0).unwrap();
        let options = CastOptions {
            step,
            ..CastOptions::default()
        };
        caster
            .render(function, camera, [2, 2], &options)
            .map(|_| ())
    };
    assert_eq!(from(1e9, 1.0), Ok(()));
    assert!(matches!(from(1e13, 1.0), Err(CastError::TooFar { .. })));
    assert!(matches!(
        from(30.0, 1e-7),
        Err(CastError::TooManySamples { .. })
    ));
    for step in [0.0, -1.0, f32::NAN, f32::INFINITY] {
        assert!(matches!(from(30.0, step), Err(CastError::Step { .. })));
    }
    assert_eq!(check_size([1 << 20, 1, 1], 1 << 20), Ok(()));
    assert!(matches!(
        check_size([1, (1 << 20) + 1, 1], (1 << 20) + 1),
        Err(CastError::TooLong { axis: 1, .. })
    ));
    assert!(matches!(
        check_size([2048; 3], 1 << 33),
        Err(CastError::TooLarge { .. })
    ));
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]
    #[test]
    fn any_view_of_any_volume(
        dims in prop::array::uniform3(1usize..24),
        spacing in prop::array::uniform3(0.2f32..3.0),
        origin in prop::array::uniform3(-1.5f32..2.5),
        target in prop::array::uniform3(0.0f32..1.0),
        fov in 5.0f32..120.0,
        step in 0.2f32..3.0,
        seed in 0u32..1000,
        which in 0usize..4,
    ) {
        let volume = &volumes(dims, spacing, seed)[which];
        let extent = volume.extent().max(Vec3::splat(0.5));
        let camera = Camera::new(Vec3::from(origin) * extent, Vec3::from(target) * extent, Vec3::new(0.1, 0.2, 1.0), fov);
        if let Ok(camera) = camera {
            check(volume, &camera, [23, 19], step);
        }
    }
}

#[test]
fn a_constant_medium_is_as_opaque_as_its_length_says() {
    let volume = Volume::new(
        [33, 33, 33],
        [1.0; 3],
        Voxels::U8(vec![7; 33 * 33 * 33]),
        ValueScale::default(),
    )
    .unwrap();
    let caster = Raycaster::new(&volume).unwrap();
    let function = function(&[[0.0, 0.5, 0.25, 1.0, 0.05]]);
    let camera = Camera::new(
        Vec3::new(16.0, 16.0, -40.0),
        Vec3::splat(16.0),
        Vec3::Y,
        10.0,
    )
    .unwrap();
    for step in [2.0, 1.0, 0.5, 0.25] {
        let options = CastOptions {
            step,
            termination: 1.0,
            ..CastOptions::default()
        };
        let picture = caster.render(&function, &camera, [1, 1], &options).unwrap();
        // Samples at 40, 40 + step, … 72: one more than there are steps.
        let expected = 1.0 - 0.95_f64.powf(f64::from(32.0 + step));
        assert!(
            (f64::from(picture.opacity[0]) - expected).abs() < 1e-5,
            "{step}: {}",
            picture.opacity[0]
        );
        let [r, g, b] = picture.image.pixels()[0].map(f64::from);
        assert!(
            (r - 0.5 * expected).abs() < 1e-5
                && (g - 0.25 * expected).abs() < 1e-5
                && (b - expected).abs() < 1e-5
        );
    }
}

#[test]
fn what_is_hidden_is_taken_to_be_the_same() {
    let volume = &volumes([20, 20, 20], [1.0; 3], 5)[0];
    let caster = Raycaster::new(volume).unwrap();
    let function = function(&[[0.0, 0.8, 0.4, 0.2, 0.3]]);
    let camera = Camera::new(Vec3::splat(-30.0), Vec3::splat(9.5), Vec3::Z, 40.0).unwrap();
    let render = |termination, behind| {
        let options = CastOptions {
            termination,
            behind,
            ..CastOptions::default()
        };
        caster
            .render(&function, &camera, [16, 16], &options)
            .unwrap()
    };
    let exact = render(1.0, Behind::Nothing);
    let errors = |behind| {
        let picture = render(0.9, behind);
        let pixels = picture.image.pixels().iter().zip(exact.image.pixels());
        let errors: Vec<f32> = pixels.map(|(a, b)| (a[0] - b[0]).abs()).collect();
        let mean = errors.iter().sum::<f32>() / errors.len() as f32;
        (errors.into_iter().fold(0.0, f32::max), mean)
    };
    let [(most, mean), (most_dark, mean_dark)] = [Behind::TheSame, Behind::Nothing].map(errors);
    // Never more than what a ray of the threshold's opacity lacks, in red.
    assert!(most.max(most_dark) <= 0.08 + 1e-6, "{most} {most_dark}");
    assert!(mean < 0.3 * mean_dark, "{mean} {mean_dark}");
}

#[test]
fn a_clip_box_takes_samples_away_and_moves_none() {
    let volume = &volumes([20, 17, 31], [1.0, 1.5, 0.7], 3)[1];
    let extent = volume.extent();
    let camera = Camera::new(
        extent * 0.5 + Vec3::new(50.0, -30.0, 20.0),
        extent * 0.5,
        Vec3::Z,
        40.0,
    )
    .unwrap();
    let caster = Raycaster::new(volume).unwrap();
    let prepared = caster.prepare(&functions(volume)[1]);
    let render = |clip: Option<(Vec3, Vec3)>, isa| {
        let clip = clip.map(|(min, max)| Aabb { min, max });
        let options = CastOptions {
            clip,
            isa,
            ..CastOptions::default()
        };
        let picture = prepared.render(&camera, [40, 40], &options).unwrap();
        let slow = prepared.render_slowly(&camera, [40, 40], &options).unwrap();
        assert_eq!((&picture.image, &picture.end), (&slow.image, &slow.end));
        picture
    };
    for isa in Isa::ALL.into_iter().filter(|isa| isa.is_available()) {
        let whole = render(None, isa);
        let around = render(Some((Vec3::splat(-9.0), extent + 9.0)), isa);
        assert_eq!(around, whole);
        let half = render(Some((Vec3::ZERO, extent * Vec3::new(1.0, 0.5, 1.0))), isa);
        assert!(half.work.samples < whole.work.samples * 2 / 3);
        // What a ray meets first is seen the same if it is inside.
        let same = half.image.pixels().iter().zip(whole.image.pixels());
        assert!(same.filter(|(a, b)| a == b && a[0] > 0.0).count() > 20);
        let nothing = render(Some((extent, Vec3::ZERO)), isa);
        assert_eq!(
            (nothing.work, nothing.opacity.iter().sum::<f32>()),
            (Work::default(), 0.0)
        );
    }
    let clip = Some(Aabb {
        min: Vec3::NAN,
        max: extent,
    });
    let options = CastOptions {
        clip,
        ..CastOptions::default()
    };
    let error = caster
        .render(&functions(volume)[1], &camera, [4, 4], &options)
        .unwrap_err();
    assert!(matches!(error, CastError::Clip { .. }));
}

/// Values that rise by 4 for each voxel along x.
fn ramp() -> Volume {
    let dims = [60, 20, 20];
    let values = (0..60 * 20 * 20).map(|i| (i % 60 * 4) as u8).collect();
    Volume::new(dims, [1.0; 3], Voxels::U8(values), ValueScale::default()).unwrap()
}

/// Straight along x at the middle.
fn along_x() -> Camera {
    Camera::new(Vec3::new(-300.0, 9.5, 9.5), Vec3::splat(9.5), Vec3::Z, 1.0).unwrap()
}

fn lit_along_x(appearance: Appearance, step: f32) -> [f32; 3] {
    let volume = ramp();
    let picture = check_appearance(&volume, appearance, &along_x(), [3, 3], step);
    picture.image.pixels()[4]
}

#[test]
fn a_surface_is_lit_as_the_angle_of_its_gradient_says() {
    let clear = function(&[[0.0; 5]]);
    let surface = |opacity| IsoSurface {
        value: 101.0,
        colour: [0.5, 0.25, 1.0],
        opacity,
    };
    let mut appearance = Appearance::from(clear);
    appearance.surfaces = vec![surface(1.0)];
    assert_eq!(lit_along_x(appearance.clone(), 1.0), [0.5, 0.25, 1.0]);
    // Its opacity does not depend on the step.
    appearance.surfaces = vec![surface(0.5)];
    for step in [0.3, 1.0, 7.0] {
        let seen = lit_along_x(appearance.clone(), step);
        assert!((seen[2] - 0.5).abs() < 1e-6, "{step}: {seen:?}");
    }
    // Lit from the eye it has all of the light, from a slant of 60° half, from behind as from before.
    appearance.surfaces = vec![surface(1.0)];
    for (light, straight) in [
        (crate::appearance::Light::Head, 1.0),
        (crate::appearance::Light::From(Vec3::X * 4.0), 1.0),
        (
            crate::appearance::Light::From(Vec3::new(-0.5, 0.75_f32.sqrt(), 0.0)),
            0.5,
        ),
        (crate::appearance::Light::From(Vec3::Z), 0.0),
    ] {
        appearance.shading = Some(Shading {
            ambient: 0.2,
            diffuse: 0.6,
            specular: 0.0,
            shininess: 1,
            light,
        });
        let seen = lit_along_x(appearance.clone(), 1.0);
        let expected = 0.5 * (0.2 + 0.6 * straight);
        assert!((seen[0] - expected).abs() < 1e-4, "{light:?}: {seen:?}");
    }
}

#[test]
fn what_is_thinner_than_a_step_is_seen_by_pre_integration() {
    // Opaque over a twentieth of a voxel.
    let function = function(&[
        [100.9, 0.0, 1.0, 0.0, 0.0],
        [100.9, 0.0, 1.0, 0.0, 1.0],
        [102.1, 0.0, 1.0, 0.0, 1.0],
        [102.1, 0.0, 1.0, 0.0, 0.0],
    ]);
    let mut appearance = Appearance::from(function);
    let sampled = |appearance: &Appearance| {
        let steps = [0.9, 1.1, 1.3, 1.7, 2.1];
        steps.map(|step| lit_along_x(appearance.clone(), step)[1])
    };
    assert!(sampled(&appearance).contains(&0.0), "some steps miss it");
    appearance.integration = Integration::PreIntegrated;
    for seen in sampled(&appearance) {
        assert!((seen - 1.0).abs() < 1e-5, "{seen}");
    }
}

#[test]
fn of_the_nearest_voxel_there_are_no_values_between() {
    // Seen where no voxel is.
    let between = function(&[
        [100.5, 0.0, 1.0, 0.0, 0.0],
        [100.5, 0.0, 1.0, 0.0, 1.0],
        [103.5, 0.0, 1.0, 0.0, 1.0],
        [103.5, 0.0, 1.0, 0.0, 0.0],
    ]);
    let mut appearance = Appearance::from(between);
    assert!(lit_along_x(appearance.clone(), 0.2)[1] > 0.9);
    appearance.interpolation = Interpolation::Nearest;
    assert_eq!(lit_along_x(appearance, 0.2), [0.0; 3]);
}

#[test]
fn appearances_without_a_meaning() {
    let volume = ramp();
    let caster = Raycaster::new(&volume).unwrap();
    let refused = |change: &dyn Fn(&mut Appearance)| {
        let mut appearance = Appearance::from(function(&[[0.0; 5]]));
        appearance.shading = Some(Shading::default());
        appearance.surfaces = vec![IsoSurface {
            value: 1.0,
            colour: [0.5; 3],
            opacity: 1.0,
        }];
        change(&mut appearance);
        caster.prepare_appearance(appearance).err()
    };
    assert_eq!(refused(&|_| ()), None);
    let shading = |change: fn(&mut Shading)| {
        refused(&|appearance| {
            if let Some(shading) = &mut appearance.shading {
                change(shading);
            }
        })
    };
    assert!(matches!(
        shading(|s| s.ambient = -0.1),
        Some(AppearanceError::Share {
            name: "ambient",
            ..
        })
    ));
    assert!(matches!(
        shading(|s| s.specular = f32::INFINITY),
        Some(AppearanceError::Share {
            name: "specular",
            ..
        })
    ));
    assert!(matches!(
        shading(|s| s.shininess = 0),
        Some(AppearanceError::Shininess { shininess: 0 })
    ));
    assert!(matches!(
        shading(|s| s.light = crate::appearance::Light::From(Vec3::ZERO)),
        Some(AppearanceError::LightDirection { .. })
    ));
    for surface in [
        |s: &mut IsoSurface| s.value = f32::NAN,
        |s: &mut IsoSurface| s.opacity = 1.5,
        |s: &mut IsoSurface| s.colour[1] = -1.0,
    ] {
        let error = refused(&|appearance| surface(&mut appearance.surfaces[0]));
        assert!(matches!(error, Some(AppearanceError::Surface { .. })));
    }
}

#[test]
fn a_ray_that_leaves_empty_space_has_a_sample_before_it() {
    // A ball in the middle of nothing, seen by its surface alone.
    let dims = [40, 36, 44];
    let ball = |i: usize| {
        let place = [i % 40, i / 40 % 36, i / (40 * 36)].map(|c| c as f32 - 20.0);
        (200.0 - 16.0 * Vec3::from(place).length()).clamp(0.0, 255.0) as u8
    };
    let values = (0..40 * 36 * 44).map(ball).collect();
    let volume = Volume::new(dims, [1.0; 3], Voxels::U8(values), ValueScale::default()).unwrap();
    let mut appearance = Appearance::from(function(&[[0.0; 5]]));
    appearance.surfaces = vec![IsoSurface {
        value: 90.5,
        colour: [1.0, 0.5, 0.2],
        opacity: 0.7,
    }];
    let camera = Camera::new(
        Vec3::new(90.0, -60.0, 50.0),
        Vec3::splat(20.0),
        Vec3::Z,
        25.0,
    );
    for step in [0.7, 2.3, 5.0] {
        let camera = camera.unwrap();
        let picture = check_appearance(&volume, appearance.clone(), &camera, [40, 40], step);
        assert!(picture.opacity.iter().filter(|&&o| o > 0.5).count() > 50);
    }
}

#[test]
fn a_step_over_missing_values_is_not_skipped() {
    // 1, a sheet of nothing, 6: nothing is seen of either, and something of the step over the sheet.
    let volume = Volume::new(
        [40, 20, 20],
        [1.0; 3],
        Voxels::F32(
            (0..40 * 20 * 20)
                .map(|i| match i % 40 {
                    0..20 => 1.0,
                    20 => f32::NAN,
                    _ => 6.0,
                })
                .collect(),
        ),
        ValueScale::default(),
    )
    .unwrap();
    let mut appearance = Appearance::from(function(&[[0.0; 5]]));
    appearance.surfaces = vec![IsoSurface {
        value: 3.0,
        colour: [1.0; 3],
        opacity: 1.0,
    }];
    // Two samples that follow each other have values only if none is within a voxel of the sheet.
    let crossed = [2.1, 2.6, 3.1, 3.7].map(|step| {
        let picture = check_appearance(&volume, appearance.clone(), &along_x(), [3, 3], step);
        picture.opacity[4]
    });
    assert!(crossed.contains(&1.0), "{crossed:?}");
}
