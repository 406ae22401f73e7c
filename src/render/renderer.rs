//! Cameras to frames.

use super::frame::{Frame, TilePixels, TiledFrame};
use super::order::{Tile, tiles};
use super::scheduler::{Outcome, Workers};
use super::settings::RenderSettings;
use super::shade::Shader;
use super::stats::{FrameStats, RayCount, Tally};
use super::tile::{Calls, Scratch, TileTask};
use crate::error::Result;
use crate::mesh::Mesh;
use crate::scene::{Camera, Lighting, Surface};
use crate::traverse::{Accel, Dispatch, Kernel, PacketWidth, RayPacket};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};
use std::time::Instant;

/// Makes pictures of one scene with one set of settings.
#[derive(Debug)]
pub struct Renderer<'a, S = Mesh> {
    accel: &'a Accel,
    surface: &'a S,
    settings: RenderSettings,
    tiles: Vec<Tile>,
    /// What workers learnt in the frame before about which kernel is quickest.
    learnt: Mutex<Vec<Dispatch>>,
}

impl<'a, S: Surface> Renderer<'a, S> {
    /// A renderer; `accel` must have been built from what `surface` says the corners of.
    ///
    /// # Errors
    /// As [`RenderSettings::check`].
    pub fn new(accel: &'a Accel, surface: &'a S, settings: RenderSettings) -> Result<Self> {
        settings.check()?;
        let tiles = tiles(settings.size.width, settings.size.height, settings.tuning.tile);
        Ok(Self { accel, surface, settings, tiles, learnt: Mutex::default() })
    }

    /// The settings.
    pub fn settings(&self) -> &RenderSettings {
        &self.settings
    }

    /// How many tiles a frame has.
    pub fn tile_count(&self) -> usize {
        self.tiles.len()
    }

    /// Renders a frame.
    pub fn frame(&self, camera: &Camera, lighting: &Lighting) -> (Frame, FrameStats) {
        self.frame_with_progress(camera, lighting, &AtomicUsize::new(0))
    }

    /// Renders a frame; `tiles_done` is raised by one with each tile and can be read meanwhile.
    pub fn frame_with_progress(
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
        let workers = Workers { threads: tuning.worker_count(), pin: tuning.pin };
        let task = TileTask {
            accel: self.accel,
            calls,
            shader: Shader::new(self.surface, lighting, shadows),
            view: camera.view(size.width, size.height),
            samples,
        };

        let mut tiled = TiledFrame::new(size, aovs);
        let outcome = workers.run(
            tiled.split(&self.tiles),
            || {
                let learnt = self.learnt.lock().unwrap_or_else(PoisonError::into_inner).pop();
                Scratch::<W>::new(learnt.unwrap_or_default())
            },
            |scratch: &mut Scratch<W>, pixels: TilePixels<'_>| {
                task.render(scratch, pixels);
                tiles_done.fetch_add(1, Ordering::Relaxed);
            },
        );
        *self.learnt.lock().unwrap_or_else(PoisonError::into_inner) =
            outcome.states.iter().map(|scratch| scratch.dispatch).collect();
        let frame = tiled.assemble(size, &self.tiles);
        (frame, self.stats(&outcome, start.elapsed().as_secs_f64()))
    }

    fn stats<const W: usize>(&self, outcome: &Outcome<Scratch<W>>, seconds: f64) -> FrameStats {
        let threads = outcome.states.len();
        let camera: Tally = outcome.states.iter().map(|scratch| scratch.camera).sum();
        let shadow: Tally = outcome.states.iter().map(|scratch| scratch.shadow).sum();
        FrameStats {
            camera: RayCount::new(camera, threads),
            shadow: RayCount::new(shadow, threads),
            total: RayCount::of(camera.rays + shadow.rays, seconds),
            seconds,
            tiles: self.tiles.len(),
            threads,
            pinned: outcome.pinned,
        }
    }
}
