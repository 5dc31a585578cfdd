//! Whether this processor's reciprocal estimate is the one that the golden trees were made with.
//!
//! Embree takes the scale of Morton codes from `rcpps`, whose twelve good bits are the maker's
//! choice, and one Newton step; the last bit of the scale can move a primitive into another cell.

/// The hash of the estimates below, taken on an AMD EPYC (Zen 4), where the files were made.
#[cfg(target_arch = "x86_64")]
const GOLDEN: u64 = 0x1501_1f5b_e66f_b335;

/// Whether lines marked `rcp` can be compared on this processor. False where there is no such
/// instruction.
#[must_use]
pub fn has_golden_reciprocal() -> bool {
    #[cfg(target_arch = "x86_64")]
    return fingerprint() == GOLDEN;
    #[cfg(not(target_arch = "x86_64"))]
    false
}

/// A hash of the estimate at 8192 points of 16 binades, some within each of the intervals over which
/// a table with twelve bits is constant or linear.
#[cfg(target_arch = "x86_64")]
fn fingerprint() -> u64 {
    super::Fnv::of_words(points().map(|x| estimate(x).to_bits()))
}

#[cfg(target_arch = "x86_64")]
fn points() -> impl Iterator<Item = f32> {
    (0..8192_u32).map(|i| f32::from_bits(((120 + i % 16) << 23) | (i << 10) | (i % 1024)))
}

/// `rcpps` without `unsafe`: what `wide` makes of this on x86.
#[cfg(target_arch = "x86_64")]
fn estimate(x: f32) -> f32 {
    wide::f32x4::splat(x).recip().to_array()[0]
}

#[cfg(all(test, target_arch = "x86_64"))]
mod tests {
    use super::*;

    /// Were `wide` to divide instead, the fingerprint would say nothing about the processor.
    #[test]
    fn the_estimate_is_near_the_reciprocal_and_is_not_a_division() {
        let error = |x: f32| (f64::from(estimate(x)) * f64::from(x) - 1.0).abs();
        let largest = points().map(error).fold(0.0, f64::max);
        assert!(largest < 1.5 / 4096.0, "{largest}");
        assert!(points().any(|x| estimate(x) != x.recip()));
    }
}
