//! The calls into Embree, and all unsafe code of the crate.
//!
//! In: a path, a [`Geometry`], rays. Out: bits. Invariant: a handle lives as long as what was made
//! with it, and the library is never unloaded, for threads of its own may still run in it. Names
//! and numbers are those of Embree's `rtcore_*.h`, version 4.

use std::ffi::{CString, c_char, c_int, c_uint, c_void};
use std::path::Path;
use std::ptr::{self, NonNull};
use std::sync::Arc;

use super::rays::{Packet, RayToLight, Rays, Valid};
use super::{EmbreeError, Geometry};

/// Handles of devices, scenes and geometries.
type Handle = *mut c_void;

const GEOMETRY_TRIANGLE: c_int = 0;
const GEOMETRY_SPHERE_POINT: c_int = 50;
const BUFFER_INDEX: c_int = 0;
const BUFFER_VERTEX: c_int = 1;
const FORMAT_UINT3: c_int = 0x5003;
const FORMAT_FLOAT3: c_int = 0x9003;
const FORMAT_FLOAT4: c_int = 0x9004;
const QUALITY_MEDIUM: c_int = 1;
const SCENE_ROBUST: c_int = 1 << 2;
const QUERY_COHERENT: c_int = 1 << 16;

/// `RTCOccludedArguments`, with room for the member that some builds add.
#[repr(C)]
struct Arguments {
    flags: c_int,
    feature_mask: c_uint,
    context: *mut c_void,
    filter: *mut c_void,
    occluded: *mut c_void,
    min_width_distance_factor: f32,
}

impl Arguments {
    fn coherent() -> Self {
        Self {
            flags: QUERY_COHERENT,
            feature_mask: c_uint::MAX,
            context: ptr::null_mut(),
            filter: ptr::null_mut(),
            occluded: ptr::null_mut(),
            min_width_distance_factor: 0.0,
        }
    }
}

/// Declares the table of functions and how it is filled.
macro_rules! functions {
    ($($name:ident: $symbol:literal, fn($($argument:ty),*) $(-> $result:ty)?;)*) => {
        /// Embree's functions.
        #[derive(Clone, Copy, Debug)]
        pub(super) struct Library {
            $($name: unsafe extern "C" fn($($argument),*) $(-> $result)?,)*
        }

        impl Library {
            /// Loads a library and looks all functions up.
            pub(super) fn open(path: &Path) -> Result<Self, String> {
                // SAFETY: loading runs the library's initialisers; whoever names a library asks
                // for that.
                let library = unsafe { libloading::Library::new(path) }
                    .map_err(|error| error.to_string())?;
                let functions = Self {
                    // SAFETY: the types are those of Embree 4's headers for these names.
                    $($name: unsafe { *library.get($symbol).map_err(|error| error.to_string())? },)*
                };
                // The pointers stay good: it is never unloaded.
                std::mem::forget(library);
                Ok(functions)
            }
        }
    };
}

functions! {
    new_device: b"rtcNewDevice\0", fn(*const c_char) -> Handle;
    release_device: b"rtcReleaseDevice\0", fn(Handle);
    device_error: b"rtcGetDeviceError\0", fn(Handle) -> c_int;
    new_scene: b"rtcNewScene\0", fn(Handle) -> Handle;
    release_scene: b"rtcReleaseScene\0", fn(Handle);
    set_scene_flags: b"rtcSetSceneFlags\0", fn(Handle, c_int);
    set_build_quality: b"rtcSetSceneBuildQuality\0", fn(Handle, c_int);
    commit_scene: b"rtcCommitScene\0", fn(Handle);
    new_geometry: b"rtcNewGeometry\0", fn(Handle, c_int) -> Handle;
    release_geometry: b"rtcReleaseGeometry\0", fn(Handle);
    new_buffer: b"rtcSetNewGeometryBuffer\0",
        fn(Handle, c_int, c_uint, c_int, usize, usize) -> *mut c_void;
    commit_geometry: b"rtcCommitGeometry\0", fn(Handle);
    attach_geometry: b"rtcAttachGeometry\0", fn(Handle, Handle) -> c_uint;
    occluded1: b"rtcOccluded1\0", fn(Handle, *mut RayToLight, *mut Arguments);
    occluded8: b"rtcOccluded8\0", fn(*const Valid<8>, Handle, *mut Rays<8>, *mut Arguments);
    occluded16: b"rtcOccluded16\0", fn(*const Valid<16>, Handle, *mut Rays<16>, *mut Arguments);
}

/// A device: Embree's threads and its last error.
#[derive(Debug)]
pub(super) struct Device {
    library: Library,
    handle: NonNull<c_void>,
}

// SAFETY: Embree's devices may be used from any thread.
unsafe impl Send for Device {}
// SAFETY: as above.
unsafe impl Sync for Device {}

impl Device {
    pub(super) fn new(library: Library, thread_count: usize) -> Result<Self, EmbreeError> {
        let configuration =
            CString::new(format!("threads={thread_count}")).expect("a number holds no zero byte");
        // SAFETY: the text ends with a zero byte and is copied by the callee.
        let handle = unsafe { (library.new_device)(configuration.as_ptr()) };
        match NonNull::new(handle) {
            Some(handle) => Ok(Self { library, handle }),
            None => Err(EmbreeError::Refused {
                // SAFETY: without a device the call tells why there is none.
                code: unsafe { (library.device_error)(ptr::null_mut()) },
                doing: "making a device",
            }),
        }
    }

    /// Turns Embree's error, if there is one since the last call, into ours.
    fn check(&self, doing: &'static str) -> Result<(), EmbreeError> {
        // SAFETY: the device lives.
        match unsafe { (self.library.device_error)(self.handle.as_ptr()) } {
            0 => Ok(()),
            code => Err(EmbreeError::Refused { code, doing }),
        }
    }
}

impl Drop for Device {
    fn drop(&mut self) {
        // SAFETY: the handle is ours and is not used again.
        unsafe { (self.library.release_device)(self.handle.as_ptr()) }
    }
}

/// A committed scene.
#[derive(Debug)]
pub(super) struct BuiltScene {
    device: Arc<Device>,
    handle: NonNull<c_void>,
}

// SAFETY: a committed scene is only read; Embree lets any threads query it at once.
unsafe impl Send for BuiltScene {}
// SAFETY: as above.
unsafe impl Sync for BuiltScene {}

impl BuiltScene {
    pub(super) fn new(
        device: &Arc<Device>,
        geometry: &Geometry,
        is_robust: bool,
    ) -> Result<Self, EmbreeError> {
        const DOING: &str = "building a scene";
        let library = &device.library;
        // SAFETY: the device lives.
        let handle = unsafe { (library.new_scene)(device.handle.as_ptr()) };
        let Some(handle) = NonNull::new(handle) else {
            device.check(DOING)?;
            return Err(EmbreeError::Refused {
                code: 0,
                doing: DOING,
            });
        };
        // From here on the scene is released whatever happens.
        let scene = Self {
            device: Arc::clone(device),
            handle,
        };
        let flags = if is_robust { SCENE_ROBUST } else { 0 };
        // SAFETY: the scene lives and is not committed yet.
        unsafe {
            (library.set_scene_flags)(scene.handle.as_ptr(), flags);
            (library.set_build_quality)(scene.handle.as_ptr(), QUALITY_MEDIUM);
        }
        if !geometry.triangles.is_empty() {
            scene.attach(GEOMETRY_TRIANGLE, |of| {
                scene.fill(of, BUFFER_VERTEX, FORMAT_FLOAT3, &geometry.vertices)?;
                scene.fill(of, BUFFER_INDEX, FORMAT_UINT3, &geometry.triangles)
            })?;
        }
        if !geometry.spheres.is_empty() {
            scene.attach(GEOMETRY_SPHERE_POINT, |of| {
                scene.fill(of, BUFFER_VERTEX, FORMAT_FLOAT4, &geometry.spheres)
            })?;
        }
        // SAFETY: the scene lives, and nothing else uses it yet.
        unsafe { (library.commit_scene)(scene.handle.as_ptr()) };
        device.check(DOING)?;
        Ok(scene)
    }

    /// Makes a geometry, fills it and hands it to the scene.
    fn attach(
        &self,
        kind: c_int,
        fill: impl FnOnce(NonNull<c_void>) -> Result<(), EmbreeError>,
    ) -> Result<(), EmbreeError> {
        const DOING: &str = "making a geometry";
        let library = &self.device.library;
        // SAFETY: the device lives.
        let geometry = unsafe { (library.new_geometry)(self.device.handle.as_ptr(), kind) };
        let Some(geometry) = NonNull::new(geometry) else {
            self.device.check(DOING)?;
            return Err(EmbreeError::Refused {
                code: 0,
                doing: DOING,
            });
        };
        let filled = fill(geometry);
        // SAFETY: both handles live; the scene keeps the geometry alive once it is attached.
        unsafe {
            if filled.is_ok() {
                (library.commit_geometry)(geometry.as_ptr());
                (library.attach_geometry)(self.handle.as_ptr(), geometry.as_ptr());
            }
            (library.release_geometry)(geometry.as_ptr());
        }
        filled.and_then(|()| self.device.check(DOING))
    }

    /// Makes a buffer of a geometry and copies `items` into it.
    fn fill<T: Copy, const N: usize>(
        &self,
        geometry: NonNull<c_void>,
        kind: c_int,
        format: c_int,
        items: &[[T; N]],
    ) -> Result<(), EmbreeError> {
        const DOING: &str = "making a buffer";
        // SAFETY: the geometry lives; stride and count are those of `items`.
        let buffer = unsafe {
            (self.device.library.new_buffer)(
                geometry.as_ptr(),
                kind,
                0,
                format,
                size_of::<[T; N]>(),
                items.len(),
            )
        };
        if buffer.is_null() {
            self.device.check(DOING)?;
            return Err(EmbreeError::Refused {
                code: 0,
                doing: DOING,
            });
        }
        // SAFETY: the new buffer has room for `items.len()` items of this stride, is aligned to 16
        // bytes, and is not `items`.
        unsafe { ptr::copy_nonoverlapping(items.as_ptr(), buffer.cast(), items.len()) };
        Ok(())
    }

    /// Returns whether something is on the ray.
    #[inline]
    pub(super) fn is_occluded(&self, mut ray: RayToLight) -> bool {
        // SAFETY: the scene is committed; the ray is `RTCRay` in size, alignment and members, and
        // no one else sees it; no arguments means the default ones.
        unsafe {
            (self.device.library.occluded1)(self.handle.as_ptr(), &raw mut ray, ptr::null_mut());
        }
        ray.far < 0.0
    }

    /// Returns for each of a packet's rays whether something is on it; lanes without a ray mean
    /// nothing.
    #[inline]
    pub(super) fn are_occluded8(&self, packet: &Packet<8>, is_coherent: bool) -> [bool; 8] {
        let occluded = self.device.library.occluded8;
        self.are_occluded_by(occluded, packet, is_coherent)
    }

    /// As [`BuiltScene::are_occluded8`].
    #[inline]
    pub(super) fn are_occluded16(&self, packet: &Packet<16>, is_coherent: bool) -> [bool; 16] {
        let occluded = self.device.library.occluded16;
        self.are_occluded_by(occluded, packet, is_coherent)
    }

    /// Calls one of the library's functions for packets.
    #[inline]
    fn are_occluded_by<const N: usize>(
        &self,
        occluded: unsafe extern "C" fn(*const Valid<N>, Handle, *mut Rays<N>, *mut Arguments),
        packet: &Packet<N>,
        is_coherent: bool,
    ) -> [bool; N] {
        let mut rays = packet.rays;
        let mut arguments = Arguments::coherent();
        let arguments = if is_coherent {
            &raw mut arguments
        } else {
            ptr::null_mut()
        };
        // SAFETY: as above; `valid` has as many lanes as the rays and is aligned to 64 bytes.
        unsafe {
            occluded(
                &raw const packet.valid,
                self.handle.as_ptr(),
                &raw mut rays,
                arguments,
            );
        }
        rays.far.map(|far| far < 0.0)
    }
}

impl Drop for BuiltScene {
    fn drop(&mut self) {
        // SAFETY: the handle is ours and is not used again.
        unsafe { (self.device.library.release_scene)(self.handle.as_ptr()) }
    }
}
