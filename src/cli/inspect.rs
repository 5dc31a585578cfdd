//! `raywright inspect`: what a scene is, and what a tree over it is like.

use std::time::Instant;

use clap::Args;
use raywright::{
    bvh::{BuildParams, TreeStats},
    tracer::Indicators,
};

use super::{
    Failure, output,
    rows::{number, section},
    run_options::{ParameterOptions, RunOptions},
    scene::SceneOptions,
};

#[derive(Debug, Args)]
pub(crate) struct InspectArgs {
    #[command(flatten)]
    scene: SceneOptions,
    #[command(flatten)]
    run: RunOptions,
    #[command(flatten)]
    parameters: ParameterOptions,
    /// Print one JSON object
    #[arg(long)]
    json: bool,
}

#[derive(serde::Serialize)]
struct Report {
    schema_version: u32,
    scene: String,
    meshes: usize,
    materials: usize,
    triangles: usize,
    emissive_meshes: usize,
    other_lights: usize,
    bounds_min: [f32; 3],
    bounds_max: [f32; 3],
    camera_origin: [f32; 3],
    camera_target: [f32; 3],
    camera_vertical_fov_degrees: f32,
    indicators: Vec<(&'static str, f64)>,
    parameters: Vec<(String, String)>,
    tree: Vec<(&'static str, f64)>,
    /// How many leaves have so many references as the place says.
    leaf_sizes: Vec<usize>,
    build_ms: f64,
    notes: Vec<String>,
}

/// Prints the report.
pub(crate) fn run(args: &InspectArgs) -> Result<(), Failure> {
    let params = args.parameters.applied_to(BuildParams::default())?;
    let report = args.run.install(|| {
        let stage = args.scene.prepare()?;
        let start = Instant::now();
        let tree = stage.world.build_tree(&params, &mut Default::default())?;
        let build_ms = start.elapsed().as_secs_f64() * 1e3;
        let stats = tree.stats();
        let scene = stage.world.scene();
        let bounds = scene.bounds();
        let corner = |v: raywright::bvh::Vec3| {
            if bounds.is_empty() {
                [0.0; 3]
            } else {
                v.to_array()
            }
        };
        Ok(Report {
            schema_version: 1,
            scene: args.scene.scene.clone(),
            meshes: scene.meshes.len(),
            materials: scene.materials.len(),
            triangles: scene.triangle_count(),
            emissive_meshes: scene
                .meshes
                .iter()
                .filter(|m| scene.materials[m.material].is_emissive())
                .count(),
            other_lights: scene.lights.len(),
            bounds_min: corner(bounds.min),
            bounds_max: corner(bounds.max),
            camera_origin: stage.camera.origin.to_array(),
            camera_target: stage.camera.target.to_array(),
            camera_vertical_fov_degrees: stage.camera.vertical_fov_degrees,
            indicators: Indicators::of(scene, &stage.camera).named().collect(),
            parameters: raywright::tune::described(&params),
            tree: tree_rows(&stats),
            leaf_sizes: stats.leaf_sizes,
            build_ms,
            notes: stage.notes,
        })
    })?;
    if args.json {
        output::json(&report)
    } else {
        print(&report)
    }
}

fn tree_rows(stats: &TreeStats) -> Vec<(&'static str, f64)> {
    vec![
        ("nodes", stats.nodes as f64),
        ("leaves", stats.leaves as f64),
        ("references", stats.references as f64),
        ("duplication", stats.duplication),
        ("depth", stats.depth as f64),
        ("largest_leaf", stats.largest_leaf as f64),
        ("node_fill", stats.node_fill),
        ("leaf_fill", stats.leaf_fill),
        ("overlap", stats.overlap),
        ("sah_nodes", stats.sah_nodes),
        ("sah_primitives", stats.sah_primitives),
        ("sah_blocks", stats.sah_blocks),
        ("sah_cost", stats.sah_cost),
        ("bytes", stats.bytes as f64),
        (
            "bytes_per_reference",
            stats.bytes as f64 / stats.references.max(1) as f64,
        ),
    ]
}

fn print(report: &Report) -> Result<(), Failure> {
    let vector = |v: [f32; 3]| format!("{} {} {}", v[0], v[1], v[2]);
    let scene = [
        ("meshes", report.meshes.to_string()),
        ("materials", report.materials.to_string()),
        ("triangles", report.triangles.to_string()),
        ("emissive meshes", report.emissive_meshes.to_string()),
        ("other lights", report.other_lights.to_string()),
        ("bounds min", vector(report.bounds_min)),
        ("bounds max", vector(report.bounds_max)),
        ("camera origin", vector(report.camera_origin)),
        ("camera target", vector(report.camera_target)),
        (
            "vertical field of view",
            format!("{}°", report.camera_vertical_fov_degrees),
        ),
    ];
    section(&report.scene, scene)?;
    section(
        "indicators",
        report
            .indicators
            .iter()
            .map(|(name, value)| (*name, number(*value))),
    )?;
    section(
        "parameters",
        report
            .parameters
            .iter()
            .map(|(name, value)| (name.as_str(), value.clone())),
    )?;
    let tree = report
        .tree
        .iter()
        .map(|(name, value)| (*name, number(*value)));
    section("tree", tree.chain([("build_ms", number(report.build_ms))]))?;
    let sizes = report.leaf_sizes.iter().enumerate();
    let rows: Vec<_> = sizes
        .filter(|&(_, &leaves)| leaves > 0)
        .map(|(size, leaves)| (size.to_string(), leaves.to_string()))
        .collect();
    section(
        "leaves by number of references",
        rows.iter()
            .map(|(size, leaves)| (size.as_str(), leaves.clone())),
    )
}
