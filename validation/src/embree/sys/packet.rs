//! Rays in packets of eight: the library has an array for each of their fields.

use std::{ffi::c_void, ptr};

use raywright_bvh::Ray;

use super::{
    Scene,
    api::{Context3, NO_ID, PACKET, RayHit8, RayRecord8, SceneHandle, Valid8},
};
use crate::embree::EmbreeHit;

/// `rtcIntersect8` or `rtcOccluded8`.
type Ask = unsafe extern "C" fn(*const Valid8, SceneHandle, *mut c_void, *mut c_void);

impl Scene<'_> {
    /// The closest hit of each ray, eight at a time in their order, the last packet with what is
    /// left. Of hits at the same distance it may be any.
    pub fn closest_hits(&self, rays: &[Ray], hits: &mut Vec<Option<EmbreeHit>>) {
        hits.clear();
        for rays in rays.chunks(PACKET) {
            let mut record = RayHit8 {
                ray: packet_of(rays),
                normal: [[0.0; PACKET]; 3],
                u: [0.0; PACKET],
                v: [0.0; PACKET],
                primitive_id: [NO_ID; PACKET],
                geometry_id: [NO_ID; PACKET],
                instance_ids: [[NO_ID; PACKET]; 4],
            };
            self.ask_packet(
                self.handle.device.api.intersect8,
                rays.len(),
                ptr::from_mut(&mut record).cast(),
            );
            hits.extend((0..rays.len()).map(|lane| {
                (record.geometry_id[lane] != NO_ID).then_some(EmbreeHit {
                    t: record.ray.t_far[lane],
                    u: record.u[lane],
                    v: record.v[lane],
                    geometry_id: record.geometry_id[lane],
                    primitive_id: record.primitive_id[lane],
                })
            }));
        }
    }

    /// Whether each ray hits anything; otherwise as [`Scene::closest_hits`].
    pub fn any_hits(&self, rays: &[Ray], are_hit: &mut Vec<bool>) {
        are_hit.clear();
        for rays in rays.chunks(PACKET) {
            let mut record = packet_of(rays);
            self.ask_packet(
                self.handle.device.api.occluded8,
                rays.len(),
                ptr::from_mut(&mut record).cast(),
            );
            are_hit.extend(
                record.t_far[..rays.len()]
                    .iter()
                    .map(|&t| t == f32::NEG_INFINITY),
            );
        }
    }

    /// Asks with the first `count` rays of a packet.
    #[inline]
    fn ask_packet(&self, function: Ask, count: usize, record: *mut c_void) {
        let valid = Valid8(std::array::from_fn(|lane| -i32::from(lane < count)));
        let scene = self.handle.scene;
        if self.context_first {
            let mut context = Context3::new();
            // SAFETY: the scene is committed and alive; the mask and the record of `function`,
            // which both callers give with it, have the header's layout or more room (3), and the
            // alignment of 32 that the library asks for.
            unsafe { function(&valid, scene, ptr::from_mut(&mut context).cast(), record) }
        } else {
            // SAFETY: as above; no arguments mean the defaults.
            unsafe { function(&valid, scene, record, ptr::null_mut()) }
        }
    }
}

/// At most eight rays as a packet. The places of rays that are not there hold zeros.
#[inline]
fn packet_of(rays: &[Ray]) -> RayRecord8 {
    let mut packet = RayRecord8 {
        origin: [[0.0; PACKET]; 3],
        t_near: [0.0; PACKET],
        direction: [[0.0; PACKET]; 3],
        time: [0.0; PACKET],
        t_far: [0.0; PACKET],
        mask: [u32::MAX; PACKET],
        id: [0; PACKET],
        flags: [0; PACKET],
    };
    for (lane, ray) in rays.iter().enumerate() {
        for axis in 0..3 {
            packet.origin[axis][lane] = ray.origin[axis];
            packet.direction[axis][lane] = ray.direction[axis];
        }
        // As for one ray.
        packet.t_near[lane] = ray.t_min.max(0.0);
        packet.t_far[lane] = ray.t_max;
    }
    packet
}
