//! What the difference of two answers is.

use std::collections::HashMap;

use raywright_bvh::{Accuracy, Ray, TriangleMesh, Vec3};

use super::evaluate::{Evaluation, TriangleTestForm};

/// What a tracer says of a ray.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Answer {
    /// Distance in units of the direction.
    pub t: f32,
    /// Weights of vertices 1 and 2.
    pub uv: [f32; 2],
    /// Which mesh, and which of its triangles.
    pub ids: [u32; 2],
}

/// What two answers to one ray are.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[non_exhaustive]
pub enum Class {
    /// The same triangle, or both none.
    Same,
    /// Two triangles at an edge or a vertex that both may have.
    EdgeTie,
    /// Two triangles at the same distance.
    CoplanarTie,
    /// One misses a triangle that the ray touches at the outline of what it sees.
    SilhouetteTie,
    /// A hit at an end of the ray.
    IntervalTie,
    /// A triangle that is seen so nearly edge-on, or is so thin, that nothing is certain.
    IllConditioned,
    /// Ours is right; the other misses what it must hit.
    OtherMisses,
    /// Ours is right; the other hits what it must not.
    OtherInvents,
    /// Ours misses what it touches exactly at an edge or vertex within a surface: a fault of a watertight test,
    /// and what a fast one may do.
    Leak,
    /// Ours is wrong.
    Bug,
}

impl Class {
    /// All, in the order of tables.
    pub const ALL: [Self; 10] = [
        Self::Same,
        Self::EdgeTie,
        Self::CoplanarTie,
        Self::SilhouetteTie,
        Self::IntervalTie,
        Self::IllConditioned,
        Self::OtherMisses,
        Self::OtherInvents,
        Self::Leak,
        Self::Bug,
    ];

    /// Its name in tables.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Same => "same",
            Self::EdgeTie => "edge tie",
            Self::CoplanarTie => "coplanar tie",
            Self::SilhouetteTie => "silhouette tie",
            Self::IntervalTie => "interval tie",
            Self::IllConditioned => "ill-conditioned",
            Self::OtherMisses => "other misses",
            Self::OtherInvents => "other invents",
            Self::Leak => "leak",
            Self::Bug => "bug",
        }
    }
}

/// Whose place is the same, to the last bit; −0 is 0.
type Place = [u32; 3];

fn place(vertex: Vec3) -> Place {
    vertex.to_array().map(|x| (x + 0.0).to_bits())
}

/// Judges answers about some meshes.
#[derive(Debug)]
pub struct Judge<'m> {
    meshes: &'m [&'m TriangleMesh],
    accuracy: Accuracy,
    /// Triangles at each edge, the smaller place first.
    neighbours: HashMap<[Place; 2], Vec<[u32; 2]>>,
}

impl<'m> Judge<'m> {
    /// A judge of tests of an accuracy.
    #[must_use]
    pub fn new(meshes: &'m [&'m TriangleMesh], accuracy: Accuracy) -> Self {
        let mut neighbours: HashMap<_, Vec<_>> = HashMap::new();
        for (geometry, mesh) in (0..).zip(meshes) {
            for primitive in 0..mesh.triangles().len() as u32 {
                let places = mesh.corners(primitive).map(place);
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
            neighbours,
        }
    }

    fn corners(&self, [geometry, primitive]: [u32; 2]) -> [Vec3; 3] {
        self.meshes[geometry as usize].corners(primitive)
    }

    fn own_form(&self) -> TriangleTestForm {
        match self.accuracy {
            Accuracy::Fast => TriangleTestForm::MollerTrumbore,
            Accuracy::Robust => TriangleTestForm::Sheared,
        }
    }

    /// That of the other, which is taken for Embree.
    fn other_form(&self) -> TriangleTestForm {
        match self.accuracy {
            Accuracy::Fast => TriangleTestForm::MollerTrumbore,
            Accuracy::Robust => TriangleTestForm::EdgeSums,
        }
    }

    /// What our answer is beside another.
    #[must_use]
    pub fn class(&self, ray: &Ray, ours: Option<Answer>, other: Option<Answer>) -> Class {
        let own = ours.map(|answer| {
            let evaluation = Evaluation::new(self.corners(answer.ids), ray, self.own_form());
            (answer, evaluation)
        });
        if let Some((answer, evaluation)) = &own
            && let Some(fault) = wrong(ray, answer, evaluation)
        {
            return fault;
        }
        let Some(other) = other else {
            return match own {
                None => Class::Same,
                Some((_, own)) => missed_by_other(ray, &own),
            };
        };
        if own.is_some_and(|(answer, _)| answer.ids == other.ids) {
            return Class::Same;
        }
        let theirs = Evaluation::new(self.corners(other.ids), ray, self.other_form());
        if let Some((_, own)) = &own {
            let apart = theirs.t - own.t;
            if apart.is_nan() || apart.abs() <= own.t_bound + theirs.t_bound {
                let at_edges = own.margin() <= 1.0 && theirs.margin() <= 1.0;
                return if at_edges {
                    Class::EdgeTie
                } else {
                    Class::CoplanarTie
                };
            }
            if apart > 0.0 {
                return missed_by_other(ray, own);
            }
        }
        self.missed(ray, other.ids, &theirs)
    }

    /// Ours misses a triangle that the other hits, and hits nothing at its distance.
    fn missed(&self, ray: &Ray, ids: [u32; 2], theirs: &Evaluation) -> Class {
        if is_at_end(ray, theirs) {
            return Class::IntervalTie;
        }
        if theirs.is_ill_conditioned {
            return Class::IllConditioned;
        }
        let own = Evaluation::new(self.corners(ids), ray, self.own_form());
        if own.is_ill_conditioned {
            return Class::IllConditioned;
        }
        match own.margin() {
            margin if margin > 1.0 => Class::Bug,
            _ if self.is_at_outline(ray, ids, &own) => Class::SilhouetteTie,
            _ if own.is_met => Class::Leak,
            _ if theirs.margin() >= -1.0 => Class::EdgeTie,
            _ => Class::OtherInvents,
        }
    }

    /// Whether an edge that the ray passes within the bound of the error has nothing on its other side.
    fn is_at_outline(&self, ray: &Ray, ids: [u32; 2], own: &Evaluation) -> bool {
        let corners = self.corners(ids);
        (0..3).filter(|&i| own.margins[i] <= 1.0).any(|i| {
            let ends = [corners[(i + 1) % 3], corners[(i + 2) % 3]];
            let side = side(ends, corners[i], ray);
            let mut key = ends.map(place);
            key.sort_unstable();
            let others = self.neighbours.get(&key).into_iter().flatten();
            let mut beyond = others.filter(|&&other| other != ids).map(|&other| {
                let corners = self.corners(other);
                let third = corners
                    .into_iter()
                    .find(|&corner| !key.contains(&place(corner)));
                third.map_or(0.0, |third| self::side(ends, third, ray))
            });
            !beyond.any(|other| other * side < 0.0)
        })
    }
}

/// On which side of an edge a point is, as the ray sees it: 1 or −1, or 0 if it is on its line.
fn side([p, q]: [Vec3; 2], point: Vec3, ray: &Ray) -> f64 {
    let [p, q, point] = [p, q, point].map(Vec3::as_dvec3);
    let normal = ray.direction.as_dvec3().cross(q - p);
    let side = normal.dot(point - p);
    if side == 0.0 { 0.0 } else { side.signum() }
}

/// What is wrong with our own hit, if anything.
fn wrong(ray: &Ray, answer: &Answer, own: &Evaluation) -> Option<Class> {
    if own.is_ill_conditioned {
        return Some(Class::IllConditioned);
    }
    let t = f64::from(answer.t);
    let off = answer.uv.map(f64::from);
    let is_off = (t - own.t).abs() > own.t_bound
        || (0..2).any(|i| (off[i] - own.uv[i]).abs() > own.uv_bound);
    let is_invented = !own.is_met && own.margin() < -1.0;
    let is_outside = !(ray.t_min <= answer.t && answer.t <= ray.t_max);
    (is_off || is_invented || is_outside || answer.t.is_nan()).then_some(Class::Bug)
}

/// The other misses what we hit.
fn missed_by_other(ray: &Ray, own: &Evaluation) -> Class {
    if is_at_end(ray, own) {
        Class::IntervalTie
    } else if own.margin() > 1.0 || own.is_met {
        Class::OtherMisses
    } else {
        Class::SilhouetteTie
    }
}

fn is_at_end(ray: &Ray, evaluation: &Evaluation) -> bool {
    [ray.t_min, ray.t_max]
        .iter()
        .any(|&end| (f64::from(end) - evaluation.t).abs() <= evaluation.t_bound)
}
