//! How a volume is to look: a transfer function and what may be asked of it besides.
//!
//! Whatever is not asked for is absent from the loop over samples: a picture with a transfer function
//! alone is made by another kernel.

use raywright_bvh::Vec3;

use crate::transfer::TransferFunction;

/// A transfer function, and how it is applied.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Appearance {
    /// Colour and opacity of values.
    pub function: TransferFunction,
    /// What is looked up in it.
    pub integration: Integration,
    /// How values between voxels are found.
    pub interpolation: Interpolation,
    /// How what is seen is lit; `None`: colours are taken as they are.
    pub shading: Option<Shading>,
    /// Surfaces of equal value within the volume.
    pub surfaces: Vec<IsoSurface>,
}

impl From<TransferFunction> for Appearance {
    fn from(function: TransferFunction) -> Self {
        Self {
            function,
            integration: Integration::Samples,
            interpolation: Interpolation::Trilinear,
            shading: None,
            surfaces: Vec::new(),
        }
    }
}

impl Appearance {
    /// Whether samples of the transfer function are all that is seen.
    pub(crate) fn is_plain(&self) -> bool {
        let Self {
            function: _,
            integration,
            interpolation,
            shading,
            surfaces,
        } = self;
        *integration == Integration::Samples
            && *interpolation == Interpolation::Trilinear
            && shading.is_none()
            && surfaces.is_empty()
    }

    pub(crate) fn check(&self) -> Result<(), AppearanceError> {
        if let Some(shading) = &self.shading {
            shading.check()?;
        }
        self.surfaces.iter().try_for_each(IsoSurface::check)
    }
}

/// What is looked up in a transfer function.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub enum Integration {
    /// The value of each sample, which stands for the whole step.
    #[default]
    Samples,
    /// The values at both ends of each step, between which all others are passed: the integral over
    /// them is tabled for 256 × 256 pairs. It sees what is thinner than a step, and costs a table of
    /// 0.75 MB for every step length. Engel, Kraus, Ertl, *High-Quality Pre-Integrated Volume
    /// Rendering Using Hardware-Accelerated Pixel Shading*, 2001; within a step nothing hides
    /// anything, as in their approximation.
    PreIntegrated,
}

/// How values between voxels are found.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub enum Interpolation {
    /// The value of the nearest voxel.
    Nearest,
    /// Linear along each axis.
    #[default]
    Trilinear,
}

/// Light on what is seen, after Blinn, *Models of Light Reflection for Computer Synthesized Pictures*,
/// 1977, with the gradient of the values as the normal, either way around: ambient + diffuse · |n·l|
/// of the colour, and specular · |n·h|^shininess of white. Where values do not change colours are
/// taken as they are.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Shading {
    /// Share of the colour that is seen in the dark, 0 or more.
    pub ambient: f32,
    /// Share of the colour where the light falls straight, 0 or more.
    pub diffuse: f32,
    /// Share of white where the light is mirrored, 0 or more.
    pub specular: f32,
    /// The exponent of the mirror, 1 to 1024.
    pub shininess: u32,
    /// Where the light comes from.
    pub light: Light,
}

impl Default for Shading {
    fn default() -> Self {
        Self {
            ambient: 0.3,
            diffuse: 0.7,
            specular: 0.2,
            shininess: 32,
            light: Light::Head,
        }
    }
}

impl Shading {
    fn check(&self) -> Result<(), AppearanceError> {
        for (name, value) in [
            ("ambient", self.ambient),
            ("diffuse", self.diffuse),
            ("specular", self.specular),
        ] {
            if !(value >= 0.0 && value.is_finite()) {
                return Err(AppearanceError::Share { name, value });
            }
        }
        if !(1..=1024).contains(&self.shininess) {
            return Err(AppearanceError::Shininess {
                shininess: self.shininess,
            });
        }
        match self.light {
            Light::From(direction) if direction.try_normalize().is_none() => {
                Err(AppearanceError::LightDirection { direction })
            }
            _ => Ok(()),
        }
    }
}

/// Where light comes from.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum Light {
    /// From the eye, along each ray.
    Head,
    /// From far away in this direction, world units, of any length but 0.
    From(Vec3),
}

/// A surface of equal value.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct IsoSurface {
    /// The value on it, in the units of the file.
    pub value: f32,
    /// Red, green and blue, 0 to 1.
    pub colour: [f32; 3],
    /// Its opacity, whatever the step: 0 to 1.
    pub opacity: f32,
}

impl IsoSurface {
    fn check(&self) -> Result<(), AppearanceError> {
        let shares = self.colour.iter().chain([&self.opacity]);
        if !self.value.is_finite() || shares.into_iter().any(|share| !(0.0..=1.0).contains(share)) {
            return Err(AppearanceError::Surface { surface: *self });
        }
        Ok(())
    }
}

/// Why a volume cannot look like that.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum AppearanceError {
    /// A share of the shading is negative or not finite.
    #[error("{name} is {value}; it must be 0 or more")]
    Share {
        /// Which.
        name: &'static str,
        /// What it is.
        value: f32,
    },
    /// The exponent of the mirror.
    #[error("shininess is {shininess}; it must be 1 to 1024")]
    Shininess {
        /// What it is.
        shininess: u32,
    },
    /// A direction without a length.
    #[error("light from {direction} comes from nowhere")]
    LightDirection {
        /// The direction.
        direction: Vec3,
    },
    /// A surface with a value that is not finite, or a colour or opacity outside 0 to 1.
    #[error(
        "a surface has the value {}, the colour {:?} and the opacity {}; the first must be finite and \
         the others 0 to 1",
        surface.value, surface.colour, surface.opacity
    )]
    Surface {
        /// The surface.
        surface: IsoSurface,
    },
}
