//! Are two Monte Carlo pictures the same picture? Compares a mean and its standard error per
//! pixel with a reference's, by single values, by blocks and as a whole.
//!
//! Source: the statistical comparison of renderers of Subr, Arvo, *Statistical Hypothesis Testing
//! for Assessing Monte Carlo Estimators*, 2007, with the limits that were measured for the golden
//! pictures of the shared data (their README, section 5). A uniform bias shows in the whole, a
//! local one in the blocks, a wrong variance in the single values.

/// Side of a block in pixels.
const BLOCK: usize = 8;

/// A picture with known error: mean and standard error of the mean per pixel, row by row.
#[derive(Clone, Copy, Debug)]
pub struct Estimate<'a> {
    /// Mean of each pixel.
    pub mean: &'a [[f32; 3]],
    /// Standard error of that mean.
    pub standard_error: &'a [[f32; 3]],
}

/// What the comparison found.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct ZTest {
    /// A: mean of z over all values, and the largest magnitude that is accepted.
    pub mean: (f64, f64),
    /// B: standard deviation of z.
    pub deviation: f64,
    /// C: share of values with |z| > 3.
    pub share_above_3: f64,
    /// D: number of values with |z| > 5, and how many are accepted.
    pub above_5: (usize, usize),
    /// E: standard deviation, largest magnitude, and share above 3 of the blocks' z.
    pub blocks: (f64, f64, f64),
    /// How many blocks there are. Their channels are not independent and do not count.
    pub block_count: usize,
    /// F: z of the whole picture per channel.
    pub whole: [f64; 3],
    /// G: values without error on either side that differ.
    pub certain_differences: usize,
}

impl ZTest {
    /// Compares two pictures of the same size.
    ///
    /// # Panics
    /// If the sizes differ or `width` does not divide them.
    #[must_use]
    pub fn new(ours: Estimate<'_>, reference: Estimate<'_>, width: usize) -> Self {
        let sizes = [
            ours.standard_error.len(),
            reference.mean.len(),
            reference.standard_error.len(),
        ];
        assert!(
            sizes.iter().all(|&n| n == ours.mean.len()) && ours.mean.len().is_multiple_of(width)
        );
        let value = |pixel: usize, channel: usize| {
            let difference =
                f64::from(ours.mean[pixel][channel]) - f64::from(reference.mean[pixel][channel]);
            let error = f64::from(ours.standard_error[pixel][channel])
                .hypot(f64::from(reference.standard_error[pixel][channel]));
            (difference, error)
        };
        let pixels = ours.mean.len();
        let mut z = Vec::new();
        let mut uncertain_pixels = 0;
        let mut certain_differences = 0;
        for pixel in 0..pixels {
            let mut uncertain = false;
            for channel in 0..3 {
                let (difference, error) = value(pixel, channel);
                if error > 0.0 {
                    z.push(difference / error);
                    uncertain = true;
                } else {
                    let allowed = 1e-5 * f64::from(reference.mean[pixel][channel]).max(1e-3);
                    certain_differences +=
                        usize::from(difference.is_nan() || difference.abs() > allowed);
                }
            }
            uncertain_pixels += usize::from(uncertain);
        }
        let joint = |pixels: &mut dyn Iterator<Item = usize>, channel: usize| {
            let (mut difference, mut variance) = (0.0, 0.0);
            for pixel in pixels {
                let (d, e) = value(pixel, channel);
                difference += d;
                variance += e * e;
            }
            (variance > 0.0).then(|| difference / variance.sqrt())
        };
        let rows = pixels / width;
        let mut blocks = Vec::new();
        for y in (0..rows).step_by(BLOCK) {
            for x in (0..width).step_by(BLOCK) {
                let (x_end, y_end) = ((x + BLOCK).min(width), (y + BLOCK).min(rows));
                for channel in 0..3 {
                    let mut pixels =
                        (y..y_end).flat_map(|y| (x..x_end).map(move |x| y * width + x));
                    blocks.extend(joint(&mut pixels, channel));
                }
            }
        }
        let whole = std::array::from_fn(|channel| joint(&mut (0..pixels), channel).unwrap_or(0.0));
        let limit = 4.0 / (uncertain_pixels.max(1) as f64).sqrt();
        Self {
            mean: (mean(&z), limit),
            deviation: deviation(&z),
            share_above_3: share_above(&z, 3.0),
            above_5: (
                z.iter().filter(|z| z.abs() > 5.0).count(),
                ((z.len() as f64 * 3e-4) as usize).max(3),
            ),
            blocks: (
                deviation(&blocks),
                blocks.iter().fold(0.0, |most, z| most.max(z.abs())),
                share_above(&blocks, 3.0),
            ),
            block_count: width.div_ceil(BLOCK) * rows.div_ceil(BLOCK),
            whole,
            certain_differences,
        }
    }

    /// What speaks against the pictures being the same, by the tests that hold for any number of
    /// samples: blocks, whole, certain values.
    #[must_use]
    pub fn binding_faults(&self) -> Vec<String> {
        let mut faults = Vec::new();
        let (deviation, largest, share) = self.blocks;
        let mut check = |holds: bool, text: String| {
            if !holds {
                faults.push(text)
            }
        };
        // The deviation of n values is itself uncertain by 1/√(2n): a small picture has few blocks.
        let slack = 4.0 / (2.0 * self.block_count as f64).sqrt();
        let accepted = (1.0 - slack).min(0.85)..=(1.0 + slack).max(1.2);
        check(
            accepted.contains(&deviation),
            format!("E: deviation of blocks {deviation:.3}"),
        );
        check(largest <= 5.0, format!("E: largest block {largest:.2}"));
        // One block of a small picture may be above 3 by chance.
        check(
            share <= (1.0 / self.block_count as f64).max(0.015),
            format!("E: share of blocks above 3 is {share:.4}"),
        );
        check(
            self.whole.iter().all(|z| z.abs() <= 4.0),
            format!("F: whole picture {:.2?}", self.whole),
        );
        check(
            self.certain_differences == 0,
            format!("G: {} certain values differ", self.certain_differences),
        );
        faults
    }

    /// What speaks against it by the tests of single values, which hold only if ours has at least
    /// as many samples per batch as the reference.
    #[must_use]
    pub fn value_faults(&self) -> Vec<String> {
        let mut faults = Vec::new();
        let mut check = |holds: bool, text: String| {
            if !holds {
                faults.push(text)
            }
        };
        check(
            self.mean.0.abs() <= self.mean.1,
            format!("A: mean {:.4}, limit {:.4}", self.mean.0, self.mean.1),
        );
        check(
            (0.9..=1.12).contains(&self.deviation),
            format!("B: deviation {:.3}", self.deviation),
        );
        check(
            self.share_above_3 <= 0.012,
            format!("C: share above 3 is {:.4}", self.share_above_3),
        );
        check(
            self.above_5.0 <= self.above_5.1,
            format!("D: {} values above 5", self.above_5.0),
        );
        faults
    }
}

fn mean(values: &[f64]) -> f64 {
    if values.is_empty() {
        0.0
    } else {
        values.iter().sum::<f64>() / values.len() as f64
    }
}

fn deviation(values: &[f64]) -> f64 {
    if values.len() < 2 {
        return 1.0;
    }
    let centre = mean(values);
    let squares: f64 = values.iter().map(|v| (v - centre) * (v - centre)).sum();
    (squares / (values.len() - 1) as f64).sqrt()
}

fn share_above(values: &[f64], limit: f64) -> f64 {
    let above = values.iter().filter(|v| v.abs() > limit).count();
    above as f64 / values.len().max(1) as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIDE: usize = 64;

    /// A sum of twelve uniform numbers less six is normal to three digits (SplitMix64).
    fn normal(state: &mut u64) -> f32 {
        let mut uniform = || {
            *state = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
            let mut z = *state;
            z = (z ^ z >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
            z = (z ^ z >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
            ((z ^ z >> 31) >> 40) as f32 / (1 << 24) as f32
        };
        (0..12).map(|_| uniform()).sum::<f32>() - 6.0
    }

    /// A picture of truth `truth(pixel)` with normal noise of the given size.
    fn noisy(
        seed: u64,
        noise: f32,
        truth: impl Fn(usize) -> f32,
    ) -> (Vec<[f32; 3]>, Vec<[f32; 3]>) {
        let mut state = seed;
        let mean = (0..SIDE * SIDE)
            .map(|p| [(); 3].map(|()| truth(p) + noise * normal(&mut state)))
            .collect();
        (mean, vec![[noise; 3]; SIDE * SIDE])
    }

    fn compare(
        ours: &(Vec<[f32; 3]>, Vec<[f32; 3]>),
        reference: &(Vec<[f32; 3]>, Vec<[f32; 3]>),
    ) -> ZTest {
        let estimate = |(mean, standard_error)| Estimate {
            mean,
            standard_error,
        };
        ZTest::new(
            estimate((&ours.0, &ours.1)),
            estimate((&reference.0, &reference.1)),
            SIDE,
        )
    }

    fn truth(pixel: usize) -> f32 {
        1.0 + (pixel % SIDE) as f32 / SIDE as f32
    }

    #[test]
    fn the_same_picture_passes() {
        for seed in 0..20 {
            let test = compare(&noisy(seed, 0.05, truth), &noisy(seed + 1000, 0.02, truth));
            assert_eq!(
                [test.binding_faults(), test.value_faults()].concat(),
                Vec::<String>::new(),
                "{test:?}"
            );
        }
    }

    #[test]
    fn half_a_percent_more_light_fails() {
        let test = compare(
            &noisy(1, 0.05, |p| truth(p) * 1.005),
            &noisy(2, 0.02, truth),
        );
        assert!(
            test.binding_faults().iter().any(|f| f.starts_with('F')),
            "{test:?}"
        );
    }

    #[test]
    fn a_shift_by_one_pixel_fails_in_blocks_or_values() {
        let stripes = |p: usize| 1.0 + 0.5 * ((p % SIDE / 4) % 2) as f32;
        let test = compare(
            &noisy(1, 0.05, |p| stripes(p + 1)),
            &noisy(2, 0.02, stripes),
        );
        assert!(!test.value_faults().is_empty(), "{test:?}");
    }

    #[test]
    fn a_wrong_background_fails() {
        let mut ours = noisy(1, 0.0, truth);
        let reference = noisy(2, 0.0, truth);
        assert_eq!(compare(&ours, &reference).certain_differences, 0);
        ours.0[17][1] += 1e-3;
        assert_eq!(compare(&ours, &reference).certain_differences, 1);
        ours.0[17][1] = f32::NAN;
        assert_eq!(compare(&ours, &reference).certain_differences, 1);
    }

    #[test]
    fn too_small_an_error_fails() {
        let mut ours = noisy(1, 0.05, truth);
        ours.1.iter_mut().flatten().for_each(|e| *e *= 0.5);
        let test = compare(&ours, &noisy(2, 0.01, truth));
        assert!(
            test.value_faults().iter().any(|f| f.starts_with('B')),
            "{test:?}"
        );
    }
}
