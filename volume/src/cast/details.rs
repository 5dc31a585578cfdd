//! What is asked for beyond samples of a transfer function, in the units of a picture's rays, and the
//! formulas for one ray: the slow twin of `detailed`.

use super::{
    RayResult,
    reference::{Samples, add},
};
use crate::{
    appearance::{Appearance, Interpolation, Light, Shading},
    grid::Volume,
    slabs::{SLAB_SIZE, SlabTable},
    table::{BakedFunction, FULL_COLOUR, TableIndex},
};

/// Details of a picture.
#[derive(Clone, Debug)]
pub(crate) struct Details {
    pub(crate) interpolation: Interpolation,
    /// Steps by their ends, instead of samples.
    pub(crate) slabs: Option<SlabTable>,
    pub(crate) shade: Option<Shade>,
    /// By rising value.
    pub(crate) surfaces: Vec<RawSurface>,
}

/// A surface in the units of the table.
#[derive(Clone, Copy, Debug)]
pub(crate) struct RawSurface {
    pub(crate) raw: f32,
    pub(crate) colour: [f32; 3],
    pub(crate) opacity: f32,
}

/// Turns by which a surface is found between two samples (regula falsi).
pub(crate) const SURFACE_TURNS: usize = 4;

/// The shading of a picture.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Shade {
    pub(crate) ambient: f32,
    pub(crate) diffuse: f32,
    /// In units of the table.
    pub(crate) specular: f32,
    pub(crate) shininess: u32,
    /// A unit direction in world space; `None`: the eye.
    pub(crate) light: Option<[f32; 3]>,
    /// A difference of raw values, times this, is a component of the gradient in the world, all of
    /// them by the same factor.
    pub(crate) per_difference: [f32; 3],
    /// A step in voxels, times this, is a unit direction in the world.
    pub(crate) per_step: [f32; 3],
}

/// The square of a gradient below which there is none: a thousandth of the range in a thousand
/// lengths of a voxel, about.
pub(crate) const SMALLEST_SQUARE: f32 = 1e-12;

impl Shade {
    fn new(shading: &Shading, volume: &Volume, step: f32) -> Self {
        let [low, high] = volume.raw_range();
        let range = if high > low { high - low } else { 1.0 };
        let spacing = volume.spacing();
        Self {
            ambient: shading.ambient,
            diffuse: shading.diffuse,
            specular: shading.specular * FULL_COLOUR,
            shininess: shading.shininess,
            light: match shading.light {
                Light::Head => None,
                Light::From(direction) => Some(direction.normalize().to_array()),
            },
            per_difference: spacing.map(|s| volume.unit_length() / s / range),
            per_step: spacing.map(|s| s / (step * volume.unit_length())),
        }
    }

    /// The colour of what is lit at a place.
    fn of(&self, samples: &Samples<'_>, colour: [f32; 3], place: [f32; 3]) -> [f32; 3] {
        let gradient: [f32; 3] = std::array::from_fn(|axis| {
            let beside = |offset: f32| {
                let mut beside = place;
                beside[axis] = (beside[axis] + offset)
                    .max(0.0)
                    .min(samples.view.last_voxel[axis]);
                samples.value(beside)
            };
            (beside(1.0) - beside(-1.0)) * self.per_difference[axis]
        });
        let square = dot(gradient, gradient);
        if square.is_nan() || square <= SMALLEST_SQUARE {
            return colour;
        }
        let length = square.sqrt();
        let direction: [f32; 3] =
            std::array::from_fn(|axis| samples.lattice.step[axis] * self.per_step[axis]);
        let (straight, mirrored) = match self.light {
            None => {
                let straight = (dot(gradient, direction) / length).abs();
                (straight, straight)
            }
            Some(light) => {
                let half: [f32; 3] = std::array::from_fn(|axis| light[axis] - direction[axis]);
                let straight = (dot(gradient, light) / length).abs();
                let size = (dot(half, half).sqrt() * length).max(f32::MIN_POSITIVE);
                (straight, (dot(gradient, half) / size).abs())
            }
        };
        let share = self.ambient + self.diffuse * straight;
        let white = self.specular * power(mirrored, self.shininess);
        colour.map(|c| (c * share + white).min(FULL_COLOUR))
    }
}

fn dot(a: [f32; 3], b: [f32; 3]) -> f32 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// x^n for n ≥ 1, by squares.
fn power(mut x: f32, mut n: u32) -> f32 {
    let mut result = 1.0;
    while n > 0 {
        if n & 1 == 1 {
            result *= x;
        }
        x *= x;
        n >>= 1;
    }
    result
}

impl Details {
    /// For steps of `step` lengths of a voxel.
    pub(crate) fn new(
        appearance: &Appearance,
        surfaces: &[RawSurface],
        function: &BakedFunction,
        volume: &Volume,
        step: f32,
    ) -> Self {
        let slabs = || SlabTable::new(function, TableIndex::new(volume, SLAB_SIZE), step);
        Self {
            interpolation: appearance.interpolation,
            slabs: match appearance.integration {
                crate::appearance::Integration::Samples => None,
                crate::appearance::Integration::PreIntegrated => Some(slabs()),
            },
            shade: appearance
                .shading
                .as_ref()
                .map(|shading| Shade::new(shading, volume, step)),
            surfaces: surfaces.to_vec(),
        }
    }

    /// Whether two samples that follow each other matter together.
    pub(crate) fn needs_front(&self) -> bool {
        self.slabs.is_some() || !self.surfaces.is_empty()
    }

    /// Looks at sample `k` of a ray, whose value is `back`, the sample before having the value
    /// `front`, NaN if there is none.
    pub(crate) fn look(
        &self,
        samples: &Samples<'_>,
        ray: &mut RayResult,
        k: f32,
        [front, back]: [f32; 2],
    ) {
        let place = samples.place(k);
        let shaded = |colour, place| match &self.shade {
            Some(shade) => shade.of(samples, colour, place),
            None => colour,
        };
        let mut cross = |surface: &RawSurface| {
            let place = self.crossing(samples, k, [front, back], surface.raw);
            add(ray, surface.opacity, shaded(surface.colour, place));
        };
        for surface in &self.surfaces {
            if front < surface.raw && surface.raw <= back {
                cross(surface);
            }
        }
        for surface in self.surfaces.iter().rev() {
            if back < surface.raw && surface.raw <= front {
                cross(surface);
            }
        }
        let (opacity, colour) = match &self.slabs {
            Some(slabs) if !front.is_nan() && !back.is_nan() => {
                let item = slabs.item(front, back);
                (slabs.opacities[item], slabs.colours[item])
            }
            None if !back.is_nan() => {
                let entry = samples.table.index.of(back);
                (samples.table.opacities[entry], samples.table.colours[entry])
            }
            _ => return,
        };
        if opacity > 0.0 {
            let [r, g, b, _] = colour.map(f32::from);
            add(ray, opacity, shaded([r, g, b], place));
        }
    }

    /// Where the surface of a value lies between samples k − 1 and k.
    fn crossing(
        &self,
        samples: &Samples<'_>,
        k: f32,
        [front, back]: [f32; 2],
        raw: f32,
    ) -> [f32; 3] {
        let (mut near, mut far) = ((0.0, front), (1.0, back));
        let mut share = 0.0;
        for turn in 0..=SURFACE_TURNS {
            share = near.0 + (raw - near.1) / (far.1 - near.1) * (far.0 - near.0);
            if turn == SURFACE_TURNS {
                break;
            }
            let value = samples.value(samples.place(k - 1.0 + share));
            if (value < raw) == (front < raw) {
                near = (share, value);
            } else {
                far = (share, value);
            }
        }
        samples.place(k - 1.0 + share)
    }
}
