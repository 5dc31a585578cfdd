//! Flags that say how a volume looks beyond its transfer function.

use clap::{Args, ValueEnum};
use raywright::volume::{
    Appearance, Integration, Interpolation, IsoSurface, Light, Shading, TransferFunction,
};

use crate::cli::Failure;

#[derive(Clone, Copy, Debug, ValueEnum)]
enum Between {
    /// The value of the nearest voxel
    Nearest,
    /// Linear along each axis
    Trilinear,
}

#[derive(Debug, Args)]
pub(crate) struct LookOptions {
    /// Shade by the gradient of the values, lit from the eye
    #[arg(long)]
    shade: bool,
    /// Shade with light from this direction, world units, instead of the eye
    #[arg(long, value_name = "X,Y,Z", allow_hyphen_values = true)]
    light: Option<String>,
    /// Show the surface of a value, as in 1200 or 1200:ff8040 or 1200:ff8040:0.5 (value, colour, opacity); may be repeated
    #[arg(
        long,
        value_name = "VALUE[:RRGGBB[:OPACITY]]",
        allow_hyphen_values = true
    )]
    surface: Vec<String>,
    /// Look up whole steps instead of samples: sees what is thinner than a step
    #[arg(long)]
    pre_integrated: bool,
    /// How values between voxels are found
    #[arg(long, value_enum, default_value_t = Between::Trilinear)]
    interpolation: Between,
}

impl LookOptions {
    /// What `function` is to look like.
    pub(crate) fn appearance(&self, function: TransferFunction) -> Result<Appearance, Failure> {
        let mut appearance = Appearance::from(function);
        appearance.surfaces = self
            .surface
            .iter()
            .map(|s| surface(s))
            .collect::<Result<_, _>>()?;
        if self.pre_integrated {
            appearance.integration = Integration::PreIntegrated;
        }
        appearance.interpolation = match self.interpolation {
            Between::Nearest => Interpolation::Nearest,
            Between::Trilinear => Interpolation::Trilinear,
        };
        let light = match &self.light {
            Some(text) => Some(Light::From(direction(text)?.into())),
            None => self.shade.then_some(Light::Head),
        };
        appearance.shading = light.map(|light| Shading {
            light,
            ..Shading::default()
        });
        Ok(appearance)
    }
}

fn direction(text: &str) -> Result<[f32; 3], Failure> {
    let numbers: Result<Vec<f32>, _> = text.split(',').map(|n| n.trim().parse()).collect();
    <[f32; 3]>::try_from(numbers.unwrap_or_default()).map_err(|_| {
        Failure::with_hint(
            anyhow::anyhow!("{text} is no direction"),
            "give three numbers, as in 1,1,2",
        )
    })
}

fn surface(text: &str) -> Result<IsoSurface, Failure> {
    let mut parts = text.split(':');
    let number = |part: Option<&str>| part.map_or(Some(1.0), |part| part.trim().parse().ok());
    let value = parts.next().and_then(|part| part.trim().parse().ok());
    let colour = parts.next().map_or(Some([1.0; 3]), colour);
    let opacity = number(parts.next());
    match (value, colour, opacity, parts.next()) {
        (Some(value), Some(colour), Some(opacity), None) => Ok(IsoSurface {
            value,
            colour,
            opacity,
        }),
        _ => Err(Failure::with_hint(
            anyhow::anyhow!("{text} is no surface"),
            "give a value, and perhaps a colour and an opacity, as in 1200:ff8040:0.5",
        )),
    }
}

/// The colour of six hexadecimal digits.
fn colour(text: &str) -> Option<[f32; 3]> {
    if text.len() != 6 || !text.bytes().all(|b| b.is_ascii_hexdigit()) {
        return None;
    }
    let part = |i: usize| u8::from_str_radix(&text[i..i + 2], 16).ok();
    Some([part(0)?, part(2)?, part(4)?].map(|c| f32::from(c) / 255.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn surfaces_in_words() {
        let read = |text: &str| surface(text).ok().map(|s| (s.value, s.colour, s.opacity));
        assert_eq!(read("-1200.5"), Some((-1200.5, [1.0; 3], 1.0)));
        assert_eq!(read("3:ff0033"), Some((3.0, [1.0, 0.0, 0.2], 1.0)));
        assert_eq!(read("3:000000:0.25"), Some((3.0, [0.0; 3], 0.25)));
        for bad in [
            "",
            "x",
            "3:ff",
            "3:gg0000",
            "3:ff0000:x",
            "3:ff0000:1:1",
            "3:ééé",
        ] {
            assert_eq!(read(bad), None, "{bad}");
        }
    }
}
