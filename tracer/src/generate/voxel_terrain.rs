//! A landscape of unit cubes with caves, trees and lava, as block games make it.
//!
//! Idea: a height from value noise, tunnels where two slow 3-d noises are both near their middle
//! value (the intersection of two surfaces is a curve), and only the faces that touch air. The
//! kind of scene is that of `vokselia_spawn` in the autotuning paper; the world is another.
//!
//! Invariants: every coordinate is a whole number; every face is a unit square of two triangles
//! whose normal points to air; beyond the borders of the world is air, so that the surface is
//! closed. Hard on a tree builder by its ties: equal areas, equal centroids on each axis, and
//! camera rays that meet edges exactly.

use raywright_bvh::{TriangleMesh, Vec3};
use raywright_imaging::Camera;

use super::noise::{at_lattice, value_noise};
use crate::scene::{Light, Material, Mesh, Scene};

/// Edge of the world in blocks for about 300,000 triangles.
pub const DEFAULT_SIZE: u32 = 160;

const HEIGHT: i32 = 72;
const SEA_LEVEL: i32 = 24;
const SNOW_LEVEL: i32 = 46;
const LAVA_LEVEL: i32 = 7;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Block {
    Air,
    Stone,
    Dirt,
    Grass,
    Sand,
    Snow,
    Water,
    Wood,
    Leaves,
    Lava,
}

/// What is drawn: one mesh and one material each, with albedo and emitted radiance.
const SOLIDS: [(Block, &str, [f32; 3], [f32; 3]); 9] = [
    (Block::Stone, "stone", [0.28, 0.27, 0.26], [0.0; 3]),
    (Block::Dirt, "dirt", [0.25, 0.15, 0.08], [0.0; 3]),
    (Block::Grass, "grass", [0.13, 0.32, 0.06], [0.0; 3]),
    (Block::Sand, "sand", [0.66, 0.58, 0.36], [0.0; 3]),
    (Block::Snow, "snow", [0.86, 0.88, 0.92], [0.0; 3]),
    (Block::Water, "water", [0.05, 0.17, 0.36], [0.0; 3]),
    (Block::Wood, "wood", [0.20, 0.12, 0.06], [0.0; 3]),
    (Block::Leaves, "leaves", [0.06, 0.20, 0.04], [0.0; 3]),
    (Block::Lava, "lava", [0.30, 0.08, 0.02], [9.0, 2.6, 0.4]),
];

/// Blocks in x, y, z from 0; air outside.
struct World {
    size: i32,
    blocks: Vec<Block>,
}

impl World {
    fn place(&self, [x, y, z]: [i32; 3]) -> Option<usize> {
        let inside =
            (0..self.size).contains(&x) && (0..HEIGHT).contains(&y) && (0..self.size).contains(&z);
        inside.then(|| ((y * self.size + z) * self.size + x) as usize)
    }

    fn get(&self, position: [i32; 3]) -> Block {
        self.place(position)
            .map_or(Block::Air, |place| self.blocks[place])
    }

    /// Sets a block; nothing happens outside the world.
    fn set(&mut self, position: [i32; 3], block: Block) {
        if let Some(place) = self.place(position) {
            self.blocks[place] = block;
        }
    }

    fn columns(&self) -> impl Iterator<Item = (i32, i32)> + use<> {
        let size = self.size;
        (0..size).flat_map(move |z| (0..size).map(move |x| (x, z)))
    }
}

/// The terrain on `size` × `size` columns, clamped to 1..=1024, centred on the origin in x and z.
/// The number of triangles grows with the square of `size`.
#[must_use]
pub fn voxel_terrain(size: u32) -> Scene {
    let size = size.clamp(1, 1024) as i32;
    let world = make_world(size);
    let materials: Vec<Material> = SOLIDS
        .iter()
        .map(|(_, name, albedo, radiance)| {
            Material::diffuse(*name, Vec3::from_array(*albedo))
                .with_emission(Vec3::from_array(*radiance))
        })
        .collect();
    let meshes = SOLIDS
        .iter()
        .enumerate()
        .map(|(material, &(block, name, ..))| Mesh {
            name: name.to_owned(),
            triangles: visible_faces(&world, block),
            material,
        })
        .filter(|mesh| !mesh.triangles.triangles().is_empty())
        .collect();
    let extent = size as f32;
    Scene {
        meshes,
        materials,
        lights: vec![
            Light::Constant {
                radiance: Vec3::new(0.42, 0.58, 0.9),
            },
            Light::Directional {
                direction: Vec3::new(0.62, -0.6, -0.36),
                irradiance: Vec3::new(4.4, 3.9, 3.1),
            },
        ],
        camera: Some(Camera {
            origin: Vec3::new(-0.44 * extent, 46.0 + 0.16 * extent, 0.62 * extent),
            target: Vec3::new(0.04 * extent, 22.0, -0.02 * extent),
            up: Vec3::Y,
            vertical_fov_degrees: 48.0,
        }),
    }
}

fn make_world(size: i32) -> World {
    let mut world = World {
        size,
        blocks: vec![Block::Air; (size * size * HEIGHT) as usize],
    };
    for (x, z) in world.columns() {
        let ground = ground_height(x, z);
        for y in 0..=ground.max(SEA_LEVEL) {
            world.set([x, y, z], undisturbed([x, y, z], ground));
        }
    }
    carve(&mut world);
    for (x, z) in world.columns() {
        let ground = ground_height(x, z);
        if world.get([x, ground, z]) == Block::Grass && at_lattice(5, [x, 0, z]) < 0.018 {
            plant_tree(&mut world, [x, ground + 1, z]);
        }
    }
    world
}

/// The y of the highest block of a column without sea and trees.
fn ground_height(x: i32, z: i32) -> i32 {
    let octave = |seed, wavelength: f32| {
        value_noise(seed, [x as f32 / wavelength, 0.0, z as f32 / wavelength])
    };
    let hills = 0.65 * octave(1, 56.0) + 0.25 * octave(2, 21.0) + 0.10 * octave(3, 8.0);
    // Squaring makes valleys wide and peaks narrow.
    (13.0 + 62.0 * hills * hills) as i32
}

fn undisturbed([x, y, z]: [i32; 3], ground: i32) -> Block {
    let depth = ground - y;
    let rough = (3.0 * at_lattice(4, [x, 0, z])) as i32;
    if depth < 0 {
        Block::Water
    } else if depth > 3 {
        Block::Stone
    } else if ground <= SEA_LEVEL + 1 {
        Block::Sand
    } else if depth > 0 {
        Block::Dirt
    } else if ground + rough > SNOW_LEVEL {
        Block::Snow
    } else {
        Block::Grass
    }
}

/// Removes tunnels and fills the deepest with lava. The lowest layer stays, and so does the bed of
/// the sea, which would otherwise stand on air.
fn carve(world: &mut World) {
    for (x, z) in world.columns() {
        let ground = ground_height(x, z);
        let roof = if ground <= SEA_LEVEL + 1 {
            ground - 4
        } else {
            ground
        };
        for y in 1..=roof {
            let noise = |seed, [wide, high]: [f32; 2]| {
                value_noise(seed, [x as f32 / wide, y as f32 / high, z as f32 / wide]) - 0.5
            };
            let (first, second) = (noise(6, [17.0, 11.0]), noise(7, [14.0, 9.0]));
            if first * first + second * second < 0.0045 {
                let deep = y <= LAVA_LEVEL;
                world.set([x, y, z], if deep { Block::Lava } else { Block::Air });
            }
        }
    }
}

fn plant_tree(world: &mut World, [x, y, z]: [i32; 3]) {
    let trunk = 4 + (3.0 * at_lattice(8, [x, y, z])) as i32;
    for dy in -2..=2_i32 {
        let reach = if dy >= 1 { 1 } else { 2 };
        for dz in -reach..=reach {
            for dx in -reach..=reach {
                let position = [x + dx, y + trunk + dy, z + dz];
                let corner = i32::abs(dx) == reach && i32::abs(dz) == reach;
                let missing = corner && (dy == 2 || at_lattice(9, position) < 0.5);
                if !missing && world.get(position) == Block::Air {
                    world.set(position, Block::Leaves);
                }
            }
        }
    }
    for dy in 0..trunk {
        world.set([x, y + dy, z], Block::Wood);
    }
}

/// The faces between `block` and air. Vertices are shared among the faces of one kind of block.
fn visible_faces(world: &World, block: Block) -> TriangleMesh {
    let lattice_size = world.size + 1;
    let mut numbers = vec![u32::MAX; (lattice_size * lattice_size * (HEIGHT + 1)) as usize];
    let mut vertices = Vec::new();
    let mut triangles = Vec::new();
    let mut vertex = |[x, y, z]: [i32; 3]| {
        let number = &mut numbers[((y * lattice_size + z) * lattice_size + x) as usize];
        if *number == u32::MAX {
            *number = vertices.len() as u32;
            let centred = [x - world.size / 2, y, z - world.size / 2];
            vertices.push(Vec3::from_array(centred.map(|c| c as f32)));
        }
        *number
    };
    for y in 0..HEIGHT {
        for (x, z) in world.columns() {
            let position = [x, y, z];
            if world.get(position) != block {
                continue;
            }
            for axis in 0..3 {
                let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
                for (towards, u, v) in [(1, u, v), (-1, v, u)] {
                    let mut neighbour = position;
                    neighbour[axis] += towards;
                    if world.get(neighbour) != Block::Air {
                        continue;
                    }
                    // u, v and the outward axis are right-handed: around the face, along u first.
                    let mut corner = position;
                    corner[axis] += (towards + 1) / 2;
                    let [a, b, c, d] = [[0, 0], [1, 0], [1, 1], [0, 1]].map(|[du, dv]| {
                        let mut place = corner;
                        place[u] += du;
                        place[v] += dv;
                        vertex(place)
                    });
                    triangles.extend([[a, b, c], [a, c, d]]);
                }
            }
        }
    }
    TriangleMesh::new(vertices, triangles).expect("faces use vertices that were just made")
}

#[cfg(test)]
mod tests {
    use std::collections::HashMap;

    use super::*;

    /// Each face has its block behind and air in front.
    #[test]
    fn normals_point_from_the_block_to_air() {
        let size = 32;
        let world = make_world(size);
        let scene = voxel_terrain(size as u32);
        let mut faces = 0;
        for mesh in &scene.meshes {
            let block = SOLIDS[mesh.material].0;
            for pair in mesh.triangles.triangles().chunks(2) {
                let corner = |i: u32| mesh.triangles.vertices()[i as usize];
                let [a, b, c] = pair[0].map(corner);
                let normal = (b - a).cross(c - a);
                assert_eq!(normal.abs().element_sum(), 1.0);
                let middle = 0.5 * (a + c);
                let block_at = |point: Vec3| {
                    let half = (size / 2) as f32;
                    let shifted = point + Vec3::new(half, 0.0, half);
                    world.get(shifted.to_array().map(|c| c.floor() as i32))
                };
                assert_eq!(block_at(middle - 0.5 * normal), block);
                assert_eq!(block_at(middle + 0.5 * normal), Block::Air);
                faces += 1;
            }
        }
        assert_eq!(faces * 2, scene.triangle_count());
    }

    /// As many faces go through each edge in one direction as in the other: no hole.
    #[test]
    fn the_surface_is_closed() {
        let scene = voxel_terrain(24);
        let mut balance: HashMap<[[i32; 3]; 2], i32> = HashMap::new();
        for mesh in &scene.meshes {
            for i in 0..mesh.triangles.triangles().len() as u32 {
                let corners = mesh.triangles.corners(i);
                for k in 0..3 {
                    let ends = [corners[k], corners[(k + 1) % 3]];
                    let [from, to] = ends.map(|p| p.to_array().map(|c| c as i32));
                    let direction = if from < to { 1 } else { -1 };
                    *balance.entry([from.min(to), from.max(to)]).or_default() += direction;
                }
            }
        }
        assert!(balance.values().all(|&sum| sum == 0));
    }

    #[test]
    fn the_default_world_has_every_kind_of_block_and_caves() {
        let scene = voxel_terrain(DEFAULT_SIZE);
        assert_eq!(scene.meshes.len(), SOLIDS.len());
        let world = make_world(DEFAULT_SIZE as i32);
        let underground_air = world
            .columns()
            .flat_map(|(x, z)| (1..ground_height(x, z) - 8).map(move |y| [x, y, z]))
            .filter(|&position| world.get(position) == Block::Air)
            .count();
        assert!(underground_air > 10_000, "{underground_air}");
    }
}
