//! Do all kernels give the bits of the loop over all triangles? For many rays: a million through every width, leaf
//! format, accuracy and instruction set, alone and in batches.
//!
//! Run: `cargo run --release -p raywright-bvh --example kernels_agree [-- RAYS]`. Exit code 1 if one differs.
//!
//! The rays start around and in a scene of a few hundred triangles (a grid, slivers, long triangles across each other,
//! two that are one on the other) and aim at vertices, edges, inner points or nowhere, along axes too; many have an end.

use std::process::ExitCode;

use rayon::prelude::*;
use raywright_bvh::{
    Accuracy, BuildParams, Bvh, Hit, Isa, LeafFormat, Ray, RayPackets, TriangleMesh, Vec3,
    reference,
};

const RAYS: usize = 1_000_000;

/// Rays of one batch.
const BATCH: usize = 4096;

type Bits = Option<[u32; 5]>;

fn bits(hit: Option<Hit>) -> Bits {
    hit.map(|h| {
        let [t, u, v] = [h.t, h.u, h.v].map(f32::to_bits);
        [t, u, v, h.geometry_id, h.primitive_id]
    })
}

/// SplitMix64 (Steele, Lea, Flood, 2014).
struct Random(u64);

impl Random {
    fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    fn below(&mut self, n: usize) -> usize {
        (self.bits() % n as u64) as usize
    }

    /// In 0..1.
    fn unit(&mut self) -> f32 {
        (self.bits() >> 40) as f32 / (1u32 << 24) as f32
    }

    /// In a cube from −1 to 1.
    fn vector(&mut self) -> Vec3 {
        Vec3::from([self.unit(), self.unit(), self.unit()]) * 2.0 - Vec3::ONE
    }
}

fn meshes(random: &mut Random) -> [TriangleMesh; 2] {
    const SIDE: u32 = 8;
    let grid = |height: f32| -> Vec<Vec3> {
        let point = |i: u32| {
            Vec3::new(
                (i % SIDE) as f32 / 3.5 - 1.0,
                height,
                (i / SIDE) as f32 / 3.5 - 1.0,
            )
        };
        (0..SIDE * SIDE).map(point).collect()
    };
    let mut vertices = grid(0.25);
    let mut triangles: Vec<[u32; 3]> = (0..SIDE * (SIDE - 1))
        .filter(|i| i % SIDE != SIDE - 1)
        .flat_map(|i| [[i, i + 1, i + SIDE], [i + 1, i + SIDE + 1, i + SIDE]])
        .collect();
    for number in 0..150 {
        let first = vertices.len() as u32;
        let (a, b) = (random.vector(), random.vector());
        let c = match number % 3 {
            0 => random.vector(),
            1 => (a + b) * 0.5 + random.vector() * 1e-4,
            _ => a + random.vector() * 0.1,
        };
        vertices.extend([a, b, c]);
        triangles.push([first, first + 1, first + 2]);
    }
    // The grid once more, in the place of the other: equal distances.
    let again = TriangleMesh::new(grid(0.25), triangles[..20].to_vec());
    [
        TriangleMesh::new(vertices, triangles).expect("a mesh"),
        again.expect("a mesh"),
    ]
}

fn ray(random: &mut Random, mesh: &TriangleMesh) -> Ray {
    let corners = mesh.corners(random.below(mesh.triangles().len()) as u32);
    let (along, across) = (random.unit(), random.unit());
    let target = match random.below(5) {
        0 => corners[random.below(3)],
        1 => corners[0].lerp(corners[1], along),
        2 => random.vector(),
        _ => {
            corners[0]
                + ((corners[1] - corners[0]) * along + (corners[2] - corners[0]) * across) * 0.5
        }
    };
    let origin = match random.below(4) {
        0 => target + Vec3::AXES[random.below(3)] * (random.unit() - 0.5),
        1 => random.vector() * 1e3,
        _ => random.vector() * 2.0,
    };
    let ray = Ray::new(origin, target - origin);
    match random.below(3) {
        0 => ray.with_range(0.5 * random.unit(), 0.5 + random.unit()),
        _ => ray,
    }
}

/// How many rays a tree answers otherwise, alone or in batches.
fn differing(tree: &Bvh, rays: &[Ray], expected: &[Bits]) -> usize {
    let alone = rays.par_iter().zip(expected).filter(|&(ray, &expected)| {
        bits(tree.closest_hit(ray)) != expected || tree.any_hit(ray) != expected.is_some()
    });
    let batches = [(8, RayPackets::Off), (1, RayPackets::On)].map(|(in_flight, packets)| {
        let tree = tree
            .clone()
            .with_rays_in_flight(in_flight)
            .with_ray_packets(packets);
        let batches = rays.par_chunks(BATCH).zip(expected.par_chunks(BATCH));
        let count = batches.map(|(rays, expected)| {
            let (mut hits, mut are_hit) = (Vec::new(), Vec::new());
            tree.closest_hits(rays, &mut hits);
            tree.any_hits(rays, &mut are_hit);
            let got = hits.into_iter().zip(are_hit).zip(expected);
            got.filter(|&((hit, is_hit), &expected)| {
                bits(hit) != expected || is_hit != expected.is_some()
            })
            .count()
        });
        count.sum::<usize>()
    });
    alone.count() + batches.into_iter().sum::<usize>()
}

fn main() -> ExitCode {
    let count = match std::env::args().nth(1).map(|text| text.parse()) {
        None => RAYS,
        Some(Ok(count)) => count,
        Some(Err(error)) => {
            eprintln!("error: RAYS: {error}");
            return ExitCode::from(2);
        }
    };
    let mut random = Random(1);
    let meshes = meshes(&mut random);
    let meshes = [&meshes[0], &meshes[1]];
    let rays: Vec<Ray> = (0..count).map(|_| ray(&mut random, meshes[0])).collect();
    let mut all_agree = true;
    for accuracy in [Accuracy::Fast, Accuracy::Robust] {
        let expected: Vec<Bits> = rays
            .par_iter()
            .map(|ray| {
                bits(reference::closest_hit(&meshes, ray, accuracy).expect("meshes of a tree"))
            })
            .collect();
        let hits = expected.iter().flatten().count();
        println!("{accuracy:?}: {count} rays, {hits} hit something");
        for leaf_format in [LeafFormat::Edges, LeafFormat::Compact] {
            for branching_factor in [2, 4, 8, 16] {
                let mut params = BuildParams::default();
                (params.accuracy, params.leaf_format) = (accuracy, leaf_format);
                params.branching_factor = branching_factor;
                let tree = Bvh::build(&meshes, &params).expect("a tree");
                for tree in Isa::ALL
                    .into_iter()
                    .filter_map(|isa| tree.clone().with_isa(isa))
                {
                    let differing = differing(&tree, &rays, &expected);
                    println!(
                        "  {leaf_format:?}, {branching_factor} children, {}: {differing} differ",
                        tree.isa()
                    );
                    all_agree &= differing == 0;
                }
            }
        }
    }
    match all_agree {
        true => ExitCode::SUCCESS,
        false => ExitCode::FAILURE,
    }
}
