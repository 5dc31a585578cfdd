//! How far two pictures are apart.
//!
//! Structural similarity: Wang, Bovik, Sheikh, Simoncelli, *Image Quality Assessment: From Error
//! Visibility to Structural Similarity*, 2004: on luminance, in Gaussian windows of 11 × 11 pixels with
//! σ = 1.5, constants 0.01² and 0.03² for values from 0 to 1. At the borders the window is what of it
//! lies in the picture, its weights scaled to a sum of 1.
//!
//! Invariant: what is not finite in either picture makes every figure NaN, never a good one.

use crate::image::Image;

/// Half the side of a window, pixels.
const RADIUS: usize = 5;
/// Of the window's Gaussian, pixels.
const SIGMA: f64 = 1.5;
/// Against division by nothing.
const CONSTANTS: [f64; 2] = [0.01 * 0.01, 0.03 * 0.03];

/// How far a picture is from another of the same size, values of 1 being full brightness.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct Difference {
    /// Root of the mean square over all pixels and channels.
    pub rmse: f64,
    /// The same over the pixels that are not black in both; 0 if all are.
    pub rmse_seen: f64,
    /// The largest difference of a channel.
    pub largest: f64,
    /// Mean structural similarity, 1 for equal pictures.
    pub ssim: f64,
}

impl Difference {
    /// The difference of two pictures; `None` if their sizes differ.
    #[must_use]
    pub fn of(a: &Image, b: &Image) -> Option<Self> {
        if (a.width(), a.height()) != (b.width(), b.height()) {
            return None;
        }
        let (mut squares, mut largest, mut seen) = (0.0, 0.0_f64, 0_usize);
        for (a, b) in a.pixels().iter().zip(b.pixels()) {
            seen += usize::from(*a != [0.0; 3] || *b != [0.0; 3]);
            for (a, b) in a.iter().zip(b) {
                let difference = f64::from(*a) - f64::from(*b);
                squares += difference * difference;
                largest = if largest.is_nan() || difference.is_nan() {
                    f64::NAN
                } else {
                    largest.max(difference.abs())
                };
            }
        }
        let mean = |pixels: usize| (squares / (3 * pixels.max(1)) as f64).sqrt();
        Some(Self {
            rmse: mean(a.pixels().len()),
            rmse_seen: mean(seen),
            largest,
            ssim: ssim(a, b),
        })
    }

    /// Peak signal-to-noise ratio in decibels: −20 · log10 of the root mean square; infinite for equal
    /// pictures.
    #[must_use]
    pub fn psnr(&self) -> f64 {
        -20.0 * self.rmse.log10()
    }
}

/// Mean structural similarity.
fn ssim(a: &Image, b: &Image) -> f64 {
    let size = [a.width() as usize, a.height() as usize];
    let a: Vec<f64> = a.pixels().iter().map(luminance).collect();
    let b: Vec<f64> = b.pixels().iter().map(luminance).collect();
    let product =
        |a: &[f64], b: &[f64]| -> Vec<f64> { a.iter().zip(b).map(|(a, b)| a * b).collect() };
    let [aa, bb, ab] = [product(&a, &a), product(&b, &b), product(&a, &b)];
    let [a, b, aa, bb, ab] = [a, b, aa, bb, ab].map(|values| blurred(&values, size));
    let sum: f64 = (0..a.len())
        .map(|i| similarity([a[i], b[i]], [aa[i], bb[i], ab[i]]))
        .sum();
    sum / a.len() as f64
}

/// Of a window, by means and means of products.
fn similarity([a, b]: [f64; 2], [aa, bb, ab]: [f64; 3]) -> f64 {
    let [c1, c2] = CONSTANTS;
    let (variance_a, variance_b, covariance) = (aa - a * a, bb - b * b, ab - a * b);
    (2.0 * a * b + c1) * (2.0 * covariance + c2)
        / ((a * a + b * b + c1) * (variance_a + variance_b + c2))
}

fn luminance(rgb: &[f32; 3]) -> f64 {
    let [r, g, b] = rgb.map(f64::from);
    0.2126 * r + 0.7152 * g + 0.0722 * b
}

fn weight(distance: usize) -> f64 {
    let distance = distance as f64;
    (-0.5 * distance * distance / (SIGMA * SIGMA)).exp()
}

/// The weighted means of all windows: along rows, then along columns.
fn blurred(values: &[f64], [width, height]: [usize; 2]) -> Vec<f64> {
    let weights: [f64; RADIUS + 1] = std::array::from_fn(weight);
    let pass = |values: &[f64], length: usize, stride: usize, start: usize, out: &mut [f64]| {
        for i in 0..length {
            let window = i.saturating_sub(RADIUS)..(i + RADIUS + 1).min(length);
            let (mut sum, mut total) = (0.0, 0.0);
            for j in window {
                let weight = weights[i.abs_diff(j)];
                sum += weight * values[start + j * stride];
                total += weight;
            }
            out[start + i * stride] = sum / total;
        }
    };
    let (mut rows, mut both) = (vec![0.0; values.len()], vec![0.0; values.len()]);
    for y in 0..height {
        pass(values, width, 1, y * width, &mut rows);
    }
    for x in 0..width {
        pass(&rows, height, width, x, &mut both);
    }
    both
}

#[cfg(test)]
mod tests {
    use super::*;

    fn picture(width: u32, height: u32, of: impl Fn(u32, u32) -> [f32; 3]) -> Image {
        let mut image = Image::new(width, height).unwrap();
        for y in 0..height {
            for x in 0..width {
                image.set(x, y, of(x, y));
            }
        }
        image
    }

    fn noise(seed: u32) -> Image {
        picture(23, 9, |x, y| {
            let mut state = (y * 23 + x).wrapping_mul(747_796_405) ^ seed;
            std::array::from_fn(|_| {
                state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                (state >> 8) as f32 / 16_777_216.0
            })
        })
    }

    #[test]
    fn equal_pictures_do_not_differ() {
        let same = Difference::of(&noise(1), &noise(1)).unwrap();
        assert_eq!((same.rmse, same.rmse_seen, same.largest), (0.0, 0.0, 0.0));
        assert!((same.ssim - 1.0).abs() < 1e-12);
        assert_eq!(same.psnr(), f64::INFINITY);
        let other = Image::new(9, 23).unwrap();
        assert_eq!(Difference::of(&noise(1), &other), None);
    }

    #[test]
    fn of_constant_pictures_there_is_a_closed_form() {
        let (a, b) = (
            picture(40, 30, |_, _| [0.25; 3]),
            picture(40, 30, |_, _| [0.75; 3]),
        );
        let found = Difference::of(&a, &b).unwrap();
        assert_eq!(
            (found.rmse, found.rmse_seen, found.largest),
            (0.5, 0.5, 0.5)
        );
        let [c1, _] = CONSTANTS;
        let expected = (2.0 * 0.25 * 0.75 + c1) / (0.25 * 0.25 + 0.75 * 0.75 + c1);
        assert!((found.ssim - expected).abs() < 1e-9, "{}", found.ssim);
        assert!((found.psnr() - 6.0206).abs() < 1e-4);
    }

    #[test]
    fn black_in_both_is_not_seen() {
        let a = picture(10, 10, |x, _| [if x < 2 { 0.5 } else { 0.0 }; 3]);
        let b = picture(10, 10, |x, _| [if x < 1 { 0.5 } else { 0.0 }; 3]);
        let found = Difference::of(&a, &b).unwrap();
        assert!((found.rmse - 0.5 * 0.1_f64.sqrt()).abs() < 1e-12);
        assert!((found.rmse_seen - 0.5 * 0.5_f64.sqrt()).abs() < 1e-12);
    }

    #[test]
    fn windows_are_those_of_the_definition() {
        let (a, b) = (noise(5), noise(77));
        let (width, height) = (23_usize, 9_usize);
        let mut sum = 0.0;
        for y in 0..height {
            for x in 0..width {
                let mut means = [0.0; 6];
                for v in 0..height {
                    for u in 0..width {
                        let (dx, dy) = (u.abs_diff(x), v.abs_diff(y));
                        if dx > RADIUS || dy > RADIUS {
                            continue;
                        }
                        let weight = (-0.5 * (dx * dx + dy * dy) as f64 / 2.25).exp();
                        let [p, q] = [&a, &b].map(|i| luminance(&i.get(u as u32, v as u32)));
                        for (mean, value) in means.iter_mut().zip([1.0, p, q, p * p, q * q, p * q])
                        {
                            *mean += weight * value;
                        }
                    }
                }
                let [total, p, q, pp, qq, pq] = means;
                sum += similarity([p / total, q / total], [pp / total, qq / total, pq / total]);
            }
        }
        let found = Difference::of(&a, &b).unwrap().ssim;
        assert!((found - sum / 207.0).abs() < 1e-12, "{found}");
        assert!((-1.0..0.9).contains(&found));
    }

    #[test]
    fn what_is_no_number_is_no_success() {
        let broken = picture(23, 9, |x, _| [if x == 3 { f32::NAN } else { 0.5 }; 3]);
        let found = Difference::of(&broken, &noise(1)).unwrap();
        assert!(found.rmse.is_nan() && found.largest.is_nan() && found.ssim.is_nan());
    }
}
