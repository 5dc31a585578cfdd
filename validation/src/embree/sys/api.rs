//! Declarations: functions, structs, constants of `rtcore.h`.

use std::{
    ffi::{c_char, c_void},
    path::Path,
    ptr,
};

use libloading::{Error, Library};

pub(super) type DeviceHandle = *mut c_void;
pub(super) type SceneHandle = *mut c_void;
pub(super) type GeometryHandle = *mut c_void;
pub(super) type BvhHandle = *mut c_void;
pub(super) type Allocator = *mut c_void;

pub(super) const PROPERTY_VERSION: i32 = 0;
pub(super) const PROPERTY_NATIVE_RAY8: i32 = 33;
pub(super) const PROPERTY_NATIVE_RAY16: i32 = 34;
pub(super) const GEOMETRY_TRIANGLE: i32 = 0;
pub(super) const BUFFER_INDEX: i32 = 0;
pub(super) const BUFFER_VERTEX: i32 = 1;
pub(super) const FORMAT_UINT3: i32 = 0x5003;
pub(super) const FORMAT_FLOAT3: i32 = 0x9003;
/// `RTC_INVALID_GEOMETRY_ID`.
pub(super) const NO_ID: u32 = u32::MAX;

/// `RTCBuildPrimitive`.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(32))]
pub(super) struct Primitive {
    pub(super) lower: [f32; 3],
    pub(super) geometry_id: u32,
    pub(super) upper: [f32; 3],
    pub(super) primitive_id: u32,
}

/// `RTCBounds`.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(16))]
pub(super) struct Bounds {
    pub(super) lower: [f32; 3],
    pub(super) padding0: f32,
    pub(super) upper: [f32; 3],
    pub(super) padding1: f32,
}

/// `RTCRay`.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(16))]
pub(super) struct RayRecord {
    pub(super) origin: [f32; 3],
    pub(super) t_near: f32,
    pub(super) direction: [f32; 3],
    pub(super) time: f32,
    pub(super) t_far: f32,
    pub(super) mask: u32,
    pub(super) id: u32,
    pub(super) flags: u32,
}

/// `RTCRayHit`, with room for what later versions add to the hit.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(16))]
pub(super) struct RayHit {
    pub(super) ray: RayRecord,
    pub(super) normal: [f32; 3],
    pub(super) u: f32,
    pub(super) v: f32,
    pub(super) primitive_id: u32,
    pub(super) geometry_id: u32,
    pub(super) instance_ids: [u32; 13],
}

/// Rays of a packet.
pub(super) const PACKET: usize = 8;

/// `RTCRay8`.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(32))]
pub(super) struct RayRecord8 {
    pub(super) origin: [[f32; PACKET]; 3],
    pub(super) t_near: [f32; PACKET],
    pub(super) direction: [[f32; PACKET]; 3],
    pub(super) time: [f32; PACKET],
    pub(super) t_far: [f32; PACKET],
    pub(super) mask: [u32; PACKET],
    pub(super) id: [u32; PACKET],
    pub(super) flags: [u32; PACKET],
}

/// `RTCRayHit8`, with room for what later versions add to the hit.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(32))]
pub(super) struct RayHit8 {
    pub(super) ray: RayRecord8,
    pub(super) normal: [[f32; PACKET]; 3],
    pub(super) u: [f32; PACKET],
    pub(super) v: [f32; PACKET],
    pub(super) primitive_id: [u32; PACKET],
    pub(super) geometry_id: [u32; PACKET],
    pub(super) instance_ids: [[u32; PACKET]; 4],
}

/// Which rays of a packet are there: −1, or 0 for those that are not.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(32))]
pub(super) struct Valid8(pub(super) [i32; PACKET]);

/// `RTCIntersectContext` of version 3, with room to spare.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(16))]
pub(super) struct Context3 {
    pub(super) flags: u32,
    pub(super) padding: u32,
    pub(super) filter: *const c_void,
    pub(super) instance_id: u32,
    pub(super) rest: [u32; 27],
}

impl Context3 {
    /// The context of rays without filter and instance.
    #[inline]
    pub(super) fn new() -> Self {
        Self {
            flags: 0,
            padding: 0,
            filter: ptr::null(),
            instance_id: NO_ID,
            rest: [0; 27],
        }
    }
}

pub(super) type CreateNode = extern "C" fn(Allocator, u32, *mut c_void) -> *mut c_void;
pub(super) type SetChildren = extern "C" fn(*mut c_void, *mut *mut c_void, u32, *mut c_void);
pub(super) type SetBounds = extern "C" fn(*mut c_void, *mut *const Bounds, u32, *mut c_void);
pub(super) type CreateLeaf =
    extern "C" fn(Allocator, *const Primitive, usize, *mut c_void) -> *mut c_void;
pub(super) type SplitPrimitive =
    extern "C" fn(*const Primitive, u32, f32, *mut Bounds, *mut Bounds, *mut c_void);

/// User pointer, bytes (negative: given back), and whether they are already there; returns whether to go on.
pub(super) type WatchMemory = extern "C" fn(*mut c_void, isize, bool) -> bool;

/// `RTCBuildArguments`.
#[derive(Debug)]
#[repr(C)]
pub(super) struct Arguments {
    pub(super) byte_size: usize,
    pub(super) quality: i32,
    pub(super) flags: i32,
    pub(super) branching_factor: u32,
    pub(super) max_depth: u32,
    pub(super) sah_block_size: u32,
    pub(super) min_leaf_size: u32,
    pub(super) max_leaf_size: u32,
    pub(super) traversal_cost: f32,
    pub(super) intersection_cost: f32,
    pub(super) bvh: BvhHandle,
    pub(super) primitives: *mut Primitive,
    pub(super) primitive_count: usize,
    pub(super) primitive_capacity: usize,
    pub(super) create_node: CreateNode,
    pub(super) set_node_children: SetChildren,
    pub(super) set_node_bounds: SetBounds,
    pub(super) create_leaf: CreateLeaf,
    pub(super) split_primitive: Option<SplitPrimitive>,
    pub(super) progress: *const c_void,
    pub(super) user: *mut c_void,
}

/// Declares the functions of a struct and loads each by its name.
macro_rules! functions {
    ($($(#[$doc:meta])* $field:ident = $symbol:literal: fn($($argument:ty),*) $(-> $result:ty)?;)*) => {
        /// The functions of a library.
        #[derive(Debug)]
        pub(super) struct Api {
            $($(#[$doc])* pub(super) $field: unsafe extern "C" fn($($argument),*) $(-> $result)?,)*
        }

        impl Api {
            /// Loads the library and its functions. The library stays in memory for ever.
            pub(super) fn load(path: &Path) -> Result<Self, Error> {
                // SAFETY: a library's initialisers run here; that of Embree is documented to need
                // nothing. That the file is Embree is the caller's word (see `Embree::load`).
                let library = unsafe { Library::new(path) }?;
                let api = Self {
                    $($field:
                        // SAFETY: the name belongs to a function of this type in `rtcore.h`, and
                        // the library is not unloaded while the pointer lives.
                        *unsafe { library.get(concat!($symbol, "\0").as_bytes()) }?,)*
                };
                std::mem::forget(library);
                Ok(api)
            }
        }
    };
}

functions! {
    new_device = "rtcNewDevice": fn(*const c_char) -> DeviceHandle;
    release_device = "rtcReleaseDevice": fn(DeviceHandle);
    get_device_error = "rtcGetDeviceError": fn(DeviceHandle) -> i32;
    get_device_property = "rtcGetDeviceProperty": fn(DeviceHandle, i32) -> isize;
    set_memory_monitor = "rtcSetDeviceMemoryMonitorFunction": fn(DeviceHandle, WatchMemory, *mut c_void);
    new_bvh = "rtcNewBVH": fn(DeviceHandle) -> BvhHandle;
    build_bvh = "rtcBuildBVH": fn(*const Arguments) -> *mut c_void;
    thread_local_alloc = "rtcThreadLocalAlloc": fn(Allocator, usize, usize) -> *mut c_void;
    release_bvh = "rtcReleaseBVH": fn(BvhHandle);
    new_scene = "rtcNewScene": fn(DeviceHandle) -> SceneHandle;
    set_scene_build_quality = "rtcSetSceneBuildQuality": fn(SceneHandle, i32);
    set_scene_flags = "rtcSetSceneFlags": fn(SceneHandle, i32);
    commit_scene = "rtcCommitScene": fn(SceneHandle);
    release_scene = "rtcReleaseScene": fn(SceneHandle);
    new_geometry = "rtcNewGeometry": fn(DeviceHandle, i32) -> GeometryHandle;
    set_geometry_build_quality = "rtcSetGeometryBuildQuality": fn(GeometryHandle, i32);
    set_new_geometry_buffer = "rtcSetNewGeometryBuffer":
        fn(GeometryHandle, i32, u32, i32, usize, usize) -> *mut c_void;
    commit_geometry = "rtcCommitGeometry": fn(GeometryHandle);
    attach_geometry_by_id = "rtcAttachGeometryByID": fn(SceneHandle, GeometryHandle, u32);
    release_geometry = "rtcReleaseGeometry": fn(GeometryHandle);
    /// Version 4: scene, ray and hit, arguments. Version 3: scene, context, ray and hit.
    intersect1 = "rtcIntersect1": fn(SceneHandle, *mut c_void, *mut c_void);
    /// Version 4: scene, ray, arguments. Version 3: scene, context, ray.
    occluded1 = "rtcOccluded1": fn(SceneHandle, *mut c_void, *mut c_void);
    /// As `intersect1`, behind which rays are there.
    intersect8 = "rtcIntersect8": fn(*const Valid8, SceneHandle, *mut c_void, *mut c_void);
    /// As `occluded1`, behind which rays are there.
    occluded8 = "rtcOccluded8": fn(*const Valid8, SceneHandle, *mut c_void, *mut c_void);
}

#[cfg(test)]
mod tests {
    use std::mem::{align_of, offset_of, size_of};

    use super::*;

    /// Sizes and places as a C compiler gives them to the structs of `rtcore.h` on 64 bits.
    #[test]
    #[cfg(target_pointer_width = "64")]
    fn structs_have_the_layout_of_the_header() {
        assert_eq!((size_of::<Primitive>(), align_of::<Primitive>()), (32, 32));
        assert_eq!((size_of::<Bounds>(), align_of::<Bounds>()), (32, 16));
        assert_eq!(size_of::<RayRecord>(), 48);
        assert_eq!(offset_of!(RayHit, u), 60);
        assert_eq!(offset_of!(RayHit, geometry_id), 72);
        assert_eq!(size_of::<RayHit>(), 128);
        assert_eq!(
            (size_of::<RayRecord8>(), align_of::<RayRecord8>()),
            (384, 32)
        );
        assert_eq!(offset_of!(RayRecord8, t_far), 256);
        assert_eq!(offset_of!(RayHit8, u), 480);
        assert_eq!(offset_of!(RayHit8, geometry_id), 576);
        assert_eq!((size_of::<Valid8>(), align_of::<Valid8>()), (32, 32));
        assert_eq!(offset_of!(Context3, filter), 8);
        assert_eq!(offset_of!(Context3, instance_id), 16);
        assert_eq!(offset_of!(Arguments, intersection_cost), 40);
        assert_eq!(offset_of!(Arguments, bvh), 48);
        assert_eq!(size_of::<Arguments>(), 136);
    }

    /// The same against what bindgen makes of the headers of Embree 4: size, alignment, and the place of every field.
    #[test]
    #[cfg(feature = "embree4-sys")]
    fn structs_have_the_layout_that_bindgen_finds() {
        macro_rules! same_places {
            ($own:ty, $other:ty: $($field:ident = $other_field:ident $(. $other_within:ident)*),* $(,)?) => {
                $(assert_eq!(
                    offset_of!($own, $field),
                    offset_of!($other, $other_field $(. $other_within)*),
                    stringify!($other $other_field),
                );)*
            };
        }
        fn same_shape<A, B>() {
            let of_b = (size_of::<B>(), align_of::<B>());
            assert_eq!(
                (size_of::<A>(), align_of::<A>()),
                of_b,
                "{}",
                std::any::type_name::<B>()
            );
        }
        use embree4_sys as header;
        same_shape::<Primitive, header::RTCBuildPrimitive>();
        same_places!(Primitive, header::RTCBuildPrimitive:
            lower = lower_x, geometry_id = geomID, upper = upper_x, primitive_id = primID);
        same_shape::<Bounds, header::RTCBounds>();
        same_places!(Bounds, header::RTCBounds:
            lower = lower_x, padding0 = align0, upper = upper_x, padding1 = align1);
        same_shape::<RayRecord, header::RTCRay>();
        same_places!(RayRecord, header::RTCRay:
            origin = org_x, t_near = tnear, direction = dir_x, time = time, t_far = tfar, mask = mask, id = id,
            flags = flags);
        // Room for more at the end is on purpose.
        assert!(size_of::<RayHit>() >= size_of::<header::RTCRayHit>());
        same_places!(RayHit, header::RTCRayHit:
            ray = ray, normal = hit.Ng_x, u = hit.u, v = hit.v, primitive_id = hit.primID, geometry_id = hit.geomID,
            instance_ids = hit.instID);
        same_shape::<RayRecord8, header::RTCRay8>();
        same_places!(RayRecord8, header::RTCRay8:
            origin = org_x, t_near = tnear, direction = dir_x, time = time, t_far = tfar, mask = mask, id = id,
            flags = flags);
        assert!(size_of::<RayHit8>() >= size_of::<header::RTCRayHit8>());
        same_places!(RayHit8, header::RTCRayHit8:
            ray = ray, normal = hit.Ng_x, u = hit.u, v = hit.v, primitive_id = hit.primID, geometry_id = hit.geomID,
            instance_ids = hit.instID);
        same_shape::<Arguments, header::RTCBuildArguments>();
        same_places!(Arguments, header::RTCBuildArguments:
            byte_size = byteSize, quality = buildQuality, flags = buildFlags, branching_factor = maxBranchingFactor,
            max_depth = maxDepth, sah_block_size = sahBlockSize, min_leaf_size = minLeafSize,
            max_leaf_size = maxLeafSize, traversal_cost = traversalCost, intersection_cost = intersectionCost,
            bvh = bvh, primitives = primitives, primitive_count = primitiveCount,
            primitive_capacity = primitiveArrayCapacity, create_node = createNode,
            set_node_children = setNodeChildren, set_node_bounds = setNodeBounds, create_leaf = createLeaf,
            split_primitive = splitPrimitive, progress = buildProgress, user = userPtr);
    }
}
