//! The slow twin of every kernel: a loop over all triangles, without tree and without lanes, in
//! plain `f32`. Kernels must give the same bits.

use glam::Vec3;

use super::{
    kernel::{Candidate, precedes},
    robust::{SMALL_EDGE_VALUE, axes_of, in_f64, margin_of},
    setup::RaySetup,
    triangle::UNIT_ROUNDOFF,
};
use crate::{
    Aabb, Accuracy,
    boxes::{self, BoxHit},
    bvh::{bounds_of, hit_of, number_triangles, scale_of, triangle_count},
    error::{BuildError, InstanceError},
    instances::{self, Instance, InstanceHit, Meeting},
    mesh::TriangleMesh,
    ray::{Hit, Ray},
};

/// The closest hit of a ray with meshes, by testing every triangle by the test of `accuracy`.
///
/// # Errors
/// As [`Bvh::build`](crate::Bvh::build), for the same meshes.
pub fn closest_hit(
    meshes: &[&TriangleMesh],
    ray: &Ray,
    accuracy: Accuracy,
) -> Result<Option<Hit>, BuildError> {
    closest_hit_where(meshes, ray, accuracy, |_| true)
}

/// The closest of the hits that `accept` takes, as
/// [`Bvh::closest_hit_where`](crate::Bvh::closest_hit_where) gives it, by asking about every hit.
///
/// # Errors
/// As [`Bvh::build`](crate::Bvh::build), for the same meshes.
pub fn closest_hit_where(
    meshes: &[&TriangleMesh],
    ray: &Ray,
    accuracy: Accuracy,
    mut accept: impl FnMut(&Hit) -> bool,
) -> Result<Option<Hit>, BuildError> {
    let triangle = match accuracy {
        Accuracy::Fast => fast_triangle,
        Accuracy::Robust => robust_triangle,
    };
    triangle_count(meshes)?;
    let mut first_ids = Vec::new();
    number_triangles(meshes, &mut first_ids);
    let scale = scale_of(&bounds_of(meshes))?;
    let Some(setup) = RaySetup::new(ray, scale) else {
        return Ok(None);
    };
    let mut best: Option<Candidate> = None;
    for (mesh, &first_id) in meshes.iter().zip(&first_ids) {
        for primitive_id in 0..mesh.triangles().len() as u32 {
            let corners = mesh.corners(primitive_id).map(|v| v * scale);
            let Some((t, u, v)) = triangle(&setup, corners) else {
                continue;
            };
            let candidate = Candidate {
                t,
                u,
                v,
                id: first_id + primitive_id,
            };
            if accept(&hit_of(&candidate, &setup, &first_ids))
                && best.is_none_or(|best| precedes((candidate.t, candidate.id), (best.t, best.id)))
            {
                best = Some(candidate);
            }
        }
    }
    Ok(best.map(|best| hit_of(&best, &setup, &first_ids)))
}

/// All boxes that a ray enters, as [`BoxBvh::intervals`](crate::BoxBvh::intervals) gives them, by
/// testing every box.
///
/// # Errors
/// As [`BoxBvh::build`](crate::BoxBvh::build), for the same boxes.
pub fn box_intervals(boxes: &[Aabb], ray: &Ray) -> Result<Vec<BoxHit>, BuildError> {
    let scale = scale_of(&boxes::check(boxes)?)?;
    let Some(ray) = RaySetup::new(ray, scale) else {
        return Ok(vec![]);
    };
    let mut hits: Vec<_> = box_candidates(boxes, &ray, scale)
        .iter()
        .map(|candidate| BoxHit::new(candidate, &ray))
        .collect();
    hits.sort_by(BoxHit::order);
    Ok(hits)
}

/// The closest of the hits with instances that `accept` takes, as
/// [`InstancedBvh::closest_hit_where`](crate::InstancedBvh::closest_hit_where) gives it, by testing
/// every triangle of every instance. `objects` are what the trees were built over, each with the
/// accuracy of its tree.
///
/// # Errors
/// As [`Bvh::build`](crate::Bvh::build) and
/// [`InstancedBvh::build`](crate::InstancedBvh::build), for the same meshes and instances.
pub fn closest_instance_hit_where(
    objects: &[(&[&TriangleMesh], Accuracy)],
    instances: &[Instance],
    ray: &Ray,
    mask: u32,
    mut accept: impl FnMut(&InstanceHit) -> bool,
) -> Result<Option<InstanceHit>, InstanceError> {
    let bounds: Vec<_> = objects
        .iter()
        .map(|(meshes, _)| bounds_of(meshes))
        .collect();
    let placements = instances::place(&bounds, instances)?;
    let boxes: Vec<_> = placements
        .iter()
        .map(|placement| placement.bounds)
        .collect();
    let scale = scale_of(&boxes::check(&boxes)?)?;
    let Some(world) = RaySetup::new(ray, scale) else {
        return Ok(None);
    };
    let mut best: Option<(f32, InstanceHit)> = None;
    for interval in box_candidates(&boxes, &world, scale) {
        let placement = &placements[interval.id as usize];
        let instance = &instances[placement.instance_id as usize];
        if instance.mask & mask == 0 {
            continue;
        }
        let meeting = Meeting {
            world: &world,
            interval: &interval,
            instance_id: placement.instance_id,
        };
        let (meshes, accuracy) = objects[instance.tree];
        let ray = placement.to_object.ray(ray);
        let hit = closest_hit_where(meshes, &ray, accuracy, |hit| accept(&meeting.place(*hit).1))?;
        if let Some((t, hit)) = hit.map(|hit| meeting.place(hit))
            && best.is_none_or(|(best_t, best)| {
                precedes((t, hit.instance_id), (best_t, best.instance_id))
            })
        {
            best = Some((t, hit));
        }
    }
    Ok(best.map(|(_, hit)| hit))
}

/// Entry and exit of each box that a ray enters, in the order of the boxes.
fn box_candidates(boxes: &[Aabb], ray: &RaySetup, scale: f32) -> Vec<Candidate> {
    let mut hits = Vec::new();
    for (id, bounds) in (0..).zip(boxes) {
        let (mut t, mut u) = (ray.t_min, ray.t_max);
        for axis in 0..3 {
            let at = |plane: f32| (plane * scale - ray.origin[axis]) * ray.reciprocal[axis];
            let (low, high) = (at(bounds.min[axis]), at(bounds.max[axis]));
            let pad = ray.margin[axis] * (8.0 * UNIT_ROUNDOFF);
            t = t.max(low.min(high) - pad);
            u = u.min(low.max(high) + pad);
        }
        if t <= u {
            hits.push(Candidate { t, u, v: 0.0, id });
        }
    }
    hits
}

/// Distance and weights of vertices 1 and 2 where the ray meets a triangle.
fn fast_triangle(ray: &RaySetup, [v0, v1, v2]: [Vec3; 3]) -> Option<(f32, f32, f32)> {
    let origin = Vec3::from(ray.origin);
    let direction = Vec3::from(ray.direction);
    let (edge_1, edge_2) = (v0 - v1, v2 - v0);
    let to_vertex = v0 - origin;
    let r = cross(to_vertex, direction);
    let normal = cross(edge_2, edge_1);
    let den = dot(normal, direction);
    let flip = |x: f32| if den.is_sign_negative() { -x } else { x };
    let (u, v) = (flip(dot(r, edge_2)), flip(dot(r, edge_1)));
    if den == 0.0 || u < 0.0 || v < 0.0 || u + v > den.abs() {
        return None;
    }
    let t = flip(dot(normal, to_vertex)) / den.abs();
    let t = in_box(ray, [v0, v0 - edge_1, v0 + edge_2], ray.margin, t)?;
    Some((t, u / den.abs(), v / den.abs()))
}

/// The same by the robust test.
fn robust_triangle(ray: &RaySetup, corners: [Vec3; 3]) -> Option<(f32, f32, f32)> {
    let [x, y, z] = axes_of(ray.direction);
    let d = ray.direction;
    let (shear_x, shear_y) = (d[x] / d[z], d[y] / d[z]);
    let sheared = corners.map(|vertex| {
        let to = |axis: usize| vertex[axis] - ray.origin[axis];
        [to(x) - shear_x * to(z), to(y) - shear_y * to(z), to(z)]
    });
    let [a, b, c] = sheared;
    let edge = |p: [f32; 3], q: [f32; 3]| p[0] * q[1] - p[1] * q[0];
    let values = [edge(c, b), edge(a, c), edge(b, a)];
    if values.iter().any(|&value| value < 0.0) && values.iter().any(|&value| value > 0.0) {
        return None;
    }
    let permuted = |v: Vec3| Vec3::new(v[x], v[y], v[z]);
    let [v0, v1, v2] = corners.map(permuted);
    let normal = cross(v2 - v0, v0 - v1);
    let approach = dot(normal, permuted(Vec3::from(d)));
    let [t, weight_b, weight_c] =
        if approach == 0.0 || values.iter().any(|v| v.abs() <= SMALL_EDGE_VALUE) {
            let corners = [v0, v1, v2].map(|v| v.to_array());
            in_f64(ray, [x, y, z], corners, sheared)?
        } else {
            let [u, v, w] = values;
            let den = u + v + w;
            let to_plane = dot(normal, v0 - permuted(Vec3::from(ray.origin)));
            [to_plane / approach, v / den, w / den]
        };
    let t = in_box(ray, corners, margin_of(ray, z), t)?;
    Some((t, weight_b, weight_c))
}

/// The distance, clamped to the interval in which the ray is inside the triangle's box, widened by
/// 8 roundoffs; `None` if it is empty or the distance is outside the ray's.
fn in_box(ray: &RaySetup, [a, b, c]: [Vec3; 3], margin: [f32; 3], t: f32) -> Option<f32> {
    let (mut enter, mut leave) = (f32::NEG_INFINITY, f32::INFINITY);
    for axis in 0..3 {
        let (a, b, c) = (a[axis], b[axis], c[axis]);
        let at = |plane: f32| (plane - ray.origin[axis]) * ray.reciprocal[axis];
        let (low, high) = (at(a.min(b).min(c)), at(a.max(b).max(c)));
        let pad = margin[axis] * (8.0 * UNIT_ROUNDOFF);
        enter = enter.max(low.min(high) - pad);
        leave = leave.min(low.max(high) + pad);
    }
    let t = t.max(enter).min(leave);
    (enter <= leave && ray.t_min <= t && t <= ray.t_max).then_some(t)
}

fn cross(a: Vec3, b: Vec3) -> Vec3 {
    Vec3::new(
        a.y * b.z - a.z * b.y,
        a.z * b.x - a.x * b.z,
        a.x * b.y - a.y * b.x,
    )
}

fn dot(a: Vec3, b: Vec3) -> f32 {
    a.x * b.x + a.y * b.y + a.z * b.z
}
