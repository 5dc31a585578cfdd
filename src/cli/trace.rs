//! `raywright trace`: rays that somebody else made, and what they hit, for those who check a tracer of their own.
//!
//! Invariants: hits are in the order of the rays, whatever the threads; a hit is what the library's
//! `closest_hit` and `any_hit` say, and is written without loss.

mod files;

use std::path::PathBuf;

use clap::Args;
use rayon::prelude::*;
use raywright::bvh::{BuildParams, Ray};

use super::{
    Failure, output,
    run_options::{ParameterOptions, RunOptions},
    scene::SceneOptions,
};
use files::{Form, Hits};

#[derive(Debug, Args)]
pub(crate) struct TraceArgs {
    /// A file (.obj, .obj.gz) or a built-in scene (interior, voxel-terrain)
    scene: String,
    /// Rays as .csv (a head is optional) or NumPy .npy (rows of f4 or f8): origin x, y, z, direction x, y, z
    /// and, if wanted, t_min and t_max, which are 0 and infinity otherwise
    #[arg(long, value_name = "FILE")]
    rays: PathBuf,
    /// Whether rays hit anything, instead of what they hit first
    #[arg(long)]
    any: bool,
    /// Where hits go, as .csv or .npy (f8): t, u, v, geometry_id, primitive_id, and inf, 0, 0, -1, -1 for none;
    /// with --any 1 or 0. u and v are the weights of the second and third vertex; geometry_id counts the
    /// meshes of the scene, primitive_id the triangles of one
    #[arg(short, long, value_name = "FILE", default_value = "hits.csv")]
    output: PathBuf,
    #[command(flatten)]
    parameters: ParameterOptions,
    #[command(flatten)]
    run: RunOptions,
}

/// Traces the rays and writes the hits.
pub(crate) fn run(args: &TraceArgs) -> Result<(), Failure> {
    let params = args.parameters.applied_to(BuildParams::default())?;
    // Before anything is read or built.
    let form = Form::of(&args.output)?;
    let (rays, rounded) = files::read_rays(&args.rays)?;
    if rounded > 0 {
        output::note(format_args!(
            "note: {rounded} numbers of the rays are no 32-bit floats and were rounded"
        ));
    }
    args.run.install(|| {
        let world = SceneOptions::built_in(&args.scene).world()?;
        let tree = world.build_tree(&params, &mut Default::default())?;
        let tree = tree
            .with_isa(args.run.isa())
            .ok_or_else(|| anyhow::anyhow!("this machine does not have that instruction set"))?;
        let hits = if args.any {
            Hits::Any(rays.par_iter().map(|ray| tree.any_hit(ray)).collect())
        } else {
            Hits::Closest(rays.par_iter().map(|ray| tree.closest_hit(ray)).collect())
        };
        files::write_hits(&args.output, form, &hits)?;
        output::line(format_args!(
            "{} of {} rays hit: {}",
            hits.count(),
            rays.len(),
            args.output.display()
        ))
    })
}

/// A ray from a row of a file: six numbers, or eight.
fn ray([ox, oy, oz, dx, dy, dz]: [f32; 6], range: Option<[f32; 2]>) -> Ray {
    let [t_min, t_max] = range.unwrap_or([0.0, f32::INFINITY]);
    Ray::new([ox, oy, oz], [dx, dy, dz]).with_range(t_min, t_max)
}
