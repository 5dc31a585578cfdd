//! T26, T27, T28: builds that run on many threads, beside rays, or again and again over meshes that move.

use std::{
    sync::{
        Arc, Mutex, PoisonError,
        atomic::{AtomicBool, AtomicUsize, Ordering},
    },
    thread,
};

use raywright_bvh::{
    Aabb, Accuracy, BuildError, BuildParams, BuildPrimitive, BuildWorkspace, Bvh, Corners,
    Hierarchy, LeafReference, MeshError, Quality, Ray, RefitError, TriangleMesh, Vec3, reference,
};

use super::{
    ExtremesError, Findings, Settings, meshes,
    modes::{ACCURACIES, Bits, Sampler, bits, qualities_and_widths, with},
};

/// All that is in a hierarchy: level, box and references of each node, depth first.
fn contents(tree: &Hierarchy) -> Vec<(usize, [u32; 6], Vec<LeafReference>)> {
    let mut all = Vec::new();
    let mut stack: Vec<_> = tree.root().map(|root| (1, root)).into_iter().collect();
    while let Some((level, node)) = stack.pop() {
        let Aabb { min, max } = node.bounds();
        let planes = [min.x, min.y, min.z, max.x, max.y, max.z];
        let leaf = node.leaf().unwrap_or_default().to_vec();
        all.push((level, planes.map(f32::to_bits), leaf));
        stack.extend(node.children().map(|child| (level + 1, child)));
    }
    all
}

/// T26.
pub(super) fn determinism(
    settings: &Settings,
    findings: &mut Findings,
) -> Result<(), ExtremesError> {
    // So many that ranges are divided in pieces, if rays are as many as they should be.
    let mesh = meshes::random_soup((settings.rays * 2).clamp(2000, 80_000), 26)?;
    let count = mesh.triangles().len() as u32;
    let rounds = if settings.rays < 10_000 { 1 } else { 5 };
    let primitives: Vec<BuildPrimitive> = (0..count)
        .map(|primitive_id| BuildPrimitive {
            bounds: (mesh.corners(primitive_id).into_iter()).fold(Aabb::EMPTY, Aabb::extended_by),
            geometry_id: 0,
            primitive_id,
        })
        .collect();
    let corners: &Corners<'_> = &|leaf: LeafReference| mesh.corners(leaf.primitive_id);
    let mut sampler = Sampler::new(26);
    let rays: Vec<Ray> = (0..200)
        .map(|_| Ray::new(2.0 * sampler.vector(), sampler.vector()))
        .collect();
    let mut builds = 0;
    for params in qualities_and_widths(Accuracy::Robust) {
        let build = |threads: usize| -> Result<_, ExtremesError> {
            let pool = rayon::ThreadPoolBuilder::new()
                .num_threads(threads)
                .build()?;
            pool.install(|| {
                let mut workspace = BuildWorkspace::default();
                let hierarchy =
                    Hierarchy::build(&primitives, Some(corners), &params, &mut workspace)?;
                let tree = Bvh::build_in(&[&mesh], &params, &mut workspace)?;
                let hits: Vec<Bits> = rays.iter().map(|ray| bits(tree.closest_hit(ray))).collect();
                Ok((contents(&hierarchy), tree.stats(), hits))
            })
        };
        let one = build(1)?;
        for threads in [2, 3, 8, 16] {
            for _ in 0..rounds {
                builds += 1;
                let same = build(threads)? == one;
                findings.demand(same, || {
                    format!("{threads} threads build another tree: {params:?}")
                });
            }
        }
    }
    findings.figure(
        format!("builds of {count} triangles, all equal to one thread's"),
        builds,
        "",
    );
    Ok(())
}

/// T27: four threads trace while one publishes trees of two scenes, rebuilt and refitted in turn.
pub(super) fn concurrency(
    settings: &Settings,
    findings: &mut Findings,
) -> Result<(), ExtremesError> {
    let first = meshes::icosphere(3)?.mesh;
    let second = meshes::mapped(&first, |v| 0.75 * v + 0.1)?;
    let scenes = [&first, &second];
    let mut sampler = Sampler::new(27);
    let rays: Vec<Ray> = (0..400)
        .map(|_| Ray::new(0.2 * sampler.vector(), sampler.vector()))
        .collect();
    let params = with(Quality::BinnedSah, 8, Accuracy::Robust);
    let mut expected = Vec::new();
    for scene in scenes {
        let tree = Bvh::build(&[scene], &params)?;
        let hits = rays.iter().map(|ray| bits(tree.closest_hit(ray)));
        expected.push(hits.collect::<Vec<_>>());
    }
    let rounds = (settings.rays / 100).clamp(20, 400);
    let shown = Mutex::new(Arc::new((0, Bvh::build(&[&first], &params)?)));
    let lock = || shown.lock().unwrap_or_else(PoisonError::into_inner);
    let (done, answers) = (AtomicBool::new(false), AtomicUsize::new(0));
    let faults = thread::scope(|scope| {
        let tracers: Vec<_> = (0..4)
            .map(|_| {
                scope.spawn(|| {
                    let mut faults = 0;
                    loop {
                        let is_last = done.load(Ordering::Acquire);
                        let tree = lock().clone();
                        for (ray, &expected) in rays.iter().zip(&expected[tree.0]) {
                            faults += usize::from(bits(tree.1.closest_hit(ray)) != expected);
                        }
                        answers.fetch_add(rays.len(), Ordering::Relaxed);
                        if is_last {
                            return faults;
                        }
                    }
                })
            })
            .collect();
        let built = publish(rounds, scenes, &params, |version, tree| {
            *lock() = Arc::new((version, tree));
        });
        done.store(true, Ordering::Release);
        let faults: Vec<_> = tracers.into_iter().map(|tracer| tracer.join()).collect();
        built.map(|()| faults)
    })?;
    for fault in faults {
        findings.demand(matches!(fault, Ok(0)), || {
            format!("a thread that traces: {fault:?} answers of no version")
        });
    }
    findings.figure("trees published", rounds, "");
    findings.figure("answers, each of one version", answers.into_inner(), "");
    findings.deviates("no run under ThreadSanitizer: it needs another compiler");
    Ok(())
}

/// Builds and refits trees of two scenes in turn.
fn publish(
    rounds: usize,
    scenes: [&TriangleMesh; 2],
    params: &BuildParams,
    show: impl Fn(usize, Bvh),
) -> Result<(), ExtremesError> {
    let mut kept = Bvh::build(&[scenes[0]], params)?;
    for round in 0..rounds {
        let version = round % 2;
        if round % 4 < 2 {
            kept.refit(&[scenes[version]])?;
            show(version, kept.clone());
        } else {
            show(version, Bvh::build(&[scenes[version]], params)?);
        }
    }
    Ok(())
}

/// A hundred frames: a mesh that turns and grows, is pressed into a plane and into a point, and returns.
fn frame(mesh: &TriangleMesh, number: u32) -> Result<TriangleMesh, MeshError> {
    let phase = number as f32 / 99.0;
    let size = 2f32.powf(8.0 * (std::f32::consts::PI * phase).sin());
    meshes::mapped(mesh, |v| match number {
        25..=34 => size * Vec3::new(v.x, 0.3, v.z),
        55..=64 => Vec3::new(1.0, -2.0, 0.5),
        99 => v,
        _ => {
            let (sin, cos) = (5.0 * phase * v.y).sin_cos();
            size * Vec3::new(cos * v.x - sin * v.z, v.y, sin * v.x + cos * v.z)
        }
    })
}

/// T28.
pub(super) fn refit(settings: &Settings, findings: &mut Findings) -> Result<(), ExtremesError> {
    let first = meshes::icosphere(2)?.mesh;
    let count = (settings.rays / 400).clamp(4, 100);
    let mut frames = Vec::new();
    let mut sampler = Sampler::new(28);
    for number in 0..100 {
        let mesh = frame(&first, number)?;
        let rays: Vec<Ray> = (0..count)
            .map(|_| {
                let triangle = sampler.triangle(&mesh);
                let to = sampler.on(triangle);
                let from = to + 100.0 * sampler.vector();
                Ray::new(from, to - from)
            })
            .collect();
        frames.push((mesh, rays));
    }
    let far = meshes::mapped(&first, |v| v * 2f32.powi(101))?;
    let other = meshes::icosphere(1)?.mesh;
    let mut nan = first.vertices().to_vec();
    nan[7].y = f32::NAN;
    let refused = TriangleMesh::new(nan, first.triangles().to_vec());
    findings.demand(
        matches!(refused, Err(MeshError::NonFiniteVertex { vertex: 7, .. })),
        || format!("a frame with NaN: {refused:?}"),
    );
    let mut compared = 0;
    for accuracy in ACCURACIES {
        let mut expected = Vec::new();
        for (mesh, rays) in &frames {
            let mut hits: Vec<Bits> = Vec::new();
            for ray in rays {
                hits.push(bits(reference::closest_hit(&[mesh], ray, accuracy)?));
            }
            expected.push(hits);
        }
        for params in qualities_and_widths(accuracy) {
            let mut tree = Bvh::build(&[&first], &params)?;
            for (number, ((mesh, rays), expected)) in frames.iter().zip(&expected).enumerate() {
                tree.refit(&[mesh])?;
                // What is refused leaves the tree as it was.
                let refused = [tree.refit(&[&far]).err(), tree.refit(&[&other]).err()];
                let is_typed = matches!(
                    refused,
                    [
                        Some(RefitError::Build(BuildError::CoordinateRange { .. })),
                        Some(RefitError::TriangleCount { .. })
                    ]
                );
                findings.demand(is_typed, || format!("refused frames: {refused:?}"));
                let hits = |tree: &Bvh| -> Vec<Bits> {
                    rays.iter().map(|ray| bits(tree.closest_hit(ray))).collect()
                };
                compared += rays.len();
                findings.demand(hits(&tree) == *expected, || {
                    format!("frame {number}: hits are not those of all triangles: {params:?}")
                });
                if number % 10 == 9 {
                    let fresh = Bvh::build(&[mesh], &params)?;
                    findings.demand(hits(&fresh) == *expected, || {
                        format!("frame {number}: a new tree has other hits: {params:?}")
                    });
                }
            }
        }
    }
    findings.figure(
        "hits of refitted trees, equal to the last bit",
        compared,
        "",
    );
    Ok(())
}
