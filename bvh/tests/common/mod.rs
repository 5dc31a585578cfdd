//! What several test files share: meshes, rays, the qualities that are built today.

// Each test file is a program of its own and uses a part of this.
#![allow(dead_code)]

use raywright_bvh::{
    Aabb, BuildParams, BuildPrimitive, Collapse, Hierarchy, Hit, LeafReference, PARAMETERS,
    ParameterRange, Quality, Ray, TriangleMesh, Vec3,
};

pub(crate) type Bits = Option<(u32, u32, u32, u32, u32)>;

/// A hit to the last bit.
pub(crate) fn bits(hit: Option<Hit>) -> Bits {
    hit.map(|h| {
        (
            h.t.to_bits(),
            h.u.to_bits(),
            h.v.to_bits(),
            h.geometry_id,
            h.primitive_id,
        )
    })
}

/// Every quality that the table of parameters lists as built: one that is added there joins all
/// tests that ask here.
pub(crate) fn built_qualities() -> Vec<Quality> {
    let row = PARAMETERS.iter().find(|p| p.name == "quality").unwrap();
    let ParameterRange::Words(built) = row.range else {
        panic!("qualities are words");
    };
    let quality = |word: &&str| {
        let mut params = BuildParams::default();
        params.set("quality", word).unwrap();
        params.quality
    };
    built.iter().map(quality).collect()
}

/// These, those of Morton order once more with as many rotations as there may be, and those that are collapsed only where
/// it is asked for.
pub(crate) fn and_variants(mut all: Vec<BuildParams>) -> Vec<BuildParams> {
    for place in 0..all.len() {
        let mut params = all[place];
        match params.quality {
            Quality::Morton => params.rotations = 16,
            Quality::BinnedSah | Quality::SpatialSplits => params.collapse = Collapse::LeastCost,
            _ => continue,
        }
        all.push(params);
    }
    all
}

/// Random numbers by SplitMix64 (Steele, Lea, Flood, *Fast Splittable Pseudorandom Number
/// Generators*, 2014).
pub(crate) struct Random(pub(crate) u64);

impl Random {
    pub(crate) fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// In 0..1.
    pub(crate) fn unit(&mut self) -> f32 {
        (self.bits() >> 40) as f32 / (1u32 << 24) as f32
    }

    /// In the cube -1..1.
    pub(crate) fn vector(&mut self) -> Vec3 {
        Vec3::new(self.unit(), self.unit(), self.unit()) * 2.0 - 1.0
    }
}

/// A closed sphere of radius 1 with 4·n·(n − 1) triangles.
pub(crate) fn sphere(n: u32) -> TriangleMesh {
    let columns = 2 * n;
    let mut vertices = vec![Vec3::Z, -Vec3::Z];
    for row in 1..n {
        let (sin, cos) = (std::f32::consts::PI * row as f32 / n as f32).sin_cos();
        for column in 0..columns {
            let around = std::f32::consts::TAU * column as f32 / columns as f32;
            vertices.push(Vec3::new(sin * around.cos(), sin * around.sin(), cos));
        }
    }
    let at = |row: u32, column: u32| 2 + (row - 1) * columns + column % columns;
    let mut triangles = Vec::new();
    for column in 0..columns {
        triangles.push([0, at(1, column), at(1, column + 1)]);
        triangles.push([1, at(n - 1, column + 1), at(n - 1, column)]);
        for row in 1..n - 1 {
            let (a, b) = (at(row, column), at(row, column + 1));
            let (c, d) = (at(row + 1, column), at(row + 1, column + 1));
            triangles.push([a, c, d]);
            triangles.push([a, d, b]);
        }
    }
    TriangleMesh::new(vertices, triangles).unwrap()
}

/// The box of all triangles.
pub(crate) fn bounds(meshes: &[&TriangleMesh]) -> Aabb {
    let corners = meshes
        .iter()
        .flat_map(|mesh| (0..mesh.triangles().len() as u32).flat_map(move |id| mesh.corners(id)));
    corners.fold(Aabb::EMPTY, Aabb::extended_by)
}

/// Rays at random points of random triangles (corners and edges included), from around the scene
/// and from inside it; every third one has an end, every fourth is parallel to an axis.
pub(crate) fn random_rays(meshes: &[&TriangleMesh], count: usize, seed: u64) -> Vec<Ray> {
    let mut random = Random(seed);
    let all = bounds(meshes);
    let meshes: Vec<_> = meshes
        .iter()
        .filter(|m| !m.triangles().is_empty())
        .collect();
    if meshes.is_empty() {
        return vec![Ray::new(Vec3::ZERO, Vec3::X); count];
    }
    let size = (all.max - all.min).max_element().max(1e-3);
    (0..count)
        .map(|number| {
            let mesh = meshes[random.bits() as usize % meshes.len()];
            let id = random.bits() % mesh.triangles().len() as u64;
            let [a, b, c] = mesh.corners(id as u32);
            let (u, v) = match number % 5 {
                0 => (0.0, 0.0),
                1 => (0.5, 0.5),
                _ => (random.unit() * 0.5, random.unit() * 0.5),
            };
            let target = a + (b - a) * u + (c - a) * v;
            let direction = if number % 4 == 0 {
                let mut axis = Vec3::ZERO;
                axis[number / 4 % 3] = if number % 8 == 0 { size } else { -size };
                axis
            } else {
                random.vector() * size
            };
            let ray = Ray::new(target - direction, direction);
            if number % 3 == 0 {
                ray.with_range(0.5, 2.0)
            } else {
                ray
            }
        })
        .collect()
}

/// Threads of its own for a build, each with so much stack.
pub(crate) fn pool(threads: usize, stack_bytes: usize) -> rayon::ThreadPool {
    rayon::ThreadPoolBuilder::new()
        .num_threads(threads)
        .stack_size(stack_bytes)
        .build()
        .unwrap()
}

/// One primitive per triangle of a mesh.
pub(crate) fn primitives(mesh: &TriangleMesh) -> Vec<BuildPrimitive> {
    (0..mesh.triangles().len() as u32)
        .map(|primitive_id| BuildPrimitive {
            bounds: (mesh.corners(primitive_id).into_iter()).fold(Aabb::EMPTY, Aabb::extended_by),
            geometry_id: 0,
            primitive_id,
        })
        .collect()
}

/// Everything that is in a hierarchy: of each node, depth first, the level, the box as bits, and
/// the references if it is a leaf.
pub(crate) fn contents(tree: &Hierarchy) -> Vec<(usize, [u32; 6], Vec<LeafReference>)> {
    let mut all = Vec::new();
    let mut stack: Vec<_> = tree.root().map(|root| (1, root)).into_iter().collect();
    while let Some((level, node)) = stack.pop() {
        let Aabb { min, max } = node.bounds();
        let bits = [min.x, min.y, min.z, max.x, max.y, max.z].map(f32::to_bits);
        all.push((level, bits, node.leaf().unwrap_or_default().to_vec()));
        stack.extend(node.children().map(|child| (level + 1, child)));
    }
    all
}
