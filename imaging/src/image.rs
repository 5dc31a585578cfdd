//! A picture in memory: linear RGB in f32, row 0 at the top.
//!
//! Invariants: both sides are in 1..=[`MAX_SIDE`](crate::film::MAX_SIDE), and there is one value per pixel.

use crate::film::{FilmError, check_size, filled};

/// Linear RGB picture with Rec. 709 primaries, row-major from the top left pixel.
#[derive(Clone, Debug, PartialEq)]
pub struct Image {
    width: u32,
    height: u32,
    pixels: Vec<[f32; 3]>,
}

impl Image {
    /// A black picture.
    ///
    /// # Errors
    ///
    /// As [`Film::new`](crate::Film::new).
    pub fn new(width: u32, height: u32) -> Result<Image, FilmError> {
        let count = check_size(width, height)?;
        Ok(Image {
            width,
            height,
            pixels: filled(count)?,
        })
    }

    /// The picture of `pixels`, row after row, of a size that has been checked.
    pub(crate) fn from_rows(width: u32, height: u32, pixels: Vec<[f32; 3]>) -> Image {
        debug_assert_eq!(check_size(width, height), Ok(pixels.len()));
        Image {
            width,
            height,
            pixels,
        }
    }

    /// Width, pixels.
    pub fn width(&self) -> u32 {
        self.width
    }

    /// Height, pixels.
    pub fn height(&self) -> u32 {
        self.height
    }

    /// All pixels, row after row from the top.
    pub fn pixels(&self) -> &[[f32; 3]] {
        &self.pixels
    }

    /// All pixels to be changed, row after row from the top.
    pub fn pixels_mut(&mut self) -> &mut [[f32; 3]] {
        &mut self.pixels
    }

    /// The pixel in column `x` of row `y`.
    ///
    /// # Panics
    ///
    /// If the pixel lies outside the picture.
    pub fn get(&self, x: u32, y: u32) -> [f32; 3] {
        self.pixels[self.index(x, y)]
    }

    /// Sets the pixel in column `x` of row `y`.
    ///
    /// # Panics
    ///
    /// If the pixel lies outside the picture.
    pub fn set(&mut self, x: u32, y: u32, rgb: [f32; 3]) {
        let index = self.index(x, y);
        self.pixels[index] = rgb;
    }

    /// The same picture with other sides: between the centres of pixels linear along both axes, and
    /// constant beyond those at the border.
    ///
    /// # Errors
    ///
    /// As [`Image::new`].
    pub fn resized(&self, width: u32, height: u32) -> Result<Image, FilmError> {
        let mut image = Image::new(width, height)?;
        // For each pixel along a side: the pixels on both sides of its centre, and the share of the second.
        let sources = |from: u32, to: u32| -> Vec<(u32, u32, f32)> {
            let source = |i: u32| {
                let place = (f64::from(i) + 0.5) * f64::from(from) / f64::from(to) - 0.5;
                let place = place.clamp(0.0, f64::from(from - 1));
                let first = place as u32;
                (
                    first,
                    (first + 1).min(from - 1),
                    (place - f64::from(first)) as f32,
                )
            };
            (0..to).map(source).collect()
        };
        let columns = sources(self.width, width);
        for (y, (above, below, down)) in sources(self.height, height).into_iter().enumerate() {
            let start = y * width as usize;
            let row = &mut image.pixels[start..start + width as usize];
            for (pixel, &(left, right, across)) in row.iter_mut().zip(&columns) {
                let mixed = |a: [f32; 3], b: [f32; 3], share: f32| -> [f32; 3] {
                    std::array::from_fn(|c| a[c] + (b[c] - a[c]) * share)
                };
                let top = mixed(self.get(left, above), self.get(right, above), across);
                let bottom = mixed(self.get(left, below), self.get(right, below), across);
                *pixel = mixed(top, bottom, down);
            }
        }
        Ok(image)
    }

    /// Mean of each channel over the picture.
    pub fn mean(&self) -> [f64; 3] {
        let mut sum = [0.0; 3];
        for pixel in &self.pixels {
            for (sum, &value) in sum.iter_mut().zip(pixel) {
                *sum += f64::from(value);
            }
        }
        sum.map(|sum| sum / self.pixels.len() as f64)
    }

    fn index(&self, x: u32, y: u32) -> usize {
        let (width, height) = (self.width, self.height);
        assert!(
            x < width && y < height,
            "pixel ({x}, {y}) is outside {width} x {height}"
        );
        y as usize * width as usize + x as usize
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_begin_at_the_top_left() {
        let mut image = Image::new(3, 2).unwrap();
        image.set(2, 0, [1.0; 3]);
        image.set(0, 1, [2.0; 3]);
        assert_eq!(image.pixels()[2..4], [[1.0; 3], [2.0; 3]]);
        assert_eq!(image.get(0, 1), [2.0; 3]);
    }

    #[test]
    fn mean_of_each_channel() {
        let mut image = Image::new(2, 2).unwrap();
        image.set(0, 0, [4.0, 0.0, 2.0]);
        image.set(1, 1, [4.0, 0.0, -6.0]);
        assert_eq!(image.mean(), [2.0, 0.0, -1.0]);
    }

    #[test]
    fn resizing_keeps_what_is_linear() {
        let mut image = Image::new(8, 6).unwrap();
        for y in 0..6 {
            for x in 0..8 {
                image.set(x, y, [x as f32 + 0.5, y as f32 + 0.5, 3.0]);
            }
        }
        assert_eq!(image.resized(8, 6).unwrap(), image);
        let large = image.resized(32, 12).unwrap();
        for y in 1..11 {
            for x in 2..30 {
                let [r, g, b] = large.get(x, y);
                let expected = [(x as f32 + 0.5) / 4.0, (y as f32 + 0.5) / 2.0];
                assert!((r - expected[0]).abs() < 1e-5 && (g - expected[1]).abs() < 1e-5);
                assert_eq!(b, 3.0);
            }
        }
        // Beyond the outermost centres there is nothing to go by.
        assert_eq!(large.get(0, 0), image.get(0, 0));
        assert_eq!(large.get(31, 11), image.get(7, 5));
        assert!(image.resized(0, 3).is_err());
        assert_eq!(image.resized(1, 1).unwrap().pixels(), [[4.0, 3.0, 3.0]]);
    }

    #[test]
    fn sizes_are_checked_as_for_a_film() {
        assert_eq!(
            Image::new(0, 4),
            Err(FilmError::Side {
                width: 0,
                height: 4
            })
        );
    }

    #[test]
    #[should_panic(expected = "pixel (3, 0) is outside 3 x 2")]
    fn a_column_too_far_is_not_the_next_row() {
        Image::new(3, 2).unwrap().get(3, 0);
    }
}
