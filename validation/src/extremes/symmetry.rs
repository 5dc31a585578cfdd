//! T07, T08: what meets exactly. Rays between points of the lattices that meshes are made of, and rays along the axes
//! with zeros of both signs, in the planes of boxes and walls.

use raywright_bvh::{Accuracy, MeshError, Ray, TriangleMesh, Vec3};

use super::{
    ExtremesError, Findings, Settings,
    leaks::misses,
    meshes,
    modes::{ACCURACIES, Judged, Sampler, ask_all, bits, exact_hits, name},
};

/// A cube −1..1 with n × n squares per face.
fn centred(n: u32, size: f32) -> Result<TriangleMesh, MeshError> {
    meshes::mapped(&meshes::cube(n)?.mesh, |v| (2.0 * v - 1.0) * size)
}

/// T07: rays from the centre, and from lattice points about it, to the corners, middles of edges and centres of the
/// squares of boxes, and of a small box in a large one.
pub(super) fn solids(settings: &Settings, findings: &mut Findings) -> Result<(), ExtremesError> {
    let mut sampler = Sampler::new(7);
    let small = centred(2, 1.0 / 1024.0)?;
    let mut leaks = [0; 2];
    let mut rays_asked = 0;
    for n in [1, 2, 3, 4, 8] {
        let large = centred(n, 1.0)?;
        let scene = [&large, &small];
        let targets: Vec<Vec3> = scene
            .iter()
            .flat_map(|mesh| {
                (0..mesh.triangles().len() as u32).flat_map(|id| {
                    let [a, b, c] = mesh.corners(id);
                    [a, 0.5 * (a + b), 0.5 * (b + c), 0.5 * (c + a)]
                })
            })
            .collect();
        let rays: Vec<Ray> = (0..settings.rays / 5)
            .map(|index| {
                let from = match index % 4 {
                    0 => Vec3::ZERO,
                    // Within the small box, and between the two.
                    1 => (sampler.vector() * 4.0).round() / 8192.0,
                    _ => (sampler.vector() * 7.0).round() / 8.0,
                };
                Ray::new(from, targets[sampler.below(targets.len())] - from)
            })
            .filter(|ray| ray.direction != Vec3::ZERO)
            .collect();
        rays_asked += rays.len();
        let exact = exact_hits(&scene, &rays);
        for accuracy in ACCURACIES {
            let judged = Judged::new(&scene, &rays, &exact, accuracy)?;
            findings.faults.extend(judged.first_fault().cloned());
            let answers = ask_all(&scene, accuracy, |tree| misses(tree, &rays))?;
            let most = answers.iter().map(|&(count, _)| count).max().unwrap_or(0);
            leaks[accuracy as usize] += most;
            findings
                .faults
                .extend(answers.into_iter().find_map(|(_, fault)| fault));
            findings.figure(format!("{}, n = {n}", name(accuracy)), judged, "");
        }
    }
    for accuracy in ACCURACIES {
        let count = leaks[accuracy as usize];
        findings.figure(
            format!("{}, leaks", name(accuracy)),
            format!("{count} of {rays_asked}"),
            "",
        );
        findings.demand(count == 0 || accuracy == Accuracy::Fast, || {
            format!("robust leaks {count} of {rays_asked}")
        });
    }
    Ok(())
}

/// The same mesh or ray with the axes in another order.
fn turned(v: Vec3, axis: usize) -> Vec3 {
    let mut components = v.to_array();
    components.rotate_right(axis);
    Vec3::from(components)
}

/// The four rays down an axis that differ in the signs of their zeros.
fn with_zeros(from: Vec3, along: f32, axis: usize) -> [Ray; 4] {
    [[0.0, 0.0], [0.0, -0.0], [-0.0, 0.0], [-0.0, -0.0]].map(|[x, y]| {
        let direction = Vec3::new(x, y, along);
        Ray::new(turned(from, axis), turned(direction, axis))
    })
}

/// T08.
pub(super) fn axes(settings: &Settings, findings: &mut Findings) -> Result<(), ExtremesError> {
    let mut sampler = Sampler::new(8);
    let sizes: &[u32] = if settings.are_few() {
        &[8, 10]
    } else {
        &[8, 10, 64, 100]
    };
    for &n in sizes {
        let flat = meshes::grid(n)?;
        let at = |i: usize| i as f32 / n as f32;
        let mut inner = Vec::new();
        let mut border = Vec::new();
        for _ in 0..settings.rays / 16 {
            let n = n as usize;
            let (i, j) = (1 + sampler.below(n - 1), 1 + sampler.below(n - 1));
            inner.push([at(i), at(j)]);
            border.push([at(i), at(n * (j % 2))]);
        }
        for axis in 0..3 {
            let mesh = meshes::mapped(&flat, |v| turned(v, axis))?;
            let rays = |points: &[[f32; 2]]| -> Vec<[Ray; 4]> {
                let rays = points.iter().zip(0_usize..).map(|(&[x, y], number)| {
                    let (from, along) = [(0.0, 1.0), (1.0, -1.0)][number % 2];
                    with_zeros(Vec3::new(x, y, from), along, axis)
                });
                rays.collect()
            };
            let (inner, border) = (rays(&inner), rays(&border));
            for accuracy in ACCURACIES {
                let answers = ask_all(&[&mesh], accuracy, |tree| {
                    let is_lost = |ray: &Ray| tree.closest_hit(ray).is_none();
                    let lost = |rays: &[[Ray; 4]]| rays.iter().filter(|r| is_lost(&r[0])).count();
                    let unlike = inner.iter().chain(&border).filter(|rays| {
                        let [first, others @ ..] = rays.map(|ray| bits(tree.closest_hit(&ray)));
                        others.iter().any(|&other| other != first)
                    });
                    let unlike: Vec<_> = unlike.collect();
                    let first = unlike
                        .first()
                        .map(|rays| rays.map(|ray| tree.closest_hit(&ray)));
                    (lost(&inner), lost(&border), first)
                })?;
                let (lost, lost_at_border, _) = answers[0];
                let unlike = answers.iter().find_map(|answer| answer.2);
                findings.demand(answers.iter().all(|a| a.0 == 0), || {
                    format!(
                        "{}, n = {n}, axis {axis}: inner vertices are lost: {lost}",
                        name(accuracy)
                    )
                });
                findings.demand(unlike.is_none(), || {
                    format!(
                        "{}, n = {n}, axis {axis}: the sign of a zero matters: {unlike:?}",
                        name(accuracy)
                    )
                });
                if axis == 0 {
                    findings.figure(
                        format!("{}, n = {n}, inner vertices lost", name(accuracy)),
                        format!("{lost} of {}", inner.len()),
                        "0",
                    );
                    findings.figure(
                        format!("{}, n = {n}, vertices of the border lost", name(accuracy)),
                        format!("{lost_at_border} of {}", border.len()),
                        "about half",
                    );
                }
            }
        }
    }
    in_planes(settings, &mut sampler, findings)?;
    nearly_zero(settings, &mut sampler, findings)
}

/// Rays in the plane of a wall, past it to another; on the faces of boxes of nodes.
fn in_planes(
    settings: &Settings,
    sampler: &mut Sampler,
    findings: &mut Findings,
) -> Result<(), ExtremesError> {
    let flat = meshes::grid(16)?;
    let wall = meshes::mapped(&flat, |v| Vec3::new(2.0, v.x, v.y))?;
    let rays: Vec<Ray> = (0..settings.rays / 8)
        .flat_map(|number| {
            // In the plane z = 0.5 of the flat one, often along a line of its lattice.
            let y = (sampler.unit() * 15.0 + 0.5).round() / 16.0 + [0.0, 1.0 / 64.0][number % 2];
            let rays = [[0.0, 0.0], [0.0, -0.0], [-0.0, 0.0], [-0.0, -0.0]];
            rays.map(|[dy, dz]| Ray::new(Vec3::new(-1.0, y, 0.5), Vec3::new(1.0, dy, dz)))
        })
        .collect();
    for accuracy in ACCURACIES {
        let wrong = ask_all(&[&flat, &wall], accuracy, |tree| {
            let hits = rays.iter().map(|ray| tree.closest_hit(ray));
            hits.filter(|hit| hit.is_none_or(|hit| hit.geometry_id != 1 || hit.t != 3.0))
                .count()
        })?;
        let most = wrong.into_iter().max().unwrap_or(0);
        findings.figure(
            format!(
                "{}, in the plane of a wall, not at the next",
                name(accuracy)
            ),
            format!("{most} of {}", rays.len()),
            "",
        );
        findings.demand(most == 0, || {
            format!(
                "{}: a ray in the plane of a wall does not reach the next",
                name(accuracy)
            )
        });
    }
    Ok(())
}

/// Components so small that they move nothing: the hits are those of zeros.
fn nearly_zero(
    settings: &Settings,
    sampler: &mut Sampler,
    findings: &mut Findings,
) -> Result<(), ExtremesError> {
    let mesh = meshes::grid(10)?;
    let rays: Vec<[Ray; 3]> = (0..settings.rays / 8)
        .map(|_| {
            let mut inside = || (sampler.below(10) as f32 + 0.2 + 0.2 * sampler.unit()) / 10.0;
            let from = Vec3::new(inside(), inside(), 0.0);
            [[0.0, 0.0], [1e-20, -1e-39], [-1e-39, 1e-20]]
                .map(|[x, y]| Ray::new(from, Vec3::new(x, y, 1.0)))
        })
        .collect();
    for accuracy in ACCURACIES {
        let unlike = ask_all(&[&mesh], accuracy, |tree| {
            let is_unlike = |rays: &&[Ray; 3]| {
                let [zero, others @ ..] = rays.map(|ray| bits(tree.closest_hit(&ray)));
                zero.is_none() || others.iter().any(|&other| other != zero)
            };
            rays.iter().filter(is_unlike).count()
        })?;
        let most = unlike.into_iter().max().unwrap_or(0);
        findings.figure(
            format!("{}, components 1e-20 and 1e-39, unlike 0", name(accuracy)),
            format!("{most} of {}", rays.len()),
            "sign lost below 1e-18",
        );
        findings.demand(most == 0, || {
            format!("{}: tiny components change {most} hits", name(accuracy))
        });
    }
    Ok(())
}
