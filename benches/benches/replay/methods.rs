//! The searches that are compared.

use std::error::Error;

use raywright_benches::recordings::SpaceKind;
use raywright_tuner::{Search, Space, search_by_name};

/// A search with everything that belongs to it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Method {
    pub(crate) name: &'static str,
    pub(crate) space: SpaceKind,
    search: Kind,
    pub(crate) starts: Starts,
    /// Frames in vain after which what is best so far is kept.
    pub(crate) patience: Option<u32>,
    pub(crate) seeds: u64,
}

/// What is tried first.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Starts {
    Nothing,
    /// The strong default.
    #[cfg(feature = "peers")]
    Strong,
    /// So many configurations that together are good in the other scenes.
    OfOtherScenes(usize),
}

/// Those of most searches that have some.
pub(crate) const THREE: Starts = Starts::OfOtherScenes(3);

/// Whose search it is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    Own(&'static str),
    #[cfg(feature = "peers")]
    Peer(&'static str),
}

const SEEDS: u64 = 10;

/// The search that is judged beside the peers.
pub(crate) const JUDGED: &str = "the same, ends after 12 frames in vain";

impl Method {
    const fn own(
        name: &'static str,
        space: SpaceKind,
        search: &'static str,
        starts: Starts,
    ) -> Method {
        Method {
            name,
            space,
            search: Kind::Own(search),
            starts,
            patience: None,
            seeds: SEEDS,
        }
    }

    /// A search that is not ours, in the canonical space.
    #[cfg(feature = "peers")]
    pub(crate) const fn peer(name: &'static str, search: &'static str, starts: Starts) -> Method {
        Method {
            name,
            space: SpaceKind::Canonical,
            search: Kind::Peer(search),
            starts,
            patience: None,
            seeds: SEEDS,
        }
    }

    #[cfg(feature = "peers")]
    pub(crate) const fn with_seeds(mut self, seeds: u64) -> Method {
        self.seeds = seeds;
        self
    }

    #[cfg(feature = "peers")]
    pub(crate) fn search_name(&self) -> &'static str {
        let (Kind::Own(name) | Kind::Peer(name)) = self.search;
        name
    }

    pub(crate) fn is_peer(&self) -> bool {
        !matches!(self.search, Kind::Own(_))
    }
}

/// As that of `raywright::tune::Hybrid`.
const PATIENCE: u32 = 12;

const OWN: [Method; 7] = [
    Method::own(
        "random, printed",
        SpaceKind::Printed,
        "random",
        Starts::Nothing,
    ),
    Method::own(
        "paper: hypercube + simplex, printed",
        SpaceKind::Printed,
        "nelder-mead",
        Starts::Nothing,
    ),
    Method::own(
        "hypercube + simplex, canonical",
        SpaceKind::Canonical,
        "nelder-mead",
        Starts::Nothing,
    ),
    Method::own(
        "3 starts + simplex, canonical",
        SpaceKind::Canonical,
        "nelder-mead",
        THREE,
    ),
    Method::own(
        "Gaussian process, canonical",
        SpaceKind::Canonical,
        "gaussian-process",
        Starts::Nothing,
    ),
    Method::own(
        "3 starts + Gaussian process, canonical",
        SpaceKind::Canonical,
        "gaussian-process",
        THREE,
    ),
    Method {
        patience: Some(PATIENCE),
        ..Method::own(JUDGED, SpaceKind::Canonical, "gaussian-process", THREE)
    },
];

/// All searches that can be had.
#[derive(Debug)]
pub(crate) struct Searches {
    pub(crate) methods: Vec<Method>,
    #[cfg(feature = "peers")]
    peers: crate::peers::Peers,
}

impl Searches {
    /// Looks for peers; says on standard output what is left out.
    pub(crate) fn open() -> Searches {
        #[cfg(feature = "peers")]
        {
            let peers = crate::peers::Peers::open();
            let methods = OWN.into_iter().chain(peers.methods()).collect();
            Searches { methods, peers }
        }
        #[cfg(not(feature = "peers"))]
        {
            println!("left out: peers, which the feature peers brings");
            Searches {
                methods: OWN.to_vec(),
            }
        }
    }

    /// The search of a method, for a space and so many frames.
    pub(crate) fn search(
        &self,
        method: &Method,
        space: &Space,
        frames: usize,
    ) -> Result<Box<dyn Search>, Box<dyn Error>> {
        let (name, search) = match method.search {
            Kind::Own(name) => (name, search_by_name(name)),
            #[cfg(feature = "peers")]
            Kind::Peer(name) => (name, self.peers.search(name, space, frames)),
        };
        #[cfg(not(feature = "peers"))]
        let _ = (space, frames);
        search.ok_or_else(|| format!("no search {name}").into())
    }

    /// Why a peer gave no answer since that was asked last.
    pub(crate) fn failure(&self) -> Option<String> {
        #[cfg(feature = "peers")]
        return self.peers.failure();
        #[cfg(not(feature = "peers"))]
        None
    }
}
