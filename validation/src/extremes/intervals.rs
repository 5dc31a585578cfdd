//! T09, T10: where a ray begins and ends, and rays that are none.

use raywright_bvh::{Ray, Vec3, Work, reference};

use super::{
    ExtremesError, Findings, Settings, meshes,
    modes::{ACCURACIES, ask_all, bits, label, name},
};

/// A triangle across the axis z.
fn layer(z: f32) -> [Vec3; 3] {
    [[-9.0, -9.0], [9.0, -9.0], [0.0, 9.0]].map(|[x, y]| Vec3::new(x, y, z))
}

/// T09: intervals are closed; a chain of hits finds each plane once.
pub(super) fn ends(_: &Settings, findings: &mut Findings) -> Result<(), ExtremesError> {
    let (before, after) = (1f32.next_down(), 1f32.next_up());
    let (inf, nan) = (f32::INFINITY, f32::NAN);
    // A plane at t = 1: interval, whether it is hit, Embree fast, Embree robust.
    let table = [
        ([1.0, 1.0], true, "miss, hit"),
        ([0.0, 1.0], true, "hit, hit"),
        ([1.0, 2.0], true, "miss, hit"),
        ([after, 2.0], false, "miss, miss"),
        ([0.0, before], false, "miss, miss"),
        ([before, 1.0], true, "hit, hit"),
        ([1.0, after], true, "miss, hit"),
        ([2.0, 1.0], false, "miss, miss"),
        ([-1.0, 2.0], true, "hit, hit"),
        ([0.0, -inf], false, "miss, but occluded"),
        ([nan, 2.0], false, "miss, miss"),
        ([0.0, nan], false, "miss, miss"),
        ([inf, inf], false, "miss, miss"),
    ];
    let mesh = meshes::soup(&[layer(1.0)])?;
    let down = Ray::new(Vec3::ZERO, Vec3::Z);
    let cases =
        table.map(|([low, high], is_hit, embree)| (down.with_range(low, high), is_hit, embree));
    let on_surface = Ray::new(Vec3::Z, Vec3::Z);
    let behind = Ray::new(2.0 * Vec3::Z, Vec3::Z);
    let others = [
        // On the triangle; a triangle behind, which a negative start does not reach.
        (on_surface, true, "miss, hit at -0"),
        (behind.with_range(-5.0, 5.0), false, "hit, hit"),
        // A light at the plane, and one just before it.
        (
            Ray::new(Vec3::ZERO, 4.0 * Vec3::Z).with_range(0.0, 0.25),
            true,
            "",
        ),
        (
            Ray::new(Vec3::ZERO, 4.0 * Vec3::Z).with_range(0.0, 0.25f32.next_down()),
            false,
            "",
        ),
    ];
    for (ray, is_hit, embree) in cases.into_iter().chain(others) {
        let mut as_expected = [true; 2];
        for accuracy in ACCURACIES {
            let answers = ask_all(&[&mesh], accuracy, |tree| {
                let hit = tree.closest_hit(&ray);
                hit.is_some() == is_hit
                    && tree.any_hit(&ray) == is_hit
                    && hit.is_none_or(|hit| ray.t_min.max(0.0) <= hit.t && hit.t <= ray.t_max)
                    // 0, and not its negative.
                    && hit.is_none_or(|hit| hit.t.is_sign_positive())
            })?;
            as_expected[accuracy as usize] = answers.into_iter().all(|right| right);
        }
        let title = format!("[{}, {}] from z = {}", ray.t_min, ray.t_max, ray.origin.z);
        let told = if is_hit { "hit, hit" } else { "miss, miss" };
        findings.demand(as_expected == [true; 2], || {
            format!(
                "{title}: not {told} but fast right {}, robust right {}",
                as_expected[0], as_expected[1]
            )
        });
        findings.figure(title, told, embree);
    }
    chain(findings)
}

/// From hit to hit by the next number beyond.
fn chain(findings: &mut Findings) -> Result<(), ExtremesError> {
    const PLANES: u32 = 100;
    let planes: Vec<_> = (0..PLANES).map(|i| layer(0.37 * i as f32)).collect();
    let mesh = meshes::soup(&planes)?;
    for (direction, what) in [
        (Vec3::Z, "straight"),
        (Vec3::new(0.011, 0.003, 1.0), "slanted"),
    ] {
        for accuracy in ACCURACIES {
            let answers = ask_all(&[&mesh], accuracy, |tree| {
                let mut ray = Ray::new(Vec3::new(0.0, 0.0, -1.0), direction);
                let mut ids = Vec::new();
                while let Some(hit) = tree.closest_hit(&ray) {
                    ids.push(hit.primitive_id);
                    ray = ray.with_range(hit.t.next_up(), f32::INFINITY);
                    if ids.len() > 2 * PLANES as usize {
                        break;
                    }
                }
                ids.into_iter().eq(0..PLANES)
            })?;
            let right = answers.into_iter().all(|right| right);
            findings.demand(right, || {
                format!(
                    "{}, {what}: a chain of hits does not find each plane once",
                    name(accuracy)
                )
            });
        }
        findings.figure(
            format!("{what} chain through {PLANES} planes"),
            "each once",
            "",
        );
    }
    Ok(())
}

const VALUES: [f32; 5] = [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, 0.0, -0.0];

fn set(ray: &mut Ray, field: usize, value: f32) {
    match field {
        0..3 => ray.origin[field] = value,
        3..6 => ray.direction[field - 3] = value,
        6 => ray.t_min = value,
        _ => ray.t_max = value,
    }
}

/// Whether it has an origin, a direction, and an interval with something in it.
fn is_ray(ray: &Ray) -> bool {
    ray.origin.is_finite()
        && ray.direction.is_finite()
        && ray.direction != Vec3::ZERO
        && ray.t_min.max(0.0) <= ray.t_max
        && !ray.t_min.is_nan()
}

/// T10: every value in every field, and every two of them.
pub(super) fn invalid(_: &Settings, findings: &mut Findings) -> Result<(), ExtremesError> {
    let mesh = meshes::icosphere(3)?.mesh;
    let sound = Ray::new([0.1, 0.2, -3.0], [0.01, -0.02, 1.0]);
    let mut rays = Vec::new();
    for first in 0..40 {
        for second in first..40 {
            let mut ray = sound;
            set(&mut ray, first / 5, VALUES[first % 5]);
            set(&mut ray, second / 5, VALUES[second % 5]);
            rays.push(ray);
        }
    }
    rays.push(Ray::new(Vec3::ZERO, Vec3::ZERO));
    rays.push(Ray::new(Vec3::ZERO, -Vec3::ZERO));
    let none = rays.iter().filter(|ray| !is_ray(ray)).count();
    for accuracy in ACCURACIES {
        let mut expected = Vec::new();
        for ray in &rays {
            expected.push(bits(reference::closest_hit(&[&mesh], ray, accuracy)?));
        }
        let answers = ask_all(&[&mesh], accuracy, |tree| {
            let mut most_visits = 0;
            let mut fault = None;
            for (ray, &expected) in rays.iter().zip(&expected) {
                let mut work = Work::default();
                let hit = bits(tree.closest_hit_with_work(ray, &mut work));
                let any = tree.any_hit_with_work(ray, &mut work);
                let is_right = if is_ray(ray) {
                    hit == expected && any == hit.is_some()
                } else {
                    most_visits = most_visits.max(work.nodes);
                    hit.is_none() && !any && work.nodes <= 1
                };
                if !is_right {
                    fault = Some(format!("{}: {ray:?}, {work:?}", label(tree)));
                }
            }
            (most_visits, fault)
        })?;
        let visits = answers.iter().map(|&(visits, _)| visits).max().unwrap_or(0);
        findings
            .faults
            .extend(answers.into_iter().find_map(|(_, fault)| fault));
        findings.figure(
            format!(
                "{}, most visits of {none} rays that are none",
                name(accuracy)
            ),
            visits,
            "a miss after up to 6 µs",
        );
    }
    Ok(())
}
