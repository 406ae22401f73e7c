//! Cameras to frames.

use super::bounded::{First, FirstStats, StandIn, StandInCost};
use super::effects::{Appearance, EffectCosts, EffectScratch, EffectTask, Limits, Tallies};
use super::frame::{Frame, TilePixels};
use super::lookahead::{Course, Lookahead, Seen};
use super::order::{Tile, tiles};
use super::scheduler::{Outcome, Sharing, Workers};
use super::settings::RenderSettings;
use super::shade::Shader;
use super::stats::{FrameStats, RayCount, Tally, quantile};
use super::tile::{Calls, Scratch, TileTask, squares};
use crate::cache::Cached;
use crate::error::Result;
use crate::mesh::Mesh;
use crate::scene::effects::Effect;
use crate::scene::{Camera, Lighting, Surface};
use crate::traverse::{Accel, DispatchPool, Kernel, PacketWidth, Places, RayPacket};
use std::collections::HashSet;
use std::mem;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

/// Makes pictures of one scene with one set of settings.
#[derive(Debug)]
pub struct Renderer<'a, S = Mesh> {
    accel: &'a Accel,
    surface: &'a S,
    settings: RenderSettings,
    tiles: Vec<Tile>,
    /// What workers learnt in the frames before about which kernel is quickest.
    learnt: DispatchPool,
    /// What squares of the picture cost in the frames before.
    places: Places,
    /// Frames so far.
    frames: AtomicUsize,
    /// Where the camera goes, if anybody looks ahead.
    course: Option<Course<'a>>,
    /// What boxes cost in the frames before.
    stand_in: StandInCost,
    /// What there is to show beside matt surfaces, if anything.
    appearance: Option<&'a Appearance>,
    /// How far its accuracy goes.
    limits: Limits,
    /// Seconds that each tile took, since they were last taken, if they are kept.
    tile_times: Option<Mutex<Vec<f32>>>,
}

/// A frame that is to be drawn.
struct Wanted<'a> {
    seen: Seen,
    lighting: &'a Lighting,
    /// Raised by one with each tile that is complete.
    tiles_done: &'a AtomicUsize,
    /// When a first picture is to be there.
    limit: Option<Duration>,
}

/// A frame, and what was there before.
struct Drawn {
    first: Option<First>,
    frame: Frame,
    stats: FrameStats,
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
        let places = Places::new(squares(settings.size.width) * squares(settings.size.height));
        let (frames, stand_in) = (AtomicUsize::new(0), StandInCost::default());
        Ok(Self {
            accel,
            surface,
            settings,
            tiles,
            learnt,
            places,
            frames,
            course: Course::of(accel),
            stand_in,
            appearance: None,
            limits: Limits::default(),
            tile_times: None,
        })
    }

    /// The same, with effects. Light then comes from `appearance`, not from what frames are given.
    ///
    /// # Errors
    /// As [`Limits::check`](super::Limits::check).
    pub fn with_appearance(self, appearance: &'a Appearance) -> Result<Self> {
        appearance.limits.check()?;
        Ok(Self { appearance: Some(appearance), limits: appearance.limits, ..self })
    }

    /// The same with other limits than the appearance has.
    ///
    /// # Errors
    /// As [`Limits::check`](super::Limits::check).
    pub fn with_limits(self, limits: Limits) -> Result<Self> {
        limits.check()?;
        Ok(Self { limits, ..self })
    }

    /// The same, and the seconds that each tile takes are kept until they are [taken](Self::take_tile_times).
    pub(crate) fn keeping_tile_times(self) -> Self {
        Self { tile_times: Some(Mutex::default()), ..self }
    }

    /// The seconds that each tile took, of all frames since these were last taken; none if they are not kept.
    pub(crate) fn take_tile_times(&self) -> Vec<f32> {
        let taken =
            |times: &Mutex<Vec<f32>>| mem::take(&mut *times.lock().unwrap_or_else(PoisonError::into_inner));
        self.tile_times.as_ref().map(taken).unwrap_or_default()
    }

    /// Below what seconds half and 99 % of a frame's tiles stayed.
    fn tile_quantiles(&self, times: impl Iterator<Item = f32>) -> [f64; 2] {
        let mut times: Vec<f32> = times.collect();
        if let Some(kept) = &self.tile_times {
            kept.lock().unwrap_or_else(PoisonError::into_inner).extend(&times);
        }
        [0.5, 0.99].map(|share| quantile(&mut times, share))
    }

    /// The settings.
    pub fn settings(&self) -> &RenderSettings {
        &self.settings
    }

    /// How many tiles a frame has.
    pub fn tile_count(&self) -> usize {
        self.tiles.len()
    }

    /// Says which camera comes after the one of the frame that is rendered next, or that none does. Towards the end of
    /// that frame, what the next one will need first of a scene that is not all in memory is asked for. Where nothing is
    /// said, the camera is thought to go on as it came.
    pub fn announce(&self, next: Option<Camera>) {
        if let Some(course) = &self.course {
            course.announce(next);
        }
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
        let wanted = Wanted { seen: self.seen(camera), lighting, tiles_done, limit: None };
        self.drawn(&wanted).map(|drawn| (drawn.frame, drawn.stats))
    }

    /// The same in two steps: a first picture within `limit`, in which boxes stand for what has not come from
    /// the file by then, and the frame, which is the same as without a limit. Of a scene that is all in memory,
    /// nothing ever has to come, and there is no first picture.
    ///
    /// # Errors
    /// As [`frame_with_progress`](Self::frame_with_progress).
    pub fn bounded_frame(
        &self,
        camera: &Camera,
        lighting: &Lighting,
        tiles_done: &AtomicUsize,
        limit: Duration,
    ) -> Result<(Option<First>, Frame, FrameStats)> {
        let wanted = Wanted { seen: self.seen(camera), lighting, tiles_done, limit: Some(limit) };
        self.drawn(&wanted).map(|drawn| (drawn.first, drawn.frame, drawn.stats))
    }

    /// How many rays an effect casts for each pixel's samples, or how often it is [used](super::EffectCost::uses), on
    /// average, row by row from the top; of [`Effect::Antialiasing`], the samples of each pixel beyond its first. Nothing
    /// of an effect that does not run.
    ///
    /// # Errors
    /// As [`frame_with_progress`](Self::frame_with_progress).
    pub fn counts_of(
        &self,
        effect: Effect,
        camera: &Camera,
        lighting: &Lighting,
        tiles_done: &AtomicUsize,
    ) -> Result<Vec<f32>> {
        // The plain renderer counts nothing pixel by pixel: what it does is done by the other one.
        let plain;
        let appearance = match self.appearance {
            Some(appearance) => appearance,
            None => {
                plain = Appearance::plain(lighting, self.settings.shadows);
                &plain
            }
        };
        let wanted = Wanted { seen: self.seen(camera), lighting, tiles_done, limit: None };
        let count = || self.drawn_with_effects(appearance, &wanted, Some(effect)).frame;
        let frame = match self.accel.cached() {
            Some(cached) => cached.or_error(count)?,
            None => count(),
        };
        Ok(frame.color.into_iter().map(|[count, ..]| count).collect())
    }

    fn drawn(&self, wanted: &Wanted<'_>) -> Result<Drawn> {
        match self.accel.cached() {
            Some(cached) => {
                let drawn = cached.or_error(|| self.drawn_by_kernel(wanted));
                cached.set_deadline(None);
                drawn
            }
            None => Ok(self.drawn_by_kernel(wanted)),
        }
    }

    fn drawn_by_kernel(&self, wanted: &Wanted<'_>) -> Drawn {
        let Some(appearance) = self.appearance else { return self.drawn_plain(wanted) };
        // A first picture has no effects: it has boxes for what it lacks.
        let first = wanted
            .limit
            .and_then(|_| self.drawn_plain(&Wanted { tiles_done: &AtomicUsize::new(0), ..*wanted }).first);
        Drawn { first, ..self.drawn_with_effects(appearance, wanted, None) }
    }

    fn drawn_plain(&self, wanted: &Wanted<'_>) -> Drawn {
        match self.settings.tuning.packet {
            Kernel::Single => self.drawn_with(Calls::<1>::PACKETS, wanted),
            Kernel::Packet4 => self.drawn_with(Calls::<4>::PACKETS, wanted),
            Kernel::Packet8 => self.drawn_with(Calls::<8>::PACKETS, wanted),
            Kernel::Packet16 => self.drawn_with(Calls::<16>::PACKETS, wanted),
            // A scene that is in memory in part has neither lists nor wide beams, and gives its turns by squares.
            Kernel::Filter if self.accel.cached().is_none() => self.drawn_with(Calls::LISTS, wanted),
            Kernel::Stream | Kernel::Filter => self.drawn_with(Calls::STREAM, wanted),
            Kernel::WideTile if self.accel.cached().is_none() => self.drawn_with(Calls::LOTS, wanted),
            Kernel::Tile | Kernel::WideTile => self.drawn_with(Calls::TILES, wanted),
        }
    }

    fn drawn_with<const W: usize>(&self, calls: Calls<W>, wanted: &Wanted<'_>) -> Drawn
    where
        RayPacket<W>: PacketWidth<W>,
    {
        let start = Instant::now();
        let RenderSettings { size, samples, shadows, aovs, ref tuning } = self.settings;
        let threads = tuning.worker_count();
        let view = wanted.seen.view;
        let mut task = TileTask {
            accel: self.accel,
            calls: calls.within(tuning.tile),
            shader: Shader::new(self.surface, wanted.lighting, shadows),
            view,
            samples,
            places: &self.places,
            columns: squares(size.width),
            stand_in: None,
        };
        let mut frame = Frame::black(size, aovs);

        let mut outcome = Outcome::default();
        let mut first = None;
        if let Some(cached) = self.accel.cached() {
            cached.begin_frame();
            if let Some(limit) = wanted.limit {
                cached.set_deadline(Some(self.stand_in.deadline(limit, size.pixels(), threads)));
                task.stand_in = Some(StandIn { cached, view, cost: &self.stand_in });
            }
        }
        let backwards = self.goes_backwards();
        let jobs = self.jobs(&mut frame, backwards);
        self.pass(&task, jobs, backwards, wanted, &mut outcome);

        if let (Some(cached), Some(_)) = (self.accel.cached(), wanted.limit) {
            let stand_ins: u64 = outcome.states.iter().map(|scratch| scratch.stand_ins).sum();
            let stand_ins = stand_ins as f64 / size.pixels() as f64;
            let seconds = start.elapsed().as_secs_f64();
            first = Some(First { frame: frame.clone(), stats: FirstStats { seconds, stand_ins } });
            cached.set_deadline(None);
            task.stand_in = None;
            let late: HashSet<(u32, u32)> =
                outcome.states.iter().flat_map(|scratch| scratch.late.iter().copied()).collect();
            let mut jobs = frame.split(&self.tiles, tuning.tile);
            jobs.retain(|pixels| late.contains(&(pixels.tile.x, pixels.tile.y)));
            if !jobs.is_empty() {
                self.pass(&task, jobs, false, wanted, &mut outcome);
            }
        }
        Drawn { first, frame, stats: self.stats(&outcome, threads, start.elapsed().as_secs_f64()) }
    }

    fn drawn_with_effects(
        &self,
        appearance: &Appearance,
        wanted: &Wanted<'_>,
        counted: Option<Effect>,
    ) -> Drawn {
        let start = Instant::now();
        let RenderSettings { size, samples, aovs, ref tuning, .. } = self.settings;
        let task = EffectTask {
            world: appearance.world(self.accel, self.surface, tuning.packet, self.limits),
            view: wanted.seen.view,
            samples,
            error: self.limits.error,
            counted,
        };
        if let Some(cached) = self.accel.cached() {
            cached.begin_frame();
        }
        let mut frame = Frame::black(size, aovs);
        let backwards = self.goes_backwards();
        let (workers, jobs) = (self.workers(backwards), self.jobs(&mut frame, backwards));
        let lookahead = self.lookahead(&jobs, wanted.seen, &workers);
        let outcome = workers.run(
            jobs,
            || EffectScratch::new(self.learnt.take(), counted.is_some()),
            |scratch: &mut EffectScratch, pixels: TilePixels<'_>| {
                if let Some(lookahead) = &lookahead {
                    lookahead.at(&pixels.tile);
                }
                task.render(scratch, pixels);
                wanted.tiles_done.fetch_add(1, Ordering::Relaxed);
            },
        );
        outcome.states.iter().for_each(|scratch| self.learnt.put(scratch.waves.tracer.learnt()));

        let mut costs = Tallies::default();
        outcome.states.iter().for_each(|scratch| costs += scratch.waves.tallies);
        let camera: Tally = outcome.states.iter().map(|scratch| scratch.waves.camera).sum();
        let tiles = outcome.states.iter().flat_map(|scratch| scratch.tiles.iter().copied());
        let [tile_p50, tile_p99] = self.tile_quantiles(tiles);
        let seconds = start.elapsed().as_secs_f64();
        let threads = tuning.worker_count();
        let samples: u64 = outcome.states.iter().map(|scratch| scratch.samples).sum();
        let stats = FrameStats {
            camera: RayCount::new(camera, threads),
            shadow: RayCount::new(costs[Effect::Shadows], threads),
            total: RayCount::of(camera.rays + costs.rays(), seconds),
            seconds,
            tiles: self.tiles.len(),
            tile_p50,
            tile_p99,
            threads,
            pinned: outcome.pinned,
            samples: samples as f64 / size.pixels() as f64,
            costs: EffectCosts::new(appearance.set, &costs, threads, seconds),
        };
        Drawn { first: None, frame, stats }
    }

    /// The scene, if not all of it is in memory.
    fn partial(&self) -> Option<&Cached> {
        self.accel.cached().map(|cached| &**cached).filter(|cached| !cached.is_whole())
    }

    /// Whether a frame that begins goes from the last tile to the first. What the last frame has used last is there still:
    /// this one begins with it.
    fn goes_backwards(&self) -> bool {
        let is_odd = self.frames.fetch_add(1, Ordering::Relaxed) % 2 == 1;
        is_odd && self.partial().is_some()
    }

    /// A frame's tiles, in the order in which they are to be begun.
    fn jobs<'f>(&self, frame: &'f mut Frame, backwards: bool) -> Vec<TilePixels<'f>> {
        let mut jobs = frame.split(&self.tiles, self.settings.tuning.tile);
        if backwards {
            jobs.reverse();
        }
        jobs
    }

    /// Whether anything is looked ahead for.
    #[cfg(test)]
    pub(crate) const fn looks_ahead(&self) -> bool {
        self.course.is_some()
    }

    /// How a frame is seen that begins, and the one after it.
    fn seen(&self, camera: &Camera) -> Seen {
        let RenderSettings { size, ref tuning, .. } = self.settings;
        let view = |camera: &Camera| camera.view(size.width, size.height);
        let next = self.course.as_ref().and_then(|course| course.after(camera));
        Seen {
            view: view(camera),
            next: next.as_ref().map(view),
            in_beams: matches!(tuning.packet, Kernel::Tile | Kernel::WideTile),
        }
    }

    /// What looks ahead while some tiles are rendered, if anything does.
    fn lookahead(&self, jobs: &[TilePixels<'_>], seen: Seen, workers: &Workers) -> Option<Lookahead<'a>> {
        let course = self.course.as_ref()?;
        let tiles = jobs.iter().map(|pixels| pixels.tile).collect();
        Some(course.lookahead(seen, tiles, workers, self.settings.tuning.worker_count()))
    }

    /// Who renders tiles, of which the last come first or not.
    fn workers(&self, backwards: bool) -> Workers {
        let tuning = &self.settings.tuning;
        let threads = tuning.worker_count();
        match self.partial() {
            None => Workers { threads, pin: tuning.pin, sharing: Sharing::Runs },
            // Some wait for their blocks while others are at work.
            Some(cached) => {
                // Where blocks have to go, tiles that are begun at about the same time are neighbours, so that they
                // need the same ones. Where all have room, each worker has a part of the picture to itself, as
                // in memory, and what is near it in its own caches.
                let sharing = if cached.is_short() {
                    Sharing::Queue
                } else if backwards {
                    Sharing::MirroredRuns
                } else {
                    Sharing::Runs
                };
                Workers { threads: cached.workers(threads), pin: false, sharing }
            }
        }
    }

    /// Renders some tiles.
    fn pass<const W: usize>(
        &self,
        task: &TileTask<'_, S, W>,
        jobs: Vec<TilePixels<'_>>,
        backwards: bool,
        wanted: &Wanted<'_>,
        all: &mut Outcome<Scratch<W>>,
    ) where
        RayPacket<W>: PacketWidth<W>,
    {
        let workers = self.workers(backwards);
        let lookahead = self.lookahead(&jobs, wanted.seen, &workers);
        let outcome = workers.run(
            jobs,
            || Scratch::<W>::new(self.learnt.take(), task.calls.side, task.calls.lots),
            |scratch: &mut Scratch<W>, pixels: TilePixels<'_>| {
                if let Some(lookahead) = &lookahead {
                    lookahead.at(&pixels.tile);
                }
                if task.render(scratch, pixels) {
                    wanted.tiles_done.fetch_add(1, Ordering::Relaxed);
                }
            },
        );
        outcome.states.iter().for_each(|scratch| self.learnt.put(scratch.dispatch));
        all.states.extend(outcome.states);
        all.pinned = outcome.pinned;
    }

    fn stats<const W: usize>(
        &self,
        outcome: &Outcome<Scratch<W>>,
        threads: usize,
        seconds: f64,
    ) -> FrameStats {
        let camera: Tally = outcome.states.iter().map(|scratch| scratch.camera).sum();
        let shadow: Tally = outcome.states.iter().map(|scratch| scratch.shadow).sum();
        let tiles = outcome.states.iter().flat_map(|scratch| scratch.tiles.iter().copied());
        let [tile_p50, tile_p99] = self.tile_quantiles(tiles);
        FrameStats {
            camera: RayCount::new(camera, threads),
            shadow: RayCount::new(shadow, threads),
            total: RayCount::of(camera.rays + shadow.rays, seconds),
            seconds,
            tiles: self.tiles.len(),
            tile_p50,
            tile_p99,
            threads,
            pinned: outcome.pinned,
            samples: f64::from(self.settings.samples),
            costs: EffectCosts::default(),
        }
    }
}
