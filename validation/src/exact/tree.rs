//! A tree for exact hits, so that every ray can be asked and not only a few.
//!
//! A binary tree, divided where the expected number of tests is least (binned surface area heuristic: Wald, *On fast
//! Construction of SAH-based Bounding Volume Hierarchies*, 2007). It shares no code with the trees that it judges.
//!
//! Invariant: it tells the hits of the loop over all triangles, bit for bit, up to a distance. A box is passed by only
//! if the line of the ray misses it or enters it beyond; that of a triangle contains all of its distances (see `line`).

use glam::DVec3;
use raywright_bvh::{Ray, TriangleMesh};

use super::{ExactHit, hit, line::Line, order};

/// Triangles of a leaf at most.
const LEAF: usize = 4;

/// Places along an axis at which nodes may be divided, and one.
const BINS: usize = 32;

/// Triangles of some meshes, to be asked for all that a ray meets.
#[derive(Debug)]
pub struct ExactTree<'m> {
    meshes: &'m [&'m TriangleMesh],
    /// Each before its first child.
    nodes: Vec<Node>,
    ids: Vec<[u32; 2]>,
}

#[derive(Clone, Copy, Debug)]
struct Node {
    min: DVec3,
    max: DVec3,
    /// The second child of an inner node, the first of a leaf's ids.
    next: usize,
    /// How many ids a leaf has; 0 of an inner node.
    count: usize,
}

impl<'m> ExactTree<'m> {
    /// Builds the tree.
    #[must_use]
    pub fn new(meshes: &'m [&'m TriangleMesh]) -> Self {
        let mut ids: Vec<[u32; 2]> = (0..)
            .zip(meshes)
            .flat_map(|(geometry, mesh)| {
                (0..mesh.triangles().len() as u32).map(move |primitive| [geometry, primitive])
            })
            .collect();
        let mut nodes = Vec::new();
        if !ids.is_empty() {
            divide(meshes, &mut ids, 0, &mut nodes);
        }
        Self { meshes, nodes, ids }
    }

    /// What [`all_hits`](super::all_hits) tells up to a distance, included.
    #[must_use]
    pub fn hits_until(&self, ray: &Ray, t_max: f64) -> Vec<ExactHit> {
        let line = Line::new(ray);
        let (t_min, t_max) = (f64::from(ray.t_min), t_max.min(f64::from(ray.t_max)));
        let mut hits = Vec::new();
        let mut waiting = Vec::from_iter((!self.nodes.is_empty()).then_some(0));
        while let Some(index) = waiting.pop() {
            let node = &self.nodes[index];
            let [enter, leave] = line.interval(node.min, node.max);
            if enter > leave || enter > t_max || leave < t_min {
                continue;
            }
            if node.count == 0 {
                waiting.extend([node.next, index + 1]);
            } else {
                let ids = &self.ids[node.next..node.next + node.count];
                hits.extend(ids.iter().filter_map(|&ids| hit(self.meshes, ids, ray)));
            }
        }
        hits.retain(|hit| hit.t <= t_max);
        hits.sort_by(order);
        hits
    }
}

/// A box that grows.
#[derive(Clone, Copy)]
struct Bounds {
    min: DVec3,
    max: DVec3,
}

impl Bounds {
    const EMPTY: Self = Self {
        min: DVec3::INFINITY,
        max: DVec3::NEG_INFINITY,
    };

    fn with(self, point: DVec3) -> Self {
        Self {
            min: self.min.min(point),
            max: self.max.max(point),
        }
    }

    fn half_area(self) -> f64 {
        let size = (self.max - self.min).max(DVec3::ZERO);
        size.x * size.y + size.y * size.z + size.z * size.x
    }
}

/// Appends the nodes of some triangles, whose ids begin at `first`.
fn divide(meshes: &[&TriangleMesh], ids: &mut [[u32; 2]], first: usize, nodes: &mut Vec<Node>) {
    let corners = |[geometry, primitive]: [u32; 2]| {
        let corners = meshes[geometry as usize].corners(primitive);
        corners.map(|corner| corner.as_dvec3())
    };
    let middle = |ids: [u32; 2]| corners(ids).into_iter().sum::<DVec3>();
    let all = ids.iter().flat_map(|&ids| corners(ids));
    let Bounds { min, max } = all.fold(Bounds::EMPTY, Bounds::with);
    let index = nodes.len();
    nodes.push(Node {
        min,
        max,
        next: first,
        count: ids.len(),
    });
    if ids.len() <= LEAF {
        return;
    }
    let middles = ids.iter().map(|&ids| middle(ids));
    let middles = middles.fold(Bounds::EMPTY, Bounds::with);
    let size = middles.max - middles.min;
    let axis = size.max_position();
    let bin = |ids: [u32; 2]| {
        let share = (middle(ids)[axis] - middles.min[axis]) / size[axis];
        ((share * BINS as f64) as usize).min(BINS - 1)
    };
    let mut bins = [(0, Bounds::EMPTY); BINS];
    for &ids in &*ids {
        let (count, bounds) = &mut bins[bin(ids)];
        *count += 1;
        *bounds = corners(ids).into_iter().fold(*bounds, Bounds::with);
    }
    let plane = cheapest_plane(&bins);
    ids.sort_unstable_by_key(|&ids| (bin(ids), ids));
    let left: usize = bins[..plane].iter().map(|(count, _)| count).sum();
    // All in one bin: by number.
    let left = if left == 0 || left == ids.len() {
        ids.len() / 2
    } else {
        left
    };
    let (left_ids, right_ids) = ids.split_at_mut(left);
    divide(meshes, left_ids, first, nodes);
    nodes[index].next = nodes.len();
    nodes[index].count = 0;
    divide(meshes, right_ids, first + left, nodes);
}

/// How many bins go to the left: where the sum of areas times counts is least.
fn cheapest_plane(bins: &[(usize, Bounds); BINS]) -> usize {
    let cost = |bins: &[(usize, Bounds)]| {
        let count: usize = bins.iter().map(|(count, _)| count).sum();
        let bounds = bins.iter().filter(|(count, _)| *count > 0);
        let bounds = bounds.fold(Bounds::EMPTY, |all, (_, bounds)| {
            all.with(bounds.min).with(bounds.max)
        });
        count as f64 * bounds.half_area()
    };
    let costs = (1..BINS).map(|plane| (plane, cost(&bins[..plane]) + cost(&bins[plane..])));
    let best = costs.min_by(|a, b| a.1.total_cmp(&b.1));
    best.map_or(BINS / 2, |(plane, _)| plane)
}

#[cfg(all(test, feature = "golden"))]
mod tests {
    use rand::{RngExt, SeedableRng};
    use rand_xoshiro::Xoshiro256PlusPlus;
    use raywright_bvh::Vec3;

    use super::{super::all_hits, *};

    /// On a lattice, where rays run in planes and through edges and vertices, and anywhere.
    #[test]
    fn hits_are_those_of_the_loop_over_all_triangles() {
        let mut random = Xoshiro256PlusPlus::seed_from_u64(1);
        let mut total = 0;
        for is_lattice in [true, false] {
            let mut point = || {
                Vec3::from_array(std::array::from_fn(|_| {
                    if is_lattice {
                        random.random_range(-4..=4) as f32
                    } else {
                        random.random::<f32>() - 0.5
                    }
                }))
            };
            let count = 300;
            let mesh = |point: &mut dyn FnMut() -> Vec3| {
                let triangles = (0..count).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
                let vertices = (0..3 * count).map(|_| point()).collect();
                TriangleMesh::new(vertices, triangles).unwrap()
            };
            let meshes = [mesh(&mut point), mesh(&mut point)];
            let meshes = [&meshes[0], &meshes[1]];
            let tree = ExactTree::new(&meshes);
            for index in 0..2000 {
                let ray = Ray::new(point(), point());
                let ray = if index % 2 == 0 {
                    ray
                } else {
                    ray.with_range(0.25, 2.0)
                };
                let all = all_hits(&meshes, &ray);
                assert_eq!(tree.hits_until(&ray, f64::INFINITY), all, "{ray:?}");
                total += all.len();
                let Some(middle) = all.get(all.len() / 2).map(|hit| hit.t) else {
                    continue;
                };
                let count = all.iter().filter(|hit| hit.t <= middle).count();
                assert_eq!(tree.hits_until(&ray, middle), all[..count], "{ray:?}");
            }
        }
        assert!(total > 10_000, "{total} hits");
        let ray = Ray::new(Vec3::ZERO, Vec3::X);
        assert!(ExactTree::new(&[]).hits_until(&ray, 1.0).is_empty());
    }
}
