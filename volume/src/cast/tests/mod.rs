//! Kernels against the slow twin.

mod details;
mod geometry;
mod sparse;

use glam::Vec3;
use proptest::prelude::*;
use raywright_bvh::{Aabb, BuildParams, Isa, Quality};
use raywright_imaging::{AnyCamera, Camera};

use super::*;
use crate::{
    enclosure::EnclosureKind,
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
    let mut prepared = caster.prepare_appearance(appearance.clone()).unwrap();
    let expected = prepared.render_slowly(camera, size, &options).unwrap();
    for (skipping, enclosure) in ways_to_skip() {
        enclose(&mut prepared, enclosure.as_ref());
        for isa in Isa::ALL.into_iter().filter(|isa| isa.is_available()) {
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
                    "pixel {i}, {isa}, {skipping:?}, {enclosure:?}, {appearance:?}"
                );
            }
        }
    }
    expected
}

fn enclose(prepared: &mut Prepared<'_>, enclosure: Option<&EnclosureParams>) {
    if let Some(params) = enclosure {
        let mut workspace = BuildWorkspace::default();
        prepared.enclose(params, &mut workspace).unwrap();
    }
}

/// All ways to leave out empty space, with trees of several kinds.
fn ways_to_skip() -> Vec<(Skipping, Option<EnclosureParams>)> {
    let mut ways = vec![(Skipping::None, None), (Skipping::Distance, None)];
    for kind in [EnclosureKind::Hull, EnclosureKind::Segments] {
        for (block_edge, branching_factor, quality) in
            [(4, 8, Quality::BinnedSah), (8, 2, Quality::Morton)]
        {
            let mut params = EnclosureParams::new(kind);
            params.block_edge = block_edge;
            params.build.branching_factor = branching_factor;
            params.build.quality = quality;
            ways.push((Skipping::Enclosure, Some(params)));
        }
    }
    ways
}

#[test]
fn an_enclosure_is_asked_for_before_it_is_used() {
    let volume = &volumes([20, 17, 31], [1.0; 3], 3)[0];
    let caster = Raycaster::new(volume).unwrap();
    let mut prepared = caster.prepare(&functions(volume)[0]);
    let camera = Camera::new(Vec3::splat(60.0), Vec3::splat(9.0), Vec3::Z, 30.0).unwrap();
    let options = CastOptions {
        skipping: Skipping::Enclosure,
        ..CastOptions::default()
    };
    let render = |prepared: &Prepared<'_>| prepared.render(camera, [8, 8], &options);
    assert_eq!(render(&prepared), Err(CastError::NotEnclosed));
    let mut workspace = BuildWorkspace::default();
    for block_edge in [0, 2, 12] {
        let mut params = EnclosureParams::new(EnclosureKind::Hull);
        params.block_edge = block_edge;
        let error = prepared.enclose(&params, &mut workspace).unwrap_err();
        let least = 4;
        assert_eq!(error, EnclosureError::BlockEdge { block_edge, least });
    }
    let mut params = EnclosureParams::new(EnclosureKind::Segments);
    params.build = BuildParams::default();
    params.build.branching_factor = 99;
    assert!(matches!(
        prepared.enclose(&params, &mut workspace),
        Err(EnclosureError::Build(_))
    ));
    params.build = BuildParams::default();
    params.block_edge = 4;
    let stats = prepared.enclose(&params, &mut workspace).unwrap();
    assert!(stats.leaves > 0);
    assert!(render(&prepared).is_ok());
}

#[test]
fn the_work_of_rays_is_that_of_the_picture() {
    let volume = &volumes([20, 17, 31], [1.0, 1.5, 0.7], 3)[0];
    let caster = Raycaster::new(volume).unwrap();
    let extent = volume.extent();
    let eye = extent * 0.5 + Vec3::new(50.0, -30.0, 20.0);
    let camera = Camera::new(eye, extent * 0.5, Vec3::Z, 40.0).unwrap();
    for appearance in appearances_with_plain(volume) {
        let mut prepared = caster.prepare_appearance(appearance).unwrap();
        for (skipping, enclosure) in ways_to_skip() {
            enclose(&mut prepared, enclosure.as_ref());
            for isa in Isa::ALL.into_iter().filter(|isa| isa.is_available()) {
                let mut options = CastOptions {
                    isa,
                    skipping,
                    ..CastOptions::default()
                };
                let total = prepared.render(camera, [41, 35], &options).unwrap();
                options.counts = Counts::PerRay;
                let counted = prepared.render(camera, [41, 35], &options).unwrap();
                let slow = prepared.render_slowly(camera, [41, 35], &options).unwrap();
                assert_eq!((&counted.image, counted.work), (&total.image, total.work));
                assert!(total.ray_work.is_empty());
                let sum = |of: fn(&RayWork) -> u32| {
                    counted
                        .ray_work
                        .iter()
                        .map(|work| u64::from(of(work)))
                        .sum::<u64>()
                };
                assert_eq!(sum(|work| work.samples), total.work.samples);
                assert_eq!(sum(|work| work.skips), total.work.skips);
                assert!(total.work.packet_steps > 0);
                for (fast, slow) in counted.ray_work.iter().zip(&slow.ray_work) {
                    // The second sample of a pair may be one too many.
                    match skipping {
                        Skipping::None => assert!(fast.samples.abs_diff(slow.samples) <= 1),
                        _ => assert!(fast.samples <= slow.samples + 1),
                    }
                }
            }
        }
    }
}

fn appearances_with_plain(volume: &Volume) -> Vec<Appearance> {
    let function = &functions(volume)[0];
    let mut all = details::appearances(volume, function);
    all.push(function.clone().into());
    all
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
                check(&volume, camera, [45, 38], 0.8);
                lit += 1;
            }
        }
    }
    assert_eq!(lit, 40);
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
            check(volume, camera, [23, 19], step);
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
        let picture = caster.render(&function, camera, [1, 1], &options).unwrap();
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
            .render(&function, camera, [16, 16], &options)
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
        let picture = prepared.render(camera, [40, 40], &options).unwrap();
        let slow = prepared.render_slowly(camera, [40, 40], &options).unwrap();
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
        .render(&functions(volume)[1], camera, [4, 4], &options)
        .unwrap_err();
    assert!(matches!(error, CastError::Clip { .. }));
}

#[test]
fn parts_have_every_row_once_and_are_spread() {
    for height in [1, 31, 32, 33, 480, 512, 1000, 1024, 5000] {
        let parts = parts(height);
        let mut rows: Vec<u32> = parts.iter().flatten().cloned().flatten().collect();
        rows.sort_unstable();
        assert!(rows.into_iter().eq(0..height));
        assert!(parts.len() <= 16 && parts.iter().all(|part| !part.is_empty()));
    }
    let first: Vec<u32> = parts(1024)[..4]
        .iter()
        .flatten()
        .map(|rows| rows.start / 256)
        .collect();
    assert!((0..4).all(|quarter| first.contains(&quarter)), "{first:?}");
}

#[test]
fn a_picture_in_parts_has_the_rows_of_whole_ones() {
    let volume = &volumes([20, 17, 31], [1.0, 1.5, 0.7], 3)[0];
    let caster = Raycaster::new(volume).unwrap();
    let extent = volume.extent();
    let eye = extent * 0.5 + Vec3::new(40.0, -20.0, 20.0);
    let camera = Camera::new(eye, extent * 0.5, Vec3::Z, 40.0).unwrap();
    let (size, options) = ([37, 150], CastOptions::default());
    for appearance in appearances_with_plain(volume) {
        let prepared = caster.prepare_appearance(appearance).unwrap();
        let whole = |step: f32| {
            let options = CastOptions { step, ..options };
            prepared.render(camera, size, &options).unwrap()
        };
        let same = prepared
            .render_in_parts(camera, size, &options, |_, _| 1.0)
            .unwrap();
        let mut once = whole(1.0);
        // Lanes are filled from other tiles.
        once.work.packet_steps = same.work.packet_steps;
        assert_eq!(
            (same.image, same.opacity, same.end),
            (once.image, once.opacity, once.end)
        );
        let steps: Vec<f32> = (0..parts(size[1]).len())
            .map(|i| 0.5 + 0.1 * i as f32)
            .collect();
        let mut told = Vec::new();
        let mixed = prepared.render_in_parts(camera, size, &options, |part, work| {
            told.push(work.samples);
            steps[part]
        });
        let mixed = mixed.unwrap();
        told.push(mixed.work.samples);
        assert!(told[0] == 0 && told.is_sorted() && told.len() == steps.len() + 1);
        for (part, step) in parts(size[1]).iter().zip(steps) {
            let whole = whole(step);
            for y in part.iter().cloned().flatten() {
                for x in 0..size[0] {
                    assert_eq!(
                        mixed.image.get(x, y),
                        whole.image.get(x, y),
                        "{x} {y} {step}"
                    );
                }
            }
        }
    }
}
