//! `raypack render [SCENE] -o out.png`: a still or a camera path.

mod heat;
mod report;

use super::cache_options::{BYTES_PER_WORKER, CacheArgs, Within};
use super::looks::LooksOptions;
use super::memory::Beside;
use super::model::Model;
use super::options::{AccuracyOption, BuildOptions, PoolsOption, as_option, orbit};
use super::outputs::Outputs;
use super::progress::watch;
use super::report::Json;
use super::scene::{Looks, Scene};
use crate::error::{Error, Result};
use crate::mesh::Mesh;
use crate::mesh::generate::plant;
use crate::profile::Profile;
use crate::render::{First, RenderSettings, Renderer, Size, Tuning, memory_beside};
use crate::scene::effects::Effect;
use crate::scene::{Camera, Lighting, Orbit, Surface};
use crate::simd::Isa;
use crate::store::{self, is_scene};
use crate::traverse::Kernel;
use report::{FirstShot, Report, Shot};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Duration;
use tracing::{debug, info};

/// The size of pictures of models: square, as benchmarks have it.
const MODEL_SIZE: Size = Size { width: 1024, height: 1024 };

/// The size of pictures of the demo.
const DEMO_SIZE: Size = Size { width: 1280, height: 720 };

/// Render a picture, or a path of pictures, of a model
///
/// Prints what was rendered, how long each step took, and the rays per second by kind of ray.
/// RAYPACK_ISA=portable|avx2|avx512 forces an instruction set.
#[derive(Clone, Debug, clap::Args)]
pub struct Args {
    /// The model: .obj, .ply, .stl, .gltf or .glb, or a .rpk scene file; without it, the built-in process plant
    scene: Option<PathBuf>,
    #[command(flatten)]
    outputs: Outputs,
    /// The camera, or a TOML file with these keys; without it, the whole scene is framed. FOV is
    /// vertical, in degrees (45 if left out); UP is 0,1,0 if left out. With ;aperture=D, a lens of that diameter, what
    /// is nearer or farther than AT, or than ;focus=D, is out of focus
    #[arg(long, value_name = "eye=X,Y,Z;at=X,Y,Z;up=X,Y,Z;fov=DEG", allow_hyphen_values = true)]
    camera: Option<String>,
    /// Width and height in pixels [default: 1024x1024, and 1280x720 for the built-in scene]
    #[arg(long, value_name = "WxH", allow_hyphen_values = true)]
    size: Option<String>,
    /// Samples per pixel, at most [default: 1, and 64 if effects of chance run, such as soft shadows]
    #[arg(long, value_name = "N")]
    samples: Option<u32>,
    #[command(flatten)]
    looks: LooksOptions,
    /// Worker threads; 0 for all processors [default: the profile's]
    #[arg(long, value_name = "N")]
    threads: Option<usize>,
    /// Keep each worker on one processor
    #[arg(long)]
    pin: bool,
    /// Rays that are traced together: 1, 4, 8, 16, 64 (a stream), 256 or 1024 (beams) or 4096 (lists) [default: the profile's]
    #[arg(long, value_name = "N")]
    packet: Option<usize>,
    /// Side of a tile in pixels [default: the profile's]
    #[arg(long, value_name = "PIXELS")]
    tile: Option<u32>,
    #[command(flatten)]
    build: BuildOptions,
    #[command(flatten)]
    accuracy: AccuracyOption,
    #[command(flatten)]
    pools: PoolsOption,
    #[command(flatten)]
    cache: CacheArgs,
    /// What comes before it is needed, with --loading async: what lies beside a block that is read from the disk, as long
    /// as there is room (beside: so it is by itself), what coming tiles and the next frame will need (ahead), or nothing
    /// (off)
    #[arg(long, value_name = "off|beside|ahead", help_heading = "Scene files within --memory")]
    prefetch: Option<String>,
    /// Write what each pixel's ray costs instead of what it sees, or how many rays its samples cast for an effect (uses,
    /// such as look-ups of textures, of one that casts none; samples beyond the first of antialiasing): .png in
    /// colours, .exr or .pfm as numbers
    #[arg(
        long,
        value_name = "steps|tests|leaves|time|EFFECT",
        conflicts_with_all = ["orbit", "depth", "normals"]
    )]
    heatmap: Option<String>,
    /// Leave out the shadows
    #[arg(long)]
    no_shadows: bool,
    /// Render N frames while the eye goes round the point that it looks at: out_000.png and so on
    #[arg(long, value_name = "N")]
    orbit: Option<u32>,
    /// Degrees from one frame of --orbit to the next; positive goes to the right
    #[arg(
        long,
        value_name = "DEG",
        default_value_t = 2.0,
        requires = "orbit",
        allow_negative_numbers = true
    )]
    step: f64,
    /// With --memory on a .rpk: have a first picture within so many milliseconds, beside the frame's as
    /// out.first.png, with boxes in place of what has not come from the file yet
    #[arg(long, value_name = "MS", requires = "memory", conflicts_with = "heatmap")]
    first_within: Option<u32>,
    #[command(flatten)]
    json: Json,
}

/// Runs the command.
pub fn run(args: &Args) -> Result<()> {
    // Everything that can be wrong with the options, before any work.
    let isa = Isa::from_env()?;
    let profile = args.build.profile_for(args.scene.as_deref(), true)?;
    let settings = args.settings(&profile)?;
    let accuracy = args.accuracy.mode()?;
    args.pools.check(&args.build, accuracy)?;
    args.looks.check()?;
    let camera = args.camera.as_deref().map(Camera::parse).transpose()?;
    let orbit = args.orbit()?;
    let heatmap = args.heatmap.as_deref().map(heat::Shown::parse).transpose()?;
    let others: Vec<_> = args.scene.as_deref().into_iter().chain(args.json.file()).collect();
    args.outputs.check(args.orbit, &others)?;
    args.json.check()?;
    let first_within = args.first_within()?;
    info!("profile {}, instruction set {isa}", args.build.name());
    debug!("{settings:?}");

    let mut scene = match (&args.scene, args.build.limit()?) {
        (Some(path), Some(memory)) if is_scene(path) => {
            let threads = settings.tuning.worker_count();
            let prefetch = args.prefetch.as_deref().map(str::parse).transpose()?;
            args.open_within(path, &settings, Within { memory, accuracy, threads, isa, prefetch })?
        }
        (path, limit) => {
            let threads = settings.tuning.worker_count();
            let request = args.looks.check()?;
            // Opened only where its size matters.
            let environment = limit.map(|_| args.looks.environment_bytes()).transpose()?.flatten();
            let of_mesh = |mesh: &Mesh| {
                let (materials, uses) = (mesh.colors.materials(), mesh.colors.uses());
                memory_beside(materials, &uses, &mesh.images, &request, environment.is_some(), threads)
            };
            let fixed = settings.frame_bytes() + threads * BYTES_PER_WORKER + environment.unwrap_or(0);
            let beside = Beside { fixed, accuracy, of_mesh: &of_mesh };
            match (path, limit) {
                (Some(path), _) => Scene::prepare_beside(path, &args.build, &profile.build, isa, &beside)?,
                (None, Some(limit)) => Model::demo().build_beside(&profile.build, isa, limit, &beside)?,
                (None, None) => Model::demo().build(&args.build, &profile.build, isa)?,
            }
        }
    };
    scene.accel.set_accuracy(accuracy);
    args.pools.make(&scene.accel)?;
    let camera = camera.unwrap_or_else(|| args.default_camera(&scene, settings.size));
    camera.check()?;
    if let Some(shown) = heatmap {
        return args.heat(&scene, camera, settings, shown);
    }
    let cameras: Vec<Camera> = orbit.map_or_else(|| vec![camera], |orbit| orbit.cameras(camera).collect());
    match &scene.looks {
        Looks::Mesh(mesh) => args.render(&scene, mesh, settings, cameras, None),
        Looks::Stored(stored) => args.render(&scene, stored, settings, cameras, None),
        Looks::Cached(cached) => args.render(&scene, cached, settings, cameras, first_within),
    }
}

impl Args {
    /// A scene file of which a part will be in memory.
    fn open_within(&self, path: &Path, settings: &RenderSettings, within: Within) -> Result<Scene> {
        if self.heatmap.is_some() {
            let message = "it walks a tree that is all in memory; leave --memory out";
            return Err(Error::option("--heatmap", message));
        }
        let request = self.looks.check()?;
        // The picture that a frame was at first stays until the frame is complete.
        let frames = 1 + usize::from(self.first_within.is_some());
        let environment = self.looks.environment_bytes()?;
        let beside = |file: &store::File, workers| {
            let meta = file.meta();
            let materials = meta.colors.materials();
            let effects = memory_beside(
                materials,
                &meta.uses,
                &file.images(),
                &request,
                environment.is_some(),
                workers,
            );
            frames * settings.frame_bytes() + effects + environment.unwrap_or(0)
        };
        self.cache.open(path, within, beside)
    }

    /// Draws what pixels cost.
    fn heat(
        &self,
        scene: &Scene,
        camera: Camera,
        settings: RenderSettings,
        shown: heat::Shown,
    ) -> Result<()> {
        let heat::Shown::Effect(effect) = shown else {
            if self.samples.is_some() {
                return Err(Error::option(
                    "--samples",
                    "one ray through each pixel is looked at; leave it out",
                ));
            }
            let costs = |cost| heat::costs(scene, &camera, settings.size, cost);
            let heat::Shown::Cost(cost) = shown else { unreachable!("it is one of both") };
            return heat::give(
                scene,
                camera,
                settings.size,
                shown,
                &costs(cost),
                self.outputs.picture(),
                (&self.build, &self.json),
            );
        };
        match &scene.looks {
            Looks::Mesh(mesh) => self.heat_of(scene, mesh, camera, settings, effect),
            Looks::Stored(stored) => self.heat_of(scene, stored, camera, settings, effect),
            Looks::Cached(cached) => self.heat_of(scene, cached, camera, settings, effect),
        }
    }

    /// Draws how many rays pixels cast for an effect, or how often they use it.
    fn heat_of(
        &self,
        scene: &Scene,
        surface: &impl Surface,
        camera: Camera,
        settings: RenderSettings,
        effect: Effect,
    ) -> Result<()> {
        let size = settings.size;
        let lighting = scene.reading(|| self.lighting(&camera, scene))?;
        let staged = self.looks.stage(scene, surface, &camera, lighting, (self.samples, !self.no_shadows))?;
        let shadows = staged.analysis.set().has(Effect::Shadows);
        let settings = RenderSettings { samples: staged.samples, shadows, ..settings };
        let mut renderer = Renderer::new(&scene.accel, surface, settings)?;
        if let Some(appearance) = &staged.appearance {
            renderer = renderer.with_appearance(appearance)?;
        }
        let tiles_done = AtomicUsize::new(0);
        let fraction = || tiles_done.load(Ordering::Relaxed) as f64 / renderer.tile_count() as f64;
        let counts =
            watch("counting", fraction, || renderer.counts_of(effect, &camera, &lighting, &tiles_done))?;
        let shown = heat::Shown::Effect(effect);
        let options = (&self.build, &self.json);
        heat::give(scene, camera, size, shown, &counts, self.outputs.picture(), options)
    }

    /// Renders a frame for each camera, the first of which the light is made for, and reports.
    fn render(
        &self,
        scene: &Scene,
        surface: &impl Surface,
        settings: RenderSettings,
        cameras: Vec<Camera>,
        first_within: Option<Duration>,
    ) -> Result<()> {
        let lighting = scene.reading(|| self.lighting(&cameras[0], scene))?;
        let staged =
            self.looks.stage(scene, surface, &cameras[0], lighting, (self.samples, !self.no_shadows))?;
        let settings = RenderSettings {
            samples: staged.samples,
            shadows: staged.analysis.set().has(Effect::Shadows),
            ..settings
        };
        let mut renderer = Renderer::new(&scene.accel, surface, settings)?;
        if let Some(appearance) = &staged.appearance {
            renderer = renderer.with_appearance(appearance)?;
        }
        let mut shots = Vec::with_capacity(cameras.len());
        let tiles_done = AtomicUsize::new(0);
        let tiles = renderer.tile_count() * cameras.len();
        let fraction = || tiles_done.load(Ordering::Relaxed) as f64 / tiles as f64;
        watch("rendering", fraction, || {
            for (number, &camera) in (0..).zip(&cameras) {
                renderer.announce(cameras.get(number as usize + 1).copied());
                let (first, frame, stats) = match first_within {
                    None => {
                        let (frame, stats) = renderer.frame_with_progress(&camera, &lighting, &tiles_done)?;
                        (None, frame, stats)
                    }
                    Some(limit) => renderer.bounded_frame(&camera, &lighting, &tiles_done, limit)?,
                };
                let first = first.map(|First { frame, stats }| {
                    let file = self.outputs.write_first(&frame, number, self.orbit)?;
                    Ok::<_, Error>(FirstShot { file, stats })
                });
                let first = first.transpose()?;
                let file = self.outputs.write(&frame, number, self.orbit)?;
                debug!("frame {number} in {:.4} s", stats.seconds);
                shots.push(Shot { file, camera, stats, first });
            }
            Ok::<(), Error>(())
        })?;
        let memory = scene.memory_report(&self.build)?;
        let report = Report::new(
            scene,
            renderer.settings(),
            self.build.name(),
            shots,
            memory,
            &staged.analysis.effects,
        );
        self.json.give(&report.text(scene), &report)
    }

    fn settings(&self, profile: &Profile) -> Result<RenderSettings> {
        let size = match &self.size {
            Some(text) => text.parse()?,
            None if self.scene.is_none() => DEMO_SIZE,
            None => MODEL_SIZE,
        };
        let packet = match self.packet {
            None => profile.render.packet,
            Some(width) => Kernel::of_width(width).ok_or_else(|| {
                Error::option("--packet", format!("{width} is not one of 1, 4, 8, 16, 64, 256, 1024, 4096"))
            })?,
        };
        let tuning = Tuning {
            packet,
            tile: self.tile.unwrap_or(profile.render.tile),
            threads: self.threads.unwrap_or(profile.render.threads),
            pin: self.pin || profile.render.pin,
        };
        let settings = RenderSettings {
            size,
            samples: self.samples.unwrap_or(1),
            shadows: !self.no_shadows,
            aovs: self.outputs.aovs(),
            tuning,
        };
        settings.check().map_err(as_option)?;
        Ok(settings)
    }

    /// When a first picture is to be there.
    fn first_within(&self) -> Result<Option<Duration>> {
        let Some(limit) = self.first_within else { return Ok(None) };
        if !self.scene.as_deref().is_some_and(is_scene) {
            let message = "only of a .rpk scene file some may have to come yet; leave it out";
            return Err(Error::option("--first-within", message));
        }
        if limit == 0 {
            return Err(Error::option("--first-within", "0 is no time; give at least 1"));
        }
        Ok(Some(Duration::from_millis(limit.into())))
    }

    fn orbit(&self) -> Result<Option<Orbit>> {
        let Some(frames) = self.orbit else { return Ok(None) };
        orbit("--orbit", frames, self.step).map(Some)
    }

    fn default_camera(&self, scene: &Scene, size: Size) -> Camera {
        if self.scene.is_none() {
            let view = plant::demo_view();
            Camera { fov: view.fov_degrees, ..Camera::new(view.eye, view.at) }
        } else {
            Camera::framing(&scene.accel.bounds(), size.aspect())
        }
    }

    /// The demo has a sun of its own; other scenes get their light from over the camera's
    /// shoulder. It stays where it is while the camera moves.
    fn lighting(&self, camera: &Camera, scene: &Scene) -> Lighting {
        if self.scene.is_none() {
            Lighting::outdoors(crate::Vec3::Y, plant::demo_view().sun)
        } else {
            Lighting::for_view(camera, &scene.accel)
        }
    }
}
