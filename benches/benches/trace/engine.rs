//! What is asked with rays, and what it answers.

use std::fmt;

use raywright_benches::rays::RaySet;
use raywright_bvh::{Hit, Ray};
use raywright_validation::embree::EmbreeHit;

use super::{embree::EmbreeScene, ours::Ours};

/// An engine over a scene.
pub(crate) struct Engine<'a> {
    pub(crate) role: Role,
    /// Of its tree, where it says so.
    pub(crate) bytes_per_triangle: Option<f64>,
    pub(crate) tracer: Box<dyn Trace + 'a>,
}

/// Whose engine it is, and which.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Role {
    Embree(EmbreeScene),
    Ours(Ours),
    /// Of another crate.
    #[cfg_attr(
        not(feature = "peers"),
        expect(dead_code, reason = "made with the feature")
    )]
    Peer(&'static str),
}

impl fmt::Display for Role {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Embree(scene) => write!(f, "Embree {scene}"),
            Self::Ours(ours) => write!(f, "raywright {ours}"),
            Self::Peer(name) => f.write_str(name),
        }
    }
}

/// Answers many rays, one answer for each in their order.
pub(crate) trait Trace: Sync {
    /// Fills `answers.closest`.
    fn closest(&self, rays: &[Ray], answers: &mut Answers);
    /// Fills `answers.is_hit`.
    fn any(&self, rays: &[Ray], answers: &mut Answers);
}

/// Where the closest hit is, and of what. Every engine stores this within its time.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Closest {
    /// Infinite where nothing is hit.
    pub(crate) t: f32,
    /// Never read: it is stored as a user would store it.
    #[expect(dead_code, reason = "storing it is part of what is measured")]
    pub(crate) primitive_id: u32,
}

impl Closest {
    pub(crate) const NOTHING: Self = Self {
        t: f32::INFINITY,
        primitive_id: u32::MAX,
    };

    pub(crate) fn new(t: f32, primitive_id: u32) -> Self {
        Self { t, primitive_id }
    }
}

impl From<Hit> for Closest {
    fn from(hit: Hit) -> Self {
        Self::new(hit.t, hit.primitive_id)
    }
}

impl From<EmbreeHit> for Closest {
    fn from(hit: EmbreeHit) -> Self {
        Self::new(hit.t, hit.primitive_id)
    }
}

/// Memory for answers, and for those of engines that give many at once in a form of their own.
#[derive(Debug, Default)]
pub(crate) struct Answers {
    pub(crate) closest: Vec<Closest>,
    pub(crate) is_hit: Vec<bool>,
    pub(crate) hits: Vec<Option<Hit>>,
    pub(crate) embree_hits: Vec<Option<EmbreeHit>>,
}

impl Answers {
    /// Answers closest hits one ray at a time.
    #[inline]
    pub(crate) fn fill_closest(&mut self, rays: &[Ray], ask: impl Fn(&Ray) -> Closest) {
        self.closest.clear();
        self.closest.extend(rays.iter().map(ask));
    }

    /// Answers whether something is hit one ray at a time.
    #[inline]
    pub(crate) fn fill_any(&mut self, rays: &[Ray], ask: impl Fn(&Ray) -> bool) {
        self.is_hit.clear();
        self.is_hit.extend(rays.iter().map(ask));
    }
}

/// A closest hit, if there is one, as it is stored.
#[inline]
pub(crate) fn stored<H: Into<Closest>>(hit: Option<H>) -> Closest {
    hit.map_or(Closest::NOTHING, Into::into)
}

impl Engine<'_> {
    /// Answers rays with what is asked of their set.
    pub(crate) fn ask(&self, set: &RaySet, rays: &[Ray], answers: &mut Answers) {
        if set.any_hit {
            self.tracer.any(rays, answers);
        } else {
            self.tracer.closest(rays, answers);
        }
    }
}
