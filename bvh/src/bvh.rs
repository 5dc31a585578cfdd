//! The tree that a user holds: built over meshes, asked with rays.

use glam::Vec3;

use crate::{
    any_tree::AnyTree,
    bounds::Aabb,
    build::{
        self, BuildWorkspace, LeafReference,
        primitive::{Bounds, PrimitiveRef},
        tasks,
    },
    error::{BuildError, RefitError},
    layout::{
        emit::Source,
        triangles::{Triangles, locate},
    },
    mesh::{MeshError, TriangleMesh},
    params::{BuildParams, RayPackets},
    ray::{Hit, Ray, Work},
    simd::Isa,
    stats::TreeStats,
    traverse::{
        kernel::{Candidate, Filter, Watch},
        setup::{Asked, RaySetup, Unprepared, power_of_two_below},
        stream::{self, Together, Waiting},
    },
};

/// Largest coordinates outside this range are refused.
const COORDINATE_MIN: f32 = 1.0 / (1u128 << 100) as f32;
const COORDINATE_MAX: f32 = (1u128 << 100) as f32;

/// A bounding volume hierarchy over triangles.
///
/// Which triangle a ray hits, and where, is a function of the ray, the meshes and
/// [`Accuracy`](crate::Accuracy) alone: no other parameter of the build, no instruction set and no
/// number of threads changes a bit of it. Equal distances are decided by the lowest geometry id, then by the lowest primitive id.
#[derive(Clone, Debug)]
pub struct Bvh {
    tree: AnyTree,
    /// Number of each mesh's first triangle over all meshes, and the total at the end.
    first_ids: Vec<u32>,
    /// Stored coordinates are those of the meshes times this power of two, so that the largest
    /// lies in 1..2: no scene is too small or too large for the products of a triangle test.
    scale: f32,
    bounds: Aabb,
    params: BuildParams,
    isa: Isa,
    last_refit: Option<Refit>,
}

/// What a refit did to the cost of a tree, in the unit of
/// [`TreeStats::sah_cost`](crate::TreeStats::sah_cost).
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct Refit {
    /// Cost of the tree as it was built.
    pub sah_cost_built: f64,
    /// Cost before this refit.
    pub sah_cost_before: f64,
    /// Cost after it.
    pub sah_cost_after: f64,
}

impl Refit {
    /// Cost after the refit over the cost of the tree as it was built: 1 if nothing has become
    /// worse. Where primitives were cut it is above 1 from the first refit on, even if nothing
    /// moves, since refitted boxes hold whole triangles.
    ///
    /// Both costs are relative to their own root box. So a scene of which one part moves away makes
    /// the drift smaller than the loss in the part that stays.
    #[must_use]
    pub fn sah_drift(&self) -> f64 {
        if self.sah_cost_built > 0.0 {
            self.sah_cost_after / self.sah_cost_built
        } else {
            1.0
        }
    }
}

impl Bvh {
    /// Builds a tree over `meshes`; the place of a mesh in the slice is its geometry id. No mesh,
    /// or none with triangles, is a tree that no ray hits.
    ///
    /// # Errors
    /// [`BuildError`] if the parameters are not valid, `max_depth` is too small, coordinates are
    /// outside 2⁻¹⁰⁰ … 2¹⁰⁰, or there are too many triangles.
    pub fn build(meshes: &[&TriangleMesh], params: &BuildParams) -> Result<Self, BuildError> {
        Self::build_in(meshes, params, &mut BuildWorkspace::default())
    }

    /// Builds a tree in the memory of an earlier build. With
    /// [`Dynamics::Dynamic`](crate::Dynamics) the memory stays in the workspace for the next. The
    /// tree itself takes the memory of an older one that was given to [`Bvh::recycle`], if there is
    /// one.
    ///
    /// Whoever builds the same scene frame by frame, and recycles each tree, allocates nothing more
    /// from the third build on, as long as one thread builds; several need some kilobytes, which
    /// they free at the end.
    ///
    /// # Errors
    /// As [`Bvh::build`].
    pub fn build_in(
        meshes: &[&TriangleMesh],
        params: &BuildParams,
        workspace: &mut BuildWorkspace,
    ) -> Result<Self, BuildError> {
        params.validate().map_err(BuildError::Parameters)?;
        workspace.begin(triangle_count(meshes)?, params)?;
        let mut first_ids = workspace.spares.take_empty(meshes.len() + 1);
        number_triangles(meshes, &mut first_ids);
        number_points(meshes, &mut workspace.first_points)?;
        let bounds = reference_all(meshes, &mut workspace.references);
        let scale = scale_of(&bounds)?;
        tasks::for_each_piece(&mut workspace.references, &|piece| {
            for reference in piece {
                *reference = scaled(reference, scale);
            }
        });
        let corners = |leaf: LeafReference| {
            meshes[leaf.geometry_id as usize]
                .corners(leaf.primitive_id)
                .map(|v| v * scale)
        };
        let root = build::build(workspace, Some(corners), params)?;
        let source = Source {
            root,
            records: &workspace.records,
            leaves: &workspace.leaves,
            primitives: Triangles {
                meshes,
                first_ids: &first_ids,
                first_points: &workspace.first_points,
                scale,
            },
        };
        let tree = AnyTree::new(&source, params, &mut workspace.spares)?;
        workspace.end(params);
        Ok(Self {
            tree,
            first_ids,
            scale,
            bounds,
            params: *params,
            isa: Isa::best(),
            last_refit: None,
        })
    }

    /// Gives up the tree for its memory, in which the workspace builds another; of whatever
    /// parameters, though nodes are only used again for the same width (2, 3 to 4, 5 to 8, 9 to 16)
    /// and blocks for the same leaf format and accuracy. What eight builds in a row had no use for
    /// is freed. A tree in the memory of a larger one holds all of it, which
    /// [`TreeStats::bytes`](crate::TreeStats::bytes) does not count.
    ///
    /// A tree that was built for [`Dynamics::Static`](crate::Dynamics) is only dropped, and so is
    /// one that does not fit in the workspace's limit of memory.
    pub fn recycle(self, workspace: &mut BuildWorkspace) {
        let Self {
            tree,
            first_ids,
            params,
            ..
        } = self;
        workspace.keep_parts(&params, |spares| {
            tree.recycle(spares);
            spares.keep(first_ids);
        });
    }

    /// Moves the tree to new vertices: the same meshes in the same order with as many triangles
    /// each. Hits are then those of a tree that is built anew, to the last bit; only the speed may
    /// differ. Vertices, their number, and even which of them a triangle uses, may be others.
    ///
    /// Which triangles are together in a node and a leaf stays as the build decided. While things
    /// only bend and turn a little, a refit costs a fraction of a build and loses little. Triangles
    /// that were neighbours and drift apart make boxes large: build anew when
    /// [`Refit::sah_drift`] times the time spent on rays costs more than a build, a drift of 1.5
    /// being a usual limit without measurement. A tree that was built while all lay in one point or
    /// plane was divided without knowing what it would become: it is worth a build as soon as it is
    /// unfolded. After spatial splits, the boxes are those of whole triangles (nobody knows where
    /// the parts of a cut triangle would move), so that the gain of the splits is gone while their
    /// references remain: a quality without cuts serves moving meshes better.
    ///
    /// # Errors
    /// [`RefitError`] if there are other numbers of meshes or triangles, or for what
    /// [`Bvh::build`] refuses in the meshes. The tree is then as it was before.
    pub fn refit(&mut self, meshes: &[&TriangleMesh]) -> Result<Refit, RefitError> {
        self.check_counts(meshes)?;
        let bounds = bounds_of(meshes);
        let scale = scale_of(&bounds)?;
        let mut first_points = Vec::new();
        number_points(meshes, &mut first_points)?;
        let (sah_cost_built, sah_cost_before) = match self.last_refit {
            Some(last) => (last.sah_cost_built, last.sah_cost_after),
            None => {
                let cost = self.tree.sah_cost(&self.params);
                (cost, cost)
            }
        };
        self.tree.refit(&Triangles {
            meshes,
            first_ids: &self.first_ids,
            first_points: &first_points,
            scale,
        });
        (self.scale, self.bounds) = (scale, bounds);
        let refit = Refit {
            sah_cost_built,
            sah_cost_before,
            sah_cost_after: self.tree.sah_cost(&self.params),
        };
        self.last_refit = Some(refit);
        Ok(refit)
    }

    fn check_counts(&self, meshes: &[&TriangleMesh]) -> Result<(), RefitError> {
        let built = self.first_ids.len() - 1;
        if meshes.len() != built {
            return Err(RefitError::MeshCount {
                given: meshes.len(),
                built,
            });
        }
        for (geometry_id, (mesh, ids)) in meshes.iter().zip(self.first_ids.windows(2)).enumerate() {
            let (given, built) = (mesh.triangles().len(), (ids[1] - ids[0]) as usize);
            if given != built {
                return Err(RefitError::TriangleCount {
                    geometry_id,
                    given,
                    built,
                });
            }
        }
        Ok(())
    }

    /// The same tree, which traces the rays of a batch with so many in flight on a core
    /// ([`BuildParams::rays_in_flight`]), from 1 to the largest number that is valid there; others are taken for the
    /// nearest of these. It changes no hit.
    #[must_use]
    pub fn with_rays_in_flight(mut self, rays_in_flight: u32) -> Self {
        self.params.rays_in_flight = rays_in_flight.clamp(1, stream::MAX_IN_FLIGHT as u32);
        self
    }

    /// The same tree, which traces or does not trace neighbours in a batch together
    /// ([`BuildParams::ray_packets`]). It changes no hit.
    #[must_use]
    pub fn with_ray_packets(mut self, ray_packets: RayPackets) -> Self {
        self.params.ray_packets = ray_packets;
        self
    }

    /// The same tree, traced by the kernels of another instruction set. `None` if this machine
    /// does not have it.
    #[must_use]
    pub fn with_isa(self, isa: Isa) -> Option<Self> {
        isa.is_available().then_some(Self { isa, ..self })
    }

    /// The closest hit of a ray. A ray that is not finite, has no direction or an empty interval
    /// hits nothing.
    #[must_use]
    #[inline]
    pub fn closest_hit(&self, ray: &Ray) -> Option<Hit> {
        self.closest_hit_of(self.unprepared(ray), &mut ())
    }

    /// The closest hit of a ray; adds what it took to `work`.
    #[must_use]
    pub fn closest_hit_with_work(&self, ray: &Ray, work: &mut Work) -> Option<Hit> {
        self.closest_hit_of(self.unprepared(ray), work)
    }

    /// Whether a ray hits anything.
    #[must_use]
    #[inline]
    pub fn any_hit(&self, ray: &Ray) -> bool {
        self.any_hit_of(self.unprepared(ray), &mut ())
    }

    /// Whether a ray hits anything; adds what it took to `work`.
    #[must_use]
    pub fn any_hit_with_work(&self, ray: &Ray, work: &mut Work) -> bool {
        self.any_hit_of(self.unprepared(ray), work)
    }

    /// The closest of the hits that `accept` takes, equal distances decided as ever: a leaf whose
    /// texture is transparent at `(u, v)` is passed, say.
    ///
    /// `accept` must be a function of the hit, which is to the last bit what
    /// [`Bvh::closest_hit`] would give. It may be called for hits that are not the closest, in no
    /// certain order, and more than once for a triangle that the build has cut.
    ///
    /// A mask of geometries is a filter too:
    ///
    /// ```
    /// # use raywright_bvh::{Bvh, BuildParams, Ray, TriangleMesh, Vec3};
    /// # let corners = |z| [Vec3::ZERO, Vec3::X, Vec3::Y].map(|v| v + Vec3::Z * z).to_vec();
    /// # let near = TriangleMesh::new(corners(1.0), vec![[0, 1, 2]])?;
    /// # let far = TriangleMesh::new(corners(0.0), vec![[0, 1, 2]])?;
    /// # let ray = Ray::new([0.25, 0.25, 3.0], [0.0, 0.0, -1.0]);
    /// let bvh = Bvh::build(&[&near, &far], &BuildParams::default())?;
    /// let masks = [0b01_u32, 0b10];
    /// let seen = |ray_mask: u32| {
    ///     let hit = bvh.closest_hit_where(&ray, |hit| {
    ///         masks[hit.geometry_id as usize] & ray_mask != 0
    ///     });
    ///     hit.map(|hit| hit.geometry_id)
    /// };
    /// assert_eq!([seen(0b11), seen(0b10), seen(0b100)], [Some(0), Some(1), None]);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    #[must_use]
    pub fn closest_hit_where(
        &self,
        ray: &Ray,
        mut accept: impl FnMut(&Hit) -> bool,
    ) -> Option<Hit> {
        let setup = self.setup(ray)?;
        self.closest_where(&setup, &mut |candidate| {
            accept(&self.hit_of(candidate, &setup))
        })
    }

    /// Whether a ray has a hit that `accept` takes, which is called as by
    /// [`Bvh::closest_hit_where`].
    #[must_use]
    pub fn any_hit_where(&self, ray: &Ray, mut accept: impl FnMut(&Hit) -> bool) -> bool {
        self.setup(ray).is_some_and(|setup| {
            self.any_where(&setup, &mut |candidate| {
                accept(&self.hit_of(candidate, &setup))
            })
        })
    }

    // Not generic: the kernels with a filter are compiled with this crate, not with each caller.

    #[inline(never)]
    pub(crate) fn closest_where(
        &self,
        setup: &RaySetup,
        accept: &mut dyn FnMut(&Candidate) -> bool,
    ) -> Option<Hit> {
        self.closest_hit_of(setup, &mut Filter(accept))
    }

    #[inline(never)]
    pub(crate) fn any_where(
        &self,
        setup: &RaySetup,
        accept: &mut dyn FnMut(&Candidate) -> bool,
    ) -> bool {
        self.any_hit_of(setup, &mut Filter(accept))
    }

    /// The closest hits of many rays, `hits[i]` becoming that of `rays[i]`: those of
    /// [`Bvh::closest_hit`] to the last bit, found as [`BuildParams::rays_in_flight`]
    /// and [`BuildParams::ray_packets`] say.
    pub fn closest_hits(&self, rays: &[Ray], hits: &mut Vec<Option<Hit>>) {
        hits.clear();
        hits.resize(rays.len(), None);
        self.stream::<false>(rays, |place, candidate, setup| {
            hits[place] = Some(hit_of(candidate, setup, &self.first_ids));
        });
    }

    /// Whether each of many rays hits anything; otherwise as [`Bvh::closest_hits`].
    pub fn any_hits(&self, rays: &[Ray], are_hit: &mut Vec<bool>) {
        are_hit.clear();
        are_hit.resize(rays.len(), false);
        self.stream::<true>(rays, |place, _, _| are_hit[place] = true);
    }

    fn stream<const ANY: bool>(
        &self,
        rays: &[Ray],
        tell: impl FnMut(usize, &Candidate, &RaySetup),
    ) {
        let batch = Waiting::new(rays, self.scale);
        let together = Together {
            in_flight: self.params.rays_in_flight as usize,
            in_packets: self.params.ray_packets == RayPackets::On,
        };
        self.tree.stream::<ANY>(self.isa, batch, together, tell);
    }

    /// The smallest box around all triangles; empty if there are none.
    #[must_use]
    pub fn bounds(&self) -> Aabb {
        self.bounds
    }

    /// What it was built with.
    #[must_use]
    pub fn params(&self) -> &BuildParams {
        &self.params
    }

    /// Which instruction set traces it.
    #[must_use]
    pub fn isa(&self) -> Isa {
        self.isa
    }

    /// Counts, depth, cost and bytes, found by walking through the tree.
    #[must_use]
    pub fn stats(&self) -> TreeStats {
        self.tree.stats(&self.params)
    }

    /// A ray that its kernels prepare.
    #[inline]
    fn unprepared<'a>(&self, ray: &'a Ray) -> Unprepared<'a> {
        let scale = self.scale;
        Unprepared { ray, scale }
    }

    /// A ray in the space of the tree; `None` if it can hit nothing.
    #[inline]
    pub(crate) fn setup(&self, ray: &Ray) -> Option<RaySetup> {
        RaySetup::new(ray, self.scale)
    }

    #[inline]
    pub(crate) fn closest_hit_of<O: Watch>(&self, ray: impl Asked, watch: &mut O) -> Option<Hit> {
        self.tree
            .closest(self.isa, ray, watch, |hit, setup| self.hit_of(hit, setup))
    }

    #[inline]
    pub(crate) fn any_hit_of<O: Watch>(&self, ray: impl Asked, watch: &mut O) -> bool {
        self.tree.any(self.isa, ray, watch)
    }

    /// A candidate of its kernels as a hit.
    #[inline]
    pub(crate) fn hit_of(&self, candidate: &Candidate, setup: &RaySetup) -> Hit {
        hit_of(candidate, setup, &self.first_ids)
    }
}

/// The hit in the caller's units and ids.
#[inline]
pub(crate) fn hit_of(candidate: &Candidate, setup: &RaySetup, first_ids: &[u32]) -> Hit {
    let LeafReference {
        geometry_id,
        primitive_id,
    } = locate(first_ids, candidate.id);
    Hit {
        // A ray that starts on a triangle meets it at 0 of either sign, and one at an edge has a weight of 0 of either
        // sign, by that of a zero in its direction.
        t: setup.unscaled(candidate.t) + 0.0,
        u: candidate.u + 0.0,
        v: candidate.v + 0.0,
        geometry_id,
        primitive_id,
    }
}

/// How many triangles all meshes have.
pub(crate) fn triangle_count(meshes: &[&TriangleMesh]) -> Result<usize, MeshError> {
    let count: usize = meshes.iter().map(|mesh| mesh.triangles().len()).sum();
    if count > TriangleMesh::MAX_TRIANGLES {
        return Err(MeshError::TooManyTriangles {
            count,
            limit: TriangleMesh::MAX_TRIANGLES,
        });
    }
    Ok(count)
}

/// Fills in the number of each mesh's first triangle over all meshes, and the total at the end, of
/// no more triangles than [`triangle_count`] allows.
pub(crate) fn number_triangles(meshes: &[&TriangleMesh], first_ids: &mut Vec<u32>) {
    let counts = meshes.iter().map(|mesh| mesh.triangles().len());
    number(counts, first_ids);
}

/// Fills in the number of each mesh's first vertex over all meshes, and the total at the end.
fn number_points(meshes: &[&TriangleMesh], first_points: &mut Vec<u32>) -> Result<(), BuildError> {
    const LIMIT: usize = u32::MAX as usize;
    let count = meshes.iter().map(|mesh| mesh.vertices().len()).sum();
    if count > LIMIT {
        return Err(BuildError::TreeTooLarge {
            parts: "vertices",
            count,
            limit: LIMIT,
        });
    }
    let counts = meshes.iter().map(|mesh| mesh.vertices().len());
    number(counts, first_points);
    Ok(())
}

/// The sum of the counts before each, and that of all, which `u32` holds.
fn number(counts: impl ExactSizeIterator<Item = usize>, firsts: &mut Vec<u32>) {
    let mut next = 0;
    firsts.clear();
    firsts.reserve_exact(counts.len() + 1);
    for count in counts {
        firsts.push(next);
        next += count as u32;
    }
    firsts.push(next);
}

/// Fills in the box of each triangle in the caller's coordinates; gives the box around them.
fn reference_all(meshes: &[&TriangleMesh], references: &mut Vec<PrimitiveRef>) -> Aabb {
    let count = meshes.iter().map(|mesh| mesh.triangles().len()).sum();
    // What an earlier build left is overwritten like what is new.
    references.resize(count, PrimitiveRef::new(Aabb::EMPTY, 0, 0));
    let (mut bounds, mut rest) = (Bounds::EMPTY, &mut references[..]);
    for (geometry_id, mesh) in meshes.iter().enumerate() {
        let (own, others) = rest.split_at_mut(mesh.triangles().len());
        rest = others;
        bounds.extend(&reference_mesh(mesh, geometry_id as u32, 0, own));
    }
    bounds.to_aabb()
}

/// The same for the triangles of a mesh from `first` on, at the same time where they are many.
fn reference_mesh(
    mesh: &TriangleMesh,
    geometry_id: u32,
    first: u32,
    references: &mut [PrimitiveRef],
) -> Bounds {
    let mut bounds = Bounds::EMPTY;
    if references.len() > tasks::PIECE_SIZE {
        let middle = references.len() / 2;
        let (left, right) = references.split_at_mut(middle);
        let (left, right) = tasks::join(
            || reference_mesh(mesh, geometry_id, first, left),
            || reference_mesh(mesh, geometry_id, first + middle as u32, right),
        );
        bounds.extend(&left);
        bounds.extend(&right);
        return bounds;
    }
    for (primitive_id, reference) in (first..).zip(references) {
        let own = corners_bounds(mesh.corners(primitive_id));
        *reference = PrimitiveRef::new(own, geometry_id, primitive_id);
        bounds.extend(&reference.0);
    }
    bounds
}

/// A box times a power of two: the box of the scaled corners to the last bit, since rounding keeps
/// order.
fn scaled(reference: &PrimitiveRef, scale: f32) -> PrimitiveRef {
    let Aabb { min, max } = reference.0.to_aabb();
    let bounds = Aabb {
        min: min * scale,
        max: max * scale,
    };
    PrimitiveRef::new(bounds, reference.geometry_id(), reference.primitive_id())
}

pub(crate) fn bounds_of(meshes: &[&TriangleMesh]) -> Aabb {
    let corners = meshes.iter().flat_map(|mesh| {
        mesh.triangles()
            .iter()
            .flatten()
            .map(|&index| mesh.vertices()[index as usize])
    });
    corners.fold(Aabb::EMPTY, Aabb::extended_by)
}

fn corners_bounds([a, b, c]: [Vec3; 3]) -> Aabb {
    Aabb {
        min: a.min(b).min(c),
        max: a.max(b).max(c),
    }
}

/// The power of two that brings the largest coordinate into 1..2; 1 if there is none but 0.
pub(crate) fn scale_of(bounds: &Aabb) -> Result<f32, BuildError> {
    let largest = if bounds.is_empty() {
        0.0
    } else {
        bounds.min.abs().max(bounds.max.abs()).max_element()
    };
    if largest == 0.0 {
        return Ok(1.0);
    }
    if !(COORDINATE_MIN..=COORDINATE_MAX).contains(&largest) {
        return Err(BuildError::CoordinateRange {
            largest,
            min: COORDINATE_MIN,
            max: COORDINATE_MAX,
        });
    }
    Ok(power_of_two_below(largest).recip())
}
