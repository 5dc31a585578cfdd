//! A wood of one tree that is planted many times: instances, masks, and leaves that are cut out of
//! cards.
//!
//! Run: `cargo run --release --example 09_instances`

use std::sync::Arc;

use raywright::bvh::{
    Affine3, BuildParams, Bvh, Instance, InstanceHit, InstancedBvh, Ray, TriangleMesh, Vec3,
};

/// Bits of masks: what the camera sees, what casts shadows.
const SEEN: u32 = 0b01;
const CASTS_SHADOW: u32 = 0b10;

/// A parallelogram around a centre.
fn card(centre: Vec3, a: Vec3, b: Vec3) -> Result<TriangleMesh, Box<dyn std::error::Error>> {
    let corners = [-a - b, a - b, a + b, b - a]
        .map(|v| centre + v * 0.5)
        .to_vec();
    Ok(TriangleMesh::new(corners, vec![[0, 1, 2], [0, 2, 3]])?)
}

/// Cards are opaque where their texture is: in rings around their middle.
fn is_opaque(hit: &InstanceHit) -> bool {
    let (u, v) = (hit.hit.u, hit.hit.v);
    let (x, y) = [(u + v, v), (u, u + v)][hit.hit.primitive_id as usize];
    let radius = (2.0 * x - 1.0).hypot(2.0 * y - 1.0);
    // The stem has no holes.
    hit.hit.geometry_id == 0 || (radius < 1.0 && !((radius * 10.0) as u32).is_multiple_of(3))
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let params = BuildParams::default();
    let stem = card(Vec3::Y, Vec3::X * 0.3, Vec3::Y * 2.0)?;
    let leaves = card(Vec3::Y * 3.0, Vec3::X * 2.5, Vec3::Y * 3.0)?;
    let ground = card(Vec3::ZERO, Vec3::X * 200.0, Vec3::Z * 200.0)?;
    let trees = [
        Arc::new(Bvh::build(&[&ground], &params)?),
        Arc::new(Bvh::build(&[&stem, &leaves], &params)?),
    ];

    let mut instances = vec![Instance::new(0, Affine3::IDENTITY)];
    for i in 0..400 {
        let (row, column) = ((i / 20) as f32, (i % 20) as f32);
        let place = Vec3::new(column * 4.0 - 39.0 + row % 2.0, 0.0, -3.0 * row);
        let size = Vec3::new(1.0, 0.7 + (i * 7 % 10) as f32 * 0.06, 1.0);
        let transform = Affine3::from_translation(place)
            * Affine3::from_rotation_y(i as f32)
            * Affine3::from_scale(size);
        // In the left half there are only shadows.
        let mask = if column < 10.0 {
            CASTS_SHADOW
        } else {
            u32::MAX
        };
        instances.push(Instance::new(1, transform).with_mask(mask));
    }
    let wood = InstancedBvh::build(&trees, &instances, &params, &mut Default::default())?;

    let (eye, sun) = (Vec3::new(0.0, 6.0, 12.0), Vec3::new(0.5, 0.6, 0.4));
    let mut counts = [0; 4];
    for y in 0..18 {
        let line = (0..76).map(|x| {
            let direction = Vec3::new((x as f32 - 37.5) / 40.0, (1.5 - y as f32) / 24.0, -1.0);
            let ray = Ray::new(eye, direction);
            let Some(hit) = wood.closest_hit_where(&ray, SEEN, is_opaque) else {
                return ' ';
            };
            counts[0] += 1;
            let point = eye + direction * hit.hit.t;
            let to_sun = Ray::new(point, sun).with_range(1e-3, f32::INFINITY);
            let in_shadow = wood.any_hit_where(&to_sun, CASTS_SHADOW, is_opaque);
            counts[1] += usize::from(in_shadow);
            counts[2] += usize::from(wood.any_hit(&to_sun, CASTS_SHADOW));
            counts[3] += usize::from(wood.any_hit_where(&to_sun, SEEN, is_opaque));
            match (instances[hit.instance_id as usize].tree, in_shadow) {
                (0, false) => '.',
                (0, true) => ':',
                (_, false) => 'o',
                (_, true) => '8',
            }
        });
        println!("{}", line.collect::<String>());
    }
    println!("of {} points, in shadow: {};", counts[0], counts[1]);
    println!("if cards were opaque: {};", counts[2]);
    println!("if only what is seen cast shadows: {}", counts[3]);
    Ok(())
}
