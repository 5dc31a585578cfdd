//! Pictures with fewer rays than pixels against full ones and the slow twin.

use super::*;
use crate::cast::sparse::{fill, silhouettes};

fn scene() -> (Volume, Camera) {
    let volume = volumes([40, 33, 37], [1.0, 1.1, 0.9], 5).remove(0);
    let camera = Camera::new(
        Vec3::new(90.0, 60.0, -40.0),
        Vec3::splat(18.0),
        Vec3::Y,
        32.0,
    );
    (volume, camera.unwrap())
}

const LATTICES: [PixelsPerRay; 2] = [PixelsPerRay::Checker, PixelsPerRay::Four];

#[test]
fn pixels_with_rays_are_those_of_the_full_picture() {
    let (volume, camera) = scene();
    let caster = Raycaster::new(&volume).unwrap();
    // Sizes that end within tiles, and odd ones.
    for size in [[70, 45], [33, 64], [1, 1], [2, 1], [1, 2]] {
        for function in functions(&volume) {
            let prepared = caster.prepare(&function);
            let full = prepared
                .render(camera, size, &CastOptions::default())
                .unwrap();
            for pixels_per_ray in LATTICES {
                for isa in Isa::ALL.into_iter().filter(|isa| isa.is_available()) {
                    let options = CastOptions {
                        pixels_per_ray,
                        isa,
                        ..CastOptions::default()
                    };
                    let sparse = prepared.render(camera, size, &options).unwrap();
                    let slow = prepared.render_slowly(camera, size, &options).unwrap();
                    assert_eq!(
                        sparse.image, slow.image,
                        "{pixels_per_ray:?} {isa} {size:?}"
                    );
                    assert_eq!((&sparse.opacity, &sparse.end), (&slow.opacity, &slow.end));
                    let parts = prepared
                        .render_in_parts(camera, size, &options, |_, _| 1.0)
                        .unwrap();
                    assert_eq!(parts.image, sparse.image);
                    assert_eq!(parts.work.rays, sparse.work.rays);
                    let marks = silhouettes(&sparse, pixels_per_ray);
                    let mut rays = 0;
                    for y in 0..size[1] {
                        for x in 0..size[0] {
                            let i = (y * size[0] + x) as usize;
                            let on_lattice = Chosen::Lattice(pixels_per_ray).has(x, y);
                            if on_lattice || marks[i] {
                                rays += 1;
                                assert_eq!(sparse.image.pixels()[i], full.image.pixels()[i]);
                                assert_eq!(sparse.opacity[i], full.opacity[i]);
                                assert_eq!(sparse.end[i], full.end[i]);
                            }
                        }
                    }
                    assert!(sparse.work.rays <= rays);
                    assert!(sparse.work.samples <= full.work.samples);
                }
            }
        }
    }
}

/// Root mean square of the difference of colours.
fn difference(a: &Picture, b: &Picture) -> f64 {
    let squares: f64 = (a.image.pixels().iter().zip(b.image.pixels()))
        .flat_map(|(a, b)| (0..3).map(|c| f64::from(a[c] - b[c]).powi(2)))
        .sum();
    (squares / (3 * a.opacity.len()) as f64).sqrt()
}

#[test]
fn fewer_rays_are_less_work_and_little_error() {
    let (volume, camera) = scene();
    let caster = Raycaster::new(&volume).unwrap();
    let size = [160, 120];
    let prepared = caster.prepare(&functions(&volume)[1]);
    let render = |pixels_per_ray| {
        let options = CastOptions {
            pixels_per_ray,
            ..CastOptions::default()
        };
        prepared.render(camera, size, &options).unwrap()
    };
    let full = render(PixelsPerRay::One);
    for (lattice, most_error) in [(PixelsPerRay::Checker, 0.01), (PixelsPerRay::Four, 0.02)] {
        let sparse = render(lattice);
        let share = sparse.work.samples as f64 / full.work.samples as f64;
        assert!(share < 1.3 / lattice.count(), "{lattice:?}: {share}");
        let error = difference(&sparse, &full);
        assert!(error > 0.0 && error < most_error, "{lattice:?}: {error}");
    }
}

#[test]
fn what_is_linear_is_made_exactly() {
    // Nothing but a ramp of opacity: the mean of neighbours is what is between them, nearly.
    let full = |size: [u32; 2]| {
        let mut picture = blank(size, &CastOptions::default()).unwrap();
        for y in 0..size[1] {
            for x in 0..size[0] {
                let i = (y * size[0] + x) as usize;
                picture.opacity[i] = 0.1 + x as f32 / 64.0 + y as f32 / 128.0;
                picture.image.pixels_mut()[i] = [picture.opacity[i]; 3];
            }
        }
        picture
    };
    for lattice in LATTICES {
        let expected = full([9, 9]);
        let mut made = expected.clone();
        for y in 0..9 {
            for x in 0..9 {
                if !Chosen::Lattice(lattice).has(x, y) {
                    made.opacity[(y * 9 + x) as usize] = -1.0;
                }
            }
        }
        fill(&mut made, lattice, &[false; 81]);
        for y in 1..8 {
            for x in 1..8 {
                let i = (y * 9 + x) as usize;
                assert!((made.opacity[i] - expected.opacity[i]).abs() < 1e-6);
            }
        }
    }
}
