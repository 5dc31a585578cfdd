//! OpenEXR: f32 without loss, ZIP, one file for the picture and its standard error.
//!
//! The picture is in the channels `R`, `G`, `B`, which every viewer shows. The standard error is
//! the layer `standard_error` in the sense of the OpenEXR convention: channels of the same part
//! whose names have that prefix, `standard_error.R` and so on.

use std::io::Cursor;
use std::path::Path;

use ::exr::math::Vec2;
use ::exr::meta::MetaData;
use ::exr::prelude as codec;
use ::exr::prelude::{ReadChannels, ReadLayers, ReadSpecificChannel, WritableImage};

use super::{ImageError, read_bytes, replace_file};
use crate::film::{FilmError, check_size};
use crate::image::Image;

const COLOUR: [&str; 3] = ["R", "G", "B"];
const STANDARD_ERROR: [&str; 3] = ["standard_error.R", "standard_error.G", "standard_error.B"];

/// Writes `colour` and, if there is one, its `standard_error`.
///
/// # Errors
///
/// If the two differ in size, or if the file cannot be written.
pub fn write_exr(
    path: impl AsRef<Path>,
    colour: &Image,
    standard_error: Option<&Image>,
) -> Result<(), ImageError> {
    let path = path.as_ref();
    let size = [colour.width(), colour.height()];
    let mut channels = channels_of(COLOUR, colour);
    if let Some(error) = standard_error {
        let error_size = [error.width(), error.height()];
        if error_size != size {
            let path = path.to_owned();
            return Err(ImageError::LayerSizes {
                path,
                colour: size,
                standard_error: error_size,
            });
        }
        channels.extend(channels_of(STANDARD_ERROR, error));
    }
    let layer = codec::Layer::new(
        Vec2(size[0] as usize, size[1] as usize),
        codec::LayerAttributes::default(),
        codec::Encoding::SMALL_LOSSLESS,
        codec::AnyChannels::sort(channels.into_iter().collect()),
    );
    let mut bytes = Cursor::new(Vec::new());
    codec::Image::from_layer(layer)
        .write()
        .to_buffered(&mut bytes)
        .map_err(|source| ImageError::Exr {
            path: path.to_owned(),
            source,
        })?;
    replace_file(path, bytes.get_ref())
}

fn channels_of(names: [&str; 3], image: &Image) -> Vec<codec::AnyChannel<codec::FlatSamples>> {
    let samples = |channel: usize| image.pixels().iter().map(|rgb| rgb[channel]).collect();
    let channel =
        |(index, name)| codec::AnyChannel::new(name, codec::FlatSamples::F32(samples(index)));
    names.into_iter().enumerate().map(channel).collect()
}

/// Reads the picture of an EXR file and, if the file holds it, its standard error. Samples of
/// other types are converted to f32; further channels are ignored.
///
/// # Errors
///
/// If the file cannot be read, holds no full-resolution channels `R`, `G`, `B`, or is larger than
/// a picture may be.
pub fn read_exr(path: impl AsRef<Path>) -> Result<(Image, Option<Image>), ImageError> {
    let path = path.as_ref();
    let bytes = read_bytes(path)?;
    let exr_error = |source| ImageError::Exr {
        path: path.to_owned(),
        source,
    };
    let size_error = |source| ImageError::Size {
        path: path.to_owned(),
        source,
    };
    // The codec takes memory for a whole block of the size that a header claims, and the process
    // is aborted if there is none: hence the sizes are looked at first.
    let meta = MetaData::read_from_buffered(bytes.as_slice(), false).map_err(exr_error)?;
    for header in &meta.headers {
        let [width, height] = sides(header.layer_size);
        check_size(width, height).map_err(size_error)?;
    }
    let image = codec::read()
        .no_deep_data()
        .largest_resolution_level()
        .specific_channels()
        .required(COLOUR[0])
        .required(COLOUR[1])
        .required(COLOUR[2])
        .optional(STANDARD_ERROR[0], 0.0)
        .optional(STANDARD_ERROR[1], 0.0)
        .optional(STANDARD_ERROR[2], 0.0)
        .collect_pixels(
            |size, (_, _, _, red, green, blue)| {
                Layers::new(size, red.is_some() && green.is_some() && blue.is_some())
            },
            |layers: &mut Result<Layers, FilmError>, at, pixel: (f32, f32, f32, f32, f32, f32)| {
                if let Ok(layers) = layers {
                    let (red, green, blue, red_error, green_error, blue_error) = pixel;
                    let (x, y) = (at.x() as u32, at.y() as u32);
                    layers.colour.set(x, y, [red, green, blue]);
                    if let Some(error) = &mut layers.standard_error {
                        error.set(x, y, [red_error, green_error, blue_error]);
                    }
                }
            },
        )
        .first_valid_layer()
        .all_attributes()
        .from_buffered(Cursor::new(bytes))
        .map_err(exr_error)?;
    let layers = image.layer_data.channel_data.pixels.map_err(size_error)?;
    Ok((layers.colour, layers.standard_error))
}

/// What is read from one file.
struct Layers {
    colour: Image,
    standard_error: Option<Image>,
}

impl Layers {
    fn new(size: Vec2<usize>, with_standard_error: bool) -> Result<Layers, FilmError> {
        let [width, height] = sides(size);
        let colour = Image::new(width, height)?;
        let standard_error = with_standard_error.then(|| colour.clone());
        Ok(Layers {
            colour,
            standard_error,
        })
    }
}

/// Width and height; what is beyond u32 is beyond the limit of a picture as well.
fn sides(size: Vec2<usize>) -> [u32; 2] {
    [size.width(), size.height()].map(|side| u32::try_from(side).unwrap_or(u32::MAX))
}
