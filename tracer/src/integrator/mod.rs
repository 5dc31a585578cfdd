//! What the colour of a ray is. Path length K is the number of scattering events: K = 0 shows
//! emission alone, K = 1 adds direct light, K = 3 is the workload of the autotuning paper.

pub(crate) mod naive;
pub(crate) mod path;
pub(crate) mod view;

pub use view::View;

/// What is rendered.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Integrator {
    /// Paths with next-event estimation and multiple importance sampling.
    Path {
        /// Scattering events of a path, K.
        path_length: u32,
    },
    /// Paths that find emitters by chance alone: the slow twin of `Path`, with the same mean.
    NaivePath {
        /// Scattering events of a path, K.
        path_length: u32,
    },
    /// A false-colour view of the first hit.
    View(View),
}

impl Integrator {
    /// The default path length, that of the autotuning paper.
    pub const DEFAULT_PATH_LENGTH: u32 = 3;
}
