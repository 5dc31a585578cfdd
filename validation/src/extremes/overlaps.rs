//! T19: triangles in one plane. Of equal distances the lowest id is hit; of distances that differ by rounding alone,
//! either, but the same one by every tree and instruction set.

use raywright_bvh::{MeshError, Ray, TriangleMesh, Vec3};

use super::{
    ExtremesError, Findings, Settings, meshes,
    modes::{ACCURACIES, Judged, Sampler, ask_all, bits, exact_hits, name},
};

/// 8 × 8 and 32 × 32 squares in one slanted plane, but for the rounding of vertices.
pub(super) fn slanted() -> Result<[TriangleMesh; 2], MeshError> {
    let on_plane = |n| {
        meshes::mapped(&meshes::grid(n)?, |v| {
            Vec3::new(v.x, v.y, 0.3 * v.x + 0.2 * v.y + 0.1)
        })
    };
    Ok([on_plane(8)?, on_plane(32)?])
}

pub(super) fn rays_from_above(count: usize, sampler: &mut Sampler) -> Vec<Ray> {
    let mut ray = || {
        let to = Vec3::new(sampler.unit(), sampler.unit(), 0.0);
        let from = sampler.vector() + 3.0 * Vec3::Z;
        Ray::new(from, to + (0.3 * to.x + 0.2 * to.y + 0.1) * Vec3::Z - from)
    };
    (0..count).map(|_| ray()).collect()
}

/// T19.
pub(super) fn coplanar(settings: &Settings, findings: &mut Findings) -> Result<(), ExtremesError> {
    let mut sampler = Sampler::new(19);
    duplicates(findings)?;
    let count = settings.rays / 2;
    let [coarse, fine] = slanted()?;
    let near = meshes::soup(&[layer(1.0), layer(1f32.next_up())])?;
    let far = meshes::soup(&[layer(1f32.next_up()), layer(1.0)])?;
    let above = rays_from_above(count, &mut sampler);
    let at_layers: Vec<Ray> = (0..count)
        .map(|_| {
            let from = 0.5 * sampler.vector();
            Ray::new(from, sampler.vector() + 2.0 * Vec3::Z)
        })
        .collect();
    for (what, scene, rays, embree) in [
        (
            "8 × 8 on 32 × 32",
            [&coarse, &fine],
            &above,
            [
                "5586 of 20000",
                "4678 of 20000, by another instruction set 0",
            ],
        ),
        ("planes 1 ulp apart", [&near, &far], &at_layers, ["", ""]),
    ] {
        let exact = exact_hits(&scene, rays);
        for accuracy in ACCURACIES {
            let judged = Judged::new(&scene, rays, &exact, accuracy)?;
            findings.faults.extend(judged.first_fault().cloned());
            findings.figure(format!("{}, {what}", name(accuracy)), &judged, "");
            let answers = ask_all(&scene, accuracy, |tree| {
                let hits = rays.iter().map(|ray| bits(tree.closest_hit(ray)));
                hits.collect::<Vec<_>>()
            })?;
            findings.demand(answers.iter().all(|hits| *hits == answers[0]), || {
                format!("{}, {what}: trees differ", name(accuracy))
            });
            let coarse = answers[0]
                .iter()
                .flatten()
                .filter(|hit| hit[3] == 0)
                .count();
            findings.figure(
                format!("{}, {what}, of the first mesh", name(accuracy)),
                format!("{coarse} of {}", rays.len()),
                embree[accuracy as usize],
            );
        }
    }
    Ok(())
}

fn layer(z: f32) -> [Vec3; 3] {
    [[-9.0, -9.0], [9.0, -9.0], [0.0, 9.0]].map(|[x, y]| Vec3::new(x, y, z))
}

fn duplicates(findings: &mut Findings) -> Result<(), ExtremesError> {
    let mesh = meshes::soup(&[layer(1.0); 64])?;
    let ray = Ray::new(Vec3::ZERO, Vec3::Z);
    for accuracy in ACCURACIES {
        let hits = ask_all(&[&mesh, &mesh], accuracy, |tree| {
            bits(tree.closest_hit(&ray))
        })?;
        let ids = |hit: &super::modes::Bits| hit.map(|hit| [hit[3], hit[4]]);
        let lowest = hits.iter().all(|hit| ids(hit) == Some([0, 0]));
        findings.demand(lowest, || {
            format!("{}: not the lowest id of equal ones", name(accuracy))
        });
        findings.figure(
            format!("{}, 64 duplicates twice, id", name(accuracy)),
            if lowest { "0" } else { "not the lowest" },
            "8 to 60, by instruction set",
        );
    }
    Ok(())
}
