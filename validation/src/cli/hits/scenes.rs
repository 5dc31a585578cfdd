//! What `hits` asks: scenes by the names of their folders, and closed meshes.

use std::{error::Error, path::Path};

use raywright_bvh::{TriangleMesh, Vec3};
use raywright_validation::{TriangleSet, golden, hits};

/// The part of the conference room that is a copy of it at 1/73 of its size.
const MINIATURE: [Vec3; 2] = [
    Vec3::new(1618.0, -1.0, -1017.0),
    Vec3::new(1647.0, 1.5, -993.0),
];

/// The scene that has it.
const WITH_MINIATURE: &str = "conference";

/// A mesh with its name.
pub(super) struct Scene {
    pub(super) name: String,
    pub(super) mesh: TriangleMesh,
}

impl Scene {
    fn new(name: impl Into<String>, set: &TriangleSet) -> Result<Self, Box<dyn Error>> {
        let count = u32::try_from(set.triangles.len())?;
        let triangles = (0..count).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
        Ok(Self {
            name: name.into(),
            mesh: TriangleMesh::new(set.triangles.concat(), triangles)?,
        })
    }
}

/// The scenes of some names, the conference room also without its miniature; then the closed meshes.
pub(super) fn scenes(folder: &Path, names: &[String]) -> Result<Vec<Scene>, Box<dyn Error>> {
    let mut scenes = Vec::new();
    for name in names {
        let path = folder.join(name).join(format!("{name}.obj.gz"));
        let set = golden::read_obj(&path)?;
        if name == WITH_MINIATURE {
            let mut without = set.clone();
            without.triangles.retain(|corners| {
                let is_in = |v: &Vec3| v.cmpge(MINIATURE[0]).all() && v.cmple(MINIATURE[1]).all();
                !corners.iter().all(is_in)
            });
            scenes.push(Scene::new(
                format!("{name} without its miniature"),
                &without,
            )?);
        }
        scenes.push(Scene::new(name.as_str(), &set)?);
    }
    for set in hits::CLOSED.into_iter().filter_map(hits::closed) {
        scenes.push(Scene::new(set.name.as_str(), &set)?);
    }
    Ok(scenes)
}
