//! `rtcBuildBVH`. Nodes live in the library's own memory, as those of its users do: a node is a
//! header, then the boxes of its children, then pointers to them; a leaf is a header, then its
//! references. The tree is copied from there once it is whole.

use std::{
    ffi::c_void,
    ptr::{self, NonNull},
    slice,
};

use raywright_bvh::{Aabb, BuildPrimitive, Corners, LeafReference, Vec3};

use super::{
    Device,
    api::{Allocator, Api, Arguments, Bounds, BvhHandle, Primitive},
};
use crate::{
    embree::{BuildArguments, EmbreeError, clip},
    tree::{Node, Tree},
};

/// The upper five bits of a geometry id hold the split budget while spatial splits are built.
const GEOMETRY_MASK: u32 = (1 << 27) - 1;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u32)]
enum Kind {
    Leaf,
    Inner,
}

#[derive(Clone, Copy, Debug)]
#[repr(C, align(16))]
struct Header {
    kind: Kind,
    /// Children or references behind it.
    count: u32,
}

/// What the callbacks know.
struct User<'a> {
    api: &'static Api,
    corners: Option<&'a Corners<'a>>,
}

/// A tree in the library's memory.
#[derive(Debug)]
pub struct Built<'a> {
    device: &'a Device,
    bvh: BvhHandle,
    root: *const Header,
}

impl Device {
    /// Builds a tree over `primitives` as the library does for its users. `corners` gives the
    /// triangle of a primitive: without it, high quality is medium.
    ///
    /// # Errors
    /// [`EmbreeError::Crashes`] for what is known to crash the library, and what it refuses.
    pub fn build(
        &self,
        primitives: &[BuildPrimitive],
        corners: Option<&Corners<'_>>,
        arguments: &BuildArguments,
    ) -> Result<Built<'_>, EmbreeError> {
        arguments.check(self.major())?;
        // The library permutes the array and appends parts of primitives to it.
        let capacity = arguments.capacity.max(primitives.len());
        let mut array: Vec<Primitive> = Vec::with_capacity(capacity);
        array.extend(primitives.iter().map(|p| Primitive {
            lower: p.bounds.min.to_array(),
            geometry_id: p.geometry_id,
            upper: p.bounds.max.to_array(),
            primitive_id: p.primitive_id,
        }));
        // SAFETY: the device is alive (2).
        let bvh = unsafe { (self.api.new_bvh)(self.handle) };
        self.check()?;
        // Released with it, whatever happens next.
        let mut built = Built {
            device: self,
            bvh,
            root: ptr::null(),
        };
        let user = User {
            api: self.api,
            corners,
        };
        let arguments = Arguments {
            byte_size: size_of::<Arguments>(),
            quality: arguments.quality as i32,
            flags: 0,
            branching_factor: arguments.branching_factor,
            max_depth: arguments.max_depth,
            sah_block_size: arguments.sah_block_size,
            min_leaf_size: arguments.min_leaf_size,
            max_leaf_size: arguments.max_leaf_size,
            traversal_cost: arguments.traversal_cost,
            intersection_cost: arguments.intersection_cost,
            bvh,
            primitives: array.as_mut_ptr(),
            primitive_count: primitives.len(),
            primitive_capacity: capacity,
            create_node,
            set_node_children,
            set_node_bounds,
            create_leaf,
            split_primitive: corners.is_some().then_some(split_primitive),
            progress: ptr::null(),
            user: ptr::from_ref(&user).cast_mut().cast(),
        };
        // SAFETY: the struct has the header's layout (3); the array has room for `capacity`
        // primitives, of which `primitive_count` are initialised; `user` outlives the call, is only
        // read, and may be read by many threads, `corners` being `Sync`; the callbacks have the
        // header's types.
        let root = unsafe { (self.api.build_bvh)(&raw const arguments) };
        self.check()?;
        built.root = root.cast();
        Ok(built)
    }
}

impl Built<'_> {
    /// A copy of the tree. Over nothing the library builds a leaf of nothing, which is kept.
    ///
    /// # Errors
    /// [`EmbreeError::Incomplete`] if a node was never filled.
    pub fn tree(&self) -> Result<Tree, EmbreeError> {
        if self.root.is_null() {
            return Ok(Tree::default());
        }
        // SAFETY: the root came from `create_node` or `create_leaf`, and the memory of both lives
        // as long as the tree's handle.
        let root = unsafe { copy(self.root) }?;
        Ok(Tree { root: Some(root) })
    }
}

impl Drop for Built<'_> {
    fn drop(&mut self) {
        // SAFETY: alive until here (2); copies of the tree do not point into it.
        unsafe { (self.device.api.release_bvh)(self.bvh) }
    }
}

/// A copy of a node and all below.
///
/// # Safety
/// `header` came from `create_node` or `create_leaf` of a tree that is not released, and no
/// callback is running.
unsafe fn copy(header: *const Header) -> Result<Node, EmbreeError> {
    // SAFETY: both callbacks write a header at the address that they return.
    let Header { kind, count } = unsafe { *header };
    match kind {
        Kind::Leaf => {
            // SAFETY: `create_leaf` wrote `count` references behind the header.
            let references =
                unsafe { slice::from_raw_parts(references_of(header), count as usize) };
            Ok(Node::Leaf(references.to_vec()))
        }
        Kind::Inner => {
            let mut children = Vec::with_capacity(count as usize);
            for slot in 0..count as usize {
                // SAFETY: `create_node` wrote `count` boxes and pointers behind the header.
                let (bounds, child) = unsafe {
                    let bounds = *bounds_of(header).add(slot);
                    (bounds, *children_of(header, count).add(slot))
                };
                if child.is_null() {
                    return Err(EmbreeError::Incomplete);
                }
                // SAFETY: a child that is not null was returned by one of the two callbacks.
                children.push((aabb(&bounds), unsafe { copy(child) }?));
            }
            Ok(Node::Inner(children))
        }
    }
}

fn aabb(bounds: &Bounds) -> Aabb {
    Aabb {
        min: Vec3::from_array(bounds.lower),
        max: Vec3::from_array(bounds.upper),
    }
}

// Addresses within a node or leaf. A header is 16 bytes and aligned to 16, as is a box.

fn bounds_of(header: *const Header) -> *mut Bounds {
    header.wrapping_add(1).cast::<Bounds>().cast_mut()
}

fn children_of(header: *const Header, count: u32) -> *mut *const Header {
    bounds_of(header).wrapping_add(count as usize).cast()
}

fn references_of(header: *const Header) -> *mut LeafReference {
    header.wrapping_add(1).cast::<LeafReference>().cast_mut()
}

/// Memory that the library frees with the tree; null if it has none.
///
/// # Safety
/// Called from a callback with its `allocator` and `user`.
unsafe fn allocate(
    allocator: Allocator,
    user: *mut c_void,
    bytes: usize,
) -> Option<NonNull<Header>> {
    // SAFETY: `user` is what `Device::build` gave, alive until the build returns. The library wants
    // an alignment of at most 16 and a size that is a multiple of it.
    let memory = unsafe {
        let user = &*user.cast::<User<'_>>();
        (user.api.thread_local_alloc)(allocator, bytes.next_multiple_of(16), 16)
    };
    NonNull::new(memory.cast())
}

extern "C" fn create_node(allocator: Allocator, count: u32, user: *mut c_void) -> *mut c_void {
    let bytes =
        size_of::<Header>() + count as usize * (size_of::<Bounds>() + size_of::<*const Header>());
    // SAFETY: this is a callback of a build.
    let Some(header) = (unsafe { allocate(allocator, user, bytes) }) else {
        return ptr::null_mut();
    };
    // SAFETY: the memory is new, aligned to 16, and holds a header, `count` boxes and `count`
    // pointers.
    unsafe {
        header.write(Header {
            kind: Kind::Inner,
            count,
        });
        for slot in 0..count as usize {
            children_of(header.as_ptr(), count)
                .add(slot)
                .write(ptr::null());
        }
    }
    header.as_ptr().cast()
}

extern "C" fn set_node_children(
    node: *mut c_void,
    children: *mut *mut c_void,
    count: u32,
    _user: *mut c_void,
) {
    let header: *const Header = node.cast();
    // SAFETY: `node` came from `create_node`, and no other thread has it; `children` holds `count`
    // pointers from the two callbacks. Should the count be another than at creation, the smaller
    // one is safe.
    unsafe {
        let room = (*header).count;
        for slot in 0..count.min(room) as usize {
            let child = (*children.add(slot)).cast();
            children_of(header, room).add(slot).write(child);
        }
    }
}

extern "C" fn set_node_bounds(
    node: *mut c_void,
    bounds: *mut *const Bounds,
    count: u32,
    _user: *mut c_void,
) {
    let header: *const Header = node.cast();
    // SAFETY: as in `set_node_children`; each pointer is to a box that lives during the call.
    unsafe {
        for slot in 0..count.min((*header).count) as usize {
            bounds_of(header).add(slot).write(**bounds.add(slot));
        }
    }
}

extern "C" fn create_leaf(
    allocator: Allocator,
    primitives: *const Primitive,
    count: usize,
    user: *mut c_void,
) -> *mut c_void {
    let bytes = size_of::<Header>() + count * size_of::<LeafReference>();
    // SAFETY: this is a callback of a build.
    let Some(header) = (unsafe { allocate(allocator, user, bytes) }) else {
        return ptr::null_mut();
    };
    // SAFETY: the memory is new, aligned to 16, and holds a header and `count` references;
    // `primitives` holds `count` primitives.
    unsafe {
        header.write(Header {
            kind: Kind::Leaf,
            count: count as u32,
        });
        for slot in 0..count {
            let primitive = *primitives.add(slot);
            references_of(header.as_ptr())
                .add(slot)
                .write(LeafReference {
                    geometry_id: primitive.geometry_id,
                    primitive_id: primitive.primitive_id,
                });
        }
    }
    header.as_ptr().cast()
}

extern "C" fn split_primitive(
    primitive: *const Primitive,
    axis: u32,
    position: f32,
    left: *mut Bounds,
    right: *mut Bounds,
    user: *mut c_void,
) {
    // SAFETY: `user` is what `Device::build` gave; `primitive`, `left` and `right` point to one
    // struct each that lives during the call.
    let (user, primitive) = unsafe { (&*user.cast::<User<'_>>(), *primitive) };
    // Given to the library only together with this callback.
    let Some(corners) = user.corners else { return };
    let bounds = Aabb {
        min: Vec3::from_array(primitive.lower),
        max: Vec3::from_array(primitive.upper),
    };
    let triangle = corners(LeafReference {
        geometry_id: primitive.geometry_id & GEOMETRY_MASK,
        primitive_id: primitive.primitive_id,
    });
    let parts = clip(triangle, &bounds, axis as usize, position);
    for (part, target) in parts.iter().zip([left, right]) {
        let bounds = Bounds {
            lower: part.min.to_array(),
            padding0: 0.0,
            upper: part.max.to_array(),
            padding1: 0.0,
        };
        // SAFETY: see above.
        unsafe { target.write(bounds) };
    }
}
