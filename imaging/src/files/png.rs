//! PNG: 8 bits per channel, sRGB, to look at.

use std::path::Path;

use ::image::codecs::png::PngEncoder;
use ::image::{ExtendedColorType, ImageEncoder};

use super::{ImageError, replace_file};
use crate::image::Image;
use crate::tone::Display;

/// Writes `image` as `display` shows it.
///
/// # Errors
///
/// If the file cannot be written.
pub fn write_png(
    path: impl AsRef<Path>,
    image: &Image,
    display: &Display,
) -> Result<(), ImageError> {
    let path = path.as_ref();
    let channels = image.pixels().as_flattened();
    let shown: Vec<u8> = channels
        .iter()
        .map(|&channel| display.encode(channel))
        .collect();
    let mut bytes = Vec::new();
    PngEncoder::new(&mut bytes)
        .write_image(
            &shown,
            image.width(),
            image.height(),
            ExtendedColorType::Rgb8,
        )
        .map_err(|source| ImageError::Png {
            path: path.to_owned(),
            source,
        })?;
    replace_file(path, &bytes)
}
