//! Trees that are built frame by frame, in the memory of those before: counted at the allocator of
//! the process, for which reason this file has one test alone.

use std::alloc::System;

use cap::Cap;
use rayon::{ThreadPool, ThreadPoolBuilder};
use raywright_bvh::{
    Accuracy, BuildParams, BuildWorkspace, Bvh, Collapse, Dynamics, LeafFormat, Quality,
    TriangleMesh, Vec3,
};

#[global_allocator]
static ALLOCATOR: Cap<System> = Cap::new(System, usize::MAX);

const WAYS: [(Quality, Collapse); 7] = [
    (Quality::Morton, Collapse::LargestFirst),
    (Quality::Agglomerative, Collapse::LargestFirst),
    (Quality::BinnedSah, Collapse::LargestFirst),
    (Quality::BinnedSah, Collapse::LeastCost),
    (Quality::SpatialSplits, Collapse::LargestFirst),
    (Quality::SpatialSplits, Collapse::LeastCost),
    (Quality::Optimized, Collapse::LargestFirst),
];

const WIDTHS: [u32; 4] = [2, 4, 7, 16];

/// Builds of the long run.
const REBUILDS: usize = 200;

/// What several threads may take for themselves while they build, which depends on which of them
/// are at work at the same time.
const OF_THREADS: usize = 1 << 20;

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

fn pool(threads: usize) -> ThreadPool {
    let builder = ThreadPoolBuilder::new().num_threads(threads);
    builder.build().unwrap()
}

/// Every quality and collapse, width, leaf format and accuracy, of a mesh that is built again and again.
fn every_setting() -> impl Iterator<Item = BuildParams> {
    let formats = [LeafFormat::Edges, LeafFormat::Compact];
    let accuracies = [Accuracy::Fast, Accuracy::Robust];
    WAYS.into_iter().flat_map(move |way| {
        WIDTHS.into_iter().flat_map(move |width| {
            formats.into_iter().flat_map(move |leaf_format| {
                accuracies.into_iter().map(move |accuracy| {
                    let mut params = BuildParams::default();
                    (params.quality, params.collapse) = way;
                    params.branching_factor = width;
                    params.leaf_format = leaf_format;
                    params.accuracy = accuracy;
                    params.dynamics = Dynamics::Dynamic;
                    params
                })
            })
        })
    })
}

/// Bytes that were ever asked for; larger by each allocation.
fn asked_for() -> usize {
    ALLOCATOR.total_allocated()
}

#[test]
fn rebuilds_allocate_nothing() {
    // Both stay to the end: a pool frees its memory some time after it has been dropped.
    let (one, two) = (pool(1), pool(2));
    // First, since the peak of the process is what is looked at.
    two.install(|| a_long_run(false));
    one.install(|| a_long_run(true));
    one.install(every_setting_builds_without_allocation);
    one.install(settings_in_turn_share_memory_and_old_ones_are_freed);
    one.install(a_static_build_leaves_nothing);
}

/// 200 builds, now of this quality, now of that: the memory in use does not change after the third
/// build of each, nor does the most that was in use.
fn a_long_run(single: bool) {
    let mesh = terrain(60);
    let mut workspace = BuildWorkspace::default();
    let (mut live, mut peak, mut asked) = (0, 0, 0);
    for build in 0..REBUILDS {
        let mut params = BuildParams::default();
        (params.quality, params.collapse) = WAYS[build % WAYS.len()];
        let tree = Bvh::build_in(&[&mesh], &params, &mut workspace).unwrap();
        tree.recycle(&mut workspace);
        let now = ALLOCATOR.allocated();
        if build < 3 * WAYS.len() {
            (live, peak, asked) = (now, ALLOCATOR.max_allocated(), asked_for());
            continue;
        }
        assert_eq!(now, live, "build {build}");
        let grown = ALLOCATOR.max_allocated() - peak;
        if single {
            assert_eq!((grown, asked_for() - asked), (0, 0), "build {build}");
        } else {
            assert!(grown <= OF_THREADS, "build {build}: {grown} bytes");
        }
    }
}

/// After three builds of a setting, one more takes nothing from the allocator; not even where the
/// workspace served all others before.
fn every_setting_builds_without_allocation() {
    let meshes = [terrain(20), terrain(3)];
    let meshes: Vec<&TriangleMesh> = meshes.iter().collect();
    let mut workspace = BuildWorkspace::default();
    for params in every_setting() {
        let mut asked = 0;
        for _ in 0..4 {
            asked = asked_for();
            let tree = Bvh::build_in(&meshes, &params, &mut workspace).unwrap();
            tree.recycle(&mut workspace);
        }
        assert_eq!(asked_for() - asked, 0, "{params:?}");
    }
}

/// Whoever tries all widths in turn allocates nothing after the first round; whoever then stays
/// with one no longer holds the memory of the others.
fn settings_in_turn_share_memory_and_old_ones_are_freed() {
    let mesh = terrain(20);
    let params = WIDTHS.map(|width| {
        let mut params = BuildParams::default();
        params.branching_factor = width;
        params
    });
    let mut workspace = BuildWorkspace::default();
    let mut build = |params: &BuildParams| {
        let tree = Bvh::build_in(&[&mesh], params, &mut workspace).unwrap();
        let bytes = tree.stats().bytes;
        tree.recycle(&mut workspace);
        (bytes, workspace.bytes())
    };
    let mut trees = params.map(|params| build(&params).0);
    trees.sort_unstable();
    let (_, all) = build(&params[0]);
    for _ in 0..3 {
        for params in &params {
            assert_eq!(build(params).1, all);
        }
    }
    let (mut own, mut kept) = (0, 0);
    for _ in 0..20 {
        (own, kept) = build(&params[3]);
    }
    let of_the_others = all - kept;
    assert!(of_the_others > 0 && of_the_others < 3 * trees[3]);
    // A workspace that never built anything else holds as much.
    let mut fresh = BuildWorkspace::default();
    for _ in 0..3 {
        let tree = Bvh::build_in(&[&mesh], &params[3], &mut fresh).unwrap();
        tree.recycle(&mut fresh);
    }
    // The blocks may be those of a tree that had more of them.
    assert!(
        kept >= fresh.bytes() && kept - fresh.bytes() < own,
        "{kept} {}",
        fresh.bytes()
    );
}

/// With `static` the memory is given back: each build takes the same anew.
fn a_static_build_leaves_nothing() {
    let mesh = terrain(20);
    for way in WAYS {
        let mut params = BuildParams::default();
        (params.quality, params.collapse) = way;
        params.dynamics = Dynamics::Static;
        let mut workspace = BuildWorkspace::default();
        let live = ALLOCATOR.allocated();
        let mut taken = [0; 4];
        for taken in &mut taken {
            let asked = asked_for();
            let tree = Bvh::build_in(&[&mesh], &params, &mut workspace).unwrap();
            *taken = asked_for() - asked;
            tree.recycle(&mut workspace);
            assert_eq!(ALLOCATOR.allocated(), live, "{way:?}");
        }
        assert_eq!(taken, [taken[0]; 4], "{way:?}");
    }
}
