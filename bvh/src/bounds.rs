//! Axis-aligned boxes.

use glam::Vec3;

/// An axis-aligned box; empty if `min > max` on any axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Aabb {
    /// The smallest coordinates.
    pub min: Vec3,
    /// The largest coordinates.
    pub max: Vec3,
}

impl Aabb {
    /// The box of nothing: union with it changes nothing.
    pub const EMPTY: Self = Self {
        min: Vec3::INFINITY,
        max: Vec3::NEG_INFINITY,
    };

    /// The smallest box that holds both.
    #[must_use]
    pub fn union(self, other: Self) -> Self {
        Self {
            min: self.min.min(other.min),
            max: self.max.max(other.max),
        }
    }

    /// What both have in common; empty if that is nothing.
    #[must_use]
    pub fn intersection(self, other: Self) -> Self {
        Self {
            min: self.min.max(other.min),
            max: self.max.min(other.max),
        }
    }

    /// The smallest box that holds this one and a point.
    #[must_use]
    pub fn extended_by(self, point: Vec3) -> Self {
        Self {
            min: self.min.min(point),
            max: self.max.max(point),
        }
    }

    /// Whether it holds no point.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        !self.min.cmple(self.max).all()
    }

    /// Length of the diagonal; 0 for the empty box. Squares are taken in f64, where they cannot
    /// overflow.
    #[must_use]
    pub fn diagonal(&self) -> f32 {
        if self.is_empty() {
            0.0
        } else {
            self.min.as_dvec3().distance(self.max.as_dvec3()) as f32
        }
    }

    /// The middle.
    #[must_use]
    pub fn centre(&self) -> Vec3 {
        self.min * 0.5 + self.max * 0.5
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn empty_and_huge_boxes_have_a_diagonal() {
        assert_eq!(Aabb::EMPTY.diagonal(), 0.0);
        assert!(Aabb::EMPTY.is_empty());
        for length in [1e-30_f32, 1.0, 1e30] {
            let bounds = Aabb::EMPTY
                .extended_by(Vec3::ZERO)
                .extended_by(Vec3::new(length, 0.0, 0.0));
            assert_eq!(bounds.diagonal(), length);
        }
    }
}
