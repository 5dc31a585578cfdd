//! An accelerator's answers beside exact ones, or beside those of another.

use std::fmt;

use raywright_bvh::{Accuracy, Ray, TriangleMesh};

use super::Accelerator;
use crate::{
    exact,
    hits::{Answer, Class, Judge},
};

/// What is wrong with an answer.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum Finding {
    /// A wrong number, a hit where there is none, or one outside the interval; or a nearer hit is missed.
    Wrong,
    /// A hit exactly at an edge or vertex within a surface is missed: a fault of a watertight test alone.
    Leak,
    /// The triangle does not exist.
    NoSuchTriangle,
    /// Any hit says otherwise than the closest hit.
    AnyHit,
}

/// An answer that is wrong.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Fault {
    /// What is wrong.
    pub finding: Finding,
    /// The ray.
    pub ray: Ray,
    /// What the accelerator said.
    pub answer: Option<Answer>,
    /// What it was compared with.
    pub expected: Option<Answer>,
}

impl fmt::Display for Fault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let what = match self.finding {
            Finding::Wrong => "a wrong answer",
            Finding::Leak => "a leak",
            Finding::NoSuchTriangle => "a triangle that does not exist",
            Finding::AnyHit => "any hit says otherwise than the closest hit",
        };
        let Self {
            ray,
            answer,
            expected,
            ..
        } = self;
        write!(f, "{what}: {ray:?} gave {answer:?}, beside {expected:?}")
    }
}

impl std::error::Error for Fault {}

/// Checks answers about some meshes; the place of a mesh in the slice is its geometry id.
#[derive(Debug)]
pub struct Checker<'m> {
    meshes: &'m [&'m TriangleMesh],
    accuracy: Accuracy,
    judge: Judge<'m>,
}

impl<'m> Checker<'m> {
    /// `accuracy` tells what the accelerator's triangle test is: with [`Accuracy::Fast`] that of Möller and Trumbore in
    /// f32, which may leak at edges; with [`Accuracy::Robust`] a watertight one, as that of Woop, Benthin and Wald.
    /// A more exact test passes as either.
    #[must_use]
    pub fn new(meshes: &'m [&'m TriangleMesh], accuracy: Accuracy) -> Self {
        Self {
            meshes,
            accuracy,
            judge: Judge::new(meshes, accuracy).of_free_distances(),
        }
    }

    /// Checks beside the exact hits of all triangles: time in proportion to their number.
    ///
    /// # Errors
    /// The fault.
    pub fn beside_exact(&self, accelerator: &impl Accelerator, ray: &Ray) -> Result<(), Fault> {
        let hits = exact::all_hits(self.meshes, ray);
        let expected = hits.first().map(|hit| Answer {
            t: hit.t as f32,
            uv: hit.uv.map(|x| x as f32),
            ids: [hit.geometry_id, hit.primitive_id],
        });
        self.check(accelerator, ray, expected, |answer| {
            let farthest = self.judge.farthest(ray, answer);
            let near = hits.partition_point(|hit| hit.t <= farthest);
            self.judge.class_beside_all(ray, answer, &hits[..near])
        })
    }

    /// Checks beside another accelerator, which is to be right: what it misses or invents is not held against
    /// the first. Fit for large meshes.
    ///
    /// # Errors
    /// The fault.
    pub fn beside(
        &self,
        accelerator: &impl Accelerator,
        peer: &impl Accelerator,
        ray: &Ray,
    ) -> Result<(), Fault> {
        let expected = peer.closest_hit(ray);
        self.check(accelerator, ray, expected, |answer| {
            self.judge.class(ray, answer, expected)
        })
    }

    fn check(
        &self,
        accelerator: &impl Accelerator,
        ray: &Ray,
        expected: Option<Answer>,
        class: impl Fn(Option<Answer>) -> Class,
    ) -> Result<(), Fault> {
        let answer = accelerator.closest_hit(ray);
        let finding = self
            .finding(ray, answer, class)
            .or_else(|| (accelerator.any_hit(ray) != answer.is_some()).then_some(Finding::AnyHit));
        match finding {
            None => Ok(()),
            Some(finding) => Err(Fault {
                finding,
                ray: *ray,
                answer,
                expected,
            }),
        }
    }

    /// What is wrong with a closest hit.
    fn finding(
        &self,
        ray: &Ray,
        answer: Option<Answer>,
        class: impl Fn(Option<Answer>) -> Class,
    ) -> Option<Finding> {
        if let Some(answer) = answer {
            if !self.has_triangle(answer.ids) {
                return Some(Finding::NoSuchTriangle);
            }
            if !(ray.t_min <= answer.t && answer.t <= ray.t_max) {
                return Some(Finding::Wrong);
            }
        }
        match class(answer) {
            Class::Bug => Some(Finding::Wrong),
            Class::Leak if self.accuracy == Accuracy::Robust => Some(Finding::Leak),
            _ => None,
        }
    }

    fn has_triangle(&self, [geometry, primitive]: [u32; 2]) -> bool {
        let mesh = self.meshes.get(geometry as usize);
        mesh.is_some_and(|mesh| (primitive as usize) < mesh.triangles().len())
    }
}
