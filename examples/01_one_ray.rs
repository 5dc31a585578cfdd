//! One ray, one triangle.
//!
//! Run: `cargo run --example 01_one_ray`

use raywright::bvh::{BuildParams, Bvh, Ray, TriangleMesh, Vec3};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    // Positions in any unit, three indices per triangle.
    let vertices = vec![
        Vec3::new(0.0, 0.0, 0.0),
        Vec3::new(2.0, 0.0, 0.0),
        Vec3::new(0.0, 2.0, 0.0),
    ];
    let mesh = TriangleMesh::new(vertices, vec![[0, 1, 2]])?;

    // The place of a mesh in the slice is its geometry id.
    let bvh = Bvh::build(&[&mesh], &BuildParams::default())?;

    let ray = Ray::new([0.5, 0.25, 3.0], [0.0, 0.0, -1.0]);
    let hit = bvh.closest_hit(&ray).ok_or("the ray should hit")?;
    println!(
        "hit triangle {} of mesh {} at t = {}",
        hit.primitive_id, hit.geometry_id, hit.t
    );
    println!(
        "weights of its corners: {} {} {}",
        1.0 - hit.u - hit.v,
        hit.u,
        hit.v
    );

    // A shadow ray only asks whether there is anything.
    let blocked = bvh.any_hit(&ray.with_range(0.0, 2.9));
    println!("anything nearer than 2.9: {blocked}");
    Ok(())
}
