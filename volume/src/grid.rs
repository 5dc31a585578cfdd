//! A scalar field on a regular grid.
//!
//! Voxel values sit at integer positions of index space; world = index · spacing on each axis, so
//! that the domain is the closed box from 0 to (dims − 1) · spacing. Values in memory are those of
//! the file, of the narrowest type that holds them; `value = raw · slope + intercept`. Signed
//! integers are kept as unsigned ones with an offset in the intercept, which keeps their order and
//! halves the number of kernels.
//!
//! Invariants: every size is at least 1 and their product is the number of voxels; spacings are
//! positive and finite; the slope is finite and not 0; the range is that of all finite voxels, and
//! empty (0..0) if there is none; values at its ends are finite.

use glam::Vec3;

use crate::voxels::PADDING;
pub use crate::voxels::{VoxelSlice, Voxels};

/// How raw values become values: `value = raw · slope + intercept`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ValueScale {
    /// Not 0. A negative slope reverses the order.
    pub slope: f32,
    /// The value of raw 0.
    pub intercept: f32,
}

impl Default for ValueScale {
    fn default() -> Self {
        Self {
            slope: 1.0,
            intercept: 0.0,
        }
    }
}

/// Where the grid lies in the space of the patient or the experiment, as the file says. Rendering
/// takes place in the space of the grid; this is for those who place several things together.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Orientation {
    /// Direction of each index axis, unit vectors.
    pub axes: [Vec3; 3],
    /// Position of voxel (0, 0, 0).
    pub origin: Vec3,
}

impl Default for Orientation {
    fn default() -> Self {
        Self {
            axes: [Vec3::X, Vec3::Y, Vec3::Z],
            origin: Vec3::ZERO,
        }
    }
}

/// Why numbers do not describe a grid.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum GridError {
    /// A size is 0.
    #[error("a grid of {dims:?} voxels has none")]
    Empty {
        /// The sizes.
        dims: [usize; 3],
    },
    /// The sizes call for another number of voxels.
    #[error("a grid of {dims:?} voxels is given {given}")]
    VoxelCount {
        /// The sizes.
        dims: [usize; 3],
        /// The number of voxels.
        given: usize,
    },
    /// A spacing is not positive and finite.
    #[error("spacing is {spacing:?}: it must be positive and finite on every axis")]
    Spacing {
        /// The spacings.
        spacing: [f32; 3],
    },
    /// The slope is 0, or slope or intercept is not finite.
    #[error("slope {:?} and intercept {:?}: both must be finite, and the slope not 0", scale.slope, scale.intercept)]
    ValueScale {
        /// What was given.
        scale: ValueScale,
    },
    /// Slope and intercept lead out of single precision.
    #[error("values from {:?} to {:?}: they must be finite", range[0], range[1])]
    ValueRange {
        /// The smallest and the largest value.
        range: [f32; 2],
    },
}

/// A scalar field on a regular grid.
#[derive(Clone, Debug, PartialEq)]
pub struct Volume {
    dims: [usize; 3],
    spacing: [f32; 3],
    voxels: Voxels,
    scale: ValueScale,
    orientation: Orientation,
    raw_range: [f32; 2],
    missing: usize,
    clamped: usize,
}

impl Volume {
    /// A grid of `dims` voxels, `spacing` apart in world units. NaN means that a value is missing:
    /// what touches such a voxel is transparent. Infinite values become the largest or smallest
    /// finite one.
    ///
    /// # Errors
    /// [`GridError`] if the numbers do not fit together.
    pub fn new(
        dims: [usize; 3],
        spacing: [f32; 3],
        mut voxels: Voxels,
        scale: ValueScale,
    ) -> Result<Self, GridError> {
        if dims.contains(&0) {
            return Err(GridError::Empty { dims });
        }
        let count = dims[0]
            .checked_mul(dims[1])
            .and_then(|n| n.checked_mul(dims[2]));
        if count != Some(voxels.len()) {
            return Err(GridError::VoxelCount {
                dims,
                given: voxels.len(),
            });
        }
        if !spacing.iter().all(|s| *s > 0.0 && s.is_finite()) {
            return Err(GridError::Spacing { spacing });
        }
        if scale.slope == 0.0 || !scale.slope.is_finite() || !scale.intercept.is_finite() {
            return Err(GridError::ValueScale { scale });
        }
        let (mut missing, mut clamped) = (0, 0);
        if let Voxels::F32(values) = &mut voxels {
            [missing, clamped] = make_finite(values);
        }
        let raw_range = voxels.range().unwrap_or([0.0; 2]);
        voxels.pad();
        let volume = Self {
            dims,
            spacing,
            voxels,
            scale,
            orientation: Orientation::default(),
            raw_range,
            missing,
            clamped,
        };
        let range = volume.range();
        if !range.iter().all(|value| value.is_finite()) {
            return Err(GridError::ValueRange { range });
        }
        Ok(volume)
    }

    /// The same grid, placed in the space of its file.
    #[must_use]
    pub fn with_orientation(self, orientation: Orientation) -> Self {
        Self {
            orientation,
            ..self
        }
    }

    /// Voxels along x, y, z.
    #[must_use]
    pub fn dims(&self) -> [usize; 3] {
        self.dims
    }

    /// Distance between voxels along x, y, z, world units.
    #[must_use]
    pub fn spacing(&self) -> [f32; 3] {
        self.spacing
    }

    /// The smallest spacing: opacities are per this length, and steps in units of it.
    #[must_use]
    pub fn unit_length(&self) -> f32 {
        self.spacing.into_iter().fold(f32::INFINITY, f32::min)
    }

    /// The corner of the domain opposite to the origin, world units.
    #[must_use]
    pub fn extent(&self) -> Vec3 {
        Vec3::from_array(std::array::from_fn(|axis| {
            (self.dims[axis] - 1) as f32 * self.spacing[axis]
        }))
    }

    /// The raw value of a voxel by its place, x fastest.
    ///
    /// # Panics
    /// If there is no such place.
    #[must_use]
    pub fn raw(&self, index: usize) -> f32 {
        assert!(index < self.len(), "no such voxel");
        self.voxels().get(index)
    }

    /// How many voxels there are; at least one.
    #[must_use]
    #[expect(clippy::len_without_is_empty, reason = "there is always one")]
    pub fn len(&self) -> usize {
        self.voxels.len() - PADDING
    }

    /// The raw values, x fastest, and [`PADDING`] more, so that whoever reads a voxel may read on.
    pub(crate) fn padded(&self) -> &Voxels {
        &self.voxels
    }

    /// The raw values, x fastest.
    #[must_use]
    pub fn voxels(&self) -> VoxelSlice<'_> {
        self.voxels.slice(self.len())
    }

    /// How raw values become values.
    #[must_use]
    pub fn scale(&self) -> ValueScale {
        self.scale
    }

    /// Where the file places the grid.
    #[must_use]
    pub fn orientation(&self) -> Orientation {
        self.orientation
    }

    /// The smallest and largest raw value.
    #[must_use]
    pub fn raw_range(&self) -> [f32; 2] {
        self.raw_range
    }

    /// The smallest and largest value.
    #[must_use]
    pub fn range(&self) -> [f32; 2] {
        let [a, b] = self.raw_range.map(|raw| self.value_of(raw));
        [a.min(b), a.max(b)]
    }

    /// The value of a raw one.
    #[must_use]
    pub fn value_of(&self, raw: f32) -> f32 {
        raw * self.scale.slope + self.scale.intercept
    }

    /// The value of a voxel.
    ///
    /// # Panics
    /// If there is no such voxel.
    #[must_use]
    pub fn value(&self, [x, y, z]: [usize; 3]) -> f32 {
        let [width, height, depth] = self.dims;
        assert!(x < width && y < height && z < depth, "no such voxel");
        self.value_of(self.raw((z * height + y) * width + x))
    }

    /// How many voxels have no value.
    #[must_use]
    pub fn missing(&self) -> usize {
        self.missing
    }

    /// How many voxels were infinite in the source.
    #[must_use]
    pub fn clamped(&self) -> usize {
        self.clamped
    }
}

/// Replaces infinite values by the largest and smallest finite ones, and every NaN by the same
/// one; returns the numbers of NaN and of infinite values.
fn make_finite(values: &mut [f32]) -> [usize; 2] {
    let (mut low, mut high) = (f32::INFINITY, f32::NEG_INFINITY);
    let [mut missing, mut infinite] = [0, 0];
    for &value in values.iter() {
        if value.is_finite() {
            (low, high) = (low.min(value), high.max(value));
        } else if value.is_nan() {
            missing += 1;
        } else {
            infinite += 1;
        }
    }
    if missing + infinite > 0 {
        let [low, high] = if low <= high { [low, high] } else { [0.0, 0.0] };
        for value in values {
            // clamp() keeps NaN.
            *value = if value.is_nan() {
                f32::NAN
            } else {
                value.clamp(low, high)
            };
        }
    }
    [missing, infinite]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn volume(values: Vec<f32>, slope: f32) -> Volume {
        let scale = ValueScale {
            slope,
            intercept: 1.0,
        };
        Volume::new(
            [values.len(), 1, 1],
            [2.0, 1.0, 1.0],
            Voxels::F32(values),
            scale,
        )
        .unwrap()
    }

    #[test]
    fn a_negative_slope_reverses_the_range() {
        let volume = volume(vec![1.0, 3.0, 2.0], -2.0);
        assert_eq!(volume.raw_range(), [1.0, 3.0]);
        assert_eq!(volume.range(), [-5.0, -1.0]);
        assert_eq!(volume.value([1, 0, 0]), -5.0);
        assert_eq!(volume.extent(), Vec3::new(4.0, 0.0, 0.0));
    }

    #[test]
    fn what_is_not_finite_is_counted_and_kept_out_of_the_range() {
        let volume = volume(
            vec![f32::NAN, 2.0, f32::INFINITY, 5.0, f32::NEG_INFINITY],
            1.0,
        );
        assert_eq!((volume.missing(), volume.clamped()), (1, 2));
        assert_eq!(volume.raw_range(), [2.0, 5.0]);
        assert_eq!([2, 4].map(|x| volume.value([x, 0, 0])), [6.0, 3.0]);
        assert!(volume.value([0, 0, 0]).is_nan());
    }

    #[test]
    fn a_volume_without_any_value() {
        let volume = volume(vec![f32::NAN, f32::INFINITY], 1.0);
        assert_eq!((volume.missing(), volume.clamped()), (1, 1));
        assert_eq!(volume.raw_range(), [0.0, 0.0]);
    }

    #[test]
    fn values_that_single_precision_cannot_hold() {
        let scale = ValueScale {
            slope: 1e38,
            intercept: 0.0,
        };
        let result = Volume::new([2, 1, 1], [1.0; 3], Voxels::U8(vec![0, 9]), scale);
        assert!(matches!(result, Err(GridError::ValueRange { .. })));
    }

    #[test]
    fn numbers_that_do_not_fit_together() {
        let new = |dims, spacing, slope| {
            let scale = ValueScale {
                slope,
                intercept: 0.0,
            };
            Volume::new(dims, spacing, Voxels::U8(vec![0; 6]), scale).map(|_| ())
        };
        let unit = [1.0; 3];
        assert_eq!(new([1, 2, 3], unit, 1.0), Ok(()));
        assert!(matches!(
            new([0, 2, 3], unit, 1.0),
            Err(GridError::Empty { .. })
        ));
        assert!(matches!(
            new([2, 2, 3], unit, 1.0),
            Err(GridError::VoxelCount { given: 6, .. })
        ));
        let huge = [usize::MAX, 2, 3];
        assert!(matches!(
            new(huge, unit, 1.0),
            Err(GridError::VoxelCount { .. })
        ));
        for spacing in [0.0, -1.0, f32::NAN, f32::INFINITY] {
            let result = new([1, 2, 3], [1.0, spacing, 1.0], 1.0);
            assert!(
                matches!(result, Err(GridError::Spacing { .. })),
                "{spacing}"
            );
        }
        for slope in [0.0, f32::NAN, f32::INFINITY] {
            let result = new([1, 2, 3], unit, slope);
            assert!(
                matches!(result, Err(GridError::ValueScale { .. })),
                "{slope}"
            );
        }
    }
}
