//! Watertightness: rays that start inside a closed mesh hit it, whether they aim anywhere, at a
//! point of an edge or at a vertex. The robust test must lose none; what the fast test loses is
//! printed (`cargo test -- --nocapture`).

use raywright_bvh::{Accuracy, BuildParams, Bvh, Isa, LeafFormat, Ray, TriangleMesh, Vec3};

const RAYS_PER_KIND: usize = 1000;

/// Numbers in 0..1 from a 64-bit Weyl sequence, mixed (SplitMix64).
struct Numbers(u64);

impl Numbers {
    fn next(&mut self) -> f32 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 40) as f32 / (1u32 << 24) as f32
    }

    fn below(&mut self, n: usize) -> usize {
        ((self.next() * n as f32) as usize).min(n - 1)
    }

    /// A vector of the cube -1..1.
    fn vector(&mut self) -> Vec3 {
        Vec3::new(self.next(), self.next(), self.next()) * 2.0 - 1.0
    }
}

/// A closed mesh, every corner a vertex that its neighbours share, and a box inside it.
struct Closed {
    name: &'static str,
    vertices: Vec<Vec3>,
    triangles: Vec<[u32; 3]>,
    inside: [Vec3; 2],
}

/// An icosahedron, each triangle divided into four `levels` times, on the unit sphere.
fn icosphere(levels: u32) -> Closed {
    let phi = (1.0 + 5f32.sqrt()) / 2.0;
    let mut vertices = Vec::new();
    for (a, b) in [(1.0, phi), (-1.0, phi), (1.0, -phi), (-1.0, -phi)] {
        vertices.extend([
            Vec3::new(a, b, 0.0),
            Vec3::new(0.0, a, b),
            Vec3::new(b, 0.0, a),
        ]);
    }
    // Faces are the triples at the edge's length from each other.
    let near = |a: Vec3, b: Vec3| (a.distance(b) - 2.0).abs() < 0.01;
    let mut triangles = Vec::new();
    for a in 0..12 {
        for b in a + 1..12 {
            for c in b + 1..12 {
                let [p, q, r] = [a, b, c].map(|i| vertices[i]);
                if near(p, q) && near(q, r) && near(r, p) {
                    triangles.push([a as u32, b as u32, c as u32]);
                }
            }
        }
    }
    assert_eq!(triangles.len(), 20);
    let mut vertices: Vec<Vec3> = vertices.into_iter().map(Vec3::normalize).collect();
    for _ in 0..levels {
        let mut middles = std::collections::HashMap::new();
        let mut middle = |a: u32, b: u32| {
            *middles.entry((a.min(b), a.max(b))).or_insert_with(|| {
                vertices.push((vertices[a as usize] + vertices[b as usize]).normalize());
                vertices.len() as u32 - 1
            })
        };
        triangles = triangles
            .iter()
            .flat_map(|&[a, b, c]| {
                let (ab, bc, ca) = (middle(a, b), middle(b, c), middle(c, a));
                [[a, ab, ca], [b, bc, ab], [c, ca, bc], [ab, bc, ca]]
            })
            .collect();
    }
    Closed {
        name: "icosphere",
        vertices,
        triangles,
        inside: [Vec3::splat(-0.4), Vec3::splat(0.4)],
    }
}

/// A box of `n` squares per side with heights on one face: a cube if all are 1, else a terrain over
/// a floor. Vertices are welded by their place on the lattice.
fn prism(name: &'static str, n: u32, mut height: impl FnMut(u32, u32) -> f32) -> Closed {
    let mut numbers = std::collections::HashMap::new();
    let mut vertices = Vec::new();
    let mut heights = std::collections::HashMap::new();
    let mut vertex = |[x, y, z]: [u32; 3]| {
        *numbers.entry([x, y, z]).or_insert_with(|| {
            let top = *heights.entry((x, z)).or_insert_with(|| height(x, z));
            let at = |i: u32| i as f32 / n as f32;
            vertices.push(Vec3::new(at(x), at(y) * top, at(z)));
            vertices.len() as u32 - 1
        })
    };
    let mut triangles = Vec::new();
    for i in 0..n {
        for j in 0..n {
            for side in [0, n] {
                for place in [
                    |i, j, side| [i, side, j],
                    |i, j, side| [side, i, j],
                    |i, j, side| [i, j, side],
                ] {
                    let [a, b, c, d] = [(i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1)]
                        .map(|(i, j)| vertex(place(i, j, side)));
                    triangles.extend([[a, b, c], [a, c, d]]);
                }
            }
        }
    }
    Closed {
        name,
        vertices,
        triangles,
        inside: [Vec3::splat(0.1), Vec3::new(0.9, 0.4, 0.9)],
    }
}

fn meshes() -> [Closed; 3] {
    let mut numbers = Numbers(7);
    [
        icosphere(4),
        prism("cube", 16, |_, _| 1.0),
        prism("terrain", 32, |_, _| 0.5 + 0.5 * numbers.next()),
    ]
}

/// Rays from points inside to the points that `target` makes, and how many there are.
fn misses(
    mesh: &Closed,
    tree: &Bvh,
    seed: u64,
    place: &impl Fn(Vec3) -> Vec3,
    target: impl Fn(&mut Numbers) -> Option<Vec3>,
) -> usize {
    let mut numbers = Numbers(seed);
    let mut misses = 0;
    for _ in 0..RAYS_PER_KIND {
        let [low, high] = mesh.inside;
        let origin = place(low + (high - low) * (numbers.vector() * 0.5 + 0.5));
        let direction = match target(&mut numbers) {
            Some(target) => target - origin,
            None => numbers.vector(),
        };
        let ray = Ray::new(origin, direction);
        let hit = tree.closest_hit(&ray);
        assert_eq!(hit.is_some(), tree.any_hit(&ray), "{ray:?}");
        misses += usize::from(hit.is_none());
    }
    misses
}

/// Misses by random rays, at points of edges, and at vertices.
fn leaks(
    mesh: &Closed,
    tree: &Bvh,
    vertices: &[Vec3],
    place: &impl Fn(Vec3) -> Vec3,
) -> [usize; 3] {
    let random = misses(mesh, tree, 1, place, |_| None);
    let edges = misses(mesh, tree, 2, place, |numbers| {
        let triangle = mesh.triangles[numbers.below(mesh.triangles.len())];
        let corner = numbers.below(3);
        let [a, b] = [corner, (corner + 1) % 3].map(|c| vertices[triangle[c] as usize]);
        Some(a + (b - a) * numbers.next())
    });
    let at_vertices = misses(mesh, tree, 3, place, |numbers| {
        Some(vertices[numbers.below(vertices.len())])
    });
    [random, edges, at_vertices]
}

fn check(mesh: &Closed, place: &impl Fn(Vec3) -> Vec3, accuracy: Accuracy, context: &str) {
    let vertices: Vec<Vec3> = mesh.vertices.iter().map(|&v| place(v)).collect();
    let triangles = TriangleMesh::new(vertices.clone(), mesh.triangles.clone()).unwrap();
    let mut params = BuildParams::default();
    params.accuracy = accuracy;
    // One tree of each width; the bits of the others are compared elsewhere.
    for (branching_factor, leaf_format) in [
        (8, LeafFormat::Edges),
        (4, LeafFormat::Compact),
        (16, LeafFormat::Edges),
    ] {
        params.branching_factor = branching_factor;
        params.leaf_format = leaf_format;
        let tree = Bvh::build(&[&triangles], &params).unwrap();
        for isa in Isa::ALL {
            let Some(tree) = tree.clone().with_isa(isa) else {
                continue;
            };
            let leaks = leaks(mesh, &tree, &vertices, place);
            match accuracy {
                Accuracy::Robust => assert_eq!(
                    leaks, [0; 3],
                    "{} {context}, {branching_factor} children, {isa}",
                    mesh.name
                ),
                Accuracy::Fast if branching_factor == 8 && isa == Isa::best() => println!(
                    "{} {context}: fast loses {leaks:?} of {RAYS_PER_KIND} random rays, at edges, at vertices",
                    mesh.name
                ),
                Accuracy::Fast => {}
            }
        }
    }
}

#[test]
fn in_place() {
    for mesh in meshes() {
        for accuracy in [Accuracy::Fast, Accuracy::Robust] {
            check(&mesh, &|v| v, accuracy, "in place");
        }
    }
}

#[test]
fn at_any_scale() {
    for mesh in meshes() {
        for exponent in [-60, -37, -12, 13, 38, 60] {
            let scale = 2f32.powi(exponent);
            let context = format!("times 2^{exponent}");
            check(&mesh, &|v| v * scale, Accuracy::Robust, &context);
        }
        for exponent in [-15, -5, 5, 15] {
            let scale = 10f32.powi(exponent);
            let context = format!("times 10^{exponent}");
            check(&mesh, &|v| v * scale, Accuracy::Robust, &context);
        }
    }
}

/// Far away, vertices round to a coarse lattice; the mesh stays closed, and the origins inside as
/// long as the lattice is finer than the box that they are taken from is deep.
#[test]
fn far_from_the_origin() {
    for mesh in meshes() {
        for offset in [1.0, 10.0, 1e2, 1e3, 1e4, 1e5] {
            let place = |v: Vec3| v + Vec3::new(offset, -0.7 * offset, 0.3 * offset);
            let context = format!("plus {offset}");
            for accuracy in [Accuracy::Fast, Accuracy::Robust] {
                check(&mesh, &place, accuracy, &context);
            }
        }
    }
}
