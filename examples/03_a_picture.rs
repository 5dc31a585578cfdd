//! A picture of a scene made by hand: a floor, a wall and a lamp.
//!
//! Run: `cargo run --release --example 03_a_picture`

use raywright::{
    bvh::{BuildParams, TriangleMesh, Vec3},
    imaging::{Camera, Film, TileLoop, write_image},
    tracer::{Integrator, Material, Mesh, Rgb, Scene, Shot, World},
};

/// A parallelogram; its normal is `a` × `b`.
fn quad(corner: Vec3, a: Vec3, b: Vec3) -> Result<TriangleMesh, Box<dyn std::error::Error>> {
    let vertices = vec![corner, corner + a, corner + a + b, corner + b];
    Ok(TriangleMesh::new(vertices, vec![[0, 1, 2], [0, 2, 3]])?)
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let materials = vec![
        Material::diffuse("floor", Rgb::new(0.7, 0.7, 0.7)),
        Material::diffuse("wall", Rgb::new(0.7, 0.3, 0.2)),
        Material::diffuse("lamp", Rgb::ZERO).with_emission(Rgb::splat(12.0)),
    ];
    let shapes = [
        quad(Vec3::new(-2.0, 0.0, -2.0), Vec3::Z * 4.0, Vec3::X * 4.0)?,
        quad(Vec3::new(-2.0, 0.0, -2.0), Vec3::X * 4.0, Vec3::Y * 3.0)?,
        // A lamp emits on the side of its normal: downwards.
        quad(Vec3::new(-0.5, 2.5, -0.5), Vec3::X, Vec3::Z)?,
    ];
    let meshes = shapes.into_iter().zip(materials.iter()).enumerate();
    let meshes = meshes.map(|(material, (triangles, m))| Mesh {
        name: m.name.clone(),
        triangles,
        material,
    });
    let world = World::new(Scene {
        meshes: meshes.collect(),
        materials,
        ..Scene::default()
    });

    let tree = world.build_tree(&BuildParams::default(), &mut Default::default())?;
    let camera = Camera::new(
        Vec3::new(0.0, 1.5, 6.0),
        Vec3::new(0.0, 1.0, 0.0),
        Vec3::Y,
        45.0,
    )?;
    let shot = Shot {
        world: &world,
        camera,
        integrator: Integrator::Path { path_length: 3 },
        seed: 1,
    };
    let mut film = Film::new(320, 240)?;
    let done = shot.render(&mut film, 0..64, &TileLoop::new(), |_tile| &tree)?;
    println!("{done:?}: {} samples", film.samples());
    write_image("a_picture.png", &film.mean())?;
    Ok(())
}
