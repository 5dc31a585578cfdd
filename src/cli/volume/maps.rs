//! Pictures of what rays did instead of what they saw: where they end, where they were expected to end
//! (as figure 4 of Bruder, Frey, Ertl 2016), and what they took.

use clap::ValueEnum;
use raywright::{
    imaging::{AnyCamera, Camera, Image},
    volume::{
        CastOptions, Counts, EstimateMethod, Estimator, Picture, Raycaster, TransferFunction,
        Volume,
    },
};

use crate::cli::Failure;

/// Differences are shown as many times larger.
const ERROR_SCALE: f32 = 4.0;

#[derive(Clone, Copy, Debug, ValueEnum)]
pub(crate) enum Show {
    /// What the transfer function shows
    Colours,
    /// Where rays end, the nearer the brighter; black where they see nothing
    Termination,
    /// Where they are expected to end, for squares of 8 pixels
    EstimatedTermination,
    /// The difference of the two, four times
    TerminationError,
    /// Samples of each ray, white for the most
    Samples,
}

/// What is drawn of rays.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Map {
    Termination,
    Estimated,
    Error,
    Samples,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
pub(crate) enum Method {
    /// Mean extinction of blocks
    Mean,
    /// Draws from opacities in bins of equal cube root
    Cube,
    /// Draws from opacities in bins of equal size, as in the paper
    PaperLinear,
}

impl Show {
    /// What is drawn; `None`: the picture itself.
    pub(crate) fn map(self) -> Option<Map> {
        match self {
            Self::Colours => None,
            Self::Termination => Some(Map::Termination),
            Self::EstimatedTermination => Some(Map::Estimated),
            Self::TerminationError => Some(Map::Error),
            Self::Samples => Some(Map::Samples),
        }
    }
}

impl From<Method> for EstimateMethod {
    fn from(method: Method) -> Self {
        match method {
            Method::Mean => Self::MeanExtinction,
            Method::Cube => Self::CubeRoot,
            Method::PaperLinear => Self::PaperLinear,
        }
    }
}

/// Where rays end, where they were expected to, and the difference four times: figure 4 of the paper.
pub(super) fn terminations(
    volume: &Volume,
    caster: &Raycaster<'_>,
    function: &TransferFunction,
    camera: Camera,
    size: [u32; 2],
) -> Result<[Image; 3], Failure> {
    let options = CastOptions::default();
    let picture = caster.prepare(function).render(camera, size, &options)?;
    let draw = |map| {
        Maps::new(map, volume, function, EstimateMethod::MeanExtinction).draw(
            &picture,
            camera.into(),
            &options,
        )
    };
    Ok([
        draw(Map::Termination)?,
        draw(Map::Estimated)?,
        draw(Map::Error)?,
    ])
}

/// Draws pictures of rays through a volume.
pub(crate) struct Maps<'a> {
    map: Map,
    estimator: Estimator<'a>,
    function: &'a TransferFunction,
    method: EstimateMethod,
}

impl<'a> Maps<'a> {
    pub(crate) fn new(
        map: Map,
        volume: &'a Volume,
        function: &'a TransferFunction,
        method: EstimateMethod,
    ) -> Self {
        Self {
            map,
            estimator: Estimator::new(volume),
            function,
            method,
        }
    }

    /// What has to be counted for it.
    pub(crate) fn counts(&self) -> Counts {
        match self.map {
            Map::Samples => Counts::PerRay,
            _ => Counts::Total,
        }
    }

    /// The map of a picture that was made with these options.
    pub(crate) fn draw(
        &self,
        picture: &Picture,
        camera: AnyCamera,
        options: &CastOptions,
    ) -> Result<Image, Failure> {
        let size = [picture.image.width(), picture.image.height()];
        let mut image = Image::new(size[0], size[1])?;
        let pixels = image.pixels_mut().iter_mut().enumerate();
        if self.map == Map::Samples {
            let most = picture.ray_work.iter().map(|ray| ray.samples).max();
            let most = most.unwrap_or(0).max(1) as f32;
            for (pixel, colour) in pixels {
                *colour = [picture.ray_work[pixel].samples as f32 / most; 3];
            }
            return Ok(image);
        }
        let prepared = self.estimator.prepare(self.function, self.method);
        let estimate = prepared.estimate(camera, size, options, 0)?;
        let seen = || estimate.rays.iter().filter(|ray| ray.front < ray.back);
        let near = seen().map(|ray| ray.front).fold(f32::INFINITY, f32::min);
        let far = seen().map(|ray| ray.back).fold(f32::NEG_INFINITY, f32::max);
        let brightness = |end: f32| ((far - end) / (far - near)).clamp(0.0, 1.0);
        for (pixel, colour) in pixels {
            let [x, y] = [pixel as u32 % size[0], pixel as u32 / size[0]];
            let tile = y / estimate.tile_size * estimate.tiles[0] + x / estimate.tile_size;
            let ray = &estimate.rays[tile as usize];
            let is_expected = ray.front < ray.back;
            let expected = if is_expected {
                brightness(ray.end)
            } else {
                0.0
            };
            let end = picture.end[pixel];
            let found = if picture.opacity[pixel] > options.termination {
                brightness(end)
            } else if is_expected {
                // Behind the last block in which something can be seen a ray has nothing to do.
                brightness(end.min(ray.back))
            } else {
                0.0
            };
            *colour = match self.map {
                Map::Estimated => [expected; 3],
                Map::Error => [(expected - found).abs() * ERROR_SCALE; 3],
                Map::Termination | Map::Samples => [found; 3],
            };
        }
        Ok(image)
    }
}
