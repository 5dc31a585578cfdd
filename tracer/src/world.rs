//! A scene made ready to be rendered: light tables, and what the scene needs.

use raywright_bvh::{Aabb, BuildError, BuildParams, BuildWorkspace, Bvh, Hit, TriangleMesh};

use crate::{
    emitters::Emitters,
    scene::{Light, Material, Rgb, Scene},
    surface::Surface,
};

/// What a scene contains; what it does not contain costs nothing. Found once, when the world is
/// made.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub struct Needs {
    /// Lights that next-event estimation can choose.
    pub next_event: bool,
    /// Light that a path finds by going on: emissive surfaces or an environment. Without it the
    /// last ray of a path need not be traced.
    pub found_by_rays: bool,
}

/// A scene with its light tables.
#[derive(Clone, Debug)]
pub struct World {
    scene: Scene,
    pub(crate) emitters: Emitters,
    environment: Rgb,
    needs: Needs,
}

impl World {
    /// Prepares a scene.
    #[must_use]
    pub fn new(scene: Scene) -> Self {
        let emitters = Emitters::new(&scene);
        let environment = scene
            .lights
            .iter()
            .map(|light| {
                if let Light::Constant { radiance } = light {
                    *radiance
                } else {
                    Rgb::ZERO
                }
            })
            .sum();
        let needs = Needs {
            next_event: !emitters.is_empty(),
            found_by_rays: emitters.any_mesh() || environment != Rgb::ZERO,
        };
        Self {
            scene,
            emitters,
            environment,
            needs,
        }
    }

    /// The scene.
    #[must_use]
    pub fn scene(&self) -> &Scene {
        &self.scene
    }

    /// What the scene contains.
    #[must_use]
    pub fn needs(&self) -> Needs {
        self.needs
    }

    /// The box around all triangles.
    #[must_use]
    pub fn bounds(&self) -> Aabb {
        self.scene.bounds()
    }

    /// Builds a tree over the scene's meshes in the memory of an earlier build, and of an earlier
    /// tree that was given to [`Bvh::recycle`].
    ///
    /// # Errors
    /// As [`Bvh::build`].
    pub fn build_tree(
        &self,
        params: &BuildParams,
        workspace: &mut BuildWorkspace,
    ) -> Result<Bvh, BuildError> {
        let meshes: Vec<&TriangleMesh> = self
            .scene
            .meshes
            .iter()
            .map(|mesh| &mesh.triangles)
            .collect();
        Bvh::build_in(&meshes, params, workspace)
    }

    /// The point of a hit and its material.
    #[inline]
    pub(crate) fn surface(&self, hit: &Hit) -> (Surface, &Material) {
        let mesh = &self.scene.meshes[hit.geometry_id as usize];
        (
            Surface::of_hit(&mesh.triangles, hit),
            &self.scene.materials[mesh.material],
        )
    }

    /// Radiance of the environment; the same from everywhere.
    #[inline]
    pub(crate) fn environment(&self) -> Rgb {
        self.environment
    }
}
