//! Views at the extremes.

use raywright_imaging::OrthographicCamera;

use super::*;

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
