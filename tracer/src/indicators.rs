//! The 17 indicators of a scene and a camera from which a tuner predicts: Table 2 of Herveau,
//! Pfaffe, Tillmann, Tichy, Dachsbacher, *Analysis of Acceleration Structure Parameters and Hybrid
//! Autotuning for Ray Tracing*.
//!
//! Everything about surfaces is relative to the squared diagonal of the scene's box, so that a
//! change of unit changes only positions and extent. Open points of the paper, decided here:
//! variances are those of the population; the diffuse ratio is weighted by area, of a material
//! diffuse luminance ÷ (diffuse + specular), 1 for a black one; lights are emitters as listed, an
//! emissive mesh counting as one. Sums are taken in f64 in the order of the meshes.

use raywright_imaging::Camera;

use crate::{
    emitters::areas,
    scene::{Material, Scene, luminance},
};

/// Names and the range from which each is normalised, in the order of [`Indicators::values`].
pub const INDICATORS: [(&str, f64, f64); 17] = [
    ("mesh_count", 0.0, 1e5),
    ("triangle_count", 0.0, 1e7),
    ("light_count", 0.0, 1e5),
    ("camera_x", -10.0, 10.0),
    ("camera_y", -10.0, 10.0),
    ("camera_z", -10.0, 10.0),
    ("target_x", -10.0, 10.0),
    ("target_y", -10.0, 10.0),
    ("target_z", -10.0, 10.0),
    ("vertical_fov_degrees", 0.0, 180.0),
    ("diffuse_ratio", 0.0, 1.0),
    ("extent", 0.0, 1e5),
    ("total_area", 0.0, 10.0),
    ("light_area", 0.0, 10.0),
    ("area_per_mesh", 0.0, 10.0),
    ("triangle_size_variance_mean", 0.0, 1e-2),
    ("triangle_size_variance_variance", 0.0, 1e-2),
];

/// The indicators of one scene seen by one camera.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Indicators {
    values: [f64; 17],
}

impl Indicators {
    /// Computes them. A scene without extent has no relative areas: they are 0.
    #[must_use]
    pub fn of(scene: &Scene, camera: &Camera) -> Self {
        let extent = f64::from(scene.bounds().diagonal());
        let relative = if extent > 0.0 {
            1.0 / (extent * extent)
        } else {
            0.0
        };
        let (mut total_area, mut light_area, mut diffuse_area) = (0.0, 0.0, 0.0);
        let mut emissive_meshes = 0;
        let mut variances = Vec::with_capacity(scene.meshes.len());
        for mesh in &scene.meshes {
            let material = &scene.materials[mesh.material];
            let areas = areas(mesh);
            let area = areas.iter().sum::<f64>() * relative;
            total_area += area;
            diffuse_area += area * diffuse_share(material);
            if material.is_emissive() {
                light_area += area;
                emissive_meshes += 1;
            }
            variances.push(variance(
                &areas.iter().map(|a| a * relative).collect::<Vec<_>>(),
            ));
        }
        let meshes = scene.meshes.len();
        let [camera_x, camera_y, camera_z] = camera.origin.to_array().map(f64::from);
        let [target_x, target_y, target_z] = camera.target.to_array().map(f64::from);
        Self {
            values: [
                meshes as f64,
                scene.triangle_count() as f64,
                (emissive_meshes + scene.lights.len()) as f64,
                camera_x,
                camera_y,
                camera_z,
                target_x,
                target_y,
                target_z,
                f64::from(camera.vertical_fov_degrees),
                if total_area > 0.0 {
                    diffuse_area / total_area
                } else {
                    1.0
                },
                extent,
                total_area,
                light_area,
                if meshes > 0 {
                    total_area / meshes as f64
                } else {
                    0.0
                },
                mean(&variances),
                variance(&variances),
            ],
        }
    }

    /// The values, in the order of [`INDICATORS`].
    #[must_use]
    pub fn values(&self) -> &[f64; 17] {
        &self.values
    }

    /// Name and value of each.
    pub fn named(&self) -> impl Iterator<Item = (&'static str, f64)> {
        INDICATORS.iter().map(|(name, ..)| *name).zip(self.values)
    }

    /// Each mapped from its range to 0..1 and clamped, and how many had to be clamped.
    #[must_use]
    pub fn normalised(&self) -> ([f64; 17], usize) {
        let mut clamped = 0;
        let normalised = std::array::from_fn(|i| {
            let (_, min, max) = INDICATORS[i];
            let x = (self.values[i] - min) / (max - min);
            clamped += usize::from(!(0.0..=1.0).contains(&x));
            x.clamp(0.0, 1.0)
        });
        (normalised, clamped)
    }
}

fn diffuse_share(material: &Material) -> f64 {
    let (diffuse, specular) = (
        f64::from(luminance(material.diffuse)),
        f64::from(luminance(material.specular)),
    );
    if diffuse + specular > 0.0 {
        diffuse / (diffuse + specular)
    } else {
        1.0
    }
}

fn mean(values: &[f64]) -> f64 {
    if values.is_empty() {
        0.0
    } else {
        values.iter().sum::<f64>() / values.len() as f64
    }
}

fn variance(values: &[f64]) -> f64 {
    let centre = mean(values);
    mean(
        &values
            .iter()
            .map(|v| (v - centre) * (v - centre))
            .collect::<Vec<_>>(),
    )
}

#[cfg(test)]
mod tests {
    use raywright_bvh::{TriangleMesh, Vec3};

    use super::*;
    use crate::scene::{Mesh, Rgb};

    fn cube(scale: f32) -> Scene {
        let vertices = (0..8)
            .map(|i| Vec3::new((i & 1) as f32, (i >> 1 & 1) as f32, (i >> 2) as f32) * scale)
            .collect();
        let faces = [
            [0, 1, 3, 2],
            [4, 6, 7, 5],
            [0, 4, 5, 1],
            [2, 3, 7, 6],
            [0, 2, 6, 4],
            [1, 5, 7, 3],
        ];
        let triangles = faces
            .iter()
            .flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]])
            .collect();
        Scene {
            meshes: vec![Mesh {
                name: "cube".into(),
                triangles: TriangleMesh::new(vertices, triangles).unwrap(),
                material: 0,
            }],
            materials: vec![Material {
                specular: Rgb::splat(0.25),
                ..Material::diffuse("grey", Rgb::splat(0.75))
            }],
            ..Scene::default()
        }
    }

    fn camera() -> Camera {
        Camera {
            origin: Vec3::new(1.0, 2.0, 3.0),
            target: Vec3::new(0.5, 0.5, 0.5),
            up: Vec3::Y,
            vertical_fov_degrees: 50.0,
        }
    }

    fn get(indicators: &Indicators, name: &str) -> f64 {
        indicators.named().find(|(n, _)| *n == name).unwrap().1
    }

    #[test]
    fn unit_cube_in_closed_form() {
        let got = Indicators::of(&cube(1.0), &camera());
        for (name, expected) in [
            ("mesh_count", 1.0),
            ("triangle_count", 12.0),
            ("light_count", 0.0),
            ("camera_y", 2.0),
            ("target_z", 0.5),
            ("vertical_fov_degrees", 50.0),
            ("diffuse_ratio", 0.75),
            ("extent", 3f64.sqrt()),
            ("total_area", 2.0),
            ("light_area", 0.0),
            ("area_per_mesh", 2.0),
            ("triangle_size_variance_mean", 0.0),
            ("triangle_size_variance_variance", 0.0),
        ] {
            assert!(
                (get(&got, name) - expected).abs() < 1e-6,
                "{name}: {}",
                get(&got, name)
            );
        }
    }

    #[test]
    fn a_change_of_unit_changes_positions_and_extent_alone() {
        let (small, large) = (
            Indicators::of(&cube(1.0), &camera()),
            Indicators::of(&cube(1000.0), &camera()),
        );
        for ((name, a), (_, b)) in small.named().zip(large.named()) {
            if name == "extent" {
                assert!((b / a - 1000.0).abs() < 1e-3);
            } else {
                assert!((a - b).abs() < 1e-6, "{name}: {a} {b}");
            }
        }
    }

    #[test]
    fn normalised_values_are_clamped_and_counted() {
        let (values, clamped) = Indicators::of(&cube(1e6), &camera()).normalised();
        assert!(values.iter().all(|v| (0.0..=1.0).contains(v)));
        assert_eq!(clamped, 1, "only the extent is out of range");
    }
}
