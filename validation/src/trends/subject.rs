//! A scene with rays, what is asked of it, and the clock.

use std::{collections::HashMap, hint::black_box, time::Duration};

use raywright_bvh::{
    Aabb, BuildParams, BuildPrimitive, BuildWorkspace, Bvh, Hierarchy, MeshError, Ray, Rounding,
    TriangleMesh, Vec3, Work,
};

use super::TrendsError;
use crate::{
    hits::{RayKind, Rays},
    triangles::TriangleSet,
};

/// Rays as a path tracer has them.
const KINDS: [RayKind; 3] = [RayKind::Primary, RayKind::Diffuse, RayKind::Shadow];

/// A scene with rays, and whose rounding our builder follows.
#[derive(Debug)]
pub struct Subject {
    pub(super) set: TriangleSet,
    pub(super) mesh: TriangleMesh,
    pub(super) primitives: Vec<BuildPrimitive>,
    pub(super) bounds: Aabb,
    rays: Vec<Ray>,
    pub(super) rounding: Rounding,
}

impl Subject {
    /// A scene with `rays` rays of each kind.
    ///
    /// # Errors
    /// If it is no mesh, or none with triangles.
    pub fn new(set: TriangleSet, rays: usize, rounding: Rounding) -> Result<Self, TrendsError> {
        let fault = |why: String| TrendsError::Scene {
            scene: set.name.clone(),
            why,
        };
        if set.triangles.is_empty() {
            return Err(fault("no triangles".into()));
        }
        let mesh = welded(&set.triangles).map_err(|error| fault(error.to_string()))?;
        let tree = Bvh::build(&[&mesh], &BuildParams::default())?;
        let mut source = Rays::new(&mesh, &tree, 1);
        let rays = KINDS
            .iter()
            .flat_map(|&kind| source.of(kind, rays))
            .collect();
        Ok(Self {
            primitives: set.primitives(),
            bounds: set.bounds(),
            set,
            mesh,
            rays,
            rounding,
        })
    }

    /// The name of the scene.
    #[must_use]
    pub fn name(&self) -> &str {
        &self.set.name
    }

    /// How many triangles it has.
    #[must_use]
    pub fn triangles(&self) -> usize {
        self.set.triangles.len()
    }

    pub(super) fn hierarchy(&self, params: &BuildParams) -> Result<Hierarchy, TrendsError> {
        let corners = |reference| self.set.corners(reference);
        let workspace = &mut BuildWorkspace::default();
        Ok(Hierarchy::build(
            &self.primitives,
            Some(&corners),
            params,
            workspace,
        )?)
    }

    pub(super) fn trace(&self, is_hit: impl Fn(&Ray) -> bool) -> f64 {
        let start = work_time();
        let hits = self.rays.iter().filter(|ray| is_hit(ray)).count();
        let time = work_time().saturating_sub(start).as_secs_f64();
        black_box(hits);
        1e9 * time / self.rays.len() as f64
    }

    pub(super) fn work(&self, tree: &Bvh) -> [f64; 2] {
        let mut work = Work::default();
        for ray in &self.rays {
            black_box(tree.closest_hit_with_work(ray, &mut work));
        }
        [work.nodes, work.blocks].map(|count| count as f64 / self.rays.len() as f64)
    }
}

/// A mesh whose triangles share vertices that have the same bits, as compact leaves expect.
fn welded(triangles: &[[Vec3; 3]]) -> Result<TriangleMesh, MeshError> {
    let (mut vertices, mut indices) = (Vec::new(), HashMap::new());
    let mut index = |vertex: Vec3| {
        *indices
            .entry(vertex.to_array().map(f32::to_bits))
            .or_insert_with(|| {
                vertices.push(vertex);
                vertices.len() as u32 - 1
            })
    };
    let triangles = triangles
        .iter()
        .map(|corners| corners.map(&mut index))
        .collect();
    TriangleMesh::new(vertices, triangles)
}

/// What all threads of the process have worked, in seconds of a core: other processes do not count.
#[cfg(target_os = "linux")]
pub(super) fn work_time() -> Duration {
    use rustix::time::{ClockId, clock_gettime};

    let time = clock_gettime(ClockId::ProcessCPUTime);
    Duration::new(time.tv_sec as u64, time.tv_nsec as u32)
}

/// The time of day, where the system has no such clock.
#[cfg(not(target_os = "linux"))]
pub(super) fn work_time() -> Duration {
    std::time::UNIX_EPOCH.elapsed().unwrap_or_default()
}
