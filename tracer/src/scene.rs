//! The scene model: what is rendered, as plain data.
//!
//! Conventions: right-handed, y up, any unit of length; colours are linear RGB with Rec. 709
//! primaries; radiance for surfaces and environments, intensity for point lights, irradiance on a
//! perpendicular surface for directional lights.

use raywright_bvh::{Aabb, TriangleMesh, Vec3};
use raywright_imaging::Camera;

/// A linear RGB colour or a radiometric quantity per channel.
pub type Rgb = Vec3;

/// Luminance of a linear Rec. 709 colour.
#[must_use]
#[inline]
pub fn luminance(colour: Rgb) -> f32 {
    colour.dot(Vec3::new(0.2126, 0.7152, 0.0722))
}

/// From which side of a surface light is scattered.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Sides {
    /// Only from the side that the geometric normal points to; black from behind.
    Front,
    /// From both sides alike.
    #[default]
    Both,
}

/// How a surface reflects and emits.
#[derive(Clone, Debug, PartialEq)]
pub struct Material {
    /// The name, as in the file that it came from.
    pub name: String,
    /// Albedo of the Lambert reflection, each channel in 0..=1.
    pub diffuse: Rgb,
    /// Specular reflectance as the file states it. It is not rendered; it enters the indicator
    /// `diffuse ratio`.
    pub specular: Rgb,
    /// Radiance emitted on the side of the geometric normal (counter-clockwise winding).
    pub emission: Rgb,
    /// Which sides reflect.
    pub sides: Sides,
}

impl Material {
    /// A Lambert material that reflects on both sides.
    #[must_use]
    pub fn diffuse(name: impl Into<String>, albedo: Rgb) -> Self {
        Self {
            name: name.into(),
            diffuse: albedo,
            specular: Rgb::ZERO,
            emission: Rgb::ZERO,
            sides: Sides::Both,
        }
    }

    /// The same material with `radiance` emitted.
    #[must_use]
    pub fn with_emission(self, radiance: Rgb) -> Self {
        Self {
            emission: radiance,
            ..self
        }
    }

    /// The same material with other reflecting sides.
    #[must_use]
    pub fn with_sides(self, sides: Sides) -> Self {
        Self { sides, ..self }
    }

    /// Whether it emits.
    #[must_use]
    #[inline]
    pub fn is_emissive(&self) -> bool {
        self.emission != Rgb::ZERO
    }
}

/// Triangles with one material; its place in [`Scene::meshes`] is the geometry id of its hits.
#[derive(Clone, Debug, PartialEq)]
pub struct Mesh {
    /// The name, as in the file that it came from.
    pub name: String,
    /// The triangles.
    pub triangles: TriangleMesh,
    /// Index into [`Scene::materials`].
    pub material: usize,
}

/// A light that is no surface. Emissive surfaces are meshes with an emissive material.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum Light {
    /// A point that sends `intensity` in all directions.
    Point {
        /// Where it is.
        position: Vec3,
        /// Radiant intensity.
        intensity: Rgb,
    },
    /// Parallel light from infinitely far away.
    Directional {
        /// The direction in which the light travels; need not be a unit vector.
        direction: Vec3,
        /// Irradiance on a surface perpendicular to it.
        irradiance: Rgb,
    },
    /// The same radiance from every direction in which a ray leaves the scene.
    Constant {
        /// Radiance.
        radiance: Rgb,
    },
}

/// Everything that is rendered.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Scene {
    /// The meshes; the index is the geometry id.
    pub meshes: Vec<Mesh>,
    /// The materials.
    pub materials: Vec<Material>,
    /// The lights that are no surfaces.
    pub lights: Vec<Light>,
    /// The camera that came with the scene, if one did.
    pub camera: Option<Camera>,
}

impl Scene {
    /// The number of triangles of all meshes.
    #[must_use]
    pub fn triangle_count(&self) -> usize {
        self.meshes
            .iter()
            .map(|m| m.triangles.triangles().len())
            .sum()
    }

    /// The box around all triangles.
    #[must_use]
    pub fn bounds(&self) -> Aabb {
        let corners = self.meshes.iter().flat_map(|mesh| {
            let vertices = mesh.triangles.vertices();
            mesh.triangles
                .triangles()
                .iter()
                .flatten()
                .map(|&index| vertices[index as usize])
        });
        corners.fold(Aabb::EMPTY, Aabb::extended_by)
    }

    /// Whether nothing emits light.
    #[must_use]
    pub fn is_dark(&self) -> bool {
        self.lights.is_empty()
            && self
                .meshes
                .iter()
                .all(|mesh| !self.materials[mesh.material].is_emissive())
    }

    /// Adds a clear sky and a high sun.
    pub fn add_sky(&mut self) {
        self.lights.extend([
            Light::Constant {
                radiance: Rgb::new(0.6, 0.8, 1.2),
            },
            Light::Directional {
                direction: Vec3::new(0.35, -1.0, 0.22),
                irradiance: Rgb::new(9.0, 8.0, 6.5),
            },
        ]);
    }

    /// Adds a point light where the camera stands, which lights grey surfaces `distance` away as
    /// a sky of radiance 1 would.
    pub fn add_headlight(&mut self, camera: &Camera, distance: f32) {
        let intensity = Rgb::splat(std::f32::consts::PI * distance * distance);
        self.lights.push(Light::Point {
            position: camera.origin,
            intensity,
        });
    }
}
