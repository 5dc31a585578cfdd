//! Splitting a polygon into triangles.
//!
//! A strictly convex polygon becomes the fan of its first corner, which is what most tools do. All
//! others go through ear clipping (Meisters, "Polygons have ears", 1975): a corner whose triangle
//! holds no other corner is cut off until three are left. The polygon is looked at along the
//! dominant axis of its Newell normal (Newell's method, as in Sutherland et al., "A
//! characterization of ten hidden-surface algorithms", 1974), so it need not be exactly flat.
//!
//! Invariants: n corners give n − 2 triangles in the winding of the polygon; every corner is used.
//! A corner between two collinear edges gets triangles of positive area where that is possible, so
//! that no crack opens between it and its neighbours when empty triangles are dropped later.
//!
//! Not for polygons that cross themselves: those end as a fan, and the caller is told.

use raywright_bvh::Vec3;

/// Polygons that are not convex and have more corners than this are fanned: the time of ear
/// clipping grows with the square of the corners, and files are not trusted.
const MAX_CLIPPED_CORNERS: usize = 1024;

/// How a polygon was split.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Split {
    /// The triangles cover the polygon.
    Exact,
    /// All or part was split as if it were convex, which it is not, or nobody knows.
    Fanned,
}

/// Splits polygons; holds memory that is used again for the next one.
#[derive(Debug, Default)]
pub(super) struct Triangulator {
    /// The corners in the plane, counter-clockwise.
    points: Vec<[f64; 2]>,
    previous: Vec<usize>,
    next: Vec<usize>,
    candidates: Vec<usize>,
}

impl Triangulator {
    /// Gives the triangles of the polygon with these corners, as indices into `corners`, to
    /// `emit`.
    pub(super) fn split(&mut self, corners: &[Vec3], mut emit: impl FnMut([usize; 3])) -> Split {
        let count = corners.len();
        let known = if count <= 3 || self.project(corners) {
            Some(Split::Exact)
        } else if count > MAX_CLIPPED_CORNERS || self.points.is_empty() {
            Some(Split::Fanned)
        } else {
            None
        };
        if let Some(split) = known {
            (2..count).for_each(|last| emit([0, last - 1, last]));
            return split;
        }
        self.clip(emit)
    }

    /// Fills `points` and says whether they are a strictly convex polygon. Without a normal, or
    /// with coordinates that are not finite, there are no points.
    fn project(&mut self, corners: &[Vec3]) -> bool {
        self.points.clear();
        let normal = newell_normal(corners);
        let dominant = (0..3)
            .max_by(|&a, &b| normal[a].abs().total_cmp(&normal[b].abs()))
            .filter(|&axis| normal[axis] != 0.0 && normal[axis].is_finite());
        let Some(axis) = dominant else {
            return false;
        };
        let (mut u, mut v) = ((axis + 1) % 3, (axis + 2) % 3);
        if normal[axis] < 0.0 {
            (u, v) = (v, u);
        }
        self.points
            .extend(corners.iter().map(|c| [f64::from(c[u]), f64::from(c[v])]));
        let count = corners.len();
        (0..count).all(|i| self.turn(i, (i + 1) % count, (i + 2) % count) > 0.0)
    }

    fn clip(&mut self, mut emit: impl FnMut([usize; 3])) -> Split {
        let count = self.points.len();
        self.previous.clear();
        self.previous
            .extend((0..count).map(|i| (i + count - 1) % count));
        self.next.clear();
        self.next.extend((0..count).map(|i| (i + 1) % count));
        self.candidates.clear();
        self.candidates.extend((0..count).rev());

        let mut left = count;
        let mut start = 0;
        let mut cut_since_refill = false;
        while left > 3 {
            let ear = match self.candidates.pop() {
                // Corners that were cut off are marked by being their own neighbour.
                Some(corner) if self.next[corner] == corner => continue,
                Some(corner) if self.is_ear(corner) => corner,
                Some(_) => continue,
                // Cutting an ear can make an ear of a corner that is not its neighbour.
                None if cut_since_refill => {
                    let rest: Vec<usize> = self.ring(start).collect();
                    self.candidates.extend(rest);
                    cut_since_refill = false;
                    continue;
                }
                None => match self.flat_corner(start) {
                    Some(corner) => corner,
                    None => {
                        let rest: Vec<usize> = self.ring(start).collect();
                        (2..left).for_each(|last| emit([rest[0], rest[last - 1], rest[last]]));
                        return Split::Fanned;
                    }
                },
            };
            let (before, after) = (self.previous[ear], self.next[ear]);
            emit([before, ear, after]);
            self.next[before] = after;
            self.previous[after] = before;
            self.next[ear] = ear;
            self.candidates.extend([before, after]);
            start = after;
            left -= 1;
            cut_since_refill = true;
        }
        emit([start, self.next[start], self.previous[start]]);
        Split::Exact
    }

    /// The corners that are left, from `start` on.
    fn ring(&self, start: usize) -> impl Iterator<Item = usize> + use<'_> {
        let mut after = Some(start);
        std::iter::from_fn(move || {
            let corner = after?;
            after = Some(self.next[corner]).filter(|&next| next != start);
            Some(corner)
        })
    }

    /// Twice the signed area of a triangle; positive if it turns to the left.
    fn turn(&self, a: usize, b: usize, c: usize) -> f64 {
        let [a, b, c] = [self.points[a], self.points[b], self.points[c]];
        (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
    }

    /// Whether the triangle at `corner` has positive area and no other corner in it or on its
    /// boundary. Corners at the same place as one of its own do not count: a polygon with a hole
    /// is written with a bridge whose ends appear twice.
    fn is_ear(&self, corner: usize) -> bool {
        let (before, after) = (self.previous[corner], self.next[corner]);
        let own = [before, corner, after];
        self.turn(before, corner, after) > 0.0
            && self
                .ring(self.next[after])
                .take_while(|&other| other != before)
                .filter(|&other| own.iter().all(|&o| self.points[o] != self.points[other]))
                .all(|other| {
                    self.turn(before, corner, other) < 0.0
                        || self.turn(corner, after, other) < 0.0
                        || self.turn(after, before, other) < 0.0
                })
    }

    /// A corner whose triangle has no area.
    fn flat_corner(&self, start: usize) -> Option<usize> {
        self.ring(start)
            .find(|&i| self.turn(self.previous[i], i, self.next[i]) == 0.0)
    }
}

/// Twice the vector area. Sums over edges, so that it exists for polygons that are not flat.
fn newell_normal(corners: &[Vec3]) -> [f64; 3] {
    // Relative to the first corner: far from the origin the products would lose the area.
    let relative = |corner: Vec3| {
        let difference = corner.as_dvec3() - corners[0].as_dvec3();
        difference.to_array()
    };
    let mut normal = [0.0; 3];
    let mut before = relative(corners[corners.len() - 1]);
    for &corner in corners {
        let here = relative(corner);
        for (axis, sum) in normal.iter_mut().enumerate() {
            let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
            *sum += before[u] * here[v] - before[v] * here[u];
        }
        before = here;
    }
    normal
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn split(corners: &[Vec3]) -> (Split, Vec<[usize; 3]>) {
        let mut triangles = Vec::new();
        let outcome = Triangulator::default().split(corners, |t| triangles.push(t));
        (outcome, triangles)
    }

    /// Exact splits of flat polygons: all triangles wind as the polygon does, and the areas add
    /// up, which overlaps or gaps would break.
    fn assert_covers(corners: &[Vec3]) {
        let (outcome, triangles) = split(corners);
        assert_eq!(outcome, Split::Exact);
        assert_eq!(triangles.len(), corners.len() - 2);
        let normal = glam::DVec3::from_array(newell_normal(corners));
        let direction = normal.normalize();
        let areas = triangles.iter().map(|t| {
            let [a, b, c] = t.map(|i| corners[i].as_dvec3());
            (b - a).cross(c - a).dot(direction)
        });
        assert!(areas.clone().all(|area| area >= 0.0), "{triangles:?}");
        let sum: f64 = areas.sum();
        assert!((sum / normal.length() - 1.0).abs() < 1e-6, "{triangles:?}");
    }

    fn flat(points: &[[f32; 2]]) -> Vec<Vec3> {
        points.iter().map(|p| Vec3::new(p[0], p[1], 0.0)).collect()
    }

    #[test]
    fn convex_polygons_are_fans() {
        let (outcome, triangles) =
            split(&flat(&[[0., 0.], [2., 0.], [3., 1.], [1., 3.], [0., 1.]]));
        assert_eq!(outcome, Split::Exact);
        assert_eq!(triangles, [[0, 1, 2], [0, 2, 3], [0, 3, 4]]);
    }

    #[test]
    fn concave_polygons_in_all_rotations_and_windings() {
        let arrow = [[0., 0.], [4., -3.], [1., 0.], [4., 3.]];
        let comb = [
            [0., 0.],
            [7., 0.],
            [7., 3.],
            [6., 3.],
            [6., 1.],
            [4., 1.],
            [4., 3.],
            [3., 3.],
            [3., 1.],
            [1., 1.],
            [1., 3.],
            [0., 3.],
        ];
        for shape in [&arrow[..], &comb[..]] {
            let mut corners = flat(shape);
            for _ in 0..corners.len() {
                corners.rotate_left(1);
                assert_covers(&corners);
                let reversed: Vec<Vec3> = corners.iter().rev().copied().collect();
                assert_covers(&reversed);
                // Standing upright, in both other planes.
                assert_covers(
                    &corners
                        .iter()
                        .map(|c| Vec3::new(c.z, c.x, c.y))
                        .collect::<Vec<_>>(),
                );
                assert_covers(
                    &corners
                        .iter()
                        .map(|c| Vec3::new(c.x, c.z, c.y))
                        .collect::<Vec<_>>(),
                );
            }
        }
    }

    #[test]
    fn a_corner_on_a_straight_edge_gets_triangles_with_area() {
        let corners = flat(&[[0., 0.], [1., 0.], [2., 0.], [2., 2.], [0., 2.]]);
        let (outcome, triangles) = split(&corners);
        assert_eq!(outcome, Split::Exact);
        for triangle in triangles {
            let [a, b, c] = triangle.map(|i| corners[i]);
            assert!((b - a).cross(c - a).z > 0.0, "{triangle:?}");
        }
    }

    #[test]
    fn a_hole_with_a_bridge() {
        assert_covers(&flat(&[
            [0., 0.],
            [6., 0.],
            [6., 6.],
            [0., 6.],
            [0., 0.],
            [2., 2.],
            [2., 4.],
            [4., 4.],
            [4., 2.],
            [2., 2.],
        ]));
    }

    #[test]
    fn what_crosses_itself_is_fanned_and_reported() {
        let bow_tie = flat(&[[0., 0.], [2., 2.], [2., 0.], [0., 2.]]);
        let (outcome, triangles) = split(&bow_tie);
        assert_eq!((outcome, triangles.len()), (Split::Fanned, 2));
    }

    #[test]
    fn too_many_corners_for_clipping() {
        let star = |count: usize| -> Vec<Vec3> {
            (0..count)
                .map(|i| {
                    let angle = i as f32 / count as f32 * std::f32::consts::TAU;
                    Vec3::new(angle.cos(), angle.sin(), 0.0) * [1.0, 0.5][i % 2]
                })
                .collect()
        };
        assert_covers(&star(MAX_CLIPPED_CORNERS));
        let (outcome, triangles) = split(&star(MAX_CLIPPED_CORNERS + 2));
        assert_eq!(
            (outcome, triangles.len()),
            (Split::Fanned, MAX_CLIPPED_CORNERS)
        );
    }

    proptest! {
        /// A corner at each of many directions, at any distance: simple, rarely convex.
        #[test]
        fn star_shaped_polygons(radii in prop::collection::vec(0.1_f32..10.0, 4..40)) {
            let count = radii.len() as f32;
            let corners: Vec<Vec3> = radii.iter().enumerate().map(|(i, &radius)| {
                let angle = i as f32 / count * std::f32::consts::TAU;
                Vec3::new(radius * angle.cos(), 100.0, -radius * angle.sin())
            }).collect();
            assert_covers(&corners);
        }

        #[test]
        fn anything_gives_n_minus_2_triangles(
            corners in prop::collection::vec(prop::array::uniform3(-2_i8..3), 3..12),
        ) {
            let corners: Vec<Vec3> =
                corners.iter().map(|c| Vec3::from_array(c.map(f32::from))).collect();
            let (_, triangles) = split(&corners);
            prop_assert_eq!(triangles.len(), corners.len() - 2);
        }
    }
}
