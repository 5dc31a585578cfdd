//! Choosing and sampling lights for next-event estimation.
//!
//! An emitter is a mesh with an emissive material, a point, or a parallel light; one is chosen by
//! a mixture of equal chances and chances in proportion to power (defensive sampling, Hesterberg
//! 1995: no light that matters nearby can starve). A constant environment is no emitter: sampling
//! the cosine finds it better than any choice of direction.
//!
//! Invariant: [`Emitters::density`] is the one function for the density of a sampled point; both
//! sides of multiple importance sampling use it.

use raywright_bvh::Vec3;

use crate::{
    sampling::uniform_triangle,
    scene::{Light, Mesh, Rgb, Scene, luminance},
    surface::Surface,
};

/// Share of the chances that is equal for all.
const EQUAL_SHARE: f64 = 0.5;

/// What next-event estimation may choose.
#[derive(Clone, Debug)]
enum Emitter {
    Mesh(MeshEmitter),
    Point { position: Vec3, intensity: Rgb },
    Directional { towards: Vec3, irradiance: Rgb },
}

#[derive(Clone, Debug)]
struct MeshEmitter {
    geometry_id: usize,
    radiance: Rgb,
    area: f64,
    /// Share of the mesh's area up to and including each triangle.
    cumulative: Vec<f32>,
}

/// A light seen from a point: what arrives if nothing is between.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LightSample {
    /// Unit vector towards the light.
    pub(crate) direction: Vec3,
    /// Radiance, or irradiance of a perpendicular surface for lights without extent; of a sample,
    /// divided by the probability (density) of the choice.
    pub(crate) value: Rgb,
    /// Probability density per solid angle; `None` for lights that no ray can hit by chance.
    pub(crate) density: Option<f32>,
    /// What must be free for the light to arrive.
    pub(crate) shadow_ray: raywright_bvh::Ray,
}

/// All emitters of a scene.
#[derive(Clone, Debug, Default)]
pub(crate) struct Emitters {
    emitters: Vec<Emitter>,
    probability: Vec<f32>,
    cumulative: Vec<f32>,
    /// Place in `emitters` of each emissive mesh, by geometry id.
    of_geometry: Vec<Option<u32>>,
}

impl Emitters {
    pub(crate) fn new(scene: &Scene) -> Self {
        let mut emitters = Vec::new();
        let mut power = Vec::new();
        let mut of_geometry = vec![None; scene.meshes.len()];
        for (geometry_id, mesh) in scene.meshes.iter().enumerate() {
            let radiance = scene.materials[mesh.material].emission;
            let areas = areas(mesh);
            let area: f64 = areas.iter().sum();
            if luminance(radiance) > 0.0 && area > 0.0 {
                of_geometry[geometry_id] = Some(emitters.len() as u32);
                power.push(std::f64::consts::PI * area * f64::from(luminance(radiance)));
                let cumulative = cumulative(&areas);
                emitters.push(Emitter::Mesh(MeshEmitter {
                    geometry_id,
                    radiance,
                    area,
                    cumulative,
                }));
            }
        }
        let radius = f64::from(scene.bounds().diagonal()) / 2.0;
        for light in &scene.lights {
            match *light {
                Light::Point {
                    position,
                    intensity,
                } if luminance(intensity) > 0.0 => {
                    power.push(4.0 * std::f64::consts::PI * f64::from(luminance(intensity)));
                    emitters.push(Emitter::Point {
                        position,
                        intensity,
                    });
                }
                Light::Directional {
                    direction,
                    irradiance,
                } if luminance(irradiance) > 0.0 => {
                    power.push(
                        std::f64::consts::PI * radius * radius * f64::from(luminance(irradiance)),
                    );
                    emitters.push(Emitter::Directional {
                        towards: -direction.normalize_or_zero(),
                        irradiance,
                    });
                }
                _ => {}
            }
        }
        let total: f64 = power.iter().sum();
        let chances: Vec<f64> = power
            .iter()
            .map(|p| EQUAL_SHARE / power.len() as f64 + (1.0 - EQUAL_SHARE) * p / total)
            .collect();
        let cumulative = cumulative(&chances);
        // The chances that the cumulative table really gives, rounding included.
        let probability = (0..cumulative.len())
            .map(|i| cumulative[i] - if i == 0 { 0.0 } else { cumulative[i - 1] })
            .collect();
        Self {
            emitters,
            probability,
            cumulative,
            of_geometry,
        }
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.emitters.is_empty()
    }

    /// Whether a ray can hit an emitter.
    pub(crate) fn any_mesh(&self) -> bool {
        self.emitters
            .iter()
            .any(|emitter| matches!(emitter, Emitter::Mesh(_)))
    }

    /// Samples a light for a point on a surface; `None` if the light cannot arrive there.
    #[inline]
    pub(crate) fn sample(
        &self,
        meshes: &[Mesh],
        at: &Surface,
        choice: [f32; 2],
        uniform: [f32; 2],
    ) -> Option<LightSample> {
        let index = choose(&self.cumulative, choice[0]);
        let probability = self.probability[index];
        match &self.emitters[index] {
            Emitter::Mesh(emitter) => {
                let triangle = choose(&emitter.cumulative, choice[1]);
                let corners = meshes[emitter.geometry_id]
                    .triangles
                    .corners(triangle as u32);
                let point = Surface::at(corners, uniform_triangle(uniform));
                let between = point.position - at.position;
                let direction = between.normalize_or_zero();
                let density = self.density(emitter.geometry_id, &point, at.position, direction)?;
                Some(LightSample {
                    direction,
                    value: emitter.radiance / density,
                    density: Some(density),
                    shadow_ray: at.segment_to(&point),
                })
            }
            emitter => {
                let light = emitter.without_extent(at)?;
                Some(LightSample {
                    value: light.value / probability,
                    ..light
                })
            }
        }
    }

    /// Probability density per solid angle with which [`Emitters::sample`] chooses `point`, a
    /// point of the mesh `geometry_id`, as seen from `from` in the unit direction `direction`.
    /// `None` if the mesh does not emit towards `from`.
    #[inline]
    pub(crate) fn density(
        &self,
        geometry_id: usize,
        point: &Surface,
        from: Vec3,
        direction: Vec3,
    ) -> Option<f32> {
        let index = self.of_geometry[geometry_id]? as usize;
        let Emitter::Mesh(emitter) = &self.emitters[index] else {
            return None;
        };
        let cosine = -point.normal.dot(direction);
        let distance_squared = point.position.distance_squared(from);
        if cosine <= 0.0 || distance_squared == 0.0 {
            return None;
        }
        Some(self.probability[index] * distance_squared / (emitter.area as f32 * cosine))
    }

    /// All lights without extent, with what arrives at a surface that faces them: for the naive
    /// integrator, which makes no choice.
    pub(crate) fn without_extent(&self, at: &Surface) -> impl Iterator<Item = LightSample> {
        self.emitters
            .iter()
            .filter_map(|emitter| emitter.without_extent(at))
    }
}

impl Emitter {
    /// What arrives from a point or a parallel light.
    #[inline]
    fn without_extent(&self, at: &Surface) -> Option<LightSample> {
        match *self {
            Self::Mesh(_) => None,
            Self::Point {
                position,
                intensity,
            } => {
                let between = position - at.position;
                let distance_squared = between.length_squared();
                (distance_squared > 0.0).then(|| LightSample {
                    direction: between / distance_squared.sqrt(),
                    value: intensity / distance_squared,
                    density: None,
                    shadow_ray: at.segment_to_point(position),
                })
            }
            Self::Directional {
                towards,
                irradiance,
            } => Some(LightSample {
                direction: towards,
                value: irradiance,
                density: None,
                shadow_ray: at.ray_towards(towards),
            }),
        }
    }
}

/// The area of each triangle.
pub(crate) fn areas(mesh: &Mesh) -> Vec<f64> {
    let area = |id: usize| {
        let [a, b, c] = mesh.triangles.corners(id as u32).map(Vec3::as_dvec3);
        (b - a).cross(c - a).length() / 2.0
    };
    (0..mesh.triangles.triangles().len()).map(area).collect()
}

/// The running sum of weights, as a share of their total; the last is exactly 1.
fn cumulative(weights: &[f64]) -> Vec<f32> {
    let total: f64 = weights.iter().sum();
    let mut sum = 0.0;
    let mut cumulative: Vec<f32> = weights
        .iter()
        .map(|weight| {
            sum += weight;
            (sum / total) as f32
        })
        .collect();
    if let Some(last) = cumulative.last_mut() {
        *last = 1.0;
    }
    cumulative
}

/// The first place whose cumulative share is above `uniform` (in 0..1).
#[inline]
fn choose(cumulative: &[f32], uniform: f32) -> usize {
    cumulative
        .partition_point(|&share| share <= uniform)
        .min(cumulative.len() - 1)
}
