//! The golden pictures of the shared data: the path tracer against references with known error,
//! by the tests that their README calls binding, and against its slow twin.

#![cfg(feature = "tracer")]

use std::path::{Path, PathBuf};

use raywright::{
    bvh::{BuildParams, Bvh, Vec3},
    imaging::{Camera, Film, Image, TileLoop, read_pfm},
    tracer::{Integrator, Light, Material, Mesh, Rgb, Scene, Shot, Sides, World, load::load_scene},
};
use raywright_validation::{Estimate, ZTest};
use serde_json::Value;

/// Independent pictures from which the error of their mean is found.
const BATCHES: u32 = 16;

fn golden() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/data/golden/images")
}

fn floats(value: &Value) -> Vec3 {
    let channel = |i: usize| value[i].as_f64().expect("three numbers") as f32;
    Vec3::new(channel(0), channel(1), channel(2))
}

struct Golden {
    world: World,
    camera: Camera,
    width: u32,
    height: u32,
    tree: Bvh,
}

/// A golden scene; `None` with a message where the data is absent. `place` moves every point.
fn load(name: &str, place: impl Fn(Vec3) -> Vec3) -> Option<Golden> {
    let folder = golden().join(name);
    let Ok(text) = std::fs::read_to_string(folder.join("scene.json")) else {
        eprintln!("skipped: {} is absent", folder.display());
        return None;
    };
    let json: Value = serde_json::from_str(&text).expect("scene.json");
    let sides = if json["twosided"] == true {
        Sides::Both
    } else {
        Sides::Front
    };
    let mut scene = Scene::default();
    for entry in json["meshes"].as_array().expect("meshes") {
        let mut path = folder.join(entry["obj"].as_str().expect("obj"));
        if !path.exists() {
            path.set_extension("obj.gz");
        }
        let material = entry["material"].as_str().expect("material");
        let mut material = Material::diffuse(
            material,
            floats(&json["materials"][material]["reflectance"]),
        )
        .with_sides(sides);
        if let Some(radiance) = entry.get("radiance") {
            material = material.with_emission(floats(radiance));
        }
        for mesh in load_scene(&path).expect("a golden mesh").scene.meshes {
            let triangles = mesh.triangles.triangles().to_vec();
            let vertices = mesh
                .triangles
                .vertices()
                .iter()
                .map(|&v| place(v))
                .collect();
            let triangles = raywright::bvh::TriangleMesh::new(vertices, triangles).expect("valid");
            scene.meshes.push(Mesh {
                name: mesh.name,
                triangles,
                material: scene.materials.len(),
            });
        }
        scene.materials.push(material);
    }
    for light in json["lights"].as_array().expect("lights") {
        scene
            .lights
            .push(match light["type"].as_str().expect("type") {
                "point" => Light::Point {
                    position: floats(&light["position"]),
                    intensity: floats(&light["intensity"]),
                },
                "directional" => Light::Directional {
                    direction: floats(&light["direction"]),
                    irradiance: floats(&light["irradiance"]),
                },
                "constant" => Light::Constant {
                    radiance: floats(&light["radiance"]),
                },
                other => panic!("no light of type {other}"),
            });
    }
    let camera = &json["camera"];
    let pixels = |key: &str| camera[key].as_u64().expect("pixels") as u32;
    let (width, height) = (pixels("width"), pixels("height"));
    let camera = Camera {
        origin: place(floats(&camera["origin"])),
        target: place(floats(&camera["target"])),
        up: floats(&camera["up"]),
        vertical_fov_degrees: camera["vfov"].as_f64().expect("vfov") as f32,
    };
    let world = World::new(scene);
    let tree = world
        .build_tree(&BuildParams::default(), &mut Default::default())
        .expect("a tree");
    Some(Golden {
        world,
        camera,
        width,
        height,
        tree,
    })
}

impl Golden {
    fn render(&self, integrator: Integrator, seed: u64, samples: u32) -> Film {
        let mut film = Film::new(self.width, self.height).expect("a size");
        let shot = Shot {
            world: &self.world,
            camera: self.camera,
            integrator,
            seed,
        };
        let done = shot
            .render(&mut film, 0..samples, &TileLoop::new(), |_| &self.tree)
            .expect("a camera");
        assert_eq!(done, raywright::imaging::Completion::Finished);
        assert_eq!(film.rejected(), 0, "samples that are not finite");
        film
    }

    /// Mean of independent batches, and the standard error of that mean.
    fn batches(
        &self,
        integrator: Integrator,
        first_seed: u64,
        samples: u32,
    ) -> (Vec<[f32; 3]>, Vec<[f32; 3]>) {
        let mut sums = vec![([0_f64; 3], [0_f64; 3]); (self.width * self.height) as usize];
        for batch in 0..BATCHES {
            let mean = self
                .render(integrator, first_seed + u64::from(batch), samples)
                .mean();
            for ((sum, squares), pixel) in sums.iter_mut().zip(mean.pixels()) {
                for channel in 0..3 {
                    let value = f64::from(pixel[channel]);
                    sum[channel] += value;
                    squares[channel] += value * value;
                }
            }
        }
        let n = f64::from(BATCHES);
        let mean = |sum: f64| sum / n;
        let error =
            |sum: f64, squares: f64| ((squares - sum * sum / n).max(0.0) / (n - 1.0) / n).sqrt();
        sums.iter()
            .map(|(sum, squares)| {
                let channels = |f: &dyn Fn(usize) -> f64| std::array::from_fn(|c| f(c) as f32);
                (
                    channels(&|c| mean(sum[c])),
                    channels(&|c| error(sum[c], squares[c])),
                )
            })
            .unzip()
    }
}

fn compare(
    ours: &(Vec<[f32; 3]>, Vec<[f32; 3]>),
    reference: (&Image, &Image),
    width: u32,
) -> ZTest {
    ZTest::new(
        Estimate {
            mean: &ours.0,
            standard_error: &ours.1,
        },
        Estimate {
            mean: reference.0.pixels(),
            standard_error: reference.1.pixels(),
        },
        width as usize,
    )
}

/// Renders a golden picture; the value tests are asked too where ours has as many samples per
/// batch as the reference.
fn check(name: &str, path_length: u32, samples: u32, reference_samples: u32) {
    let Some(golden_scene) = load(name, |v| v) else {
        return;
    };
    let read = |what: &str| {
        read_pfm(
            golden()
                .join(name)
                .join(format!("K{path_length}.{what}.pfm")),
        )
        .expect("a picture")
    };
    let (mean, error) = (read("mean"), read("sem"));
    let ours = golden_scene.batches(Integrator::Path { path_length }, 1, samples);
    let test = compare(&ours, (&mean, &error), golden_scene.width);
    let mut faults = test.binding_faults();
    if samples >= reference_samples {
        faults.extend(test.value_faults());
    }
    eprintln!(
        "{name} K{path_length}: whole {:.2?}, blocks {:.3?}",
        test.whole, test.blocks
    );
    assert!(
        faults.is_empty(),
        "{name} K{path_length}: {faults:?}\n{test:?}"
    );

    // The same test must refuse a picture that is 2 % brighter, or it proves nothing.
    let brighter = |values: &[[f32; 3]]| {
        values
            .iter()
            .map(|v| v.map(|c| c * 1.02))
            .collect::<Vec<_>>()
    };
    let fault = (brighter(&ours.0), brighter(&ours.1));
    assert!(
        !compare(&fault, (&mean, &error), golden_scene.width)
            .binding_faults()
            .is_empty()
    );
}

#[test]
fn a_cornell_k1() {
    check("a_cornell", 1, 378, 378);
}

#[test]
fn a_cornell_k2() {
    check("a_cornell", 2, 128, 449);
}

#[test]
fn a_cornell_k3() {
    check("a_cornell", 3, 128, 544);
}

#[test]
fn a_cornell_k8() {
    check("a_cornell", 8, 64, 201);
}

#[test]
fn c_sponza_point_k1() {
    check("c_sponza_point", 1, 19, 19);
}

#[test]
fn c_sponza_point_k3() {
    check("c_sponza_point", 3, 32, 85);
}

#[test]
fn d_sponza_sky_k1() {
    check("d_sponza_sky", 1, 64, 95);
}

#[test]
fn d_sponza_sky_k3() {
    check("d_sponza_sky", 3, 24, 71);
}

#[test]
fn g2_closed_furnace_k1_and_k3() {
    check("g2_closed_furnace", 1, 270, 270);
    check("g2_closed_furnace", 3, 133, 133);
}

/// Σ ρ^i for ρ = 0.5, in a room of any size and at any place: the mean of the picture may lack no
/// more light than the edges that its coordinates can resolve.
#[test]
fn the_closed_furnace_keeps_its_closed_form_anywhere() {
    let cases = [
        (0.0, 1.0, 1e-4),
        (0.0, 1e-6, 1e-4),
        (0.0, 1e-3, 1e-4),
        (0.0, 1e3, 1e-4),
        (0.0, 1e6, 1e-4),
        (1_000.0, 1.0, 3e-4),
        (10_000.0, 1.0, 1e-3),
        (10_000.0, 1e-3, 1e-3),
    ];
    for (shift, scale, deficit_allowed) in cases {
        let Some(room) = load("g2_closed_furnace", |v| (v + shift) * scale) else {
            return;
        };
        for (path_length, exact) in [(0, 1.0), (1, 1.5), (3, 1.875), (8, 1.996_093_75)] {
            let samples = 600_000 / (room.width * room.height);
            let film = room.render(Integrator::Path { path_length }, 7, samples);
            let n = f64::from(room.width * room.height);
            let mean = film.mean().mean()[0];
            let error = film
                .standard_error()
                .pixels()
                .iter()
                .map(|p| f64::from(p[0]) * f64::from(p[0]))
                .sum::<f64>()
                .sqrt()
                / n;
            let deficit = 1.0 - mean / exact;
            eprintln!(
                "shift {shift} scale {scale} K{path_length}: deficit {deficit:.2e} ± {:.1e}",
                error / exact
            );
            assert!(
                deficit.abs() <= deficit_allowed + 4.0 * error / exact,
                "moved by {shift}, scaled by {scale}, K = {path_length}: {mean} instead of {exact}"
            );
        }
    }
}

/// Finding emitters by chance has the same mean as choosing them, with all weights right.
#[test]
fn the_naive_integrator_agrees() {
    for (name, path_length, samples) in [
        ("a_cornell", 1, 128),
        ("a_cornell", 3, 128),
        ("g2_closed_furnace", 3, 128),
        ("d_sponza_sky", 2, 16),
    ] {
        let Some(scene) = load(name, |v| v) else {
            return;
        };
        let clever = scene.batches(Integrator::Path { path_length }, 100, samples);
        let naive = scene.batches(Integrator::NaivePath { path_length }, 200, 4 * samples);
        let estimate = |(mean, standard_error)| Estimate {
            mean,
            standard_error,
        };
        let test = ZTest::new(
            estimate((&clever.0, &clever.1)),
            estimate((&naive.0, &naive.1)),
            scene.width as usize,
        );
        // Values of a naive picture of a small lamp are far from normal; blocks and whole are not.
        assert!(
            test.whole.iter().all(|z| z.abs() <= 4.0),
            "{name} K{path_length}: {test:?}"
        );
        assert!(test.blocks.1 <= 6.0, "{name} K{path_length}: {test:?}");
    }
}

/// Light is additive: twice the light is twice the picture, to the last bit.
#[test]
fn twice_the_light_is_twice_the_picture() {
    let Some(mut golden_scene) = load("a_cornell", |v| v) else {
        return;
    };
    let once = golden_scene
        .render(Integrator::Path { path_length: 3 }, 3, 4)
        .mean();
    let mut scene = golden_scene.world.scene().clone();
    for material in &mut scene.materials {
        material.emission *= 2.0;
    }
    golden_scene.world = World::new(scene);
    let twice = golden_scene
        .render(Integrator::Path { path_length: 3 }, 3, 4)
        .mean();
    let doubled: Vec<[f32; 3]> = once.pixels().iter().map(|p| p.map(|c| c * 2.0)).collect();
    assert!(once.pixels().iter().any(|p| Rgb::from(*p) != Rgb::ZERO));
    assert_eq!(twice.pixels(), doubled);
}
