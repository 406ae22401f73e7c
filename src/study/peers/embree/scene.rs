//! A scene: one triangle geometry, built once, and the queries against it.

use super::abi::{
    Arguments, BUFFER_INDEX, BUFFER_VERTEX, FORMAT_FLOAT3, FORMAT_UINT3, GEOMETRY_TRIANGLE, Handle,
    QUALITY_HIGH, QUALITY_LOW, QUALITY_MEDIUM, RayHits, Rays, SCENE_ROBUST, Valid,
};
use super::device::Device;
use crate::error::{Error, Result};
use crate::mesh::Mesh;
use std::ffi::c_void;
use std::sync::Arc;
use std::time::Instant;

/// How a scene is built.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Build {
    /// For scenes that change: Morton codes in place of the SAH.
    Low,
    /// Embree's default quality.
    Medium,
    /// Spatial splits.
    High,
    /// High quality with the robust flag: traversal and triangle test leave no gap between neighbours. Embree
    /// 4.4 makes no spatial splits for robust triangles, so its tree is the medium one.
    RobustHigh,
}

impl Build {
    /// The qualities, quickest first.
    pub const QUALITIES: [Self; 3] = [Self::Low, Self::Medium, Self::High];
    /// Those that rays are raced on.
    pub const ALL: [Self; 3] = [Self::Medium, Self::High, Self::RobustHigh];

    /// `low`, `medium`, `high` or `robust`.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Low => "low",
            Self::Medium => "medium",
            Self::High => "high",
            Self::RobustHigh => "robust",
        }
    }
}

/// A committed scene.
#[derive(Debug)]
pub struct Scene {
    device: Arc<Device>,
    handle: Handle,
    build: Build,
    build_seconds: f64,
    bytes: u64,
}

// SAFETY: a committed scene is only queried, which Embree allows from any number of threads at once.
unsafe impl Send for Scene {}
// SAFETY: as above.
unsafe impl Sync for Scene {}

impl Scene {
    /// Copies the mesh into Embree's buffers and builds. The clock runs over the commits only.
    ///
    /// # Errors
    /// The mesh has no triangles, or Embree fails (memory).
    pub fn new(device: &Arc<Device>, mesh: &Mesh, build: Build) -> Result<Self> {
        if mesh.triangles.is_empty() {
            return Err(Error::Mesh("it has no triangles".into()));
        }
        let api = &device.library().api;
        let held_before = device.bytes();
        // SAFETY: the device is alive.
        let handle = unsafe { (api.new_scene)(device.handle()) };
        let Some(handle) = handle else {
            return Err(device.check("making a scene").expect_err("a missing scene has a reason"));
        };
        // From here on `drop` releases the scene.
        let mut scene = Self { device: Arc::clone(device), handle, build, build_seconds: 0.0, bytes: 0 };
        let geometry = Geometry::new(device, mesh)?;
        let (quality, flags) = match build {
            Build::Low => (QUALITY_LOW, 0),
            Build::Medium => (QUALITY_MEDIUM, 0),
            Build::High => (QUALITY_HIGH, 0),
            Build::RobustHigh => (QUALITY_HIGH, SCENE_ROBUST),
        };
        let start = Instant::now();
        // SAFETY: scene and geometry are alive and of the same device; the scene keeps the geometry.
        unsafe {
            (api.set_scene_build_quality)(handle, quality);
            (api.set_scene_flags)(handle, flags);
            (api.commit_geometry)(geometry.handle);
            (api.attach_geometry)(handle, geometry.handle);
            (api.commit_scene)(handle);
        }
        scene.build_seconds = start.elapsed().as_secs_f64();
        device.check("building a scene")?;
        scene.bytes = u64::try_from(device.bytes() - held_before).unwrap_or(0);
        Ok(scene)
    }

    /// How it was built.
    pub fn build(&self) -> Build {
        self.build
    }

    /// Seconds that the build took, with the device's threads.
    pub fn build_seconds(&self) -> f64 {
        self.build_seconds
    }

    /// Bytes that the scene holds, its vertex and index buffers among them.
    pub fn bytes(&self) -> u64 {
        self.bytes
    }

    /// `rtcIntersect1/4/8/16`: the closest hits of the valid lanes. `N` is 1, 4, 8 or 16, and with 1 the
    /// lane is always valid. The caller has reset the hits' geometry to `INVALID_ID`.
    #[inline(always)]
    pub(super) fn intersect<const N: usize>(
        &self,
        valid: &Valid<N>,
        packet: &mut RayHits<N>,
        arguments: &Arguments,
    ) {
        let api = &self.device.library().api;
        let (valid, target) = (valid.0.as_ptr(), (&raw mut *packet).cast::<c_void>());
        // SAFETY: the scene is committed; mask and packet are exclusive or read only, have the layout that
        // `abi` checks for this width, and are aligned to 64 bytes; the arguments outlive the call.
        unsafe {
            match N {
                1 => (api.intersect1)(self.handle, target, arguments),
                4 => (api.intersect4)(valid, self.handle, target, arguments),
                8 => (api.intersect8)(valid, self.handle, target, arguments),
                16 => (api.intersect16)(valid, self.handle, target, arguments),
                _ => unreachable!("Embree has no packets of {N}"),
            }
        }
    }

    /// `rtcOccluded1/4/8/16`: sets `tfar` of the valid lanes to minus infinity where anything is hit.
    /// Only the packet's rays are read and written.
    #[inline(always)]
    pub(super) fn occluded<const N: usize>(
        &self,
        valid: &Valid<N>,
        packet: &mut RayHits<N>,
        arguments: &Arguments,
    ) {
        let api = &self.device.library().api;
        let (valid, target) = (valid.0.as_ptr(), (&raw mut *packet).cast::<c_void>());
        // SAFETY: as in `intersect`; the rays are the packet's first field, so they have its alignment.
        unsafe {
            match N {
                1 => (api.occluded1)(self.handle, target, arguments),
                4 => (api.occluded4)(valid, self.handle, target, arguments),
                8 => (api.occluded8)(valid, self.handle, target, arguments),
                16 => (api.occluded16)(valid, self.handle, target, arguments),
                _ => unreachable!("Embree has no packets of {N}"),
            }
        }
    }
}

impl Drop for Scene {
    fn drop(&mut self) {
        // SAFETY: the scene's one reference is this one.
        unsafe { (self.device.library().api.release_scene)(self.handle) };
    }
}

/// The application's reference to a geometry; a scene that it is attached to holds its own.
struct Geometry<'d> {
    device: &'d Device,
    handle: Handle,
}

impl<'d> Geometry<'d> {
    /// A triangle geometry with copies of the mesh's vertices and indices.
    fn new(device: &'d Device, mesh: &Mesh) -> Result<Self> {
        let api = &device.library().api;
        // SAFETY: the device is alive.
        let handle = unsafe { (api.new_geometry)(device.handle(), GEOMETRY_TRIANGLE) };
        let Some(handle) = handle else {
            return Err(device.check("making a geometry").expect_err("a missing geometry has a reason"));
        };
        let geometry = Self { device, handle };
        geometry.fill(BUFFER_VERTEX, FORMAT_FLOAT3, mesh.positions.iter().map(|p| p.to_array()))?;
        geometry.fill(BUFFER_INDEX, FORMAT_UINT3, mesh.triangles.iter().copied())?;
        Ok(geometry)
    }

    /// Has Embree allocate (and so pad) a buffer of 12-byte items and writes them.
    fn fill<T: Copy>(
        &self,
        buffer: u32,
        format: u32,
        items: impl ExactSizeIterator<Item = [T; 3]>,
    ) -> Result<()> {
        const { assert!(size_of::<[T; 3]>() == 12) };
        let (api, count) = (&self.device.library().api, items.len());
        // SAFETY: the geometry is alive; 12 is the size of an item.
        let start = unsafe {
            (api.set_new_geometry_buffer)(self.handle, buffer, 0, format, size_of::<[T; 3]>(), count)
        };
        let Some(start) = start else {
            return Err(self.device.check("allocating a buffer").expect_err("a missing buffer has a reason"));
        };
        let start = start.cast::<[T; 3]>();
        for (i, item) in items.take(count).enumerate() {
            // SAFETY: the buffer holds `count` items, is aligned to 16 bytes, and nobody else knows it yet.
            unsafe { start.add(i).write(item) };
        }
        Ok(())
    }
}

impl Drop for Geometry<'_> {
    fn drop(&mut self) {
        // SAFETY: this reference is the application's own.
        unsafe { (self.device.library().api.release_geometry)(self.handle) };
    }
}

/// A packet of `N` rays with the fields that the benchmark never changes filled in.
pub(super) const fn blank<const N: usize>() -> Rays<N> {
    Rays {
        origin: [[0.0; N]; 3],
        tnear: [0.0; N],
        direction: [[1.0; N]; 3],
        time: [0.0; N],
        tfar: [-1.0; N],
        mask: [u32::MAX; N],
        id: [0; N],
        flags: [0; N],
    }
}
