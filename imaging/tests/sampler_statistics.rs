//! Are addressed numbers as good as drawn ones, along every axis of the address?
//!
//! Each family walks along one axis, or diagonally through two, and must look like independent
//! uniform numbers. Limits are five standard deviations of the statistic under that hypothesis;
//! nothing is drawn at random here, so that a test that passes always passes.

use raywright_imaging::PixelSampler;

const COUNT: u32 = 1 << 18;
const SIGMAS: f64 = 5.0;

/// (name, value number i of the family).
type Family = (&'static str, fn(u32) -> f32);

fn at(seed: u64, x: u32, y: u32, sample: u32, dimension: u32) -> f32 {
    PixelSampler::new(seed, x, y, sample).uniform(dimension)
}

const FAMILIES: [Family; 14] = [
    ("dimensions", |i| at(1, 2, 3, 4, i)),
    ("columns", |i| at(1, i, 3, 4, 0)),
    ("rows", |i| at(1, 2, i, 4, 0)),
    ("samples", |i| at(1, 2, 3, i, 0)),
    ("seeds", |i| at(u64::from(i), 2, 3, 4, 0)),
    ("pixels, row by row", |i| at(1, i % 512, i / 512, 0, 0)),
    ("film of all samples of a few pixels", |i| {
        at(1, i / 2048, 0, i / 2 % 1024, i % 2)
    }),
    ("columns by 2^10", |i| at(1, i << 10, 3, 4, 0)),
    ("seeds by 2^40", |i| at(u64::from(i) << 40, 2, 3, 4, 0)),
    ("columns and rows", |i| at(1, i, i, 4, 0)),
    ("columns against samples", |i| at(1, i, 3, COUNT - i, 0)),
    ("samples against dimensions", |i| at(1, 2, 3, i, COUNT - i)),
    ("seeds against columns", |i| {
        at(u64::from(i), COUNT - i, 3, 4, 0)
    }),
    ("dimensions of the highest sample", |i| {
        at(u64::MAX, u32::MAX, u32::MAX, u32::MAX, i)
    }),
];

fn assert_normal(name: &str, statistic: &str, z: f64) {
    assert!(
        z.abs() < SIGMAS,
        "{name}: {statistic} is {z:.2} standard deviations off"
    );
}

/// Pearson's statistic for equal cells, as a number of standard deviations from its mean.
fn chi_square(cells: &[u32]) -> f64 {
    let expected = cells.iter().sum::<u32>() as f64 / cells.len() as f64;
    let sum: f64 = cells
        .iter()
        .map(|&n| (f64::from(n) - expected).powi(2) / expected)
        .sum();
    let freedom = (cells.len() - 1) as f64;
    (sum - freedom) / (2.0 * freedom).sqrt()
}

#[test]
fn mean_and_variance() {
    let n = f64::from(COUNT);
    for (name, value) in FAMILIES {
        let (mut sum, mut squares) = (0.0, 0.0);
        for i in 0..COUNT {
            let deviation = f64::from(value(i)) - 0.5;
            sum += deviation;
            squares += deviation * deviation;
        }
        assert_normal(name, "mean", sum / n * (12.0 * n).sqrt());
        // The square of a uniform deviation has mean 1/12 and variance 1/80 − 1/144 = 1/180.
        assert_normal(
            name,
            "variance",
            (squares / n - 1.0 / 12.0) * (180.0 * n).sqrt(),
        );
    }
}

#[test]
fn chi_square_of_single_values() {
    for (name, value) in FAMILIES {
        let mut cells = [0u32; 256];
        (0..COUNT).for_each(|i| cells[(value(i) * 256.0) as usize] += 1);
        assert_normal(name, "chi-square", chi_square(&cells));
    }
}

#[test]
fn chi_square_of_the_low_bits() {
    for (name, value) in FAMILIES {
        let mut cells = [0u32; 256];
        (0..COUNT).for_each(|i| cells[((value(i) * 65536.0).fract() * 256.0) as usize] += 1);
        assert_normal(name, "chi-square of the low 8 bits", chi_square(&cells));
    }
}

#[test]
fn chi_square_of_neighbours() {
    for (name, value) in FAMILIES {
        for lag in [1, 2, 8] {
            let mut cells = [0u32; 32 * 32];
            for i in 0..COUNT - lag {
                let [a, b] = [i, i + lag].map(|i| (value(i) * 32.0) as usize);
                cells[a * 32 + b] += 1;
            }
            assert_normal(name, "chi-square of pairs", chi_square(&cells));
        }
    }
}

#[test]
fn correlation_of_neighbours() {
    for (name, value) in FAMILIES {
        for lag in [1, 2, 8, 512] {
            let products = (0..COUNT - lag)
                .map(|i| (f64::from(value(i)) - 0.5) * (f64::from(value(i + lag)) - 0.5));
            // The product of two independent deviations has variance 1/144.
            let z = products.sum::<f64>() * 12.0 / f64::from(COUNT - lag).sqrt();
            assert_normal(name, "correlation", z);
        }
    }
}

/// Strongest test of the key: each bit of the address decides each bit of the number.
#[test]
fn every_bit_of_the_address_flips_half_of_the_number() {
    const TRIALS: u32 = 4096;
    const ADDRESS_BITS: u32 = 64 + 4 * 32;
    let number = |address: [u64; 3]| {
        let half = |word: u64, shift: u32| (word >> shift) as u32;
        let [seed, pixel, rest] = address;
        let value = at(
            seed,
            half(pixel, 0),
            half(pixel, 32),
            half(rest, 0),
            half(rest, 32),
        );
        (value * 16_777_216.0) as u32
    };
    for bit in 0..ADDRESS_BITS {
        let mut flips = [0u32; 24];
        for trial in 0..TRIALS {
            let t = u64::from(trial);
            let address = [t, (t % 64) | ((t / 64) << 32), (t % 16) | ((t % 5) << 32)];
            let mut flipped = address;
            flipped[bit as usize / 64] ^= 1 << (bit % 64);
            let changed = number(address) ^ number(flipped);
            (0..24).for_each(|k| flips[k] += changed >> k & 1);
        }
        for (k, count) in flips.into_iter().enumerate() {
            // Binomial with p = 1/2.
            let z = (f64::from(count) * 2.0 / f64::from(TRIALS) - 1.0) * f64::from(TRIALS).sqrt();
            // 4608 statistics are looked at: five sigmas are passed by chance with 0.3 %.
            assert!(
                z.abs() < SIGMAS,
                "address bit {bit}, number bit {k}: z = {z:.2}"
            );
        }
    }
}

#[test]
fn values_lie_below_one() {
    for (name, value) in FAMILIES {
        let outside = (0..COUNT)
            .map(value)
            .find(|value| !(0.0..1.0).contains(value));
        assert_eq!(outside, None, "{name}");
    }
}
