//! Answers to a ray, and what two of them may be to each other.

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
    /// Ours passes between triangles that leave no gap, however their vertices are moved within rounding: a fault of a
    /// watertight test, and what a fast one may do.
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
