//! `raypack effects SCENE`: what a scene calls for.

use super::looks::{LooksOptions, callers};
use super::options::BuildOptions;
use super::report::{ENGINE, Engine, Json, Lines};
use super::scene::{Looks, Scene};
use crate::error::Result;
use crate::scene::effects::Call;
use crate::scene::{Camera, Lighting, Surface};
use crate::simd::Isa;
use serde::Serialize;
use std::path::PathBuf;

/// Say which effects a scene calls for, and what calls for each
///
/// An effect runs only if something in the scene calls for it: a material that triangles have, a light, the camera.
/// `render` shows what is on here; --effects turns each on or off, there as here.
#[derive(Clone, Debug, clap::Args)]
pub struct Args {
    /// The model: .obj, .ply, .stl, .gltf or .glb, or a .rpk scene file
    scene: PathBuf,
    #[command(flatten)]
    looks: LooksOptions,
    /// The camera, as eye=X,Y,Z;at=X,Y,Z;up=X,Y,Z;fov=DEG or a TOML file; without it the scene is framed
    #[arg(long, allow_hyphen_values = true)]
    camera: Option<String>,
    #[command(flatten)]
    build: BuildOptions,
    #[command(flatten)]
    json: Json,
}

#[derive(Debug, Serialize)]
struct Report<'a> {
    engine: Engine,
    model: &'a str,
    effects: &'a [Call],
    /// Samples per pixel, at most, that `render` would take.
    samples: u32,
    /// Pictures on surfaces that were opened, and the bytes that they take up.
    textures: usize,
    texture_bytes: usize,
    /// Pictures that could not be.
    problems: Vec<String>,
}

/// Runs the command.
pub fn run(args: &Args) -> Result<()> {
    let isa = Isa::from_env()?;
    args.looks.check()?;
    args.json.check()?;
    let profile = args.build.profile_for(Some(&args.scene), false)?;
    let camera = args.camera.as_deref().map(Camera::parse).transpose()?;
    let scene = Scene::prepare(&args.scene, &args.build, &profile.build, isa)?;
    let camera = camera.unwrap_or_else(|| Camera::framing(&scene.accel.bounds(), 1.0));
    camera.check()?;
    match &scene.looks {
        Looks::Mesh(mesh) => args.report(&scene, mesh, &camera),
        Looks::Stored(stored) => args.report(&scene, stored, &camera),
        Looks::Cached(cached) => args.report(&scene, cached, &camera),
    }
}

impl Args {
    fn report(&self, scene: &Scene, surface: &impl Surface, camera: &Camera) -> Result<()> {
        let lighting = Lighting::for_view(camera, &scene.accel);
        let staged = self.looks.stage(scene, surface, camera, lighting, (None, true))?;
        let textures = staged.appearance.as_ref().map(|appearance| &appearance.textures);
        let report = Report {
            engine: ENGINE,
            model: &scene.name,
            effects: &staged.analysis.effects,
            samples: staged.samples,
            textures: textures.map_or(0, |textures| textures.len()),
            texture_bytes: textures.map_or(0, |textures| textures.bytes()),
            problems: staged.problems.iter().map(ToString::to_string).collect(),
        };
        let mut lines = Lines::default();
        lines.add("model", &scene.name);
        for call in &staged.analysis.effects {
            let state = if call.on { "on" } else { "off" };
            lines.add("effect", format!("{:<18} {state:<4} {}", call.name, callers(call)));
        }
        lines.add("samples", format!("{} per pixel at most", staged.samples));
        self.json.give(lines.text(), &report)
    }
}
