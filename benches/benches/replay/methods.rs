//! The searches that are compared.

use std::error::Error;

use raywright_benches::recordings::{PORTFOLIO, SpaceKind};
use raywright_tuner::{Search, Space, search_by_name};

/// A search with everything that belongs to it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Method {
    pub(crate) name: &'static str,
    pub(crate) space: SpaceKind,
    search: Kind,
    /// Names of rows that are tried first.
    pub(crate) starts: &'static [&'static str],
    pub(crate) seeds: u64,
}

/// Whose search it is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    Own(&'static str),
    #[cfg(feature = "peers")]
    Peer(&'static str),
}

const SEEDS: u64 = 10;

/// The search that is judged beside the peers.
pub(crate) const JUDGED: &str = "3 starts + Gaussian process, canonical";

impl Method {
    const fn own(
        name: &'static str,
        space: SpaceKind,
        search: &'static str,
        starts: &'static [&'static str],
    ) -> Method {
        Method {
            name,
            space,
            search: Kind::Own(search),
            starts,
            seeds: SEEDS,
        }
    }

    /// A search that is not ours, in the canonical space.
    #[cfg(feature = "peers")]
    pub(crate) const fn peer(
        name: &'static str,
        search: &'static str,
        starts: &'static [&'static str],
    ) -> Method {
        Method {
            name,
            space: SpaceKind::Canonical,
            search: Kind::Peer(search),
            starts,
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

const OWN: [Method; 6] = [
    Method::own("random, printed", SpaceKind::Printed, "random", &[]),
    Method::own(
        "paper: hypercube + simplex, printed",
        SpaceKind::Printed,
        "nelder-mead",
        &[],
    ),
    Method::own(
        "hypercube + simplex, canonical",
        SpaceKind::Canonical,
        "nelder-mead",
        &[],
    ),
    Method::own(
        "3 starts + simplex, canonical",
        SpaceKind::Canonical,
        "nelder-mead",
        PORTFOLIO,
    ),
    Method::own(
        "Gaussian process, canonical",
        SpaceKind::Canonical,
        "gaussian-process",
        &[],
    ),
    Method::own(JUDGED, SpaceKind::Canonical, "gaussian-process", PORTFOLIO),
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
