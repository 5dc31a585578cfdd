//! The order of the references along a Morton curve of 63 bits.

use super::super::{control::BuildControl, curve, primitive::PrimitiveRef, radix, tasks};
use crate::error::BuildError;

/// Bits of a Morton code per axis.
const AXIS_BITS: u32 = 21;

/// How many leading bits of a code are sorted by in passes over all.
const LEADING_BITS: u32 = 44;

/// A place on the Morton curve.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Place {
    code: u64,
    /// Index of the reference.
    pub(super) index: u32,
}

/// Sorts by the codes, equal ones by the index: by their leading bits in few passes over memory,
/// and where those are equal, which is rare, by comparison.
pub(super) fn sort(
    places: &mut [Place],
    scratch: &mut Vec<Place>,
    control: &BuildControl,
) -> Result<(), BuildError> {
    const LOW_BIT: u32 = 3 * AXIS_BITS - LEADING_BITS;
    let key = |place: &Place| place.code;
    radix::sort(places, scratch, LOW_BIT, 3 * AXIS_BITS, key, control)?;
    for run in places.chunk_by_mut(|a, b| a.code >> LOW_BIT == b.code >> LOW_BIT) {
        if run.len() > 1 {
            run.sort_unstable_by_key(|place| (place.code, place.index));
        }
    }
    Ok(())
}

/// Fills in the place of each reference by its centroid, in a grid of cubes.
pub(super) fn encode(
    references: &[PrimitiveRef],
    places: &mut Vec<Place>,
    control: &BuildControl,
) -> Result<(), BuildError> {
    let centroids = curve::centroid_bounds(references, PrimitiveRef::doubled_centroid);
    let lower = centroids.lower().to_array();
    let [x, y, z, _] = centroids.extent().to_array();
    let largest = x.max(y).max(z);
    const CELLS: f32 = (1 << AXIS_BITS) as f32;
    let scale = if largest > 0.0 { CELLS / largest } else { 0.0 };
    places.resize(references.len(), Place::default());
    tasks::try_for_each_piece_from(0, places, &|begin, places: &mut [Place]| {
        control.check()?;
        let references = &references[begin..][..places.len()];
        for ((index, place), reference) in (begin as u32..).zip(places).zip(references) {
            let code = |axis: usize| {
                let cell = (reference.doubled_centroid_on(axis) - lower[axis]) * scale;
                // A conversion of a float saturates and makes 0 of what is not a number.
                curve::spread_bits((cell as u32).min((1 << AXIS_BITS) - 1))
            };
            *place = Place {
                code: code(0) | code(1) << 1 | code(2) << 2,
                index,
            };
        }
        Ok(())
    })
}
