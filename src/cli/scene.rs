//! The scene that a command works on: a file or a built-in scene, its lights, its camera.

use std::path::Path;

use clap::Args;
use raywright::{
    bvh::{BuildParams, Bvh, Vec3},
    imaging::Camera,
    tracer::{Scene, World, automatic_camera, dark_distance, generate, load::load_scene},
};

use super::{Failure, output};

/// Which scene, seen from where.
#[derive(Clone, Debug, Args)]
pub(crate) struct SceneOptions {
    /// A file (.obj, .obj.gz) or a built-in scene (interior, voxel-terrain)
    pub(crate) scene: String,
    /// Where the camera stands: x,y,z (default: chosen to show much of the scene)
    #[arg(long, value_name = "X,Y,Z", value_parser = vector, allow_hyphen_values = true, requires = "camera_target")]
    camera_origin: Option<Vec3>,
    /// Where the camera looks: x,y,z
    #[arg(long, value_name = "X,Y,Z", value_parser = vector, allow_hyphen_values = true, requires = "camera_origin")]
    camera_target: Option<Vec3>,
    /// Full vertical field of view, in degrees
    #[arg(long, value_name = "DEGREES")]
    fov: Option<f32>,
    /// Add a sky and a sun to a scene that has lights of its own
    #[arg(long)]
    sky: bool,
}

/// A scene that is ready.
#[derive(Debug)]
pub(crate) struct Stage {
    /// Its name, for files and titles.
    pub(crate) name: String,
    pub(crate) world: World,
    pub(crate) camera: Camera,
    /// What the user should know about the scene.
    pub(crate) notes: Vec<String>,
}

impl SceneOptions {
    /// A built-in scene with its own camera.
    pub(crate) fn built_in(name: &str) -> Self {
        Self {
            scene: name.to_owned(),
            camera_origin: None,
            camera_target: None,
            fov: None,
            sky: false,
        }
    }

    /// Loads or generates the scene, and tells on standard error what the user should know.
    pub(crate) fn prepare(&self) -> Result<Stage, Failure> {
        let mut notes = Vec::new();
        let (name, mut scene) = self.load(&mut notes)?;
        let dark = scene.is_dark();
        if dark {
            notes.push("the scene has no lights: it gets a sky and a sun".into());
        }
        if dark || self.sky {
            scene.add_sky();
        }
        let mut world = World::new(scene);
        let tree = world.build_tree(&BuildParams::default(), &mut Default::default())?;
        let camera = self.camera(&world, &tree)?;
        if let Some(distance) = dark_distance(&world, &tree, &camera).filter(|_| dark) {
            notes.push(
                "the sky hardly reaches what the camera sees: a light at the camera is added"
                    .into(),
            );
            let mut scene = world.scene().clone();
            scene.add_headlight(&camera, distance);
            world = World::new(scene);
        }
        for note in &notes {
            output::note(format_args!("note: {note}"));
        }
        Ok(Stage {
            name,
            world,
            camera,
            notes,
        })
    }

    /// The scene as it is, without lights that it lacks; tells on standard error what the user should know.
    pub(crate) fn world(&self) -> Result<World, Failure> {
        let mut notes = Vec::new();
        let (_, scene) = self.load(&mut notes)?;
        for note in &notes {
            output::note(format_args!("note: {note}"));
        }
        Ok(World::new(scene))
    }

    /// Loads or generates the scene; its name.
    fn load(&self, notes: &mut Vec<String>) -> Result<(String, Scene), Failure> {
        let path = Path::new(&self.scene);
        match generate::by_name(&self.scene) {
            Some(scene) if !path.exists() => Ok((self.scene.clone(), scene)),
            _ => {
                let loaded = load_scene(path).map_err(|error| match path.exists() {
                    true => Failure::from(error),
                    false => Failure::with_hint(
                        error,
                        format!(
                            "give a file, or a built-in scene: {}",
                            generate::NAMES.join(", ")
                        ),
                    ),
                })?;
                notes.extend(loaded.warnings.iter().map(ToString::to_string));
                Ok((stem(path), loaded.scene))
            }
        }
    }

    fn camera(&self, world: &World, tree: &Bvh) -> Result<Camera, Failure> {
        let mut camera = match (self.camera_origin, self.camera_target, world.scene().camera) {
            (Some(origin), Some(target), _) => Camera {
                origin,
                target,
                up: Vec3::Y,
                vertical_fov_degrees: 60.0,
            },
            (_, _, Some(camera)) => camera,
            _ => automatic_camera(world, tree),
        };
        camera.vertical_fov_degrees = self.fov.unwrap_or(camera.vertical_fov_degrees);
        camera.validate()?;
        Ok(camera)
    }
}

/// The file name without its endings.
fn stem(path: &Path) -> String {
    let name = path.file_name().map_or_else(
        || "scene".into(),
        |name| name.to_string_lossy().into_owned(),
    );
    name.split('.')
        .next()
        .filter(|stem| !stem.is_empty())
        .unwrap_or("scene")
        .to_owned()
}

fn vector(text: &str) -> Result<Vec3, String> {
    let numbers: Result<Vec<f32>, _> = text.split(',').map(|n| n.trim().parse()).collect();
    match numbers.as_deref() {
        Ok(&[x, y, z]) => Ok(Vec3::new(x, y, z)),
        _ => Err("three numbers are needed, as in 1.5,0,-2".into()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stems_and_vectors() {
        assert_eq!(stem(Path::new("a/sponza.obj.gz")), "sponza");
        assert_eq!(stem(Path::new("..")), "scene");
        assert_eq!(vector("1, -2.5,3e1"), Ok(Vec3::new(1.0, -2.5, 30.0)));
        assert!(vector("1,2").is_err() && vector("a,b,c").is_err());
    }
}
