//! Builds that are watched, stopped and limited.

use std::sync::{
    Arc, Mutex,
    atomic::{AtomicBool, Ordering},
};

use raywright_bvh::{
    BuildControl, BuildError, BuildParams, BuildWorkspace, Bvh, Collapse, PARAMETERS,
    ParameterRange, Quality, TriangleMesh, Vec3,
};

/// A terrain of 2 n² triangles.
fn terrain(n: u32) -> TriangleMesh {
    let height = |x: u32, y: u32| ((x * 7919 + y * 104_729) % 1009) as f32 / 500.0;
    let vertices = (0..=n)
        .flat_map(|y| (0..=n).map(move |x| Vec3::new(x as f32, height(x, y), y as f32)))
        .collect();
    let triangles = (0..n)
        .flat_map(|y| (0..n).map(move |x| y * (n + 1) + x))
        .flat_map(|a| [[a, a + 1, a + n + 1], [a + 1, a + n + 2, a + n + 1]])
        .collect();
    TriangleMesh::new(vertices, triangles).unwrap()
}

fn every_quality() -> Vec<BuildParams> {
    let quality = PARAMETERS.iter().find(|p| p.name == "quality").unwrap();
    let ParameterRange::Words(words) = quality.range else {
        panic!("quality has words");
    };
    let params = words.iter().map(|word| {
        let mut params = BuildParams::default();
        params.set("quality", word).unwrap();
        params
    });
    let mut all: Vec<BuildParams> = params.collect();
    let mut collapsed = BuildParams::default();
    collapsed.collapse = Collapse::LeastCost;
    all.push(collapsed);
    collapsed.quality = Quality::SpatialSplits;
    all.push(collapsed);
    all
}

#[test]
fn progress_never_passes_the_total_and_ends_with_it() {
    let mesh = terrain(100);
    for params in every_quality() {
        let seen = Arc::new(Mutex::new(vec![]));
        let mut workspace = BuildWorkspace::default();
        let log = seen.clone();
        workspace.control = BuildControl {
            progress: Some(Arc::new(move |done, total| {
                log.lock().unwrap().push((done, total));
            })),
            ..BuildControl::default()
        };
        Bvh::build_in(&[&mesh], &params, &mut workspace).unwrap();
        let seen = seen.lock().unwrap();
        assert!(seen.iter().all(|&(done, total)| done <= total));
        assert_eq!(seen.last(), Some(&(20_000, 20_000)), "{:?}", params.quality);
    }
}

#[test]
fn a_cancelled_build_is_an_error_and_the_workspace_goes_on() {
    let mesh = terrain(100);
    for params in every_quality() {
        let mut workspace = BuildWorkspace::default();
        let old = Bvh::build_in(&[&mesh], &params, &mut workspace).unwrap();
        // Before the build, and by the first word of progress in it.
        for from_the_start in [true, false] {
            let cancelled = Arc::new(AtomicBool::new(from_the_start));
            let stop = cancelled.clone();
            workspace.control = BuildControl {
                cancelled: Some(cancelled),
                progress: Some(Arc::new(move |_, _| stop.store(true, Ordering::Relaxed))),
                memory_limit: None,
            };
            let got = Bvh::build_in(&[&mesh], &params, &mut workspace).err();
            assert_eq!(got, Some(BuildError::Cancelled), "{:?}", params.quality);
        }
        workspace.control = BuildControl::default();
        let again = Bvh::build_in(&[&mesh], &params, &mut workspace).unwrap();
        assert_eq!(again.stats(), old.stats());
    }
}

#[test]
fn control_outlives_the_memory_of_a_static_build() {
    let mesh = terrain(10);
    let mut params = BuildParams::default();
    params.set("dynamics", "static").unwrap();
    let mut workspace = BuildWorkspace::default();
    let cancelled = Arc::new(AtomicBool::new(false));
    workspace.control.cancelled = Some(cancelled.clone());
    Bvh::build_in(&[&mesh], &params, &mut workspace).unwrap();
    assert_eq!(workspace.bytes(), 0);
    cancelled.store(true, Ordering::Relaxed);
    let got = Bvh::build_in(&[&mesh], &params, &mut workspace).err();
    assert_eq!(got, Some(BuildError::Cancelled));
}

#[test]
fn a_limit_holds_whatever_was_built_and_recycled_before() {
    let meshes = [terrain(100), terrain(37)];
    let most = |n: usize| {
        let needed = every_quality().into_iter();
        let needed = needed.map(|params| BuildWorkspace::bytes_needed(n, &params));
        needed.max().unwrap()
    };
    let limit = most(meshes[0].triangles().len());
    let mut workspace = BuildWorkspace::default();
    workspace.control.memory_limit = Some(limit);
    let mut kept = vec![];
    for round in 0..4 {
        for params in every_quality() {
            let mesh = &meshes[round % 2];
            let tree = Bvh::build_in(&[mesh], &params, &mut workspace).unwrap();
            assert!(workspace.bytes() <= limit, "{:?}", params.quality);
            tree.recycle(&mut workspace);
            assert!(workspace.bytes() <= limit, "{:?}", params.quality);
            kept.push(workspace.bytes());
        }
    }
    // A limit does not mean that all is freed each time.
    assert!(kept.iter().any(|&bytes| bytes > limit / 4));
    // A smaller one is kept from the next build on.
    let params = BuildParams::default();
    let limit = BuildWorkspace::bytes_needed(meshes[1].triangles().len(), &params);
    workspace.control.memory_limit = Some(limit);
    Bvh::build_in(&[&meshes[1]], &params, &mut workspace).unwrap();
    assert!(workspace.bytes() <= limit);
}

#[test]
fn a_tree_that_passes_the_limit_is_not_kept() {
    let mesh = terrain(100);
    let params = BuildParams::default();
    let needed = BuildWorkspace::bytes_needed(mesh.triangles().len(), &params);
    let mut workspace = BuildWorkspace::default();
    let mut kept = |limit: Option<usize>| {
        workspace.control.memory_limit = limit;
        let tree = Bvh::build_in(&[&mesh], &params, &mut workspace).unwrap();
        let (bytes, before) = (tree.stats().bytes, workspace.bytes());
        tree.recycle(&mut workspace);
        (workspace.bytes() - before, bytes)
    };
    let (added, bytes) = kept(None);
    assert!(added >= bytes && added < bytes + 100);
    assert_eq!(kept(Some(needed)).0, 0);
    assert!(kept(Some(needed + 2 * bytes)).0 >= bytes);
}

#[test]
fn memory_is_what_was_announced_and_a_limit_is_kept() {
    let mesh = terrain(100);
    let n = mesh.triangles().len();
    for params in every_quality() {
        let needed = BuildWorkspace::bytes_needed(n, &params);
        let mut workspace = BuildWorkspace::default();
        workspace.control.memory_limit = Some(needed - 1);
        let got = Bvh::build_in(&[&mesh], &params, &mut workspace).err();
        let limit = needed - 1;
        assert_eq!(got, Some(BuildError::MemoryLimit { needed, limit }));
        workspace.control.memory_limit = Some(needed);
        let mut bytes = vec![];
        for _ in 0..5 {
            Bvh::build_in(&[&mesh], &params, &mut workspace).unwrap();
            bytes.push(workspace.bytes());
        }
        assert!(
            bytes.iter().all(|&b| b <= needed),
            "{:?}: {bytes:?} of {needed} bytes",
            params.quality
        );
        // Buffers that change places may both grow to the larger size in the second build.
        assert!(bytes[2..].iter().all(|&b| b == bytes[1]), "{bytes:?}");
    }
}
