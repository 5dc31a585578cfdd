//! False-colour views of what camera rays meet. Black where nothing is hit.

use raywright_bvh::{Bvh, Ray, Work};

use crate::{scene::Rgb, world::World};

/// What a false-colour view shows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum View {
    /// The geometric normal, from −1..1 to 0..1 per axis.
    Normals,
    /// One colour per geometry id.
    GeometryIds,
    /// One colour per geometry and primitive id.
    PrimitiveIds,
    /// How many nodes the ray visited, 0 to [`View::MOST_NODES`], from black to white over blue,
    /// red and yellow. The only view that depends on the tree.
    Nodes,
}

impl View {
    /// All of them.
    pub const ALL: [Self; 4] = [
        Self::Normals,
        Self::GeometryIds,
        Self::PrimitiveIds,
        Self::Nodes,
    ];

    /// So many nodes and more are white in [`View::Nodes`].
    pub const MOST_NODES: u64 = 64;

    /// Its name on a command line.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Normals => "normals",
            Self::GeometryIds => "geometry-ids",
            Self::PrimitiveIds => "primitive-ids",
            Self::Nodes => "nodes",
        }
    }
}

pub(crate) fn colour(view: View, world: &World, bvh: &Bvh, ray: &Ray) -> Rgb {
    let mut work = Work::default();
    let hit = bvh.closest_hit_with_work(ray, &mut work);
    if view == View::Nodes {
        return heat(work.nodes as f32 / View::MOST_NODES as f32);
    }
    hit.map_or(Rgb::ZERO, |hit| match view {
        View::Normals => world.surface(&hit).0.normal * 0.5 + 0.5,
        View::GeometryIds => colour_of(u64::from(hit.geometry_id)),
        View::PrimitiveIds | View::Nodes => {
            colour_of(u64::from(hit.geometry_id) << 32 | u64::from(hit.primitive_id))
        }
    })
}

/// A bright colour that differs for neighbouring numbers: the output function of SplitMix64
/// (Steele, Lea, Flood, *Fast Splittable Pseudorandom Number Generators*, 2014).
fn colour_of(id: u64) -> Rgb {
    let mut z = (id + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    z = (z ^ z >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ z >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^= z >> 31;
    let channel = |shift: u32| 0.15 + 0.85 * ((z >> shift & 0xffff) as f32 / 65535.0);
    Rgb::new(channel(0), channel(16), channel(32))
}

/// Black, blue, red, yellow, white for 0 to 1.
fn heat(x: f32) -> Rgb {
    const STOPS: [Rgb; 5] = [
        Rgb::ZERO,
        Rgb::new(0.0, 0.0, 0.6),
        Rgb::new(0.8, 0.05, 0.1),
        Rgb::new(1.0, 0.8, 0.0),
        Rgb::ONE,
    ];
    let place = x.clamp(0.0, 1.0) * (STOPS.len() - 1) as f32;
    let below = (place as usize).min(STOPS.len() - 2);
    STOPS[below].lerp(STOPS[below + 1], place - below as f32)
}
