//! Other crates, built and asked as their documentation advises. Every one tests triangles by
//! itself but the crate bvh, which knows boxes alone (its test of triangles ignores their backs)
//! and gets the test of obvhs.

use std::time::Duration;

use bvh::{
    aabb::{Aabb as BvhAabb, Bounded},
    bounding_hierarchy::{BHShape, BoundingHierarchy},
    bvh::Bvh as PeerBvh,
    ray::Ray as BvhRay,
};
use obvhs::{
    BvhBuildParams,
    cwbvh::{CwBvh, builder::build_cwbvh_from_tris},
    ray::{Ray as ObvhsRay, RayHit},
    triangle::Triangle,
};
use parry3d::{
    query::Ray as ParryRay,
    shape::{CompositeShapeRef, TriMesh},
};
use raywright_bvh::{Aabb, Ray, TriangleMesh};

use super::engine::{Answers, Closest, Engine, Role, Trace};

pub(crate) fn engines(mesh: &TriangleMesh) -> Vec<Engine<'static>> {
    let engine = |name: &'static str, tracer: Box<dyn Trace>| Engine {
        role: Role::Peer(name),
        bytes_per_triangle: None,
        tracer,
    };
    let triangles: Vec<Triangle> = (0..mesh.triangles().len() as u32)
        .map(|id| {
            let [v0, v1, v2] = mesh.corners(id).map(|v| v.to_array().into());
            Triangle { v0, v1, v2 }
        })
        .collect();
    vec![
        engine("obvhs CWBVH, medium", Box::new(Compressed::new(&triangles))),
        engine("bvh", Box::new(Binary::new(mesh, triangles))),
        engine("parry3d", Box::new(Parry::new(mesh))),
    ]
}

fn obvhs_ray(ray: &Ray) -> ObvhsRay {
    let [origin, direction] = [ray.origin, ray.direction].map(|v| v.to_array().into());
    ObvhsRay::new(origin, direction, ray.t_min, ray.t_max)
}

/// The compressed tree of obvhs.
struct Compressed {
    tree: CwBvh,
    /// In the order of the leaves, as its documentation advises for speed.
    triangles: Vec<Triangle>,
}

impl Compressed {
    fn new(triangles: &[Triangle]) -> Self {
        let params = BvhBuildParams::medium_build();
        let tree = build_cwbvh_from_tris(triangles, params, &mut Duration::default());
        let in_leaves = tree.primitive_indices.iter();
        let triangles = in_leaves.map(|&i| triangles[i as usize]).collect();
        Self { tree, triangles }
    }
}

impl Trace for Compressed {
    fn closest(&self, rays: &[Ray], answers: &mut Answers) {
        answers.fill_closest(rays, |ray| {
            let mut hit = RayHit::none();
            self.tree.ray_traverse(obvhs_ray(ray), &mut hit, |ray, id| {
                self.triangles[id].intersect(ray)
            });
            Closest::new(hit.t, hit.primitive_id)
        });
    }

    fn any(&self, rays: &[Ray], answers: &mut Answers) {
        answers.fill_any(rays, |ray| {
            let test = |ray: &ObvhsRay, id: usize| self.triangles[id].intersect(ray);
            !self.tree.ray_traverse_miss(obvhs_ray(ray), test)
        });
    }
}

/// A box with the triangle that it is of, and a place for the node that the crate bvh finds it in.
struct Shape {
    bounds: BvhAabb<f32, 3>,
    triangle: u32,
    node: usize,
}

impl Bounded<f32, 3> for Shape {
    fn aabb(&self) -> BvhAabb<f32, 3> {
        self.bounds
    }
}

impl BHShape<f32, 3> for Shape {
    fn set_bh_node_index(&mut self, index: usize) {
        self.node = index;
    }

    fn bh_node_index(&self) -> usize {
        self.node
    }
}

/// The binary tree of the crate bvh.
struct Binary {
    tree: PeerBvh<f32, 3>,
    shapes: Vec<Shape>,
    triangles: Vec<Triangle>,
}

impl Binary {
    fn new(mesh: &TriangleMesh, triangles: Vec<Triangle>) -> Self {
        let mut shapes: Vec<Shape> = (0..mesh.triangles().len() as u32)
            .map(|triangle| {
                let corners = mesh.corners(triangle).into_iter();
                let bounds = corners.fold(Aabb::EMPTY, Aabb::extended_by);
                let [min, max] = [bounds.min, bounds.max].map(|v| v.to_array().into());
                Shape {
                    bounds: BvhAabb::with_bounds(min, max),
                    triangle,
                    node: 0,
                }
            })
            .collect();
        let tree = PeerBvh::build_par(&mut shapes);
        Self {
            tree,
            shapes,
            triangles,
        }
    }
}

/// As the crate makes it, but that the direction keeps its length and so `t` its unit.
fn bvh_ray(ray: &Ray) -> BvhRay<f32, 3> {
    BvhRay {
        origin: ray.origin.to_array().into(),
        direction: ray.direction.to_array().into(),
        inv_direction: ray.direction.recip().to_array().into(),
    }
}

impl Trace for Binary {
    fn closest(&self, rays: &[Ray], answers: &mut Answers) {
        answers.fill_closest(rays, |ray| {
            let (box_ray, mut triangle_ray) = (bvh_ray(ray), obvhs_ray(ray));
            let mut closest = Closest::NOTHING;
            for shape in self.tree.nearest_traverse_iterator(&box_ray, &self.shapes) {
                // Boxes come in the order in which they are entered: none behind is nearer.
                let interval = box_ray.intersection_slice_for_aabb(&shape.bounds);
                if interval.is_some_and(|(enter, _)| enter > triangle_ray.tmax) {
                    break;
                }
                let t = self.triangles[shape.triangle as usize].intersect(&triangle_ray);
                if t < closest.t {
                    closest = Closest::new(t, shape.triangle);
                    triangle_ray.tmax = t;
                }
            }
            closest
        });
    }

    fn any(&self, rays: &[Ray], answers: &mut Answers) {
        answers.fill_any(rays, |ray| {
            let (box_ray, triangle_ray) = (bvh_ray(ray), obvhs_ray(ray));
            let mut shapes = self.tree.traverse_iterator(&box_ray, &self.shapes);
            shapes.any(|shape| {
                let t = self.triangles[shape.triangle as usize].intersect(&triangle_ray);
                t.is_finite()
            })
        });
    }
}

/// The mesh of parry3d, which has no any-hit: closest hits answer it. Its rays begin at 0, as all of
/// ours here do.
struct Parry(TriMesh);

impl Parry {
    fn new(mesh: &TriangleMesh) -> Self {
        let vertices = mesh.vertices().iter().map(|v| v.to_array().into());
        let mesh = TriMesh::new(vertices.collect(), mesh.triangles().to_vec());
        Self(mesh.expect("a mesh with triangles"))
    }

    fn hit(&self, ray: &Ray) -> Option<Closest> {
        let [origin, direction] = [ray.origin, ray.direction].map(|v| v.to_array().into());
        let limit = ray.t_max.min(f32::MAX);
        let ray = ParryRay::new(origin, direction);
        let hit = CompositeShapeRef(&self.0).cast_local_ray(&ray, limit, true)?;
        Some(Closest::new(hit.1, hit.0))
    }
}

impl Trace for Parry {
    fn closest(&self, rays: &[Ray], answers: &mut Answers) {
        answers.fill_closest(rays, |ray| self.hit(ray).unwrap_or(Closest::NOTHING));
    }

    fn any(&self, rays: &[Ray], answers: &mut Answers) {
        answers.fill_any(rays, |ray| self.hit(ray).is_some());
    }
}
