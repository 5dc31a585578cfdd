//! The foreign interface: the only `unsafe` of this crate.
//!
//! Source: Embree's `rtcore*.h`, versions 3.13 and 4.4 (Apache-2.0); about 27 functions and 9
//! structs are declared by hand. What differs between the versions is in [`Scene`].
//!
//! Invariants, on which every SAFETY note rests:
//! 1. function pointers come from a library that is never unloaded, under the names of `rtcore.h`;
//! 2. a handle that a wrapper holds is not null, belongs to the device it was made with, and is
//!    released once, when the wrapper is dropped; what depends on a device borrows it;
//! 3. a struct given to the library has the library's layout (test below) and outlives the call.

mod api;
mod build;
mod packet;
mod scene;

use std::{
    ffi::c_void,
    marker::PhantomData,
    path::{Path, PathBuf},
    ptr,
    sync::atomic::{AtomicIsize, Ordering},
};

use raywright_bvh::Isa;

use super::{EmbreeError, find};

use api::{Api, DeviceHandle};
pub use build::Built;
pub use scene::{PreparedScene, Scene};

/// A loaded library.
#[derive(Clone, Debug)]
pub struct Embree {
    api: &'static Api,
    path: PathBuf,
}

impl Embree {
    /// Loads the first library of the search order of [the module](super).
    ///
    /// # Errors
    /// [`EmbreeError::NotFound`] with all names that were tried.
    pub fn find() -> Result<Self, EmbreeError> {
        let mut tried = Vec::new();
        for candidate in find::candidates() {
            match Self::load(&candidate) {
                Ok(embree) => return Ok(embree),
                Err(error) => tried.push((candidate.display().to_string(), error.to_string())),
            }
        }
        Err(EmbreeError::NotFound { tried })
    }

    /// Loads a library by its path, or by a name that the system's loader knows. Loading a library
    /// runs its code: name only files that you trust.
    ///
    /// # Errors
    /// [`EmbreeError::NotEmbree`] if it cannot be loaded or lacks a function.
    pub fn load(path: &Path) -> Result<Self, EmbreeError> {
        let api = Api::load(path).map_err(|error| EmbreeError::NotEmbree {
            path: path.into(),
            message: error.to_string(),
        })?;
        Ok(Self {
            // Never unloaded: see the head of this file.
            api: Box::leak(Box::new(api)),
            path: path.into(),
        })
    }

    /// The file or name that was loaded.
    #[must_use]
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// A device that works with `threads` threads (0: one per core), for this whole process.
    ///
    /// # Errors
    /// If the library refuses or is neither version 3 nor 4.
    pub fn device(&self, threads: usize) -> Result<Device, EmbreeError> {
        self.configured_device(format!("threads={threads}\0"))
    }

    /// The same with no wider instructions than `widest`, even where the machine has them.
    ///
    /// # Errors
    /// As [`Embree::device`].
    pub fn device_held_to(&self, threads: usize, widest: Isa) -> Result<Device, EmbreeError> {
        // The option `isa` would also take what the machine does not have.
        let name = match widest {
            Isa::Avx2 => "avx2",
            Isa::Avx512 => "avx512",
            _ => "sse2",
        };
        self.configured_device(format!("threads={threads},max_isa={name}\0"))
    }

    /// A device by the library's own words, which end in a zero byte.
    fn configured_device(&self, config: String) -> Result<Device, EmbreeError> {
        // SAFETY: the text ends in a zero byte (both callers write it) and outlives the call, which
        // copies it.
        let handle = unsafe { (self.api.new_device)(config.as_ptr().cast()) };
        if handle.is_null() {
            // SAFETY: a null device is allowed: the error is then that of this thread.
            let code = unsafe { (self.api.get_device_error)(ptr::null_mut()) };
            return Err(EmbreeError::Refused { code });
        }
        let bytes = Box::new(AtomicIsize::new(0));
        // SAFETY: the handle is not null; the number lives on the heap until after the device is released, and may be
        // changed by many threads.
        unsafe {
            let user = ptr::from_ref(&*bytes).cast_mut().cast();
            (self.api.set_memory_monitor)(handle, watch_memory, user);
        }
        let device = Device {
            api: self.api,
            handle,
            bytes,
            one_thread: PhantomData,
        };
        let version = device.version();
        if !matches!(device.major(), 3 | 4) {
            return Err(EmbreeError::Version { version });
        }
        Ok(device)
    }
}

/// A device of the library.
#[derive(Debug)]
pub struct Device {
    api: &'static Api,
    handle: DeviceHandle,
    /// What the library holds, told by itself.
    bytes: Box<AtomicIsize>,
    /// Errors are kept per thread: a wrapper asks for them on the thread of its call.
    one_thread: PhantomData<*const ()>,
}

impl Device {
    /// The version: major · 10000 + minor · 100 + patch.
    #[must_use]
    pub fn version(&self) -> isize {
        self.property(api::PROPERTY_VERSION)
    }

    /// The major version, 3 or 4.
    #[must_use]
    pub fn major(&self) -> isize {
        self.version() / 10_000
    }

    /// The widest instructions that it traces with on this machine, judged by the widest packet
    /// of rays that it has native code for.
    #[must_use]
    pub fn instruction_set(&self) -> &'static str {
        if self.property(api::PROPERTY_NATIVE_RAY16) != 0 {
            "AVX-512"
        } else if self.property(api::PROPERTY_NATIVE_RAY8) != 0 {
            "AVX or AVX2"
        } else {
            "SSE or NEON"
        }
    }

    /// Bytes that the library holds for trees, buffers and temporaries, as it tells its memory monitor.
    #[must_use]
    pub fn bytes(&self) -> usize {
        self.bytes.load(Ordering::Relaxed).max(0) as usize
    }

    fn property(&self, property: i32) -> isize {
        // SAFETY: the handle is alive (2); an unknown property is answered by an error and 0.
        unsafe { (self.api.get_device_property)(self.handle, property) }
    }

    /// What the library says about the calls since the last question.
    fn check(&self) -> Result<(), EmbreeError> {
        // SAFETY: the handle is alive (2).
        match unsafe { (self.api.get_device_error)(self.handle) } {
            0 => Ok(()),
            code => Err(EmbreeError::Refused { code }),
        }
    }
}

impl Drop for Device {
    fn drop(&mut self) {
        // SAFETY: alive until here (2); whatever was made with it borrowed it and is gone.
        unsafe { (self.api.release_device)(self.handle) }
    }
}

extern "C" fn watch_memory(user: *mut c_void, bytes: isize, _are_there: bool) -> bool {
    // SAFETY: `user` is the number of a device, which outlives the device.
    let total = unsafe { &*user.cast::<AtomicIsize>() };
    total.fetch_add(bytes, Ordering::Relaxed);
    true
}
