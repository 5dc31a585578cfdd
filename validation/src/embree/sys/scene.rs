//! Scenes of triangle meshes, and rays one at a time.

use std::{ffi::c_void, ptr};

use raywright_bvh::{Ray, TriangleMesh};

use super::{
    Device,
    api::{
        self, BUFFER_INDEX, BUFFER_VERTEX, Context3, FORMAT_FLOAT3, FORMAT_UINT3,
        GEOMETRY_TRIANGLE, NO_ID, RayHit, RayRecord, SceneHandle,
    },
};
use crate::embree::{EmbreeError, EmbreeHit, SceneSettings};

/// A scene whose meshes are there but whose trees are not built.
#[derive(Debug)]
pub struct PreparedScene<'a>(Handle<'a>);

/// A scene that can be asked with rays.
#[derive(Debug)]
pub struct Scene<'a> {
    pub(super) handle: Handle<'a>,
    /// Version 3 has the context before the ray, version 4 the arguments behind it.
    pub(super) context_first: bool,
}

// SAFETY: what a shared scene allows is to ask it with rays, which the library's manual allows to
// many threads at once on a scene that is committed; nothing of it asks the device for errors,
// which are kept per thread.
unsafe impl Sync for Scene<'_> {}

/// A scene's handle, released at the end.
#[derive(Debug)]
pub(super) struct Handle<'a> {
    pub(super) device: &'a Device,
    pub(super) scene: SceneHandle,
}

impl Device {
    /// Copies meshes into a new scene; the place of a mesh in the slice is its geometry id.
    ///
    /// # Errors
    /// What the library refuses.
    pub fn scene(
        &self,
        meshes: &[&TriangleMesh],
        settings: &SceneSettings,
    ) -> Result<PreparedScene<'_>, EmbreeError> {
        let api = self.api;
        // SAFETY: the device is alive (2).
        let scene = unsafe { (api.new_scene)(self.handle) };
        self.check()?;
        let handle = Handle {
            device: self,
            scene,
        };
        // SAFETY: the scene is alive; any number is allowed, and refused if it has no meaning.
        unsafe {
            (api.set_scene_build_quality)(scene, settings.quality as i32);
            (api.set_scene_flags)(scene, settings.flags());
        }
        for (mesh, id) in meshes.iter().zip(0..) {
            self.attach(mesh, id, settings, scene)?;
        }
        self.check()?;
        Ok(PreparedScene(handle))
    }

    fn attach(
        &self,
        mesh: &TriangleMesh,
        id: u32,
        settings: &SceneSettings,
        scene: SceneHandle,
    ) -> Result<(), EmbreeError> {
        let api = self.api;
        let (vertices, triangles) = (mesh.vertices(), mesh.triangles());
        // SAFETY: device and scene are alive (2). A new buffer has room for `count` elements of
        // twelve bytes and stays valid while the geometry lives, which is until it is released
        // below and the scene with it; it is null where the library refused. `Vec3` is three `f32`
        // and a triangle three `u32`, both without padding. The mesh's indices are below its
        // number of vertices, as `TriangleMesh` promises.
        unsafe {
            let geometry = (api.new_geometry)(self.handle, GEOMETRY_TRIANGLE);
            (api.set_geometry_build_quality)(geometry, settings.geometry_quality as i32);
            let buffer = |kind: i32, format: i32, count: usize| {
                (api.set_new_geometry_buffer)(geometry, kind, 0, format, 12, count)
            };
            let target = buffer(BUFFER_VERTEX, FORMAT_FLOAT3, vertices.len());
            if !target.is_null() {
                let source = vertices.as_ptr().cast::<[f32; 3]>();
                ptr::copy_nonoverlapping(source, target.cast(), vertices.len());
            }
            let target = buffer(BUFFER_INDEX, FORMAT_UINT3, triangles.len());
            if !target.is_null() {
                ptr::copy_nonoverlapping(triangles.as_ptr(), target.cast(), triangles.len());
            }
            (api.commit_geometry)(geometry);
            (api.attach_geometry_by_id)(scene, geometry, id);
            (api.release_geometry)(geometry);
        }
        self.check()
    }
}

impl<'a> PreparedScene<'a> {
    /// Builds the trees (`rtcCommitScene`).
    ///
    /// # Errors
    /// What the library refuses.
    pub fn commit(self) -> Result<Scene<'a>, EmbreeError> {
        let device = self.0.device;
        // SAFETY: the scene is alive (2).
        unsafe { (device.api.commit_scene)(self.0.scene) };
        device.check()?;
        Ok(Scene {
            context_first: device.major() < 4,
            handle: self.0,
        })
    }
}

impl Scene<'_> {
    /// The closest hit of a ray. Of hits at the same distance it may be any.
    #[must_use]
    #[inline]
    pub fn closest_hit(&self, ray: &Ray) -> Option<EmbreeHit> {
        let mut record = RayHit {
            ray: ray_record(ray),
            normal: [0.0; 3],
            u: 0.0,
            v: 0.0,
            primitive_id: NO_ID,
            geometry_id: NO_ID,
            instance_ids: [NO_ID; 13],
        };
        self.ask(
            self.handle.device.api.intersect1,
            ptr::from_mut(&mut record).cast(),
        );
        (record.geometry_id != NO_ID).then_some(EmbreeHit {
            t: record.ray.t_far,
            u: record.u,
            v: record.v,
            geometry_id: record.geometry_id,
            primitive_id: record.primitive_id,
        })
    }

    /// Whether a ray hits anything.
    #[must_use]
    #[inline]
    pub fn any_hit(&self, ray: &Ray) -> bool {
        let mut record = ray_record(ray);
        self.ask(
            self.handle.device.api.occluded1,
            ptr::from_mut(&mut record).cast(),
        );
        record.t_far == f32::NEG_INFINITY
    }

    #[inline]
    fn ask(
        &self,
        function: unsafe extern "C" fn(SceneHandle, *mut c_void, *mut c_void),
        record: *mut c_void,
    ) {
        let scene = self.handle.scene;
        if self.context_first {
            let mut context = Context3::new();
            // SAFETY: the scene is committed and alive; both records have the header's layout or
            // more room (3), and the alignment of 16 that the library asks for.
            unsafe { function(scene, ptr::from_mut(&mut context).cast(), record) }
        } else {
            // SAFETY: as above; no arguments mean the defaults.
            unsafe { function(scene, record, ptr::null_mut()) }
        }
    }
}

impl Drop for Handle<'_> {
    fn drop(&mut self) {
        // SAFETY: alive until here (2).
        unsafe { (self.device.api.release_scene)(self.scene) }
    }
}

#[inline]
fn ray_record(ray: &Ray) -> api::RayRecord {
    RayRecord {
        origin: ray.origin.to_array(),
        // Version 3 with assertions stops at a negative value; it acts as 0 here and there.
        t_near: ray.t_min.max(0.0),
        direction: ray.direction.to_array(),
        time: 0.0,
        t_far: ray.t_max,
        mask: u32::MAX,
        id: 0,
        flags: 0,
    }
}
