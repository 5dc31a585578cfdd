//! The film: mean and standard error of every pixel.
//!
//! Idea: each pixel accumulates its own samples by the recurrence of Welford (Note on a method for
//! calculating corrected sums of squares and products, 1962) in f64,
//!
//! ```text
//! d = x − mean,  mean += d/n,  m2 += d·(x − mean)
//! ```
//!
//! which, unlike the difference of Σx² and (Σx)²/n, does not cancel when the mean is large and the
//! variance small, and gives the exact mean of equal samples.
//!
//! Invariants: what a pixel holds depends on its samples and on their order alone, so that passes
//! of 1 + 1 + 2 samples and one pass of 4 give the same bits; a sample belongs to one pixel; every
//! value is finite.

use glam::Vec3;

use crate::image::Image;

/// Longest side of a picture, pixels.
pub const MAX_SIDE: u32 = 1 << 16;

/// Most pixels of a picture. A film of that size takes 15 GB.
pub const MAX_PIXELS: u64 = 1 << 28;

/// Why there is no film of the size asked for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum FilmError {
    /// A side is zero or too long.
    #[error("picture of {width} x {height} pixels: each side must be in 1..={MAX_SIDE}")]
    Side {
        /// Width asked for, pixels.
        width: u32,
        /// Height asked for, pixels.
        height: u32,
    },
    /// The sides are permitted, their product is not.
    #[error("picture of {width} x {height} pixels: more than {MAX_PIXELS} in all")]
    TooManyPixels {
        /// Width asked for, pixels.
        width: u32,
        /// Height asked for, pixels.
        height: u32,
    },
    /// The system has not as much memory.
    #[error("no memory for {bytes} bytes of pixels")]
    OutOfMemory {
        /// Size of the allocation that failed.
        bytes: u64,
    },
}

/// Accumulated samples of one pixel.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Pixel {
    mean: [f64; 3],
    /// Sum of the squared deviations from the mean.
    m2: [f64; 3],
    count: u32,
    rejected: u32,
}

impl Pixel {
    /// Adds one sample. If any channel is infinite or not a number, the sample counts as black and
    /// as [`rejected`](Pixel::rejected): the picture survives, and the fault stays visible.
    ///
    /// A pixel takes up to `u32::MAX` samples, as many as sample indices can name.
    #[inline]
    pub fn add(&mut self, rgb: Vec3) {
        let rgb = if rgb.is_finite() {
            rgb
        } else {
            self.rejected += 1;
            Vec3::ZERO
        };
        self.count += 1;
        let n = f64::from(self.count);
        for (channel, value) in rgb.to_array().into_iter().enumerate() {
            let value = f64::from(value);
            let deviation = value - self.mean[channel];
            self.mean[channel] += deviation / n;
            self.m2[channel] += deviation * (value - self.mean[channel]);
        }
    }

    /// Mean of the samples, 0 without samples.
    pub fn mean(&self) -> [f64; 3] {
        self.mean
    }

    /// Standard error of the mean, sqrt(m2 / (n (n − 1))); 0 where it is unknown, for n < 2.
    pub fn standard_error(&self) -> [f64; 3] {
        if self.count < 2 {
            return [0.0; 3];
        }
        let n = f64::from(self.count);
        self.m2.map(|m2| (m2 / (n * (n - 1.0))).sqrt())
    }

    /// Number of samples, the rejected ones included.
    pub fn count(&self) -> u32 {
        self.count
    }

    /// Number of samples that were infinite or not a number.
    pub fn rejected(&self) -> u32 {
        self.rejected
    }
}

/// Accumulators of all pixels of a picture.
#[derive(Clone, Debug, PartialEq)]
pub struct Film {
    width: u32,
    height: u32,
    /// Row-major from the top left pixel.
    pixels: Vec<Pixel>,
}

impl Film {
    /// A film without samples.
    ///
    /// # Errors
    ///
    /// If a side is zero or longer than [`MAX_SIDE`], if there are more than [`MAX_PIXELS`], or if
    /// memory does not suffice.
    pub fn new(width: u32, height: u32) -> Result<Film, FilmError> {
        let count = check_size(width, height)?;
        Ok(Film {
            width,
            height,
            pixels: filled(count)?,
        })
    }

    /// Width, pixels.
    pub fn width(&self) -> u32 {
        self.width
    }

    /// Height, pixels.
    pub fn height(&self) -> u32 {
        self.height
    }

    /// The pixel in column `x` of row `y`, row 0 at the top.
    ///
    /// # Panics
    ///
    /// If the pixel lies outside the film.
    pub fn pixel(&self, x: u32, y: u32) -> &Pixel {
        let (width, height) = (self.width, self.height);
        assert!(
            x < width && y < height,
            "pixel ({x}, {y}) is outside {width} x {height}"
        );
        &self.pixels[y as usize * width as usize + x as usize]
    }

    /// All pixels, row after row from the top.
    pub fn pixels(&self) -> &[Pixel] {
        &self.pixels
    }

    /// All pixels to be added to, row after row from the top.
    pub(crate) fn pixels_mut(&mut self) -> &mut [Pixel] {
        &mut self.pixels
    }

    /// The picture: mean of every pixel.
    pub fn mean(&self) -> Image {
        self.develop(Pixel::mean)
    }

    /// Standard error of the picture, pixel by pixel.
    pub fn standard_error(&self) -> Image {
        self.develop(Pixel::standard_error)
    }

    /// Number of samples in all pixels, the rejected ones included.
    pub fn samples(&self) -> u64 {
        self.pixels.iter().map(|pixel| u64::from(pixel.count)).sum()
    }

    /// Number of samples that were infinite or not a number. Anything but 0 is a fault of the
    /// integrator.
    pub fn rejected(&self) -> u64 {
        self.pixels
            .iter()
            .map(|pixel| u64::from(pixel.rejected))
            .sum()
    }

    fn develop(&self, value: impl Fn(&Pixel) -> [f64; 3]) -> Image {
        let pixels = self
            .pixels
            .iter()
            .map(|pixel| value(pixel).map(|channel| channel as f32));
        Image::from_rows(self.width, self.height, pixels.collect())
    }
}

/// Number of pixels of a permitted size.
pub(crate) fn check_size(width: u32, height: u32) -> Result<usize, FilmError> {
    let permitted = 1..=MAX_SIDE;
    if !permitted.contains(&width) || !permitted.contains(&height) {
        return Err(FilmError::Side { width, height });
    }
    let count = u64::from(width) * u64::from(height);
    if count > MAX_PIXELS {
        return Err(FilmError::TooManyPixels { width, height });
    }
    Ok(count as usize)
}

/// `count` default values, or an error instead of the abort of an ordinary allocation.
pub(crate) fn filled<T: Clone + Default>(count: usize) -> Result<Vec<T>, FilmError> {
    let mut values = Vec::new();
    values
        .try_reserve_exact(count)
        .map_err(|_| FilmError::OutOfMemory {
            bytes: count as u64 * size_of::<T>() as u64,
        })?;
    values.resize(count, T::default());
    Ok(values)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn pixel_of(samples: &[Vec3]) -> Pixel {
        let mut pixel = Pixel::default();
        samples.iter().for_each(|&sample| pixel.add(sample));
        pixel
    }

    /// Mean and standard error from their definitions, in two passes.
    fn two_passes(values: &[f64]) -> (f64, f64) {
        let n = values.len() as f64;
        let mean = values.iter().sum::<f64>() / n;
        let squares: f64 = values.iter().map(|value| (value - mean).powi(2)).sum();
        (mean, (squares / (n * (n - 1.0))).sqrt())
    }

    #[test]
    fn sides_and_sizes_out_of_range() {
        for (width, height) in [(0, 1), (1, 0), (MAX_SIDE + 1, 1), (1, u32::MAX)] {
            assert_eq!(
                Film::new(width, height),
                Err(FilmError::Side { width, height })
            );
        }
        let (width, height) = (MAX_SIDE, 4097);
        assert_eq!(
            Film::new(width, height),
            Err(FilmError::TooManyPixels { width, height })
        );
        assert_eq!(check_size(MAX_SIDE, 4096), Ok(1 << 28));
    }

    #[test]
    fn no_memory_is_an_error() {
        let bytes = u64::MAX / 2 - 7;
        let result = filled::<u64>((bytes / 8) as usize);
        assert_eq!(
            result,
            Err(FilmError::OutOfMemory {
                bytes: bytes / 8 * 8
            })
        );
    }

    #[test]
    fn a_new_film_is_black_and_certain_of_nothing() {
        let film = Film::new(3, 2).unwrap();
        assert_eq!((film.samples(), film.rejected()), (0, 0));
        assert_eq!(film.mean().pixels(), [[0.0; 3]; 6]);
        assert_eq!(film.standard_error().pixels(), [[0.0; 3]; 6]);
    }

    #[test]
    fn one_sample_has_no_standard_error() {
        let pixel = pixel_of(&[Vec3::new(1.0, 2.0, 3.0)]);
        assert_eq!(
            (pixel.mean(), pixel.standard_error()),
            ([1.0, 2.0, 3.0], [0.0; 3])
        );
    }

    #[test]
    fn equal_samples_have_an_exact_mean() {
        let value = 0.1f32;
        let pixel = pixel_of(&[Vec3::splat(value); 1000]);
        assert_eq!(pixel.mean(), [f64::from(value); 3]);
        assert_eq!(pixel.standard_error(), [0.0; 3]);
    }

    #[test]
    fn two_samples_in_closed_form() {
        let pixel = pixel_of(&[Vec3::new(1.0, 0.0, -2.0), Vec3::new(3.0, 0.0, 2.0)]);
        assert_eq!(pixel.mean(), [2.0, 0.0, 0.0]);
        assert_eq!(pixel.standard_error(), [1.0, 0.0, 2.0]);
    }

    #[test]
    fn samples_that_are_not_numbers_are_black_and_counted() {
        let mut film = Film::new(2, 1).unwrap();
        for value in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
            film.pixels_mut()[1].add(Vec3::new(5.0, value, 5.0));
        }
        film.pixels_mut()[1].add(Vec3::splat(4.0));
        assert_eq!((film.samples(), film.rejected()), (4, 3));
        assert_eq!(film.mean().get(1, 0), [1.0; 3]);
        assert_eq!(
            (film.pixel(0, 0).rejected(), film.pixel(1, 0).rejected()),
            (0, 3)
        );
    }

    #[test]
    fn largest_samples_stay_finite() {
        let pixel = pixel_of(&[Vec3::MAX, Vec3::MIN, Vec3::MAX, Vec3::MAX]);
        let largest = f64::from(f32::MAX);
        assert_eq!(pixel.mean(), [0.5 * largest; 3]);
        assert_eq!(pixel.standard_error(), [0.5 * largest; 3]);
    }

    #[test]
    #[should_panic(expected = "outside 2 x 3")]
    fn pixel_right_of_the_film() {
        Film::new(2, 3).unwrap().pixel(2, 0);
    }

    proptest! {
        #[test]
        fn agrees_with_two_passes(
            centre in prop_oneof![Just(0.0), Just(1.0), Just(1e4)],
            deviations in prop::collection::vec(-1f32..1.0, 2..300),
        ) {
            let samples: Vec<f32> = deviations.iter().map(|deviation| centre + deviation).collect();
            let pixel = pixel_of(&samples.iter().map(|&s| Vec3::splat(s)).collect::<Vec<_>>());
            let exact: Vec<f64> = samples.iter().map(|&sample| f64::from(sample)).collect();
            let (mean, error) = two_passes(&exact);
            prop_assert!((pixel.mean()[0] - mean).abs() <= 1e-13 * f64::from(centre + 1.0));
            prop_assert!((pixel.standard_error()[0] - error).abs() <= 1e-9 * error.max(1e-3));
            prop_assert_eq!(pixel.count() as usize, samples.len());
        }
    }
}
