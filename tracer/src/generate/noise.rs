//! Numbers that look random and are the same everywhere.
//!
//! The hash is the finaliser of SplitMix64 (Steele, Lea, Flood, "Fast splittable pseudorandom
//! number generators", 2014). Value noise: a hash at each lattice point, blended by smoothstep.
//! Only additions and multiplications of `f32`, which every machine rounds alike.

/// Mixes a 64-bit number well.
fn mix(mut z: u64) -> u64 {
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

/// In 0..1, from 24 bits.
fn unit(bits: u64) -> f32 {
    (bits >> 40) as f32 / (1 << 24) as f32
}

/// A number in 0..1 for each lattice point and seed.
pub(super) fn at_lattice(seed: u64, [x, y, z]: [i32; 3]) -> f32 {
    let mut hash = mix(seed.wrapping_add(0x9e37_79b9_7f4a_7c15));
    for coordinate in [x, y, z] {
        hash = mix(hash ^ u64::from(coordinate as u32));
    }
    unit(hash)
}

/// Smooth noise in 0..1; features have the size of one unit.
pub(super) fn value_noise(seed: u64, point: [f32; 3]) -> f32 {
    let cell = point.map(|c| c.floor() as i32);
    let weight: [f32; 3] = std::array::from_fn(|axis| {
        let t = point[axis] - point[axis].floor();
        t * t * (3.0 - 2.0 * t)
    });
    let mut sum = 0.0;
    for corner in 0..8 {
        let step: [i32; 3] = std::array::from_fn(|axis| corner >> axis & 1);
        let share: f32 = (0..3)
            .map(|axis| [1.0 - weight[axis], weight[axis]][step[axis] as usize])
            .product();
        let place = std::array::from_fn(|axis| cell[axis].wrapping_add(step[axis]));
        sum += share * at_lattice(seed, place);
    }
    sum
}

/// A stream of numbers.
#[derive(Clone, Debug)]
pub(super) struct Random {
    state: u64,
}

impl Random {
    pub(super) fn new(seed: u64) -> Self {
        Self { state: seed }
    }

    /// The next number in `low..high`.
    pub(super) fn between(&mut self, low: f32, high: f32) -> f32 {
        self.state = self.state.wrapping_add(0x9e37_79b9_7f4a_7c15);
        low + (high - low) * unit(mix(self.state))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// First outputs of the reference implementation for seed 1234567.
    #[test]
    fn the_stream_is_splitmix64() {
        let first = 6_457_827_717_110_365_317_u64;
        assert_eq!(Random::new(1_234_567).between(0.0, 1.0), unit(first));
    }

    #[test]
    fn noise_meets_the_lattice_values_and_stays_between() {
        for place in [[0, 0, 0], [-3, 5, 7], [100, -1, 2]] {
            let noise = value_noise(1, place.map(|c| c as f32));
            assert_eq!(noise, at_lattice(1, place));
        }
        let samples = (0..1000).map(|i| value_noise(2, [i as f32 * 0.37, 0.5, i as f32 * 0.11]));
        let (mut low, mut high) = (1.0_f32, 0.0_f32);
        samples.for_each(|s| (low, high) = (low.min(s), high.max(s)));
        assert!(
            low >= 0.0 && high <= 1.0 && high - low > 0.5,
            "{low} {high}"
        );
    }
}
