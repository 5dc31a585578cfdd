//! Scenes to measure on: real ones of the shared data, or the built-in ones.

use std::{
    collections::HashMap,
    env, fs,
    path::{Path, PathBuf},
};

use raywright_bvh::{TriangleMesh, Vec3};
use raywright_tracer::{World, automatic_camera, generate, imaging::Camera, load::load_scene};
use serde::Deserialize;

/// A scene.
#[derive(Debug)]
pub struct BenchScene {
    /// Its name.
    pub name: String,
    /// With the first camera of `cameras.json`.
    pub world: World,
    /// All its triangles in one mesh, as Embree's figures are taken.
    pub mesh: TriangleMesh,
}

#[derive(Deserialize)]
struct Cameras {
    scenes: HashMap<String, SceneCameras>,
}

/// What a file of cameras says of a scene; some say less.
#[derive(Debug, Deserialize)]
pub(crate) struct SceneCameras {
    pub(crate) triangles: Option<f64>,
    pub(crate) bounds_min: Option<[f64; 3]>,
    pub(crate) bounds_max: Option<[f64; 3]>,
    pub(crate) cameras: Vec<CameraLine>,
}

#[derive(Debug, Deserialize)]
pub(crate) struct CameraLine {
    pub(crate) name: Option<String>,
    pub(crate) eye: [f32; 3],
    pub(crate) target: [f32; 3],
    up: [f32; 3],
    pub(crate) fov_y_deg: f32,
}

/// The shared data beside the workspace: Cargo names this crate's folder to what it runs; otherwise
/// the current folder is taken for it.
pub(crate) fn scenes_folder() -> PathBuf {
    let member = env::var_os("CARGO_MANIFEST_DIR").map(PathBuf::from);
    let workspace = member.as_deref().and_then(Path::parent);
    workspace
        .unwrap_or(Path::new(""))
        .join("../shared/data/scenes")
}

/// The scenes called `names` that are in the shared data; the built-in scenes if none is. Says on
/// standard output what is left out and why.
#[must_use]
pub fn real_or_built_in(names: &[&str]) -> Vec<BenchScene> {
    let folder = scenes_folder();
    let mut scenes: Vec<BenchScene> = names
        .iter()
        .filter_map(|name| match load(&folder, name) {
            Ok(scene) => Some(scene),
            Err(why) => {
                println!("without {name}: {why}");
                None
            }
        })
        .collect();
    if scenes.is_empty() {
        println!("no real scenes: the built-in ones are taken");
        let built_in = generate::NAMES
            .iter()
            .filter_map(|&name| Some(bench_scene(name, World::new(generate::by_name(name)?))));
        scenes.extend(built_in);
    }
    scenes
}

fn load(folder: &Path, name: &str) -> Result<BenchScene, String> {
    let path = folder.join(name).join(format!("{name}.obj.gz"));
    let mut scene = load_scene(&path).map_err(|error| error.to_string())?.scene;
    scene.camera = camera(folder, name);
    let mut world = World::new(scene);
    if world.scene().camera.is_none() {
        let tree = world
            .build_tree(&Default::default(), &mut Default::default())
            .map_err(|error| error.to_string())?;
        let mut scene = world.scene().clone();
        scene.camera = Some(automatic_camera(&world, &tree));
        world = World::new(scene);
    }
    Ok(bench_scene(name, world))
}

/// The first camera of a scene in `cameras.json`.
fn camera(folder: &Path, name: &str) -> Option<Camera> {
    let scenes = cameras_file(folder)?;
    let line = scenes.get(name)?.cameras.first()?;
    Some(Camera {
        origin: line.eye.into(),
        target: line.target.into(),
        up: line.up.into(),
        vertical_fov_degrees: line.fov_y_deg,
    })
}

/// The scenes of `cameras.json` in a folder, if it can be read.
pub(crate) fn cameras_file(folder: &Path) -> Option<HashMap<String, SceneCameras>> {
    let text = fs::read_to_string(folder.join("cameras.json")).ok()?;
    let cameras: Cameras = serde_json::from_str(&text).ok()?;
    Some(cameras.scenes)
}

fn bench_scene(name: &str, world: World) -> BenchScene {
    let mesh = joined(world.scene().meshes.iter().map(|mesh| &mesh.triangles));
    BenchScene {
        name: name.to_owned(),
        world,
        mesh,
    }
}

/// All triangles in one mesh.
fn joined<'a>(meshes: impl Iterator<Item = &'a TriangleMesh>) -> TriangleMesh {
    let (mut vertices, mut triangles): (Vec<Vec3>, Vec<[u32; 3]>) = Default::default();
    for mesh in meshes {
        let first = vertices.len() as u32;
        vertices.extend(mesh.vertices());
        triangles.extend(mesh.triangles().iter().map(|t| t.map(|i| first + i)));
    }
    TriangleMesh::new(vertices, triangles).expect("parts of valid meshes")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn joining_keeps_the_triangles() {
        let world = World::new(generate::by_name("interior").expect("a scene"));
        let scene = bench_scene("interior", world);
        let meshes = &scene.world.scene().meshes;
        assert!(meshes.len() > 1);
        assert_eq!(
            scene.mesh.triangles().len(),
            scene.world.scene().triangle_count()
        );
        let last = &meshes[meshes.len() - 1].triangles;
        let ids = [last.triangles().len(), scene.mesh.triangles().len()].map(|n| n as u32 - 1);
        assert_eq!(last.corners(ids[0]), scene.mesh.corners(ids[1]));
    }
}
