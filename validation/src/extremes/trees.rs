//! T17, T18, T21: inputs that make trees deep, large or slow to build.

use std::time::Instant;

use raywright_bvh::{
    Accuracy, BuildParams, BuildWorkspace, Bvh, Quality, Ray, TriangleMesh, Vec3, reference,
};

use super::{
    ExtremesError, Findings, Settings, meshes,
    modes::{
        ACCURACIES, Bits, QUALITIES, Sampler, WIDTHS, ask_each, bits, cuts, label, name,
        qualities_and_widths, with,
    },
};

/// Times of smaller builds are noise.
const TIMED: usize = 100_000;

/// Time of the better of two builds, bytes of tree and workspace, and the tree.
fn build(mesh: &TriangleMesh, params: &BuildParams) -> Result<(f64, usize, Bvh), ExtremesError> {
    let mut best = f64::INFINITY;
    let mut last = None;
    for _ in 0..2 {
        let mut workspace = BuildWorkspace::default();
        let start = Instant::now();
        let tree = Bvh::build_in(&[mesh], params, &mut workspace)?;
        best = best.min(start.elapsed().as_secs_f64());
        last = Some((tree.stats().bytes + workspace.bytes(), tree));
        if mesh.triangles().len() < TIMED {
            break;
        }
    }
    let (bytes, tree) = last.ok_or_else(|| ExtremesError::Case("no build".to_owned()))?;
    Ok((best, bytes, tree))
}

/// T17.
pub(super) fn identical(settings: &Settings, findings: &mut Findings) -> Result<(), ExtremesError> {
    let largest = (settings.rays * 25).clamp(1000, 1_000_000);
    let corners = [[-1.0, -1.0], [1.0, -1.0], [0.0, 1.0]].map(|[x, y]| Vec3::new(x, y, 0.5));
    let ray = Ray::new([0.0, 0.0, -1.0], [0.0, 0.0, 1.0]);
    let mut params: Vec<BuildParams> = Vec::new();
    for accuracy in ACCURACIES {
        params.extend(qualities_and_widths(accuracy));
    }
    for count in [1, 2, 3, 64, 10_000.min(largest), largest] {
        let same = TriangleMesh::new(corners.to_vec(), vec![[0, 1, 2]; count])?;
        // Random triangles that share no vertex have more of them: the same number, unused, for the same memory.
        let random = meshes::random_soup(count, 17)?;
        let is_large = count > 10_000;
        for params in &params {
            // The largest by one width.
            if is_large && (params.branching_factor != 8 || params.accuracy == Accuracy::Fast) {
                continue;
            }
            let (time, bytes, tree) = build(&same, params)?;
            let (random_time, random_bytes, _) = build(&random, params)?;
            let stats = tree.stats();
            let what = || format!("{count} identical, {}", label(&tree));
            findings.demand(stats.depth <= 64, || {
                format!("{}: depth {}", what(), stats.depth)
            });
            let hit = tree.closest_hit(&ray);
            findings.demand(hit.is_some_and(|hit| hit.primitive_id == 0), || {
                format!("{}: {hit:?}", what())
            });
            let memory = bytes as f64 / random_bytes as f64;
            findings.demand(count < 64 || memory <= 1.2, || {
                format!("{}: {memory:.2} × the memory of random triangles", what())
            });
            let slower = time / random_time;
            findings.demand(count < TIMED || slower <= 5.0, || {
                format!("{}: {slower:.1} × the time of random triangles", what())
            });
            if is_large {
                let start = Instant::now();
                std::hint::black_box(tree.closest_hit(&ray));
                let ray_ms = 1e3 * start.elapsed().as_secs_f64();
                findings.figure(
                    format!(
                        "{count} identical, {:?}: depth, time and memory to random, one ray",
                        params.quality
                    ),
                    format!("{}, {slower:.2}, {memory:.2}, {ray_ms:.1} ms", stats.depth),
                    "time 0.5 to 1.3, memory 0.5 to 0.7, 16 to 22 ms",
                );
            }
        }
    }
    concentric(settings, &params, findings)
}

/// 10⁴ triangles with one centre, of sizes from 1 to 2²⁰.
fn concentric(
    settings: &Settings,
    params: &[BuildParams],
    findings: &mut Findings,
) -> Result<(), ExtremesError> {
    let count = settings.rays.clamp(100, 10_000);
    let triangles: Vec<_> = (0..count)
        .map(|i| {
            let size = 2f32.powf(20.0 * i as f32 / count as f32);
            [[-1.0, -1.0], [1.0, -1.0], [0.0, 2.0]].map(|[x, y]| size * Vec3::new(x, y, 1e-3))
        })
        .collect();
    let mesh = meshes::soup(&triangles)?;
    let ray = Ray::new([0.0, 0.0, -1.0], [0.0, 0.0, 1.0]);
    let mut deepest = 0;
    for params in params {
        let expected = bits(reference::closest_hit(&[&mesh], &ray, params.accuracy)?);
        let tree = Bvh::build(&[&mesh], params)?;
        deepest = deepest.max(tree.stats().depth);
        let got = bits(tree.closest_hit(&ray));
        findings.demand(got == expected && got.is_some(), || {
            format!("concentric, {}: {got:?}, not {expected:?}", label(&tree))
        });
    }
    findings.demand(deepest <= 64, || format!("concentric: depth {deepest}"));
    findings.figure(format!("{count} concentric, depth"), deepest, "");
    Ok(())
}

/// Meshes whose trees are as deep as they get.
fn deep_meshes() -> Result<Vec<(&'static str, TriangleMesh)>, ExtremesError> {
    let diagonal: Vec<_> = (0..2000)
        .map(|i| {
            let at = Vec3::splat(i as f32);
            [at, at + Vec3::X, at + Vec3::Y]
        })
        .collect();
    // 2^k triangles of each Morton code, the codes of each level within a cell of the last.
    let mut sampler = Sampler::new(18);
    let nested: Vec<_> = (0..8)
        .flat_map(|level| {
            let size = 2f32.powi(-11 * level);
            (0..64).map(move |_| size)
        })
        .map(|size| {
            let at = size * sampler.vector();
            [
                at,
                at + 0.01 * size * sampler.vector(),
                at + 0.01 * size * sampler.vector(),
            ]
        })
        .collect();
    let equal: Vec<_> = (0..4096)
        .map(|i| {
            let at = Vec3::splat(if i == 0 { 1e6 } else { 1e-3 * i as f32 });
            [at, at + Vec3::X, at + Vec3::Y]
        })
        .collect();
    Ok(vec![
        ("series of 0.5", meshes::series(1.0, 0.5, 90)?),
        ("series of 0.9", meshes::series(1.0, 0.9, 800)?),
        ("series of 110", meshes::series(power(30), 0.5, 110)?),
        ("sorted diagonal", meshes::soup(&diagonal)?),
        ("nested clusters", meshes::soup(&nested)?),
        ("equal Morton codes", meshes::soup(&equal)?),
    ])
}

fn power(k: i32) -> f32 {
    2f32.powi(k)
}

/// Leaves of one triangle.
fn deepest(mut params: BuildParams) -> BuildParams {
    (params.min_leaf_size, params.max_leaf_size) = (1, 1);
    params
}

/// T18.
pub(super) fn deep(settings: &Settings, findings: &mut Findings) -> Result<(), ExtremesError> {
    let mut sampler = Sampler::new(180);
    for (name_of_mesh, mesh) in deep_meshes()? {
        let rays: Vec<Ray> = (0..(settings.rays / 40).max(20))
            .map(|_| {
                let triangle = sampler.triangle(&mesh);
                let size = triangle[0].distance(triangle[1]);
                let to = sampler.on(triangle);
                let from = to + 4.0 * size * sampler.vector();
                Ray::new(from, to - from)
            })
            .collect();
        let mut depths = (usize::MAX, 0);
        for accuracy in ACCURACIES {
            let mut expected: Vec<Bits> = Vec::new();
            for ray in &rays {
                expected.push(bits(reference::closest_hit(&[&mesh], ray, accuracy)?));
            }
            let params: Vec<_> = qualities_and_widths(accuracy)
                .into_iter()
                .flat_map(|params| [params, deepest(params)])
                .collect();
            let answers = ask_each(&[&mesh], &params, |tree| {
                let unlike = rays.iter().zip(&expected).find(|(ray, expected)| {
                    let got = bits(tree.closest_hit(ray));
                    got != **expected || tree.any_hit(ray) != got.is_some()
                });
                let cut = cuts(tree.params().quality);
                let fault =
                    unlike.map(|(ray, _)| format!("{name_of_mesh}, {}: {ray:?}", label(tree)));
                (tree.stats().depth, cut, fault)
            })?;
            for (depth, _, fault) in answers {
                depths = (depths.0.min(depth), depths.1.max(depth));
                findings.demand(depth <= 64, || format!("{name_of_mesh}: depth {depth}"));
                findings.faults.extend(fault);
            }
            let hits = expected.iter().flatten().count();
            findings.figure(
                format!("{}, {name_of_mesh}, hits", name(accuracy)),
                format!("{hits} of {}", rays.len()),
                "",
            );
        }
        findings.figure(
            format!("{name_of_mesh}, depth"),
            format!("{} … {}", depths.0, depths.1),
            "32, and 8 of leaves",
        );
    }
    shrinking(findings)
}

/// A ray down at each of 110 triangles of sizes 2³⁰ … 2⁻⁷⁹: how many are found.
fn shrinking(findings: &mut Findings) -> Result<(), ExtremesError> {
    let mesh = meshes::series(power(30), 0.5, 110)?;
    let embree = [
        "79 right, the others vanish",
        "86 to 92 right, 2 to 9 wrong",
    ];
    for accuracy in ACCURACIES {
        let answers = ask_each(&[&mesh], &qualities_and_widths(accuracy), |tree| {
            let (mut right, mut wrong) = (0, 0);
            for id in 0..110 {
                let [a, b, c] = mesh.corners(id);
                let size = a.x;
                let target = a + 0.3 * (b - a) + 0.3 * (c - a);
                let ray = Ray::new(target + size * Vec3::Z, -Vec3::Z);
                match tree.closest_hit(&ray) {
                    Some(hit) if hit.primitive_id == id => right += 1,
                    Some(_) => wrong += 1,
                    None => {}
                }
            }
            (right, wrong)
        })?;
        let (right, wrong) = answers[0];
        findings.demand(answers.iter().all(|&answer| answer == answers[0]), || {
            format!("{}: trees differ over the series of 110", name(accuracy))
        });
        findings.demand(wrong == 0, || {
            format!(
                "{}: {wrong} of the series of 110 hit another",
                name(accuracy)
            )
        });
        findings.figure(
            format!(
                "{}, series of 110, right / wrong / vanished",
                name(accuracy)
            ),
            format!("{right} / {wrong} / {}", 110 - right - wrong),
            embree[accuracy as usize],
        );
        if right < 110 {
            findings.deviates(
                "what is less than the rounding of the largest coordinate, or underflows beside it, vanishes",
            );
        }
    }
    findings.deviations.dedup();
    Ok(())
}

/// Stack of a thread that builds, traces and drops.
const STACK: usize = 128 << 10;

/// T21. An overflow would end the process.
pub(super) fn stack(_: &Settings, findings: &mut Findings) -> Result<(), ExtremesError> {
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(1)
        .stack_size(STACK)
        .build()?;
    let mut trees = 0;
    for (name_of_mesh, mesh) in deep_meshes()? {
        let ray = {
            let [a, b, c] = mesh.corners(0);
            let to = (a + b + c) / 3.0;
            Ray::new(to + a.distance(b) * Vec3::Z, -Vec3::Z)
        };
        for quality in QUALITIES {
            for width in WIDTHS {
                let params = deepest(with(quality, width, Accuracy::Robust));
                let is_hit = pool.install(|| {
                    let mut tree = Bvh::build(&[&mesh], &params)?;
                    tree.refit(&[&mesh])?;
                    Ok::<_, ExtremesError>(tree.closest_hit(&ray).is_some() && tree.any_hit(&ray))
                })?;
                trees += 1;
                findings.demand(is_hit, || {
                    format!("{name_of_mesh}, {quality:?}, {width} children: no hit")
                });
            }
        }
    }
    let kinds = Quality::Optimized as usize + 1;
    findings.figure(
        format!(
            "trees built, refitted, traced and dropped in {} KiB, {kinds} qualities",
            STACK >> 10
        ),
        trees,
        "",
    );
    Ok(())
}
