//! Cameras to frames.

use super::frame::{Frame, TilePixels, TiledFrame};
use super::order::{Tile, tiles};
use super::scheduler::{Outcome, Sharing, Workers};
use super::settings::RenderSettings;
use super::shade::Shader;
use super::stats::{FrameStats, RayCount, Tally, quantile};
use super::tile::{Calls, Scratch, TileTask};
use crate::error::Result;
use crate::mesh::Mesh;
use crate::scene::{Camera, Lighting, Surface};
use crate::traverse::{Accel, DispatchPool, Kernel, PacketWidth, RayPacket};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Instant;

/// Makes pictures of one scene with one set of settings.
#[derive(Debug)]
pub struct Renderer<'a, S = Mesh> {
    accel: &'a Accel,
    surface: &'a S,
    settings: RenderSettings,
    tiles: Vec<Tile>,
    /// What workers learnt in the frames before about which kernel is quickest.
    learnt: DispatchPool,
    /// Frames so far.
    frames: AtomicUsize,
}

impl<'a, S: Surface> Renderer<'a, S> {
    /// A renderer; `accel` must have been built from what `surface` says the corners of.
    ///
    /// # Errors
    /// As [`RenderSettings::check`].
    pub fn new(accel: &'a Accel, surface: &'a S, settings: RenderSettings) -> Result<Self> {
        settings.check()?;
        let tiles = tiles(settings.size.width, settings.size.height, settings.tuning.tile);
        let learnt = DispatchPool::default();
        Ok(Self { accel, surface, settings, tiles, learnt, frames: AtomicUsize::new(0) })
    }

    /// The settings.
    pub fn settings(&self) -> &RenderSettings {
        &self.settings
    }

    /// How many tiles a frame has.
    pub fn tile_count(&self) -> usize {
        self.tiles.len()
    }

    /// Renders a frame. Panics if a scene that is not all in memory cannot be read.
    pub fn frame(&self, camera: &Camera, lighting: &Lighting) -> (Frame, FrameStats) {
        self.frame_with_progress(camera, lighting, &AtomicUsize::new(0)).expect("the scene can be read")
    }

    /// Renders a frame; `tiles_done` is raised by one with each tile and can be read meanwhile.
    ///
    /// # Errors
    /// A scene that is not all in memory cannot be read.
    pub fn frame_with_progress(
        &self,
        camera: &Camera,
        lighting: &Lighting,
        tiles_done: &AtomicUsize,
    ) -> Result<(Frame, FrameStats)> {
        let frame = || self.frame_by_kernel(camera, lighting, tiles_done);
        match self.accel.cached() {
            Some(cached) => cached.or_error(frame),
            None => Ok(frame()),
        }
    }

    fn frame_by_kernel(
        &self,
        camera: &Camera,
        lighting: &Lighting,
        tiles_done: &AtomicUsize,
    ) -> (Frame, FrameStats) {
        match self.settings.tuning.packet {
            Kernel::Single => self.frame_of(Calls::<1>::PACKETS, camera, lighting, tiles_done),
            Kernel::Packet4 => self.frame_of(Calls::<4>::PACKETS, camera, lighting, tiles_done),
            Kernel::Packet8 => self.frame_of(Calls::<8>::PACKETS, camera, lighting, tiles_done),
            Kernel::Packet16 => self.frame_of(Calls::<16>::PACKETS, camera, lighting, tiles_done),
            Kernel::Stream => self.frame_of(Calls::STREAM, camera, lighting, tiles_done),
            Kernel::Tile => self.frame_of(Calls::TILES, camera, lighting, tiles_done),
        }
    }

    fn frame_of<const W: usize>(
        &self,
        calls: Calls<W>,
        camera: &Camera,
        lighting: &Lighting,
        tiles_done: &AtomicUsize,
    ) -> (Frame, FrameStats)
    where
        RayPacket<W>: PacketWidth<W>,
    {
        let start = Instant::now();
        let RenderSettings { size, samples, shadows, aovs, ref tuning } = self.settings;
        let threads = tuning.worker_count();
        let workers = match self.accel.cached() {
            None => Workers { threads, pin: tuning.pin, sharing: Sharing::Runs },
            // Some wait for their blocks while others are at work. Tiles that are begun at about the same
            // time are neighbours, so that they need the same blocks.
            Some(cached) => Workers { threads: cached.workers(threads), pin: false, sharing: Sharing::Queue },
        };
        let task = TileTask {
            accel: self.accel,
            calls,
            shader: Shader::new(self.surface, lighting, shadows),
            view: camera.view(size.width, size.height),
            samples,
        };

        if let Some(cached) = self.accel.cached() {
            cached.begin_frame();
        }
        let mut tiled = TiledFrame::new(size, aovs);
        let mut jobs = tiled.split(&self.tiles);
        // What the last frame has used last is there still: this one begins with it.
        if self.frames.fetch_add(1, Ordering::Relaxed) % 2 == 1 && self.accel.cached().is_some() {
            jobs.reverse();
        }
        let outcome = workers.run(
            jobs,
            || Scratch::<W>::new(self.learnt.take()),
            |scratch: &mut Scratch<W>, pixels: TilePixels<'_>| {
                task.render(scratch, pixels);
                tiles_done.fetch_add(1, Ordering::Relaxed);
            },
        );
        outcome.states.iter().for_each(|scratch| self.learnt.put(scratch.dispatch));
        let frame = tiled.assemble(size, &self.tiles);
        (frame, self.stats(&outcome, threads, start.elapsed().as_secs_f64()))
    }

    fn stats<const W: usize>(
        &self,
        outcome: &Outcome<Scratch<W>>,
        threads: usize,
        seconds: f64,
    ) -> FrameStats {
        let camera: Tally = outcome.states.iter().map(|scratch| scratch.camera).sum();
        let shadow: Tally = outcome.states.iter().map(|scratch| scratch.shadow).sum();
        let mut times: Vec<f32> =
            outcome.states.iter().flat_map(|scratch| scratch.tiles.iter().copied()).collect();
        FrameStats {
            camera: RayCount::new(camera, threads),
            shadow: RayCount::new(shadow, threads),
            total: RayCount::of(camera.rays + shadow.rays, seconds),
            seconds,
            tiles: self.tiles.len(),
            tile_p50: quantile(&mut times, 0.5),
            tile_p99: quantile(&mut times, 0.99),
            threads,
            pinned: outcome.pinned,
        }
    }
}
