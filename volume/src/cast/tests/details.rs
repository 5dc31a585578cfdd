//! What can be asked for beyond samples of a transfer function.

use super::*;
use crate::appearance::{Interpolation, Light, Shading};

/// Everything that can be asked for, alone and together.
pub(super) fn appearances(volume: &Volume, function: &TransferFunction) -> Vec<Appearance> {
    let [low, high] = volume.range();
    let surface = |share: f32, opacity| IsoSurface {
        value: low + (high - low) * share,
        colour: [0.3, 0.9, share * 0.5],
        opacity,
    };
    let shading = Shading {
        light: Light::From(Vec3::new(1.0, 2.0, -0.5)),
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
                        check_appearance(&volume, appearance, camera, [37, 29], step);
                    }
                }
            }
        }
    }
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
    let picture = check_appearance(&volume, appearance, along_x(), [3, 3], step);
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
        (Light::Head, 1.0),
        (Light::From(Vec3::X * 4.0), 1.0),
        (Light::From(Vec3::new(-0.5, 0.75_f32.sqrt(), 0.0)), 0.5),
        (Light::From(Vec3::Z), 0.0),
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
        shading(|s| s.light = Light::From(Vec3::ZERO)),
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
        let picture = check_appearance(&volume, appearance.clone(), camera, [40, 40], step);
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
        let picture = check_appearance(&volume, appearance.clone(), along_x(), [3, 3], step);
        picture.opacity[4]
    });
    assert!(crossed.contains(&1.0), "{crossed:?}");
}
