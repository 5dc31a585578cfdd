//! Random numbers for the estimate of early termination: three Tausworthe steps and a linear
//! congruential one. Howes, Thomas, *Efficient Random Number Generation and Application Using CUDA*,
//! GPU Gems 3, 2007, chapter 37.
//!
//! Invariant: the numbers of a ray depend on frame and ray alone. The state is made by splitmix64:
//! with the number of the ray itself as state, the first numbers of neighbours are nearly equal.

/// The generator of one ray.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct HybridTausworthe {
    state: [u32; 4],
}

/// A Tausworthe step needs a state above this.
const SMALLEST_STATE: u32 = 129;

impl HybridTausworthe {
    /// The generator of a ray in a frame.
    pub(crate) fn new(frame: u32, ray: u32) -> Self {
        let mut seed = u64::from(frame) << 32 | u64::from(ray);
        let mut state = [0; 4];
        for word in &mut state {
            *word = (split_mix(&mut seed) >> 32) as u32;
        }
        for word in &mut state[..3] {
            if *word < SMALLEST_STATE {
                *word += SMALLEST_STATE;
            }
        }
        Self { state }
    }

    fn next(&mut self) -> u32 {
        let [a, b, c, d] = &mut self.state;
        *a = step(*a, [13, 19, 12], 0xffff_fffe);
        *b = step(*b, [2, 25, 4], 0xffff_fff8);
        *c = step(*c, [3, 11, 17], 0xffff_fff0);
        *d = d.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        *a ^ *b ^ *c ^ *d
    }

    /// A number in 0..1.
    pub(crate) fn unit(&mut self) -> f32 {
        (self.next() >> 8) as f32 / (1 << 24) as f32
    }
}

fn step(z: u32, [first, second, third]: [u32; 3], mask: u32) -> u32 {
    let mixed = ((z << first) ^ z) >> second;
    (z & mask) << third ^ mixed
}

fn split_mix(state: &mut u64) -> u64 {
    *state = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let z = (*state ^ *state >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let z = (z ^ z >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ z >> 31
}

#[cfg(test)]
mod tests {
    use std::{fs, path::Path};

    use serde_json::Value;

    use super::*;

    #[test]
    fn the_golden_numbers() {
        let path = Path::new(env!("CARGO_MANIFEST_DIR"))
            .join("../../shared/data/volume-reference/tausworthe.json");
        let Ok(text) = fs::read_to_string(&path) else {
            println!("skipped: {} is not there", path.display());
            return;
        };
        let golden: Value = serde_json::from_str(&text).unwrap();
        let sequences = golden["sequences"].as_array().unwrap();
        assert!(sequences.len() >= 4);
        for sequence in sequences {
            let number = |name: &str| sequence[name].as_u64().map(|n| n as u32);
            let words = |name: &str| -> Vec<u32> {
                let words = sequence[name].as_array().unwrap().iter();
                words.map(|w| w.as_u64().unwrap() as u32).collect()
            };
            let state: [u32; 4] = words("state").try_into().unwrap();
            let mut generator = HybridTausworthe { state };
            if let (Some(frame), Some(ray)) = (number("frame"), number("ray")) {
                assert_eq!(HybridTausworthe::new(frame, ray), generator);
            }
            let mut twin = generator;
            for (word, unit) in words("u32")
                .iter()
                .zip(sequence["unit"].as_array().unwrap())
            {
                assert_eq!(generator.next(), *word, "{}", sequence["label"]);
                assert_eq!(f64::from(twin.unit()), unit.as_f64().unwrap());
            }
        }
    }

    #[test]
    fn neighbouring_rays_have_independent_numbers() {
        let first = |ray| f64::from(HybridTausworthe::new(3, ray).unit());
        let n = 20_000;
        let mean = (0..n).map(first).sum::<f64>() / f64::from(n);
        let product = |ray| (first(ray) - 0.5) * (first(ray + 1) - 0.5);
        let correlation = 12.0 * (0..n).map(product).sum::<f64>() / f64::from(n);
        assert!((mean - 0.5).abs() < 0.01, "{mean}");
        assert!(correlation.abs() < 0.03, "{correlation}");
    }
}
