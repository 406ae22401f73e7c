//! Embree 4's binary interface as its public documentation describes it: structures, constants, functions.
//!
//! Written for Embree 4.4 as it is built by default (one instance level, instance arrays on). The layouts
//! of the default build have not changed within 4.x since instance arrays came in 4.3; before, a hit
//! lacked its last row, which changes no offset of another row.

use libloading::Library;
use std::ffi::{c_char, c_void};
use std::mem::{align_of, offset_of, size_of};
use std::ptr::{self, NonNull};

/// `RTC_INVALID_GEOMETRY_ID`: no geometry, no primitive, no instance.
pub const INVALID_ID: u32 = u32::MAX;
/// `RTC_GEOMETRY_TYPE_TRIANGLE`.
pub const GEOMETRY_TRIANGLE: u32 = 0;
/// `RTC_BUFFER_TYPE_INDEX`.
pub const BUFFER_INDEX: u32 = 0;
/// `RTC_BUFFER_TYPE_VERTEX`.
pub const BUFFER_VERTEX: u32 = 1;
/// `RTC_FORMAT_UINT3`.
pub const FORMAT_UINT3: u32 = 0x5003;
/// `RTC_FORMAT_FLOAT3`.
pub const FORMAT_FLOAT3: u32 = 0x9003;
/// `RTC_BUILD_QUALITY_LOW`: Morton codes.
pub const QUALITY_LOW: u32 = 0;
/// `RTC_BUILD_QUALITY_MEDIUM`, the default.
pub const QUALITY_MEDIUM: u32 = 1;
/// `RTC_BUILD_QUALITY_HIGH`: spatial splits.
pub const QUALITY_HIGH: u32 = 2;
/// `RTC_SCENE_FLAG_ROBUST`.
pub const SCENE_ROBUST: u32 = 1 << 2;
/// `RTC_DEVICE_PROPERTY_VERSION_MAJOR`; minor and patch follow.
pub const PROPERTY_VERSION_MAJOR: u32 = 1;
/// `RTC_RAY_QUERY_FLAG_COHERENT`; its absence means incoherent, the default.
const QUERY_COHERENT: u32 = 1 << 16;
/// `RTC_FEATURE_FLAG_ALL`, which the documentation advises on CPUs.
const FEATURES_ALL: u32 = u32::MAX;

/// A device, scene or geometry.
pub type Handle = NonNull<c_void>;

/// `RTCRay` (N = 1) and `RTCRay4/8/16`: a row for each component.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub struct Rays<const N: usize> {
    /// Origins: x, y, z.
    pub origin: [[f32; N]; 3],
    /// Where the segments start.
    pub tnear: [f32; N],
    /// Directions: x, y, z.
    pub direction: [[f32; N]; 3],
    /// Time for motion blur: 0.
    pub time: [f32; N],
    /// Where the segments end. Becomes the hit's `t`, or minus infinity where `occluded` finds one.
    pub tfar: [f32; N],
    /// Which geometries a ray sees: all bits.
    pub mask: [u32; N],
    /// The application's own number: 0.
    pub id: [u32; N],
    /// Must be 0.
    pub flags: [u32; N],
}

/// `RTCHit` (N = 1) and `RTCHit4/8/16`.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub struct Hits<const N: usize> {
    /// Geometric normals, not normalised: x, y, z.
    pub normal: [[f32; N]; 3],
    /// Weights of the second corner.
    pub u: [f32; N],
    /// Weights of the third corner.
    pub v: [f32; N],
    /// Triangles' indices.
    pub primitive: [u32; N],
    /// Geometries' indices; [`INVALID_ID`] before the query and after a miss.
    pub geometry: [u32; N],
    /// Instances' indices.
    pub instance: [u32; N],
    /// Indices within an instance array.
    pub instance_primitive: [u32; N],
}

/// `RTCRayHit` (N = 1) and `RTCRayHit4/8/16`, aligned for the widest.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
pub struct RayHits<const N: usize> {
    /// What to trace; the query writes `tfar`.
    pub rays: Rays<N>,
    /// What was hit.
    pub hits: Hits<N>,
}

/// Which lanes take part: -1 for those that do, else 0.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
pub struct Valid<const N: usize>(pub [i32; N]);

/// `RTCIntersectArguments` and `RTCOccludedArguments`, which differ only in the last callback's type.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub struct Arguments {
    flags: u32,
    feature_mask: u32,
    context: *mut c_void,
    filter: Option<unsafe extern "C" fn()>,
    callback: Option<unsafe extern "C" fn()>,
    /// Read only by builds with `EMBREE_MIN_WIDTH`, which is off by default.
    min_width_distance_factor: f32,
}

impl Arguments {
    /// The documented defaults, with the coherent flag set or not.
    pub const fn new(coherent: bool) -> Self {
        Self {
            flags: if coherent { QUERY_COHERENT } else { 0 },
            feature_mask: FEATURES_ALL,
            context: ptr::null_mut(),
            filter: None,
            callback: None,
            min_width_distance_factor: 0.0,
        }
    }
}

/// Checks at compile time that a packet's rows lie where Embree looks for them: 12 rows of rays (48 bytes
/// a lane), 9 of hits, without gaps but for the padding at the end.
const fn check_layout<const N: usize>(documented_size: usize) {
    assert!(offset_of!(Rays<N>, tnear) == 12 * N);
    assert!(offset_of!(Rays<N>, direction) == 16 * N);
    assert!(offset_of!(Rays<N>, tfar) == 32 * N);
    assert!(offset_of!(Rays<N>, flags) == 44 * N);
    assert!(size_of::<Rays<N>>() == 48 * N);
    assert!(offset_of!(RayHits<N>, hits) == 48 * N);
    assert!(offset_of!(Hits<N>, u) == 12 * N);
    assert!(offset_of!(Hits<N>, primitive) == 20 * N);
    assert!(offset_of!(Hits<N>, geometry) == 24 * N);
    assert!(offset_of!(Hits<N>, instance_primitive) == 32 * N);
    assert!(size_of::<Hits<N>>() == 36 * N);
    assert!(size_of::<RayHits<N>>() >= documented_size && align_of::<RayHits<N>>() >= 4 * N);
}

const _: () = {
    check_layout::<1>(96);
    check_layout::<4>(336);
    check_layout::<8>(672);
    check_layout::<16>(1344);
    assert!(offset_of!(Arguments, feature_mask) == 4);
    assert!(offset_of!(Arguments, context) == 8);
    assert!(offset_of!(Arguments, filter) == 8 + size_of::<usize>());
    assert!(offset_of!(Arguments, callback) == 8 + 2 * size_of::<usize>());
};

/// `RTCMemoryMonitorFunction`: user pointer, bytes (negative when freed), whether it was after the fact.
pub type MemoryMonitor = unsafe extern "C" fn(*mut c_void, isize, bool) -> bool;
/// `rtcIntersect1` and `rtcOccluded1`; the second argument points to [`RayHits`] or [`Rays`].
pub type SingleQuery = unsafe extern "C" fn(Handle, *mut c_void, *const Arguments);
/// `rtcIntersect4/8/16` and `rtcOccluded4/8/16`.
pub type PacketQuery = unsafe extern "C" fn(*const i32, Handle, *mut c_void, *const Arguments);

/// Declares [`Api`]: a field for each function, and how all of them are looked up.
macro_rules! functions {
    ($($field:ident = $symbol:literal: $signature:ty;)*) => {
        /// Embree's functions that are used here.
        #[allow(missing_docs)]
        pub struct Api {
            $(pub $field: $signature,)*
        }

        impl Api {
            /// Looks every function up.
            ///
            /// # Safety
            /// The library is an Embree 4 and stays loaded for as long as any of the functions is called.
            pub unsafe fn resolve(library: &Library) -> Result<Self, libloading::Error> {
                // SAFETY: the caller vouches that these names have Embree 4's signatures.
                Ok(unsafe { Self { $($field: *library.get::<$signature>($symbol)?,)* } })
            }
        }
    };
}

functions! {
    new_device = c"rtcNewDevice": unsafe extern "C" fn(*const c_char) -> Option<Handle>;
    release_device = c"rtcReleaseDevice": unsafe extern "C" fn(Handle);
    device_error = c"rtcGetDeviceError": unsafe extern "C" fn(Option<Handle>) -> u32;
    device_property = c"rtcGetDeviceProperty": unsafe extern "C" fn(Handle, u32) -> isize;
    set_memory_monitor = c"rtcSetDeviceMemoryMonitorFunction":
        unsafe extern "C" fn(Handle, Option<MemoryMonitor>, *mut c_void);
    new_scene = c"rtcNewScene": unsafe extern "C" fn(Handle) -> Option<Handle>;
    set_scene_flags = c"rtcSetSceneFlags": unsafe extern "C" fn(Handle, u32);
    set_scene_build_quality = c"rtcSetSceneBuildQuality": unsafe extern "C" fn(Handle, u32);
    commit_scene = c"rtcCommitScene": unsafe extern "C" fn(Handle);
    release_scene = c"rtcReleaseScene": unsafe extern "C" fn(Handle);
    new_geometry = c"rtcNewGeometry": unsafe extern "C" fn(Handle, u32) -> Option<Handle>;
    set_new_geometry_buffer = c"rtcSetNewGeometryBuffer":
        unsafe extern "C" fn(Handle, u32, u32, u32, usize, usize) -> Option<Handle>;
    commit_geometry = c"rtcCommitGeometry": unsafe extern "C" fn(Handle);
    attach_geometry = c"rtcAttachGeometry": unsafe extern "C" fn(Handle, Handle) -> u32;
    release_geometry = c"rtcReleaseGeometry": unsafe extern "C" fn(Handle);
    intersect1 = c"rtcIntersect1": SingleQuery;
    intersect4 = c"rtcIntersect4": PacketQuery;
    intersect8 = c"rtcIntersect8": PacketQuery;
    intersect16 = c"rtcIntersect16": PacketQuery;
    occluded1 = c"rtcOccluded1": SingleQuery;
    occluded4 = c"rtcOccluded4": PacketQuery;
    occluded8 = c"rtcOccluded8": PacketQuery;
    occluded16 = c"rtcOccluded16": PacketQuery;
}

/// What an `RTCError` means.
pub const fn error_name(code: u32) -> &'static str {
    match code {
        0 => "no error",
        2 => "invalid argument",
        3 => "invalid operation",
        4 => "out of memory",
        5 => "it does not support this processor",
        6 => "cancelled",
        _ => "unknown error",
    }
}

/// Names by which a system's loader may know the library, most exact first.
pub const SYSTEM_NAMES: &[&str] = if cfg!(target_os = "macos") {
    &["libembree4.4.dylib", "libembree4.dylib"]
} else if cfg!(windows) {
    &["embree4.dll"]
} else {
    &["libembree4.so.4", "libembree4.so"]
};
