//! Other crates, as their documentation advises; context, no goals.

use std::time::Duration;

use bvh::{
    aabb::{Aabb as BvhAabb, Bounded},
    bounding_hierarchy::{BHShape, BoundingHierarchy},
    bvh::Bvh as PeerBvh,
};
use obvhs::{
    BvhBuildParams, bvh2::builder::build_bvh2_from_tris, cwbvh::builder::build_cwbvh_from_tris,
    triangle::Triangle,
};
use parry3d::{
    bounding_volume::Aabb as ParryAabb,
    partitioning::{Bvh as ParryBvh, BvhBuildStrategy},
};
use raywright_benches::clock::Clock;
use raywright_bvh::TriangleMesh;

use super::builds::{Builder, primitives};

/// A box with a place for the node that the crate bvh finds it in.
#[derive(Clone)]
struct Shape {
    bounds: BvhAabb<f32, 3>,
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

/// Builders of other crates over the boxes or triangles of a mesh.
pub(crate) fn builders(mesh: &TriangleMesh, clock: Clock) -> Vec<Builder<'static>> {
    let builder = |name: &str, run: Box<dyn Fn() -> Duration>| Builder {
        name: name.into(),
        sah: None,
        run,
    };
    let triangles: Vec<Triangle> = (0..mesh.triangles().len() as u32)
        .map(|id| {
            let [v0, v1, v2] = mesh.corners(id).map(|v| v.to_array().into());
            Triangle { v0, v1, v2 }
        })
        .collect();
    let bvh2 = |params: BvhBuildParams| {
        let triangles = triangles.clone();
        Box::new(move || {
            clock.time(|| build_bvh2_from_tris(&triangles, params, &mut Duration::default()))
        })
    };
    let fastest = bvh2(BvhBuildParams::fastest_build());
    let medium = bvh2(BvhBuildParams::medium_build());
    let cwbvh = move || {
        clock.time(|| {
            let params = BvhBuildParams::medium_build();
            build_cwbvh_from_tris(&triangles, params, &mut Duration::default())
        })
    };
    let primitives = primitives(mesh);
    let shapes: Vec<Shape> = primitives
        .iter()
        .map(|p| Shape {
            bounds: BvhAabb::with_bounds(
                p.bounds.min.to_array().into(),
                p.bounds.max.to_array().into(),
            ),
            node: 0,
        })
        .collect();
    let boxes: Vec<ParryAabb> = primitives
        .iter()
        .map(|p| {
            let [min, max] = [p.bounds.min, p.bounds.max].map(|v| v.to_array().into());
            ParryAabb::new(min, max)
        })
        .collect();
    vec![
        builder("obvhs BVH2, fastest", fastest),
        builder("obvhs BVH2, medium", medium),
        builder("obvhs CWBVH, medium", Box::new(cwbvh)),
        builder(
            "bvh",
            Box::new(move || {
                let mut shapes = shapes.clone();
                clock.time(|| PeerBvh::build_par(&mut shapes))
            }),
        ),
        builder(
            "parry3d, binned",
            Box::new(move || {
                clock.time(|| ParryBvh::from_leaves(BvhBuildStrategy::Binned, &boxes))
            }),
        ),
    ]
}
