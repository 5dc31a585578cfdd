//! A tree over instances: the same tree over triangles at many places, moved, turned, scaled,
//! sheared or mirrored. Two levels, as Wald, Benthin, Slusallek, *Distributed Interactive Ray
//! Tracing of Dynamic Scenes*, 2003: a tree over the boxes of the instances, and in each box the way
//! through the tree of its object by the ray as the object sees it, whose direction is not
//! normalised, so that distances keep their unit.
//!
//! Invariant: a hit is a function of the ray, the mask, the meshes with their accuracy, and the
//! transforms alone. No order of visits changes a bit, because
//! - the ray is taken to the object in f64 by operations that round once each, then rounded to f32,
//!   the numbers in which rays are given;
//! - the interval in which a ray is inside an instance's box is a function of both (`box_test`), and
//!   the distance of a hit is clamped to it, so that an instance that is entered behind the best hit
//!   has nothing before it;
//! - distances are compared in the scaled unit of the upper tree, equal ones by the lowest instance
//!   id; and a ray is only shortened for an object where scaling loses no bit of a distance
//!   ([`RaySetup::limited_to`]).
//!
//! How much larger than the object's box an instance's box is: let u = 2⁻²⁴, A the linear part of
//! the transform, t its translation, B = A⁻¹, and k the largest row sum of |A|·|B| (Skeel's condition
//! number: 1 for whatever keeps axes, however it scales them). The object sees the origin
//! B·(o − t) + e with |e| ≤ u·|B|·|o − t|, and the direction B·d + f with |f| ≤ u·|B|·|d|. A point
//! p = o + s·d of the world is thus seen off by at most u·|B|·(|o − t| + |p − o|), which is
//! u·k·(|o − t| + |p − o|) in the world. With W the largest coordinate of the box and of t, and
//! |o| ≤ 6·W, this is below 14·u·k·W; the rest of 16·u·k·W, by which boxes are padded, is for what
//! f64 rounds, below u·k·W as k ≤ 2²⁴. From farther away, rays are known to no more than that: they
//! may pass a silhouette by at which the object would have been hit. (For k < 2 not even that, since
//! the interval of a box is widened by 3.9·u·(S + |o|) more than it must.)
//!
//! The object's own box is padded by 128·u·L before, L its largest coordinate: a triangle test may
//! accept a ray that passes the triangle's box at 24.2·u·(2·L + |o|), and the distance then should be
//! the same whether the object is an instance or not.
//!
//! Not good for: objects whose boxes overlap a lot, each of which is entered in turn.

use std::sync::Arc;

use glam::{Affine3, DMat3, DVec3};

use crate::{
    Aabb, BoxBvh, BuildParams, BuildWorkspace, Bvh, Hit, InstanceError, Isa, Ray, TreeStats,
    traverse::{
        kernel::{Candidate, precedes},
        setup::RaySetup,
        triangle::UNIT_ROUNDOFF,
    },
};

/// Pad of a world box in units of u·k·W.
const WORLD_PAD: f64 = 16.0 * UNIT_ROUNDOFF as f64;

/// Pad of an object's box in units of its largest coordinate.
const OBJECT_PAD: f64 = 128.0 * UNIT_ROUNDOFF as f64;

/// Largest k of a transform that is taken: with a larger one nothing is left of the numbers of a
/// ray.
const CONDITION_MAX: f64 = (1 << 24) as f64;

/// A tree at a place.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct Instance {
    /// Place of the tree in the slice that [`InstancedBvh::build`] is given.
    pub tree: usize,
    /// From the coordinates of the tree's meshes to those of the world.
    pub transform: Affine3,
    /// The instance is met by rays whose mask has a bit in common with this.
    pub mask: u32,
}

impl Instance {
    /// An instance that rays of every mask but 0 meet.
    #[must_use]
    pub fn new(tree: usize, transform: impl Into<Affine3>) -> Self {
        Self {
            tree,
            transform: transform.into(),
            mask: u32::MAX,
        }
    }

    /// The same instance, met by rays whose mask has a bit in common with `mask`.
    #[must_use]
    pub fn with_mask(self, mask: u32) -> Self {
        Self { mask, ..self }
    }
}

/// Where a ray meets an instance.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct InstanceHit {
    /// Which instance.
    pub instance_id: u32,
    /// What is hit of its tree; `t` is in units of the ray's direction in the world.
    pub hit: Hit,
}

/// A bounding volume hierarchy over instances of others, two levels in all.
///
/// Which triangle of which instance a ray hits, and where, is a function of the ray and its mask,
/// the meshes and the [`Accuracy`](crate::Accuracy) of their trees, and the transforms alone: no
/// other parameter of a build and no instruction set changes a bit of it. Equal distances are decided
/// by the lowest instance id, then as in the tree.
///
/// Distances are clamped to the interval in which the ray is inside the instance's box; the identity
/// gives the hits of the tree itself. Rays are rounded to `f32` once in the space of the object. So
/// from origins farther away than six times the largest coordinate of an instance's box, a ray may
/// pass a silhouette by at which exact arithmetic has a hit; and a ray whose origin or direction
/// leaves the range of `f32` there does not meet the instance.
#[derive(Clone, Debug)]
pub struct InstancedBvh {
    /// Over the boxes of the instances that have one.
    top: BoxBvh,
    /// What is in each box.
    placed: Vec<Placed>,
}

/// An instance in its box.
#[derive(Clone, Debug)]
struct Placed {
    tree: Arc<Bvh>,
    to_object: ToObject,
    mask: u32,
    instance_id: u32,
}

impl InstancedBvh {
    /// Builds a tree over `instances` of `trees`; the place in the slice is an instance's id. The
    /// parameters are those of the upper tree and as for [`BoxBvh::build`]; the others keep theirs.
    /// An instance of an empty tree is never hit, and no instances are a tree that no ray hits.
    ///
    /// The cost is that of a build over as many boxes. Where instances move, this tree is built
    /// anew, in the memory of the last ([`InstancedBvh::recycle`]), while `trees` stay.
    ///
    /// # Errors
    /// The first of `instances` whose tree does not exist or whose transform is not finite or cannot
    /// be inverted; otherwise as [`BoxBvh::build`]: among them coordinates of the world outside
    /// 2⁻¹⁰⁰ … 2¹⁰⁰.
    pub fn build(
        trees: &[Arc<Bvh>],
        instances: &[Instance],
        params: &BuildParams,
        workspace: &mut BuildWorkspace,
    ) -> Result<Self, InstanceError> {
        let bounds: Vec<_> = trees.iter().map(|tree| tree.bounds()).collect();
        let placements = place(&bounds, instances)?;
        let boxes: Vec<_> = placements
            .iter()
            .map(|placement| placement.bounds)
            .collect();
        let placed = placements.iter().map(|placement| {
            let instance = &instances[placement.instance_id as usize];
            Placed {
                tree: Arc::clone(&trees[instance.tree]),
                to_object: placement.to_object,
                mask: instance.mask,
                instance_id: placement.instance_id,
            }
        });
        Ok(Self {
            placed: placed.collect(),
            top: BoxBvh::build(&boxes, params, workspace)?,
        })
    }

    /// Gives up the upper tree for its memory, as [`Bvh::recycle`].
    pub fn recycle(self, workspace: &mut BuildWorkspace) {
        self.top.recycle(workspace);
    }

    /// The same instances, the upper tree traced by the kernels of another instruction set; the
    /// trees of the objects keep theirs. `None` if this machine does not have it.
    #[must_use]
    pub fn with_isa(self, isa: Isa) -> Option<Self> {
        Some(Self {
            top: self.top.with_isa(isa)?,
            ..self
        })
    }

    /// The closest hit of a ray with the instances that have a bit of `mask`. A ray that is not
    /// finite, has no direction or an empty interval hits nothing.
    #[must_use]
    pub fn closest_hit(&self, ray: &Ray, mask: u32) -> Option<InstanceHit> {
        self.closest_by(ray, mask, |tree, setup, _| {
            tree.closest_hit_of(setup, &mut ())
        })
    }

    /// Whether a ray hits any of the instances that have a bit of `mask`.
    #[must_use]
    pub fn any_hit(&self, ray: &Ray, mask: u32) -> bool {
        self.any_by(ray, mask, |tree, setup, _| tree.any_hit_of(setup, &mut ()))
    }

    /// The closest of the hits that `accept` takes, which is called as by
    /// [`Bvh::closest_hit_where`].
    #[must_use]
    pub fn closest_hit_where(
        &self,
        ray: &Ray,
        mask: u32,
        mut accept: impl FnMut(&InstanceHit) -> bool,
    ) -> Option<InstanceHit> {
        self.closest_where(ray, mask, &mut accept)
    }

    /// Whether a ray has a hit that `accept` takes, which is called as by
    /// [`Bvh::closest_hit_where`].
    #[must_use]
    pub fn any_hit_where(
        &self,
        ray: &Ray,
        mask: u32,
        mut accept: impl FnMut(&InstanceHit) -> bool,
    ) -> bool {
        self.any_where(ray, mask, &mut accept)
    }

    /// The smallest box around the padded boxes of all instances; empty if there is none.
    #[must_use]
    pub fn bounds(&self) -> Aabb {
        self.top.bounds()
    }

    /// What the upper tree was built with.
    #[must_use]
    pub fn params(&self) -> &BuildParams {
        self.top.params()
    }

    /// Which instruction set traces the upper tree.
    #[must_use]
    pub fn isa(&self) -> Isa {
        self.top.isa()
    }

    /// Counts, depth, cost and bytes of the upper tree, whose primitives are the boxes of instances.
    #[must_use]
    pub fn stats(&self) -> TreeStats {
        self.top.stats()
    }

    // Not generic, as in `Bvh`.

    #[inline(never)]
    fn closest_where(
        &self,
        ray: &Ray,
        mask: u32,
        accept: &mut dyn FnMut(&InstanceHit) -> bool,
    ) -> Option<InstanceHit> {
        self.closest_by(ray, mask, |tree, setup, meeting| {
            tree.closest_where(setup, &mut |candidate| {
                accept(&meeting.place(tree.hit_of(candidate, setup)).1)
            })
        })
    }

    #[inline(never)]
    fn any_where(
        &self,
        ray: &Ray,
        mask: u32,
        accept: &mut dyn FnMut(&InstanceHit) -> bool,
    ) -> bool {
        self.any_by(ray, mask, |tree, setup, meeting| {
            tree.any_where(setup, &mut |candidate| {
                accept(&meeting.place(tree.hit_of(candidate, setup)).1)
            })
        })
    }

    /// The first of the hits that `trace` finds in the trees of the instances.
    fn closest_by(
        &self,
        ray: &Ray,
        mask: u32,
        mut trace: impl FnMut(&Bvh, &RaySetup, &Meeting<'_>) -> Option<Hit>,
    ) -> Option<InstanceHit> {
        let world = self.top.setup(ray)?;
        let (mut best_t, mut best) = (world.t_max, None::<InstanceHit>);
        self.top.visit(&world, &mut |interval| {
            let Some((placed, setup)) = self.enter(ray, mask, interval) else {
                return best_t;
            };
            let meeting = Meeting {
                world: &world,
                interval,
                instance_id: placed.instance_id,
            };
            let setup = meeting.limited(setup, best_t);
            if let Some(hit) = trace(&placed.tree, &setup, &meeting) {
                let (t, hit) = meeting.place(hit);
                let best_id = best.map_or(u32::MAX, |best| best.instance_id);
                if precedes((t, hit.instance_id), (best_t, best_id)) {
                    (best_t, best) = (t, Some(hit));
                }
            }
            best_t
        });
        best
    }

    /// Whether `trace` finds anything in the tree of any instance.
    fn any_by(
        &self,
        ray: &Ray,
        mask: u32,
        mut trace: impl FnMut(&Bvh, &RaySetup, &Meeting<'_>) -> bool,
    ) -> bool {
        let Some(world) = self.top.setup(ray) else {
            return false;
        };
        let mut found = false;
        self.top.visit(&world, &mut |interval| {
            if let Some((placed, setup)) = self.enter(ray, mask, interval) {
                found = trace(
                    &placed.tree,
                    &setup,
                    &Meeting {
                        world: &world,
                        interval,
                        instance_id: placed.instance_id,
                    },
                );
            }
            // No box is entered before this.
            if found {
                f32::NEG_INFINITY
            } else {
                world.t_max
            }
        });
        found
    }

    /// The instance of a box with the ray as its tree sees it; `None` if it does not.
    #[inline]
    fn enter(&self, ray: &Ray, mask: u32, interval: &Candidate) -> Option<(&Placed, RaySetup)> {
        let placed = &self.placed[interval.id as usize];
        if placed.mask & mask == 0 {
            return None;
        }
        let setup = placed.tree.setup(&placed.to_object.ray(ray))?;
        Some((placed, setup))
    }
}

/// A ray inside the box of an instance.
pub(crate) struct Meeting<'a> {
    /// The ray in the space of the upper tree.
    pub(crate) world: &'a RaySetup,
    /// Entry and exit in that space.
    pub(crate) interval: &'a Candidate,
    pub(crate) instance_id: u32,
}

impl Meeting<'_> {
    /// A hit of the instance's tree as one of the instance, and its distance in the space of the
    /// upper tree.
    #[inline]
    pub(crate) fn place(&self, hit: Hit) -> (f32, InstanceHit) {
        let t = self.world.scaled(hit.t);
        let t = t.max(self.interval.t).min(self.interval.u);
        let hit = InstanceHit {
            instance_id: self.instance_id,
            hit: Hit {
                t: self.world.unscaled(t) + 0.0,
                ..hit
            },
        };
        (t, hit)
    }

    /// The object's ray, without what would be placed behind `best_t`.
    #[inline]
    fn limited(&self, object: RaySetup, best_t: f32) -> RaySetup {
        // Hits beyond the exit are placed at the exit.
        if best_t >= self.interval.u {
            return object;
        }
        let t = self.world.unscaled(best_t);
        // Scaling keeps order: all hits beyond t are placed behind the best.
        if self.world.scaled(t.next_up()) > best_t {
            object.limited_to(t)
        } else {
            object
        }
    }
}

/// An instance's way back: B·(p − t) for points, B·d for directions.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ToObject {
    inverse: DMat3,
    translation: DVec3,
}

impl ToObject {
    /// A ray as the object sees it. By the identity it stays as it is, but for the sign of zeros.
    #[inline]
    pub(crate) fn ray(&self, ray: &Ray) -> Ray {
        let origin = ray.origin.as_dvec3() - self.translation;
        Ray {
            origin: (self.inverse * origin).as_vec3(),
            direction: (self.inverse * ray.direction.as_dvec3()).as_vec3(),
            ..*ray
        }
    }
}

/// An instance that has a box.
pub(crate) struct Placement {
    pub(crate) instance_id: u32,
    pub(crate) to_object: ToObject,
    /// In the world, padded.
    pub(crate) bounds: Aabb,
}

/// Checks instances of trees with these bounds, and places those that are not empty.
pub(crate) fn place(
    bounds: &[Aabb],
    instances: &[Instance],
) -> Result<Vec<Placement>, InstanceError> {
    let mut placements = Vec::with_capacity(instances.len());
    for (
        instance,
        &Instance {
            tree, transform, ..
        },
    ) in instances.iter().enumerate()
    {
        let Some(bounds) = bounds.get(tree) else {
            return Err(InstanceError::TreeOutOfRange {
                instance,
                tree,
                trees: bounds.len(),
            });
        };
        if !transform.is_finite() {
            return Err(InstanceError::TransformNotFinite { instance });
        }
        let matrix = transform.matrix3.as_dmat3();
        let inverse = matrix.inverse();
        let condition = condition(&matrix, &inverse);
        // Written so that NaN fails.
        if !(condition <= CONDITION_MAX && inverse.as_mat3().is_finite()) {
            return Err(InstanceError::TransformNotInvertible {
                instance,
                condition,
            });
        }
        if !bounds.is_empty() {
            let translation = transform.translation.as_dvec3();
            placements.push(Placement {
                // More of them than this can number are refused with their boxes.
                instance_id: instance as u32,
                to_object: ToObject {
                    inverse,
                    translation,
                },
                bounds: world_box(bounds, &matrix, translation, condition),
            });
        }
    }
    Ok(placements)
}

/// The largest row sum of |A|·|B|.
fn condition(matrix: &DMat3, inverse: &DMat3) -> f64 {
    let rows = matrix.abs() * (inverse.abs() * DVec3::ONE);
    // max_element may drop a NaN.
    if rows.is_nan() {
        f64::NAN
    } else {
        rows.max_element()
    }
}

/// The padded box of an instance.
fn world_box(bounds: &Aabb, matrix: &DMat3, translation: DVec3, condition: f64) -> Aabb {
    let (low, high) = (bounds.min.as_dvec3(), bounds.max.as_dvec3());
    let pad = DVec3::splat(OBJECT_PAD * low.abs().max(high.abs()).max_element());
    let (low, high) = (low - pad, high + pad);
    let (mut min, mut max) = (translation, translation);
    for (column, (low, high)) in [
        (matrix.x_axis, (low.x, high.x)),
        (matrix.y_axis, (low.y, high.y)),
        (matrix.z_axis, (low.z, high.z)),
    ] {
        min += (column * low).min(column * high);
        max += (column * low).max(column * high);
    }
    let largest = min.abs().max(max.abs()).max(translation.abs());
    let pad = WORLD_PAD * condition * largest.max_element();
    Aabb {
        min: (min - pad).to_array().map(rounded_down).into(),
        max: (max + pad).to_array().map(|x| -rounded_down(-x)).into(),
    }
}

/// The largest f32 not above; what is out of range stays finite, and the tree refuses it.
fn rounded_down(x: f64) -> f32 {
    let x = x.clamp(f64::from(f32::MIN), f64::from(f32::MAX));
    let nearest = x as f32;
    if f64::from(nearest) > x {
        nearest.next_down()
    } else {
        nearest
    }
}
