//! A kit for those who have an accelerator of their own: meshes and rays on which accelerators go wrong, and a judge.
//!
//! ```
//! use raywright_bvh::{Accuracy, BuildParams, Bvh};
//! use raywright_validation::kit::Trial;
//!
//! // In place of `Bvh`: anything that is an `Accelerator`, or two closures.
//! let build = |mesh: &_| Bvh::build(&[mesh], &BuildParams::default()).unwrap();
//! // The default triangle test is the fast one, which may leak at edges.
//! let outcome = Trial::new(Accuracy::Fast).with_cases(20).run(build);
//! assert!(outcome.is_ok(), "{}", outcome.unwrap_err());
//! ```
//!
//! [`Trial`] runs a property test (Claessen, Hughes, *QuickCheck: A Lightweight Tool for Random Testing of Haskell
//! Programs*, 2000, as the crate proptest has it) over all [classes of meshes](MeshClass) with rays of all
//! [aims](Aim), and gives the smallest mesh and ray that it could find. [`meshes`], [`cases`] and [`Checker`] are its
//! parts, for tests of one's own: an accelerator is checked beside exact hits, or beside another accelerator
//! (a [`Bvh`], with the feature `embree` a scene of Embree's).
//!
//! Invariants: what is made smaller keeps its class; an answer is a fault only if it is beyond what rounding may do
//! (see [`hits`](crate::hits)).

mod check;
mod meshes;
mod rays;
mod trial;

use raywright_bvh::{Bvh, Ray};

use crate::hits::Answer;

pub use check::{Checker, Fault, Finding};
pub use meshes::{MeshClass, meshes};
pub use rays::{Aim, Case, cases};
pub use trial::{Counterexample, Trial};

/// What answers rays about the triangles of a mesh.
pub trait Accelerator {
    /// The closest hit within the interval of the ray, ends included.
    fn closest_hit(&self, ray: &Ray) -> Option<Answer>;

    /// Whether there is any hit, by the same triangle test.
    fn any_hit(&self, ray: &Ray) -> bool;
}

/// The closest hit and any hit as closures.
impl<C, A> Accelerator for (C, A)
where
    C: Fn(&Ray) -> Option<Answer>,
    A: Fn(&Ray) -> bool,
{
    fn closest_hit(&self, ray: &Ray) -> Option<Answer> {
        self.0(ray)
    }

    fn any_hit(&self, ray: &Ray) -> bool {
        self.1(ray)
    }
}

impl Accelerator for Bvh {
    fn closest_hit(&self, ray: &Ray) -> Option<Answer> {
        Bvh::closest_hit(self, ray).map(|hit| Answer {
            t: hit.t,
            uv: [hit.u, hit.v],
            ids: [hit.geometry_id, hit.primitive_id],
        })
    }

    fn any_hit(&self, ray: &Ray) -> bool {
        Bvh::any_hit(self, ray)
    }
}

#[cfg(feature = "embree")]
impl Accelerator for crate::embree::Scene<'_> {
    fn closest_hit(&self, ray: &Ray) -> Option<Answer> {
        crate::embree::Scene::closest_hit(self, ray).map(|hit| Answer {
            t: hit.t,
            uv: [hit.u, hit.v],
            ids: [hit.geometry_id, hit.primitive_id],
        })
    }

    fn any_hit(&self, ray: &Ray) -> bool {
        crate::embree::Scene::any_hit(self, ray)
    }
}
