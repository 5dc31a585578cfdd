//! Independent uniform numbers, addressed instead of drawn.
//!
//! Idea: the number of a given seed, pixel, sample and dimension is a pure function of these four.
//! There is no state to advance, so that threads, tiles, order of work, and features that are
//! switched off cannot change any number of any other place.
//!
//! Source: SplitMix64 (Steele, Lea, Flood: Fast splittable pseudorandom number generators, 2014).
//! Its state is a counter with an odd step, the golden gamma, so that the n-th output of a stream
//! is `mix64(key + n·gamma)`, at random access. The mixing function has the constants of
//! Stafford's variant 13. The key of a stream is a chain of the same function over seed, pixel and
//! sample.
//!
//! Invariants: values lie in [0, 1), multiples of 2^-24. Two streams can overlap only when their
//! keys differ by a small multiple of the gamma, which is as rare as for keys drawn at random.
//!
//! Not good for: fast convergence. The numbers are as uneven as random ones are; a low-discrepancy
//! sequence has less variance.

/// Step of the counter: 2^64 divided by the golden ratio, made odd.
const GOLDEN_GAMMA: u64 = 0x9e37_79b9_7f4a_7c15;

/// Spreads sample indices over the 64 bits of the key before they are mixed. Odd, so that no two
/// indices of a pixel meet; the multiplier of PCG64, which has no simple relation to the gamma.
const SAMPLE_STEP: u64 = 0x5851_f42d_4c95_7f2d;

/// The fixed plan of dimensions: which number of a path decides what.
///
/// Two dimensions for the point in the pixel, two for the lens, one for the time, then
/// [`dimension::PER_EVENT`] for every scattering event. A feature that is switched off leaves its
/// dimensions unread, so that every other decision stays the same.
pub mod dimension {
    /// Point in the pixel, two dimensions.
    pub const FILM: u32 = 0;
    /// Point on the lens, two dimensions.
    pub const LENS: u32 = 2;
    /// Time within the shutter interval.
    pub const TIME: u32 = 4;
    /// First dimension of the first scattering event.
    pub const EVENTS: u32 = 5;
    /// Dimensions of one scattering event.
    pub const PER_EVENT: u32 = 8;

    /// Offset within an event: choice of the light.
    pub const LIGHT_CHOICE: u32 = 0;
    /// Offset within an event: point on the light, two dimensions.
    pub const LIGHT_UV: u32 = 1;
    /// Offset within an event: choice of the lobe of the BSDF.
    pub const LOBE: u32 = 3;
    /// Offset within an event: direction of the BSDF, two dimensions.
    pub const BSDF_UV: u32 = 4;
    /// Offset within an event: Russian roulette.
    pub const ROULETTE: u32 = 6;
    /// Offset within an event: in reserve, for alpha tests and the like.
    pub const SPARE: u32 = 7;

    /// First dimension of scattering event `k`, counted from 0. The plan repeats after 2^29
    /// events, far beyond any path.
    #[inline]
    pub const fn event(k: u32) -> u32 {
        EVENTS.wrapping_add(PER_EVENT.wrapping_mul(k))
    }
}

/// The numbers of one sample of one pixel.
///
/// ```
/// use raywright_imaging::sampler::{dimension, PixelSampler};
///
/// let sampler = PixelSampler::new(7, 12, 34, 0);
/// let [dx, dy] = sampler.uniform_2d(dimension::FILM);
/// assert!((0.0..1.0).contains(&dx) && (0.0..1.0).contains(&dy));
/// // The same address gives the same number, in any order.
/// assert_eq!(dy, PixelSampler::new(7, 12, 34, 0).uniform(dimension::FILM + 1));
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PixelSampler {
    key: u64,
}

impl PixelSampler {
    /// The numbers of sample `sample` of pixel (`x`, `y`) in the picture of seed `seed`.
    #[inline]
    pub fn new(seed: u64, x: u32, y: u32, sample: u32) -> PixelSampler {
        let pixel = u64::from(x) | (u64::from(y) << 32);
        let of_seed = mix64(seed.wrapping_add(GOLDEN_GAMMA));
        let of_pixel = mix64(of_seed ^ pixel);
        let of_sample = u64::from(sample).wrapping_mul(SAMPLE_STEP);
        PixelSampler {
            key: mix64(of_pixel.wrapping_add(of_sample)),
        }
    }

    /// The number of `dimension`, uniform in [0, 1).
    #[inline]
    pub fn uniform(&self, dimension: u32) -> f32 {
        unit_f32(splitmix64(self.key, u64::from(dimension)))
    }

    /// The numbers of `dimension` and `dimension + 1`.
    #[inline]
    pub fn uniform_2d(&self, dimension: u32) -> [f32; 2] {
        let first = u64::from(dimension);
        [first, first + 1].map(|index| unit_f32(splitmix64(self.key, index)))
    }
}

/// Output `index`, counted from 0, of the SplitMix64 stream that starts at `key`.
#[inline]
fn splitmix64(key: u64, index: u64) -> u64 {
    mix64(key.wrapping_add(GOLDEN_GAMMA.wrapping_mul(index + 1)))
}

/// Output function of SplitMix64: a bijection in which every bit of the input reaches every bit of
/// the output.
#[inline]
fn mix64(mut z: u64) -> u64 {
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

/// The 24 highest bits as a fraction: as many as f32 holds, so that nothing rounds up to 1.
#[inline]
fn unit_f32(bits: u64) -> f32 {
    const UNIT: f32 = 1.0 / (1 << 24) as f32;
    (bits >> 40) as f32 * UNIT
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stream_is_that_of_the_reference_implementation() {
        // First outputs of the C code of Vigna for the state 1234567.
        let golden = [
            6_457_827_717_110_365_317,
            3_203_168_211_198_807_973,
            9_817_491_932_198_370_423,
            4_593_380_528_125_082_431,
            16_408_922_859_458_223_821,
        ];
        for (index, expected) in golden.into_iter().enumerate() {
            assert_eq!(splitmix64(1_234_567, index as u64), expected);
        }
    }

    #[test]
    fn golden_values() {
        // ((seed, x, y, sample), numerators over 2^24 of the dimensions 0, 1, 2 and 2^32 − 1),
        // from an independent program. A change of any of them changes every picture.
        let most = u32::MAX;
        let golden = [
            ((0, 0, 0, 0), [2_942_985, 7_939_244, 10_972_381, 3_740_649]),
            ((0, 1, 0, 0), [7_001_599, 9_374_246, 8_265_769, 8_230_759]),
            (
                (0, 0, 1, 0),
                [7_453_569, 13_844_982, 12_754_971, 14_425_149],
            ),
            ((0, 0, 0, 1), [15_379_498, 4_048_258, 3_935_058, 3_694_440]),
            ((1, 0, 0, 0), [6_244_118, 5_955_081, 6_163_188, 9_267_569]),
            (
                (u64::MAX, most, most, most),
                [15_242_581, 12_606_909, 1_842_619, 2_989_286],
            ),
        ];
        for ((seed, x, y, sample), numerators) in golden {
            let sampler = PixelSampler::new(seed, x, y, sample);
            for (dimension, numerator) in [0, 1, 2, most].into_iter().zip(numerators) {
                assert_eq!(sampler.uniform(dimension), numerator as f32 / 16_777_216.0);
            }
        }
    }

    #[test]
    fn two_dimensions_are_two_single_ones() {
        let sampler = PixelSampler::new(5, 6, 7, 8);
        for dimension in [0, 1, 17, u32::MAX - 1] {
            let single = [sampler.uniform(dimension), sampler.uniform(dimension + 1)];
            assert_eq!(sampler.uniform_2d(dimension), single);
        }
    }

    #[test]
    fn largest_bits_stay_below_one() {
        assert_eq!(unit_f32(u64::MAX), 1.0 - f32::EPSILON / 2.0);
        assert_eq!(unit_f32(0), 0.0);
    }

    #[test]
    fn no_two_samples_of_a_picture_share_a_key() {
        let mut keys: Vec<u64> = (0..1 << 20)
            .map(|i| PixelSampler::new(3, i % 32, i / 32 % 32, i / 1024).key)
            .collect();
        keys.sort_unstable();
        keys.dedup();
        assert_eq!(keys.len(), 1 << 20);
    }

    #[test]
    fn dimensions_of_events_do_not_overlap() {
        use dimension::*;
        let mut plan = vec![FILM, FILM + 1, LENS, LENS + 1, TIME];
        for k in 0..3 {
            let uv = [LIGHT_UV, LIGHT_UV + 1, BSDF_UV, BSDF_UV + 1];
            let offsets = [LIGHT_CHOICE, LOBE, ROULETTE, SPARE].into_iter().chain(uv);
            plan.extend(offsets.map(|offset| event(k) + offset));
        }
        plan.sort_unstable();
        assert_eq!(plan, (0..29).collect::<Vec<u32>>());
    }
}
