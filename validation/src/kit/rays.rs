//! Rays by aim. A ray is a recipe for a mesh, so that it keeps its aim while the mesh is made smaller.

use proptest::{collection::vec, prelude::*, sample::Index};
use raywright_bvh::{Ray, TriangleMesh, Vec3};

use super::meshes::{MeshClass, lattice, lattice_vertex, meshes};

/// Where a ray goes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum Aim {
    /// To a point within a triangle.
    Interior,
    /// To a point of an edge, at k/16 of it.
    Edge,
    /// To a vertex.
    Vertex,
    /// Along an axis, through a point as above; other components are zeros of either sign.
    Axis,
    /// Nearly in the plane of a triangle: from 1/16 to 1/65536 off it.
    Grazing,
    /// From anywhere to anywhere within four sizes of the mesh.
    Anywhere,
}

impl Aim {
    /// All.
    pub const ALL: [Self; 6] = [
        Self::Interior,
        Self::Edge,
        Self::Vertex,
        Self::Axis,
        Self::Grazing,
        Self::Anywhere,
    ];
}

/// A mesh with rays.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct Case {
    /// Its triangles.
    pub mesh: TriangleMesh,
    /// One ray at least.
    pub rays: Vec<Ray>,
}

/// Meshes of a class with rays of all aims.
///
/// What a ray aims at is at t = 1. Its interval is all of the ray, or ends before, at, or behind that point, or begins
/// there. Where the mesh is on the lattice, so are origins and, but for grazing rays, points that are aimed at.
pub fn cases(class: MeshClass) -> BoxedStrategy<Case> {
    (meshes(class), vec(recipe(), 1..=16))
        .prop_map(|(mesh, recipes)| {
            let rays = recipes.iter().map(|recipe| recipe.ray(&mesh)).collect();
            Case { mesh, rays }
        })
        .boxed()
}

/// Intervals about t = 1.
const INTERVALS: [[f32; 2]; 6] = [
    [0.0, f32::INFINITY],
    [0.0, 0.5],
    [0.5, 1.5],
    [1.5, f32::INFINITY],
    [0.0, 1.0],
    [1.0, f32::INFINITY],
];

/// What a ray is made of, whatever the mesh.
#[derive(Clone, Debug)]
struct Recipe {
    aim: Aim,
    triangle: Index,
    /// Which corner is the first.
    turn: usize,
    /// Sixteenths.
    share: [u8; 2],
    /// Where the ray comes from, in quarters of the size of the mesh.
    from: Vec3,
    /// The same, for rays to anywhere.
    to: Vec3,
    axis: usize,
    /// The signs of the components along an axis.
    signs: [bool; 3],
    /// A power of two below 1: off the plane of a triangle.
    slope: i32,
    interval: [f32; 2],
}

fn recipe() -> impl Strategy<Value = Recipe> {
    let place = (any::<Index>(), 0..3_usize, [1..=14_u8, 0..=16_u8]);
    let ends = (lattice_vertex(), [lattice(), lattice(), lattice()]);
    let direction = (0..3_usize, any::<[bool; 3]>(), 4..=16_i32);
    let kind = (
        prop::sample::select(Aim::ALL.to_vec()),
        prop::sample::select(INTERVALS.to_vec()),
    );
    (place, ends, direction, kind).prop_map(
        |((triangle, turn, share), (from, to), (axis, signs, slope), (aim, interval))| Recipe {
            aim,
            triangle,
            turn,
            share,
            from,
            to: Vec3::from_array(to),
            axis,
            signs,
            slope,
            interval,
        },
    )
}

impl Recipe {
    fn ray(&self, mesh: &TriangleMesh) -> Ray {
        let triangle = self.triangle.index(mesh.triangles().len());
        let mut corners = mesh.corners(triangle as u32);
        corners.rotate_left(self.turn);
        let size = size(mesh);
        let target = self.target(corners);
        let (origin, direction) = match self.aim {
            Aim::Interior | Aim::Edge | Aim::Vertex => {
                let origin = target + size * self.from;
                (origin, target - origin)
            }
            Aim::Axis => {
                let mut direction =
                    Vec3::from_array(self.signs.map(|sign| if sign { -0.0 } else { 0.0 }));
                direction[self.axis] = if self.signs[self.axis] { -size } else { size };
                // Adding a zero would change the sign of a zero, and nothing else.
                (target - direction, direction)
            }
            Aim::Grazing => {
                let [a, b, c] = corners;
                let normal = (b - a).cross(c - a).normalize_or_zero();
                let across = b - a + f32::from(self.share[1]) / 16.0 * (c - b);
                let direction = across + f32::powi(2.0, -self.slope) * across.length() * normal;
                (target - direction, direction)
            }
            Aim::Anywhere => {
                let centre = mesh.vertices()[0];
                let origin = centre + size * self.from;
                (origin, centre + size * self.to - origin)
            }
        };
        let [t_min, t_max] = self.interval;
        Ray::new(origin, direction).with_range(t_min, t_max)
    }

    /// The point that is aimed at.
    fn target(&self, [a, b, c]: [Vec3; 3]) -> Vec3 {
        let [first, second] = self.share.map(|share| f32::from(share) / 16.0);
        match self.aim {
            Aim::Vertex => a,
            Aim::Edge => a + second * (b - a),
            // A vertex, a point of an edge, or one within.
            Aim::Axis if self.share[0] < 5 => a,
            Aim::Axis if self.share[0] < 10 => a + second * (b - a),
            _ => {
                // Within: a sixteenth at least is left for each corner.
                let rest = 1.0 - first - 1.0 / 16.0;
                let second = (second * rest * 16.0).floor().max(1.0) / 16.0;
                a + first * (b - a) + second * (c - a)
            }
        }
    }
}

/// A power of two, at least the largest coordinate, so that offsets by sixteenths of it keep to a lattice.
fn size(mesh: &TriangleMesh) -> f32 {
    let largest = |vertex: &Vec3| vertex.abs().max_element();
    let largest = mesh.vertices().iter().map(largest).fold(0.0, f32::max);
    if largest > 0.0 {
        f32::powi(2.0, largest.log2().ceil() as i32)
    } else {
        1.0
    }
}

#[cfg(test)]
mod tests {
    use proptest::{strategy::ValueTree, test_runner::TestRunner};

    use super::*;
    use crate::exact;

    fn recipes(aim: Aim) -> BoxedStrategy<Recipe> {
        let set = move |mut recipe: Recipe| {
            (recipe.aim, recipe.interval) = (aim, INTERVALS[0]);
            recipe
        };
        recipe().prop_map(set).boxed()
    }

    /// On the lattice, rays meet what they aim at exactly, however small the case is made.
    #[test]
    fn rays_keep_their_aim() {
        let mut runner = TestRunner::deterministic();
        for (aim, is_wanted) in [
            (Aim::Interior, (|weight| weight >= 0.05) as fn(f64) -> bool),
            (Aim::Edge, |weight| weight.abs() < 1e-9),
            (Aim::Vertex, |weight| weight.abs() < 1e-9),
        ] {
            let strategy = (meshes(MeshClass::Lattice), recipes(aim));
            let mut met = 0;
            for _ in 0..100 {
                let mut tree = strategy.new_tree(&mut runner).expect("a case");
                for _ in 0..30 {
                    let (mesh, recipe) = tree.current();
                    let id = recipe.triangle.index(mesh.triangles().len()) as u32;
                    let ray = recipe.ray(&mesh);
                    if exact::is_met(mesh.corners(id), &ray) {
                        let hits = exact::all_hits(&[&mesh], &ray);
                        let own = hits
                            .iter()
                            .find(|hit| hit.primitive_id == id)
                            .expect("a hit");
                        assert!((own.t - 1.0).abs() < 1e-9, "{aim:?} {own:?}");
                        assert!(is_wanted(own.smallest_weight), "{aim:?} {own:?}");
                        met += 1;
                    }
                    if !tree.simplify() {
                        break;
                    }
                }
            }
            assert!(met > 500, "{aim:?}: {met}");
        }
    }

    #[test]
    fn rays_along_an_axis_have_one_component() {
        let mut runner = TestRunner::deterministic();
        for _ in 0..200 {
            let strategy = (meshes(MeshClass::AnyBits), recipes(Aim::Axis));
            let (mesh, recipe) = strategy.new_tree(&mut runner).expect("a case").current();
            let direction = recipe.ray(&mesh).direction.to_array();
            assert_eq!(direction.iter().filter(|&&x| x != 0.0).count(), 1);
        }
    }
}
