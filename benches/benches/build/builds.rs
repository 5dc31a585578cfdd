//! Time and cost of builds.

use std::{cell::RefCell, time::Duration};

use raywright_benches::{
    clock::Clock,
    goals::Goals,
    scenes::BenchScene,
    turns::{geometric_mean, measure_by},
};
use raywright_bvh::{
    Aabb, BuildParams, BuildPrimitive, BuildWorkspace, Bvh, Hierarchy, LeafReference, Quality,
    Rounding, TriangleMesh,
};
use raywright_validation::{
    Node, Tree,
    embree::{BuildArguments, BuildQuality, Device, SceneSettings},
};

const ROUNDS: usize = 5;
/// Of builds that take seconds and have no goal for their time.
const FEW_ROUNDS: usize = 2;

/// Quality of ours, of Embree, and the largest ratio of CPU times that meets the goal.
const GOALS: [(Quality, BuildQuality, f64); 3] = [
    (Quality::Morton, BuildQuality::Low, 1.0),
    (Quality::BinnedSah, BuildQuality::Medium, 1.0),
    (Quality::SpatialSplits, BuildQuality::High, 0.8),
];

/// The largest ratio of costs that is no worse: rounding alone changes it by less than this.
const SAH_GOAL: f64 = 1.001;

/// Qualities that Embree does not have, and the quality that they are set beside.
const BEYOND: [(Quality, BuildQuality); 2] = [
    (Quality::Agglomerative, BuildQuality::Low),
    (Quality::Optimized, BuildQuality::High),
];

/// What is built: its name, its cost if it is known, and a build, which says how long it took.
pub(crate) struct Builder<'a> {
    pub(crate) name: String,
    pub(crate) sah: Option<f64>,
    pub(crate) run: Box<dyn Fn() -> Duration + 'a>,
}

/// Ratios of all scenes.
#[derive(Debug, Default)]
pub(crate) struct Summary {
    rows: Vec<Row>,
}

#[derive(Debug)]
struct Row {
    scene: String,
    quality: Quality,
    /// CPU time of ours ÷ that of Embree.
    time: f64,
    /// Cost of our tree ÷ that of Embree's.
    sah: f64,
}

/// Our settings for a quality: those of Embree's scenes where it has the quality.
pub(crate) fn params_of(quality: Quality) -> BuildParams {
    let mut params = match quality {
        Quality::Morton | Quality::Agglomerative => BuildParams::embree_mesh_morton(),
        Quality::BinnedSah => BuildParams::embree_scene_medium(),
        Quality::SpatialSplits | Quality::Optimized => BuildParams::embree_scene_high(),
    };
    params.quality = quality;
    params
}

/// Embree's own settings for a quality: with them our trees are its trees (golden tests).
fn embree_params(quality: BuildQuality) -> BuildParams {
    match quality {
        BuildQuality::Low => BuildParams::embree_mesh_morton(),
        BuildQuality::Medium => BuildParams::embree_scene_medium(),
        BuildQuality::High => BuildParams::embree_scene_high(),
    }
}

/// Expected visits of nodes and of blocks of four, in Embree's units; `None` if it is not built.
/// For Embree's settings this is the cost of Embree's own tree, which is ours (golden tests).
fn sah(mesh: &TriangleMesh, params: &BuildParams) -> Option<f64> {
    let stats = Bvh::build(&[mesh], params).ok()?.stats();
    Some(stats.sah_nodes + stats.sah_blocks)
}

/// The same for a tree of either builder over primitives in the box `root`.
fn sah_of(tree: &Tree, root: &Aabb) -> f64 {
    fn sum(node: &Node, bounds: &Aabb) -> f64 {
        match node {
            Node::Leaf(references) => half_area(bounds) * references.len().div_ceil(4) as f64,
            Node::Inner(children) => {
                let below = children.iter().map(|(bounds, child)| sum(child, bounds));
                half_area(bounds) + below.sum::<f64>()
            }
        }
    }
    let root_node = tree.root.as_ref().expect("a tree over something");
    sum(root_node, root) / half_area(root)
}

fn half_area(bounds: &Aabb) -> f64 {
    let d = bounds.max.as_dvec3() - bounds.min.as_dvec3();
    d.x * (d.y + d.z) + d.y * d.z
}

impl Summary {
    pub(crate) fn measure(&mut self, scene: &BenchScene, device: Option<&Device>, threads: usize) {
        let clock = if threads == 1 {
            Clock::ProcessCpu
        } else {
            Clock::Wall
        };
        let mesh = &scene.mesh;
        let primitives = primitives(mesh);
        for (quality, embree_quality, _) in GOALS {
            let mut builders = Vec::new();
            if let Some(device) = device {
                builders.push(commit(device, mesh, embree_quality, clock, ""));
                builders.push(commit(device, mesh, embree_quality, clock, " again"));
            }
            let ours = builders.len();
            builders.extend(our_builds(mesh, params_of(quality), clock));
            let api = builders.len();
            if let Some(device) = device.filter(|_| threads == 1) {
                builders.extend(api_builds(device, mesh, &primitives, embree_quality, clock));
            }
            let times = table(&format!("{quality:?}"), &builders, ROUNDS, clock);
            if device.is_none() || threads != 1 || api == ours {
                continue;
            }
            // Embree's builder interface spoils its spatial splits (it clears budgets); its scenes
            // do not, and are what ours has to reach.
            let theirs = match embree_quality {
                BuildQuality::High => builders[0].sah,
                BuildQuality::Low | BuildQuality::Medium => builders[api].sah,
            };
            if let (Some(own), Some(theirs)) = (builders[ours].sah, theirs) {
                self.rows.push(Row {
                    scene: scene.name.clone(),
                    quality,
                    time: times[ours],
                    sah: own / theirs,
                });
            }
        }
        for (quality, embree_quality) in BEYOND {
            let mut builders = our_builds(mesh, params_of(quality), clock);
            if let Some(device) = device.filter(|_| !builders.is_empty()) {
                builders.insert(0, commit(device, mesh, embree_quality, clock, ""));
            }
            table(
                &format!("{quality:?}, not part of Embree"),
                &builders,
                FEW_ROUNDS,
                clock,
            );
        }
        #[cfg(feature = "peers")]
        {
            let mut builders = Vec::new();
            if let Some(device) = device {
                builders.push(commit(device, mesh, BuildQuality::Medium, clock, ""));
            }
            builders.extend(super::peers::builders(mesh, clock));
            table("other crates", &builders, ROUNDS, clock);
        }
    }

    pub(crate) fn judge(&self, goals: &mut Goals) {
        println!("\nbuilds: CPU time at one thread and SAH, ours ÷ Embree's");
        for (quality, _, limit) in GOALS {
            let rows = || self.rows.iter().filter(move |row| row.quality == quality);
            let times: Vec<f64> = rows().map(|row| row.time).collect();
            let worst = rows().map(|row| row.sah).fold(0.0, f64::max);
            for row in rows() {
                let (scene, time, sah) = (&row.scene, row.time, row.sah);
                println!("{quality:?}, {scene}: time {time:.3}, SAH {sah:.4}");
            }
            let mean = geometric_mean(&times);
            println!("{quality:?}: geometric mean of times {mean:.3} (goal ≤ {limit})");
            let what =
                format!("{quality:?}: build in {mean:.3} of Embree's CPU time, goal {limit}");
            goals.check(what, mean <= limit);
            let what = format!("{quality:?}: SAH up to {worst:.4} of Embree's, goal {SAH_GOAL}");
            goals.check(what, worst > 0.0 && worst <= SAH_GOAL);
        }
    }
}

fn commit<'a>(
    device: &'a Device,
    mesh: &'a TriangleMesh,
    quality: BuildQuality,
    clock: Clock,
    note: &str,
) -> Builder<'a> {
    Builder {
        name: format!("Embree rtcCommitScene, {quality:?}{note}"),
        sah: sah(mesh, &embree_params(quality)),
        run: Box::new(move || {
            let settings = SceneSettings::of_quality(quality);
            let scene = device.scene(&[mesh], &settings).expect("a scene");
            clock.time(|| scene.commit().expect("committed"))
        }),
    }
}

/// A build in new memory; one that reuses what the last needed while it built; one that takes the
/// memory of the last tree too, as from frame to frame. Nothing if it is not built yet.
fn our_builds(mesh: &TriangleMesh, params: BuildParams, clock: Clock) -> Vec<Builder<'_>> {
    if let Err(faults) = params.validate() {
        println!("\n{:?}: {}", params.quality, faults[0]);
        return Vec::new();
    }
    let sah = sah(mesh, &params);
    let workspace = RefCell::new(BuildWorkspace::default());
    let frames = RefCell::new((BuildWorkspace::default(), None::<Bvh>));
    vec![
        Builder {
            name: "raywright Bvh::build".into(),
            sah,
            run: Box::new(move || clock.time(|| Bvh::build(&[mesh], &params).expect("a tree"))),
        },
        Builder {
            name: "  in the memory of the last".into(),
            sah,
            run: Box::new(move || {
                let workspace = &mut workspace.borrow_mut();
                clock.time(|| Bvh::build_in(&[mesh], &params, workspace).expect("a tree"))
            }),
        },
        Builder {
            name: "  and in that of the last tree".into(),
            sah,
            run: Box::new(move || {
                let (workspace, tree) = &mut *frames.borrow_mut();
                clock.time(|| {
                    if let Some(last) = tree.take() {
                        last.recycle(workspace);
                    }
                    *tree = Some(Bvh::build_in(&[mesh], &params, workspace).expect("a tree"));
                })
            }),
        },
    ]
}

/// Trees without a layout. By Embree's rounding ours is the same tree, at a price.
fn api_builds<'a>(
    device: &'a Device,
    mesh: &'a TriangleMesh,
    primitives: &'a [BuildPrimitive],
    quality: BuildQuality,
    clock: Clock,
) -> Vec<Builder<'a>> {
    let params = embree_params(quality);
    let arguments = BuildArguments::of(&params, primitives.len()).expect("a quality of Embree's");
    let corners = |reference: LeafReference| mesh.corners(reference.primitive_id);
    let root = primitives
        .iter()
        .fold(Aabb::EMPTY, |all, p| all.union(p.bounds));
    let embree = move || {
        let built = device.build(primitives, Some(&corners), &arguments);
        built.expect("a tree")
    };
    let ours = [Rounding::Exact, Rounding::Embree].map(|rounding| {
        let mut params = params;
        params.rounding = rounding;
        let build = move || {
            let workspace = &mut BuildWorkspace::default();
            Hierarchy::build(primitives, Some(&corners), &params, workspace).expect("a tree")
        };
        Builder {
            name: format!("raywright Hierarchy::build, {rounding:?}"),
            sah: Some(sah_of(&Tree::of(&build()), &root)),
            run: Box::new(move || clock.time(build)),
        }
    });
    let embree = Builder {
        name: "Embree rtcBuildBVH".into(),
        sah: Some(sah_of(&embree().tree().expect("a whole tree"), &root)),
        run: Box::new(move || clock.time(embree)),
    };
    std::iter::once(embree).chain(ours).collect()
}

pub(crate) fn primitives(mesh: &TriangleMesh) -> Vec<BuildPrimitive> {
    (0..mesh.triangles().len() as u32)
        .map(|primitive_id| BuildPrimitive {
            bounds: mesh
                .corners(primitive_id)
                .into_iter()
                .fold(Aabb::EMPTY, Aabb::extended_by),
            geometry_id: 0,
            primitive_id,
        })
        .collect()
}

/// Measures and prints; the median ratio of each builder's time to that of the first.
fn table(title: &str, builders: &[Builder<'_>], rounds: usize, clock: Clock) -> Vec<f64> {
    if builders.is_empty() {
        return Vec::new();
    }
    // Each timed build follows one of its own kind: memory that another builder has just freed, or
    // has not, made the same Embree build differ from itself by 2.4 (dragon, Morton).
    let turns = measure_by(builders.len(), rounds, |i| {
        (builders[i].run)();
        (builders[i].run)()
    });
    println!("\n{title}; {}, {rounds} rounds in turns", clock.name());
    println!(
        "  {:<36}{:>10}{:>8}{:>18}{:>10}",
        "", "ms", "ratio", "quartiles", "SAH"
    );
    let mut medians = Vec::new();
    for (i, builder) in builders.iter().enumerate() {
        let ratio = turns.time_ratio(i, 0);
        medians.push(ratio.median);
        println!(
            "  {:<36}{:>10.1}{:>8.3}{:>18}{:>10}",
            builder.name,
            turns.times[i].as_secs_f64() * 1e3,
            ratio.median,
            format!("{:.3} … {:.3}", ratio.quartiles[0], ratio.quartiles[1]),
            builder
                .sah
                .map_or_else(String::new, |sah| format!("{sah:.3}"))
        );
    }
    println!(
        "  SAH of rtcCommitScene: of our tree by its settings, which is its tree (golden tests)"
    );
    medians
}
