//! What the difference of two answers is.
//!
//! Bounds of the errors of numbers tell what is out of question (`evaluate`, `clamp`); where a ray passes within the
//! bound of an edge, the triangles around it tell whether a miss can be right (`patch`).

use std::collections::HashMap;

use raywright_bvh::{Accuracy, Ray, TriangleMesh, Vec3};

use super::{
    clamp::power_of_two_below,
    class::{Answer, Class},
    evaluate::{Evaluation, TriangleTestForm},
    patch::{self, EdgeKey, Place},
    sheared::Shear,
};
use crate::exact::ExactHit;

/// Judges answers about some meshes.
#[derive(Debug)]
pub struct Judge<'m> {
    meshes: &'m [&'m TriangleMesh],
    accuracy: Accuracy,
    /// The power of two above the largest coordinate.
    coordinate_bound: f64,
    /// Whether distances may be left as they are, too.
    is_free: bool,
    /// Triangles at each edge.
    neighbours: HashMap<EdgeKey, Vec<[u32; 2]>>,
}

impl<'m> Judge<'m> {
    /// A judge of tests of an accuracy.
    #[must_use]
    pub fn new(meshes: &'m [&'m TriangleMesh], accuracy: Accuracy) -> Self {
        let mut neighbours: HashMap<_, Vec<_>> = HashMap::new();
        let mut largest = 0.0_f32;
        for (geometry, mesh) in (0..).zip(meshes) {
            for primitive in 0..mesh.triangles().len() as u32 {
                let corners = mesh.corners(primitive);
                for corner in corners {
                    largest = largest.max(corner.abs().max_element());
                }
                let places = corners.map(place);
                for i in 0..3 {
                    let mut ends = [places[i], places[(i + 1) % 3]];
                    ends.sort_unstable();
                    neighbours
                        .entry(ends)
                        .or_default()
                        .push([geometry, primitive]);
                }
            }
        }
        Self {
            meshes,
            accuracy,
            coordinate_bound: 2.0 * power_of_two_below(largest),
            is_free: false,
            neighbours,
        }
    }

    /// The same for a tracer with tests of the same form that may leave distances as they are, where ours keeps them
    /// to the boxes of triangles.
    #[must_use]
    pub fn of_free_distances(mut self) -> Self {
        self.is_free = true;
        self
    }

    fn corners(&self, [geometry, primitive]: [u32; 2]) -> [Vec3; 3] {
        self.meshes[geometry as usize].corners(primitive)
    }

    fn by_ours(&self, ids: [u32; 2], ray: &Ray) -> Evaluation {
        let corners = self.corners(ids);
        let kept = Evaluation::of_ours(corners, ray, self.accuracy, self.coordinate_bound);
        if !self.is_free {
            return kept;
        }
        let free = Evaluation::new(corners, ray, TriangleTestForm::of_ours(self.accuracy));
        let ([from, to], [other_from, other_to]) = (kept.t_range, free.t_range);
        Evaluation {
            t_range: [from.min(other_from), to.max(other_to)],
            ..kept
        }
    }

    /// Up to where exact hits tell anything of our answer.
    #[must_use]
    pub fn farthest(&self, ray: &Ray, ours: Option<Answer>) -> f64 {
        ours.map_or(f64::INFINITY, |answer| {
            self.by_ours(answer.ids, ray).t_range[1].max(f64::from(answer.t))
        })
    }

    /// What our answer is beside all triangles that the ray meets up to [`Self::farthest`], the closest first: the
    /// worst that it is beside any of them.
    #[must_use]
    pub fn class_beside_all(&self, ray: &Ray, ours: Option<Answer>, hits: &[ExactHit]) -> Class {
        let classes = hits.iter().map(|hit| {
            let ids = [hit.geometry_id, hit.primitive_id];
            self.class_beside(ray, ours, Some((ids, self.by_ours(ids, ray))))
        });
        let worst = classes.filter(|&class| class != Class::OtherMisses).max();
        worst.unwrap_or_else(|| self.class_beside(ray, ours, None))
    }

    /// What our answer is beside that of another tracer, which is taken for Embree.
    #[must_use]
    pub fn class(&self, ray: &Ray, ours: Option<Answer>, other: Option<Answer>) -> Class {
        let form = match self.accuracy {
            Accuracy::Fast => TriangleTestForm::MollerTrumbore,
            Accuracy::Robust => TriangleTestForm::EdgeSums,
        };
        let other = other.map(|Answer { ids, .. }| {
            let evaluation = Evaluation::new(self.corners(ids), ray, form);
            (ids, evaluation)
        });
        self.class_beside(ray, ours, other)
    }

    /// What our answer is beside a triangle that another names.
    fn class_beside(
        &self,
        ray: &Ray,
        ours: Option<Answer>,
        other: Option<([u32; 2], Evaluation)>,
    ) -> Class {
        let own = ours.map(|answer| (answer, self.by_ours(answer.ids, ray)));
        if let Some((answer, own)) = &own
            && is_wrong(ray, answer, own)
        {
            return Class::Bug;
        }
        let Some((ids, theirs)) = other else {
            return match own {
                None => Class::Same,
                Some((answer, own)) => self.missed_by_other(ray, answer.ids, &own, f64::INFINITY),
            };
        };
        if own.is_some_and(|(answer, _)| answer.ids == ids) {
            return Class::Same;
        }
        if let Some((answer, own)) = &own {
            if own.t_range[0] <= theirs.t_range[1] && theirs.t_range[0] <= own.t_range[1] {
                return if own.is_ill_conditioned || theirs.is_ill_conditioned {
                    Class::IllConditioned
                } else if own.margin() <= 1.0 && theirs.margin() <= 1.0 {
                    Class::EdgeTie
                } else {
                    Class::CoplanarTie
                };
            }
            if theirs.t_range[0] > own.t_range[1] {
                return self.missed_by_other(ray, answer.ids, own, theirs.t_range[0]);
            }
        }
        let before = own.map_or(f64::INFINITY, |(_, own)| own.t_range[0]);
        self.missed(ray, ids, &theirs, before)
    }

    /// Ours misses a triangle that the other hits, and hits nothing before a distance.
    fn missed(&self, ray: &Ray, ids: [u32; 2], theirs: &Evaluation, before: f64) -> Class {
        let own = self.by_ours(ids, ray);
        if is_at_end(ray, theirs) || is_at_end(ray, &own) {
            return Class::IntervalTie;
        }
        let is_ill_conditioned = theirs.is_ill_conditioned || own.is_ill_conditioned;
        // Ours may find it behind what it hits, though the other may not.
        if own.t_range[1] >= before {
            return if is_ill_conditioned {
                Class::IllConditioned
            } else {
                Class::CoplanarTie
            };
        }
        if own.margin() > 1.0 && !is_ill_conditioned {
            return Class::Bug;
        }
        // However thin a triangle is.
        if !self.may_pass(ray, ids, before) {
            return Class::Leak;
        }
        if is_ill_conditioned {
            Class::IllConditioned
        } else if own.is_met || own.margin() >= -1.0 {
            Class::SilhouetteTie
        } else if theirs.margin() >= -1.0 {
            Class::EdgeTie
        } else {
            Class::OtherInvents
        }
    }

    /// The other misses a triangle that ours hits, and hits nothing before a distance.
    fn missed_by_other(&self, ray: &Ray, ids: [u32; 2], own: &Evaluation, before: f64) -> Class {
        if is_at_end(ray, own) {
            Class::IntervalTie
        } else if own.is_ill_conditioned {
            Class::IllConditioned
        } else if own.margin() > 1.0 || own.is_met || !self.may_pass(ray, ids, before) {
            Class::OtherMisses
        } else {
            Class::SilhouetteTie
        }
    }

    /// Whether rounding may let a ray pass a triangle and all that meet it there, as far as what is hit lies within the
    /// ray, and before a distance.
    fn may_pass(&self, ray: &Ray, ids: [u32; 2], before: f64) -> bool {
        let origin = ray.origin.as_dvec3();
        let shear = Shear::new(ray.direction.as_dvec3());
        patch::may_be_passed(
            &shear,
            ids,
            |ids| {
                let corners = self.corners(ids);
                patch::Corners {
                    places: corners.map(place),
                    points: corners.map(|corner| shear.point(corner.as_dvec3() - origin)),
                }
            },
            |edge| self.neighbours.get(edge).map_or(&[], Vec::as_slice),
            |ids| {
                let [from, to] = self.by_ours(ids, ray).t_range;
                from >= f64::from(ray.t_min) && to <= f64::from(ray.t_max) && to < before
            },
        )
    }
}

fn place(vertex: Vec3) -> Place {
    vertex.to_array().map(|x| (x + 0.0).to_bits())
}

/// Whether our own hit is none, or not where it is said to be.
fn is_wrong(ray: &Ray, answer: &Answer, own: &Evaluation) -> bool {
    let t = f64::from(answer.t);
    let is_near = own.t_range[0] <= t && t <= own.t_range[1];
    let is_within = ray.t_min <= answer.t && answer.t <= ray.t_max;
    if !is_near || !is_within {
        return true;
    }
    let is_off = (0..2).any(|i| (f64::from(answer.uv[i]) - own.uv[i]).abs() > own.uv_bound);
    let is_invented = !own.is_met && own.margin() < -1.0;
    !own.is_ill_conditioned && (is_off || is_invented)
}

fn is_at_end(ray: &Ray, evaluation: &Evaluation) -> bool {
    let [from, to] = evaluation.t_range;
    [ray.t_min, ray.t_max]
        .map(f64::from)
        .iter()
        .any(|&end| from <= end && end <= to)
}

#[cfg(test)]
mod tests;
