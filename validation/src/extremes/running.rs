//! T23, T26, T27, T28: builds that are stopped, that run on many threads, beside rays, or again and again over meshes
//! that move.

use std::{
    panic::{AssertUnwindSafe, catch_unwind},
    sync::{
        Arc, Mutex, PoisonError,
        atomic::{AtomicBool, AtomicUsize, Ordering},
    },
    thread,
    time::{Duration, Instant},
};

use raywright_bvh::{
    Aabb, Accuracy, BuildControl, BuildError, BuildPrimitive, BuildWorkspace, Bvh, Corners,
    Hierarchy, LeafReference, MeshError, Quality, Ray, RefitError, TriangleMesh, Vec3, reference,
};

use super::{
    ExtremesError, Findings, Settings, meshes,
    modes::{ACCURACIES, Bits, QUALITIES, Sampler, bits, qualities_and_widths, with},
};

/// How soon a cancelled build must end.
const SOON: Duration = Duration::from_millis(10);

/// How often each wait is measured.
const TRIES: u32 = 5;

/// T23.
pub(super) fn cancel(settings: &Settings, findings: &mut Findings) -> Result<(), ExtremesError> {
    let mesh = meshes::random_soup((settings.rays * 5).clamp(10_000, 200_000), 23)?;
    let count = mesh.triangles().len();
    let ray = Ray::new([0.0, 0.0, -3.0], [0.01, 0.02, 1.0]);
    for quality in QUALITIES {
        let params = with(quality, 8, Accuracy::Robust);
        let mut workspace = BuildWorkspace::default();
        let start = Instant::now();
        let old = Bvh::build_in(&[&mesh], &params, &mut workspace)?;
        let whole = start.elapsed();
        let before = bits(old.closest_hit(&ray));
        let mut waits = Vec::new();
        for k in 0..8 {
            // The best of some: others use the machine.
            let mut best = None;
            for _ in 0..TRIES {
                let after = whole.mul_f64(0.1 * f64::from(k));
                let wait = cancelled_after(after, &mesh, &params, &mut workspace);
                findings.faults.extend(wait.as_ref().err().cloned());
                best = best.into_iter().chain(wait.ok().flatten()).min();
            }
            waits.extend(best);
        }
        let longest = waits.iter().max().copied().unwrap_or_default();
        // Few rays are for tests, which run beside others: no clock is to be trusted there.
        findings.demand(longest <= SOON || settings.are_few(), || {
            format!("{quality:?}: a cancelled build of {count} triangles ends after {longest:?}")
        });
        findings.figure(
            format!("{quality:?}, {count} triangles: longest wait for the end"),
            format!(
                "{:.2} ms of {:.0}",
                1e3 * longest.as_secs_f64(),
                1e3 * whole.as_secs_f64()
            ),
            "",
        );
        panicking(&mesh, &params, &mut workspace, findings);
        workspace.control = BuildControl::default();
        let again = Bvh::build_in(&[&mesh], &params, &mut workspace)?;
        let same = [&old, &again].map(|tree| bits(tree.closest_hit(&ray))) == [before; 2];
        findings.demand(same && again.stats() == old.stats(), || {
            format!("{quality:?}: trees before and after a cancelled build differ")
        });
    }
    findings.deviates(
        "a panic of the caller's own callback is passed on to the caller, not turned into an error",
    );
    Ok(())
}

/// Cancels a build from another thread; how long it goes on then. None if it was done before.
fn cancelled_after(
    after: Duration,
    mesh: &TriangleMesh,
    params: &raywright_bvh::BuildParams,
    workspace: &mut BuildWorkspace,
) -> Result<Option<Duration>, String> {
    let cancelled = Arc::new(AtomicBool::new(false));
    workspace.control = BuildControl {
        cancelled: Some(cancelled.clone()),
        ..BuildControl::default()
    };
    let (result, end, told) = thread::scope(|scope| {
        let teller = scope.spawn(move || {
            thread::sleep(after);
            let now = Instant::now();
            cancelled.store(true, Ordering::Relaxed);
            now
        });
        let result = Bvh::build_in(&[mesh], params, workspace);
        let end = Instant::now();
        (result, end, teller.join())
    });
    let told = told.map_err(|_| "the thread that cancels panicked".to_owned())?;
    match result {
        Ok(_) => Ok(None),
        Err(BuildError::Cancelled) => Ok(Some(end.saturating_duration_since(told))),
        Err(error) => Err(format!("a cancelled build says {error}")),
    }
}

/// A callback that panics: the caller gets the panic, and workspace and threads go on.
fn panicking(
    mesh: &TriangleMesh,
    params: &raywright_bvh::BuildParams,
    workspace: &mut BuildWorkspace,
    findings: &mut Findings,
) {
    /// Carries no message, so that it is not mistaken for a fault of the engine.
    struct OfCaller;
    workspace.control = BuildControl {
        progress: Some(Arc::new(|_, _| {
            std::panic::resume_unwind(Box::new(OfCaller))
        })),
        ..BuildControl::default()
    };
    let result = catch_unwind(AssertUnwindSafe(|| {
        Bvh::build_in(&[mesh], params, workspace).map(|_| ())
    }));
    let is_passed_on = result.is_err_and(|payload| payload.is::<OfCaller>());
    findings.demand(is_passed_on, || {
        format!("{:?}: the panic of a callback is lost", params.quality)
    });
}

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
    params: &raywright_bvh::BuildParams,
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
