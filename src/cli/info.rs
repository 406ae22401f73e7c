//! `raypack info SCENE`: what is in a model or a scene file, and what its tree is like.

mod file;
mod surfaces;

use super::histogram::{bars, decades};
use super::options::BuildOptions;
use super::report::{ENGINE, Engine, Json, Lines, bytes, counted, grouped};
use super::scene::{Scene, SceneReport};
use crate::error::{Error, Result};
use crate::geometry::Hit;
use crate::kdtree::TreeStats;
use crate::mesh::{Attributes, Mesh, Shapes};
use crate::scene::Camera;
use crate::simd::Isa;
use crate::study::bench::build::count::{Counts, count};
use crate::study::rays::{RayKind, RaySets, Setup};
use file::FileReport;
use serde::Serialize;
use std::path::PathBuf;
use surfaces::ColorReport;

/// Say what is in a model or a scene file, and what its tree is like
#[derive(Clone, Debug, clap::Args)]
pub struct Args {
    /// The model: .obj, .ply, .stl, .gltf or .glb, or a .rpk scene file
    model: PathBuf,
    /// Check every checksum of a scene file
    #[arg(long)]
    verify: bool,
    /// Prove that the tree is whole: every triangle is found in every leaf that it overlaps
    #[arg(long)]
    validate: bool,
    #[command(flatten)]
    build: BuildOptions,
    #[command(flatten)]
    json: Json,
}

#[derive(Debug, Serialize)]
struct Report<'a> {
    engine: Engine,
    #[serde(flatten)]
    scene: SceneReport<'a>,
    colors: ColorReport<'a>,
    /// What is in a scene file; `None` for a model.
    file: Option<FileReport<'a>>,
    memory: Memory,
    shapes: Shapes,
    /// What a random ray through the bounds did, on average.
    random_rays: Counts,
    /// `true` if the tree was validated; it is an error if it is not valid.
    validated: bool,
}

/// Bytes by part.
#[derive(Debug, Serialize)]
struct Memory {
    positions: usize,
    indices: usize,
    /// With materials, and pictures that are not in files of their own.
    colors: usize,
    /// Texture coordinates and normals.
    attributes: usize,
    tree_nodes: usize,
    tree_references: usize,
    tree_triangles: usize,
    total: usize,
}

/// Runs the command.
pub fn run(args: &Args) -> Result<()> {
    let isa = Isa::from_env()?;
    let profile = args.build.profile_for(Some(&args.model), false)?;
    args.json.check()?;
    let file = file::open(&args.model, args.verify)?;
    let (scene, copy) = match &file {
        Some(file) => (Scene::open(file, isa)?, Some(file.mesh()?)),
        None => (Scene::prepare(&args.model, &args.build, &profile.build, isa)?, None),
    };
    let mesh = copy.as_ref().or(scene.mesh()).expect("what no scene file holds was built of its mesh");
    if args.validate {
        let fault = |fault| Error::malformed(&args.model, format!("its tree is broken: {fault}"));
        scene.accel.tree().validate().map_err(fault)?;
    }
    let duplication = scene.accel.tree().duplication();
    let report = Report {
        engine: ENGINE,
        scene: scene.report().with_duplication(&duplication),
        colors: ColorReport::new(mesh),
        file: file.as_ref().map(|file| FileReport::new(file, args.verify)),
        memory: memory(mesh, &scene.tree),
        shapes: Shapes::of(mesh),
        random_rays: random_rays(&scene, mesh),
        validated: args.validate,
    };
    args.json.give(&text(&scene, &report, &duplication), &report)
}

/// Random rays are as many as a square image of this side has pixels.
const RANDOM_SIDE: u32 = 256;

/// Traces random rays through the bounds and counts what they do.
fn random_rays(scene: &Scene, mesh: &Mesh) -> Counts {
    let bounds = scene.accel.bounds();
    let setup = Setup::new(Camera::framing(&bounds, 1.0), RANDOM_SIDE, bounds, 1);
    let sets = RaySets::new(setup, mesh, |rays| vec![Hit::MISS; rays.len()]);
    count(&scene.accel, &sets.rays(RayKind::Random))
}

fn memory(mesh: &Mesh, tree: &TreeStats) -> Memory {
    let positions = size_of_val(&mesh.positions[..]);
    let indices = size_of_val(&mesh.triangles[..]);
    let attributes = mesh.attributes.len() * size_of::<Attributes>();
    let mut memory = Memory {
        positions,
        indices,
        colors: mesh.bytes().saturating_sub(positions + indices + attributes),
        attributes,
        tree_nodes: tree.node_bytes,
        tree_references: tree.reference_bytes,
        tree_triangles: tree.triangle_bytes,
        total: 0,
    };
    memory.total = mesh.bytes() + tree.bytes();
    memory
}

fn text(scene: &Scene, report: &Report<'_>, duplication: &[usize]) -> String {
    let mut lines = Lines::default();
    scene.describe(&mut lines);
    let tree = &scene.tree;
    lines.add(
        "leaves",
        format!(
            "{} empty, {:.2} triangles in the others on average, {} at most",
            grouped(tree.empty_leaves as u64),
            tree.triangles_per_leaf,
            tree.largest_leaf
        ),
    );
    lines.add(
        "a ray",
        format!(
            "that meets the bounds is expected to take {:.1} steps, {:.1} leaves and {:.1} triangle tests, were \
             there nothing to hit",
            tree.expected_steps, tree.expected_leaves, tree.expected_tests
        ),
    );
    let random = &report.random_rays;
    lines.add(
        "",
        format!(
            "and random ones that begin inside took {:.1}, {:.1} and {:.1} up to their hits",
            random.steps, random.leaves, random.tests
        ),
    );
    let numbered = |first: usize| move |i: usize| (i + first).to_string();
    bars(&mut lines, "leaf size", "leaves", &tree.leaf_histogram, numbered(0));
    bars(&mut lines, "depth", "leaves", &tree.depth_histogram, numbered(0));
    bars(&mut lines, "in leaves", "triangles", duplication, numbered(1));
    let shapes = &report.shapes;
    let [by_area, by_aspect] =
        [shapes.by_area, shapes.by_aspect].map(|counts| counts.map(|count| count as usize));
    bars(&mut lines, "area", "triangles, beside the largest", &by_area, |i| decades(-(i as i32)));
    bars(&mut lines, "aspect", "triangles, longest edge beside height", &by_aspect, |i| {
        decades(i as i32 + 1)
    });
    if shapes.without_area > 0 {
        lines.add("", format!("{} without area", counted(shapes.without_area, "triangle")));
    }
    let bounds = scene.accel.bounds();
    let (low, high, extent) = (bounds.min, bounds.max, bounds.extent());
    lines.add(
        "bounds",
        format!(
            "{},{},{} to {},{},{}; extent {} x {} x {}",
            low.x, low.y, low.z, high.x, high.y, high.z, extent.x, extent.y, extent.z
        ),
    );
    report.colors.describe(&mut lines);
    let memory = &report.memory;
    let part = |amount: usize| bytes(amount as u64);
    lines.add(
        "memory",
        format!(
            "{}: positions {}, indices {}, colors {}, attributes {}, tree nodes {}, references {}, triangles {}",
            part(memory.total),
            part(memory.positions),
            part(memory.indices),
            part(memory.colors),
            part(memory.attributes),
            part(memory.tree_nodes),
            part(memory.tree_references),
            part(memory.tree_triangles)
        ),
    );
    if let Some(file) = &report.file {
        file.describe(&mut lines);
    }
    if report.validated {
        lines.add("valid", "every triangle is found in every leaf that it overlaps");
    }
    lines.text().to_owned()
}
