//! obvhs as an engine: two trees, two build presets, one ray at a time.

use super::engine::{Contender, Engine, Lot, Results, collect};
use crate::geometry::{Hit, Ray};
use crate::mesh::Mesh;
use crate::study::peers::obvhs::{ALL, COMPILED_FOR, Layout, Prepared, Preset, Scene, VERSION};
use std::sync::Arc;

/// obvhs with its four trees built.
pub struct Obvhs {
    scenes: Vec<(Layout, Preset, Scene)>,
}

impl Obvhs {
    /// One tree, already built.
    pub fn of_scene(layout: Layout, preset: Preset, scene: Scene) -> Self {
        Self { scenes: vec![(layout, preset, scene)] }
    }

    /// Builds every tree.
    pub fn new(mesh: &Mesh) -> Self {
        let build = |(layout, preset)| (layout, preset, Scene::new(mesh, layout, preset));
        Self { scenes: ALL.map(build).into() }
    }
}

impl Engine for Obvhs {
    fn name(&self) -> &'static str {
        "obvhs"
    }

    fn version(&self) -> String {
        VERSION.into()
    }

    /// What the binary was compiled for: obvhs does not choose at run time.
    fn isa(&self) -> String {
        format!("{COMPILED_FOR} (compiled in)")
    }

    fn contenders<'a>(&'a self, rays: &[Ray], any_hit: bool) -> Vec<Box<dyn Contender + 'a>> {
        let lots = Arc::new(Lot::cut(rays, any_hit, Hit::MISS, |n| n, Prepared::new));
        let run = |(layout, preset, scene): &'a (Layout, Preset, Scene)| {
            let mode = format!("{} {}", layout.name(), preset.name());
            Box::new(Run { mode, scene, lots: Arc::clone(&lots) }) as Box<dyn Contender>
        };
        self.scenes.iter().map(run).collect()
    }
}

struct Run<'a> {
    mode: String,
    scene: &'a Scene,
    lots: Arc<Vec<Lot<Prepared, Hit, bool>>>,
}

impl Contender for Run<'_> {
    fn mode(&self) -> String {
        self.mode.clone()
    }

    fn build_seconds(&self) -> f64 {
        self.scene.build_seconds()
    }

    fn bytes(&self) -> u64 {
        self.scene.bytes()
    }

    fn fetch(&self, chunk: usize) {
        self.lots[chunk].fetch(Prepared::as_slice);
    }

    fn trace(&self, chunk: usize) {
        self.lots[chunk]
            .trace(|rays, hits| self.scene.closest(rays, hits), |rays, flags| self.scene.any(rays, flags));
    }

    fn results(&self) -> Results {
        collect(&self.lots, |hits, _, all| all.extend(hits), |flags, _, all| all.extend(flags))
    }
}
