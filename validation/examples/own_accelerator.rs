//! An accelerator of one's own under the property-test kit: a tree that halves its triangles at the median.
//!
//! Run: `cargo run --release -p raywright-validation --features kit --example own_accelerator`

use raywright_bvh::{Aabb, Accuracy, Ray, TriangleMesh, Vec3};
use raywright_validation::{
    hits::Answer,
    kit::{Accelerator, Trial},
};

struct Node {
    bounds: Aabb,
    /// Empty where there are children.
    triangles: Vec<u32>,
    children: Vec<Node>,
}

impl Node {
    fn new(mesh: &TriangleMesh, mut triangles: Vec<u32>) -> Self {
        let corners = triangles.iter().flat_map(|&id| mesh.corners(id));
        let bounds = corners.fold(Aabb::EMPTY, Aabb::extended_by);
        let mut children = Vec::new();
        if triangles.len() > 2 {
            let axis = (bounds.max - bounds.min).max_position();
            let centre = |id: u32| mesh.corners(id).iter().map(|v| v[axis]).sum::<f32>();
            triangles.sort_by(|&a, &b| centre(a).total_cmp(&centre(b)));
            let upper = triangles.split_off(triangles.len() / 2);
            children = [std::mem::take(&mut triangles), upper]
                .map(|half| Node::new(mesh, half))
                .into();
        }
        Self {
            bounds,
            triangles,
            children,
        }
    }

    /// Whether a ray enters the box, wider by a few roundings of what it is compared with.
    fn is_entered(&self, ray: &Ray) -> bool {
        let (mut enter, mut exit) = (ray.t_min, ray.t_max);
        for axis in 0..3 {
            let (low, high) = (self.bounds.min[axis], self.bounds.max[axis]);
            let pad = 4.0 * f32::EPSILON * (low.abs().max(high.abs()) + ray.origin[axis].abs());
            let at = |plane: f32| (plane - ray.origin[axis]) / ray.direction[axis];
            let (a, b) = (at(low - pad), at(high + pad));
            (enter, exit) = (enter.max(a.min(b)), exit.min(a.max(b)));
        }
        enter <= exit * (1.0 + 4.0 * f32::EPSILON)
    }

    /// The closest hit of what is below; the ray ends at the closest one so far.
    fn closest(&self, mesh: &TriangleMesh, ray: &mut Ray) -> Option<Answer> {
        if !self.is_entered(ray) {
            return None;
        }
        let mut best = None;
        for &id in &self.triangles {
            if let Some((t, uv)) = triangle(mesh.corners(id), ray) {
                ray.t_max = t;
                best = Some(Answer {
                    t,
                    uv,
                    ids: [0, id],
                });
            }
        }
        for child in &self.children {
            best = child.closest(mesh, ray).or(best);
        }
        best
    }
}

/// Möller and Trumbore's test in f64, by the normal, which is 0 where a triangle is none.
fn triangle(corners: [Vec3; 3], ray: &Ray) -> Option<(f32, [f32; 2])> {
    let [a, b, c] = corners.map(Vec3::as_dvec3);
    let (origin, direction) = (ray.origin.as_dvec3(), ray.direction.as_dvec3());
    let (e1, e2, from) = (b - a, c - a, origin - a);
    let (normal, across) = (e1.cross(e2), from.cross(direction));
    let whole = -direction.dot(normal);
    let [u, v] = [e2.dot(across) / whole, -e1.dot(across) / whole];
    let t = (from.dot(normal) / whole) as f32;
    // Comparisons are false where `whole` is 0.
    let is_hit = u >= 0.0 && v >= 0.0 && u + v <= 1.0 && ray.t_min <= t && t <= ray.t_max;
    is_hit.then_some((t, [u as f32, v as f32]))
}

struct MedianTree {
    mesh: TriangleMesh,
    root: Node,
}

impl Accelerator for MedianTree {
    fn closest_hit(&self, ray: &Ray) -> Option<Answer> {
        self.root.closest(&self.mesh, &mut { *ray })
    }

    fn any_hit(&self, ray: &Ray) -> bool {
        self.closest_hit(ray).is_some()
    }
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    // It may leak at edges, as its triangle test does.
    let trial = Trial::new(Accuracy::Fast);
    trial.run(|mesh| {
        let all = (0..mesh.triangles().len() as u32).collect();
        let root = Node::new(mesh, all);
        let mesh = mesh.clone();
        MedianTree { mesh, root }
    })?;
    println!("no fault in 256 meshes of each class");
    Ok(())
}
