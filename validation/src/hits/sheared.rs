//! A scene as a ray sees it: moved and sheared so that the ray is an axis of it (Woop, Benthin, Wald, *Watertight
//! Ray/Triangle Intersection*, 2013), in f64, with bounds of what f32 makes of it.
//!
//! Invariant: a point is a function of ray and vertex alone, hence the same in all triangles around the vertex.

use glam::DVec3;

use super::evaluate::gamma;

/// A number, and how far off it may be in f32.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Bounded {
    pub(super) value: f64,
    pub(super) bound: f64,
}

/// A vertex in the plane across the ray, whose point is (0, 0).
pub(super) type Point = [Bounded; 2];

/// On which side of an edge the ray passes: p × q of its points.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Side {
    pub(super) value: f64,
    /// What moved ends make of the value.
    pub(super) moved: f64,
    /// What the roundings of its own two products make of it.
    pub(super) rounded: f64,
}

/// The shear of a ray.
#[derive(Clone, Copy, Debug)]
pub(super) struct Shear {
    axes: [usize; 3],
    shear: [f64; 2],
    /// That of the direction along its largest axis: D·(P×Q) has the sign of this times p × q.
    pub(super) sign: f64,
}

impl Shear {
    pub(super) fn new(direction: DVec3) -> Self {
        let axes = axes_of(direction);
        let [x, y, z] = axes.map(|axis| direction[axis]);
        Self {
            axes,
            shear: [x / z, y / z],
            sign: z.signum(),
        }
    }

    /// The point of a vertex, as seen from the origin of the ray: off by four roundings of its terms.
    pub(super) fn point(&self, vertex: DVec3) -> Point {
        let along = vertex[self.axes[2]];
        [0, 1].map(|i| {
            let (own, moved) = (vertex[self.axes[i]], self.shear[i] * along);
            Bounded {
                value: own - moved,
                bound: gamma(4.0) * (own.abs() + moved.abs()),
            }
        })
    }

    /// p × q.
    pub(super) fn side(&self, p: Point, q: Point) -> Side {
        let moved = |a: Bounded, b: Bounded| {
            a.value.abs() * b.bound + b.value.abs() * a.bound + a.bound * b.bound
        };
        let (left, right) = (p[0].value * q[1].value, p[1].value * q[0].value);
        Side {
            value: left - right,
            moved: moved(p[0], q[1]) + moved(p[1], q[0]),
            rounded: gamma(2.0) * (left.abs() + right.abs()),
        }
    }
}

/// The axes in cyclic order, the largest of a direction last; of equal ones, the first.
pub(super) fn axes_of(direction: DVec3) -> [usize; 3] {
    let size = direction.abs();
    if size.x >= size.y && size.x >= size.z {
        [1, 2, 0]
    } else if size.y >= size.z {
        [2, 0, 1]
    } else {
        [0, 1, 2]
    }
}
